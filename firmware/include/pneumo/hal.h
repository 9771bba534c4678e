/* SPDX-License-Identifier: Apache-2.0 */
/* What a board must provide. Everything hardware-specific is behind these five calls; the core above is plain C99. */
#ifndef PNEUMO_HAL_H
#define PNEUMO_HAL_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "pneumo/frame.h"

struct pneumo_hal {
    void *context; /* handed back to every call */

    /* Free-running microsecond counter, 32 bits, wrapping. Sampled once a tick, at the instant of conversion. */
    uint32_t (*micros)(void *context);

    /* Latest conversion of all inputs, in HELLO's order; false if the converter did not answer. */
    bool (*read_inputs)(void *context, int32_t counts[PNEUMO_INPUTS]);

    /* Set all outputs at once. Must not block and must not fail silently. */
    void (*write_outputs)(void *context, const uint16_t counts[PNEUMO_OUTPUTS]);

    /* Hardware e-stop input, debounced; true = pressed or wire broken. */
    bool (*estop_pressed)(void *context);

    /* Queue bytes for the host. May drop whole calls when nobody reads; must not block. */
    void (*send)(void *context, const uint8_t *bytes, size_t count);
};

/* A board should also let its hardware watchdog be kicked only from the interrupt that calls pneumo_core_tick(), and wire
   the outputs so that a reset leaves the valves closed: then even a hung processor ends in the safe state. */

#endif
