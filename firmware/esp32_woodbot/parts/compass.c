/* The QMC5883L of QST. Registers are those of its data sheet, 13-52-04.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#include "sensor.h"

enum {
    ADDRESS = 0x0D,
    X_LOW = 0x00,
    STATUS = 0x06,
    CONTROL_1 = 0x09,
    CONTROL_2 = 0x0A,
    SET_RESET_PERIOD = 0x0B,

    READY = 0x01,             /* DRDY */
    OVERFLOW = 0x02,          /* OVL: beyond its range */
    SOFT_RESET = 0x80,
    POINTER_ROLLS = 0x40,     /* ROL_PNT: 00h to 06h are read in one go */
    NO_INTERRUPT = 0x01,      /* INT_ENB: 1 switches the pin off */
    RECOMMENDED = 0x01,       /* of the set/reset period */
    AT_200_HZ_8_GAUSS = 0x1D, /* OSR 512, RNG 8 G, ODR 200 Hz, continuous */
    PER_GAUSS = 3000
};

static bool start(void *self)
{
    struct i2c *bus = self;
    uint8_t set = 0; /* its identity is 255, as is a line where nobody is: no help */

    return i2c_write(bus, ADDRESS, CONTROL_2, SOFT_RESET)
           && i2c_write(bus, ADDRESS, CONTROL_2, POINTER_ROLLS | NO_INTERRUPT)
           && i2c_write(bus, ADDRESS, SET_RESET_PERIOD, RECOMMENDED)
           && i2c_write(bus, ADDRESS, CONTROL_1, AT_200_HZ_8_GAUSS)
           && i2c_read(bus, ADDRESS, CONTROL_1, &set, 1) && set == AT_200_HZ_8_GAUSS;
}

static enum reading read(void *self, double values[SENSOR_VALUES])
{
    struct i2c *bus = self;
    uint8_t set = 0, status = 0, words[6];

    if (!i2c_read(bus, ADDRESS, CONTROL_1, &set, 1) || set != AT_200_HZ_8_GAUSS
        || !i2c_read(bus, ADDRESS, STATUS, &status, 1))
        return READING_ABSENT;
    if ((status & READY) == 0)
        return READING_OLD;
    /* All six are read, on overflow too: that makes room for the next. */
    if (!i2c_read(bus, ADDRESS, X_LOW, words, sizeof words))
        return READING_ABSENT;
    if ((status & OVERFLOW) != 0)
        return READING_WRONG;
    values[0] = (double)i2c_int16(words) / PER_GAUSS;
    values[1] = (double)i2c_int16(words + 2) / PER_GAUSS;
    return READING_NEW;
}

struct sensor compass_sensor(struct i2c *bus)
{
    const struct sensor made = {.self = bus, .start = start, .read = read};

    return made;
}
