/* Control: what happens to the robot from outside, a line at a time.
 *
 * `air LAB secret` is an access point, `air off` an outage, `part front absent` a lidar
 * that is not there: see USAGE in options.c. Each line is answered on standard output.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#include <errno.h>
#include <fcntl.h>
#ifdef __GLIBC__
#include <malloc.h>
#endif
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "robot.h"

enum { WORDS = 5, LOOK = 20 /* ms */, WATCHDOG = 20 /* looks without being fed */ };

/* -- the lines --------------------------------------------------------------------- */

/* Which of the words of `all` this is; -1 for none. */
static int which(const char *word, const char *const *all)
{
    for (int i = 0; all[i] != NULL; i++)
        if (strcmp(word, all[i]) == 0)
            return i;
    return -1;
}

static bool do_air(struct robot *robot, char **word, size_t count)
{
    struct air *air = &robot->air;
    struct point *point = NULL;

    air->modelled = true;
    if (count < 2)
        return false;
    if (strcmp(word[1], "on") == 0 || strcmp(word[1], "off") == 0) {
        air->off = strcmp(word[1], "off") == 0;
        return true;
    }
    for (size_t i = 0; i < air->count; i++) /* it has another password now */
        if (strcmp(air->points[i].ssid, word[1]) == 0)
            point = &air->points[i];
    if (point == NULL && air->count < ROBOT_POINTS)
        point = &air->points[air->count++];
    if (point == NULL)
        return false;
    snprintf(point->ssid, sizeof point->ssid, "%s", word[1]);
    snprintf(point->password, sizeof point->password, "%s", count > 2 ? word[2] : "");
    snprintf(point->user, sizeof point->user, "%s", count > 3 ? word[3] : "");
    return true;
}

static bool do_part(struct robot *robot, char **word, size_t count)
{
    static const char *const parts[] = {"front", "right", "gyro", "compass", NULL};
    static const char *const faults[] = {"good", "absent", "wrong", "old", "nan", NULL};
    const int part = count == 3 ? which(word[1], parts) : -1;
    const int fault = count == 3 ? which(word[2], faults) : -1;

    if (part < 0 || fault < 0)
        return false;
    robot->parts.fault[part] = (enum fault)fault;
    return true;
}

static bool do_servo(struct robot *robot, char **word, size_t count)
{
    static const char *const sides[] = {"left", "right", NULL};
    static const char *const what[] = {"trim", "dead", "top", NULL};
    const int side = count == 4 ? which(word[1], sides) : -1;
    const int member = count == 4 ? which(word[2], what) : -1;
    struct servo *servo;

    if (side < 0 || member < 0)
        return false;
    body_advance(&robot->body, robot_now());
    servo = &robot->body.servo[side];
    *(member == 0 ? &servo->trim : member == 1 ? &servo->dead_band : &servo->top_speed)
        = atof(word[3]);
    return true;
}

static bool do_place(struct robot *robot, char **word, size_t count)
{
    if (count == 2) { /* arena RADIUS */
        robot->body.arena_radius = atof(word[1]);
        return true;
    }
    if (count != 4)
        return false;
    robot->body.at = robot_now();
    robot->body.x = atof(word[1]);
    robot->body.y = atof(word[2]);
    robot->body.heading = atof(word[3]);
    return true;
}

static bool do_names(struct robot *robot, char **word, size_t count)
{
    static const char *const modes[] = {"on", "off", "slow", NULL};
    const int mode = count == 2 ? which(word[1], modes) : -1;

    if (mode < 0)
        return false;
    pthread_mutex_lock(&robot->names.lock);
    robot->names.mode = (enum names_mode)mode;
    pthread_mutex_unlock(&robot->names.lock);
    return true;
}

static bool do_hang(struct robot *robot, char **word, size_t count)
{
    static const char *const tasks[] = {"motors", "link", NULL};
    const int task = count == 3 ? which(word[1], tasks) : -1;

    if (task < 0)
        return false;
    atomic_store(task == 0 ? &robot->hang_motors : &robot->hang_link,
                 (unsigned)atoi(word[2]));
    return true;
}

static bool do_pose(struct robot *robot, char *answer, size_t room)
{
    body_advance(&robot->body, robot_now());
    snprintf(answer, room, "pose %.6f %.6f %.6f", robot->body.x, robot->body.y,
             robot->body.heading);
    return true;
}

static bool do_lights(struct robot *robot, char *answer, size_t room)
{
    size_t at = (size_t)snprintf(answer, room, "lights");

    for (int i = 0; i < LIGHTS && at + 8 < room; i++) {
        const struct light *one = &robot->parts.lights[i];

        at += (size_t)snprintf(answer + at, room - at, " %02x%02x%02x", one->red,
                               one->green, one->blue);
    }
    return true;
}

