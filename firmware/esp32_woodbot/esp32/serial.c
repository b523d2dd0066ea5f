/* The serial line of the USB socket: the console, at 115200 baud.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#include <driver/uart.h>
#include <esp_err.h>
#include <esp_log.h>

#include "board.h"

static const uart_port_t LINE = UART_NUM_0;
enum { ROOM = 1024 };

void serial_start(void)
{
    const uart_config_t config = {
        .baud_rate = 115200,
        .data_bits = UART_DATA_8_BITS,
        .parity = UART_PARITY_DISABLE,
        .stop_bits = UART_STOP_BITS_1,
        .flow_ctrl = UART_HW_FLOWCTRL_DISABLE,
    };

    /* IDF's own words on this line would tear Improv's packets. */
    esp_log_level_set("*", ESP_LOG_NONE);
    ESP_ERROR_CHECK(uart_param_config(LINE, &config));
    ESP_ERROR_CHECK(uart_driver_install(LINE, ROOM, ROOM, 0, NULL, 0));
}

size_t serial_read(void *self, uint8_t *bytes, size_t room)
{
    const int count = uart_read_bytes(LINE, bytes, (uint32_t)room, 0);

    (void)self;
    return count > 0 ? (size_t)count : 0;
}

size_t serial_write(void *self, const uint8_t *bytes, size_t size)
{
    size_t room = 0;
    int count;

    (void)self;
    /* More than there is room for would wait for the line; 64 are the driver's own. */
    if (uart_get_tx_buffer_free_size(LINE, &room) != ESP_OK || room <= 64)
        return 0;
    count = uart_write_bytes(LINE, bytes, size < room - 64 ? size : room - 64);
    return count > 0 ? (size_t)count : 0;
}

void serial_speed(uint32_t baud)
{
    uart_wait_tx_done(LINE, pdMS_TO_TICKS(50));
    uart_set_baudrate(LINE, baud);
}
