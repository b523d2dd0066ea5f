/* Supervisor: brings the link up, sees that it is gone, and never gives up.
 *
 * A state machine without waiting: `supervisor_step` looks at the link and at the time,
 * and does at most one thing. Wi-Fi first, then a session to each of the router's
 * addresses in turn, then the declarations; a put that fails, a router that is not
 * counted, or a missing proof of life (commanded, but deaf) closes it all, and it
 * begins again after 0.25, 0.5, 1, 2, 2 ... s.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef WOODBOT_SUPERVISOR_H
#define WOODBOT_SUPERVISOR_H

#include "link.h"

enum phase { PHASE_NETWORK, PHASE_OPENING, PHASE_OPEN, PHASE_WAITING };

/* Why the last session was closed. */
enum cause {
    CAUSE_NONE, CAUSE_NO_NETWORK, CAUSE_NOT_OPENED, CAUSE_NOT_DECLARED, CAUSE_PUT,
    CAUSE_NO_ROUTER, CAUSE_DEAF, CAUSE_SILENT, CAUSE_SETTINGS
};

struct supervisor {
    const struct link *link;
    const char *const *locators;       /* "" looks for one; ends with NULL */
    bool (*declare)(void *context);    /* declares all; false if one was not */
    void (*gone)(void *context);       /* the session is about to be closed */
    void *context;
    enum phase phase;
    enum cause cause;
    uint64_t until;                    /* us */
    unsigned locator, attempt;
    uint32_t opened;                   /* how many sessions there have been */
};

void supervisor_start(struct supervisor *supervisor);
/* One thing at most; `now` in us. */
void supervisor_step(struct supervisor *supervisor, uint64_t now);
/* The session is no good: close it, and begin again. */
void supervisor_fail(struct supervisor *supervisor, enum cause cause, uint64_t now);
const char *supervisor_why(enum cause cause);

#endif
