/* SPDX-License-Identifier: Apache-2.0 */
#include "improv.h"

#include <string.h>

const uint8_t improv_start[IMPROV_START] = {'I', 'M', 'P', 'R', 'O', 'V', 1};

static uint8_t sum(const uint8_t *bytes, size_t size)
{
    unsigned total = 0;

    while (size > 0)
        total += bytes[--size];
    return (uint8_t)total;
}

size_t improv_length(const uint8_t *packet, size_t size)
{
    return size < IMPROV_HEAD ? 0 : (size_t)IMPROV_HEAD + packet[IMPROV_HEAD - 1] + 1;
}

const uint8_t *improv_data(const uint8_t *packet, enum improv_type type, size_t *size)
{
    *size = packet[IMPROV_HEAD - 1];
    if (memcmp(packet, improv_start, IMPROV_START) != 0 || packet[IMPROV_START] != type
        || sum(packet, IMPROV_HEAD + *size) != packet[IMPROV_HEAD + *size])
        return NULL;
    return packet + IMPROV_HEAD;
}

size_t improv_write(uint8_t *buffer, size_t room, enum improv_type type,
                    const uint8_t *data, size_t size)
{
    uint8_t *packet = buffer + 1;

    if (size > 255 || size + IMPROV_HEAD + 3 > room)
        return 0;
    memmove(packet + IMPROV_HEAD, data, size);
    memcpy(packet, improv_start, IMPROV_START);
    packet[IMPROV_START] = (uint8_t)type;
    packet[IMPROV_HEAD - 1] = (uint8_t)size;
    packet[IMPROV_HEAD + size] = sum(packet, IMPROV_HEAD + size);
    buffer[0] = packet[IMPROV_HEAD + size + 1] = '\n';
    return size + IMPROV_HEAD + 3;
}

size_t improv_result(uint8_t *buffer, size_t room, enum improv_command command,
                     const char *const *texts)
{
    uint8_t data[255] = {(uint8_t)command};
    size_t size = 2;

    for (; *texts != NULL; texts++) {
        size_t length = strlen(*texts);

        if (size + 1 + length > sizeof data)
            return 0;
        data[size] = (uint8_t)length;
        memcpy(data + size + 1, *texts, length);
        size += 1 + length;
    }
    data[1] = (uint8_t)(size - 2);
    return improv_write(buffer, room, IMPROV_RESULT, data, size);
}
