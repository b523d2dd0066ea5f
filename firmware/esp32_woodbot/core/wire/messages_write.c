/* SPDX-License-Identifier: Apache-2.0 */
#include "messages.h"

#include <string.h>

#include "../console.h"
#include "../woodbot_schemas.h"

struct bytes stop_write(void)
{
    static const uint8_t yes = 0xC3;
    struct bytes made = {&yes, 1};

    return made;
}

struct bytes stamp_write(uint8_t room[STAMP_SIZE], const struct stamp *stamp)
{
    struct wire_writer out = wire_write(room, STAMP_SIZE);

    wire_put_list(&out, stamp->said == stamp->n ? 3 : 4);
    wire_put_whole(&out, stamp->n);
    wire_put_real(&out, stamp->t);
    wire_put_whole(&out, stamp->badge);
    if (stamp->said != stamp->n)
        wire_put_whole(&out, stamp->said);
    return wire_written(&out);
}

struct bytes done_write(uint8_t room[STAMP_SIZE], uint64_t badge, uint64_t n)
{
    struct wire_writer out = wire_write(room, STAMP_SIZE);

    wire_put_list(&out, 2);
    wire_put_whole(&out, badge);
    wire_put_whole(&out, n);
    return wire_written(&out);
}

struct bytes badge_write(uint8_t room[STAMP_SIZE], uint64_t badge)
{
    struct wire_writer out = wire_write(room, STAMP_SIZE);

    wire_put_whole(&out, badge);
    return wire_written(&out);
}

static struct bytes description(const struct codec_schema *schema)
{
    struct bytes found = {schema->description, schema->description_size};

    return found;
}

static void put_pair(struct wire_writer *out, const char *key, const char *text)
{
    wire_put_text(out, key);
    wire_put_text(out, text);
}

static void put_number(struct wire_writer *out, const char *key, uint64_t number)
{
    wire_put_text(out, key);
    wire_put_whole(out, number);
}

static void put_flag(struct wire_writer *out, const char *key, bool flag)
{
    wire_put_text(out, key);
    wire_put_flag(out, flag);
}

static void put_entry(struct wire_writer *out, const struct request *request)
{
    bool reads = request->source[0] != '\0';

    wire_put_map(out, 8);
    put_pair(out, "key", request->agent);
    put_pair(out, "host", request->agent);
    wire_put_text(out, "outs");
    wire_put_map(out, WOODBOT_PORTS);
    for (size_t i = 0; i < WOODBOT_PORTS; i++)
        put_pair(out, woodbot_schemas[i]->port, woodbot_schemas[i]->digest);
    wire_put_text(out, "reads");
    wire_put_list(out, reads);
    if (reads)
        wire_put_text(out, request->source);
    put_number(out, "every", 1);
    put_flag(out, "lockstep", false);
    put_number(out, "since", 1);
    put_number(out, "badge", 0);
}

struct bytes request_write(uint8_t *room, size_t size, const struct request *request)
{
    struct wire_writer out = wire_write(room, size);

    wire_put_map(&out, 9);
    put_pair(&out, "host", request->agent);
    put_pair(&out, "machine", strchr(request->agent, '/') + 1);
    put_number(&out, "pid", request->identity);
    put_pair(&out, "closing", "");
    wire_put_text(&out, "agents");
    wire_put_list(&out, 1);
    put_entry(&out, request);
    wire_put_text(&out, "schemas");
    wire_put_map(&out, WOODBOT_PORTS);
    for (size_t i = 0; i < WOODBOT_PORTS; i++) {
        wire_put_text(&out, woodbot_schemas[i]->digest);
        wire_put_bytes(&out, description(woodbot_schemas[i]));
    }
    put_flag(&out, "stopped", request->stopped);
    put_number(&out, "ticket", 0);
    put_pair(&out, "numerics", "Woodbot " WOODBOT_VERSION " on " WOODBOT_CHIP);
    return wire_written(&out);
}

struct bytes schemas_write(uint8_t *room, size_t size)
{
    struct wire_writer out = wire_write(room, size);

    wire_put_map(&out, WOODBOT_PORTS);
    for (size_t i = 0; i < WOODBOT_PORTS; i++) {
        wire_put_text(&out, woodbot_schemas[i]->port);
        wire_put_bytes(&out, description(woodbot_schemas[i]));
    }
    return wire_written(&out);
}

struct bytes farewell_write(uint8_t *room, size_t size, uint64_t badge)
{
    struct wire_writer out = wire_write(room, size);

    wire_put_map(&out, 3);
    put_number(&out, "badge", badge);
    wire_put_text(&out, "made");
    wire_put_list(&out, 0);
    wire_put_text(&out, "failed");
    wire_put_nothing(&out);
    return wire_written(&out);
}
