/* SPDX-License-Identifier: Apache-2.0 */
#include <string.h>

#include "wire.h"
#include "wire_types.h"

struct wire_writer wire_write(uint8_t *buffer, size_t room)
{
    struct wire_writer made = {buffer, room, 0, false};
    return made;
}

struct bytes wire_written(const struct wire_writer *out)
{
    struct bytes made = {out->at, out->full ? 0 : out->size};
    return made;
}

static void put(struct wire_writer *out, const void *bytes, size_t count)
{
    out->full = out->full || out->room - out->size < count;
    if (out->full || count == 0)
        return;
    memcpy(out->at + out->size, bytes, count);
    out->size += count;
}

/* A byte, and a big-endian number of `width` bytes. */
static void put_number(struct wire_writer *out, unsigned head, uint64_t number,
                       size_t width)
{
    uint8_t made[9];
    size_t i;

    made[0] = (uint8_t)head;
    for (i = width; i > 0; i--, number >>= 8)
        made[i] = (uint8_t)(number & 0xFF);
    put(out, made, width + 1);
}

static void put_count(struct wire_writer *out, unsigned fix, unsigned wide, size_t count)
{
    if (count < 16)
        put_number(out, fix | (unsigned)count, 0, 0);
    else
        put_number(out, wide, count, 2);
}

void wire_put_list(struct wire_writer *out, size_t count)
{
    put_count(out, FIXLIST, LIST16, count);
}

void wire_put_map(struct wire_writer *out, size_t count)
{
    put_count(out, FIXMAP, MAP16, count);
}

void wire_put_whole(struct wire_writer *out, uint64_t number)
{
    unsigned step = 0; /* of the widths 1, 2, 4, 8 */

    if (number < FIXMAP) {
        put_number(out, (unsigned)number, 0, 0);
        return;
    }
    while (step < 3 && number >> (8u << step))
        step++;
    put_number(out, UINT8 + step, number, (size_t)1 << step);
}

void wire_put_real(struct wire_writer *out, double number)
{
    uint64_t bits;

    memcpy(&bits, &number, sizeof bits);
    put_number(out, FLOAT64, bits, 8);
}

void wire_put_flag(struct wire_writer *out, bool flag)
{
    put_number(out, flag ? YES : NO, 0, 0);
}

void wire_put_nothing(struct wire_writer *out)
{
    put_number(out, NOTHING, 0, 0);
}

/* The head of `size` bytes, narrow or wide, which are at most 65535. */
static void put_size(struct wire_writer *out, unsigned narrow, size_t size)
{
    bool wide = size > 0xFF;

    put_number(out, narrow + wide, size, wide ? 2 : 1);
}

void wire_put_text(struct wire_writer *out, const char *text)
{
    size_t size = strlen(text);

    if (size < 32)
        put_number(out, FIXTEXT | (unsigned)size, 0, 0);
    else
        put_size(out, TEXT8, size);
    put(out, text, size);
}

void wire_put_bytes(struct wire_writer *out, struct bytes bytes)
{
    put_size(out, BYTES8, bytes.size);
    put(out, bytes.at, bytes.size);
}
