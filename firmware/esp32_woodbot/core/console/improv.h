/* Improv Serial: the bytes of its packets (https://www.improv-wifi.com/serial).
 *
 * `IMPROV`, version, type, length, data, the sum of all that mod 256. A newline before
 * and after each keeps it apart from lines of text: readers look for it where a line
 * begins.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef WOODBOT_IMPROV_H
#define WOODBOT_IMPROV_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum {
    IMPROV_HEAD = 9,      /* bytes before the data */
    IMPROV_PACKET = 265,  /* the longest, without newlines */
    IMPROV_START = 7      /* bytes of `improv_start` */
};

enum improv_type { IMPROV_STATE = 1, IMPROV_ERROR, IMPROV_RPC, IMPROV_RESULT };
enum improv_state { IMPROV_READY = 2, IMPROV_PROVISIONING, IMPROV_PROVISIONED };
enum improv_error {
    IMPROV_FINE, IMPROV_INVALID, IMPROV_UNKNOWN, IMPROV_NOT_CONNECTED,
    IMPROV_BAD_NAME = 5
};
enum improv_command {
    IMPROV_WIFI = 1, IMPROV_GET_STATE, IMPROV_GET_INFO, IMPROV_SCAN, IMPROV_NAME = 6
};

/* What every packet begins with: its name and its version. */
extern const uint8_t improv_start[IMPROV_START];

/* How long the packet is whose first `size` bytes these are; 0 while that is open. */
size_t improv_length(const uint8_t *packet, size_t size);

/* The data of a whole packet of that type, its size in `size`; NULL if it is another or
 * its sum is wrong. */
const uint8_t *improv_data(const uint8_t *packet, enum improv_type type, size_t *size);

/* Write a packet between its newlines; its size, 0 if there is no room. */
size_t improv_write(uint8_t *buffer, size_t room, enum improv_type type,
                    const uint8_t *data, size_t size);

/* The result of a command: texts, up to NULL. */
size_t improv_result(uint8_t *buffer, size_t room, enum improv_command command,
                     const char *const *texts);

#endif
