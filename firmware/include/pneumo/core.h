/* SPDX-License-Identifier: Apache-2.0 */
/* The device's behaviour: arming, command watchdog, safe state, e-stop (docs/serial-protocol.md, "What the device does"). */
#ifndef PNEUMO_CORE_H
#define PNEUMO_CORE_H

#include "pneumo/frame.h"
#include "pneumo/hal.h"

#define PNEUMO_STATUS_PERIOD_US 100000u
#define PNEUMO_CONVERTER_FAILURES 5u
#define PNEUMO_SESSION_SPREAD 2654435761u /* Knuth's multiplier: sessions of neighbouring boot ids lie far apart */

struct pneumo_core {
    struct pneumo_hal hal;
    struct pneumo_hello identity; /* what HELLO says; nonce and device_us are filled in when it is sent */
    struct pneumo_receiver receiver;
    enum pneumo_state state;
    enum pneumo_fault fault;
    uint8_t flags;
    bool may_arm;      /* an accepted COMMAND without ARM came since SAFE was entered */
    bool has_sequence; /* a COMMAND was accepted since the handshake */
    uint32_t session; /* another one after every handshake and boot: old frames belong to none */
    uint32_t command_sequence, command_us;
    uint32_t sample_sequence;
    uint32_t status_us;
    uint32_t good_frames, bad_frames, refused_commands;
    uint32_t converter_failures; /* in a row */
    uint16_t outputs[PNEUMO_OUTPUTS];
};

/* Enter SAFE, set the outputs, announce the device with a HELLO of nonce 0. */
void pneumo_core_boot(struct pneumo_core *core, const struct pneumo_hal *hal, const struct pneumo_hello *identity);

/* Bytes from the host, in any portions. */
void pneumo_core_receive(struct pneumo_core *core, const uint8_t *bytes, size_t count);

/* Once every sample period, from a timer interrupt: e-stop input, watchdog, conversion, SAMPLE and STATUS.
   Not re-entrant with pneumo_core_receive(): call that one from the same priority, or mask the timer around it. */
void pneumo_core_tick(struct pneumo_core *core);

#endif
