/* The hardware seam: sensors with noise and faults, servos with a log.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "robot.h"

static const uint64_t PERIOD[PARTS] = {33000, 33000, 9600, 10000}; /* us */
static const double LIDAR_NOISE = 0.04;    /* of what it reads */
static const double GYRO_NOISE = 0.0035;   /* rad/s: the LSM6DS3TR-C at 104 Hz */
static const double FIELD = 400, FIELD_NOISE = 12; /* counts of the QMC5883L */

uint64_t robot_now(void)
{
    static _Atomic uint64_t start;
    struct timespec time;
    uint64_t now, none = 0;

#ifdef CLOCK_BOOTTIME /* it goes on while a laptop sleeps */
    clock_gettime(CLOCK_BOOTTIME, &time);
#else
    clock_gettime(CLOCK_MONOTONIC, &time);
#endif
    now = (uint64_t)time.tv_sec * 1000000u + (uint64_t)time.tv_nsec / 1000u;
    atomic_compare_exchange_strong(&start, &none, now - 1);
    return now - start;
}

static uint64_t now(void *self)
{
    (void)self;
    return robot_now();
}

/* -- servos ------------------------------------------------------------------------ */

/* A line for each change: monotonic time [s], and the pulses of both [us]. */
static void log_pulses(const struct robot *robot)
{
    char line[64];
    struct timespec time;
    int size;

    if (robot->servo_log < 0)
        return;
    clock_gettime(CLOCK_MONOTONIC, &time);
    size = snprintf(line, sizeof line, "%lld.%06ld %u %u\n", (long long)time.tv_sec,
                    time.tv_nsec / 1000, robot->body.servo[WHEEL_LEFT].pulse,
                    robot->body.servo[WHEEL_RIGHT].pulse);
    if (write(robot->servo_log, line, (size_t)size) < 0)
        return; /* a full disk does not stop the robot */
}

static void set_servo(void *self, enum wheel wheel, unsigned pulse)
{
    struct robot *robot = self;

    pthread_mutex_lock(&robot->lock);
    if (robot->body.servo[wheel].pulse != pulse) {
        body_advance(&robot->body, robot_now());
        robot->body.servo[wheel].pulse = pulse;
        log_pulses(robot);
    }
    pthread_mutex_unlock(&robot->lock);
}

static void feed(void *self)
{
    struct robot *robot = self;

    atomic_fetch_add(&robot->fed, 1);
}

/* -- sensors ----------------------------------------------------------------------- */

static double even(struct parts *parts)
{
    parts->noise ^= parts->noise << 13;
    parts->noise ^= parts->noise >> 7;
    parts->noise ^= parts->noise << 17;
    return ((double)(parts->noise >> 11) + 0.5) / 9007199254740992.0;
}

/* A normal random number. */
static double normal(struct parts *parts)
{
    const double size = sqrt(-2 * log(even(parts)));

    return size * cos(2 * acos(-1) * even(parts));
}

/* Begin to read a part: with the lock, if there is something new. */
static enum reading begin(struct robot *robot, enum part part)
{
    enum reading reading = READING_NEW;
    const uint64_t time = robot_now();

    pthread_mutex_lock(&robot->lock);
    if (robot->parts.fault[part] == FAULT_ABSENT)
        reading = READING_ABSENT;
    else if (robot->parts.fault[part] == FAULT_WRONG)
        reading = READING_WRONG;
    else if (robot->parts.fault[part] == FAULT_OLD || time < robot->parts.next[part])
        reading = READING_OLD;
    if (reading != READING_NEW) {
        pthread_mutex_unlock(&robot->lock);
        return reading;
    }
    robot->parts.next[part] = time + PERIOD[part];
    body_advance(&robot->body, time);
    return reading;
}

static double end(struct robot *robot, enum part part, double value)
{
    return robot->parts.fault[part] == FAULT_NAN ? NAN : value;
}

static enum reading read_lidar(void *self, enum lidar which, double *metres)
{
    struct robot *robot = self;
    const enum part part = which == LIDAR_FRONT ? PART_FRONT : PART_RIGHT;
    const enum reading reading = begin(robot, part);
    double seen;

    if (reading != READING_NEW)
        return reading;
    seen = body_lidar(&robot->body, which)
           * (1 + LIDAR_NOISE * normal(&robot->parts));
    *metres = end(robot, part, seen < 0 ? 0 : seen);
    pthread_mutex_unlock(&robot->lock);
    return reading;
}

static enum reading read_gyro(void *self, double *rate)
{
    struct robot *robot = self;
    const enum reading reading = begin(robot, PART_GYRO);

    if (reading != READING_NEW)
        return reading;
    *rate = end(robot, PART_GYRO,
                body_turning(&robot->body) + GYRO_NOISE * normal(&robot->parts));
    pthread_mutex_unlock(&robot->lock);
    return reading;
}

static enum reading read_compass(void *self, double *ahead, double *left)
{
    struct robot *robot = self;
    const enum reading reading = begin(robot, PART_COMPASS);

    if (reading != READING_NEW)
        return reading;
    /* North is the arena's +y. */
    *ahead = FIELD * sin(robot->body.heading) + FIELD_NOISE * normal(&robot->parts);
    *left = FIELD * cos(robot->body.heading) + FIELD_NOISE * normal(&robot->parts);
    *ahead = end(robot, PART_COMPASS, *ahead);
    pthread_mutex_unlock(&robot->lock);
    return reading;
}

static void set_lights(void *self, const struct light lights[LIGHTS])
{
    struct robot *robot = self;

    pthread_mutex_lock(&robot->lock);
    memcpy(robot->parts.lights, lights, sizeof robot->parts.lights);
    pthread_mutex_unlock(&robot->lock);
}

/* -- the rest ---------------------------------------------------------------------- */

/* Of the host's name and the process: neither alone is one robot's. */
static uint64_t identity(void *self)
{
    char host[256] = "";
    uint64_t hash = 14695981039346656037u;

    (void)self;
    gethostname(host, sizeof host - 1);
    for (const char *at = host; *at != '\0'; at++)
        hash = (hash ^ (uint8_t)*at) * 1099511628211u;
    return (hash & 0x3fffffffu) << 22 | ((uint64_t)getpid() & 0x3fffffu);
}

static enum reset started_by(void *self)
{
    const struct robot *robot = self;

    return robot->started_by;
}

static void restart(void *self)
{
    robot_reset(self, "asked");
}

struct hardware parts_hardware(struct robot *robot)
{
    const struct hardware hardware = {
        .self = robot, .now = now, .servo = set_servo, .feed = feed,
        .lidar = read_lidar, .gyro = read_gyro, .compass = read_compass,
        .lights = set_lights, .load = store_load, .store = store_store,
        .read = tether_read, .write = tether_write, .identity = identity,
        .started_by = started_by, .restart = restart,
    };

    robot->parts.noise = robot->options.seed * 0x9e3779b97f4a7c15u | 1u;
    for (int i = 0; i < 20; i++)
        even(&robot->parts);
    return hardware;
}
