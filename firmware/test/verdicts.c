/* SPDX-License-Identifier: Apache-2.0 */
/* Reads frames from stdin (u16 little-endian length, then that many bytes, without delimiter), writes one byte each: what
   pneumo_decode() says. For a frame it accepts, encodes the record again and reports 255 if that gives other bytes after decoding. */
#include <stdio.h>
#include <string.h>

#include "pneumo/frame.h"

static int survives_round_trip(const struct pneumo_record *record) {
    uint8_t first[PNEUMO_WIRE_SIZE], second[PNEUMO_WIRE_SIZE];
    struct pneumo_record again;
    size_t count = pneumo_encode(record, first);
    return pneumo_decode(first, count - 1, &again) == PNEUMO_OK && pneumo_encode(&again, second) == count &&
           memcmp(first, second, count) == 0;
}

int main(void) {
    static uint8_t frame[65536];
    uint8_t head[2];
    while (fread(head, 1, 2, stdin) == 2) {
        size_t count = (size_t)head[0] | (size_t)head[1] << 8;
        struct pneumo_record record;
        if (fread(frame, 1, count, stdin) != count)
            return 1;
        enum pneumo_result result = pneumo_decode(frame, count, &record);
        putchar(result == PNEUMO_OK && !survives_round_trip(&record) ? 255 : (int)result);
    }
    return fflush(stdout) == 0 ? 0 : 1;
}
