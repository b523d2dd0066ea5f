/* SPDX-License-Identifier: Apache-2.0 */
#include "utf8.h"

/* The bytes that follow the first of a character; -1 for what begins none. */
static int following(uint8_t first)
{
    if (first < 0x80)
        return 0;
    if (first >= 0xC2 && first < 0xE0)
        return 1;
    if (first >= 0xE0 && first < 0xF0)
        return 2;
    return first >= 0xF0 && first < 0xF5 ? 3 : -1;
}

bool utf8_plain(const uint8_t *bytes, size_t size)
{
    static const uint32_t least[] = {0, 0x80, 0x800, 0x10000};

    for (size_t i = 0; i < size; i++) {
        int more = following(bytes[i]);
        uint32_t point = more > 0 ? bytes[i] & (0x3Fu >> more) : bytes[i];

        if (more < 0 || size - i <= (size_t)more)
            return false;
        for (int left = more; left > 0; left--) {
            if ((bytes[++i] & 0xC0) != 0x80)
                return false;
            point = point << 6 | (bytes[i] & 0x3Fu);
        }
        if (point < least[more] || point > 0x10FFFF
            || (point >= 0xD800 && point < 0xE000))
            return false;
        if (point < 0x20 || (point >= 0x7F && point < 0xA0))
            return false;
    }
    return true;
}
