/* SPDX-License-Identifier: Apache-2.0 */
#include "member.h"

#include <math.h>
#include <string.h>

#include "keys.h"
#include "text.h"
#include "../woodbot_schemas.h"

#define MS UINT64_C(1000)

enum { /* ms */
    JOIN_EVERY = 500, JOIN_TIMEOUT = 2000, REFUSED_EVERY = 1000,
    AGE_EVERY = 100, AGE_TIMEOUT = 1000,
    LENT_EVERY = 2000, LENT_AGAIN = 400, LENT_TIMEOUT = 1000,
    SILENT = 1000,      /* without a tick the clock is asked for its newest */
    NEWEST_EVERY = 500,
    OUT_OF_SIGHT = 500, /* after which another run's word counts */
    SHOWN_AGAIN = 12000 /* the token of an earlier session is gone by then */
};

void member_start(struct member *member, const struct link *link, const char *fabric,
                  const char *name, const char *source, uint64_t identity, bool guest)
{
    static const char kind[] = "robot/";

    memset(member, 0, sizeof *member);
    member->link = link;
    member->identity = identity;
    member->guest = guest;
    member->most = guest ? 5000 * MS : UINT64_MAX;
    strncat(member->fabric, fabric, sizeof member->fabric - 1);
    memcpy(member->agent, kind, sizeof kind);
    strncat(member->agent, name, sizeof member->agent - sizeof kind);
    strncat(member->source, source, sizeof member->source - 1);
}

uint64_t member_run(const struct member *member)
{
    return run_of(member->badge);
}

const char *member_within(const struct member *member, const char *key)
{
    size_t size = strlen(member->fabric);

    if (strncmp(key, member->fabric, size) != 0 || key[size] != '/')
        return NULL;
    return key + size + 1;
}

/* -- what is declared ------------------------------------------------------------ */

static const char *key(const struct member *member, char room[LINK_KEY],
                       const char *rest)
{
    return key_of(room, member->fabric, rest, "");
}

bool member_declare(struct member *member, uint64_t now)
{
    const struct link *link = member->link;
    char room[LINK_KEY];

    member->seat = SEAT_ASKING;
    member->join_due = now;
    member->shown = 0;
    return link->subscribe(link->self, key(member, room, "clock/tick"))
           && link->subscribe(link->self, key(member, room, "stop"))
           && link->answer(link->self, key(member, room, "stop/@holds"))
           && (!member->guest
               || link->subscribe(link->self, key(member, room, "clock/@step/roster")));
}

static const char *token(const struct member *member, char room[LINK_KEY])
{
    char chunk[40];
    struct text text = text_in(chunk, sizeof chunk);

    text_say(&text, "clock/@member/");
    text_whole(&text, member->shown);
    return key(member, room, chunk);
}

static void hide(struct member *member)
{
    char room[LINK_KEY];

    if (member->shown != 0)
        member->link->forget(member->link->self, token(member, room));
    member->shown = 0;
}

void member_forget(struct member *member)
{
    static const char *const keys[] = {
        "clock/tick", "stop", "stop/@holds", "clock/@step/roster",
    };
    char room[LINK_KEY];

    hide(member);
    for (size_t i = 0; i < (member->guest ? 4 : 3); i++)
        member->link->forget(member->link->self, key(member, room, keys[i]));
    member_gone(member);
}

void member_gone(struct member *member)
{
    member->seat = SEAT_NONE;
    member->shown = 0;
    member->fresh = member->deaf = false;
    memset(member->asks, 0, sizeof member->asks);
}

/* -- what is asked --------------------------------------------------------------- */

static bool ask(struct member *member, enum question what, const char *selector,
                struct bytes payload, uint64_t n, uint64_t now)
{
    static const uint32_t timeouts[] = {
        [ASK_JOIN] = JOIN_TIMEOUT, [ASK_AGE] = AGE_TIMEOUT, [ASK_LENT] = LENT_TIMEOUT,
        [ASK_NEWEST] = LENT_TIMEOUT, [ASK_LEAVE] = LENT_TIMEOUT,
    };
    char room[LINK_KEY];
    uint32_t slot = ++member->asked % MEMBER_ASKS;
    uint32_t id = member->asked << 1 | member->guest;

    if (id == 0) /* as it is after four thousand million: it would mean none */
        id = 2;
    member->asks[slot].id = id;
    member->asks[slot].what = what;
    member->asks[slot].n = n;
    member->asks[slot].at = now;
    return member->link->ask(member->link->self, key(member, room, selector), payload,
                             id, timeouts[what]);
}

static const struct bytes nothing = {NULL, 0};

static bool ask_in(struct member *member, uint64_t now)
{
    uint8_t room[WOODBOT_MAX_JOIN];
    struct request request = {member->agent, member->identity, member->source,
                              member->guard.stopped};

    member->join_due = now + JOIN_EVERY * MS;
    return ask(member, ASK_JOIN, "clock/@join",
               request_write(room, sizeof room, &request), 0, now);
}

static bool ask_age(struct member *member, uint64_t now)
{
    char selector[40];
    struct text text = text_in(selector, sizeof selector);
    uint64_t n = member->beat.n > 0 ? member->beat.n : member->first - 1;

    text_say(&text, "clock/@age?n=");
    text_whole(&text, n);
    member->age_due = now + AGE_EVERY * MS;
    return ask(member, ASK_AGE, selector, nothing, n, now);
}

