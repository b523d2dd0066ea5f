/* A Woodbot as a process: three threads, as on the board.
 *
 * The motors' task has a timer of its own, the link's task waits for the network, and
 * what the board itself does (its watchdog; here what happens to it, too) is the third.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "safety/motors.h"
#include "robot.h"

enum { LINK_WAIT = 10 /* ms: the console is looked at as often */ };

static const char *const RESETS[] = {"power", "asked", "brownout", "watchdog", "crash"};

/* -- starting, and starting again -------------------------------------------------- */

static void stop_servos(struct robot *robot)
{
    const struct hardware hardware = parts_hardware(robot);

    hardware.servo(robot, WHEEL_LEFT, 0);
    hardware.servo(robot, WHEEL_RIGHT, 0);
}

/* Memory is lost, the place on the floor is not, nor are cables. */
void robot_reset(struct robot *robot, const char *why)
{
    char pose[128];

    stop_servos(robot);
    snprintf(pose, sizeof pose, "%.9g %.9g %.9g", robot->body.x, robot->body.y,
             robot->body.heading);
    setenv("WOODBOT_POSE", pose, 1);
    setenv("WOODBOT_RESET", why, 1);
    for (int fd = 3; fd < 256; fd++)
        if (fd != robot->console_in)
            fcntl(fd, F_SETFD, FD_CLOEXEC);
    fflush(stdout);
    execvp(robot->argv[0], robot->argv);
    fprintf(stderr, "woodbot-posix: %s: %s\n", robot->argv[0], strerror(errno));
    _exit(1);
}

/* What is left of before; whether it was reset. */
static bool remember(struct robot *robot)
{
    const char *why = getenv("WOODBOT_RESET"), *pose = getenv("WOODBOT_POSE");

    body_default(&robot->body);
    if (why == NULL || pose == NULL)
        return false;
    for (size_t i = 0; i < sizeof RESETS / sizeof *RESETS; i++)
        if (strcmp(why, RESETS[i]) == 0)
            robot->started_by = (enum reset)i;
    if (sscanf(pose, "%lf %lf %lf", &robot->body.x, &robot->body.y,
               &robot->body.heading) != 3)
        body_default(&robot->body);
    unsetenv("WOODBOT_RESET");
    unsetenv("WOODBOT_POSE");
    return true;
}

static bool open_log(struct robot *robot, bool again)
{
    const char *path = robot->options.servos;
    const int flags = O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC;

    robot->servo_log = path == NULL ? -1 : open(path, flags | (again ? 0 : O_TRUNC),
                                                0644);
    if (path != NULL && robot->servo_log < 0)
        fprintf(stderr, "woodbot-posix: %s: %s\n", path, strerror(errno));
    return path == NULL || robot->servo_log >= 0;
}

/* What is stored, with what the options say on top: in memory, not in the file. */
static bool prepare_settings(struct robot *robot, int argc, char **argv)
{
    const struct hardware hardware = parts_hardware(robot);
    const char *path = robot->options.settings;
    struct settings settings;
    bool good;

    store_open(robot);
    settings_load(&settings, &hardware);
    if (!options_settings(robot, argc, argv, &settings))
        return false;
    robot->options.settings = NULL;
    good = settings_store(&settings, &hardware);
    robot->options.settings = path;
    return good;
}

static bool prepare(struct robot *robot, int argc, char **argv)
{
    char answer[ROBOT_LINE * 2];
    bool again;

    robot->argv = argv;
    pthread_mutex_init(&robot->lock, NULL);
    names_start(&robot->names);
    again = remember(robot);
    if (!options_read(robot, argc, argv) || !prepare_settings(robot, argc, argv)
        || !open_log(robot, again) || !control_open(robot) || !serial_open(robot))
        return false;
    for (size_t i = 0; i < robot->options.line_count; i++)
        if (!(again && strncmp(robot->options.lines[i], "place", 5) == 0)
            && !control_line(robot, robot->options.lines[i], answer, sizeof answer)) {
            fprintf(stderr, "woodbot-posix: %s\n", answer);
            return false;
        }
    return true;
}

/* -- the tasks --------------------------------------------------------------------- */

static uint64_t monotonic(void)
{
    struct timespec time;

    clock_gettime(CLOCK_MONOTONIC, &time);
    return (uint64_t)time.tv_sec * 1000000000u + (uint64_t)time.tv_nsec;
}

static void hang(atomic_uint *ms)
{
    const unsigned wanted = atomic_exchange(ms, 0);

    if (wanted > 0)
        poll(NULL, 0, (int)wanted);
}

static void *drive(void *self)
{
    struct robot *robot = self;
    const uint64_t period = (uint64_t)MOTORS_PERIOD * 1000000u;
    uint64_t next = monotonic();

    for (;;) {
        const uint64_t now = monotonic();

        if (now < next) {
            const struct timespec rest = {0, (long)(next - now)};

            nanosleep(&rest, NULL);
            continue;
        }
        next = next + period > now ? next + period : now + period;
        hang(&robot->hang_motors);
        woodbot_drive(robot->bot);
    }
    return NULL;
}

static bool start(struct robot *robot)
{
    const struct hardware hardware = parts_hardware(robot);
    const struct pico_port port = air_port(robot);
    struct link link;
    pthread_t motors, board;

    robot->bot = calloc(1, woodbot_size());
    if (robot->bot == NULL)
        return false;
    link = link_pico(&robot->pico, robot->bot, &port);
    woodbot_start(robot->bot, &hardware, &link);
    return pthread_create(&motors, NULL, drive, robot) == 0
           && pthread_create(&board, NULL, control_run, robot) == 0;
}

int main(int argc, char **argv)
{
    static struct robot robot; /* its zeros are nothing, off and closed */

    signal(SIGPIPE, SIG_IGN);
    setvbuf(stdout, NULL, _IOLBF, 0);
    if (!prepare(&robot, argc, argv))
        return 2;
    if (!start(&robot)) {
        fprintf(stderr, "woodbot-posix: no memory, or no thread\n");
        return 1;
    }
    while (!atomic_load(&robot.ending)) {
        hang(&robot.hang_link);
        woodbot_run(robot.bot, LINK_WAIT);
    }
    stop_servos(&robot);
    return 0;
}
