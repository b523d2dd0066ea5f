/* Sensor: one that may be absent, unplugged, or silent, and never blocks anything.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef WOODBOT_SENSOR_H
#define WOODBOT_SENSOR_H

#include "hardware.h"
#include "i2c.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { SENSOR_VALUES = 2 };

struct sensor {
    void *self;

    /* Set it up; false if it does not answer as it should. Bounded. */
    bool (*start)(void *self);

    /* READING_ABSENT: it no longer answers, or has lost its settings since. */
    enum reading (*read)(void *self, double values[SENSOR_VALUES]);

    bool there;
    uint64_t since; /* us: of the last attempt to start it, or of its last word */
};

/* Read it; start it, again and again, while it is not there. */
enum reading sensor_read(struct sensor *sensor, uint64_t now,
                         double values[SENSOR_VALUES]);

/* The LSM6DS3TR-C at 104 Hz, up to 500 degrees/s: its rate about the vertical,
 * counter-clockwise from above [rad/s]. `self` is the bus. */
struct sensor gyro_sensor(struct i2c *bus);

/* The QMC5883L at 200 Hz, up to 8 G: the field along its x and y [G]. READING_WRONG
 * where a magnet is too near. `self` is the bus. */
struct sensor compass_sensor(struct i2c *bus);

#ifdef __cplusplus
}
#endif

#endif
