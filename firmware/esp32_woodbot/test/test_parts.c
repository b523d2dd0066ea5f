/* Sensors against their chips' registers, as the data sheets have them.
 *
 * A chip here is its registers: what a write leaves in them, and what a measurement
 * puts there. Each check prints a line; the first that fails ends it all.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "sensor.h"

enum { GYRO = 0x6A, COMPASS = 0x0D, SECOND = 1000000 };

/* What is on the bus: two chips, plugged in or not. */
static uint8_t gyro[128], compass[16], expander;
static bool gyro_in, compass_in, expander_in;
static bool stuck;
static uint64_t clock_now; /* us */
static unsigned transfers;

static void power_on(void)
{
    memset(gyro, 0, sizeof gyro);
    memset(compass, 0, sizeof compass);
    gyro[0x0F] = 0x6A; /* WHO_AM_I */
    gyro[0x12] = 0x04; /* CTRL3_C: addresses go up by themselves */
    compass[0x0D] = 0xFF;
    expander = 0xFF;
    gyro_in = compass_in = expander_in = true;
}

static bool talk(uint8_t *chip, size_t registers, const uint8_t *bytes, size_t size,
                 uint8_t *into, size_t room)
{
    const size_t at = bytes[0];

    for (size_t i = 1; i < size; i++)
        chip[(at + i - 1) % registers] = bytes[i];
    for (size_t i = 0; i < room; i++)
        into[i] = chip[(at + i) % registers];
    return true;
}

static bool transfer(void *self, uint8_t address, const uint8_t *bytes, size_t size,
                     uint8_t *into, size_t room)
{
    (void)self;
    transfers++;
    if (stuck) {
        clock_now += I2C_STUCK * 1000u;
        return false;
    }
    if (size == 0)
        return (address == GYRO && gyro_in) || (address == COMPASS && compass_in);
    if (address == GYRO && gyro_in)
        return talk(gyro, sizeof gyro, bytes, size, into, room);
    if (address == COMPASS && compass_in) {
        if (size == 2 && bytes[0] == 0x0A && (bytes[1] & 0x80) != 0) {
            memset(compass, 0, 0x0D); /* SOFT_RST */
            return true;
        }
        return talk(compass, sizeof compass, bytes, size, into, room);
    }
    if (address == EXPANDER_ADDRESS && expander_in && size == 1 && room == 0) {
        expander = bytes[0];
        return true;
    }
    return false;
}

static uint64_t bus_now(void *self)
{
    (void)self;
    return clock_now;
}

static struct i2c bus = {.transfer = transfer, .now = bus_now};

static void check(bool holds, const char *what)
{
    printf("%s %s\n", holds ? "ok" : "FAIL", what);
    if (!holds)
        exit(1);
}

static bool is(double value, double wanted)
{
    return fabs(value - wanted) < 1e-9;
}

static void check_gyro(void)
{
    struct sensor sensor = gyro_sensor(&bus);
    double values[SENSOR_VALUES] = {7, 7};
    uint64_t now = 5;

    power_on();
    check(sensor_read(&sensor, now, values) == READING_OLD, "the gyro starts");
    check((gyro[0x11] >> 4) == 4, "at 104 Hz");
    check((gyro[0x11] >> 2 & 3) == 1, "up to 500 degrees/s");
    check((gyro[0x12] & 0x44) == 0x44, "whole words");
    check(sensor_read(&sensor, now, values) == READING_OLD && is(values[0], 7),
          "a rate that is not there yet");
    gyro[0x1E] = 0x02;
    gyro[0x26] = 0xE8;
    gyro[0x27] = 0x03; /* 1000: 17.5 degrees/s */
    check(sensor_read(&sensor, now, values) == READING_NEW
          && is(values[0], 0.30543261909900765), "a rate counter-clockwise");
    gyro[0x26] = 0x18;
    gyro[0x27] = 0xFC; /* -1000 */
    check(sensor_read(&sensor, now, values) == READING_NEW
          && is(values[0], -0.30543261909900765), "a rate clockwise");
    gyro[0x26] = 0xFF;
    gyro[0x27] = 0x7F;
    check(sensor_read(&sensor, now, values) == READING_WRONG, "a rate out of range");

    gyro[0x11] = 0; /* power came back */
    check(sensor_read(&sensor, now, values) == READING_ABSENT, "a gyro that forgot");
    check(sensor_read(&sensor, now += SECOND, values) == READING_OLD
          && gyro[0x11] == 0x44, "it is set up again");
    gyro_in = false;
    check(sensor_read(&sensor, now, values) == READING_ABSENT, "an unplugged gyro");
    gyro_in = true;
    gyro[0x0F] = 0x69; /* an LSM6DS3, not TR-C: other registers */
    check(sensor_read(&sensor, now += SECOND, values) == READING_ABSENT,
          "another chip at its address");
}

