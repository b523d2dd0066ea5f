/* Keys: where something lives, and what a question covers.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef WOODBOT_KEYS_H
#define WOODBOT_KEYS_H

#include "../link.h"

/* Write `<one>/<two>/<three>`; an empty chunk is left out. "" if there is no room. */
const char *key_of(char room[LINK_KEY], const char *one, const char *two,
                   const char *three);

/* Go on: a chunk, or several, behind a slash. */
const char *key_add(char room[LINK_KEY], const char *chunk);

/* Whether a key of Zenoh, which may be a glob (one of its chunks may be `*`, `**`, or
 * have `$*` inside), covers this whole key. Chunks that begin with `@` are matched by
 * their like only. */
bool key_covers(const char *glob, const char *key);

/* Whether a parameter (`format` of `format=json;since=7`) has this value. */
bool key_asks(const char *parameters, const char *name, const char *value);

#endif
