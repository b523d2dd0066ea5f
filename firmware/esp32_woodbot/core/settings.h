/* Settings: what makes this Woodbot this one, and where it belongs. Kept by the port.
 *
 * Set over the console (`rems board provision`, a page in the browser), never compiled in. The
 * stored form is `name=value` lines in UTF-8, after a magic and a CRC-32: what does not
 * check is as if nothing were stored.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef WOODBOT_SETTINGS_H
#define WOODBOT_SETTINGS_H

#include "hardware.h"
#include "link.h"
#include "safety/motors.h"

enum {
    SETTINGS_NAME = 33,     /* bytes with their end */
    SETTINGS_ROUTERS = 3,
    SETTINGS_ROUTER = 64,
    SETTINGS_SIZE = 1024    /* stored */
};

struct settings {
    char name[SETTINGS_NAME];       /* "woodbot" unless told */
    char fabric[SETTINGS_NAME];     /* "rems" */
    char source[SETTINGS_NAME];     /* who commands it, `input/keys`; "" for anybody */
    char ssid[33], password[65], user[65];
    char router[SETTINGS_ROUTERS][SETTINGS_ROUTER]; /* tcp/HOST:PORT, or LINK_CABLE;
                                                      all "": look for one */
    struct servo_settings servo[2];
    double arena_radius;            /* m; 0 for none */
};

void settings_default(struct settings *settings);
/* What is stored; the defaults, and false, if there is nothing or it is damaged. */
bool settings_load(struct settings *settings, const struct hardware *hardware);
bool settings_store(const struct settings *settings, const struct hardware *hardware);
/* Set one by its name; NULL, or what is wrong with it in a sentence. */
const char *settings_set(struct settings *settings, const char *name,
                         const char *value);
/* The text of one; false if there is none of that name. A password is never told. */
bool settings_get(const struct settings *settings, const char *name, char *text,
                  size_t room);
/* Whether the serial line is the network. */
bool settings_by_cable(const struct settings *settings);
/* For its own files: the text of the i-th, a password, too; to be stored. */
bool settings_text(const struct settings *settings, size_t i, char *text, size_t room);
/* Names, in the order in which they are listed; NULL after the last. */
const char *settings_name(size_t i);

#endif
