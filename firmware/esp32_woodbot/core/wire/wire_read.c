/* SPDX-License-Identifier: Apache-2.0 */
#include <string.h>

#include "wire.h"
#include "wire_types.h"

struct wire_reader wire_read(struct bytes message)
{
    struct wire_reader made = {message.at, message.size, false};
    return made;
}

bool wire_ended(const struct wire_reader *in)
{
    return !in->wrong && in->left == 0;
}

static uint64_t fail(struct wire_reader *in)
{
    in->wrong = true;
    in->left = 0; /* whoever goes on reads nothing */
    return 0;
}

/* A big-endian number of `width` bytes. */
static uint64_t number(struct wire_reader *in, size_t width)
{
    uint64_t found = 0;

    if (in->left < width)
        return fail(in);
    in->left -= width;
    while (width-- > 0)
        found = found << 8 | *in->at++;
    return found;
}

static void pass(struct wire_reader *in, uint64_t count)
{
    if (in->left < count) {
        fail(in);
        return;
    }
    in->at += (size_t)count;
    in->left -= (size_t)count;
}

static size_t width_of(uint64_t head, unsigned first)
{
    return (size_t)1 << (head - first);
}

static size_t count_of(struct wire_reader *in, unsigned fix, unsigned wide, size_t most)
{
    uint64_t head = number(in, 1), count;

    if ((head & 0xF0) == fix)
        count = head & 0x0F;
    else if (head == wide || head == wide + 1u)
        count = number(in, head == wide ? 2 : 4);
    else
        count = fail(in);
    return (size_t)(count <= most ? count : fail(in));
}

size_t wire_read_list(struct wire_reader *in, size_t most)
{
    return count_of(in, FIXLIST, LIST16, most);
}

size_t wire_read_map(struct wire_reader *in, size_t most)
{
    return count_of(in, FIXMAP, MAP16, most);
}

uint64_t wire_read_whole(struct wire_reader *in, uint64_t low, uint64_t high)
{
    uint64_t head = number(in, 1), found = head;

    if (head >= UINT8 && head <= UINT64) {
        found = number(in, width_of(head, UINT8));
    } else if (head >= INT8 && head <= INT64) {
        size_t width = width_of(head, INT8);
        found = number(in, width);
        if (found >> (8 * width - 1)) /* negative */
            return fail(in);
    } else if (head >= FIXMAP) {
        return fail(in);
    }
    return low <= found && found <= high ? found : fail(in);
}

double wire_read_real(struct wire_reader *in)
{
    uint64_t head = number(in, 1);
    double found = 0;

    if (head == FLOAT64) {
        uint64_t bits = number(in, 8);
        memcpy(&found, &bits, sizeof found);
    } else if (head == FLOAT32) {
        uint32_t bits = (uint32_t)number(in, 4);
        float low;
        memcpy(&low, &bits, sizeof low);
        found = (double)low;
    } else {
        fail(in);
    }
    return in->wrong ? 0 : found;
}

bool wire_read_flag(struct wire_reader *in)
{
    uint64_t head = number(in, 1);

    if (head != NO && head != YES)
        fail(in);
    return head == YES;
}

/* What begins with a head from `first` on, of three widths. */
static struct bytes sized(struct wire_reader *in, unsigned first, uint64_t head,
                          size_t longest)
{
    struct bytes found = {NULL, 0};
    uint64_t size;

    if (first == TEXT8 && (head & 0xE0) == FIXTEXT)
        size = head & 0x1F;
    else if (head >= first && head <= first + 2)
        size = number(in, width_of(head, first));
    else
        size = fail(in);
    if (size > longest)
        size = fail(in);
    found.at = in->at;
    pass(in, size);
    if (!in->wrong)
        found.size = (size_t)size;
    return found;
}

struct bytes wire_read_text(struct wire_reader *in, size_t longest)
{
    return sized(in, TEXT8, number(in, 1), longest);
}

struct bytes wire_read_bytes(struct wire_reader *in, size_t longest)
{
    return sized(in, BYTES8, number(in, 1), longest);
}

/* How many items the one that begins here has inside; what is none is passed. */
static uint64_t inside(struct wire_reader *in)
{
    enum { FIXED = 0x00, SIZED = 0x10, LIST = 0x20, MAP = 0x30, NONE = 0x40 };
    /* From NOTHING on: what it is, and bytes of its number. Extensions are none. */
    static const uint8_t kinds[] = {
        FIXED, NONE, FIXED, FIXED, SIZED | 1, SIZED | 2, SIZED | 4, NONE, NONE, NONE,
        FIXED | 4, FIXED | 8, FIXED | 1, FIXED | 2, FIXED | 4, FIXED | 8,
        FIXED | 1, FIXED | 2, FIXED | 4, FIXED | 8, NONE, NONE, NONE, NONE, NONE,
        SIZED | 1, SIZED | 2, SIZED | 4, LIST | 2, LIST | 4, MAP | 2, MAP | 4,
    };
    uint64_t head = number(in, 1), count;
    unsigned kind;

    if (head < FIXMAP || head >= NEGATIVE)
        return 0;
    if (head < FIXTEXT)
        return (head & 0x0F) << (head < FIXLIST);
    if (head < NOTHING) {
        pass(in, head & 0x1F);
        return 0;
    }
    kind = kinds[head - NOTHING];
    count = kind == NONE ? fail(in) : number(in, kind & 0x0F);
    if (kind < LIST) {
        pass(in, kind < SIZED ? 0 : count);
        return 0;
    }
    return count << (kind >= MAP);
}

void wire_skip(struct wire_reader *in)
{
    uint64_t items = 1; /* each takes a byte at least, so this ends */

    while (items > 0 && !in->wrong)
        items += inside(in) - 1;
}

bool wire_is(struct bytes bytes, const char *text)
{
    return bytes.size == strlen(text) && memcmp(bytes.at, text, bytes.size) == 0;
}
