/* CRC-32 as of Ethernet and zip: reflected, 0xEDB88320. Without a table: it is small, and
 * what it is for is slow.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef WOODBOT_CRC32_H
#define WOODBOT_CRC32_H

#include <stddef.h>
#include <stdint.h>

uint32_t crc32_of(const uint8_t *bytes, size_t size);

#endif
