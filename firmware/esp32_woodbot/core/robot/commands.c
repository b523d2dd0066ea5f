/* SPDX-License-Identifier: Apache-2.0 */
#include <string.h>

#include "../wire/keys.h"
#include "../woodbot_private.h"

enum { AHEAD = 9 /* ticks by which a clock can be ahead of what was heard */ };

/* -- what is heard ----------------------------------------------------------------- */

static const char *own_key(const struct member *member, char room[LINK_KEY])
{
    return key_of(room, member->fabric, member->agent, "command");
}

const char *commands_source(const struct member *member, char room[LINK_KEY])
{
    bool whole = strchr(strchr(member->source, '/') + 1, '/') != NULL;

    return key_of(room, member->fabric, member->source, whole ? "" : "*");
}

static bool has_source(const struct member *member)
{
    return member->source[0] != '\0';
}

bool commands_declare(struct woodbot *bot, const struct member *member)
{
    const struct link *link = &bot->link;
    char room[LINK_KEY];

    return link->subscribe(link->self, own_key(member, room))
           && (!has_source(member)
               || link->subscribe(link->self, commands_source(member, room)));
}

/* -- what is refused --------------------------------------------------------------- */

static void drop(struct inlet *inlet, unsigned reason)
{
    inlet->dropped++;
    inlet->reasons[reason]++;
}

/* What comes after the last `separator` of some text; NULL if it has none. */
static const char *last(const char *text, char separator)
{
    const char *found = strrchr(text, separator);

    return found != NULL ? found + 1 : NULL;
}

static bool is_of_schema(struct woodbot *bot, const struct member *member,
                         const char *key, const char *encoding)
{
    struct inlet *inlet = &bot->inlet;
    const char *schema = last(encoding, ';');
    const char *digest = schema != NULL ? last(schema, '@') : NULL;

    if (digest == NULL || strcmp(digest, woodbot_command_schema.digest) == 0)
        return true;
    if (has_source(member) && compatibility_is(bot, digest, key))
        return true;
    inlet->schema[0] = '\0';
    strncat(inlet->schema, schema, sizeof inlet->schema - 1);
    return false;
}

/* Whether a tick was made longer ago than a command is obeyed. */
static bool is_old(const struct member *member, uint64_t said, uint64_t now)
{
    uint64_t made = guard_made(&member->guard, said);

    if (made > 0)
        return now - made > WOODBOT_MAX_AGE_US;
    /* Before all of which is known how old they are; they do not come faster. */
    return (double)(member->beat.n - said) * member->dt
           > WOODBOT_MAX_AGE * (member->beat.pace > 1 ? member->beat.pace : 1);
}

/* Whether a stamp that is one can be obeyed; DROPS if so. */
static enum drop judge(const struct woodbot *bot, const struct stamp *stamp, uint64_t now)
{
    const struct inlet *inlet = &bot->inlet;
    const struct member *member = &bot->member;
    uint64_t newest = member->beat.n, lease = bot->lease.badge;
    /* A holder may say something else of the same state; a member says it once. */
    bool again = stamp->n == inlet->n && stamp->badge != 0
                 && stamp->badge == inlet->badge && lease == 0;

    if (lease != 0 && stamp->badge != lease)
        return DROP_LEASED;
    if (lease == 0 && (stamp->badge == 0 ? has_source(member)
                                         : run_of(stamp->badge) != member_run(member)))
        return DROP_FOREIGN;
    if (stamp->n > newest + AHEAD)
        return DROP_FUTURE;
    if (stamp->n < inlet->n || again)
        return DROP_REPLAYED;
    if (stamp->said < newest && is_old(member, stamp->said, now))
        return DROP_OLD;
    return DROPS;
}

/* -- what is obeyed ---------------------------------------------------------------- */

static void take(struct woodbot *bot, const struct member *member, const char *key,
                 struct bytes payload, const char *encoding, struct bytes attachment)
{
    struct inlet *inlet = &bot->inlet;
    uint64_t newest = member->beat.n;
    struct stamp stamp = {newest, 0, newest, 0}; /* who does not say means now */
    struct woodbot_command command;
    struct codec_result result;
    enum drop wrong = DROPS;

