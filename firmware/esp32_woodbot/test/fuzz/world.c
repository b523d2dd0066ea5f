/* SPDX-License-Identifier: Apache-2.0 */
#include "world.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

struct world world;

void world_must(bool holds)
{
    if (!holds)
        abort();
}

/* -- hardware --------------------------------------------------------------------- */

static uint64_t now(void *self)
{
    (void)self;
    return world.now;
}

static bool is_young(uint64_t then)
{
    return then > 0 && world.now - then <= WOODBOT_MAX_AGE_US;
}

/* A wheel turns for a reason, and never after STOP without a release and a command. */
static void servo(void *self, enum wheel wheel, unsigned pulse)
{
    (void)self;
    world_must(wheel == WHEEL_LEFT || wheel == WHEEL_RIGHT);
    world_must(pulse == 0 || (pulse >= 700 && pulse <= 2300));
    if (pulse == 0)
        return;
    world.driven++;
    world_must(is_young(world.commanded) || is_young(world.tested));
    world_must(is_young(world.ticked) || is_young(world.tested));
    world_must(world.released >= world.stopped);
    world_must(world.commanded >= world.stopped || world.tested >= world.stopped);
    if (world.bot.lease.badge != 0 && !is_young(world.tested)) {
        world.led = true;
        world_must(world.holder_said >= world.leased);
        world_must(is_young(world.holder_said));
    }
}

static void feed(void *self)
{
    (void)self;
}

/* What a broken part may say, too. */
static enum reading measure(double *value)
{
    static const double values[] = {0.4, NAN, INFINITY, -1e300, 0, -0.0, 1e9};

    *value = values[world.now / 1000 % 7];
    return world.reading;
}

static enum reading lidar(void *self, enum lidar which, double *metres)
{
    (void)self;
    (void)which;
    return measure(metres);
}

static enum reading gyro(void *self, double *rate)
{
    (void)self;
    return measure(rate);
}

static enum reading compass(void *self, double *ahead, double *left)
{
    (void)self;
    measure(left);
    return measure(ahead);
}

static void lights(void *self, const struct light shown[LIGHTS])
{
    unsigned sum = 0;

    (void)self;
    for (size_t i = 0; i < LIGHTS; i++)
        sum += shown[i].red + shown[i].green + shown[i].blue;
    world_must(sum <= LIGHTS * 3 * 255);
}

static size_t load(void *self, uint8_t *bytes, size_t room)
{
    size_t size = world.stored_size < room ? world.stored_size : room;

    (void)self;
    memcpy(bytes, world.stored, size);
    return size;
}

static bool store(void *self, const uint8_t *bytes, size_t size)
{
    (void)self;
    world_must(size <= sizeof world.stored);
    memcpy(world.stored, bytes, size);
    world.stored_size = size;
    return true;
}

static size_t read(void *self, uint8_t *bytes, size_t room)
{
    size_t size = world.console_size < room ? world.console_size : room;

    (void)self;
    memcpy(bytes, world.console, size);
    memmove(world.console, world.console + size, world.console_size - size);
    world.console_size -= size;
    return size;
}

/* It takes less than it is given, as a line does. */
static size_t write(void *self, const uint8_t *bytes, size_t size)
{
    size_t taken = size < 64 ? size : 64;
    uint8_t sum = 0;

    (void)self;
    for (size_t i = 0; i < size; i++)
        sum = (uint8_t)(sum + bytes[i]);
    return sum == 1 ? taken / 2 : taken;
}

static uint64_t identity(void *self)
{
    (void)self;
    return 4711;
}

static enum reset started_by(void *self)
{
    (void)self;
    return RESET_POWER;
}

static void restart(void *self)
{
    (void)self;
}

/* -------------------------------------------------------------------------------- */

static const struct hardware hardware = {
    .now = now, .servo = servo, .feed = feed, .lidar = lidar, .gyro = gyro,
    .compass = compass, .lights = lights, .load = load, .store = store, .read = read,
    .write = write, .identity = identity, .started_by = started_by, .restart = restart,
};

void world_start(void)
{
    world.open = false;
    world.commanded = world.ticked = world.tested = 0;
    world.stopped = world.released = world.stops = 0;
    world.leased = world.badge = world.holder_said = 0;
    memset(world.keys, 0, sizeof world.keys);
    memset(world.asks, 0, sizeof world.asks);
    woodbot_start(&world.bot, &hardware, &world_link);
}

static void check(void)
{
    struct motion motion = motors_motion(&world.bot.motors);

    world_must(isfinite(motion.x) && isfinite(motion.y) && isfinite(motion.heading));
    world_must(isfinite(motion.obeyed.wheel_left));
    world_must(isfinite(motion.obeyed.wheel_right));
    world_must(motion.why == WHY_DRIVEN || motion.tick == 0);
}

void world_wait(uint64_t us)
{
    uint64_t until = world.now + us;

    while (world.stepped + MOTORS_PERIOD * 1000u <= until) {
        world.stepped += MOTORS_PERIOD * 1000u;
        world.now = world.stepped;
        woodbot_drive(&world.bot);
    }
    world.now = until;
    check();
}
