/* SPDX-License-Identifier: Apache-2.0 */
#include "pneumo/frame.h"

#include <string.h>

#define HEADER 2u
#define CRC 2u
#define INPUT_SIZE 9u
#define OUTPUT_SIZE 11u
#define HELLO_FIXED 45u

/* A cursor over little-endian bytes: the wire's layout never depends on the compiler's. */
struct writer {
    uint8_t *at;
};

struct reader {
    const uint8_t *at;
};

static void put8(struct writer *w, uint8_t v) { *w->at++ = v; }

static void put16(struct writer *w, uint16_t v) {
    put8(w, (uint8_t)(v & 0xFFu));
    put8(w, (uint8_t)(v >> 8));
}

static void put32(struct writer *w, uint32_t v) {
    put16(w, (uint16_t)(v & 0xFFFFu));
    put16(w, (uint16_t)(v >> 16));
}

static uint8_t get8(struct reader *r) { return *r->at++; }

static uint16_t get16(struct reader *r) {
    uint16_t low = get8(r);
    return (uint16_t)(low | ((uint16_t)get8(r) << 8));
}

static uint32_t get32(struct reader *r) {
    uint32_t low = get16(r);
    return low | ((uint32_t)get16(r) << 16);
}

static int32_t get32s(struct reader *r) {
    uint32_t v = get32(r);
    /* Two's complement without the implementation-defined conversion of large unsigned values. */
    return v <= 0x7FFFFFFFu ? (int32_t)v : -(int32_t)(0xFFFFFFFFu - v) - 1;
}

uint16_t pneumo_crc16(const uint8_t *bytes, size_t count) {
    uint16_t crc = 0xFFFFu;
    for (size_t i = 0; i < count; ++i) {
        crc = (uint16_t)(crc ^ ((uint16_t)bytes[i] << 8));
        for (int bit = 0; bit < 8; ++bit)
            crc = (uint16_t)(((unsigned)crc << 1) ^ ((crc & 0x8000u) ? 0x1021u : 0u));
    }
    return crc;
}

static size_t stuff(const uint8_t *data, size_t count, uint8_t *out) {
    size_t code_at = 0, to = 1;
    uint8_t code = 1;
    for (size_t i = 0; i < count; ++i) {
        if (data[i] == 0) {
            out[code_at] = code;
            code_at = to++;
            code = 1;
            continue;
        }
        out[to++] = data[i];
        if (++code == 0xFF && i + 1 < count) {
            out[code_at] = code;
            code_at = to++;
            code = 1;
        }
    }
    out[code_at] = code;
    return to;
}

/* Returns the number of decoded bytes, or -1 if the stuffing is wrong. */
static int unstuff(const uint8_t *frame, size_t count, uint8_t *out) {
    size_t from = 0, to = 0;
    while (from < count) {
        uint8_t code = frame[from++];
        if (code == 0 || (size_t)(code - 1u) > count - from)
            return -1;
        for (uint8_t i = 1; i < code; ++i) {
            if (frame[from] == 0)
                return -1;
            out[to++] = frame[from++];
        }
        if (code < 0xFF && from < count)
            out[to++] = 0;
    }
    return (int)to;
}

static void put_hello(struct writer *w, const struct pneumo_hello *h) {
    put32(w, h->nonce);
    put32(w, h->boot_id);
    put32(w, h->session);
    put32(w, h->device_us);
    put32(w, h->sample_period_us);
    put32(w, h->watchdog_us);
    for (int i = 0; i < 3; ++i)
        put8(w, h->firmware[i]);
    put8(w, h->adc_bits);
    put8(w, h->dac_bits);
    for (int i = 0; i < PNEUMO_SERIAL_SIZE; ++i)
        put8(w, (uint8_t)h->serial_number[i]);
    for (int i = 0; i < PNEUMO_INPUTS; ++i) {
        put8(w, h->inputs[i].channel);
        put32(w, (uint32_t)h->inputs[i].min_uv);
        put32(w, (uint32_t)h->inputs[i].max_uv);
    }
    for (int i = 0; i < PNEUMO_OUTPUTS; ++i) {
        put8(w, h->outputs[i].valve);
        put32(w, (uint32_t)h->outputs[i].min_uv);
        put32(w, (uint32_t)h->outputs[i].max_uv);
        put16(w, h->outputs[i].safe);
    }
}

