/* Body: two servos and what they drive over the floor, in a round arena.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef WOODBOT_POSIX_BODY_H
#define WOODBOT_POSIX_BODY_H

#include <stdint.h>

#include "hardware.h"

struct servo {
    double trim;        /* us, of the pulse at which it stands */
    double dead_band;   /* us from there in which it stands */
    double top_speed;   /* rad/s at 500 us from there, and beyond */
    unsigned pulse;     /* us; 0: none, it stands */
};

struct body {
    struct servo servo[2];
    double x, y, heading;    /* m, m, rad */
    double arena_radius;     /* m; 0 for none */
    double track;            /* m between the wheels */
    uint64_t at;             /* us: when it was there */
};

void body_default(struct body *body);
/* Speed of a wheel ahead [rad/s]. */
double body_wheel(const struct body *body, enum wheel wheel);
double body_turning(const struct body *body);
/* Let it drive until `now`. */
void body_advance(struct body *body, uint64_t now);
/* Distance from a lidar to the wall [m]. */
double body_lidar(const struct body *body, enum lidar which);

#endif
