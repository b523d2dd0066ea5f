/* SPDX-License-Identifier: Apache-2.0 */
#include <string.h>

#include "../woodbot_private.h"

enum { BLINKS = 3000000 /* us */ };

static void result(struct wire_writer *out)
{
    wire_put_map(out, 1);
    wire_put_text(out, "result");
}

static void error(struct wire_writer *out, const char *sentence)
{
    wire_put_map(out, 1);
    wire_put_text(out, "error");
    wire_put_text(out, sentence);
}

/* -- the verbs ---------------------------------------------------------------------- */

static void blink(struct woodbot *bot, struct wire_writer *out)
{
    bot->blink = woodbot_now(bot) + BLINKS;
    result(out);
    wire_put_nothing(out);
}

static void reset(struct woodbot *bot, struct wire_writer *out)
{
    motors_reset(&bot->motors);
    memset(&bot->state, 0, sizeof bot->state);
    result(out);
    wire_put_nothing(out);
}

static uint32_t figure(const _Atomic uint32_t *figure)
{
    return atomic_load_explicit(figure, memory_order_relaxed);
}

/* Which parts are not there, or wrong: nothing waits for them. */
static void put_parts(const struct woodbot *bot, struct wire_writer *out)
{
    static const char *const names[] = {"lidar/front", "lidar/right", "compass",
                                        "gyro/z"};
    size_t count = 0;

    for (size_t i = 0; i < PARTS; i++)
        count += bot->parts[i] >= READING_ABSENT;
    wire_put_list(out, count);
    for (size_t i = 0; i < PARTS; i++) {
        if (bot->parts[i] >= READING_ABSENT)
            wire_put_text(out, names[i]);
    }
}

/* The board's clock less the fabric's time [s], where the newest tick was made as early
 * as it can have been; and how long that tick took to come, at most [s]. */
static void put_clock(const struct member *member, struct wire_writer *out)
{
    uint64_t made = guard_made(&member->guard, member->beat.n);

    if (made == 0 || made > member->ticked) /* nothing is known yet */
        made = member->ticked;
    wire_put_text(out, "offset");
    wire_put_real(out, (double)made * 1e-6 - member->beat.t);
    wire_put_text(out, "delay");
    wire_put_real(out, (double)(member->ticked - made) * 1e-6);
}

/* As rems_net's drivers of hardware give them, and what only a board knows. */
static void figures(struct woodbot *bot, struct wire_writer *out)
{
    struct motion motion = motors_motion(&bot->motors);

    result(out);
    wire_put_map(out, 13);
    wire_put_text(out, "connected");
    wire_put_flag(out, true);
    wire_put_text(out, "safe");
    wire_put_text(out, report_why(motion.why));
    wire_put_text(out, "age");
    wire_put_real(out, (double)(woodbot_now(bot) - bot->member.ticked) * 1e-6);
    put_clock(&bot->member, out);
    wire_put_text(out, "cycles");
    wire_put_whole(out, figure(&bot->pace.cycles));
    wire_put_text(out, "missed");
    wire_put_whole(out, figure(&bot->pace.missed));
    wire_put_text(out, "worst");
    wire_put_real(out, figure(&bot->pace.worst) * 1e-6);
    wire_put_text(out, "rejected");
    wire_put_whole(out, bot->inlet.dropped);
    wire_put_text(out, "reconnects");
    wire_put_whole(out, bot->supervisor.opened > 0 ? bot->supervisor.opened - 1 : 0);
    wire_put_text(out, "expired");
    wire_put_whole(out, motion.expired);
    wire_put_text(out, "absent");
    put_parts(bot, out);
    wire_put_text(out, "started_by");
    wire_put_whole(out, (uint64_t)bot->hardware.started_by(bot->hardware.self));
}

/* -- calling ------------------------------------------------------------------------ */

const char *const verbs[] = {"blink", "figures", "reset", "servos", NULL};

struct bytes verbs_call(struct woodbot *bot, const char *verb, struct bytes payload)
{
    static void (*const functions[])(struct woodbot *, struct wire_writer *) = {
        blink, figures, reset,
    };
    struct wire_writer out = wire_write(bot->scratch, SCRATCH);

    if (strcmp(verb, "servos") == 0) {
        servos_call(bot, payload, &out);
        return wire_written(&out);
    }
    if (!call_read(payload)) {
        error(&out, "it takes no arguments.");
        return wire_written(&out);
    }
    for (size_t i = 0; i < sizeof functions / sizeof functions[0]; i++) {
        if (strcmp(verbs[i], verb) == 0) {
            functions[i](bot, &out);
            return wire_written(&out);
        }
    }
    error(&out, "there is no such verb; there is blink, figures, reset, servos.");
    return wire_written(&out);
}
