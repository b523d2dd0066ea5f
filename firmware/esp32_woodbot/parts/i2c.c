/* SPDX-License-Identifier: Apache-2.0 */
#include "i2c.h"

enum { PAUSE = 1000000 /* us without a transfer, after the bus was stuck */ };

bool i2c_transfer(struct i2c *bus, uint8_t address, const uint8_t *bytes, size_t size,
                  uint8_t *into, size_t room)
{
    const uint64_t begun = bus->now(bus->self);
    bool done;

    if (bus->stuck != 0 && begun - bus->stuck < PAUSE)
        return false;
    done = bus->transfer(bus->self, address, bytes, size, into, room);
    bus->stuck = bus->now(bus->self);
    if (done || bus->stuck - begun < I2C_STUCK * 1000u)
        bus->stuck = 0;
    return done;
}

bool i2c_answers(struct i2c *bus, uint8_t address)
{
    return i2c_transfer(bus, address, NULL, 0, NULL, 0);
}

bool i2c_write(struct i2c *bus, uint8_t address, uint8_t at, uint8_t value)
{
    const uint8_t bytes[2] = {at, value};

    return i2c_transfer(bus, address, bytes, sizeof bytes, NULL, 0);
}

bool i2c_read(struct i2c *bus, uint8_t address, uint8_t at, uint8_t *into,
              size_t room)
{
    return i2c_transfer(bus, address, &at, 1, into, room);
}

int i2c_int16(const uint8_t *bytes)
{
    const int word = bytes[0] | bytes[1] << 8;

    return word >= 0x8000 ? word - 0x10000 : word;
}

bool expander_lidars(struct i2c *bus, uint8_t on)
{
    /* P0 to P3 light D3 to D6 at 0; P7 is free. */
    const uint8_t byte = (uint8_t)(0x8F | on);

    return i2c_transfer(bus, EXPANDER_ADDRESS, &byte, 1, NULL, 0);
}
