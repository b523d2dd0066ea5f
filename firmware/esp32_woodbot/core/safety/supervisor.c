/* SPDX-License-Identifier: Apache-2.0 */
#include "supervisor.h"

#include <stddef.h>
#include <string.h>

enum { SHORTEST = 250 /* ms: the first pause */, DOUBLINGS = 3 };

static uint64_t after(uint64_t now, uint32_t ms)
{
    return now + ms * UINT64_C(1000);
}

/* The address whose turn it is. Settings may have changed how many there are. */
static const char *locator(const struct supervisor *supervisor)
{
    unsigned count = 0;

    while (supervisor->locators[count] != NULL)
        count++;
    return count > 0 ? supervisor->locators[supervisor->locator % count] : "";
}

static bool is_network_up(const struct supervisor *supervisor)
{
    const struct link *link = supervisor->link;

    return strcmp(locator(supervisor), LINK_CABLE) == 0
           || link->network(link->self) == NETWORK_UP;
}

static void open_session(struct supervisor *supervisor)
{
    const struct link *link = supervisor->link;

    if (link->open(link->self, locator(supervisor))) {
        supervisor->session = true;
        supervisor->opened++;
        supervisor->phase = PHASE_DECLARING;
    } else {
        supervisor->locator++;
        supervisor->cause = CAUSE_NOT_OPENED;
        supervisor->phase = PHASE_CLOSING;
    }
}

static void declare(struct supervisor *supervisor, uint64_t now)
{
    bool done = supervisor->declare(supervisor->context);

    if (!done)
        supervisor_fail(supervisor, CAUSE_NOT_DECLARED, now);
    if (supervisor->phase != PHASE_DECLARING) /* it may have failed by itself */
        return;
    supervisor->until = after(now, SUPERVISOR_HELD);
    supervisor->phase = PHASE_OPEN;
}

static void look(struct supervisor *supervisor, uint64_t now)
{
    const struct link *link = supervisor->link;

    if (!is_network_up(supervisor))
        supervisor_fail(supervisor, CAUSE_NO_NETWORK, now);
    else if (!link->up(link->self))
        supervisor_fail(supervisor, CAUSE_NO_ROUTER, now);
}

/* The pause begins here, not where it failed: `open` took its time since that `now`. */
static void close_session(struct supervisor *supervisor, uint64_t now)
{
    const struct link *link = supervisor->link;
    unsigned doublings = supervisor->attempt;

    if (supervisor->session) {
        supervisor->gone(supervisor->context);
        link->close(link->self);
        supervisor->session = false;
    }
    if (supervisor->attempt < DOUBLINGS)
        supervisor->attempt++;
    supervisor->until = after(now, (uint32_t)SHORTEST << doublings);
    supervisor->phase = PHASE_WAITING;
}

void supervisor_start(struct supervisor *supervisor)
{
    supervisor->phase = PHASE_NETWORK;
    supervisor->cause = CAUSE_NONE;
    supervisor->until = 0;
    supervisor->locator = supervisor->attempt = 0;
    supervisor->session = false;
    supervisor->opened = 0;
}

void supervisor_step(struct supervisor *supervisor, uint64_t now)
{
    switch (supervisor->phase) {
    case PHASE_NETWORK:
        if (is_network_up(supervisor))
            supervisor->phase = PHASE_OPENING;
        break;
    case PHASE_OPENING:
        if (is_network_up(supervisor))
            open_session(supervisor);
        else
            supervisor->phase = PHASE_NETWORK;
        break;
    case PHASE_DECLARING:
        declare(supervisor, now);
        break;
    case PHASE_OPEN:
        look(supervisor, now);
        break;
    case PHASE_CLOSING:
        close_session(supervisor, now);
        break;
    case PHASE_WAITING:
        if (now >= supervisor->until)
            supervisor->phase = PHASE_NETWORK;
        break;
    }
}

void supervisor_fail(struct supervisor *supervisor, enum cause cause, uint64_t now)
{
    bool open = supervisor->phase == PHASE_OPEN;

    if (cause == CAUSE_SETTINGS) {
        supervisor->locator = supervisor->attempt = 0;
    } else if (!open && supervisor->phase != PHASE_DECLARING) {
        return;
    } else if (open && now >= supervisor->until) {
        supervisor->attempt = 0;
    } else {
        supervisor->locator++;
    }
    supervisor->cause = cause;
    supervisor->phase = PHASE_CLOSING;
}

const char *supervisor_why(enum cause cause)
{
    static const char *const sentences[] = {
        "nothing was wrong",
        "the network is gone",
        "no router answers at that address",
        "the router took no declarations",
        "what was said did not go out",
        "the router is gone",
        "it is commanded, but hears nothing",
        "nothing is heard of the clock",
        "the settings were changed",
    };

    return (size_t)cause < sizeof sentences / sizeof sentences[0] ? sentences[cause]
                                                                  : "not known";
}
