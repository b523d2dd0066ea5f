/* Compatibility: whether another schema says the same as the command's.
 *
 * An input that plays a file knows no ranges, so its schema has another digest. Who
 * writes is asked for it, once: the same fields in the same units will do, and each
 * value is held against the command's ranges anyway. What differs is told by name.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#include <string.h>

#include "../wire/keys.h"
#include "../woodbot_private.h"

enum { AGAIN = 1000000, TIMEOUT = 1000 /* us, ms */ };

/* The number of its question. */
#define QUESTION (UINT32_MAX - 1)

static void copy(char *room, size_t size, struct bytes text)
{
    if (text.size >= size)
        text.size = size - 1;
    memcpy(room, text.at, text.size);
    room[text.size] = '\0';
}

/* -- asking ------------------------------------------------------------------------- */

bool compatibility_is(struct woodbot *bot, const char *digest, const char *key)
{
    struct compatibility *compatibility = &bot->inlet.compatibility;
    const char *port = strrchr(key, '/') + 1;

    if (strcmp(compatibility->digest, digest) == 0 && strcmp(compatibility->port, port) == 0)
        return compatibility->known && compatibility->differs[0] == '\0';
    memset(compatibility, 0, sizeof *compatibility);
    strncat(compatibility->digest, digest, sizeof compatibility->digest - 1);
    strncat(compatibility->port, port, sizeof compatibility->port - 1);
    return false;
}

/* `input/keys/@schema` of the source `input/keys/value`. */
static const char *selector(const struct member *member, char room[LINK_KEY])
{
    char agent[SOURCE_SIZE];
    char *end;

    memcpy(agent, member->source, sizeof agent);
    end = strchr(strchr(agent, '/') + 1, '/');
    if (end != NULL)
        *end = '\0';
    return key_of(room, member->fabric, agent, "@schema");
}

bool compatibility_step(struct woodbot *bot, uint64_t now)
{
    struct compatibility *compatibility = &bot->inlet.compatibility;
    const struct member *member = &bot->member;
    char room[LINK_KEY];

    if (compatibility->digest[0] == '\0' || compatibility->known || member->source[0] == '\0'
        || (compatibility->asked > 0 && now - compatibility->asked < AGAIN))
        return true;
    compatibility->asked = now;
    return bot->link.ask(bot->link.self, selector(member, room),
                         (struct bytes){NULL, 0}, QUESTION, TIMEOUT);
}

/* -- comparing ---------------------------------------------------------------------- */

static size_t field_of(struct bytes path)
{
    const struct codec_schema *schema = &woodbot_command_schema;

    for (size_t i = 0; i < schema->count; i++) {
        if (wire_is(path, schema->fields[i].path))
            return i;
    }
    return schema->count;
}

/* What more is said of a field: the unit, and whether it is a single number. */
static bool read_more(struct wire_reader *in, struct bytes *unit)
{
    size_t count = wire_read_map(in, 16);
    bool single = true;

    while (count-- > 0 && !in->wrong) {
        struct bytes key = wire_read_text(in, 32);

        if (wire_is(key, "unit")) {
            *unit = wire_read_text(in, 32);
        } else {
            single = single && (wire_is(key, "range") || wire_is(key, "doc")
                                || wire_is(key, "default"));
            wire_skip(in);
        }
    }
    return single;
}

/* Read a field; its number, or how many there are where it differs. */
static size_t read_field(struct wire_reader *in, struct compatibility *compatibility)
{
    const struct codec_schema *schema = &woodbot_command_schema;
    struct bytes path, type, unit = {NULL, 0};
    size_t found;
    bool single;

    if (wire_read_list(in, 3) != 3)
        in->wrong = true;
    path = wire_read_text(in, 255);
    type = wire_read_text(in, 32);
    single = read_more(in, &unit);
    if (in->wrong)
        return schema->count;
    found = field_of(path);
    if (found < schema->count && single && wire_is(type, "float")
        && wire_is(unit, schema->fields[found].unit))
        return found;
    copy(compatibility->differs, sizeof compatibility->differs, path);
    if (unit.size > 0)
        copy(compatibility->unit, sizeof compatibility->unit, unit);
    return schema->count;
}

static bool read_fields(struct wire_reader *in, struct compatibility *compatibility)
{
    const struct codec_schema *schema = &woodbot_command_schema;
    size_t count = wire_read_list(in, 10000);
    unsigned seen = 0;

    while (count-- > 0 && !in->wrong && compatibility->differs[0] == '\0')
        seen |= 1u << read_field(in, compatibility);
    if (in->wrong || compatibility->differs[0] != '\0')
        return !in->wrong;
    for (size_t i = 0; i < schema->count; i++) {
        if (seen >> i & 1u)
            continue;
        strncat(compatibility->differs, schema->fields[i].path,
                sizeof compatibility->differs - 1);
        return true;
    }
    return true;
}

static bool read_description(struct bytes description, struct compatibility *compatibility)
{
    struct wire_reader in = wire_read(description);
    size_t count = wire_read_map(&in, 3);

    while (count-- > 0 && !in.wrong) {
        if (wire_is(wire_read_text(&in, 16), "fields"))
            return read_fields(&in, compatibility);
        wire_skip(&in);
    }
    return false;
}

bool compatibility_answered(struct woodbot *bot, uint32_t id, struct bytes payload)
{
    struct compatibility *compatibility = &bot->inlet.compatibility;
    struct wire_reader in = wire_read(payload);
    size_t count;

    if (id != QUESTION || compatibility->known)
        return false;
    count = wire_read_map(&in, 100);
    while (count-- > 0 && !in.wrong) {
        struct bytes port = wire_read_text(&in, NAME_SIZE);
        struct bytes description = wire_read_bytes(&in, LINK_PAYLOAD);

        if (!in.wrong && wire_is(port, compatibility->port))
            compatibility->known = read_description(description, compatibility);
    }
    return true;
}
