/* Likeness: whether another schema says the same as the command's.
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

bool likeness_is(struct woodbot *bot, const char *digest, const char *key)
{
    struct likeness *likeness = &bot->inlet.likeness;
    const char *port = strrchr(key, '/') + 1;

    if (strcmp(likeness->digest, digest) == 0 && strcmp(likeness->port, port) == 0)
        return likeness->known && likeness->differs[0] == '\0';
    memset(likeness, 0, sizeof *likeness);
    strncat(likeness->digest, digest, sizeof likeness->digest - 1);
    strncat(likeness->port, port, sizeof likeness->port - 1);
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

bool likeness_step(struct woodbot *bot, uint64_t now)
{
    struct likeness *likeness = &bot->inlet.likeness;
    const struct member *member = &bot->member;
    char room[LINK_KEY];

    if (likeness->digest[0] == '\0' || likeness->known || member->source[0] == '\0'
        || (likeness->asked > 0 && now - likeness->asked < AGAIN))
        return true;
    likeness->asked = now;
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
static size_t read_field(struct wire_reader *in, struct likeness *likeness)
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
    copy(likeness->differs, sizeof likeness->differs, path);
    if (unit.size > 0)
        copy(likeness->unit, sizeof likeness->unit, unit);
    return schema->count;
}

static bool read_fields(struct wire_reader *in, struct likeness *likeness)
{
    const struct codec_schema *schema = &woodbot_command_schema;
    size_t count = wire_read_list(in, 10000);
    unsigned seen = 0;

    while (count-- > 0 && !in->wrong && likeness->differs[0] == '\0')
        seen |= 1u << read_field(in, likeness);
    if (in->wrong || likeness->differs[0] != '\0')
        return !in->wrong;
    for (size_t i = 0; i < schema->count; i++) {
        if (seen >> i & 1u)
            continue;
        strncat(likeness->differs, schema->fields[i].path,
                sizeof likeness->differs - 1);
        return true;
    }
    return true;
}

static bool read_description(struct bytes description, struct likeness *likeness)
{
    struct wire_reader in = wire_read(description);
    size_t count = wire_read_map(&in, 3);

    while (count-- > 0 && !in.wrong) {
        if (wire_is(wire_read_text(&in, 16), "fields"))
            return read_fields(&in, likeness);
        wire_skip(&in);
    }
    return false;
}

bool likeness_answered(struct woodbot *bot, uint32_t id, struct bytes payload)
{
    struct likeness *likeness = &bot->inlet.likeness;
    struct wire_reader in = wire_read(payload);
    size_t count;

    if (id != QUESTION || likeness->known)
        return false;
    count = wire_read_map(&in, 100);
    while (count-- > 0 && !in.wrong) {
        struct bytes port = wire_read_text(&in, NAME_SIZE);
        struct bytes description = wire_read_bytes(&in, LINK_PAYLOAD);

        if (!in.wrong && wire_is(port, likeness->port))
            likeness->known = read_description(description, likeness);
    }
    return true;
}