/* Bytes that are taken of the heap: only zenoh-pico, and libc itself, take any. */
static bool do_heap(char *answer, size_t room)
{
#ifdef __GLIBC__
    snprintf(answer, room, "heap %zu", mallinfo2().uordblks);
#else
    snprintf(answer, room, "heap unknown");
#endif
    return true;
}

bool control_line(struct robot *robot, const char *line, char *answer, size_t room)
{
    static const char *const verbs[] = {"air", "part", "servo", "place", "arena",
                                        "names", "hang", "pose", "lights", "heap",
                                        NULL};
    char copy[ROBOT_LINE], *word[WORDS], *rest = copy;
    size_t count = 0;
    bool good = false;

    snprintf(copy, sizeof copy, "%s", line);
    while (count < WORDS && (word[count] = strtok_r(rest, " \t\r", &rest)) != NULL)
        count++;
    snprintf(answer, room, "ok");
    if (count == 0)
        return true;
    if (strcmp(word[0], "reset") == 0 && count == 2)
        robot_reset(robot, word[1]);
    pthread_mutex_lock(&robot->lock);
    switch (which(word[0], verbs)) {
    case 0: good = do_air(robot, word, count); break;
    case 1: good = do_part(robot, word, count); break;
    case 2: good = do_servo(robot, word, count); break;
    case 3:
    case 4: good = do_place(robot, word, count); break;
    case 5: good = do_names(robot, word, count); break;
    case 6: good = do_hang(robot, word, count); break;
    case 7: good = do_pose(robot, answer, room); break;
    case 8: good = do_lights(robot, answer, room); break;
    case 9: good = do_heap(answer, room); break;
    default: break;
    }
    pthread_mutex_unlock(&robot->lock);
    if (!good)
        snprintf(answer, room, "error: no such line: %s (see --help)", line);
    return good;
}

/* -- the board's own thread -------------------------------------------------------- */

bool control_open(struct robot *robot)
{
    const char *where = robot->options.control;

    robot->control_in = -1;
    if (where == NULL)
        return true;
    if (strcmp(where, "-") == 0) {
        robot->control_in = STDIN_FILENO;
        return true;
    }
    if (mkfifo(where, 0600) < 0 && errno != EEXIST) {
        fprintf(stderr, "woodbot-posix: %s: %s\n", where, strerror(errno));
        return false;
    }
    /* Open for writing, too: it does not end when who wrote to it leaves. */
    robot->control_in = open(where, O_RDWR | O_NONBLOCK | O_CLOEXEC);
    return robot->control_in >= 0;
}

/* Take in what came; false at the end of it. */
static bool take(struct robot *robot, char *line, size_t *length)
{
    char answer[ROBOT_LINE * 2];
    char *end;
    const ssize_t got = read(robot->control_in, line + *length,
                             ROBOT_LINE - 1 - *length);

    if (got <= 0)
        return got < 0 && (errno == EAGAIN || errno == EINTR);
    *length += (size_t)got;
    line[*length] = '\0';
    while ((end = strchr(line, '\n')) != NULL) {
        *end = '\0';
        control_line(robot, line, answer, sizeof answer);
        printf("%s\n", answer);
        *length -= (size_t)(end + 1 - line);
        memmove(line, end + 1, *length + 1);
    }
    if (*length == ROBOT_LINE - 1)
        *length = 0; /* no line is as long */
    return true;
}

/* Resets the chip if the motors' task has not fed it for a while. It counts its looks
 * instead of time: where a computer has stopped all of us, nobody is to blame. */
static void watch(struct robot *robot, unsigned *fed, unsigned *looks)
{
    const unsigned now = atomic_load(&robot->fed);

    *looks = now == 0 || now != *fed ? 0 : *looks + 1;
    *fed = now;
    if (*looks >= WATCHDOG)
        robot_reset(robot, "watchdog");
}

void *control_run(void *self)
{
    struct robot *robot = self;
    char line[ROBOT_LINE];
    size_t length = 0;
    unsigned fed = 0, looks = 0;

    for (;;) {
        struct pollfd one = {robot->control_in, POLLIN, 0};
        const int ready = poll(&one, 1, LOOK);

        if (ready > 0 && !take(robot, line, &length)) {
            robot->control_in = -1;
            atomic_store(&robot->ending, true); /* who steers it has gone */
        }
        if (ready == 0)
            watch(robot, &fed, &looks);
    }
    return NULL;
}
