/* Lease: a run elsewhere commands this robot, and nobody else does (docs/time.md).
 *
 * Its holder asks for it again and again. It ends when it is given back, when a teacher
 * takes it back, or when it was not asked for again in time; the robot stands then until
 * it is told something new.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#include <string.h>

#include "../wire/keys.h"
#include "../wire/text.h"
#include "../woodbot_private.h"

enum { LENGTH = 1000000 /* us: twice as long as a command is obeyed */ };

/* What was said before does not count any more. */
static void stand(struct woodbot *bot)
{
    commands_clear(bot);
    motors_stop(&bot->motors, WHY_LEFT);
    bot->held = WHY_LEFT;
    woodbot_hold(bot); /* it may be driven anew, unless STOP holds */
}

static void end(struct woodbot *bot)
{
    memset(&bot->lease, 0, sizeof bot->lease);
    stand(bot);
}

static void reply(struct woodbot *bot, void *question, const char *key,
                  struct wire_writer *out)
{
    bot->link.reply(bot->link.self, question, key, wire_written(out),
                    "application/msgpack", (struct bytes){NULL, 0});
}

/* Why nobody gets the lease with this badge; false if somebody does. */
static bool is_refused(const struct woodbot *bot, uint64_t badge, struct text *why)
{
    const struct member *member = &bot->member;
    const struct lease *lease = &bot->lease;

    if (member->source[0] != '\0')
        text_join(why, member->source, " commands it there, and nobody else does", "");
    else if (lease->badge != 0 && lease->badge != badge)
        text_join(why, "it is leased to ", lease->holder,
                  "; wait until that run has ended, or take another robot");
    return why->size > 0;
}

void lease_asked(struct woodbot *bot, void *question, const char *key,
                 struct bytes payload)
{
    struct lease *lease = &bot->lease;
    struct text why = text_in((char *)bot->scratch, SCRATCH);
    struct wire_writer out;
    struct claim claim;
    bool is_taken;

    lease_step(bot, woodbot_now(bot));
    if (!claim_read(payload, &claim)) {
        bot->link.refuse(bot->link.self, question, "expected a claim: [badge, holder]");
        return;
    }
    is_taken = claim.badge == bot->taken.badge;
    if (!is_taken && is_refused(bot, claim.badge, &why)) {
        bot->link.refuse(bot->link.self, question, why.at);
        return;
    }
    if (claim.holder[0] == '\0') {
        if (lease->badge == claim.badge)
            end(bot);
    } else if (!is_taken) {
        if (lease->badge == 0)
            stand(bot);
        lease->badge = claim.badge;
        lease->until = woodbot_now(bot) + LENGTH;
        memcpy(lease->holder, claim.holder, sizeof lease->holder);
    }
    out = wire_write(bot->scratch, SCRATCH);
    if (is_taken)
        wire_put_text(&out, bot->taken.holder);
    else
        wire_put_real(&out, LENGTH * 1e-6);
    reply(bot, question, key, &out);
}

void lease_taken(struct woodbot *bot, void *question, const char *key,
                 struct bytes payload)
{
    struct wire_writer out;
    struct claim claim;

    lease_step(bot, woodbot_now(bot));
    if (!claim_read(payload, &claim) || claim.holder[0] == '\0') {
        bot->link.refuse(bot->link.self, question, "expected [1, the taker's name]");
        return;
    }
    out = wire_write(bot->scratch, SCRATCH);
    wire_put_text(&out, bot->lease.holder);
    if (bot->lease.badge != 0) {
        bot->taken = claim;
        bot->taken.badge = bot->lease.badge;
        end(bot);
    }
    reply(bot, question, key, &out);
}

void lease_step(struct woodbot *bot, uint64_t now)
{
    if (bot->lease.badge != 0 && now > bot->lease.until)
        end(bot);
}
