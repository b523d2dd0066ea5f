/* Guard: what a member knows of its clock in wall time: how old a tick is, and STOP.
 *
 * As rems_net/agents/host/guard.py has it. No two clocks of two machines are compared:
 * the guard notes its own time `a`, and asks how old tick n is; what is answered was
 * true after `a`, so tick n was made at `a - answer` or later.
 *
 * The latch: STOP holds from the moment in which it is heard, until the clock says a
 * greater even number; a tick that was sent before can never release it.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef WOODBOT_GUARD_H
#define WOODBOT_GUARD_H

#include <stdbool.h>
#include <stdint.h>

enum { GUARD_ANSWERS = 16 }; /* of the last 1.6 s; no command lives as long */

struct guard {
    bool stopped;
    bool again;         /* STOP is to be said again: the clock has not heard it */
    uint64_t stops, release, said_again;
    struct {
        uint64_t n, made; /* made: at the earliest, us */
    } answers[GUARD_ANSWERS];
    unsigned next;
};

/* STOP was heard. */
void guard_hear(struct guard *guard);
/* The clock's number: odd means stopped. */
void guard_take(struct guard *guard, uint64_t stops, uint64_t now);
/* A run has let this member in: another clock counts from its own beginning. */
void guard_begin(struct guard *guard, uint64_t stops, uint64_t now);
/* At `asked` [us] it was asked how old tick n is: so many seconds. */
void guard_answer(struct guard *guard, uint64_t n, double seconds, uint64_t asked);
/* When tick n was made, at the earliest [us]; 0 where nothing is known. */
uint64_t guard_made(const struct guard *guard, uint64_t n);

#endif
