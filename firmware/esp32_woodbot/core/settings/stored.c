/* SPDX-License-Identifier: Apache-2.0 */
#include "../settings.h"

#include <string.h>

#include "crc32.h"

enum { HEAD = 10 /* bytes before the lines: magic, CRC-32, their length */ };
static const uint8_t magic[4] = {'W', 'B', 'S', '1'};

static bool is_known(const char *name)
{
    const char *known;

    for (size_t i = 0; (known = settings_name(i)) != NULL; i++)
        if (strcmp(known, name) == 0)
            return true;
    return false;
}

/* Set what the lines say; a name that this firmware does not know (of a newer one) is
 * passed over, a value that is not allowed spoils them all. The lines are torn up. */
static bool read_lines(struct settings *settings, char *lines, size_t size)
{
    char *end = lines + size;

    while (lines < end) {
        char *newline = memchr(lines, '\n', (size_t)(end - lines));
        char *equals;

        if (newline == NULL)
            return false;
        *newline = '\0';
        equals = strchr(lines, '=');
        if (equals == NULL || strlen(lines) != (size_t)(newline - lines))
            return false;
        *equals = '\0';
        if (is_known(lines) && settings_set(settings, lines, equals + 1) != NULL)
            return false;
        lines = newline + 1;
    }
    return true;
}

bool settings_load(struct settings *settings, const struct hardware *hardware)
{
    uint8_t bytes[SETTINGS_SIZE];
    size_t size = hardware->load(hardware->self, bytes, sizeof bytes);
    uint32_t sum = 0;
    bool good;

    settings_default(settings);
    if (size < HEAD || size > sizeof bytes || memcmp(bytes, magic, sizeof magic) != 0)
        return false;
    for (int i = 3; i >= 0; i--)
        sum = sum << 8 | bytes[4 + i];
    if ((size_t)(bytes[8] | bytes[9] << 8) != size - HEAD
        || sum != crc32_of(bytes + 8, size - 8))
        return false;
    good = read_lines(settings, (char *)bytes + HEAD, size - HEAD);
    memset(bytes, 0, sizeof bytes); /* the password does not stay on the stack */
    if (!good)
        settings_default(settings);
    return good;
}

bool settings_store(const struct settings *settings, const struct hardware *hardware)
{
    uint8_t bytes[SETTINGS_SIZE];
    size_t size = HEAD;
    const char *name;
    uint32_t sum;
    bool stored;

    for (size_t i = 0; (name = settings_name(i)) != NULL; i++) {
        size_t length = strlen(name);

        if (size + length + 2 > sizeof bytes)
            return false;
        memcpy(bytes + size, name, length);
        bytes[size + length] = '=';
        size += length + 1;
        if (!settings_text(settings, i, (char *)bytes + size, sizeof bytes - size - 1))
            return false;
        size += strlen((char *)bytes + size);
        bytes[size++] = '\n';
    }
    memcpy(bytes, magic, sizeof magic);
    bytes[8] = (uint8_t)(size - HEAD);
    bytes[9] = (uint8_t)((size - HEAD) >> 8);
    sum = crc32_of(bytes + 8, size - 8);
    for (int i = 0; i < 4; i++)
        bytes[4 + i] = (uint8_t)(sum >> (8 * i));
    stored = hardware->store(hardware->self, bytes, size);
    memset(bytes, 0, sizeof bytes);
    return stored;
}
