/* SPDX-License-Identifier: Apache-2.0 */
/* Frames of the serial protocol: docs/serial-protocol.md, record by record. Portable C99, no allocation, no I/O. */
#ifndef PNEUMO_FRAME_H
#define PNEUMO_FRAME_H

#include <stddef.h>
#include <stdint.h>

#define PNEUMO_PROTOCOL_VERSION 2u
#define PNEUMO_MAX_FRAME 254u /* bytes before the delimiter */
#define PNEUMO_INPUTS 7
#define PNEUMO_OUTPUTS 4
#define PNEUMO_SERIAL_SIZE 16
#define PNEUMO_WIRE_SIZE (PNEUMO_MAX_FRAME + 1u) /* with the delimiter */

enum pneumo_kind {
    PNEUMO_HELLO_REQUEST = 0x01,
    PNEUMO_HELLO = 0x02,
    PNEUMO_SAMPLE = 0x10,
    PNEUMO_COMMAND = 0x20,
    PNEUMO_STATUS = 0x30
};

enum pneumo_state { PNEUMO_SAFE = 0, PNEUMO_ARMED = 1, PNEUMO_ESTOP = 2 };

enum pneumo_fault {
    PNEUMO_FAULT_NONE = 0,
    PNEUMO_FAULT_WATCHDOG = 1,
    PNEUMO_FAULT_ESTOP_COMMAND = 2,
    PNEUMO_FAULT_ESTOP_INPUT = 3,
    PNEUMO_FAULT_CONVERTER = 4,
    PNEUMO_FAULT_HANDSHAKE = 5,
    PNEUMO_FAULT_HOST_DISARMED = 6
};

enum { PNEUMO_FLAG_ESTOP_PRESSED = 1, PNEUMO_FLAG_CONVERTER_FAILED = 2 };
enum { PNEUMO_COMMAND_ARM = 1, PNEUMO_COMMAND_ESTOP = 2, PNEUMO_COMMAND_RESET = 4 };

/* Why a frame was dropped, in the order of the checks; PNEUMO_OK means it was not, PNEUMO_IDLE a lone delimiter. */
enum pneumo_result {
    PNEUMO_OK = 0,
    PNEUMO_IDLE,
    PNEUMO_OVERLONG,
    PNEUMO_COBS,
    PNEUMO_SHORT,
    PNEUMO_CRC,
    PNEUMO_VERSION,
    PNEUMO_KIND,
    PNEUMO_LENGTH,
    PNEUMO_VALUE
};

struct pneumo_hello_request {
    uint32_t nonce;
};

struct pneumo_input_range {
    uint8_t channel;
    int32_t min_uv, max_uv;
};

struct pneumo_output_range {
    uint8_t valve;
    int32_t min_uv, max_uv;
    uint16_t safe;
};

struct pneumo_hello {
    uint32_t nonce, boot_id, session, device_us, sample_period_us, watchdog_us;
    uint8_t firmware[3];
    uint8_t adc_bits, dac_bits;
    char serial_number[PNEUMO_SERIAL_SIZE]; /* filled up with 0, not necessarily terminated */
    struct pneumo_input_range inputs[PNEUMO_INPUTS];
    struct pneumo_output_range outputs[PNEUMO_OUTPUTS];
};

struct pneumo_sample {
    uint32_t session, sequence, device_us;
    uint8_t state, flags;
    int32_t counts[PNEUMO_INPUTS];
};

struct pneumo_command {
    uint32_t session, sequence;
    uint32_t sample; /* one more than the latest SAMPLE the host had: how old the command is */
    uint8_t flags;
    uint16_t counts[PNEUMO_OUTPUTS];
};

struct pneumo_status {
    uint32_t session, device_us;
    uint8_t state, fault, flags;
    uint32_t command_sequence, command_us, good_frames, bad_frames, refused_commands;
    uint16_t counts[PNEUMO_OUTPUTS];
};

struct pneumo_record {
    enum pneumo_kind kind;
    union {
        struct pneumo_hello_request hello_request;
        struct pneumo_hello hello;
        struct pneumo_sample sample;
        struct pneumo_command command;
        struct pneumo_status status;
    } as;
};

/* CRC-16/IBM-3740. */
uint16_t pneumo_crc16(const uint8_t *bytes, size_t count);

/* Encode a record with its delimiter; returns the number of bytes written, 0 if the kind is unknown. */
size_t pneumo_encode(const struct pneumo_record *record, uint8_t wire[PNEUMO_WIRE_SIZE]);

/* Decode one frame given without its delimiter; the record is valid only if PNEUMO_OK is returned. */
enum pneumo_result pneumo_decode(const uint8_t *frame, size_t count, struct pneumo_record *record);

/* Collects a byte stream into frames. All zero is the initial state. */
struct pneumo_receiver {
    uint8_t pending[PNEUMO_MAX_FRAME];
    size_t count;
    int overlong;
};

/* Feed one byte. Returns 1 when it ended a frame: *result then tells what became of it, *record holds it if PNEUMO_OK. */
int pneumo_receive_byte(struct pneumo_receiver *receiver, uint8_t byte, enum pneumo_result *result,
                        struct pneumo_record *record);

#endif