static void put_sample(struct writer *w, const struct pneumo_sample *s) {
    put32(w, s->session);
    put32(w, s->sequence);
    put32(w, s->device_us);
    put8(w, s->state);
    put8(w, s->flags);
    for (int i = 0; i < PNEUMO_INPUTS; ++i)
        put32(w, (uint32_t)s->counts[i]);
}

static void put_command(struct writer *w, const struct pneumo_command *c) {
    put32(w, c->session);
    put32(w, c->sequence);
    put32(w, c->sample);
    put8(w, c->flags);
    for (int i = 0; i < PNEUMO_OUTPUTS; ++i)
        put16(w, c->counts[i]);
}

static void put_status(struct writer *w, const struct pneumo_status *s) {
    put32(w, s->session);
    put32(w, s->device_us);
    put8(w, s->state);
    put8(w, s->fault);
    put8(w, s->flags);
    put32(w, s->command_sequence);
    put32(w, s->command_us);
    put32(w, s->good_frames);
    put32(w, s->bad_frames);
    put32(w, s->refused_commands);
    for (int i = 0; i < PNEUMO_OUTPUTS; ++i)
        put16(w, s->counts[i]);
    put8(w, 0);
}

size_t pneumo_encode(const struct pneumo_record *record, uint8_t wire[PNEUMO_WIRE_SIZE]) {
    uint8_t payload[PNEUMO_MAX_FRAME];
    struct writer w = {payload};
    put8(&w, PNEUMO_PROTOCOL_VERSION);
    put8(&w, (uint8_t)record->kind);
    switch (record->kind) {
    case PNEUMO_HELLO_REQUEST: put32(&w, record->as.hello_request.nonce); break;
    case PNEUMO_HELLO: put_hello(&w, &record->as.hello); break;
    case PNEUMO_SAMPLE: put_sample(&w, &record->as.sample); break;
    case PNEUMO_COMMAND: put_command(&w, &record->as.command); break;
    case PNEUMO_STATUS: put_status(&w, &record->as.status); break;
    default: return 0;
    }
    put16(&w, pneumo_crc16(payload, (size_t)(w.at - payload)));
    size_t count = stuff(payload, (size_t)(w.at - payload), wire);
    wire[count] = 0;
    return count + 1;
}

static enum pneumo_result get_hello_request(struct reader *r, struct pneumo_hello_request *q) {
    q->nonce = get32(r);
    return q->nonce == 0 ? PNEUMO_VALUE : PNEUMO_OK;
}

/* Printable ASCII, then only zeros. */
static int is_name(const char *name) {
    int end = PNEUMO_SERIAL_SIZE;
    while (end > 0 && name[end - 1] == 0)
        --end;
    for (int i = 0; i < end; ++i)
        if (name[i] < 0x20 || name[i] > 0x7E)
            return 0;
    return 1;
}

static enum pneumo_result get_hello(struct reader *r, struct pneumo_hello *h) {
    h->nonce = get32(r);
    h->boot_id = get32(r);
    h->session = get32(r);
    h->device_us = get32(r);
    h->sample_period_us = get32(r);
    h->watchdog_us = get32(r);
    for (int i = 0; i < 3; ++i)
        h->firmware[i] = get8(r);
    h->adc_bits = get8(r);
    h->dac_bits = get8(r);
    memcpy(h->serial_number, r->at, PNEUMO_SERIAL_SIZE);
    r->at += PNEUMO_SERIAL_SIZE;
    for (int i = 0; i < PNEUMO_INPUTS; ++i) {
        h->inputs[i].channel = get8(r);
        h->inputs[i].min_uv = get32s(r);
        h->inputs[i].max_uv = get32s(r);
    }
    for (int i = 0; i < PNEUMO_OUTPUTS; ++i) {
        h->outputs[i].valve = get8(r);
        h->outputs[i].min_uv = get32s(r);
        h->outputs[i].max_uv = get32s(r);
        h->outputs[i].safe = get16(r);
    }
    int widths = h->adc_bits >= 8 && h->adc_bits <= 32 && h->dac_bits >= 8 && h->dac_bits <= 16;
    return widths && is_name(h->serial_number) ? PNEUMO_OK : PNEUMO_VALUE;
}

static enum pneumo_result get_sample(struct reader *r, struct pneumo_sample *s) {
    s->session = get32(r);
    s->sequence = get32(r);
    s->device_us = get32(r);
    s->state = get8(r);
    s->flags = get8(r);
    for (int i = 0; i < PNEUMO_INPUTS; ++i)
        s->counts[i] = get32s(r);
    return s->state <= PNEUMO_ESTOP && s->flags <= 3 ? PNEUMO_OK : PNEUMO_VALUE;
}

