/* SPDX-License-Identifier: Apache-2.0 */
#include "i2c.h"

bool i2c_write(const struct i2c *bus, uint8_t address, uint8_t at, uint8_t value)
{
    const uint8_t bytes[2] = {at, value};

    return bus->transfer(bus->self, address, bytes, sizeof bytes, NULL, 0);
}

bool i2c_read(const struct i2c *bus, uint8_t address, uint8_t at, uint8_t *into,
              size_t room)
{
    return bus->transfer(bus->self, address, &at, 1, into, room);
}

int i2c_int16(const uint8_t *bytes)
{
    const int word = bytes[0] | bytes[1] << 8;

    return word >= 0x8000 ? word - 0x10000 : word;
}

bool expander_lidars(const struct i2c *bus, uint8_t on)
{
    /* P0 to P3 light D3 to D6 at 0; P7 is free. */
    const uint8_t byte = (uint8_t)(0x8F | on);

    return bus->transfer(bus->self, EXPANDER_ADDRESS, &byte, 1, NULL, 0);
}
