/* SPDX-License-Identifier: Apache-2.0 */
#include "../wire/text.h"
#include "../woodbot_private.h"

enum { TURNING = 600000 /* us that each wheel is tested for */ };

#define TRIED (WOODBOT_MAX_WHEEL_SPEED / 4)

/* -- status ------------------------------------------------------------------------- */

static void line(struct text *text, const char *name, const char *value)
{
    text_join(text, name, " ", value);
    text_say(text, "\r\n");
}

static const char *describe_seat(const struct member *member)
{
    static const char *const seats[] = {
        "no session", "no clock has let it in yet", "in",
    };

    return member->refusal[0] != '\0' ? member->refusal : seats[member->seat];
}

static const char *describe_phase(const struct supervisor *supervisor)
{
    static const char *const phases[] = {
        "waits for the network", "opens a session", "declares", "open", "closes",
        "waits a moment",
    };

    return phases[supervisor->phase];
}

static const char *describe_reset(enum reset reset)
{
    static const char *const resets[] = {
        "power", "asked", "brown-out", "watchdog", "crash",
    };

    return resets[reset];
}

static const char *describe_driven(const struct woodbot *bot)
{
    enum why why = motors_motion(&bot->motors).why;

    return why == WHY_DRIVEN ? "driven" : report_why(why);
}

static void status(void *self, char *room, size_t size)
{
    struct woodbot *bot = self;
    struct text text = text_in(room, size);

    line(&text, "robot", bot->member.agent);
    line(&text, "fabric", bot->member.fabric);
    text_say(&text, "wifi ");
    line(&text, bot->settings.ssid,
         network_describe(bot->link.network(bot->link.self)));
    line(&text, "link", describe_phase(&bot->supervisor));
    line(&text, "last", supervisor_why(bot->supervisor.cause));
    line(&text, "seat", describe_seat(&bot->member));
    if (bot->lease.badge != 0)
        line(&text, "leased to", bot->lease.holder);
    line(&text, "motors", describe_driven(bot));
    line(&text, "started",
         describe_reset(bot->hardware.started_by(bot->hardware.self)));
    text_say(&text, "sessions ");
    text_whole(&text, bot->supervisor.opened);
    text_say(&text, "\r\nrefused ");
    text_whole(&text, bot->inlet.dropped);
    text_say(&text, "\r\n");
}

/* -- tests -------------------------------------------------------------------------- */

static void say_part(struct text *text, const struct woodbot *bot, size_t part,
                     const char *name, double value, const char *unit)
{
    enum reading reading = bot->parts[part];

    text_say(text, name);
    text_say(text, " ");
    if (reading == READING_ABSENT) {
        text_say(text, "absent");
    } else if (reading == READING_WRONG) {
        text_say(text, "answers nonsense");
    } else {
        text_real(text, value);
        text_say(text, unit);
    }
    text_say(text, "\r\n");
}

static void test_sensors(struct woodbot *bot, struct text *text)
{
    const struct woodbot_sensors *sensors = &bot->sensors;

    report_sense(bot);
    say_part(text, bot, 0, "lidar/front", sensors->lidar_front, " m");
    say_part(text, bot, 1, "lidar/right", sensors->lidar_right, " m");
    say_part(text, bot, 2, "compass/x", sensors->compass_x, "");
    say_part(text, bot, 2, "compass/y", sensors->compass_y, "");
    say_part(text, bot, 3, "gyro/z", sensors->gyro_z, " rad/s");
}

static void test_servos(struct woodbot *bot, struct text *text)
{
    if (woodbot_stopped(bot)) {
        text_say(text, "STOP holds: it stands still\r\n");
        return;
    }
    if (motors_motion(&bot->motors).why == WHY_DRIVEN) {
        text_say(text, "it is driven from the fabric\r\n");
        return;
    }
    text_say(text, "the left wheel turns ahead, then the right one\r\n");
    motors_release(&bot->motors);
    bot->test = TEST_LEFT;
    bot->test_until = woodbot_now(bot) + TURNING;
}

static void test(void *self, const char *what, char *room, size_t size)
{
    struct woodbot *bot = self;
    struct text text = text_in(room, size);

    if (what[1] == 'e' && what[3] == 's') /* sensors, not servos */
        test_sensors(bot, &text);
    else
        test_servos(bot, &text);
}

/* Go on with a test: by orders that are as short-lived as any. */
void operator_test(struct woodbot *bot, uint64_t now)
{
    struct order order = {{0, 0}, now, 0};

    if (bot->test == TEST_NONE)
        return;
    if (now > bot->test_until) {
        bot->test_until = now + TURNING;
        bot->test = bot->test == TEST_LEFT ? TEST_RIGHT : TEST_NONE;
    }
    if (bot->test == TEST_NONE) {
        if (bot->held == WHY_DRIVEN)
            motors_release(&bot->motors);
        else
            motors_stop(&bot->motors, bot->held);
        return;
    }
    if (bot->test == TEST_LEFT)
        order.command.wheel_left = TRIED;
    else
        order.command.wheel_right = TRIED;
    motors_tick(&bot->motors, now);
    motors_tell(&bot->motors, &order);
}

/* ----------------------------------------------------------------------------------- */

static void changed(void *self)
{
    struct woodbot *bot = self;

    bot->changed = true;
}

static void reset(void *self)
{
    struct woodbot *bot = self;

    motors_stop(&bot->motors, WHY_LEFT);
    bot->hardware.restart(bot->hardware.self);
}

void operator_host(struct woodbot *bot, struct console_host *host)
{
    host->self = bot;
    host->status = status;
    host->changed = changed;
    host->test = test;
    host->reset = reset;
}
