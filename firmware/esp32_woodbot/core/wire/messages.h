/* Messages: what a clock and its hosts say (docs/time.md), read with checks, written.
 *
 * Each `_read` is false for anything else than its message, and as strict as its
 * counterpart in rems_net/agents/protocol. What a `_write` found no room for has no
 * bytes.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef WOODBOT_MESSAGES_H
#define WOODBOT_MESSAGES_H

#include "wire.h"

enum {
    NAME_SIZE = 64,    /* bytes of a name on the fabric, its end included */
    SOURCE_SIZE = 92,  /* of a source, `input/keys`: its key on any fabric has room */
    STAMP_SIZE = 37    /* of a stamp, or of a done, as it is written */
};

/* A tick, and how often STOP was said and released: odd means stopped. */
struct beat {
    uint64_t run, n, epoch, stops;
    double t, dt, pace;
};

/* When a value was written [s], by whom, and at which tick its source said it. */
struct stamp {
    uint64_t n, badge, said;
    double t;
};

struct admission {
    uint64_t badge, first, stops;
    double dt, patience;
};

struct age {
    uint64_t run, stops;
    double seconds; /* infinite for a tick that the clock does not know */
};

/* What a robot is asked for: to be lent, or taken back (no fabric). */
struct loan {
    char fabric[NAME_SIZE];
    char source[SOURCE_SIZE]; /* what its command is connected to there, or "" */
};

/* What a roster says of one member. */
struct mention {
    uint64_t run, epoch, first;
    bool named; /* an agent with its badge is there */
};

/* What a host asks the clock for: to be let in, with one agent. */
struct request {
    const char *agent;   /* `robot/woodbot-7`: the host's name, too */
    uint64_t identity;   /* as the number of a process, which no other robot has */
    const char *source;  /* of its command; "" for none */
    bool stopped;
};

/* The run that a badge belongs to. */
uint64_t run_of(uint64_t badge);
/* Whether it can be one chunk of a key. */
bool name_is(struct bytes text);
/* Whether it is `input/keys` or `robot/sim/state`, without a glob. */
bool source_is(struct bytes text);

bool beat_read(struct bytes message, struct beat *beat);
bool stop_read(struct bytes message);
bool stamp_read(struct bytes message, struct stamp *stamp);
bool admission_read(struct bytes message, struct admission *admission);
bool age_read(struct bytes message, struct age *age);
bool loan_read(struct bytes message, struct loan *loan);
/* badge: whose mention is looked for. */
bool roster_read(struct bytes message, uint64_t badge, struct mention *mention);
/* The number and the pace of the newest tick, as a clock answers at `clock/tick`. */
bool newest_read(struct bytes message, uint64_t *n, double *pace);
/* Whether it calls a verb without arguments. */
bool call_read(struct bytes message);

struct bytes stop_write(void);
struct bytes stamp_write(uint8_t room[STAMP_SIZE], const struct stamp *stamp);
struct bytes done_write(uint8_t room[STAMP_SIZE], uint64_t badge, uint64_t n);
struct bytes lent_write(uint8_t *room, size_t size, uint64_t badge, const char *fabric);
struct bytes request_write(uint8_t *room, size_t size, const struct request *request);
/* The answer at `@schema`: each port's description. */
struct bytes schemas_write(uint8_t *room, size_t size);
/* cause: why it leaves early; "" where it does not. */
struct bytes farewell_write(uint8_t *room, size_t size, uint64_t badge,
                            const char *agent, const char *cause);

#endif
