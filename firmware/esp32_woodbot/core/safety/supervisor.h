/* Supervisor: brings the link up, sees that it is gone, and never gives up.
 *
 * A state machine without waiting: `supervisor_step` looks at the link and at the time,
 * and does at most one thing. Wi-Fi first, then a session to each of the router's
 * addresses in turn, then the declarations; a put that fails, a router that is not
 * counted, or a missing proof of life (commanded, but deaf) closes it all, and it
 * begins again after 0.25, 0.5, 1, 2, 2 ... s. A session that lasted SUPERVISOR_HELD
 * was a good one: its address is tried first, and the pauses are short again.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef WOODBOT_SUPERVISOR_H
#define WOODBOT_SUPERVISOR_H

#include "../link.h"

enum { SUPERVISOR_HELD = 2000 /* ms */ };

enum phase {
    PHASE_NETWORK,      /* it waits for Wi-Fi */
    PHASE_OPENING,      /* the next step opens a session, which may take LINK_STALL */
    PHASE_DECLARING,    /* the next step declares */
    PHASE_OPEN,         /* all is well: the only phase in which anything is put */
    PHASE_CLOSING,      /* the next step closes what there is */
    PHASE_WAITING       /* until it begins again */
};

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
    uint64_t until;                    /* us: the pause ends; the session is good */
    unsigned locator, attempt;
    bool session;                      /* there is one to be closed */
    uint32_t opened;                   /* how many there have been */
};

/* The first five are filled in before; the rest is cleared. */
void supervisor_start(struct supervisor *supervisor);
/* One thing at most; `now` in us. */
void supervisor_step(struct supervisor *supervisor, uint64_t now);
/* The session is no good: the next step closes it, and it begins again. May be said
 * from anywhere, also by what is called from inside link.poll. Without a session
 * nothing counts but CAUSE_SETTINGS, which goes back to the first address. */
void supervisor_fail(struct supervisor *supervisor, enum cause cause, uint64_t now);
/* The cause, for people: "the router is gone". */
const char *supervisor_why(enum cause cause);

#endif
