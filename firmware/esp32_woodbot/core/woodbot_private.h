/* What a Woodbot is made of: for who makes one, in static memory. See woodbot.h.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef WOODBOT_PRIVATE_H
#define WOODBOT_PRIVATE_H

#include "console.h"
#include "fabric/member.h"
#include "wire/text.h"
#include "wire/wire.h"
#include "safety/motors_private.h"
#include "settings.h"
#include "safety/supervisor.h"
#include "woodbot.h"
#include "woodbot_schemas.h"

/* Why a command was refused; those of the codec come after. */
enum drop {
    DROP_SCHEMA,    /* it is of another schema */
    DROP_STAMP,     /* its stamp is none */
    DROP_FOREIGN,   /* it is of another run */
    DROP_REPLAYED,  /* something newer was obeyed */
    DROP_FUTURE,    /* its tick can't have been made */
    DROP_OLD,       /* its tick is older than a command may be */
    DROP_OUTSIDER,  /* it has a source, and that is another */
    DROP_LEASED,    /* another holds the lease */
    DROP_PAYLOAD,   /* and an enum codec_status */
    DROPS = DROP_PAYLOAD + CODEC_NO_ROOM + 1
};

/* A schema that is not the command's, and what its writer said of it. */
struct compatibility {
    char digest[20];
    char port[NAME_SIZE];
    bool known;
    char differs[40], unit[16]; /* the field that differs, and its unit there; or "" */
    uint64_t asked;             /* us */
};

/* When something came of its source, and its tick as that says when it is asked. */
struct liveness {
    uint64_t came, asked;       /* us */
    uint64_t told;              /* 0: it was not asked since something came */
    unsigned missed;
};

/* What it was told, and what was refused. */
struct inlet {
    struct woodbot_command command;
    bool told;
    uint64_t n, badge;         /* of the newest that was stamped: later ones are newer */
    uint64_t said;             /* the tick at which its source said it */
    double heard;              /* s: that tick's time; 0 before it was told anything */
    uint64_t made;             /* us: that tick's, at the earliest; 0: not known yet */
    uint64_t came;             /* us: when it was heard */
    uint64_t dropped;
    uint32_t reasons[DROPS];
    const char *path;          /* of the field that was wrong last, or NULL */
    char schema[64];           /* of the last that was of another one */
    struct compatibility compatibility;
    struct liveness liveness;
};

/* The right of a run elsewhere to command it, and of nobody else. */
struct lease {
    uint64_t badge;            /* in the stamps of its holder; 0: nobody holds it */
    uint64_t until;            /* us: its end, unless it is asked for again */
    char holder[HOLDER_SIZE];
};

/* The motors' loop, in figures: written by its task alone. */
struct pace {
    uint64_t due;              /* us */
    _Atomic uint32_t cycles, missed, worst; /* worst: us */
};

/* What the first light shows: robot/leds.c. */
enum leds_state {
    LIGHTS_STOPPED, LIGHTS_NEW, LIGHTS_JOINING, LIGHTS_NO_NETWORK, LIGHTS_NO_ROUTER,
    LIGHTS_NO_CLOCK, LIGHTS_REFUSED, LIGHTS_STANDS, LIGHTS_DRIVEN
};

enum test { TEST_NONE, TEST_LEFT, TEST_RIGHT };

enum { SCRATCH = 2048, PARTS = 4 };
_Static_assert((int)SCRATCH >= (int)WOODBOT_SCHEMA_ANSWER, "an answer fits");

struct woodbot {
    struct hardware hardware;
    struct link link;
    struct settings settings;
    struct console console;
    struct supervisor supervisor;
    struct motors motors;
    struct pace pace;

    const char *locators[SETTINGS_ROUTERS + 1];
    struct member member;
    struct lease lease;
    struct claim taken;        /* the run that has lost its lease, and the taker's name */
    struct inlet inlet;
    enum why held;             /* why the motors stand, as the link's task sees it */
    bool changed;              /* its settings were, by the console */

    struct woodbot_state state;
    struct woodbot_sensors sensors;
    struct woodbot_command obeyed;
    struct stamp stamp, source; /* of state and sensors, of what it obeys */
    enum reading parts[PARTS]; /* lidars ahead and on the right, compass, gyro */

    enum test test;
    struct light lights[LIGHTS];
    uint64_t blink, test_until, asked_in; /* us */
    uint8_t scratch[SCRATCH];
};

/* -- for its own files ------------------------------------------------------------ */

uint64_t woodbot_now(const struct woodbot *bot);
bool woodbot_stopped(const struct woodbot *bot);
/* The session is broken: it is closed, and opened anew. */
void woodbot_broken(struct woodbot *bot);
/* Whether the motors may be driven now; whoever begins anew has heard nothing. */
void woodbot_hold(struct woodbot *bot);

/* robot/commands.c: what it is told. */
bool commands_declare(struct woodbot *bot, const struct member *member);
bool commands_heard(struct woodbot *bot, const char *key, struct bytes payload,
                    const char *encoding, struct bytes attachment);
/* The key of its source, with all ports where none is named. */
const char *commands_source(const struct member *member, char room[LINK_KEY]);
/* Obey what it was told as soon as its age is known. */
void commands_obey(struct woodbot *bot);
void commands_clear(struct woodbot *bot);
/* A sentence about what was refused for one reason. */
void commands_why(const struct woodbot *bot, enum drop drop, struct text *text);

/* robot/compatibility.c: whether another schema says the same. */
bool compatibility_is(struct woodbot *bot, const char *digest, const char *key);
bool compatibility_step(struct woodbot *bot, uint64_t now);
bool compatibility_answered(struct woodbot *bot, uint32_t id, struct bytes payload);

/* robot/liveness.c: whether it hears its source. */
void liveness_heard(struct woodbot *bot);
bool liveness_step(struct woodbot *bot, uint64_t now);
bool liveness_answered(struct woodbot *bot, uint32_t id, struct bytes attachment);

/* robot/answers.c: what it is asked. */
bool answers_declare(struct woodbot *bot, const struct member *member);
void answers_asked(struct woodbot *bot, void *question, const char *key,
                   const char *parameters, struct bytes payload);

/* robot/verbs.c: what it can be called for; the payload of the answer. */
struct bytes verbs_call(struct woodbot *bot, const char *verb, struct bytes payload);
extern const char *const verbs[]; /* ends with NULL */

/* robot/servos.c: the verb that tells and sets what its servos are like. */
void servos_call(struct woodbot *bot, struct bytes message, struct wire_writer *out);

/* robot/report.c: what it says at each tick, and its sensors. */
void report_sense(struct woodbot *bot);
bool report_tick(struct woodbot *bot);
const char *report_why(enum why why);

/* robot/leds.c: what it does, at a glance. */
void leds_show(struct woodbot *bot, uint64_t now);

/* robot/lease.c: who commands it from another fabric. */
void lease_asked(struct woodbot *bot, void *question, const char *key,
                 struct bytes payload);
void lease_taken(struct woodbot *bot, void *question, const char *key,
                 struct bytes payload);
void lease_step(struct woodbot *bot, uint64_t now);

/* robot/operator.c: what the console asks of it. */
void operator_host(struct woodbot *bot, struct console_host *host);
void operator_test(struct woodbot *bot, uint64_t now);

#endif
