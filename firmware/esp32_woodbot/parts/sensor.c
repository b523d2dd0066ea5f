/* SPDX-License-Identifier: Apache-2.0 */
#include "sensor.h"

enum { SILENT_US = 1000000 /* between two attempts, and for a silent one */ };

enum reading sensor_read(struct sensor *sensor, uint64_t now,
                         double values[SENSOR_VALUES])
{
    enum reading reading;

    if (!sensor->there) {
        if (sensor->since != 0 && now - sensor->since < SILENT_US)
            return READING_ABSENT;
        sensor->since = now;
        sensor->there = sensor->start(sensor->self);
        return sensor->there ? READING_OLD : READING_ABSENT;
    }
    reading = sensor->read(sensor->self, values);
    if (reading == READING_ABSENT) {
        sensor->there = false;
    } else if (reading == READING_NEW) {
        sensor->since = now;
    } else if (now - sensor->since >= SILENT_US) {
        /* It answers, and measures nothing: it is started again. */
        sensor->there = false;
        return READING_WRONG;
    }
    return reading;
}
