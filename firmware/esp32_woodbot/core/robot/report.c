/* SPDX-License-Identifier: Apache-2.0 */
#include <math.h>
#include <string.h>

#include "../wire/keys.h"
#include "../woodbot_private.h"

/* -- sensors ----------------------------------------------------------------------- */

static bool is_new(struct woodbot *bot, size_t part, enum reading reading)
{
    bot->parts[part] = reading;
    return reading == READING_NEW;
}

/* What is absent or wrong stays as it was; it is told of, and holds up nothing. */
void report_sense(struct woodbot *bot)
{
    const struct hardware *hardware = &bot->hardware;
    struct woodbot_sensors *sensors = &bot->sensors;
    double first = 0, second = 0, length;

    if (is_new(bot, 0, hardware->lidar(hardware->self, LIDAR_FRONT, &first))
        && isfinite(first))
        sensors->lidar_front = first;
    if (is_new(bot, 1, hardware->lidar(hardware->self, LIDAR_RIGHT, &first))
        && isfinite(first))
        sensors->lidar_right = first;
    if (is_new(bot, 3, hardware->gyro(hardware->self, &first)) && isfinite(first))
        sensors->gyro_z = first;
    if (!is_new(bot, 2, hardware->compass(hardware->self, &first, &second)))
        return;
    length = sqrt(first * first + second * second);
    if (isfinite(length) && length > 0) {
        sensors->compass_x = first / length;
        sensors->compass_y = second / length;
    }
}

/* -- what is said at a tick -------------------------------------------------------- */

static bool put(struct woodbot *bot, const struct codec_schema *schema,
                const void *value, const struct stamp *stamp)
{
    const struct member *member = &bot->member;
    const struct link *link = &bot->link;
    char room[LINK_KEY];
    uint8_t attachment[STAMP_SIZE], buffer[WOODBOT_MAX_PAYLOAD];
    struct bytes stamped = stamp_write(attachment, stamp), payload = {buffer, 0};

    if (codec_encode(schema, value, buffer, sizeof buffer, &payload.size).status
        != CODEC_OK)
        return true; /* a sum that has overflowed is no fault of the link */
    key_of(room, member->fabric, member->agent, schema->port);
    return link->put(link->self, room, payload, schema->encoding, stamped, false);
}

static void look(struct woodbot *bot)
{
    const struct beat *beat = &bot->member.beat;
    struct motion motion = motors_motion(&bot->motors);
    struct stamp stamp = {beat->n, bot->member.badge, beat->n, beat->t};

    bot->state.x = motion.x;
    bot->state.y = motion.y;
    bot->state.heading = motion.heading;
    bot->obeyed = motion.obeyed;
    bot->stamp = bot->source = stamp;
    /* The echo: since when its source has said what the wheels do. */
    if (motion.tick > 0 && motion.tick < beat->n)
        bot->source.said = motion.tick;
    report_sense(bot);
}

bool report_tick(struct woodbot *bot)
{
    look(bot);
    return put(bot, &woodbot_command_schema, &bot->obeyed, &bot->source)
           && put(bot, &woodbot_state_schema, &bot->state, &bot->stamp)
           && put(bot, &woodbot_sensors_schema, &bot->sensors, &bot->stamp)
           && member_done(&bot->member);
}

/* -- why it stands ---------------------------------------------------------------- */

const char *report_why(enum why why)
{
    static const char *const sentences[] = {
        [WHY_DRIVEN] = "",
        [WHY_STARTED] = "told nothing yet",
        [WHY_STOPPED] = "stopped",
        [WHY_OLD] = "what it was told is too old",
        [WHY_NO_TICK] = "no tick of the clock comes",
        [WHY_LEFT] = "it is in no run",
        [WHY_WRONG] = "what it was told can't be obeyed",
    };

    return (size_t)why < sizeof sentences / sizeof sentences[0] ? sentences[why] : "";
}
