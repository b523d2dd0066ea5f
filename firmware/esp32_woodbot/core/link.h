/* Link: Wi-Fi and a Zenoh session, as the core sees them. The other seam (hardware.h).
 *
 * Only the link's task calls. Nothing may take longer than LINK_STALL ms: motors do not
 * wait for it, but a robot that is being opened hears no STOP. What comes is told to the
 * core by the `woodbot_heard`, `_asked` and `_answered` of woodbot.h, from inside `poll`
 * and from nowhere else. Keys are whole (`rems/robot/woodbot-7/state`).
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef WOODBOT_LINK_H
#define WOODBOT_LINK_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum {
    LINK_STALL = 2500,  /* ms: the longest that a call may take (`open`) */
    LINK_KEY = 160,     /* bytes of a key, its end included */
    LINK_PAYLOAD = 4096 /* zenoh-pico drops longer messages without a word */
};

/* What the network (Wi-Fi, a cable) is doing. */
enum network {
    NETWORK_OFF,        /* no settings, or a serial line instead of it */
    NETWORK_JOINING,
    NETWORK_UP,
    NETWORK_NOT_FOUND,  /* no access point of that name */
    NETWORK_REFUSED,    /* the password, or the user, is wrong */
    NETWORK_SECURITY    /* a password that an open network lacks, or the reverse */
};

/* A locator: the session goes through the console's serial line, and needs no network. */
#define LINK_CABLE "cable"

struct bytes {
    const uint8_t *at;
    size_t size;
};

struct network_settings {
    const char *ssid, *password;
    const char *user;   /* of an enterprise network; "" elsewhere */
    const char *name;   /* of the robot: its hostname in the network */
};

/* How a network is, after its name: "is not to be found here". */
const char *network_describe(enum network network);

/* An access point that a scan has found. */
struct access_point {
    char ssid[33];
    int rssi;           /* dBm */
    bool open;          /* it asks for no password */
};

struct link {
    void *self;

    /* Join this network from now on, and again whenever it is lost. What `network` says
     * is of this one from the moment of the call. An empty ssid: no Wi-Fi. */
    void (*join)(void *self, const struct network_settings *settings);
    enum network (*network)(void *self);

    /* Begin a scan, or go on with it: -1 while it lasts, then how many were found. */
    int (*scan)(void *self, struct access_point *found, size_t room);

    /* Open a session to `tcp/192.168.1.20:7447`; "" looks for a router by multicast.
     * True if it is open. A session is never opened twice without a close. */
    bool (*open)(void *self, const char *locator);
    void (*close)(void *self);

    /* Whether a router is there, as far as the session knows. */
    bool (*up)(void *self);

    /* Declare; `forget` takes back whatever was declared at that very key. */
    bool (*subscribe)(void *self, const char *key);
    bool (*answer)(void *self, const char *key);
    bool (*token)(void *self, const char *key);
    void (*forget)(void *self, const char *key);

    /* Put: what is late is dropped, unless it is `urgent`, which waits a little. An
     * encoding or attachment may be empty. False: the session is broken. */
    bool (*put)(void *self, const char *key, struct bytes payload,
                const char *encoding, struct bytes attachment, bool urgent);

    /* Ask at a selector; answers come with this `id`, which is not 0, until `timeout`
     * ms have gone. */
    bool (*ask)(void *self, const char *selector, struct bytes payload, uint32_t id,
                uint32_t timeout);

    /* Answer a question of which `woodbot_asked` told, until that returns; any number of
     * times, or refuse it with a sentence. */
    bool (*reply)(void *self, void *question, const char *key, struct bytes payload,
                  const char *encoding, struct bytes attachment);
    bool (*refuse)(void *self, void *question, const char *sentence);

    /* Let what came in be told; wait for at most `ms` if nothing has. */
    void (*poll)(void *self, uint32_t ms);
};

#endif
