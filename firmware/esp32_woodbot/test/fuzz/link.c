/* SPDX-License-Identifier: Apache-2.0 */
#include <string.h>

#include "world.h"

static void look(struct bytes bytes)
{
    volatile uint8_t sum = 0;

    world_must(bytes.size <= LINK_PAYLOAD);
    for (size_t i = 0; i < bytes.size; i++)
        sum = (uint8_t)(sum + bytes.at[i]);
}

static void look_at_key(const char *key)
{
    world_must(world.open);
    world_must(strlen(key) > 0 && strlen(key) < LINK_KEY);
}

static void join(void *self, const struct network_settings *settings)
{
    (void)self;
    world_must(strlen(settings->ssid) < 33 && strlen(settings->password) < 65);
    world_must(strlen(settings->user) < 65);
    world_must(strlen(settings->name) > 0 && strlen(settings->name) < 33);
}

static enum network network(void *self)
{
    (void)self;
    return world.network;
}

static int scan(void *self, struct access_point *found, size_t room)
{
    (void)self;
    if (world.now / 1000 % 2)
        return -1;
    for (size_t i = 0; i < room; i++) {
        memset(&found[i], 0, sizeof found[i]);
        memset(found[i].ssid, (int)(world.now >> i) & 0xFF, 32);
        found[i].rssi = -(int)i;
    }
    return (int)room;
}

static bool open(void *self, const char *locator)
{
    (void)self;
    world_must(!world.open && world.network == NETWORK_UP);
    world_must(strlen(locator) < SETTINGS_ROUTER);
    world_wait(world.stall);
    world.open = world.opens;
    return world.open;
}

static void close(void *self)
{
    (void)self;
    world_must(world.open);
    world.open = false;
    memset(world.keys, 0, sizeof world.keys);
    memset(world.asks, 0, sizeof world.asks);
}

static bool up(void *self)
{
    (void)self;
    world_must(world.open);
    return world.up;
}

static size_t place_of(const char *key)
{
    size_t i = 0;

    while (i < WORLD_KEYS && strcmp(world.keys[i], key) != 0)
        i++;
    return i;
}

/* What is declared again and again, and never taken back, runs out of room. */
static bool declare(void *self, const char *key)
{
    size_t place;

    (void)self;
    look_at_key(key);
    if (!world.declares)
        return false;
    place = place_of(key);
    if (place == WORLD_KEYS)
        place = place_of("");
    world_must(place < WORLD_KEYS);
    memcpy(world.keys[place], key, strlen(key) + 1);
    return true;
}

static void forget(void *self, const char *key)
{
    size_t place = place_of(key);

    (void)self;
    look_at_key(key);
    if (place < WORLD_KEYS)
        world.keys[place][0] = '\0';
}

static bool put(void *self, const char *key, struct bytes payload, const char *encoding,
                struct bytes attachment, bool urgent)
{
    (void)self;
    (void)urgent;
    look_at_key(key);
    look(payload);
    look(attachment);
    world_must(strlen(encoding) < LINK_KEY);
    return world.puts;
}

static bool ask(void *self, const char *selector, struct bytes payload, uint32_t id,
                uint32_t timeout)
{
    struct asked *asked = &world.asks[world.asked++ % WORLD_ASKS];

    (void)self;
    look_at_key(selector);
    look(payload);
    world_must(id != 0 && timeout > 0 && timeout <= 10000);
    asked->id = id;
    memcpy(asked->selector, selector, strlen(selector) + 1);
    return world.puts;
}

static void look_at_question(const void *question)
{
    world_must(question == &world.question && world.asking);
}

static bool reply(void *self, void *question, const char *key, struct bytes payload,
                  const char *encoding, struct bytes attachment)
{
    (void)self;
    look_at_question(question);
    world_must(strlen(key) > 0 && strlen(key) < LINK_KEY);
    look(payload);
    look(attachment);
    world_must(strlen(encoding) < LINK_KEY);
    return world.puts;
}

static bool refuse(void *self, void *question, const char *sentence)
{
    (void)self;
    look_at_question(question);
    world_must(strlen(sentence) < SCRATCH);
    return world.puts;
}

static void poll(void *self, uint32_t ms)
{
    (void)self;
    (void)ms;
    if (world.open)
        world.deliver();
}

const struct link world_link = {
    .join = join, .network = network, .scan = scan, .open = open, .close = close,
    .up = up, .subscribe = declare, .answer = declare, .token = declare,
    .forget = forget, .put = put, .ask = ask, .reply = reply, .refuse = refuse,
    .poll = poll,
};
