/* The console: a pseudo-terminal, or standard input and output, or none.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <termios.h>
#include <unistd.h>

#include "robot.h"

/* A chip that starts again keeps its cable: the terminal outlives `exec`. */
static const char KEPT[] = "WOODBOT_CONSOLE";

static bool complain(const char *what)
{
    fprintf(stderr, "woodbot-posix: %s: %s\n", what, strerror(errno));
    return false;
}

static bool open_terminal(struct robot *robot)
{
    const char *kept = getenv(KEPT);
    char number[16];
    struct termios raw;
    int master, slave;

    if (kept != NULL) {
        robot->console_in = robot->console_out = atoi(kept);
        return true;
    }
    master = posix_openpt(O_RDWR | O_NOCTTY);
    if (master < 0 || grantpt(master) < 0 || unlockpt(master) < 0)
        return complain("no pseudo-terminal");
    /* One end stays open here: without it, whoever leaves would break the line. */
    slave = open(ptsname(master), O_RDWR | O_NOCTTY);
    if (slave < 0 || tcgetattr(slave, &raw) < 0)
        return complain(ptsname(master));
    cfmakeraw(&raw);
    tcsetattr(slave, TCSANOW, &raw);
    fcntl(master, F_SETFL, fcntl(master, F_GETFL, 0) | O_NONBLOCK);
    robot->console_in = robot->console_out = master;
    snprintf(number, sizeof number, "%d", master);
    setenv(KEPT, number, 1);
    printf("console %s\n", ptsname(master));
    return true;
}

bool serial_open(struct robot *robot)
{
    const char *where = robot->options.console;

    robot->console_in = robot->console_out = -1;
    if (strcmp(where, "none") == 0)
        return true;
    if (strcmp(where, "pty") == 0)
        return open_terminal(robot);
    robot->console_in = STDIN_FILENO;
    robot->console_out = STDOUT_FILENO;
    return true;
}

size_t serial_read(void *self, uint8_t *bytes, size_t room)
{
    struct robot *robot = self;
    struct pollfd one = {robot->console_in, POLLIN, 0};
    ssize_t got;

    if (robot->console_in < 0 || poll(&one, 1, 0) <= 0)
        return 0;
    got = read(robot->console_in, bytes, room);
    if (got == 0) /* its end: the robot goes on */
        robot->console_in = -1;
    return got > 0 ? (size_t)got : 0;
}

size_t serial_write(void *self, const uint8_t *bytes, size_t size)
{
    struct robot *robot = self;
    struct pollfd one = {robot->console_out, POLLOUT, 0};
    ssize_t put;

    if (robot->console_out < 0)
        return size; /* as a cable that nobody plugged in */
    if (poll(&one, 1, 0) <= 0)
        return 0;
    put = write(robot->console_out, bytes, size);
    return put > 0 ? (size_t)put : 0;
}
