/* Console: a serial line for people, for `rems provision` and for Improv Serial.
 *
 * Lines of text (`status`, `set name woodbot-7`, `test servos`, `reset`) and packets of
 * Improv share the line; what is neither is left alone. A password is never printed.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef WOODBOT_CONSOLE_H
#define WOODBOT_CONSOLE_H

#include "link.h"
#include "settings.h"

/* What the console asks of the robot around it. */
struct console_host {
    void *self;
    void (*status)(void *self, char *text, size_t room);  /* lines for people */
    void (*changed)(void *self);           /* settings were stored: act on them */
    void (*test)(void *self, const char *what, char *text, size_t room);
    void (*reset)(void *self);
};

struct console {
    const struct hardware *hardware;
    const struct link *link;
    struct settings *settings;
    struct console_host host;
    uint8_t line[256];
    size_t length;
    uint8_t state;          /* of Improv: 2 ready, 3 provisioning, 4 provisioned */
    uint64_t since;         /* us: when provisioning began */
    bool packet, scanning, skipping;
};

void console_start(struct console *console);
/* Take in what came, and answer; never waits. */
void console_step(struct console *console, uint64_t now);

#endif
