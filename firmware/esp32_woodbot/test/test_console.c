/* The console of a Woodbot on the standard streams: what stands on a serial line, with a
 * modelled Wi-Fi (a few networks, of which one takes a user) and settings in a file.
 *
 *     test_console SETTINGS        until the other side closes
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#define _POSIX_C_SOURCE 200809L

#include <errno.h>
#include <poll.h>
#include <stdio.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "../core/console.h"

enum { JOIN_TIME = 100000 /* us */, SCAN_TIME = 100000 };

static const struct known {
    const char *ssid, *password, *user;
    int rssi;
} networks[] = {
    {"lab-net", "correct horse", "", -48},
    {"lab-net", "correct horse", "", -71},     /* a second access point */
    {"open-net", "", "", -60},
    {"eduroam", "anna's own", "anna@example.org", -55},
    {"B\xC3\xBCro", "\xC3\xBCml\xC3\xA4ut 7", "", -80},
    {"bad\x07name", "", "", -20},              /* of hostile bytes */
};
enum { NETWORKS = sizeof networks / sizeof networks[0] };

struct robot {
    const char *file;
    struct settings settings;
    struct network_settings wanted;
    uint64_t joining, scanning; /* us: since when; 0 for not at all */
    bool restarted, closed;
};

static uint64_t now(void *self)
{
    struct timespec time;

    (void)self;
    clock_gettime(CLOCK_MONOTONIC, &time);
    return (uint64_t)time.tv_sec * 1000000u + (uint64_t)time.tv_nsec / 1000u;
}

static size_t load(void *self, uint8_t *bytes, size_t room)
{
    FILE *file = fopen(((struct robot *)self)->file, "rb");
    size_t size = 0;

    if (file != NULL) {
        size = fread(bytes, 1, room, file);
        fclose(file);
    }
    return size;
}

static bool store(void *self, const uint8_t *bytes, size_t size)
{
    FILE *file = fopen(((struct robot *)self)->file, "wb");
    bool good = file != NULL && fwrite(bytes, 1, size, file) == size;

    return file != NULL && fclose(file) == 0 && good;
}

static size_t line_read(void *self, uint8_t *bytes, size_t room)
{
    struct robot *robot = self;
    struct pollfd ready = {STDIN_FILENO, POLLIN, 0};
    ssize_t size;

    if (poll(&ready, 1, 0) <= 0)
        return 0;
    size = read(STDIN_FILENO, bytes, room);
    robot->closed = size == 0 || (size < 0 && errno != EINTR);
    return size > 0 ? (size_t)size : 0;
}

/* Little at a time, as a true line does. */
static size_t line_write(void *self, const uint8_t *bytes, size_t size)
{
    ssize_t written = write(STDOUT_FILENO, bytes, size < 32 ? size : 32);

    (void)self;
    return written > 0 ? (size_t)written : 0;
}

static enum network try(const struct network_settings *wanted)
{
    const struct known *found = NULL;

    for (int i = 0; i < NETWORKS && found == NULL; i++)
        if (strcmp(networks[i].ssid, wanted->ssid) == 0)
            found = &networks[i];
    if (found == NULL)
        return NETWORK_NOT_FOUND;
    if ((found->password[0] == '\0') != (wanted->password[0] == '\0'))
        return NETWORK_SECURITY;
    return strcmp(found->password, wanted->password) != 0
                   || strcmp(found->user, wanted->user) != 0
               ? NETWORK_REFUSED : NETWORK_UP;
}

static enum network network(void *self)
{
    struct robot *robot = self;

    if (robot->wanted.ssid[0] == '\0' || settings_by_cable(&robot->settings))
        return NETWORK_OFF;
    if (now(self) - robot->joining < JOIN_TIME)
        return NETWORK_JOINING;
    return try(&robot->wanted);
}

static int scan(void *self, struct access_point *found, size_t room)
{
    struct robot *robot = self;
    size_t count = 0;

    if (robot->scanning == 0)
        robot->scanning = now(self);
    if (now(self) - robot->scanning < SCAN_TIME)
        return -1;
    robot->scanning = 0;
    for (; count < NETWORKS && count < room; count++) {
        memset(&found[count], 0, sizeof found[count]);
        memcpy(found[count].ssid, networks[count].ssid, strlen(networks[count].ssid));
        found[count].rssi = networks[count].rssi;
        found[count].open = networks[count].password[0] == '\0';
    }
    return (int)count;
}

static void changed(void *self)
{
    struct robot *robot = self;

    robot->wanted.ssid = robot->settings.ssid;
    robot->wanted.password = robot->settings.password;
    robot->wanted.user = robot->settings.user;
    robot->joining = now(self);
}

static void status(void *self, char *text, size_t room)
{
    static const char *const words[] = {"off", "joining", "up", "not found",
                                         "refused", "security"};
    const struct robot *robot = self;

    snprintf(text, room, "robot/%s on %s\r\nwifi: %s\r\n", robot->settings.name,
             robot->settings.fabric, words[network(self)]);
}

static void test(void *self, const char *what, char *text, size_t room)
{
    (void)self;
    snprintf(text, room, "%s: all there\r\n", what);
}

static void reset(void *self)
{
    ((struct robot *)self)->restarted = true;
}

int main(int count, char **words)
{
    static struct robot robot;
    static struct hardware hardware;
    static struct link link;
    static struct console console;

    if (count != 2)
        return 2;
    robot.file = words[1];
    robot.restarted = true;
    hardware = (struct hardware){.self = &robot, .now = now, .load = load,
                                 .store = store, .read = line_read,
                                 .write = line_write};
    link = (struct link){.self = &robot, .network = network, .scan = scan};
    console.hardware = &hardware;
    console.link = &link;
    console.settings = &robot.settings;
    console.host = (struct console_host){&robot, status, changed, test, reset};
    while (!robot.closed) {
        struct pollfd ready = {STDIN_FILENO, POLLIN, 0};

        if (robot.restarted && console.to == 0) {
            robot.restarted = false;
            settings_load(&robot.settings, &hardware);
            changed(&robot);
            console_start(&console);
        }
        console_step(&console, now(&robot));
        if (console.to == 0)
            poll(&ready, 1, 10);
    }
    return 0;
}
