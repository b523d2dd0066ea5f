/* The whole core, fuzzed from the network: whatever comes by whatever key, nothing is
 * read or written out of place, and no wheel turns that must not.
 *
 * An input is a row of messages: a byte says what kind, one which key, one how many
 * bytes follow. A link that is always well lets the robot in, and keeps nothing.
 *
 *     clang -g -O1 -fsanitize=fuzzer,address,undefined -fno-sanitize-recover=all \
 *         core/X.c core/X/X.c test/fuzz_woodbot.c -lm -o fuzz_woodbot   (X: a star)
 *     ./fuzz_woodbot -runs=10000000 -max_len=2000
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "../core/wire/messages.h"
#include "../core/woodbot_private.h"

#define RUN UINT64_C(0x123456789A)
#define BADGE (RUN << 24 | 7)
#define DT 0.02

static struct woodbot bot;
static uint64_t now;
static unsigned pulses[2];
static uint32_t asked;           /* the number of the newest question */
static bool joins;               /* ... which is that to be let in */
static char selector[LINK_KEY];

/* -- the seams --------------------------------------------------------------------- */

static uint64_t tell_now(void *self) { (void)self; return now; }

static void servo(void *self, enum wheel wheel, unsigned pulse)
{
    (void)self;
    pulses[wheel] = pulse;
}

static void feed(void *self) { (void)self; }

static enum reading lidar(void *self, enum lidar which, double *metres)
{
    (void)self;
    *metres = which == LIDAR_FRONT ? 0.4 : 1e308;
    return READING_NEW;
}

static enum reading gyro(void *self, double *rate)
{
    (void)self;
    (void)rate;
    return READING_ABSENT;
}

static enum reading compass(void *self, double *ahead, double *left)
{
    (void)self;
    *ahead = *left = 0;
    return READING_NEW;
}

static void lights(void *self, const struct light shown[LIGHTS])
{
    (void)self;
    (void)shown;
}

static size_t load(void *self, uint8_t *bytes, size_t room)
{
    (void)self; (void)bytes; (void)room;
    return 0;
}

static bool store(void *self, const uint8_t *bytes, size_t size)
{
    (void)self; (void)bytes; (void)size;
    return true;
}

static size_t read_none(void *self, uint8_t *bytes, size_t room)
{
    (void)self; (void)bytes; (void)room;
    return 0;
}

static size_t write_all(void *self, const uint8_t *bytes, size_t size)
{
    (void)self; (void)bytes;
    return size;
}

static uint64_t identity(void *self) { (void)self; return 1; }
static enum reset started_by(void *self) { (void)self; return RESET_POWER; }
static void restart(void *self) { (void)self; }

static void join(void *self, const struct network_settings *settings)
{
    (void)self; (void)settings;
}

static enum network network(void *self) { (void)self; return NETWORK_UP; }

static int scan(void *self, struct access_point *found, size_t room)
{
    (void)self; (void)found; (void)room;
    return 0;
}

static bool open_session(void *self, const char *locator)
{
    (void)self;
    return strlen(locator) < 100;
}

static void close_session(void *self) { (void)self; }
static bool up(void *self) { (void)self; return true; }
static bool key_well(void *self, const char *key) { (void)self; return *key != '\0'; }
static void forget(void *self, const char *key) { (void)self; (void)key; }

/* Read all of it, as a link does, so that the sanitizer sees what is no one's. */
static void taken(struct bytes bytes)
{
    static volatile uint8_t sum;

    for (size_t i = 0; i < bytes.size; i++)
        sum = (uint8_t)(sum + bytes.at[i]);
    if (bytes.size > LINK_PAYLOAD)
        abort();
}

static bool put(void *self, const char *key, struct bytes payload, const char *encoding,
                struct bytes attachment, bool urgent)
{
    (void)self; (void)key; (void)encoding; (void)urgent;
    taken(payload);
    taken(attachment);
    return true;
}

static bool ask(void *self, const char *asks, struct bytes payload, uint32_t id,
                uint32_t timeout)
{
    (void)self; (void)timeout;
    if (id == 0 || strlen(asks) >= LINK_KEY)
        abort();
    taken(payload);
    asked = id;
    strcpy(selector, asks);
    joins = joins || strstr(asks, "@join") != NULL;
    return true;
}

static bool reply(void *self, void *question, const char *key, struct bytes payload,
                  const char *encoding, struct bytes attachment)
{
    (void)self; (void)question; (void)encoding;
    if (*key == '\0')
        abort();
    taken(payload);
    taken(attachment);
    return true;
}

static bool refuse(void *self, void *question, const char *sentence)
{
    (void)self; (void)question;
    if (*sentence == '\0')
        abort();
    return true;
}

static void *keep(void *self, void *question) { (void)self; return question; }
static void done(void *self, void *kept) { (void)self; (void)kept; }
static void poll(void *self, uint32_t ms) { (void)self; now += ms * 1000; }

/* -- the world --------------------------------------------------------------------- */

static const struct hardware hardware = {
    NULL, tell_now, servo, feed, lidar, gyro, compass, lights, load, store, read_none,
    write_all, identity, started_by, restart,
};

