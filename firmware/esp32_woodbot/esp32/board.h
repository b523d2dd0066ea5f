/* Board: what the parts of this port have to do with one another, and its pins.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef WOODBOT_BOARD_H
#define WOODBOT_BOARD_H

#include "hardware.h"
#include "i2c.h"
#include "link.h"
#include "sensor.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Pins of the Woodbot's board. GPIO 12 and 15 are read at power-on, too: nothing may
 * pull 12 up then, or the flash gets the wrong voltage. */
enum {
    PIN_SERVO_J6 = 14, /* free */
    PIN_SERVO_J7 = 12, /* left wheel */
    PIN_SERVO_J8 = 13, /* free */
    PIN_SERVO_J9 = 15, /* right wheel */
    PIN_SCL = 32,
    PIN_SDA = 33,
    PIN_LIGHTS = 2
};

/* robot.c: starts all of it, once. */
void robot_begin(void);

/* hardware.c: the seam of hardware.h, with this board behind it. Called once. */
struct hardware board_hardware(void);

/* servos.c: no pulse until told, and the watchdog of the task that calls. */
void servos_start(void);
void servos_watch(void);
void servos_pulse(void *self, enum wheel wheel, unsigned pulse);
void servos_feed(void *self);

/* store.c: settings in NVS. serial.c: the line of the USB socket. */
size_t store_load(void *self, uint8_t *bytes, size_t room);
bool store_save(void *self, const uint8_t *bytes, size_t size);
void serial_start(void);
size_t serial_read(void *self, uint8_t *bytes, size_t room);
size_t serial_write(void *self, const uint8_t *bytes, size_t size);
void serial_speed(uint32_t baud);

/* network/tether.c: the console, with or without a session on its line. */
size_t tether_read(void *self, uint8_t *bytes, size_t room);
size_t tether_write(void *self, const uint8_t *bytes, size_t size);

/* network/: what the link asks of its port (pico/link_pico.h). */
void wifi_join(void *self, const struct network_settings *settings);
enum network wifi_network(void *self);
int wifi_scan(void *self, struct access_point *found, size_t room);
bool names_resolve(void *self, const char *host, char *address, size_t room);
const char *tether_open(void *self);

/* libraries.cpp: what Arduino libraries do. */
struct i2c *libraries_bus(void);
struct sensor libraries_lidar(enum lidar which);
void libraries_lights(void *self, const struct light lights[LIGHTS]);

#ifdef __cplusplus
}
#endif

#endif
