/* SPDX-License-Identifier: Apache-2.0 */
#include "motors.h"

#include <math.h>
#include <string.h>

#include "motors_private.h"

#if defined __FAST_MATH__ || __FINITE_MATH_ONLY__ + 0
#error "NaN must not compare as in range: compile without -ffast-math"
#endif

enum {
    MIDDLE = 1500,              /* us: a servo stands */
    REACH = 500,                /* us from there: at its top speed */
    SHORTEST = 700, LONGEST = 2300 /* us: what a servo takes for a pulse */
};

static bool is_within(double value, double min, double max)
{
    return min <= value && value <= max; /* false for NaN */
}

/* -- the link's task ------------------------------------------------------------- */

static uint64_t now(const struct motors *motors)
{
    return motors->hardware->now(motors->hardware->self);
}

static void tell(struct motors *motors)
{
    handover_write(&motors->told, &motors->telling, sizeof motors->telling);
}

/* Whether all fields are in their ranges. The codec saw to it; wheels trust nobody. */
static bool is_possible(const struct woodbot_command *command)
{
    const struct codec_schema *schema = &woodbot_command_schema;

    for (size_t i = 0; i < schema->count; i++) {
        const struct codec_field *field = &schema->fields[i];
        double value;

        memcpy(&value, (const char *)command + field->offset, sizeof value);
        if (!is_within(value, field->min, field->max))
            return false;
    }
    return true;
}

void motors_tell(struct motors *motors, const struct order *order)
{
    struct told *telling = &motors->telling;

    telling->order = *order;
    telling->ordered = true;
    /* What claims to come from the future would be obeyed when that has come. */
    telling->wrong = !is_possible(&order->command) || order->said > now(motors);
    tell(motors);
}

void motors_tick(struct motors *motors, uint64_t heard)
{
    motors->telling.ticked = heard;
    tell(motors);
}

void motors_stop(struct motors *motors, enum why why)
{
    motors->telling.hold = (uint8_t)(why == WHY_DRIVEN ? WHY_STOPPED : why);
    motors->telling.ordered = false;
    tell(motors);
}

void motors_release(struct motors *motors)
{
    if (motors->telling.hold != WHY_DRIVEN)
        motors->telling.after = now(motors);
    motors->telling.hold = WHY_DRIVEN;
    motors->telling.ordered = false;
    tell(motors);
}

void motors_reset(struct motors *motors)
{
    motors->telling.resets++;
    tell(motors);
}

static bool is_servo(const struct servo_settings *servo)
{
    return is_within(servo->trim, -REACH, REACH)
           && is_within(servo->dead_band, 0, REACH / 2)
           && is_within(servo->top_speed, 0.01, 100);
}

bool motors_set(struct motors *motors, const struct servo_settings settings[2])
{
    if (!is_servo(&settings[WHEEL_LEFT]) || !is_servo(&settings[WHEEL_RIGHT]))
        return false;
    memcpy(motors->telling.servo, settings, sizeof motors->telling.servo);
    tell(motors);
    return true;
}

struct motion motors_motion(const struct motors *motors)
{
    struct motion motion;

    /* Again only if two steps of MOTORS_PERIOD were made while one was read. */
    while (!handover_read(&motors->said, &motion, sizeof motion))
        ;
    return motion;
}

/* -- the motors' task ------------------------------------------------------------ */

static bool is_young(uint64_t then, uint64_t now)
{
    return then <= now && now - then <= WOODBOT_MAX_AGE_US;
}

/* Why the newest order must not be obeyed; WHY_DRIVEN if it may. */
static enum why judge(const struct motors *motors, uint64_t now)
{
    const struct told *heard = &motors->heard;

    if (heard->hold != WHY_DRIVEN)
        return (enum why)heard->hold;
    if (!heard->ordered || heard->order.said <= heard->after)
        return WHY_STARTED;
    if (heard->wrong)
        return WHY_WRONG;
    if (!is_young(heard->order.said, now))
        return WHY_OLD;
    if (!is_young(heard->ticked, now))
        return WHY_NO_TICK;
    if (motors->motion.why != WHY_DRIVEN && heard->order.said <= motors->stood)
        return motors->motion.why; /* said before it stopped by itself */
    return WHY_DRIVEN;
}

