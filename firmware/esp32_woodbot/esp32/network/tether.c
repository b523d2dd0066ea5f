/* The serial line as the network (cable/cable.h), once a session is wanted through it:
 * from then on a task of its own reads the line, and the console gets its part of it.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#include <esp_timer.h>
#include <freertos/FreeRTOS.h>
#include <freertos/task.h>

#include "board.h"
#include "cable.h"
#include "cable_socket.h"

enum { STACK = 4096, PRIORITY = 3, LOOK = 2 /* ms */ };

static struct cable cable;
static struct cable_socket end;
static bool on;

static void carry(void *self)
{
    (void)self;
    for (;;) {
        cable_step(&cable, (uint64_t)esp_timer_get_time());
        vTaskDelay(cable_busy(&cable) ? 1 : pdMS_TO_TICKS(LOOK));
    }
}

/* Of the link's task, as the console's two below: nobody else reads the line then. */
const char *tether_open(void *self)
{
    struct cable_port port = {.line = self, .read = serial_read, .write = serial_write};

    if (on)
        return end.locator;
    if (!cable_socket_open(&end, &port))
        return NULL;
    cable_start(&cable, &port);
    serial_speed(CABLE_BAUD);
    on = xTaskCreatePinnedToCore(carry, "cable", STACK, NULL, PRIORITY, NULL, 0)
         == pdPASS;
    return on ? end.locator : NULL;
}

size_t tether_read(void *self, uint8_t *bytes, size_t room)
{
    return on ? cable_read(&cable, bytes, room) : serial_read(self, bytes, room);
}

size_t tether_write(void *self, const uint8_t *bytes, size_t size)
{
    return on ? cable_write(&cable, bytes, size) : serial_write(self, bytes, size);
}
