/* Fuzzing the whole core: messages, answers, questions, and bytes on its console come
 * in any order and of any kind, the link fails as it likes, and time goes by. Of what
 * comes some is made as a clock and a driver make it, so that the robot is let in and
 * drives; some of that is damaged; the rest is the input's bytes.
 *
 *     cd firmware/esp32_woodbot
 *     clang -g -O1 -fsanitize=fuzzer,address,undefined -fno-sanitize-recover=all \
 *         -Icore $(find core -name "*.c") test/fuzz/{link,messages,woodbot,world}.c \
 *         -lm -o fuzz_woodbot
 *     ./fuzz_woodbot -runs=10000000 -max_len=400
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "messages.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

/* -- what happens ----------------------------------------------------------------- */

/* The clock said how often STOP was said and released; or something in disguise. */
static void release(bool surely)
{
    if (!surely || (times.stops % 2 == 0 && times.stops > world.stops))
        world.released = world.now;
}

/* Somebody may have got the lease, or given it back. */
static void look_at_lease(void)
{
    if (world.bot.lease.badge != world.badge)
        world.leased = world.now;
    world.badge = world.bot.lease.badge;
}

static void hear(const char *key, struct bytes payload, const char *encoding,
                 struct bytes attachment)
{
    struct bytes one = copy(payload), two = copy(attachment);

    woodbot_heard(&world.bot, key, one, encoding, two);
    drop(one);
    drop(two);
}

static void hear_clock(void)
{
    const struct member *member = &world.bot.member;
    uint8_t room[MESSAGE], other[MESSAGE];
    char key[LINK_KEY];
    struct bytes made = damaged(beat(room), other);

    key_of(key, member->fabric, "clock/tick", "");
    world.ticked = world.now;
    release(made.at == room);
    hear(key, made, "", (struct bytes){NULL, 0});
}

static void hear_stop(void)
{
    char key[LINK_KEY];
    const struct member *member = &world.bot.member;
    bool hears = member->seat != SEAT_NONE;

    key_of(key, member->fabric, "stop", "");
    hear(key, stop_write(), "", (struct bytes){NULL, 0});
    if (hears) {
        world.stopped = ++world.now; /* what came before is older */
        world.stops = member->guard.stops;
        world_must(woodbot_stopped(&world.bot));
        world_wait(MOTORS_PERIOD * 1000u); /* it is acted upon when it is heard */
    }
}

static void hear_command(uint8_t which)
{
    const struct member *member = &world.bot.member;
    uint8_t room[MESSAGE], other[MESSAGE], stamped[STAMP_SIZE];
    bool sourced = which % 2 && member->source[0] != '\0';
    struct bytes made = command(room), attachment = stamp(stamped);
    struct stamp sent = {0, 0, 0, 0};
    char key[LINK_KEY];

    key_of(key, member->fabric, sourced ? member->source : member->agent,
           sourced ? "value" : "command");
    world.commanded = world.now;
    if (stamp_read(attachment, &sent) && sent.badge == world.bot.lease.badge)
        world.holder_said = world.now;
    hear(key, damaged(made, other),
         which % 16 == 0 ? "application/msgpack;other@0011223344556677"
                         : woodbot_command_schema.encoding,
         attachment);
}

/* Whatever the input says, at a key that the robot knows or any other. */
static void hear_anything(uint8_t which)
{
    char key[LINK_KEY], encoding[LINK_KEY];
    const char *declared = world.keys[which % WORLD_KEYS];
    struct bytes payload, attachment;

    if (which % 4 == 0 || *declared == '\0')
        take_text(key);
    else
        memcpy(key, declared, LINK_KEY);
    payload = take_some(255);
    attachment = take_some(40);
    take_text(encoding);
    world.commanded = world.holder_said = world.ticked = world.now;
    release(false);
    hear(key, payload, encoding, attachment);
}

static struct bytes answer(const char *selector, uint8_t which, uint8_t room[MESSAGE])
{
    if (strstr(selector, "@join") != NULL)
        return admission(room);
    if (strstr(selector, "@age") != NULL)
        return age(room, which);
    if (strstr(selector, "clock/tick") != NULL)
        return newest(room);
    return (struct bytes){room, 0};
}

static void be_answered(uint8_t which)
{
    struct asked *asked = &world.asks[which % WORLD_ASKS];
    uint8_t room[MESSAGE], other[MESSAGE];
    bool refused = which > 224;
    struct bytes payload;

    if (which < 128) /* the newest one */
        asked = &world.asks[(world.asked - 1) % WORLD_ASKS];
    payload = refused ? take_some(255)
                      : damaged(answer(asked->selector, which, room), other);
    release(!refused && payload.at == room);
    payload = copy(payload);
    woodbot_answered(&world.bot, which == 0 ? take() : asked->id, refused, payload,
                     (struct bytes){NULL, 0});
    drop(payload);
}