static const struct link link = {
    NULL, join, network, scan, open_session, close_session, up, key_well, key_well,
    key_well, forget, put, ask, reply, refuse, keep, done, poll,
};

static const struct bytes nothing;

/* With FUZZ_TELL in the environment it says where an input has got. */
static void tell(void)
{
    if (getenv("FUZZ_TELL") == NULL)
        return;
    if (pulses[0])
        puts(woodbot_lent(&bot) ? "driven abroad" : "driven");
    if (woodbot_stopped(&bot))
        puts("stopped");
    if (woodbot_lent(&bot))
        puts("lent");
}

static void go_round(void)
{
    woodbot_run(&bot, 5);
    woodbot_drive(&bot);
    /* Whoever stands has no pulse, and who is told nothing stands. */
    if ((woodbot_stopped(&bot) || bot.home.seat != SEAT_IN) && (pulses[0] || pulses[1]))
        abort();
    tell();
}

/* Let it in, by the answer that a clock gives. */
static void admit(void)
{
    uint8_t room[128];
    struct wire_writer out = wire_write(room, sizeof room);

    wire_put_map(&out, 5);
    wire_put_text(&out, "badge");
    wire_put_whole(&out, BADGE);
    wire_put_text(&out, "first");
    wire_put_whole(&out, 1);
    wire_put_text(&out, "dt");
    wire_put_real(&out, DT);
    wire_put_text(&out, "stops");
    wire_put_whole(&out, 0);
    wire_put_text(&out, "patience");
    wire_put_real(&out, 30);
    joins = false;
    woodbot_answered(&bot, asked, false, wire_written(&out), nothing);
}

static void tick(uint64_t n)
{
    uint8_t room[64];
    struct wire_writer out = wire_write(room, sizeof room);

    wire_put_list(&out, 7);
    wire_put_whole(&out, RUN);
    wire_put_whole(&out, n);
    wire_put_real(&out, (double)n * DT);
    wire_put_real(&out, DT);
    wire_put_real(&out, 1);
    wire_put_whole(&out, 1);
    wire_put_whole(&out, bot.home.guard.stops);
    woodbot_heard(&bot, "rems/clock/tick", wire_written(&out), "", nothing);
}

static void begin(void)
{
    now = 1000000;
    asked = 0;
    joins = false;
    pulses[0] = pulses[1] = 0;
    woodbot_start(&bot, &hardware, &link);
    for (int i = 0; i < 20 && !joins; i++)
        go_round();
    admit();
    tick(1);
}

/* -- what comes -------------------------------------------------------------------- */

static const char *const heard[] = {
    "rems/clock/tick", "rems/stop", "rems/robot/woodbot/command", "b/clock/tick",
    "b/clock/@step/roster", "b/stop", "b/robot/woodbot/command", "b/input/keys/value",
};
static const char *const questions[] = {
    "rems/robot/woodbot/@lend", "b/robot/woodbot/@lend", "rems/**", "rems/robot/*/state",
    "rems/robot/woodbot/@call/reset", "rems/robot/woodbot/@call/servos",
    "rems/robot/woodbot/@call/*", "rems/robot/*/@why", "rems/robot/*/@stopped",
    "rems/stop/@holds", "rems/robot/woodbot/@schema", "b/robot/woodbot/**",
};

#define COUNT(table) (sizeof(table) / sizeof((table)[0]))

static void hear(const char *key, struct bytes message)
{
    /* The first byte says how many the attachment has, behind it. */
    size_t size = message.size > 0 ? message.at[0] % message.size : 0;
    struct bytes attachment = {message.at + (message.size > 0), size};
    struct bytes payload = {attachment.at + size,
                            message.size - size - (message.size > 0)};

    woodbot_heard(&bot, key, payload,
                  size % 3 ? woodbot_command_schema.encoding
                           : "application/msgpack;a@0123456789abcdef",
                  attachment);
}

static void message(unsigned kind, unsigned key, struct bytes bytes)
{
    switch (kind % 6) {
    case 0: hear(heard[key % COUNT(heard)], bytes); break;
    case 1:
        woodbot_asked(&bot, &bot, questions[key % COUNT(questions)],
                      key & 16 ? "format=json" : "", bytes);
        break;
    case 2: woodbot_answered(&bot, asked - key % 8, key & 8, bytes, bytes); break;
    case 3: woodbot_answered(&bot, UINT32_MAX - key % 4, false, bytes, bytes); break;
    case 4: now += key * UINT64_C(20000); tick(bot.home.beat.n + 1); break;
    default: go_round(); break;
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    begin();
    while (size >= 3) {
        size_t count = data[2] < size - 3 ? data[2] : size - 3;
        struct bytes bytes = {malloc(count + 1), count};

        /* In memory of its own, so that a byte too many is seen. */
        bytes.at = memcpy(realloc((void *)bytes.at, count ? count : 1), data + 3, count);
        message(data[0], data[1], bytes);
        if (joins && data[1] & 1)
            admit();
        free((void *)bytes.at);
        data += 3 + count;
        size -= 3 + count;
    }
    go_round();
    return 0;
}
