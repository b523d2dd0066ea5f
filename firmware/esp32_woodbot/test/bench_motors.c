/* A bench for motors: hardware whose time and pulses a test sets and reads.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#include "safety/motors_private.h"

struct seen {
    double left, right, x, y, heading;
    uint64_t tick, since;
    uint32_t why, expired, pulses[2], feeds;
};

void bench_start(uint64_t now);
void bench_now(uint64_t now);
void bench_tell(double left, double right, uint64_t said, uint64_t tick);
void bench_tick(uint64_t heard);
void bench_stop(int why);
void bench_release(void);
void bench_reset(void);
bool bench_set(const struct servo_settings settings[2]);
void bench_step(struct seen *seen);

static struct motors motors;
static uint64_t clock_now;
static struct seen last;

static uint64_t now(void *self)
{
    (void)self;
    return clock_now;
}

static void servo(void *self, enum wheel wheel, unsigned pulse)
{
    (void)self;
    last.pulses[wheel] = pulse;
}

static void feed(void *self)
{
    (void)self;
    last.feeds++;
}

static const struct hardware hardware = {.now = now, .servo = servo, .feed = feed};

void bench_start(uint64_t now_)
{
    clock_now = now_;
    last = (struct seen){0};
    motors_start(&motors, &hardware);
}

void bench_now(uint64_t now_)
{
    clock_now = now_;
}

void bench_tell(double left, double right, uint64_t said, uint64_t tick)
{
    struct order order = {{left, right}, said, tick};
    motors_tell(&motors, &order);
}

void bench_tick(uint64_t heard)
{
    motors_tick(&motors, heard);
}

void bench_stop(int why)
{
    motors_stop(&motors, (enum why)why);
}

void bench_release(void)
{
    motors_release(&motors);
}

void bench_reset(void)
{
    motors_reset(&motors);
}

bool bench_set(const struct servo_settings settings[2])
{
    return motors_set(&motors, settings);
}

void bench_step(struct seen *seen)
{
    struct motion motion;

    motors_step(&motors);
    motion = motors_motion(&motors);
    last.left = motion.obeyed.wheel_left;
    last.right = motion.obeyed.wheel_right;
    last.x = motion.x;
    last.y = motion.y;
    last.heading = motion.heading;
    last.tick = motion.tick;
    last.since = motion.since;
    last.why = motion.why;
    last.expired = motion.expired;
    *seen = last;
}
