/* Ears: the proof of life of a source, beside that of the ticks (fabric/member.h).
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

/* The number of its question; another than that of likeness. */
#define QUESTION (UINT32_MAX - 2)

void ears_heard(struct woodbot *bot)
{
    struct ears *ears = &bot->inlet.ears;

    ears->came = woodbot_now(bot);
    ears->told = 0;
    ears->missed = 0;
}

bool ears_step(struct woodbot *bot, uint64_t now)
{
    struct ears *ears = &bot->inlet.ears;
    const struct member *member = &bot->member;
    char room[LINK_KEY];

    if (member->source[0] == '\0' || member->seat != SEAT_IN
        || now - ears->came < SILENT || now - ears->asked < SILENT)
        return true;
    ears->asked = now;
    return bot->link.ask(bot->link.self, commands_source(member, room),
                         (struct bytes){NULL, 0}, QUESTION, TIMEOUT);
}

bool ears_answered(struct woodbot *bot, uint32_t id, struct bytes attachment)
{
    struct ears *ears = &bot->inlet.ears;
    struct stamp stamp;

    if (id != QUESTION)
        return false;
    if (!stamp_read(attachment, &stamp)
        || run_of(stamp.badge) != member_run(&bot->member))
        return true;
    if (ears->told > 0 && stamp.n > ears->told)
        ears->missed++;
    ears->told = stamp.n;
    if (ears->missed < MISSED)
        return true;
    ears_heard(bot); /* the next session gets as much time */
    supervisor_fail(&bot->supervisor, CAUSE_DEAF, woodbot_now(bot));
    return true;
}
