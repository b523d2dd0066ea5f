/* Motors: the last hop. What the wheels obey, and that they stand still by themselves.
 *
 * A task of its own calls `motors_step` every MOTORS_PERIOD ms; nothing that the link
 * does can hold it up. The link's task tells it by `motors_tell`, `motors_stop` and
 * `motors_release`; neither ever waits for the other (one writer each, C11 atomics).
 *
 * A command is obeyed while all of these hold: it is at most `max_age` old by the wall
 * clock, counted from when its source said it; a tick was heard as recently; STOP does
 * not hold; its numbers are finite and in range. Else the pulses stop. Whoever stopped
 * needs a command that was said after that.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef WOODBOT_MOTORS_H
#define WOODBOT_MOTORS_H

#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>

#include "../hardware.h"
#include "../woodbot_schemas.h"

enum { MOTORS_PERIOD = 10 /* ms */ };

/* Why the safe command is obeyed. */
enum why {
    WHY_DRIVEN,         /* it is not: the robot does as it was told */
    WHY_STARTED,        /* told nothing yet, since it started or was released */
    WHY_STOPPED,        /* STOP holds */
    WHY_OLD,            /* what it was told is too old */
    WHY_NO_TICK,        /* the clock is silent */
    WHY_LEFT,           /* it is in no run, or between two */
    WHY_WRONG           /* what it was told is not finite, not in range, or to come */
};

/* How the wheels' speed becomes pulses; of the settings. */
struct servo_settings {
    double trim;        /* us, added to 1500 */
    double dead_band;   /* us from the middle in which it does not turn */
    double top_speed;   /* rad/s at 500 us from the middle; more is not asked of it */
    bool reversed;      /* a longer pulse drives backwards */
};

/* What the link's task tells. */
struct order {
    struct woodbot_command command;
    uint64_t said;      /* us of hardware.now(): its source said it then, or later */
    uint64_t tick;      /* its number: the echo */
};

/* What the motors' task says. */
struct motion {
    struct woodbot_command obeyed;
    uint64_t tick;      /* of the order that is obeyed; 0 for none */
    uint64_t since;     /* us: when it was first obeyed; when the wheels stopped */
    double x, y, heading; /* by the wheels' own speed, since `motors_reset` [m, rad] */
    enum why why;
    uint32_t expired;   /* how often it stopped by itself */
};

struct motors;          /* in motors_private.h: of fixed size */

/* Begin, standing still: no wheel gets a pulse before `motors_set`. */
void motors_start(struct motors *motors, const struct hardware *hardware);

/* The link's task. */
void motors_tell(struct motors *motors, const struct order *order);
/* Of each clock that it needs a tick was heard at that time or later [us]. */
void motors_tick(struct motors *motors, uint64_t heard);
void motors_stop(struct motors *motors, enum why why); /* until the release */
void motors_release(struct motors *motors); /* what was said until now stays unheard */
void motors_reset(struct motors *motors);  /* the odometry is at its origin */
/* False, and nothing changes, for what no servo can be. */
bool motors_set(struct motors *motors, const struct servo_settings settings[2]);
struct motion motors_motion(const struct motors *motors);

/* The motors' task, every MOTORS_PERIOD ms. */
void motors_step(struct motors *motors);

#endif
