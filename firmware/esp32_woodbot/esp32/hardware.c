/* The seam of hardware.h: which part does what.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#include <esp_idf_version.h>
#include <esp_system.h>
#include <esp_timer.h>
#if ESP_IDF_VERSION >= ESP_IDF_VERSION_VAL(5, 0, 0)
#include <esp_mac.h>
#endif

#include "board.h"

static struct sensor lidars[2], gyro, compass;

static uint64_t now(void *self)
{
    (void)self;
    return (uint64_t)esp_timer_get_time();
}

static enum reading read_lidar(void *self, enum lidar which, double *metres)
{
    double values[SENSOR_VALUES];
    const enum reading reading = sensor_read(&lidars[which], now(self), values);

    if (reading == READING_NEW)
        *metres = values[0];
    return reading;
}

static enum reading read_gyro(void *self, double *rate)
{
    double values[SENSOR_VALUES];
    const enum reading reading = sensor_read(&gyro, now(self), values);

    if (reading == READING_NEW)
        *rate = values[0];
    return reading;
}

static enum reading read_compass(void *self, double *ahead, double *left)
{
    double values[SENSOR_VALUES];
    const enum reading reading = sensor_read(&compass, now(self), values);

    if (reading == READING_NEW) {
        *ahead = values[0];
        *left = values[1];
    }
    return reading;
}

static uint64_t identity(void *self)
{
    uint8_t address[6] = {0};
    uint64_t number = 0;

    (void)self;
    esp_read_mac(address, ESP_MAC_WIFI_STA);
    for (size_t i = 0; i < sizeof address; i++)
        number = number << 8 | address[i];
    return number;
}

static enum reset started_by(void *self)
{
    (void)self;
    switch (esp_reset_reason()) {
    case ESP_RST_SW:
        return RESET_ASKED;
    case ESP_RST_BROWNOUT:
        return RESET_BROWNOUT;
    case ESP_RST_INT_WDT:
    case ESP_RST_TASK_WDT:
    case ESP_RST_WDT:
        return RESET_WATCHDOG;
    case ESP_RST_PANIC:
        return RESET_CRASH;
    default:
        return RESET_POWER;
    }
}

static void restart(void *self)
{
    (void)self;
    esp_restart();
}

struct hardware board_hardware(void)
{
    const struct hardware made = {
        .now = now,
        .servo = servos_pulse,
        .feed = servos_feed,
        .lidar = read_lidar,
        .gyro = read_gyro,
        .compass = read_compass,
        .lights = libraries_lights,
        .load = store_load,
        .store = store_save,
        .read = tether_read,
        .write = tether_write,
        .identity = identity,
        .started_by = started_by,
        .restart = restart,
    };
    struct i2c *bus = libraries_bus();

    gyro = gyro_sensor(bus);
    compass = compass_sensor(bus);
    lidars[LIDAR_FRONT] = libraries_lidar(LIDAR_FRONT);
    lidars[LIDAR_RIGHT] = libraries_lidar(LIDAR_RIGHT);
    return made;
}