/* Whether this is a member still: the clock refuses who is none. */
static bool ask_lent(struct member *member, uint64_t now)
{
    uint8_t room[NAME_SIZE + 16];

    member->lent_due = now + (member->is_known ? LENT_EVERY : LENT_AGAIN) * MS;
    return ask(member, ASK_LENT, "clock/@lent",
               lent_write(room, sizeof room, member->badge, member->lent), 0, now);
}

static bool show(struct member *member, uint64_t now)
{
    char room[LINK_KEY];
    bool again = member->shown == member->badge;

    if (again && now < member->shown_due)
        return true;
    hide(member);
    member->shown = member->badge;
    member->shown_due = again ? UINT64_MAX : now + SHOWN_AGAIN * MS;
    return member->link->token(member->link->self, token(member, room));
}

static void part(struct member *member, enum parting parting, uint64_t now)
{
    member->seat = SEAT_ASKING;
    member->parting = parting;
    member->fresh = false;
    member->join_due = now;
}

static bool step_in(struct member *member, uint64_t now)
{
    if (now - member->seen > member->patience) {
        part(member, PARTING_LOST, now);
        return true;
    }
    if (!show(member, now))
        return false;
    if (now >= member->age_due && !ask_age(member, now))
        return false;
    if (now >= member->lent_due && !ask_lent(member, now))
        return false;
    if (now - member->ticked > SILENT * MS && now >= member->newest_due) {
        member->newest_due = now + NEWEST_EVERY * MS;
        return ask(member, ASK_NEWEST, "clock/tick", nothing, member->beat.n, now);
    }
    return true;
}

bool member_step(struct member *member, uint64_t now)
{
    const struct link *link = member->link;
    char room[LINK_KEY];

    if (member->seat == SEAT_NONE)
        return true;
    if (member->guard.again) {
        member->guard.again = false;
        if (!link->put(link->self, key(member, room, "stop"), stop_write(), "", nothing,
                       true))
            return false;
    }
    if (member->seat == SEAT_IN)
        return step_in(member, now);
    return now < member->join_due || ask_in(member, now);
}

bool member_done(struct member *member)
{
    char room[LINK_KEY];
    uint8_t done[STAMP_SIZE];

    member->fresh = false;
    return member->link->put(member->link->self, key(member, room, "clock/@step/done"),
                             done_write(done, member->badge, member->beat.n), "",
                             nothing, false);
}

void member_leave(struct member *member, const char *early)
{
    uint8_t room[3 * REFUSAL_SIZE];

    if (member->seat == SEAT_IN)
        ask(member, ASK_LEAVE, "clock/@leave",
            farewell_write(room, sizeof room, member->badge, member->agent, early), 0,
            0);
}

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

static void hear_roster(struct member *member, struct bytes payload, uint64_t now)
{
    struct mention mention;

    if (!roster_read(payload, member->badge, &mention)) {
        member->strange++;
        return;
    }
    if (member->seat != SEAT_IN || mention.run != member_run(member)
        || mention.epoch <= member->epoch || mention.first < member->first)
        return;
    member->epoch = mention.epoch;
    if (!mention.named)
        part(member, PARTING_LET_GO, now);
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
    } else if (strcmp(rest, "clock/@step/roster") == 0) {
        hear_roster(member, payload, now);
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
    if (run_of(admission.badge) != member_run(member)) {
        memset(&member->beat, 0, sizeof member->beat);
        member->epoch = 0;
    }
    if (member->badge != admission.badge)
        member->is_known = member->lent[0] == '\0'; /* it knows of no loan */
    member->badge = admission.badge;
    member->first = admission.first;
    member->dt = admission.dt;
    member->patience = (uint64_t)(admission.patience * 1e6);
    if (member->patience > member->most)
        member->patience = member->most;
    member->seat = SEAT_IN;
    member->parting = PARTING_NONE;
    member->refusal[0] = '\0';
    member->ticked = member->seen = now;
    member->told = 0;
    member->deaf = false;
    member->age_due = now;
    member->lent_due = now + (member->is_known ? LENT_EVERY * MS : 0);
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
    } else if (now - member->seen > OUT_OF_SIGHT * MS) {
        part(member, PARTING_OTHER_RUN, now);
    }
}

/* It ticks, and no tick was heard since it was asked before: this one is deaf. */
static void hear_newest(struct member *member, struct bytes payload, uint64_t n)
{
    uint64_t newest;
    double pace;

    if (!newest_read(payload, &newest, &pace)) {
        member->strange++;
    } else if (n == member->beat.n) {
        member->deaf = member->told > 0 && newest > member->told + 1;
        if (member->told == 0)
            member->told = newest;
    }
}

static void hear_lent(struct member *member, bool refused, uint64_t now)
{
    if (member->seat != SEAT_IN)
        return;
    member->seen = now;
    if (refused) {
        part(member, PARTING_LET_GO, now);
        return;
    }
    member->is_known = true;
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
    member->join_due = now + REFUSED_EVERY * MS;
}

bool member_answered(struct member *member, uint32_t id, bool refused,
                     struct bytes payload, uint64_t now)
{
    uint32_t slot = (id >> 1) % MEMBER_ASKS;
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
    else if (what == ASK_LENT)
        hear_lent(member, refused, now);
    else if (what == ASK_AGE && !refused)
        hear_age(member, payload, n, asked, now);
    else if (what == ASK_NEWEST && !refused)
        hear_newest(member, payload, n);
    return true;
}
