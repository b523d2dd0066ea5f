/* A bench for the supervisor: a link whose answers a test sets, and whose calls it reads.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#include "safety/supervisor.h"

#include <string.h>

enum { CALLS = 16, DECLARES_AND_FAILS = 2 };

struct state {
    uint32_t phase, cause, locator, attempt, session, opened;
    uint64_t until;
};

size_t bench_size(void);
void bench_start(void);
void bench_save(struct supervisor *to);
void bench_load(const struct supervisor *from);
void bench_locators(unsigned count);
void bench_world(int network, int opens, int up, int declares);
void bench_fail(int cause, uint64_t now);
void bench_step(uint64_t now, char *made, struct state *state);

static struct supervisor supervisor;
static const char *locators[] = {"a", "b", "c", NULL};
static int network_now, open_now, up_now, declare_now;
static char calls[CALLS];

static void note(char call)
{
    size_t length = strlen(calls);

    if (length < CALLS - 1)
        calls[length] = call;
}

static enum network network(void *self)
{
    (void)self;
    return (enum network)network_now;
}

static bool open_session(void *self, const char *locator)
{
    (void)self;
    note(locator[0] != '\0' ? locator[0] : '-');
    return open_now;
}

static void close_session(void *self)
{
    (void)self;
    note('x');
}

static bool up(void *self)
{
    (void)self;
    return up_now;
}

static const struct link link_ = {
    .network = network, .open = open_session, .close = close_session, .up = up};

static bool declare(void *context)
{
    (void)context;
    note('d');
    if (declare_now == DECLARES_AND_FAILS) /* a put from inside has failed */
        supervisor_fail(&supervisor, CAUSE_PUT, 0);
    return declare_now;
}

static void gone(void *context)
{
    (void)context;
    note('g');
    supervisor_fail(&supervisor, CAUSE_PUT, 0); /* its last words did not go out */
}

size_t bench_size(void)
{
    return sizeof supervisor;
}

void bench_start(void)
{
    supervisor.link = &link_;
    supervisor.locators = locators;
    supervisor.declare = declare;
    supervisor.gone = gone;
    supervisor_start(&supervisor);
}

void bench_save(struct supervisor *to)
{
    *to = supervisor;
}

void bench_load(const struct supervisor *from)
{
    supervisor = *from;
}

/* How many addresses there are from now on: 3 at most. */
void bench_locators(unsigned count)
{
    static const char *const all[] = {"a", "b", "c"};

    for (unsigned i = 0; i < 3; i++)
        locators[i] = i < count ? all[i] : NULL;
}

void bench_world(int network_, int opens, int up_, int declares)
{
    network_now = network_;
    open_now = opens;
    up_now = up_;
    declare_now = declares;
}

void bench_fail(int cause, uint64_t now)
{
    supervisor_fail(&supervisor, (enum cause)cause, now);
}

void bench_step(uint64_t now, char *made, struct state *state)
{
    memset(calls, 0, sizeof calls);
    supervisor_step(&supervisor, now);
    memcpy(made, calls, sizeof calls);
    state->phase = supervisor.phase;
    state->cause = supervisor.cause;
    state->locator = supervisor.locator;
    state->attempt = supervisor.attempt;
    state->session = supervisor.session;
    state->opened = supervisor.opened;
    state->until = supervisor.until;
}