static enum pneumo_result get_command(struct reader *r, struct pneumo_command *c) {
    c->session = get32(r);
    c->sequence = get32(r);
    c->sample = get32(r);
    c->flags = get8(r);
    for (int i = 0; i < PNEUMO_OUTPUTS; ++i)
        c->counts[i] = get16(r);
    return c->flags <= 7 ? PNEUMO_OK : PNEUMO_VALUE;
}

static enum pneumo_result get_status(struct reader *r, struct pneumo_status *s) {
    s->session = get32(r);
    s->device_us = get32(r);
    s->state = get8(r);
    s->fault = get8(r);
    s->flags = get8(r);
    s->command_sequence = get32(r);
    s->command_us = get32(r);
    s->good_frames = get32(r);
    s->bad_frames = get32(r);
    s->refused_commands = get32(r);
    for (int i = 0; i < PNEUMO_OUTPUTS; ++i)
        s->counts[i] = get16(r);
    int lists = s->state <= PNEUMO_ESTOP && s->fault <= PNEUMO_FAULT_HOST_DISARMED && s->flags <= 3;
    return lists && get8(r) == 0 ? PNEUMO_OK : PNEUMO_VALUE;
}

static size_t body_size(uint8_t kind) {
    switch (kind) {
    case PNEUMO_HELLO_REQUEST: return 4;
    case PNEUMO_HELLO: return HELLO_FIXED + PNEUMO_INPUTS * INPUT_SIZE + PNEUMO_OUTPUTS * OUTPUT_SIZE;
    case PNEUMO_SAMPLE: return 14 + 4 * PNEUMO_INPUTS;
    case PNEUMO_COMMAND: return 13 + 2 * PNEUMO_OUTPUTS;
    case PNEUMO_STATUS: return 32 + 2 * PNEUMO_OUTPUTS;
    default: return 0;
    }
}

static enum pneumo_result get_record(const uint8_t *payload, size_t count, struct pneumo_record *record) {
    uint8_t kind = payload[1];
    size_t size = body_size(kind);
    if (size == 0)
        return PNEUMO_KIND;
    if (count != HEADER + size)
        return PNEUMO_LENGTH;
    record->kind = (enum pneumo_kind)kind;
    struct reader r = {payload + HEADER};
    switch (kind) {
    case PNEUMO_HELLO_REQUEST: return get_hello_request(&r, &record->as.hello_request);
    case PNEUMO_HELLO: return get_hello(&r, &record->as.hello);
    case PNEUMO_SAMPLE: return get_sample(&r, &record->as.sample);
    case PNEUMO_COMMAND: return get_command(&r, &record->as.command);
    default: return get_status(&r, &record->as.status);
    }
}

enum pneumo_result pneumo_decode(const uint8_t *frame, size_t count, struct pneumo_record *record) {
    uint8_t data[PNEUMO_MAX_FRAME];
    if (count > PNEUMO_MAX_FRAME)
        return PNEUMO_OVERLONG;
    int decoded = unstuff(frame, count, data);
    if (decoded < 0)
        return PNEUMO_COBS;
    if (decoded < (int)(HEADER + CRC))
        return PNEUMO_SHORT;
    size_t payload = (size_t)decoded - CRC;
    struct reader r = {data + payload};
    if (get16(&r) != pneumo_crc16(data, payload))
        return PNEUMO_CRC;
    if (data[0] != PNEUMO_PROTOCOL_VERSION)
        return PNEUMO_VERSION;
    return get_record(data, payload, record);
}

int pneumo_receive_byte(struct pneumo_receiver *receiver, uint8_t byte, enum pneumo_result *result,
                        struct pneumo_record *record) {
    if (byte != 0) {
        if (receiver->count < PNEUMO_MAX_FRAME)
            receiver->pending[receiver->count++] = byte;
        else
            receiver->overlong = 1;
        return 0;
    }
    if (receiver->overlong)
        *result = PNEUMO_OVERLONG;
    else if (receiver->count == 0)
        *result = PNEUMO_IDLE;
    else
        *result = pneumo_decode(receiver->pending, receiver->count, record);
    receiver->count = 0;
    receiver->overlong = 0;
    return 1;
}
