/* What motors are made of: for who makes one, in static memory. See motors.h.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef WOODBOT_MOTORS_PRIVATE_H
#define WOODBOT_MOTORS_PRIVATE_H

#include "handover.h"
#include "motors.h"

/* Everything that the link's task says, in one piece: all of it is new, or none. */
struct told {
    struct order order;
    uint64_t ticked;    /* us: when the last tick was heard */
    uint64_t after;     /* us: what was said until then is not obeyed */
    uint32_t resets;    /* of the odometry, counted */
    uint8_t hold;       /* an enum why: WHY_DRIVEN if nothing holds it */
    bool ordered;       /* there is an order */
    bool wrong;         /* ... which no wheel can obey */
    struct servo_settings servo[2];
};

struct motors {
    const struct hardware *hardware;
    struct told telling;        /* the link's task */
    struct handover told;       /* written by the link's task */
    struct handover said;       /* a struct motion, written by the motors' task */
    struct told heard;          /* the motors' task, as all below */
    struct motion motion;
    uint64_t stepped;           /* us: when it was last asked to step */
    uint64_t stood;             /* us: when it stopped */
};

_Static_assert(sizeof(struct told) <= 4 * HANDOVER_WORDS, "told fits a slot");
_Static_assert(sizeof(struct motion) <= 4 * HANDOVER_WORDS, "motion fits a slot");

#endif
