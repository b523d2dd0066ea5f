/* What is said to the process when it is started.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "robot.h"

static const char USAGE[] =
    "usage: woodbot-posix [--name NAME] [--router LOCATOR] [OPTION ...]\n"
    "\n"
    "A Woodbot as a process: its firmware, with a model of the robot instead of it.\n"
    "\n"
    "  --name woodbot-7               who it is\n"
    "  --router tcp/127.0.0.1:7447    where the router is; else it looks for one\n"
    "  --fabric rems                  the fabric it belongs to\n"
    "  --set NAME=VALUE               another setting, such as left_trim=12\n"
    "  --settings FILE                settings are kept here; options come first\n"
    "  --console -|pty|none           its serial line (none, unless said)\n"
    "  --control -|FIFO               lines that happen to it; with -, it ends with\n"
    "                                 its standard input\n"
    "  --do LINE                      such a line at the start\n"
    "  --servos FILE                  a line for each change of the servos' pulses:\n"
    "                                 monotonic time [s], left and right [us]\n"
    "  --seed 7                       of its sensors' noise\n"
    "\n"
    "Lines of control:\n"
    "  air NAME [PASSWORD [USER]]     an access point; from then on Wi-Fi is modelled\n"
    "  air off, air on                an outage of Wi-Fi, and its end\n"
    "  names on|off|slow              whether names of hosts resolve\n"
    "  part front|right|gyro|compass good|absent|wrong|old|nan\n"
    "  servo left|right trim|dead|top VALUE    us, us, rad/s\n"
    "  arena RADIUS, place X Y HEADING         m, rad\n"
    "  hang motors|link MS            that task does nothing meanwhile\n"
    "  reset power|brownout|watchdog|crash     it starts again\n"
    "  pose, lights, heap             where it is, what it shows and takes [bytes]\n"
    "\n"
    "examples:\n"
    "  woodbot-posix --name woodbot-7 --router tcp/127.0.0.1:7447\n"
    "  woodbot-posix --settings bot.settings --console pty --do 'air LAB secret'\n";

static bool complain(const char *what, const char *which)
{
    fprintf(stderr, "woodbot-posix: %s: %s\nTry: woodbot-posix --help\n", which, what);
    return false;
}

/* Where the value of an option belongs; NULL if it is none of these. */
static const char **member(struct options *options, const char *name)
{
    if (strcmp(name, "--settings") == 0)
        return &options->settings;
    if (strcmp(name, "--console") == 0)
        return &options->console;
    if (strcmp(name, "--control") == 0)
        return &options->control;
    if (strcmp(name, "--servos") == 0)
        return &options->servos;
    return NULL;
}

static bool is_setting(const char *name)
{
    return strcmp(name, "--name") == 0 || strcmp(name, "--router") == 0
           || strcmp(name, "--fabric") == 0 || strcmp(name, "--set") == 0;
}

bool options_read(struct robot *robot, int argc, char **argv)
{
    struct options *options = &robot->options;
    const char **lines = calloc((size_t)argc + 1, sizeof *lines);

    *options = (struct options){.console = "none", .lines = lines, .seed = 1};
    if (lines == NULL)
        return false;
    for (int i = 1; i < argc; i++) {
        const char **where = member(options, argv[i]);

        if (strcmp(argv[i], "--help") == 0 || strcmp(argv[i], "-h") == 0) {
            fputs(USAGE, stdout);
            exit(0);
        }
        if (i + 1 >= argc)
            return complain("expects a value, or is no option", argv[i]);
        if (where != NULL)
            *where = argv[++i];
        else if (strcmp(argv[i], "--do") == 0)
            lines[options->line_count++] = argv[++i];
        else if (strcmp(argv[i], "--seed") == 0)
            options->seed = strtoull(argv[++i], NULL, 10);
        else if (is_setting(argv[i]))
            i++;
        else
            return complain("there is no such option", argv[i]);
    }
    if (options->control != NULL && strcmp(options->control, "-") == 0
        && strcmp(options->console, "-") == 0)
        return complain("standard input is the console already", "--control -");
    return true;
}

bool options_settings(struct robot *robot, int argc, char **argv,
                      struct settings *settings)
{
    (void)robot;
    for (int i = 1; i + 1 < argc; i++) {
        char name[64];
        const char *value = argv[i + 1], *wrong;
        const char *equals = strchr(value, '=');

        if (!is_setting(argv[i])) {
            i++; /* past the value of another option */
            continue;
        }
        snprintf(name, sizeof name, "%s", argv[i] + 2);
        if (strcmp(name, "set") == 0) {
            if (equals == NULL)
                return complain("expected NAME=VALUE, such as left_trim=12", value);
            snprintf(name, sizeof name, "%.*s", (int)(equals - value), value);
            value = equals + 1;
        }
        wrong = settings_set(settings, name, value);
        if (wrong != NULL)
            return complain(wrong, name);
        i++;
    }
    return true;
}
