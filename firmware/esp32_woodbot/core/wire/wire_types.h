/* The first bytes of msgpack: what comes. For wire_read.c and wire_write.c.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef WOODBOT_WIRE_TYPES_H
#define WOODBOT_WIRE_TYPES_H

enum {
    FIXMAP = 0x80, FIXLIST = 0x90, FIXTEXT = 0xA0,
    NOTHING = 0xC0, NO = 0xC2, YES = 0xC3, BYTES8 = 0xC4,
    FLOAT32 = 0xCA, FLOAT64 = 0xCB,
    UINT8 = 0xCC, UINT64 = 0xCF, INT8 = 0xD0, INT64 = 0xD3,
    TEXT8 = 0xD9, LIST16 = 0xDC, MAP16 = 0xDE, NEGATIVE = 0xE0
};

#endif
