/* SPDX-License-Identifier: Apache-2.0 */
#include "asking.h"

#include <string.h>

#include "../wire/keys.h"

static const void *value_of(const struct woodbot *bot, const struct codec_schema *schema)
{
    if (schema == &woodbot_command_schema)
        return &bot->obeyed;
    if (schema == &woodbot_state_schema)
        return &bot->state;
    return &bot->sensors;
}

static struct stamp stamp_of(const struct asking *asking,
                             const struct codec_schema *schema)
{
    const struct woodbot *bot = asking->bot;
    struct stamp stamp = schema == &woodbot_command_schema ? bot->source : bot->stamp;

    stamp.badge = asking->member->badge; /* also before the first tick */
    return stamp;
}

static double field_of(const struct codec_field *field, const void *value)
{
    double found;

    memcpy(&found, (const char *)value + field->offset, sizeof found);
    return found;
}

/* `first` to before `last` of a port's fields, with their units. */
static void tell_fields(struct asking *asking, const struct codec_schema *schema,
                        size_t first, size_t last)
{
    const void *value = value_of(asking->bot, schema);
    struct stamp stamp = stamp_of(asking, schema);
    struct text out = asking_text(asking);

    asking_say_when(&out, &stamp);
    text_say(&out, ", \"values\": {");
    for (size_t i = first; i < last; i++) {
        text_say(&out, i > first ? ", " : "");
        text_quote(&out, schema->fields[i].path);
        text_say(&out, ": {\"value\": ");
        text_real(&out, field_of(&schema->fields[i], value));
        text_say(&out, ", \"unit\": ");
        text_quote(&out, schema->fields[i].unit);
        text_say(&out, "}");
    }
    text_say(&out, "}}");
    asking_reply_json(asking, &out);
}

static void answer_field(struct asking *asking, const struct codec_schema *schema,
                         size_t field)
{
    struct stamp stamp = stamp_of(asking, schema);
    struct wire_writer out = wire_write(asking->bot->scratch, SCRATCH);

    if (asking->json) {
        tell_fields(asking, schema, field, field + 1);
        return;
    }
    wire_put_real(&out, field_of(&schema->fields[field], value_of(asking->bot, schema)));
    asking_reply(asking, wire_written(&out), "application/msgpack", &stamp);
}

static void answer_port(struct asking *asking, const struct codec_schema *schema)
{
    struct stamp stamp = stamp_of(asking, schema);
    struct bytes payload = {asking->bot->scratch, 0};
    struct codec_result result;

    if (asking->json) {
        tell_fields(asking, schema, 0, schema->count);
        return;
    }
    result = codec_encode(schema, value_of(asking->bot, schema), asking->bot->scratch,
                          SCRATCH, &payload.size);
    if (result.status == CODEC_OK)
        asking_reply(asking, payload, schema->encoding, &stamp);
}

void asking_values(struct asking *asking)
{
    const char *agent = asking->member->agent;

    for (size_t p = 0; p < WOODBOT_PORTS; p++) {
        const struct codec_schema *schema = woodbot_schemas[p];

        if (asking_covers(asking, agent, schema->port)) {
            answer_port(asking, schema);
            continue;
        }
        for (size_t i = 0; i < schema->count; i++) {
            key_of(asking->room, asking->member->fabric, agent, schema->port);
            key_add(asking->room, schema->fields[i].path);
            if (key_covers(asking->key, asking->room))
                answer_field(asking, schema, i);
        }
    }
}
