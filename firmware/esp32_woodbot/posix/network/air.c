/* The air: a Wi-Fi of access points with names and passwords, which may fail.
 *
 * Without one (no line `air` was said) the computer's own network is what there is.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#include <stdio.h>
#include <string.h>

#include "robot.h"

static const uint64_t JOINING = 300000, SCANNING = 400000; /* us */

static void join(void *self, const struct network_settings *settings)
{
    struct robot *robot = self;
    struct air *air = &robot->air;

    pthread_mutex_lock(&robot->lock);
    snprintf(air->ssid, sizeof air->ssid, "%s", settings->ssid);
    snprintf(air->password, sizeof air->password, "%s", settings->password);
    snprintf(air->user, sizeof air->user, "%s", settings->user);
    air->joined = air->ssid[0] != '\0';
    air->since = robot_now();
    pthread_mutex_unlock(&robot->lock);
}

static enum network look(struct air *air, uint64_t now)
{
    if (!air->modelled)
        return NETWORK_UP;
    if (!air->joined)
        return NETWORK_OFF;
    if (air->off) {
        air->since = now; /* once it is back, it is joined again */
        return NETWORK_NOT_FOUND;
    }
    if (now - air->since < JOINING)
        return NETWORK_JOINING;
    for (size_t i = 0; i < air->count; i++)
        if (strcmp(air->points[i].ssid, air->ssid) == 0)
            return (air->points[i].password[0] == '\0') != (air->password[0] == '\0')
                       ? NETWORK_SECURITY
                   : strcmp(air->points[i].password, air->password) == 0
                           && strcmp(air->points[i].user, air->user) == 0
                       ? NETWORK_UP : NETWORK_REFUSED;
    return NETWORK_NOT_FOUND;
}

static enum network network(void *self)
{
    struct robot *robot = self;
    enum network found;

    pthread_mutex_lock(&robot->lock);
    found = look(&robot->air, robot_now());
    pthread_mutex_unlock(&robot->lock);
    return found;
}

static int scan(void *self, struct access_point *found, size_t room)
{
    struct robot *robot = self;
    struct air *air = &robot->air;
    const uint64_t now = robot_now();
    int count = -1;

    pthread_mutex_lock(&robot->lock);
    if (!air->scanning) {
        air->scanning = true;
        air->scanned = now;
    } else if (now - air->scanned >= SCANNING) {
        air->scanning = false;
        count = 0;
        for (size_t i = 0; !air->off && i < air->count && i < room; i++, count++) {
            memcpy(found[i].ssid, air->points[i].ssid, sizeof found[i].ssid);
            found[i].rssi = -50 - 7 * (int)i;
            found[i].open = air->points[i].password[0] == '\0';
        }
    }
    pthread_mutex_unlock(&robot->lock);
    return count;
}

static bool resolve(void *self, const char *host, char *address, size_t room)
{
    struct robot *robot = self;

    return names_resolve(&robot->names, host, address, room);
}

struct pico_port air_port(struct robot *robot)
{
    return (struct pico_port){.self = robot, .join = join, .network = network,
                              .scan = scan, .resolve = resolve,
                              .cable = tether_open};
}