    if (!is_of_schema(bot, member, key, encoding))
        wrong = DROP_SCHEMA;
    else if (attachment.size > 0 && !stamp_read(attachment, &stamp))
        wrong = DROP_STAMP;
    else if (attachment.size > 0 || has_source(member) || bot->lease.badge != 0)
        wrong = judge(bot, &stamp, woodbot_now(bot));
    if (wrong != DROPS) {
        drop(inlet, wrong);
        return;
    }
    result = codec_decode(&woodbot_command_schema, payload.at, payload.size, &command);
    if (result.status != CODEC_OK) {
        inlet->path = result.path;
        drop(inlet, DROP_PAYLOAD + result.status);
        return;
    }
    if (attachment.size > 0) {
        inlet->n = stamp.n;
        inlet->badge = stamp.badge;
    }
    inlet->command = command;
    inlet->told = true;
    inlet->said = stamp.said;
    inlet->heard = (double)stamp.said * member->dt;
    inlet->made = 0;
    inlet->came = woodbot_now(bot);
    commands_obey(bot);
}

static bool is_own(const struct member *member, struct bytes attachment)
{
    struct stamp stamp;

    return stamp_read(attachment, &stamp) && stamp.badge == member->badge;
}

bool commands_heard(struct woodbot *bot, const char *key, struct bytes payload,
                    const char *encoding, struct bytes attachment)
{
    const struct member *member = &bot->member;
    char room[LINK_KEY];
    bool here = strcmp(key, own_key(member, room)) == 0;

    if (!here && !(has_source(member) && key_covers(commands_source(member, room), key)))
        return false;
    if (!here)
        liveness_heard(bot);
    if (member->seat != SEAT_IN || member->beat.n == 0
        || (here && is_own(member, attachment))) /* some links bring back what is put */
        return true;
    if (here && has_source(member))
        drop(&bot->inlet, DROP_OUTSIDER);
    else
        take(bot, member, key, payload, encoding, attachment);
    return true;
}

void commands_obey(struct woodbot *bot)
{
    struct inlet *inlet = &bot->inlet;
    const struct member *member = &bot->member;
    uint64_t made = guard_made(&member->guard, inlet->said);
    struct order order = {inlet->command, made, inlet->said};

    if (!inlet->told || bot->held != WHY_DRIVEN)
        return;
    if (made > inlet->came) /* stamped ahead: it was said before it came, for all that */
        made = inlet->came;
    if (made <= inlet->made)
        return;
    inlet->made = order.said = made;
    motors_tell(&bot->motors, &order);
}

void commands_clear(struct woodbot *bot)
{
    struct inlet *inlet = &bot->inlet;

    inlet->told = false;
    inlet->n = inlet->badge = inlet->said = inlet->made = 0;
}

/* -- for people -------------------------------------------------------------------- */

static void say_schema(const struct inlet *inlet, const struct member *member,
                       struct text *text)
{
    const struct codec_schema *schema = &woodbot_command_schema;
    const struct compatibility *compatibility = &inlet->compatibility;

    text_say(text, "it is of the schema ");
    text_say(text, inlet->schema);
    if (compatibility->differs[0] != '\0') {
        text_join(text, ", whose ", compatibility->differs,
                  compatibility->unit[0] != '\0' ? " is in " : " is missing or another");
        text_say(text, compatibility->unit);
    }
    text_join(text, ", and ", member->agent, "/command takes ");
    text_join(text, schema->name, "@", schema->digest);
    text_say(text, ": ");
    for (size_t i = 0; i < schema->count; i++) {
        text_join(text, i > 0 ? ", " : "", schema->fields[i].path, " in ");
        text_say(text, schema->fields[i].unit);
    }
    text_say(text, ". See what it is sent: rems get ");
    text_say(text, has_source(member) ? member->source : member->agent);
}

void commands_why(const struct woodbot *bot, enum drop drop, struct text *text)
{
    static const char *const sentences[DROP_PAYLOAD] = {
        "", "its stamp is no [n, t, badge].",
        "it is stamped by no member of this run.",
        "its tick is not newer than that of what was obeyed.",
        "it is stamped with a tick that was not made yet.",
        "what it answers to is older than a command may be.",
        "",
        "another run holds its lease, and nobody else commands it.",
    };
    const struct inlet *inlet = &bot->inlet;
    const struct member *member = &bot->member;

    if (drop == DROP_SCHEMA) {
        say_schema(inlet, member, text);
    } else if (drop == DROP_OUTSIDER) {
        text_join(text, "it is told by ", member->source, ", and by nobody else.");
    } else if (drop < DROP_PAYLOAD) {
        text_say(text, sentences[drop]);
    } else {
        text_say(text, "its payload is refused: ");
        text_say(text, codec_name((enum codec_status)(drop - DROP_PAYLOAD)));
        if (inlet->path != NULL) {
            text_say(text, ", the last at ");
            text_say(text, inlet->path);
        }
    }
}
