/* I2C: a bus with sensors on it. A port fills it in; a test puts a chip's registers
 * behind it.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef WOODBOT_I2C_H
#define WOODBOT_I2C_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

struct i2c {
    void *self;

    /* Write `size` bytes to the device at this address of 7 bits, and then, if `room`
     * is not 0, read as many. False: nobody is there, or the bus is stuck. Bounded. */
    bool (*transfer)(void *self, uint8_t address, const uint8_t *bytes, size_t size,
                     uint8_t *into, size_t room);
};

bool i2c_write(const struct i2c *bus, uint8_t address, uint8_t at, uint8_t value);
bool i2c_read(const struct i2c *bus, uint8_t address, uint8_t at, uint8_t *into,
              size_t room);

/* A number of two's complement, its low byte first, as both sensors have it. */
int i2c_int16(const uint8_t *bytes);

/* The PCF8574A: four small lights, and the lines that switch lidars off. What is
 * written is on its pins; a 1 is only a weak pull-up. */
enum { EXPANDER_ADDRESS = 0x38 };
enum expander {
    EXPANDER_RIGHT = 0x10, /* P4: XSHUT of the lidar in J5 */
    EXPANDER_BACK = 0x20,  /* P5: in J4 */
    EXPANDER_LEFT = 0x40   /* P6: in J3; the one in J2, ahead, has no such line */
};

/* These lidars are on, the others off, and the lights out. False: nobody is there. */
bool expander_lidars(const struct i2c *bus, uint8_t on);

#ifdef __cplusplus
}
#endif

#endif
