/* LEDs: what the robot is doing, at a glance from across the room.
 *
 * The first light says what it does, by the table below; docs/firmware.md has the same
 * one, and a test compares them. The last four are dark, or red for a part that is
 * absent or wrong: lidar ahead, lidar on the right, compass, gyro.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#include <string.h>

#include "../woodbot_private.h"

enum { FLASH = 250000, BLINK = 100000 /* us: on, and as long off */ };

static const struct light DARK = {0, 0, 0}, PART = {20, 0, 0}, BRIGHT = {60, 60, 60};

/* Colours that people who see no red or green tell apart by how bright they are. */
static const struct showing {
    struct light light;
    bool flashes;
} table[] = {
#define SHOWS(state, red, green, blue, flashes, colour, means) \
    [state] = {{red, green, blue}, flashes}
    SHOWS(LIGHTS_STOPPED, 50, 0, 0, false, "red", "STOP holds"),
    SHOWS(LIGHTS_NEW, 12, 12, 12, true, "white, flashing",
          "it has no settings: `rems board provision`"),
    SHOWS(LIGHTS_JOINING, 30, 20, 0, false, "yellow", "it joins the Wi-Fi"),
    SHOWS(LIGHTS_NO_NETWORK, 30, 20, 0, true, "yellow, flashing",
          "the Wi-Fi is not there, or refuses its password"),
    SHOWS(LIGHTS_NO_ROUTER, 0, 0, 40, false, "blue", "it looks for the router"),
    SHOWS(LIGHTS_NO_CLOCK, 25, 0, 30, false, "violet",
          "no clock has let it in yet: does `rems router serve` run?"),
    SHOWS(LIGHTS_REFUSED, 25, 0, 30, true, "violet, flashing",
          "the clock refuses it: `status` says why"),
    SHOWS(LIGHTS_STANDS, 12, 12, 12, false, "white", "it is in; nobody drives it"),
    SHOWS(LIGHTS_DRIVEN, 0, 40, 0, false, "green", "it is driven"),
#undef SHOWS
};

static enum leds_state state_of(const struct woodbot *bot)
{
    enum network network;

    if (woodbot_stopped(bot))
        return LIGHTS_STOPPED;
    if (bot->supervisor.phase == PHASE_NETWORK) {
        network = bot->link.network(bot->link.self);
        return network == NETWORK_OFF ? LIGHTS_NEW
               : network >= NETWORK_NOT_FOUND ? LIGHTS_NO_NETWORK
                                              : LIGHTS_JOINING;
    }
    if (bot->supervisor.phase != PHASE_OPEN)
        return LIGHTS_NO_ROUTER;
    if (bot->held != WHY_DRIVEN)
        return bot->member.refusal[0] != '\0' ? LIGHTS_REFUSED : LIGHTS_NO_CLOCK;
    return motors_motion(&bot->motors).why == WHY_DRIVEN ? LIGHTS_DRIVEN
                                                         : LIGHTS_STANDS;
}

void leds_show(struct woodbot *bot, uint64_t now)
{
    const struct showing *showing = &table[state_of(bot)];
    struct light lights[LIGHTS] = {DARK};

    lights[0] = showing->flashes && now / FLASH % 2 ? DARK : showing->light;
    for (size_t i = 0; i < PARTS; i++)
        lights[LIGHTS - PARTS + i] = bot->parts[i] >= READING_ABSENT ? PART : DARK;
    for (size_t i = 0; i < LIGHTS && now < bot->blink; i++)
        lights[i] = now / BLINK % 2 ? BRIGHT : DARK;
    if (memcmp(lights, bot->lights, sizeof lights) == 0)
        return;
    memcpy(bot->lights, lights, sizeof lights);
    bot->hardware.lights(bot->hardware.self, lights);
}
