/* Member: one membership of one fabric, as a free-running host (docs/time.md).
 *
 * Asks the clock to be let in until it answers, hears its ticks and STOP, asks every
 * 0.1 s how old a tick is, and finds out by questions alone when it is no member any
 * more: the roster of a class is too long to be read here.
 *
 * What comes from the link (`_heard`, `_answered`) changes the struct and nothing else;
 * what goes out is put and asked by `member_step`.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef WOODBOT_MEMBER_H
#define WOODBOT_MEMBER_H

#include "guard.h"
#include "../wire/messages.h"

enum {
    AGENT_SIZE = 48,    /* bytes of `robot/woodbot-7`, its end included */
    REFUSAL_SIZE = 288, /* a sentence that names a field that differs */
    MEMBER_ASKS = 32    /* questions that may be open */
};

enum seat {
    SEAT_NONE,          /* nothing is declared: there is no session, or no fabric */
    SEAT_ASKING,        /* the clock was asked, and has not let it in */
    SEAT_IN
};

enum { /* us: between two questions */
    MEMBER_EVERY = 2000000,
    MEMBER_REFUSED_EVERY = 1000000
};

/* Why it is asking, where it was in before. */
enum parting { PARTING_NONE, PARTING_LET_GO, PARTING_LOST, PARTING_OTHER_RUN };

enum question { ASK_NOTHING, ASK_JOIN, ASK_AGE, ASK_MEMBER, ASK_NEWEST, ASK_LEAVE };

struct member {
    const struct link *link;
    char fabric[NAME_SIZE];
    char agent[AGENT_SIZE];
    char source[SOURCE_SIZE];   /* of its command; "" for anybody */
    uint64_t identity;

    enum seat seat;
    enum parting parting;
    struct guard guard;
    uint64_t badge, first;      /* badge: 0 before the first admission */
    double dt;
    struct beat beat;           /* the newest tick; n is 0 before it came */
    bool fresh;                 /* ... and nothing was said at it yet */
    bool deaf;                  /* the clock ticks, and it is not heard */
    uint64_t ticked, seen;      /* us: the newest tick came; the clock answered */
    uint64_t told;              /* the clock's newest tick, since one was heard */
    uint64_t patience;          /* us */
    uint64_t join_due, age_due, member_due, newest_due, shown_due;
    uint64_t shown;             /* the badge whose token is declared; 0 for none */
    char refusal[REFUSAL_SIZE]; /* why the clock does not let it in */
    uint32_t asked;             /* questions so far */
    struct {
        uint32_t id;
        enum question what;
        uint64_t n, at;
    } asks[MEMBER_ASKS];
    uint64_t strange;           /* messages that were passed over */
};

void member_start(struct member *member, const struct link *link, const char *fabric,
                  const char *name, const char *source, uint64_t identity);

/* Hear the clock and STOP, and be asked about it. False: the session is broken. */
bool member_declare(struct member *member, uint64_t now);
/* The session is gone; STOP holds on. */
void member_gone(struct member *member);

/* Ask and say what is due. False: the session is broken. */
bool member_step(struct member *member, uint64_t now);
/* Say that the newest tick is done. */
bool member_done(struct member *member);
/* Take its leave of the clock. */
void member_leave(struct member *member);

/* What came at a key of its own; false if it is none. */
bool member_heard(struct member *member, const char *key, struct bytes payload,
                  uint64_t now);
/* False if it is another's answer. */
bool member_answered(struct member *member, uint32_t id, bool refused,
                     struct bytes payload, uint64_t now);

/* For its own two files: out of the run, which it asks for again. */
void member_part(struct member *member, enum parting parting, uint64_t now);

/* The rest of a key that begins with this fabric; NULL for another's. */
const char *member_within(const struct member *member, const char *key);
uint64_t member_run(const struct member *member);

#endif
