/* SPDX-License-Identifier: Apache-2.0 */
#include "guard.h"

#include <string.h>

enum { AGAIN = 250000 /* us between two times that STOP is said again */ };

void guard_hear(struct guard *guard)
{
    if (!guard->stopped)
        guard->release = guard->stops + 2;
    guard->stopped = true;
}

void guard_take(struct guard *guard, uint64_t stops, uint64_t now)
{
    if (stops % 2) {
        guard->stopped = true;
        if (guard->release < stops + 1)
            guard->release = stops + 1;
    } else if (guard->stopped && stops >= guard->release) {
        guard->stopped = false;
    } else if (guard->stopped && now - guard->said_again > AGAIN) {
        guard->said_again = now;
        guard->again = true;
    }
    if (guard->stops < stops)
        guard->stops = stops;
}

void guard_begin(struct guard *guard, uint64_t stops, uint64_t now)
{
    memset(guard->answers, 0, sizeof guard->answers);
    guard->stops = stops;
    guard->release = stops + 2 - stops % 2;
    guard_take(guard, stops, now);
}

void guard_answer(struct guard *guard, uint64_t n, double seconds, uint64_t asked)
{
    double age = seconds * 1e6;

    if (!(age < (double)asked)) /* before this board was started, or infinite */
        return;
    guard->answers[guard->next].n = n;
    guard->answers[guard->next].made = asked - (uint64_t)age;
    guard->next = (guard->next + 1) % GUARD_ANSWERS;
}

uint64_t guard_made(const struct guard *guard, uint64_t n)
{
    uint64_t made = 0;

    /* An answer for an earlier tick bounds a later one, too. */
    for (unsigned i = 0; i < GUARD_ANSWERS; i++) {
        if (guard->answers[i].n <= n && made < guard->answers[i].made)
            made = guard->answers[i].made;
    }
    return made;
}
