/* What Arduino libraries do: the bus (Wire), the lidars (Pololu's VL53L0X) and the
 * lights (Adafruit's NeoPixel). The bus has one owner, and the lidars' library wants
 * it to be Wire: so everything on it goes through here.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#include <Adafruit_NeoPixel.h>
#include <Arduino.h>
#include <VL53L0X.h>
#include <Wire.h>
#include <esp_timer.h>

#include "board.h"
#include "woodbot_schemas.h"

static const uint16_t PATIENCE = 100; // ms: for a lidar that measures itself as it starts
static const uint16_t NOTHING = 8190; // mm, and above: it sees nothing
static const uint8_t ADDRESS[] = {0x20, 0x23}; // 0x29 at power-on, both

static i2c bus;
static VL53L0X chips[2];
static bool right_is_on;
static Adafruit_NeoPixel pixels(LIGHTS, PIN_LIGHTS, NEO_GRB + NEO_KHZ800);

static bool transfer(void *, uint8_t address, const uint8_t *bytes, size_t size,
                     uint8_t *into, size_t room) {
    Wire.beginTransmission(address);
    if (size > 0)
        Wire.write(bytes, size);
    if (Wire.endTransmission(room == 0) != 0)
        return false;
    if (room == 0)
        return true;
    if (Wire.requestFrom(address, static_cast<uint8_t>(room)) != room)
        return false;
    for (size_t i = 0; i < room; i++)
        into[i] = static_cast<uint8_t>(Wire.read());
    return true;
}

static uint64_t now(void *) { return static_cast<uint64_t>(esp_timer_get_time()); }

i2c *libraries_bus() {
    Wire.begin(PIN_SDA, PIN_SCL, 400000);
    Wire.setTimeOut(I2C_STUCK);
    pixels.begin();
    bus.transfer = transfer;
    bus.now = now;
    return &bus;
}

// Move whoever is at 0x29 to the address of this one, and talk to it from now on.
static void move(lidar which) {
    chips[which] = VL53L0X();
    chips[which].setTimeout(PATIENCE);
    chips[which].setAddress(ADDRESS[which]);
}

static bool settle(lidar which) {
    VL53L0X &chip = chips[which];
    if (!i2c_answers(&bus, 0x29) && !i2c_answers(&bus, ADDRESS[which]))
        return false;
    move(which);
    // It may still measure for the program before this one: it begins anew, at 0x29.
    chip.writeReg(VL53L0X::SOFT_RESET_GO2_SOFT_RESET_N, 0);
    delay(1);
    chip.writeReg(VL53L0X::SOFT_RESET_GO2_SOFT_RESET_N, 1);
    delay(2);
    move(which);
    if (!chip.init())
        return false;
    chip.startContinuous();
    return true;
}

// The right one is switched off while the one ahead, which can't be, leaves 0x29.
static bool start_lidar(void *self) {
    const lidar which = self == &chips[LIDAR_FRONT] ? LIDAR_FRONT : LIDAR_RIGHT;
    if (which == LIDAR_RIGHT)
        right_is_on = false;
    if (!right_is_on && !expander_lidars(&bus, 0) && which == LIDAR_RIGHT)
        return false;
    if (which == LIDAR_FRONT)
        return settle(LIDAR_FRONT);
    VL53L0X ahead; // unplugged and plugged in again, it is at 0x29, too
    ahead.setAddress(ADDRESS[LIDAR_FRONT]);
    right_is_on = expander_lidars(&bus, EXPANDER_RIGHT);
    delay(2); // it takes 1.2 ms to wake up
    right_is_on = right_is_on && settle(LIDAR_RIGHT);
    return right_is_on;
}

static reading read_lidar(void *self, double values[SENSOR_VALUES]) {
    VL53L0X &chip = *static_cast<VL53L0X *>(self);
    if (!i2c_answers(&bus, chip.getAddress()))
        return READING_ABSENT;
    const uint8_t status = chip.readReg(VL53L0X::RESULT_INTERRUPT_STATUS);
    if (chip.last_status != 0)
        return READING_ABSENT;
    if ((status & 7) == 0)
        return READING_OLD;
    const uint16_t range = chip.readRangeContinuousMillimeters();
    if (chip.timeoutOccurred())
        return READING_ABSENT;
    values[0] = range >= NOTHING ? WOODBOT_LIDAR_REACH
                                 : min(range / 1000.0, WOODBOT_LIDAR_REACH);
    return READING_NEW;
}

sensor libraries_lidar(lidar which) {
    sensor made = {};
    made.self = &chips[which];
    made.start = start_lidar;
    made.read = read_lidar;
    return made;
}

void libraries_lights(void *, const light lights[LIGHTS]) {
    for (uint16_t i = 0; i < LIGHTS; i++)
        pixels.setPixelColor(i, lights[i].red, lights[i].green, lights[i].blue);
    pixels.show();
}
