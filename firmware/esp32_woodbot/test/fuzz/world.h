/* World: the parts and the link of a robot that is fuzzed, and the laws that it keeps.
 *
 * Time is simulated, and the motors' task runs every MOTORS_PERIOD ms of it, whatever
 * the link's task does meanwhile. What breaks a law ends the program.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef FUZZ_WORLD_H
#define FUZZ_WORLD_H

#include "wire/keys.h"
#include "woodbot_private.h"

enum { WORLD_ASKS = 16, WORLD_KEYS = 64, WORLD_CONSOLE = 1024 };

/* What was asked of the clock, and is not answered yet. */
struct asked {
    uint32_t id;
    char selector[LINK_KEY];
};

struct world {
    struct woodbot bot;
    uint64_t now, stepped;          /* us */

    /* What the link answers: set by the input. */
    enum network network;
    bool opens, up, declares, puts;
    uint32_t stall;                 /* us that an open takes */

    bool open;
    char keys[WORLD_KEYS][LINK_KEY]; /* declared */
    struct asked asks[WORLD_ASKS];
    unsigned asked;
    int question;                   /* a question is its address */
    bool asking;
    void (*deliver)(void);          /* from inside poll */

    uint8_t console[WORLD_CONSOLE];
    size_t console_size;
    uint8_t stored[SETTINGS_SIZE];
    size_t stored_size;
    enum reading reading;

    /* When something came that may be a command, or a tick; when it tested itself. */
    uint64_t commanded, ticked, tested;
    /* STOP was said, and released. */
    uint64_t stopped, released, stops;
    uint32_t driven;                /* steps at which a wheel turned */
    /* When somebody got the lease that is held, and when its holder may have commanded. */
    uint64_t leased, badge, holder_said;
    bool led;                       /* its holder has driven it */
};

extern struct world world;
extern const struct link world_link;

/* A robot that has just been switched on; what it has stored stays. */
void world_start(void);
/* Let time go by. */
void world_wait(uint64_t us);
void world_must(bool holds);

#endif
