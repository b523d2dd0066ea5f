/* SPDX-License-Identifier: Apache-2.0 */
#include "cable.h"

#include "../core/console/improv.h"

bool cable_put(struct cable_ring *ring, uint8_t byte)
{
    size_t in = atomic_load_explicit(&ring->in, memory_order_relaxed);

    if (in - atomic_load_explicit(&ring->out, memory_order_acquire) == CABLE_RING)
        return false;
    ring->bytes[in % CABLE_RING] = byte;
    atomic_store_explicit(&ring->in, in + 1, memory_order_release);
    return true;
}

bool cable_take(struct cable_ring *ring, uint8_t *byte)
{
    size_t out = atomic_load_explicit(&ring->out, memory_order_relaxed);

    if (out == atomic_load_explicit(&ring->in, memory_order_acquire))
        return false;
    *byte = ring->bytes[out % CABLE_RING];
    atomic_store_explicit(&ring->out, out + 1, memory_order_release);
    return true;
}

size_t cable_read(struct cable *cable, uint8_t *bytes, size_t room)
{
    size_t size = 0;

    while (size < room && cable_take(&cable->in, &bytes[size]))
        size++;
    return size;
}

size_t cable_write(struct cable *cable, const uint8_t *bytes, size_t size)
{
    size_t taken = 0;

    while (taken < size && cable_put(&cable->out, bytes[taken]))
        taken++;
    return taken;
}

void cable_follow(struct cable_place *place, uint8_t byte)
{
    if (place->what == CABLE_PACKET) {
        place->matched++;
        if (place->matched == IMPROV_HEAD)
            place->left = (size_t)byte + 1;
        else if (place->matched > IMPROV_HEAD && --place->left == 0)
            *place = (struct cable_place){CABLE_TEXT, 0, 0};
        return;
    }
    if (byte != improv_start[place->matched])
        place->matched = 0;
    if (byte == improv_start[place->matched] && ++place->matched == IMPROV_START)
        place->what = CABLE_PACKET;
}
