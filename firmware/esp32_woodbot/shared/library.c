/* Library: where each part of the seams is, for who fills them in from another language.
 *
 * `rems_net/firmware/library.py` mirrors these structs. It holds this table against its
 * own before anything is called, so that a mirror that is out of date is told of.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#include <stddef.h>

#include "../core/hardware.h"
#include "../core/link.h"
#include "../core/settings.h"
#include "body.h"

struct place {
    const char *name; /* of a struct, or of a struct's field */
    size_t at;        /* bytes: the struct's size, or where the field begins */
};

#define WHOLE(type) { #type, sizeof(struct type) }
#define PART(type, field) { #type "." #field, offsetof(struct type, field) }

extern const struct place library_places[];

const struct place library_places[] = {
    WHOLE(light),
    PART(light, red), PART(light, green), PART(light, blue),
    WHOLE(bytes),
    PART(bytes, at), PART(bytes, size),
    WHOLE(network_settings),
    PART(network_settings, ssid), PART(network_settings, password),
    PART(network_settings, user), PART(network_settings, name),
    WHOLE(access_point),
    PART(access_point, ssid), PART(access_point, rssi), PART(access_point, open),
    WHOLE(servo),
    PART(servo, trim), PART(servo, dead_band), PART(servo, top_speed),
    PART(servo, pulse),
    WHOLE(body),
    PART(body, servo), PART(body, x), PART(body, y), PART(body, heading),
    PART(body, arena_radius), PART(body, at), PART(body, track),
    WHOLE(hardware),
    PART(hardware, self), PART(hardware, now), PART(hardware, servo),
    PART(hardware, feed), PART(hardware, lidar), PART(hardware, gyro),
    PART(hardware, compass), PART(hardware, lights), PART(hardware, load),
    PART(hardware, store), PART(hardware, read), PART(hardware, write),
    PART(hardware, identity), PART(hardware, started_by), PART(hardware, restart),
    WHOLE(link),
    PART(link, self), PART(link, join), PART(link, network), PART(link, scan),
    PART(link, open), PART(link, close), PART(link, up), PART(link, subscribe),
    PART(link, answer), PART(link, token), PART(link, forget), PART(link, put),
    PART(link, ask), PART(link, reply), PART(link, refuse), PART(link, poll),
    WHOLE(settings),
    {NULL, 0}
};
