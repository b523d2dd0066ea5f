/* SPDX-License-Identifier: Apache-2.0 */
#include "member.h"

#include <string.h>

#include "../wire/keys.h"
#include "../wire/text.h"
#include "../woodbot_schemas.h"

#define MS UINT64_C(1000)

enum { /* ms */
    JOIN_EVERY = 500, JOIN_TIMEOUT = 2000,
    AGE_EVERY = 100, AGE_TIMEOUT = 1000,
    ASK_TIMEOUT = 1000,
    SILENT = 1000,      /* without a tick the clock is asked for its newest */
    NEWEST_EVERY = 500,
    SHOWN_AGAIN = 12000 /* the token of an earlier session is gone by then */
};

void member_start(struct member *member, const struct link *link, const char *fabric,
                  const char *name, const char *source, uint64_t identity)
{
    static const char kind[] = "robot/";
    uint32_t asked = member->asked; /* what was asked before is another's for ever */

    memset(member, 0, sizeof *member);
    member->asked = asked;
    member->link = link;
    member->identity = identity;
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
           && link->answer(link->self, key(member, room, "stop/@holds"));
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
        [ASK_JOIN] = JOIN_TIMEOUT, [ASK_AGE] = AGE_TIMEOUT, [ASK_MEMBER] = ASK_TIMEOUT,
        [ASK_NEWEST] = ASK_TIMEOUT, [ASK_LEAVE] = ASK_TIMEOUT,
    };
    char room[LINK_KEY];
    uint32_t id = ++member->asked != 0 ? member->asked : ++member->asked; /* 0: none */
    uint32_t slot = id % MEMBER_ASKS;

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
static bool ask_member(struct member *member, uint64_t now)
{
    uint8_t room[STAMP_SIZE];

    member->member_due = now + MEMBER_EVERY;
    return ask(member, ASK_MEMBER, "clock/@member", badge_write(room, member->badge), 0,
               now);
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

void member_part(struct member *member, enum parting parting, uint64_t now)
{
    member->seat = SEAT_ASKING;
    member->parting = parting;
    member->fresh = false;
    member->join_due = now;
}

static bool step_in(struct member *member, uint64_t now)
{
    if (now - member->seen > member->patience) {
        member_part(member, PARTING_LOST, now);
        return true;
    }
    if (!show(member, now))
        return false;
    if (now >= member->age_due && !ask_age(member, now))
        return false;
    if (now >= member->member_due && !ask_member(member, now))
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

void member_leave(struct member *member)
{
    uint8_t room[64];

    if (member->seat == SEAT_IN)
        ask(member, ASK_LEAVE, "clock/@leave",
            farewell_write(room, sizeof room, member->badge), 0, 0);
}
