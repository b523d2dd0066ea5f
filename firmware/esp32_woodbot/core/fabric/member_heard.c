/* SPDX-License-Identifier: Apache-2.0 */
#include <math.h>
#include <string.h>

#include "member.h"

enum { OUT_OF_SIGHT = 500000 /* us after which another run's word counts */ };

/* -- what comes ------------------------------------------------------------------ */

static void hear_beat(struct member *member, struct bytes payload, uint64_t now)
{
    struct beat beat;

    if (!beat_read(payload, &beat)) {
        member->strange++;
        return;
    }
    if (member->seat != SEAT_IN || beat.run != member_run(member))
        return;
    /* The clock rounds n dt once; it is the same to a millionth of a tick. */
    if (beat.dt != member->dt
        || fabs(beat.t - (double)beat.n * beat.dt) > 1e-6 * beat.dt + 1e-12 * beat.t) {
        member->strange++;
        return;
    }
    member->seen = now;
    if (beat.n <= member->beat.n)
        return;
    member->beat = beat;
    member->fresh = true;
    member->ticked = now;
    member->told = 0;
    guard_take(&member->guard, beat.stops, now);
}

bool member_heard(struct member *member, const char *key, struct bytes payload,
                  uint64_t now)
{
    const char *rest = member->seat == SEAT_NONE ? NULL : member_within(member, key);

    if (rest == NULL)
        return false;
    if (strcmp(rest, "stop") == 0) {
        if (stop_read(payload))
            guard_hear(&member->guard);
        else
            member->strange++;
    } else if (strcmp(rest, "clock/tick") == 0) {
        hear_beat(member, payload, now);
    } else {
        return false;
    }
    return true;
}

/* -- answers --------------------------------------------------------------------- */

static void hear_admission(struct member *member, struct bytes payload, uint64_t now)
{
    struct admission admission;

    if (member->seat != SEAT_ASKING)
        return; /* it was asked twice */
    if (!admission_read(payload, &admission)) {
        member->strange++;
        return;
    }
    if (run_of(admission.badge) != member_run(member))
        memset(&member->beat, 0, sizeof member->beat);
    member->badge = admission.badge;
    member->first = admission.first;
    member->dt = admission.dt;
    member->patience = (uint64_t)(admission.patience * 1e6);
    member->seat = SEAT_IN;
    member->parting = PARTING_NONE;
    member->refusal[0] = '\0';
    member->ticked = member->seen = now;
    member->told = 0;
    member->deaf = false;
    member->age_due = now;
    member->member_due = now + MEMBER_EVERY;
    guard_begin(&member->guard, admission.stops, now);
}

static void hear_age(struct member *member, struct bytes payload, uint64_t n,
                     uint64_t asked, uint64_t now)
{
    struct age age;

    if (!age_read(payload, &age)) {
        member->strange++;
    } else if (member->seat != SEAT_IN) {
        return;
    } else if (age.run == member_run(member)) {
        member->seen = now;
        guard_answer(&member->guard, n, age.seconds, asked);
        guard_take(&member->guard, age.stops, now);
    } else if (now - member->seen > OUT_OF_SIGHT) {
        member_part(member, PARTING_OTHER_RUN, now);
    }
}

/* It ticks, and no tick was heard since it was asked before: this one is deaf. */
static void hear_newest(struct member *member, struct bytes payload, uint64_t n)
{
    uint64_t newest;

    if (!newest_read(payload, &newest)) {
        member->strange++;
    } else if (n == member->beat.n) {
        member->deaf = member->told > 0 && newest > member->told + 1;
        if (member->told == 0)
            member->told = newest;
    }
}

static void hear_member(struct member *member, bool refused, uint64_t now)
{
    if (member->seat != SEAT_IN)
        return;
    member->seen = now;
    if (refused)
        member_part(member, PARTING_LET_GO, now);
}

static void hear_refusal(struct member *member, struct bytes payload, uint64_t now)
{
    size_t size = payload.size;

    if (member->seat != SEAT_ASKING)
        return;
    if (size >= REFUSAL_SIZE)
        size = REFUSAL_SIZE - 1;
    for (size_t i = 0; i < size; i++)
        member->refusal[i] = payload.at[i] < ' ' || payload.at[i] > '~'
                                 ? '?'
                                 : (char)payload.at[i];
    member->refusal[size] = '\0';
    member->join_due = now + MEMBER_REFUSED_EVERY;
}

bool member_answered(struct member *member, uint32_t id, bool refused,
                     struct bytes payload, uint64_t now)
{
    uint32_t slot = id % MEMBER_ASKS;
    enum question what = member->asks[slot].what;
    uint64_t n = member->asks[slot].n, asked = member->asks[slot].at;

    if (id == 0 || member->asks[slot].id != id)
        return false;
    if (!refused) /* anybody can refuse; the clock may only be slower */
        member->asks[slot].id = 0;
    if (what == ASK_JOIN && refused)
        hear_refusal(member, payload, now);
    else if (what == ASK_JOIN)
        hear_admission(member, payload, now);
    else if (what == ASK_MEMBER)
        hear_member(member, refused, now);
    else if (what == ASK_AGE && !refused)
        hear_age(member, payload, n, asked, now);
    else if (what == ASK_NEWEST && !refused)
        hear_newest(member, payload, n);
    return true;
}
