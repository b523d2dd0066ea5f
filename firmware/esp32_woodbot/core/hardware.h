/* Hardware: the parts of a Woodbot, as its core sees them. One seam of two (link.h).
 *
 * A port fills in the struct. No function waits: what is not ready yet is said so, and
 * asked for again. `self` is the port's own. Two tasks call, as said at each function:
 * "motors" (every MOTORS_PERIOD ms) and "link" (everything else).
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef WOODBOT_HARDWARE_H
#define WOODBOT_HARDWARE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { LIGHTS = 6 };

enum wheel { WHEEL_LEFT, WHEEL_RIGHT };
enum lidar { LIDAR_FRONT, LIDAR_RIGHT };

/* Why the robot has just started: each comes up stopped. */
enum reset { RESET_POWER, RESET_ASKED, RESET_BROWNOUT, RESET_WATCHDOG, RESET_CRASH };

/* What a sensor has to say. A part that is absent never blocks anything. */
enum reading { READING_NEW, READING_OLD, READING_ABSENT, READING_WRONG };

struct light { uint8_t red, green, blue; };

struct hardware {
    void *self;

    /* Microseconds since the start; never goes back, never waits. Both tasks. */
    uint64_t (*now)(void *self);

    /* Pulse of a wheel's servo [us], 1500 in the middle; 0 for none. Motors. */
    void (*servo)(void *self, enum wheel wheel, unsigned pulse);

    /* Tell the hardware's watchdog that the motors' task runs. Motors. */
    void (*feed)(void *self);

    /* Distance to what is ahead or on the right [m]. Link. */
    enum reading (*lidar)(void *self, enum lidar which, double *metres);

    /* Rate of turning, counter-clockwise from above [rad/s]. Link. */
    enum reading (*gyro)(void *self, double *rate);

    /* The magnetic field ahead and to the left, in units of the sensor's own. Link. */
    enum reading (*compass)(void *self, double *ahead, double *left);

    /* What all lights show from now on. Link. */
    void (*lights)(void *self, const struct light lights[LIGHTS]);

    /* Bytes of the settings that were stored, 0 for none; `store` replaces them all,
     * as one: after a loss of power the old or the new ones are there. Link. */
    size_t (*load)(void *self, uint8_t *bytes, size_t room);
    bool (*store)(void *self, const uint8_t *bytes, size_t size);

    /* The console, a serial line: bytes that came, and how many were taken. Link. */
    size_t (*read)(void *self, uint8_t *bytes, size_t room);
    size_t (*write)(void *self, const uint8_t *bytes, size_t size);

    /* A number that no other robot has, the same after each start: of the radio's
     * address; of the process where the robot is one. Below 2^53. Link. */
    uint64_t (*identity)(void *self);

    /* Why it started, and start again. Link. */
    enum reset (*started_by)(void *self);
    void (*restart)(void *self);
};

#endif
