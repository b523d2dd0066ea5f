/* SPDX-License-Identifier: Apache-2.0 */
#include "crc32.h"

uint32_t crc32_of(const uint8_t *bytes, size_t size)
{
    uint32_t sum = 0xFFFFFFFFu;

    for (size_t i = 0; i < size; i++) {
        sum ^= bytes[i];
        for (int bit = 0; bit < 8; bit++)
            sum = (sum >> 1) ^ ((sum & 1u) != 0 ? 0xEDB88320u : 0u);
    }
    return sum ^ 0xFFFFFFFFu;
}