static void be_asked(uint8_t which)
{
    static const char *const ends[] = {
        "**", "state", "state/x", "sensors", "@schema", "@why", "@stopped", "@lease",
        "@call/reset", "@call/blink", "@call/*", "command", "@lease", "*",
    };
    const struct member *member = &world.bot.member;
    uint8_t room[MESSAGE], other[MESSAGE];
    char key[LINK_KEY], parameters[LINK_KEY] = "";
    struct bytes payload = {room, 0};

    if (which < 32)
        take_text(key);
    else if (which < 48)
        key_of(key, member->fabric, "stop/@holds", "");
    else
        key_of(key, member->fabric, which % 32 == 0 ? "*/*" : member->agent,
               ends[which % 14]);
    if (strstr(key, "@lease") != NULL)
        payload = damaged(claim(room), other);
    else if (which % 5 == 0)
        payload = take_some(255);
    if (which % 3 == 0)
        take_text(parameters);
    else if (which % 3 == 1)
        memcpy(parameters, "format=json", 12);
    payload = copy(payload);
    world.asking = true;
    woodbot_asked(&world.bot, &world.question, key, parameters, payload);
    world.asking = false;
    look_at_lease();
    drop(payload);
}

/* From inside poll: some messages, one after another. */
static void deliver(void)
{
    for (unsigned left = take() % 8; left > 0 && input.size > 0; left--) {
        uint8_t what = take(), which = take();

        switch (what % 8) {
        case 0: case 1: hear_clock(); break;
        case 2: case 3: be_answered(which); break;
        case 4: hear_command(which); break;
        case 5: be_asked(which); break;
        case 6: which % 8 == 0 ? hear_stop() : hear_command(which); break;
        default: hear_anything(which); break;
        }
    }
}

/* -- what else happens ------------------------------------------------------------ */

static void type(uint8_t which)
{
    static const char *const lines[] = {
        "test servos\n", "test sensors\n", "status\n", "reset\n", "get\n",
        "set name woodbot-7\n", "set source input/keys\n", "set fabric room\n",
        "set router tcp/10.0.0.1:7447\n", "set left_reversed yes\n",
    };
    struct bytes typed = take_some(255);
    size_t room = WORLD_CONSOLE - world.console_size;

    if (which < 160) {
        typed.at = (const uint8_t *)lines[which % 10];
        typed.size = strlen(lines[which % 10]);
    } else if (which < 192) {
        static uint8_t packet[300];
        size_t size = improv_write(packet, sizeof packet, IMPROV_RPC, typed.at,
                                   typed.size);
        typed = (struct bytes){packet, size};
    }
    if (typed.size > room)
        typed.size = room;
    if (typed.size > 0)
        memcpy(world.console + world.console_size, typed.at, typed.size);
    world.console_size += typed.size;
}

static void change(uint8_t how)
{
    world.network = how & 1 ? NETWORK_UP : (enum network)(how >> 1 & 3);
    world.opens = (how & 0x08) == 0;
    world.up = (how & 0x10) == 0;
    world.declares = (how & 0x20) == 0;
    world.puts = (how & 0x40) == 0;
    world.stall = how & 0x80 ? 700000 : 0;
    world.reading = (enum reading)(take() % 4);
}

static void go_round(void)
{
    woodbot_run(&world.bot, 0);
    if (world.bot.test != TEST_NONE) /* it drives by itself, for 1.2 s at most */
        world.tested = world.now;
    look_at_lease();
}

static void happen(uint8_t what, uint8_t which)
{
    switch (what % 16) {
    case 0: type(which); break;
    case 1: if (which < 64) change(take()); break;
    case 2: times.stops += which < 32; break;
    case 3: world_wait((uint64_t)which * which * 20); break; /* 1.3 s at most */
    case 4: if (which < 8) world_start(); break;
    case 5:
        if (which < 8) {
            struct bytes stored = take_some(255);
            memcpy(world.stored, stored.at, stored.size);
            world.stored_size = stored.size;
            world_start();
        }
        break;
    default:
        world_wait((uint64_t)which * 100);
        go_round();
        break;
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    input = (struct bytes){data, size};
    memset(&times, 0, sizeof times);
    memset(&world, 0, sizeof world);
    world.now = world.stepped = 3000000;
    world.network = NETWORK_UP;
    world.opens = world.up = world.declares = world.puts = true;
    world.deliver = deliver;
    world_start();
    while (input.size > 0) {
        uint8_t what = take();
        happen(what, take());
    }
    world_wait(WOODBOT_MAX_AGE_US + MOTORS_PERIOD * 1000u); /* nobody says anything */
    world_must(motors_motion(&world.bot.motors).why != WHY_DRIVEN);
    if (getenv("FUZZ_TELLS") != NULL)
        printf("driven for %u steps%s\n", (unsigned)world.driven / 2,
               world.led ? ", led" : "");
    return 0;
}
