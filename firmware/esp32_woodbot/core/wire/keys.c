/* SPDX-License-Identifier: Apache-2.0 */
#include "keys.h"

#include <string.h>

const char *key_add(char room[LINK_KEY], const char *chunk)
{
    size_t size = strlen(room), more = strlen(chunk);

    if (more == 0)
        return room;
    if (size + 1 + more >= LINK_KEY) {
        room[0] = '\0';
        return room;
    }
    if (size > 0)
        room[size++] = '/';
    memcpy(room + size, chunk, more + 1);
    return room;
}

const char *key_of(char room[LINK_KEY], const char *one, const char *two,
                   const char *three)
{
    room[0] = '\0';
    key_add(room, one);
    key_add(room, two);
    return key_add(room, three);
}

static size_t chunk(const char *key)
{
    return strcspn(key, "/");
}

/* What comes after a chunk. */
static const char *after(const char *key)
{
    key += chunk(key);
    return *key == '/' ? key + 1 : key;
}

/* Whether one chunk covers another: `$*` stands for any letters. */
static bool chunk_covers(const char *glob, size_t size, const char *key, size_t length)
{
    const char *star = NULL, *from = key;

    if (size == 1 && *glob == '*')
        return *key != '@';
    for (size_t g = 0, k = 0; k < length || g < size;) {
        if (g + 1 < size && glob[g] == '$' && glob[g + 1] == '*') {
            star = glob + g + 2;
            from = key + k;
            g += 2;
        } else if (g < size && k < length && glob[g] == key[k]) {
            g++;
            k++;
        } else if (star != NULL && from < key + length) {
            g = (size_t)(star - glob); /* it stands for one letter more */
            k = (size_t)(++from - key);
        } else {
            return false;
        }
    }
    return *key != '@' || *glob == '@';
}

bool key_covers(const char *glob, const char *key)
{
    const char *star = NULL, *from = NULL; /* the last `**`, and what it ends before */

    while (*key != '\0' || *glob != '\0') {
        if (chunk(glob) == 2 && glob[0] == '*' && glob[1] == '*') {
            glob = star = after(glob);
            from = key;
        } else if (*glob != '\0' && *key != '\0'
                   && chunk_covers(glob, chunk(glob), key, chunk(key))) {
            glob = after(glob);
            key = after(key);
        } else if (star != NULL && *from != '\0' && *from != '@') {
            key = from = after(from);
            glob = star;
        } else {
            return false;
        }
    }
    return true;
}

bool key_asks(const char *parameters, const char *name, const char *value)
{
    size_t size = strlen(name), length = strlen(value);

    while (*parameters != '\0') {
        size_t whole = strcspn(parameters, ";");
        if (whole == size + 1 + length && strncmp(parameters, name, size) == 0
            && parameters[size] == '='
            && strncmp(parameters + size + 1, value, length) == 0)
            return true;
        parameters += whole;
        parameters += *parameters == ';';
    }
    return false;
}
