/* The robot on its board: two tasks.
 *
 * Wi-Fi, its IP stack and the link run on core 0; the motors have core 1, and all but
 * the highest priority there, for themselves.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#include <stdlib.h>

#include <esp_err.h>
#include <esp_event.h>
#include <esp_netif.h>
#include <freertos/FreeRTOS.h>
#include <freertos/task.h>
#include <nvs_flash.h>

#include "board.h"
#include "link_pico.h"
#include "safety/motors.h"
#include "woodbot.h"

enum {
    MOTORS_STACK = 4096,
    LINK_STACK = 12288, /* bytes: opening a session takes 7.5 kB of it */
    MOTORS_PRIORITY = configMAX_PRIORITIES - 2,
    LINK_PRIORITY = 2,
    LINK_WAIT = 5       /* ms */
};

static struct link_pico pico; /* 11 kB: no stack has room for it */

static void drive(void *self)
{
    TickType_t last = xTaskGetTickCount();

    servos_watch();
    for (;;) {
        woodbot_drive(self);
        vTaskDelayUntil(&last, pdMS_TO_TICKS(MOTORS_PERIOD));
    }
}

static void talk(void *self)
{
    for (;;)
        woodbot_run(self, LINK_WAIT);
}

static void begin(TaskFunction_t task, const char *name, uint32_t stack, void *self,
                  UBaseType_t priority, BaseType_t core)
{
    /* Without its tasks it is no robot: it says so, and starts again. */
    if (xTaskCreatePinnedToCore(task, name, stack, self, priority, NULL, core)
        != pdPASS)
        abort();
}

void robot_begin(void)
{
    const struct pico_port port = {
        .join = wifi_join,
        .network = wifi_network,
        .scan = wifi_scan,
        .resolve = names_resolve,
        .cable = tether_open,
    };
    struct woodbot *bot = calloc(1, woodbot_size());
    struct hardware hardware;
    struct link link;

    servos_start(); /* first of all: no pulse */
    if (bot == NULL)
        abort();
    if (nvs_flash_init() != ESP_OK) { /* no room, or of a newer version */
        ESP_ERROR_CHECK(nvs_flash_erase());
        ESP_ERROR_CHECK(nvs_flash_init());
    }
    /* The IP stack is there without Wi-Fi, too: a session over the cable uses it. */
    ESP_ERROR_CHECK(esp_netif_init());
    ESP_ERROR_CHECK(esp_event_loop_create_default());
    serial_start();
    hardware = board_hardware();
    link = link_pico(&pico, bot, &port);
    woodbot_start(bot, &hardware, &link);
    begin(drive, "motors", MOTORS_STACK, bot, MOTORS_PRIORITY, 1);
    begin(talk, "link", LINK_STACK, bot, LINK_PRIORITY, 0);
}
