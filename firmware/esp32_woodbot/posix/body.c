/* The body: FS90R servos with a dead band and saturation, wheels that roll, a round
 * wall. Dimensions are those of the definition.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#include <math.h>

#include "body.h"
#include "woodbot_schemas.h"

/* m ahead of the axle */
static const double LENS[2] = {WOODBOT_LIDAR_FRONT, WOODBOT_LIDAR_RIGHT};
static const double MARGIN = 0.06; /* m from the axle's middle to the wall */
static const double MIDDLE = 1500, FULL = 500; /* us */
static const uint64_t STEP = 5000; /* us */

void body_default(struct body *body)
{
    /* The dead band is that of servos since 2014. */
    const struct servo servo = {0, 45, WOODBOT_MAX_WHEEL_SPEED, 0};

    *body = (struct body){.servo = {servo, servo},
                          .arena_radius = WOODBOT_ARENA_RADIUS,
                          .track = WOODBOT_TRACK};
}

double body_wheel(const struct body *body, enum wheel wheel)
{
    const struct servo *servo = &body->servo[wheel];
    double off = (double)servo->pulse - MIDDLE - servo->trim, share;

    if (servo->pulse == 0)
        return 0;
    if (wheel == WHEEL_RIGHT) /* it is mounted the other way */
        off = -off;
    share = (fabs(off) - servo->dead_band) / (FULL - servo->dead_band);
    share = share < 0 ? 0 : share > 1 ? 1 : share;
    return copysign(share * servo->top_speed, off);
}

double body_turning(const struct body *body)
{
    const double apart = body_wheel(body, WHEEL_RIGHT) - body_wheel(body, WHEEL_LEFT);

    return WOODBOT_WHEEL_RADIUS * apart / body->track;
}

static void step(struct body *body, double dt)
{
    const double speed = WOODBOT_WHEEL_RADIUS / 2
                         * (body_wheel(body, WHEEL_LEFT)
                            + body_wheel(body, WHEEL_RIGHT));
    const double turned = dt * body_turning(body);
    const double middle = body->heading + turned / 2;
    const double free = body->arena_radius - MARGIN;
    double away;

    body->x += dt * speed * cos(middle);
    body->y += dt * speed * sin(middle);
    body->heading += turned;
    away = hypot(body->x, body->y);
    if (body->arena_radius > 0 && away > free) { /* it slides along the wall */
        body->x *= free / away;
        body->y *= free / away;
    }
}

void body_advance(struct body *body, uint64_t now)
{
    if (body->servo[0].pulse == 0 && body->servo[1].pulse == 0)
        body->at = now;
    while (body->at < now) {
        const uint64_t left = now - body->at, us = left < STEP ? left : STEP;

        step(body, (double)us * 1e-6);
        body->at += us;
    }
}

double body_lidar(const struct body *body, enum lidar which)
{
    const double s = sin(body->heading), c = cos(body->heading);
    const double ahead = which == LIDAR_FRONT ? c : s;
    const double left = which == LIDAR_FRONT ? s : -c;
    const double x = body->x + LENS[which] * c, y = body->y + LENS[which] * s;
    const double along = x * ahead + y * left, radius = body->arena_radius;
    const double square = radius * radius - x * x - y * y + along * along;
    double seen;

    if (square < 0 || radius <= 0)
        return WOODBOT_LIDAR_REACH;
    seen = sqrt(square) - along;
    return seen > 0 && seen < WOODBOT_LIDAR_REACH ? seen : WOODBOT_LIDAR_REACH;
}
