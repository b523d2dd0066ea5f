/* SPDX-License-Identifier: Apache-2.0 */
#include "handover.h"

#include <string.h>

enum { TRIES = 8 };

/* Bytes of the word that begins at `at`. */
static size_t width(size_t size, size_t at)
{
    return size - at < sizeof(uint32_t) ? size - at : sizeof(uint32_t);
}

void handover_write(struct handover *handover, const void *value, size_t size)
{
    uint32_t count = atomic_load_explicit(&handover->count, memory_order_relaxed) + 1;
    _Atomic uint32_t *slot = handover->slots[count & 1];

    /* Who reads a word below reads the count above, too: that its slot is stale. */
    atomic_thread_fence(memory_order_release);
    for (size_t at = 0; at < size; at += sizeof(uint32_t)) {
        uint32_t word = 0;
        memcpy(&word, (const char *)value + at, width(size, at));
        atomic_store_explicit(slot++, word, memory_order_relaxed);
    }
    atomic_store_explicit(&handover->count, count, memory_order_release);
}

static bool copied(const struct handover *handover, uint32_t *words, size_t count)
{
    uint32_t before = atomic_load_explicit(&handover->count, memory_order_acquire);
    const _Atomic uint32_t *slot = handover->slots[before & 1];

    for (size_t i = 0; i < count; i++)
        words[i] = atomic_load_explicit(slot + i, memory_order_relaxed);
    atomic_thread_fence(memory_order_acquire);
    return atomic_load_explicit(&handover->count, memory_order_relaxed) == before;
}

bool handover_read(const struct handover *handover, void *value, size_t size)
{
    uint32_t words[HANDOVER_WORDS];

    for (int i = 0; i < TRIES; i++) {
        if (copied(handover, words, (size + sizeof words[0] - 1) / sizeof words[0])) {
            memcpy(value, words, size);
            return true;
        }
    }
    return false;
}
