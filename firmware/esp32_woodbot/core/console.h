/* Console: a serial line for people, for `rems board provision` and for Improv Serial.
 *
 * Lines of text (`status`, `set name woodbot-7`, `test servos`, `reset`) and packets of
 * Improv share the line; what is neither is left alone. Every line is answered, in any
 * number of lines, of which the last is `ok` or begins with `error: `. Nothing is
 * echoed, and a password is never printed.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef WOODBOT_CONSOLE_H
#define WOODBOT_CONSOLE_H

#include "console/improv.h"
#include "link.h"
#include "settings.h"

#define WOODBOT_VERSION "0.1.0"
#ifdef ESP_PLATFORM
#define WOODBOT_CHIP "ESP32"
#else
#define WOODBOT_CHIP "posix"
#endif

enum {
    CONSOLE_LINE = 272,     /* bytes of a line; a packet of Improv fits, too */
    CONSOLE_OUT = 1280,     /* of an answer */
    CONSOLE_SPARE = 160,    /* of it, kept for its last line */
    CONSOLE_FOUND = 16      /* networks that a scan tells of */
};

/* What the console asks of the robot around it. */
struct console_host {
    void *self;
    void (*status)(void *self, char *text, size_t room);  /* lines for people */
    void (*changed)(void *self);           /* settings were: act before the next step */
    void (*test)(void *self, const char *what, char *text, size_t room);
    void (*reset)(void *self);
};

struct console {
    const struct hardware *hardware;
    const struct link *link;
    struct settings *settings;
    struct console_host host;
    uint8_t line[CONSOLE_LINE];
    size_t length, matched; /* of the line; of Improv's start, wherever it is */
    uint8_t out[CONSOLE_OUT];
    size_t from, to;        /* what the line has not taken yet */
    bool packet, skipping, scanning, provisioning, resetting;
    uint64_t since;         /* us: when the packet, or provisioning, began */
    char ssid[33], password[65]; /* of before: they come back if it fails */
};

/* The pointers and the host are filled in before; the rest is cleared. */
void console_start(struct console *console);
/* Take in what came, and answer; never waits. */
void console_step(struct console *console, uint64_t now);

/* For its own files: what is to be written. */
void console_say(struct console *console, const char *text);
void console_packet(struct console *console, const uint8_t *data, size_t size);

/* Improv (console_improv.c): a packet that came; what goes on. */
void console_rpc(struct console *console, uint64_t now);
void console_provision(struct console *console, uint64_t now);

#endif
