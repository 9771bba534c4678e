/* SPDX-License-Identifier: Apache-2.0 */
#include "pneumo/core.h"

#include <string.h>

static void send(struct pneumo_core *core, const struct pneumo_record *record) {
    uint8_t wire[PNEUMO_WIRE_SIZE];
    size_t count = pneumo_encode(record, wire);
    core->hal.send(core->hal.context, wire, count);
}

static uint32_t now(const struct pneumo_core *core) { return core->hal.micros(core->hal.context); }

static void set_outputs(struct pneumo_core *core, const uint16_t counts[PNEUMO_OUTPUTS]) {
    memcpy(core->outputs, counts, sizeof core->outputs);
    core->hal.write_outputs(core->hal.context, core->outputs);
}

static void set_safe_outputs(struct pneumo_core *core) {
    uint16_t safe[PNEUMO_OUTPUTS];
    for (int i = 0; i < PNEUMO_OUTPUTS; ++i)
        safe[i] = core->identity.outputs[i].safe;
    set_outputs(core, safe);
}

static void send_status(struct pneumo_core *core, uint32_t time) {
    struct pneumo_record record;
    memset(&record, 0, sizeof record);
    record.kind = PNEUMO_STATUS;
    struct pneumo_status *s = &record.as.status;
    s->session = core->session;
    s->device_us = time;
    s->state = (uint8_t)core->state;
    s->fault = (uint8_t)core->fault;
    s->flags = core->flags;
    s->command_sequence = core->command_sequence;
    s->command_us = core->command_us;
    s->good_frames = core->good_frames;
    s->bad_frames = core->bad_frames;
    s->refused_commands = core->refused_commands;
    memcpy(s->counts, core->outputs, sizeof s->counts);
    core->status_us = time;
    send(core, &record);
}

static void send_hello(struct pneumo_core *core, uint32_t nonce) {
    struct pneumo_record record;
    memset(&record, 0, sizeof record);
    record.kind = PNEUMO_HELLO;
    record.as.hello = core->identity;
    record.as.hello.nonce = nonce;
    record.as.hello.session = core->session;
    record.as.hello.device_us = now(core);
    send(core, &record);
}

/* The outputs come first: whatever happens to the line, the valves are safe. */
static void leave_armed(struct pneumo_core *core, enum pneumo_state to, enum pneumo_fault fault) {
    set_safe_outputs(core);
    core->state = to;
    core->fault = fault;
    core->may_arm = false;
    send_status(core, now(core));
}

static bool is_newer(const struct pneumo_core *core, uint32_t sequence) {
    uint32_t ahead = sequence - core->command_sequence;
    return !core->has_sequence || (ahead != 0 && ahead < 0x80000000u);
}

/* What opens valves or ends a stop answers a sample of just now; what closes them may be of any age. */
static bool is_fresh(const struct pneumo_core *core, const struct pneumo_command *command) {
    if (!(command->flags & (PNEUMO_COMMAND_ARM | PNEUMO_COMMAND_RESET)))
        return true;
    uint64_t behind = (uint32_t)(core->sample_sequence - command->sample);
    return behind * core->identity.sample_period_us <= core->identity.watchdog_us;
}

static bool acceptable(const struct pneumo_core *core, const struct pneumo_command *command) {
    uint32_t top = ((uint32_t)1 << core->identity.dac_bits) - 1u;
    for (int i = 0; i < PNEUMO_OUTPUTS; ++i)
        if (command->counts[i] > top)
            return false;
    return command->session == core->session && is_newer(core, command->sequence) && is_fresh(core, command);
}

static void when_safe(struct pneumo_core *core, const struct pneumo_command *command) {
    if (!(command->flags & PNEUMO_COMMAND_ARM)) {
        core->may_arm = true;
        return;
    }
    if (!core->may_arm || (core->flags & PNEUMO_FLAG_ESTOP_PRESSED) || core->converter_failures > 0)
        return;
    core->may_arm = false;
    core->state = PNEUMO_ARMED;
    set_outputs(core, command->counts);
    send_status(core, now(core));
}

static void when_armed(struct pneumo_core *core, const struct pneumo_command *command) {
    if (command->flags & PNEUMO_COMMAND_ARM)
        set_outputs(core, command->counts);
    else
        leave_armed(core, PNEUMO_SAFE, PNEUMO_FAULT_HOST_DISARMED);
}

static void when_stopped(struct pneumo_core *core, const struct pneumo_command *command) {
    bool reset = (command->flags & PNEUMO_COMMAND_RESET) && !(command->flags & PNEUMO_COMMAND_ARM);
    if (!reset || (core->flags & PNEUMO_FLAG_ESTOP_PRESSED))
        return;
    core->state = PNEUMO_SAFE;
    core->may_arm = false;
    send_status(core, now(core));
}

