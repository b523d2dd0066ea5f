/* UTF-8, strictly: no over-long forms, no surrogates, nothing past U+10FFFF.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef WOODBOT_UTF8_H
#define WOODBOT_UTF8_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Whether it is UTF-8 without control characters (below U+0020, U+007F to U+009F). */
bool utf8_plain(const uint8_t *bytes, size_t size);

#endif
