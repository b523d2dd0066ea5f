/* The serial line as the network, once a session is wanted through it: from then on the
 * line is read here, in a thread of its own, and the console gets its part of it.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#include <poll.h>

#include "robot.h"

enum { LOOK = 2 /* ms: the session's bytes are looked for as often */ };

static void *carry(void *self)
{
    struct robot *robot = self;
    struct tether *tether = &robot->tether;

    for (;;) {
        struct pollfd line = {robot->console_in, POLLIN, 0};

        cable_step(&tether->cable, robot_now());
        if (!cable_busy(&tether->cable))
            poll(&line, 1, LOOK);
    }
    return NULL;
}

/* Of the link's task, as the console's two below: nobody else reads the line then. */
const char *tether_open(void *self)
{
    struct robot *robot = self;
    struct tether *tether = &robot->tether;
    struct cable_port port = {.line = robot, .read = serial_read,
                              .write = serial_write};
    pthread_t thread;

    if (tether->on)
        return tether->end.locator;
    if (robot->console_in < 0 || !cable_socket_open(&tether->end, &port))
        return NULL;
    cable_start(&tether->cable, &port);
    tether->on = pthread_create(&thread, NULL, carry, robot) == 0;
    if (!tether->on)
        cable_socket_close(&tether->end);
    return tether->on ? tether->end.locator : NULL;
}

size_t tether_read(void *self, uint8_t *bytes, size_t room)
{
    struct robot *robot = self;

    return robot->tether.on ? cable_read(&robot->tether.cable, bytes, room)
                            : serial_read(self, bytes, room);
}

size_t tether_write(void *self, const uint8_t *bytes, size_t size)
{
    struct robot *robot = self;

    return robot->tether.on ? cable_write(&robot->tether.cable, bytes, size)
                            : serial_write(self, bytes, size);
}