static void check_compass(void)
{
    static const uint8_t field[6] = {0xEE, 0x02, 0x12, 0xFD, 0x34, 0x12};
    struct sensor sensor = compass_sensor(&bus);
    double values[SENSOR_VALUES] = {7, 7};
    uint64_t now = 5;

    power_on();
    compass[0x09] = 0xFF; /* of a program before this one */
    check(sensor_read(&sensor, now, values) == READING_OLD, "the compass starts");
    check(compass[0x09] == 0x1D, "continuous, 200 Hz, 8 G, 512 samples");
    check(compass[0x0A] == 0x41 && compass[0x0B] == 0x01, "no pin, and its period");
    check(sensor_read(&sensor, now, values) == READING_OLD && is(values[0], 7),
          "a field that is not there yet");
    memcpy(compass, field, sizeof field); /* 750 and -750 of 3000 a gauss */
    compass[0x06] = 0x01;
    check(sensor_read(&sensor, now, values) == READING_NEW && is(values[0], 0.25)
          && is(values[1], -0.25), "a field");
    compass[0x06] = 0x03;
    check(sensor_read(&sensor, now, values) == READING_WRONG, "a magnet too near");
    compass_in = false;
    check(sensor_read(&sensor, now, values) == READING_ABSENT, "an unplugged compass");
}

/* One that is not there costs one transfer a second, and one that is silent begins
 * anew. */
static void check_patience(void)
{
    struct sensor sensor = gyro_sensor(&bus);
    double values[SENSOR_VALUES];
    uint64_t now = 5;

    power_on();
    gyro_in = false;
    transfers = 0;
    for (int i = 0; i < 1000; i++, now += SECOND / 100)
        check(sensor_read(&sensor, now, values) == READING_ABSENT, "an absent gyro");
    check(transfers == 10, "is asked for once a second");
    gyro_in = true;
    now += SECOND;
    check(sensor_read(&sensor, now, values) == READING_OLD, "plugged in, it starts");
    now += SECOND;
    check(sensor_read(&sensor, now, values) == READING_WRONG, "a silent gyro is told");
    gyro[0x11] = 0;
    check(sensor_read(&sensor, now += SECOND, values) == READING_OLD
          && gyro[0x11] == 0x44, "and started again");
}

/* Two seconds of a link's task that reads two sensors every 10 ms, and a third part
 * that is asked for by its address, as the lidars are. */
static void check_stuck(void)
{
    struct sensor sensors[2] = {gyro_sensor(&bus), compass_sensor(&bus)};
    double values[SENSOR_VALUES];
    uint64_t begun, worst = 0, sum = 0;

    power_on();
    clock_now = SECOND;
    for (int i = 0; i < 400; i++, clock_now += SECOND / 100) {
        stuck = i >= 100 && i < 300;
        begun = clock_now;
        sensor_read(&sensors[0], clock_now, values);
        sensor_read(&sensors[1], clock_now, values);
        i2c_answers(&bus, 0x29);
        worst = clock_now - begun > worst ? clock_now - begun : worst;
        sum += clock_now - begun;
    }
    check(worst == I2C_STUCK * 1000u, "a bus that hangs takes one timeout at a time");
    check(sum <= 3 * I2C_STUCK * 1000u, "and one a second");
    check(sensors[0].there && sensors[1].there, "and is used again when it is well");
    gyro_in = false;
    check(i2c_answers(&bus, COMPASS) && !i2c_answers(&bus, GYRO), "who answers");
}

static void check_expander(void)
{
    power_on();
    check(expander_lidars(&bus, EXPANDER_RIGHT) && expander == 0x9F,
          "the right lidar on, the two others off, lights out");
    check(expander_lidars(&bus, 0) && expander == 0x8F, "all lidars off");
    expander_in = false;
    check(!expander_lidars(&bus, 0), "no expander");
}

int main(void)
{
    check_gyro();
    check_compass();
    check_patience();
    check_stuck();
    check_expander();
    return 0;
}
