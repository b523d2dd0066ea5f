/* Liveness: the proof of life of a source, beside that of the ticks (fabric/member.h).
 *
 * A session has been seen whose questions were answered while nothing that was put came
 * any more. So a robot that hears nothing of its source asks that for its value: if its
 * tick goes on and on meanwhile, the robot is commanded, but deaf.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#include "../wire/keys.h"
#include "../woodbot_private.h"

enum {
    SILENT = 1000000,   /* us without a value; and between two questions */
    TIMEOUT = 800,      /* ms */
    MISSED = 2          /* values in a row: one may be on its way */
};

/* The number of its question; another than that of compatibility. */
#define QUESTION (UINT32_MAX - 2)

void liveness_heard(struct woodbot *bot)
{
    struct liveness *liveness = &bot->inlet.liveness;

    liveness->came = woodbot_now(bot);
    liveness->told = 0;
    liveness->missed = 0;
}

bool liveness_step(struct woodbot *bot, uint64_t now)
{
    struct liveness *liveness = &bot->inlet.liveness;
    const struct member *member = &bot->member;
    char room[LINK_KEY];

    if (member->source[0] == '\0' || member->seat != SEAT_IN
        || now - liveness->came < SILENT || now - liveness->asked < SILENT)
        return true;
    liveness->asked = now;
    return bot->link.ask(bot->link.self, commands_source(member, room),
                         (struct bytes){NULL, 0}, QUESTION, TIMEOUT);
}

bool liveness_answered(struct woodbot *bot, uint32_t id, struct bytes attachment)
{
    struct liveness *liveness = &bot->inlet.liveness;
    struct stamp stamp;

    if (id != QUESTION)
        return false;
    if (!stamp_read(attachment, &stamp)
        || run_of(stamp.badge) != member_run(&bot->member))
        return true;
    if (liveness->told > 0 && stamp.n > liveness->told)
        liveness->missed++;
    liveness->told = stamp.n;
    if (liveness->missed < MISSED)
        return true;
    liveness_heard(bot); /* the next session gets as much time */
    supervisor_fail(&bot->supervisor, CAUSE_DEAF, woodbot_now(bot));
    return true;
}
