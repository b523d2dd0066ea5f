/* SPDX-License-Identifier: Apache-2.0 */
#include "woodbot.h"

#include <string.h>

#include "woodbot_private.h"

enum { NO_CLOCK = 20000 /* ms after which another of the router's addresses is tried */ };

size_t woodbot_size(void)
{
    return sizeof(struct woodbot);
}

uint64_t woodbot_now(const struct woodbot *bot)
{
    return bot->hardware.now(bot->hardware.self);
}

bool woodbot_stopped(const struct woodbot *bot)
{
    return bot->member.guard.stopped;
}

void woodbot_broken(struct woodbot *bot)
{
    supervisor_fail(&bot->supervisor, CAUSE_PUT, woodbot_now(bot));
}

/* -- standing still --------------------------------------------------------------- */

static enum why reason(const struct woodbot *bot)
{
    if (woodbot_stopped(bot))
        return WHY_STOPPED;
    return bot->member.seat == SEAT_IN ? WHY_DRIVEN : WHY_LEFT;
}

void woodbot_hold(struct woodbot *bot)
{
    enum why why = reason(bot);

    if (why == bot->held)
        return;
    bot->held = why;
    commands_clear(bot);
    bot->test = TEST_NONE;
    if (why == WHY_DRIVEN)
        motors_release(&bot->motors);
    else
        motors_stop(&bot->motors, why);
}

/* -- the session ------------------------------------------------------------------ */

static bool declare(void *self)
{
    struct woodbot *bot = self;
    uint64_t now = woodbot_now(bot);

    bot->asked_in = now;
    return commands_declare(bot, &bot->member) && answers_declare(bot, &bot->member)
           && member_declare(&bot->member, now);
}

static void gone(void *self)
{
    struct woodbot *bot = self;

    member_gone(&bot->member);
    woodbot_hold(bot);
}

static void find_locators(struct woodbot *bot)
{
    size_t count = 0;

    for (size_t i = 0; i < SETTINGS_ROUTERS; i++) {
        if (bot->settings.router[i][0] != '\0')
            bot->locators[count++] = bot->settings.router[i];
    }
    if (count == 0)
        bot->locators[count++] = "";
    bot->locators[count] = NULL;
}

/* What the settings say, from now on. */
static void settle(struct woodbot *bot)
{
    const struct settings *settings = &bot->settings;
    struct network_settings network = {settings->ssid, settings->password,
                                       settings->user, settings->name};
    struct guard guard = bot->member.guard; /* STOP holds on */

    find_locators(bot);
    motors_set(&bot->motors, settings->servo);
    bot->link.join(bot->link.self, &network);
    member_start(&bot->member, &bot->link, settings->fabric, settings->name,
                 settings->source, bot->hardware.identity(bot->hardware.self));
    bot->member.guard = guard;
    commands_clear(bot);
}

static void change(struct woodbot *bot)
{
    if (!bot->changed)
        return;
    bot->changed = false;
    member_leave(&bot->member);
    supervisor_fail(&bot->supervisor, CAUSE_SETTINGS, woodbot_now(bot));
    supervisor_step(&bot->supervisor, woodbot_now(bot)); /* by its old name */
    settle(bot);
}

/* Where there are other addresses, one without a clock is left for the next. */
static void look_further(struct woodbot *bot, uint64_t now)
{
    if (bot->member.seat != SEAT_ASKING || bot->member.refusal[0] != '\0')
        bot->asked_in = now;
    else if (bot->locators[1] != NULL && now - bot->asked_in > NO_CLOCK * 1000u)
        supervisor_fail(&bot->supervisor, CAUSE_SILENT, now);
}

/* -- once round ------------------------------------------------------------------- */

static void go_on(struct woodbot *bot, uint64_t now)
{
    bool well = member_step(&bot->member, now) && compatibility_step(bot, now)
                && liveness_step(bot, now);

    lease_step(bot, now);
    woodbot_hold(bot);
    if (well && bot->member.fresh)
        well = report_tick(bot);
    if (!well)
        woodbot_broken(bot);
    else if (bot->member.deaf)
        supervisor_fail(&bot->supervisor, CAUSE_DEAF, now);
    look_further(bot, now);
}

void woodbot_start(struct woodbot *bot, const struct hardware *hardware,
                   const struct link *link)
{
    memset(bot, 0, sizeof *bot);
    bot->hardware = *hardware;
    bot->link = *link;
    motors_start(&bot->motors, &bot->hardware);
    bot->held = WHY_LEFT;
    motors_stop(&bot->motors, WHY_LEFT);
    bot->pace.due = woodbot_now(bot);
    settings_load(&bot->settings, &bot->hardware);
    settle(bot);

    bot->supervisor.link = &bot->link;
    bot->supervisor.locators = bot->locators;
    bot->supervisor.declare = declare;
    bot->supervisor.gone = gone;
    bot->supervisor.context = bot;
    supervisor_start(&bot->supervisor);

    bot->console.hardware = &bot->hardware;
    bot->console.link = &bot->link;
    bot->console.settings = &bot->settings;
    operator_host(bot, &bot->console.host);
    console_start(&bot->console);
}

void woodbot_run(struct woodbot *bot, uint32_t ms)
{
    uint64_t now = woodbot_now(bot);

    console_step(&bot->console, now);
    change(bot);
    supervisor_step(&bot->supervisor, now);
    operator_test(bot, now);
    bot->link.poll(bot->link.self, ms);
    now = woodbot_now(bot);
    if (bot->supervisor.phase == PHASE_OPEN)
        go_on(bot, now);
    leds_show(bot, now);
}

/* Only the motors' task writes, so this needs no more than to load and store. */
static void count(_Atomic uint32_t *figure, uint32_t more)
{
    uint32_t now = atomic_load_explicit(figure, memory_order_relaxed);

    atomic_store_explicit(figure, now + more, memory_order_relaxed);
}

void woodbot_drive(struct woodbot *bot)
{
    enum { PERIOD = MOTORS_PERIOD * 1000 };
    struct pace *pace = &bot->pace;
    uint64_t now = woodbot_now(bot), late = now > pace->due ? now - pace->due : 0;

    motors_step(&bot->motors);
    count(&pace->cycles, 1);
    if (late > atomic_load_explicit(&pace->worst, memory_order_relaxed))
        atomic_store_explicit(&pace->worst, (uint32_t)late, memory_order_relaxed);
    count(&pace->missed, (uint32_t)(late / PERIOD));
    pace->due = now - late % PERIOD + PERIOD;
}

/* -- what the link tells ----------------------------------------------------------- */

void woodbot_heard(struct woodbot *bot, const char *key, struct bytes payload,
                   const char *encoding, struct bytes attachment)
{
    uint64_t now = woodbot_now(bot);

    if (!member_heard(&bot->member, key, payload, now))
        commands_heard(bot, key, payload, encoding, attachment);
    woodbot_hold(bot); /* STOP is acted upon when it is heard */
    if (bot->member.fresh)
        motors_tick(&bot->motors, bot->member.ticked);
}

void woodbot_asked(struct woodbot *bot, void *question, const char *key,
                   const char *parameters, struct bytes payload)
{
    answers_asked(bot, question, key, parameters, payload);
}

void woodbot_answered(struct woodbot *bot, uint32_t id, bool refused,
                      struct bytes payload, struct bytes attachment)
{
    uint64_t now = woodbot_now(bot);

    if (!member_answered(&bot->member, id, refused, payload, now) && !refused
        && !compatibility_answered(bot, id, payload))
        liveness_answered(bot, id, attachment);
    woodbot_hold(bot);
    commands_obey(bot);
}
