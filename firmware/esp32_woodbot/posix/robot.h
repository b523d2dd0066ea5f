/* A Woodbot as a process: the parts that a board would have, modelled.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef WOODBOT_POSIX_ROBOT_H
#define WOODBOT_POSIX_ROBOT_H

#include <pthread.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "body.h"
#include "../cable/cable_socket.h"
#include "hardware.h"
#include "link.h"
#include "link_pico.h"
#include "settings.h"

enum { ROBOT_POINTS = 8, ROBOT_LINE = 200 };

/* -- parts.c: what reads the body, and how it fails -------------------------------- */

enum part { PART_FRONT, PART_RIGHT, PART_GYRO, PART_COMPASS, PARTS };
enum fault { FAULT_NONE, FAULT_ABSENT, FAULT_WRONG, FAULT_OLD, FAULT_NAN };

struct parts {
    enum fault fault[PARTS];
    uint64_t next[PARTS];    /* us: when each has something new */
    uint64_t noise;          /* state of the random numbers */
    struct light lights[LIGHTS];
};

/* -- network/air.c: a Wi-Fi that is there, or not ---------------------------------- */

struct air {
    bool modelled, off;      /* not modelled: the computer's own network */
    struct point { char ssid[33], password[65], user[65]; } points[ROBOT_POINTS];
    size_t count;
    char ssid[33], password[65], user[65]; /* what was joined */
    bool joined, scanning;
    uint64_t since, scanned; /* us: when it began to join, to scan */
};

/* -- network/names.c: names of hosts, looked up beside ----------------------------- */

enum names_mode { NAMES_ON, NAMES_OFF, NAMES_SLOW };

struct names {
    pthread_mutex_t lock;
    pthread_cond_t changed;
    enum names_mode mode;
    bool busy, fresh;
    char host[PICO_ADDRESS], wanted[PICO_ADDRESS], address[PICO_ADDRESS];
};

void names_start(struct names *names);
bool names_resolve(struct names *names, const char *host, char *address, size_t room);

/* -- tether.c: the serial line as the network -------------------------------------- */

struct tether {
    struct cable cable;
    struct cable_socket end;
    bool on;
};

/* The address for LINK_CABLE, NULL if there is no line; the console's bytes. */
const char *tether_open(void *self);
size_t tether_read(void *self, uint8_t *bytes, size_t room);
size_t tether_write(void *self, const uint8_t *bytes, size_t size);

/* -- the whole --------------------------------------------------------------------- */

struct options {
    const char *settings, *servos, *console, *control;
    const char *const *lines;   /* of control, done at the start */
    size_t line_count;
    uint64_t seed;
};

struct robot {
    struct options options;
    char **argv;
    pthread_mutex_t lock;       /* of body, parts and air */
    struct body body;
    struct parts parts;
    struct air air;
    struct names names;
    struct tether tether;
    enum reset started_by;
    uint8_t stored[SETTINGS_SIZE];
    size_t stored_size;
    int console_in, console_out, control_in, servo_log;
    atomic_uint fed;            /* times */
    atomic_uint hang_motors, hang_link; /* ms */
    atomic_bool ending;
    struct woodbot *bot;
    struct link_pico pico;
};

uint64_t robot_now(void);

struct hardware parts_hardware(struct robot *robot);
struct pico_port air_port(struct robot *robot);

/* settings (store.c) */
void store_open(struct robot *robot);
size_t store_load(void *self, uint8_t *bytes, size_t room);
bool store_store(void *self, const uint8_t *bytes, size_t size);

/* console (serial.c); false, after it said why */
bool serial_open(struct robot *robot);
size_t serial_read(void *self, uint8_t *bytes, size_t room);
size_t serial_write(void *self, const uint8_t *bytes, size_t size);

/* control (control.c) */
bool control_open(struct robot *robot);
bool control_line(struct robot *robot, const char *line, char *answer, size_t room);
/* Lines that came, and the watchdog, for ever: the board's own thread. */
void *control_run(void *robot);
/* The chip starts again: the servos get no more pulses. Does not return. */
void robot_reset(struct robot *robot, const char *why);

/* options.c: false, after it said what is wrong; settings go into `settings`. */
bool options_read(struct robot *robot, int argc, char **argv);
bool options_settings(struct robot *robot, int argc, char **argv,
                      struct settings *settings);

#endif
