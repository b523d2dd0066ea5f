/* Handover: what one task says, for another to read. Neither ever waits.
 *
 * A sequence lock with two slots. Its one writer fills the slot that nobody is pointed
 * at, then counts up. A reader takes the other one, and knows by the count whether it
 * was written to meanwhile: only if the writer has gone round, never because the writer
 * was interrupted half-way. So it holds whichever task has the higher priority.
 *
 * Words are of 32 bits, and only loaded and stored: compilers for cores that have no
 * atomic instructions (ESP32-C3, rv32imc) make plain accesses and fences of them, and
 * need no library.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef WOODBOT_HANDOVER_H
#define WOODBOT_HANDOVER_H

#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { HANDOVER_WORDS = 32 }; /* in a slot; a shorter value leaves the rest alone */

struct handover {
    _Atomic uint32_t count; /* how often it was written; odd: slot 1 is the newest */
    _Atomic uint32_t slots[2][HANDOVER_WORDS];
};

/* The writer: `size` bytes, at most 4 * HANDOVER_WORDS, always as many. */
void handover_write(struct handover *handover, const void *value, size_t size);

/* A reader: the newest. False, and nothing read, if the writer was too fast. */
bool handover_read(const struct handover *handover, void *value, size_t size);

#endif
