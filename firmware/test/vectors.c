/* SPDX-License-Identifier: Apache-2.0 */
/* Runs the shared vectors against the firmware core: vectors FRAMES.txt BEHAVIOUR.txt. Exit code 0 only if all pass. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "pneumo/core.h"

#define LINE 4096
#define VALUES 128

static int failures, checks;

static void check(int ok, const char *file, int line, const char *what) {
    checks++;
    if (ok)
        return;
    failures++;
    fprintf(stderr, "%s:%d: %s\n", file, line, what);
}

static size_t from_hex(const char *text, uint8_t *out) {
    size_t count = 0;
    unsigned byte;
    for (; text[0] && text[1] && sscanf(text, "%2x", &byte) == 1; text += 2)
        out[count++] = (uint8_t)byte;
    return count;
}

static const char *const REASONS[] = {"ok",  "idle",    "overlong", "cobs",   "short",
                                      "crc", "version", "kind",     "length", "value"};

/* ---- frames.txt ---- */

static enum pneumo_result receive_all(const uint8_t *bytes, size_t count, struct pneumo_record *record) {
    static struct pneumo_receiver receiver;
    enum pneumo_result result = PNEUMO_IDLE;
    for (size_t i = 0; i < count; ++i)
        pneumo_receive_byte(&receiver, bytes[i], &result, record);
    return result;
}

static int flatten(const struct pneumo_record *r, long long *out, char *name) {
    int n = 0;
    if (r->kind == PNEUMO_HELLO_REQUEST) {
        out[n++] = r->as.hello_request.nonce;
    } else if (r->kind == PNEUMO_SAMPLE) {
        const struct pneumo_sample *s = &r->as.sample;
        out[n++] = s->session, out[n++] = s->sequence, out[n++] = s->device_us, out[n++] = s->state, out[n++] = s->flags;
        for (int i = 0; i < PNEUMO_INPUTS; ++i)
            out[n++] = s->counts[i];
    } else if (r->kind == PNEUMO_COMMAND) {
        const struct pneumo_command *c = &r->as.command;
        out[n++] = c->session, out[n++] = c->sequence, out[n++] = c->sample, out[n++] = c->flags;
        for (int i = 0; i < PNEUMO_OUTPUTS; ++i)
            out[n++] = c->counts[i];
    } else if (r->kind == PNEUMO_STATUS) {
        const struct pneumo_status *s = &r->as.status;
        out[n++] = s->session, out[n++] = s->device_us, out[n++] = s->state, out[n++] = s->fault, out[n++] = s->flags;
        out[n++] = s->command_sequence, out[n++] = s->command_us, out[n++] = s->good_frames;
        out[n++] = s->bad_frames, out[n++] = s->refused_commands;
        for (int i = 0; i < PNEUMO_OUTPUTS; ++i)
            out[n++] = s->counts[i];
    } else {
        const struct pneumo_hello *h = &r->as.hello;
        out[n++] = h->nonce, out[n++] = h->boot_id, out[n++] = h->session, out[n++] = h->device_us, out[n++] = h->sample_period_us;
        out[n++] = h->watchdog_us;
        for (int i = 0; i < 3; ++i)
            out[n++] = h->firmware[i];
        out[n++] = h->adc_bits, out[n++] = h->dac_bits;
        memcpy(name, h->serial_number, PNEUMO_SERIAL_SIZE);
        name[PNEUMO_SERIAL_SIZE] = 0;
        for (int i = 0; i < PNEUMO_INPUTS; ++i)
            out[n++] = h->inputs[i].channel, out[n++] = h->inputs[i].min_uv, out[n++] = h->inputs[i].max_uv;
        for (int i = 0; i < PNEUMO_OUTPUTS; ++i) {
            out[n++] = h->outputs[i].valve, out[n++] = h->outputs[i].min_uv, out[n++] = h->outputs[i].max_uv;
            out[n++] = h->outputs[i].safe;
        }
    }
    return n;
}

/* "name=1,2,3 other=4" -> 1 2 3 4; a serial number is text. */
static int parse_fields(char *text, long long *out, char *name) {
    int n = 0;
    for (char *token = strtok(text, " \n"); token; token = strtok(NULL, " \n")) {
        char *value = strchr(token, '=') + 1;
        if (strncmp(token, "serial_number=", 14) == 0) {
            strcpy(name, value);
            continue;
        }
        for (char *end = value; *value; value = *end ? end + 1 : end)
            out[n++] = strtoll(value, &end, 10);
    }
    return n;
}

static void check_good(const char *file, int line, const uint8_t *bytes, size_t count, char *fields) {
    struct pneumo_record record;
    long long got[VALUES], want[VALUES];
    char got_name[VALUES] = "", want_name[VALUES] = "";
    uint8_t wire[PNEUMO_WIRE_SIZE];
    check(receive_all(bytes, count, &record) == PNEUMO_OK, file, line, "not accepted");
    int n = flatten(&record, got, got_name), m = parse_fields(fields, want, want_name);
    check(n == m && memcmp(got, want, (size_t)n * sizeof *got) == 0, file, line, "fields differ");
    check(strcmp(got_name, want_name) == 0, file, line, "serial number differs");
    check(pneumo_encode(&record, wire) == count && memcmp(wire, bytes, count) == 0, file, line, "encoding differs");
}

