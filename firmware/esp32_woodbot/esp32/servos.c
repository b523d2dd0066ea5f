/* Servos by the LEDC, which makes pulses without the processor, and the watchdog.
 *
 * If the motors' task hangs, the last pulse goes on until the watchdog starts the chip
 * again: a second at most, and then there are none.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#include <driver/ledc.h>
#include <esp_err.h>
#include <esp_idf_version.h>
#include <esp_task_wdt.h>
#include <freertos/FreeRTOS.h>
#include <freertos/task.h>

#include "board.h"

enum {
    PERIOD = 20000, /* us: a servo is told 50 times a second */
    STEPS = 1 << 16,
    WATCHDOG = 1    /* s: the shortest that both versions of its API can say */
};

static ledc_channel_t channel_of(enum wheel wheel)
{
    return wheel == WHEEL_LEFT ? LEDC_CHANNEL_0 : LEDC_CHANNEL_1;
}

static void attach(enum wheel wheel, int pin)
{
    const ledc_channel_config_t channel = {
        .gpio_num = pin,
        .speed_mode = LEDC_LOW_SPEED_MODE,
        .channel = channel_of(wheel),
        .timer_sel = LEDC_TIMER_0,
        .duty = 0,
        .hpoint = 0,
    };

    ESP_ERROR_CHECK(ledc_channel_config(&channel));
}

void servos_start(void)
{
    const ledc_timer_config_t timer = {
        .speed_mode = LEDC_LOW_SPEED_MODE,
        .duty_resolution = LEDC_TIMER_16_BIT,
        .timer_num = LEDC_TIMER_0,
        .freq_hz = 1000000 / PERIOD,
        .clk_cfg = LEDC_AUTO_CLK,
    };

    ESP_ERROR_CHECK(ledc_timer_config(&timer));
    attach(WHEEL_LEFT, PIN_SERVO_J7);
    attach(WHEEL_RIGHT, PIN_SERVO_J9);
}

void servos_pulse(void *self, enum wheel wheel, unsigned pulse)
{
    const ledc_channel_t channel = channel_of(wheel);
    const uint32_t duty = pulse < PERIOD ? pulse * STEPS / PERIOD : 0;

    (void)self;
    /* It takes effect with the next period: no pulse is ever cut. */
    ledc_set_duty(LEDC_LOW_SPEED_MODE, channel, duty);
    ledc_update_duty(LEDC_LOW_SPEED_MODE, channel);
}

void servos_watch(void)
{
#if ESP_IDF_VERSION >= ESP_IDF_VERSION_VAL(5, 0, 0)
    const esp_task_wdt_config_t watchdog = {
        .timeout_ms = 1000 * WATCHDOG,
        .idle_core_mask = 0,
        .trigger_panic = true,
    };

    ESP_ERROR_CHECK(esp_task_wdt_reconfigure(&watchdog));
#else
    /* It watches core 0's idle task, too, which may well be late. */
    esp_task_wdt_delete(xTaskGetIdleTaskHandleForCPU(0));
    ESP_ERROR_CHECK(esp_task_wdt_init(WATCHDOG, true));
#endif
    ESP_ERROR_CHECK(esp_task_wdt_add(NULL));
}

void servos_feed(void *self)
{
    (void)self;
    esp_task_wdt_reset();
}