static void on_command(struct pneumo_core *core, const struct pneumo_command *command) {
    if (!acceptable(core, command)) {
        core->refused_commands++;
        return;
    }
    core->has_sequence = true;
    core->command_sequence = command->sequence;
    core->command_us = now(core);
    if (command->flags & PNEUMO_COMMAND_ESTOP) {
        if (core->state != PNEUMO_ESTOP)
            leave_armed(core, PNEUMO_ESTOP, PNEUMO_FAULT_ESTOP_COMMAND);
    } else if (core->state == PNEUMO_ARMED) {
        when_armed(core, command);
    } else if (core->state == PNEUMO_SAFE) {
        when_safe(core, command);
    } else {
        when_stopped(core, command);
    }
}

static void on_hello_request(struct pneumo_core *core, const struct pneumo_hello_request *request) {
    if (core->state == PNEUMO_ARMED)
        leave_armed(core, PNEUMO_SAFE, PNEUMO_FAULT_HANDSHAKE);
    core->session++;
    core->may_arm = false;
    core->has_sequence = false;
    core->command_sequence = 0;
    send_hello(core, request->nonce);
}

static void on_record(struct pneumo_core *core, const struct pneumo_record *record) {
    core->good_frames++;
    if (record->kind == PNEUMO_COMMAND)
        on_command(core, &record->as.command);
    else if (record->kind == PNEUMO_HELLO_REQUEST)
        on_hello_request(core, &record->as.hello_request);
}

void pneumo_core_boot(struct pneumo_core *core, const struct pneumo_hal *hal, const struct pneumo_hello *identity) {
    memset(core, 0, sizeof *core);
    core->hal = *hal;
    core->identity = *identity;
    core->state = PNEUMO_SAFE;
    core->fault = PNEUMO_FAULT_NONE;
    set_safe_outputs(core);
    core->session = identity->boot_id * PNEUMO_SESSION_SPREAD;
    core->status_us = now(core);
    send_hello(core, 0);
}

void pneumo_core_receive(struct pneumo_core *core, const uint8_t *bytes, size_t count) {
    for (size_t i = 0; i < count; ++i) {
        struct pneumo_record record;
        enum pneumo_result result;
        if (!pneumo_receive_byte(&core->receiver, bytes[i], &result, &record) || result == PNEUMO_IDLE)
            continue;
        if (result == PNEUMO_OK)
            on_record(core, &record);
        else
            core->bad_frames++;
    }
}

static void check_estop_input(struct pneumo_core *core) {
    core->flags &= (uint8_t)~PNEUMO_FLAG_ESTOP_PRESSED;
    if (!core->hal.estop_pressed(core->hal.context))
        return;
    core->flags |= PNEUMO_FLAG_ESTOP_PRESSED;
    if (core->state != PNEUMO_ESTOP)
        leave_armed(core, PNEUMO_ESTOP, PNEUMO_FAULT_ESTOP_INPUT);
}

static void check_watchdog(struct pneumo_core *core, uint32_t time) {
    if (core->state == PNEUMO_ARMED && time - core->command_us > core->identity.watchdog_us)
        leave_armed(core, PNEUMO_SAFE, PNEUMO_FAULT_WATCHDOG);
}

static void send_sample(struct pneumo_core *core, uint32_t time, const int32_t counts[PNEUMO_INPUTS]) {
    struct pneumo_record record;
    memset(&record, 0, sizeof record);
    record.kind = PNEUMO_SAMPLE;
    struct pneumo_sample *s = &record.as.sample;
    s->session = core->session;
    s->sequence = core->sample_sequence++;
    s->device_us = time;
    s->state = (uint8_t)core->state;
    s->flags = core->flags;
    memcpy(s->counts, counts, sizeof s->counts);
    send(core, &record);
}

static void convert(struct pneumo_core *core, int32_t counts[PNEUMO_INPUTS]) {
    core->flags &= (uint8_t)~PNEUMO_FLAG_CONVERTER_FAILED;
    if (core->hal.read_inputs(core->hal.context, counts)) {
        core->converter_failures = 0;
        return;
    }
    memset(counts, 0, PNEUMO_INPUTS * sizeof counts[0]); /* never half a conversion */
    core->flags |= PNEUMO_FLAG_CONVERTER_FAILED;
    core->converter_failures++;
    if (core->state == PNEUMO_ARMED && core->converter_failures >= PNEUMO_CONVERTER_FAILURES)
        leave_armed(core, PNEUMO_SAFE, PNEUMO_FAULT_CONVERTER);
}

void pneumo_core_tick(struct pneumo_core *core) {
    uint32_t time = now(core);
    int32_t counts[PNEUMO_INPUTS] = {0};
    check_estop_input(core);
    check_watchdog(core, time);
    convert(core, counts);
    send_sample(core, time, counts);
    if (time - core->status_us >= PNEUMO_STATUS_PERIOD_US)
        send_status(core, time);
}
