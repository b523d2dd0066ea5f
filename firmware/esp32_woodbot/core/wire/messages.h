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
    HOLDER_SIZE = 101, /* of who holds a lease, in ASCII */
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

/* What asks for the lease of a robot: again, to keep it. */
struct claim {
    uint64_t badge;           /* in the stamps of the commands */
    char holder[HOLDER_SIZE]; /* who it is; "" gives the lease back */
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

bool beat_read(struct bytes message, struct beat *beat);
bool stop_read(struct bytes message);
bool stamp_read(struct bytes message, struct stamp *stamp);
bool admission_read(struct bytes message, struct admission *admission);
bool age_read(struct bytes message, struct age *age);
bool claim_read(struct bytes message, struct claim *claim);
/* The number of the newest tick, as a clock answers at `clock/tick`. */
bool newest_read(struct bytes message, uint64_t *n);
/* Whether it calls a verb without arguments. */
bool call_read(struct bytes message);

struct bytes stop_write(void);
struct bytes stamp_write(uint8_t room[STAMP_SIZE], const struct stamp *stamp);
struct bytes done_write(uint8_t room[STAMP_SIZE], uint64_t badge, uint64_t n);
struct bytes badge_write(uint8_t room[STAMP_SIZE], uint64_t badge);
struct bytes request_write(uint8_t *room, size_t size, const struct request *request);
/* The answer at `@schema`: each port's description. */
struct bytes schemas_write(uint8_t *room, size_t size);
struct bytes farewell_write(uint8_t *room, size_t size, uint64_t badge);

#endif