static void stand(struct motors *motors, enum why why, uint64_t now)
{
    struct motion *motion = &motors->motion;

    if (motion->why == WHY_DRIVEN) {
        motors->stood = motion->since = now;
        if (why == WHY_OLD || why == WHY_NO_TICK || why == WHY_WRONG)
            motion->expired++;
    }
    motion->why = why;
    motion->tick = 0;
    codec_defaults(&woodbot_command_schema, &motion->obeyed);
}

static void obey(struct motors *motors, uint64_t now)
{
    struct motion *motion = &motors->motion;
    const struct order *order = &motors->heard.order;

    if (motion->why != WHY_DRIVEN || motion->tick != order->tick)
        motion->since = now;
    motion->why = WHY_DRIVEN;
    motion->tick = order->tick;
    motion->obeyed = order->command;
}

/* What a wheel can do of what it is told: up to its top speed. */
static double speed(const struct motors *motors, enum wheel wheel)
{
    const struct woodbot_command *obeyed = &motors->motion.obeyed;
    double top = motors->heard.servo[wheel].top_speed;
    double told = wheel == WHEEL_LEFT ? obeyed->wheel_left : obeyed->wheel_right;

    return told > top ? top : told < -top ? -top : told;
}

/* Add what the wheels have done since the last step: a circle's arc, by its chord. */
static void go_on(struct motors *motors, uint64_t now)
{
    struct motion *motion = &motors->motion;
    double left = speed(motors, WHEEL_LEFT), right = speed(motors, WHEEL_RIGHT);
    double time = (double)(now - motors->stepped) * 1e-6;
    double way = WOODBOT_WHEEL_RADIUS * (left + right) / 2 * time;
    double turn = WOODBOT_WHEEL_RADIUS * (right - left) / WOODBOT_TRACK * time;

    motors->stepped = now;
    motion->x += way * cos(motion->heading + turn / 2);
    motion->y += way * sin(motion->heading + turn / 2);
    motion->heading += turn;
}

static unsigned pulse(const struct servo_settings *servo, double speed)
{
    double offset = 0, pulse;

    if (!is_servo(servo)) /* it was not set yet */
        return 0;
    if (speed != 0)
        offset = servo->dead_band
                 + (REACH - servo->dead_band) * fabs(speed) / servo->top_speed;
    if ((speed < 0) != servo->reversed)
        offset = -offset;
    pulse = MIDDLE + servo->trim + offset;
    if (!is_within(pulse, SHORTEST, LONGEST))
        pulse = pulse < SHORTEST ? SHORTEST : LONGEST;
    return (unsigned)(pulse + 0.5);
}

static void turn_wheels(const struct motors *motors)
{
    const struct hardware *hardware = motors->hardware;
    bool driven = motors->motion.why == WHY_DRIVEN;

    for (enum wheel wheel = WHEEL_LEFT; wheel <= WHEEL_RIGHT; wheel++) {
        const struct servo_settings *servo = &motors->heard.servo[wheel];
        double told = speed(motors, wheel);

        hardware->servo(hardware->self, wheel, driven ? pulse(servo, told) : 0);
    }
}

void motors_step(struct motors *motors)
{
    struct motion *motion = &motors->motion;
    uint32_t resets = motors->heard.resets;
    uint64_t time;
    enum why why;

    /* Where the link's task is too fast, what was heard before goes on growing old. */
    (void)handover_read(&motors->told, &motors->heard, sizeof motors->heard);
    time = now(motors);
    go_on(motors, time);
    if (motors->heard.resets != resets)
        motion->x = motion->y = motion->heading = 0;
    why = judge(motors, time);
    if (why == WHY_DRIVEN)
        obey(motors, time);
    else
        stand(motors, why, time);
    turn_wheels(motors);
    motors->hardware->feed(motors->hardware->self);
    handover_write(&motors->said, motion, sizeof *motion);
}

/* -------------------------------------------------------------------------------- */

void motors_start(struct motors *motors, const struct hardware *hardware)
{
    memset(motors, 0, sizeof *motors);
    motors->hardware = hardware;
    motors->stepped = motors->telling.after = now(motors);
    motors->motion.why = WHY_STARTED;
    motors->motion.since = motors->stepped;
    motors->heard = motors->telling;
    tell(motors);
    handover_write(&motors->said, &motors->motion, sizeof motors->motion);
}
