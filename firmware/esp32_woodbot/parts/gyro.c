/* The LSM6DS3TR-C of STMicroelectronics. Registers are those of its data sheet,
 * DocID030071.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#include "sensor.h"

enum {
    ADDRESS = 0x6A,
    WHO_AM_I = 0x0F,
    WHO_AM_I_IS = 0x6A,
    CTRL2_G = 0x11,
    CTRL3_C = 0x12,
    STATUS_REG = 0x1E,
    OUTZ_L_G = 0x26,

    AT_104_HZ_500_DPS = 0x44, /* ODR_G 0100, FS_G 01 */
    WHOLE_WORDS = 0x44,       /* BDU: no half of an old word; IF_INC, as after reset */
    NEW_RATE = 0x02           /* GDA */
};

/* 17.5 mdps a bit. A robot turns with 163 degrees/s at most; a hand turns it faster. */
static const double RADIANS = 0.0175 * 3.14159265358979323846 / 180.0;

static bool start(void *self)
{
    struct i2c *bus = self;
    uint8_t is = 0;

    return i2c_read(bus, ADDRESS, WHO_AM_I, &is, 1) && is == WHO_AM_I_IS
           && i2c_write(bus, ADDRESS, CTRL3_C, WHOLE_WORDS)
           && i2c_write(bus, ADDRESS, CTRL2_G, AT_104_HZ_500_DPS);
}

static enum reading read(void *self, double values[SENSOR_VALUES])
{
    struct i2c *bus = self;
    uint8_t set = 0, status = 0, word[2];
    int raw;

    /* A loose plug that has made contact again: the chip is there, but switched off. */
    if (!i2c_read(bus, ADDRESS, CTRL2_G, &set, 1) || set != AT_104_HZ_500_DPS
        || !i2c_read(bus, ADDRESS, STATUS_REG, &status, 1))
        return READING_ABSENT;
    if ((status & NEW_RATE) == 0)
        return READING_OLD;
    if (!i2c_read(bus, ADDRESS, OUTZ_L_G, word, sizeof word))
        return READING_ABSENT;
    raw = i2c_int16(word);
    if (raw == 32767 || raw == -32768)
        return READING_WRONG; /* beyond its range */
    values[0] = raw * RADIANS;
    return READING_NEW;
}

struct sensor gyro_sensor(struct i2c *bus)
{
    const struct sensor made = {.self = bus, .start = start, .read = read};

    return made;
}
