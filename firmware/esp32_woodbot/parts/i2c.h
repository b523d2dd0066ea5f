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
     * is not 0, read as many. False: nobody is there, or the bus is stuck: that takes
     * the port's timeout, I2C_STUCK ms or a little more. */
    bool (*transfer)(void *self, uint8_t address, const uint8_t *bytes, size_t size,
                     uint8_t *into, size_t room);
    uint64_t (*now)(void *self); /* us */

    uint64_t stuck;              /* us: when the bus last was; 0: never */
};

/* ms: a transfer of 9 bytes takes 0.25 at 400 kHz. Nobody's address takes 0.03. */
enum { I2C_STUCK = 5 };

/* Transfer, unless the bus was stuck within the last second: a bus that hangs takes
 * I2C_STUCK ms of a second, however many sensors are on it. */
bool i2c_transfer(struct i2c *bus, uint8_t address, const uint8_t *bytes, size_t size,
                  uint8_t *into, size_t room);
/* Whether a device answers to its address. */
bool i2c_answers(struct i2c *bus, uint8_t address);
bool i2c_write(struct i2c *bus, uint8_t address, uint8_t at, uint8_t value);
bool i2c_read(struct i2c *bus, uint8_t address, uint8_t at, uint8_t *into,
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
bool expander_lidars(struct i2c *bus, uint8_t on);

#ifdef __cplusplus
}
#endif

#endif