static void run_frames(const char *file) {
    static char text[LINE], hex[LINE], rest[LINE];
    uint8_t bytes[LINE];
    struct pneumo_record record;
    FILE *stream = fopen(file, "r");
    if (!stream)
        exit(2);
    for (int line = 1; fgets(text, LINE, stream); ++line) {
        char verdict[8], kind[16];
        int used = 0;
        if (text[0] == '#' || sscanf(text, "%7s %4095s %15s%n", verdict, hex, kind, &used) != 3)
            continue;
        size_t count = from_hex(hex, bytes);
        strcpy(rest, text + used);
        if (strcmp(verdict, "good") == 0)
            check_good(file, line, bytes, count, rest);
        else
            check(strcmp(REASONS[receive_all(bytes, count, &record)], kind) == 0, file, line, "another reason");
    }
    fclose(stream);
}

/* ---- behaviour.txt ---- */

struct board {
    struct pneumo_core core;
    uint32_t time;
    bool estop, converter_fails;
    uint16_t outputs[PNEUMO_OUTPUTS];
    uint8_t sent[LINE];
    size_t sent_count;
};

static uint32_t board_micros(void *context) { return ((struct board *)context)->time; }

static bool board_read(void *context, int32_t counts[PNEUMO_INPUTS]) {
    for (int i = 0; i < PNEUMO_INPUTS; ++i)
        counts[i] = 11 + i;
    return !((struct board *)context)->converter_fails;
}

static void board_write(void *context, const uint16_t counts[PNEUMO_OUTPUTS]) {
    memcpy(((struct board *)context)->outputs, counts, PNEUMO_OUTPUTS * sizeof counts[0]);
}

static bool board_estop(void *context) { return ((struct board *)context)->estop; }

static void board_send(void *context, const uint8_t *bytes, size_t count) {
    struct board *board = context;
    if (board->sent_count + count > sizeof board->sent)
        board->sent_count = 0; /* nobody asked for this much; keep the newest */
    memcpy(board->sent + board->sent_count, bytes, count);
    board->sent_count += count;
}

static void boot(struct board *board, const struct pneumo_hello *identity) {
    memset(board, 0, sizeof *board);
    struct pneumo_hal hal = {board, board_micros, board_read, board_write, board_estop, board_send};
    pneumo_core_boot(&board->core, &hal, identity);
}

static void check_expect(const char *file, int line, const struct board *board, const char *text) {
    unsigned long want[9];
    const struct pneumo_core *core = &board->core;
    int n = sscanf(text, "expect %lu %lu %lu %lu %lu %lu %lu %lu %lu", want, want + 1, want + 2, want + 3, want + 4,
                   want + 5, want + 6, want + 7, want + 8);
    check(n == 9, file, line, "nine values expected");
    check(want[0] == (unsigned long)core->state, file, line, "state differs");
    check(want[1] == (unsigned long)core->fault, file, line, "fault differs");
    for (int i = 0; i < PNEUMO_OUTPUTS; ++i)
        check(want[2 + i] == board->outputs[i], file, line, "outputs differ");
    check(want[6] == core->good_frames, file, line, "good frames differ");
    check(want[7] == core->bad_frames, file, line, "bad frames differ");
    check(want[8] == core->refused_commands, file, line, "refused commands differ");
}

static void step(const char *file, int line, struct board *board, const char *text) {
    static char hex[LINE];
    static uint8_t bytes[LINE];
    unsigned value;
    if (sscanf(text, "rx %u %4095s", &value, hex) == 2) {
        board->time = value;
        pneumo_core_receive(&board->core, bytes, from_hex(hex, bytes));
    } else if (sscanf(text, "tick %u", &value) == 1) {
        board->time = value;
        board->converter_fails = strstr(text, "fail") != NULL;
        pneumo_core_tick(&board->core);
    } else if (sscanf(text, "estop %u", &value) == 1) {
        board->estop = value != 0;
    } else if (sscanf(text, "sent %4095s", hex) == 1) {
        size_t count = from_hex(hex, bytes);
        check(count == board->sent_count && memcmp(bytes, board->sent, count) == 0, file, line, "sent bytes differ");
        board->sent_count = 0;
    } else if (strncmp(text, "expect", 6) == 0) {
        check_expect(file, line, board, text);
    } else {
        check(0, file, line, "unknown step");
    }
}

static void run_behaviour(const char *file) {
    static char text[LINE], hex[LINE];
    static struct board board;
    struct pneumo_record identity;
    uint8_t bytes[LINE];
    FILE *stream = fopen(file, "r");
    if (!stream)
        exit(2);
    for (int line = 1; fgets(text, LINE, stream); ++line) {
        if (text[0] == '#')
            continue;
        if (sscanf(text, "identity %4095s", hex) == 1)
            check(receive_all(bytes, from_hex(hex, bytes), &identity) == PNEUMO_OK, file, line, "identity");
        else if (strncmp(text, "case", 4) == 0)
            boot(&board, &identity.as.hello);
        else
            step(file, line, &board, text);
    }
    fclose(stream);
}

int main(int argc, char **argv) {
    if (argc != 3)
        return 2;
    check(pneumo_crc16((const uint8_t *)"123456789", 9) == 0x29B1, "crc", 0, "check value");
    run_frames(argv[1]);
    run_behaviour(argv[2]);
    printf("%d checks, %d failures\n", checks, failures);
    return failures == 0 && checks > 100 ? 0 : 1;
}
