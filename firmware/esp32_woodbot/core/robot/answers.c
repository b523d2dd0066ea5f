/* SPDX-License-Identifier: Apache-2.0 */
#include <string.h>

#include "../wire/keys.h"
#include "../wire/text.h"
#include "../woodbot_private.h"
#include "asking.h"

static const char *const keys[] = {
    "**", "@schema", "@call/*", "@why", "@stopped", "@lease",
    "@lease/take",
};

enum { KEYS = sizeof keys / sizeof keys[0] };

bool answers_declare(struct woodbot *bot, const struct member *member)
{
    const struct link *link = &bot->link;
    char room[LINK_KEY];
    bool well = true;

    for (size_t i = 0; i < KEYS; i++)
        well = well
               && link->answer(link->self, key_of(room, member->fabric, member->agent,
                                                  keys[i]));
    return well
           && link->token(link->self,
                          key_of(room, member->fabric, member->agent, "@alive"));
}

/* Whether it is asked for this key of the robot's; it is in the room then. */
bool asking_covers(struct asking *asking, const char *one, const char *two)
{
    key_of(asking->room, asking->member->fabric, one, two);
    return key_covers(asking->key, asking->room);
}

void asking_reply(struct asking *asking, struct bytes payload, const char *encoding,
                  const struct stamp *stamp)
{
    const struct link *link = &asking->bot->link;
    uint8_t room[STAMP_SIZE];
    struct bytes attachment = {NULL, 0};

    if (stamp != NULL)
        attachment = stamp_write(room, stamp);
    link->reply(link->self, asking->question, asking->room, payload, encoding,
                attachment);
}

struct text asking_text(struct asking *asking)
{
    return text_in((char *)asking->bot->scratch, SCRATCH);
}

void asking_reply_json(struct asking *asking, const struct text *text)
{
    asking_reply(asking, text_bytes(text), "application/json", NULL);
}

void asking_say_when(struct text *text, const struct stamp *stamp)
{
    text_say(text, "{\"tick\": ");
    text_whole(text, stamp->n);
    text_say(text, ", \"time\": ");
    text_real(text, stamp->t);
}

/* -- machinery ---------------------------------------------------------------------- */

static void tell_stopped(struct asking *asking)
{
    struct woodbot *bot = asking->bot;
    bool stopped = woodbot_stopped(bot);
    bool stands = motors_motion(&bot->motors).why != WHY_DRIVEN;
    struct wire_writer out = wire_write(bot->scratch, SCRATCH);

    wire_put_map(&out, 4);
    wire_put_text(&out, "stopped");
    wire_put_flag(&out, stopped);
    wire_put_text(&out, "standing");
    wire_put_text(&out, stands ? "confirmed" : "sent");
    wire_put_text(&out, "tick");
    wire_put_whole(&out, asking->member->beat.n);
    wire_put_text(&out, "time");
    wire_put_real(&out, asking->member->beat.t);
    asking_reply(asking, wire_written(&out), "application/msgpack", NULL);
}

static void tell_holds(struct asking *asking)
{
    struct wire_writer out = wire_write(asking->bot->scratch, SCRATCH);

    wire_put_flag(&out, asking->member->guard.stopped);
    asking_reply(asking, wire_written(&out), "application/msgpack", NULL);
}

static void say_reasons(const struct woodbot *bot, struct text *out)
{
    enum { SENTENCE = 320 };
    char sentence[SENTENCE];
    const char *comma = "";

    for (unsigned i = 0; i < DROPS; i++) {
        struct text text = text_in(sentence, sizeof sentence);

        /* All of them, long as they are, leave room for the end. */
        if (bot->inlet.reasons[i] == 0 || out->room - out->size < SENTENCE + 128)
            continue;
        commands_why(bot, (enum drop)i, &text);
        text_say(out, comma);
        text_say(out, "[");
        text_whole(out, bot->inlet.reasons[i]);
        text_say(out, ", ");
        text_quote(out, sentence);
        text_say(out, "]");
        comma = ", ";
    }
}

static void tell_why(struct asking *asking)
{
    const struct woodbot *bot = asking->bot;
    const struct inlet *inlet = &bot->inlet;
    const struct beat *beat = &asking->member->beat;
    struct stamp stamp = {beat->n, 0, beat->n, beat->t};
    struct text out = asking_text(asking);

    asking_say_when(&out, &stamp);
    text_say(&out, ", \"ins\": {\"command\": {\"source\": ");
    text_quote(&out, bot->lease.badge != 0 ? bot->lease.holder : bot->member.source);
    text_say(&out, ", \"heard\": ");
    if (inlet->heard > 0)
        text_real(&out, inlet->heard);
    else
        text_say(&out, "null");
    text_say(&out, ", \"dropped\": ");
    text_whole(&out, inlet->dropped);
    text_say(&out, ", \"reasons\": [");
    say_reasons(bot, &out);
    text_say(&out, "]}}, \"made_of\": [\"Woodbot's firmware\", \"" WOODBOT_VERSION "\"]");
    text_say(&out, ", \"stands\": ");
    text_quote(&out, report_why(motors_motion(&bot->motors).why));
    text_say(&out, ", \"sessions\": ");
    text_whole(&out, bot->supervisor.opened);
    text_say(&out, ", \"last\": ");
    text_quote(&out, supervisor_why(bot->supervisor.cause));
    text_say(&out, "}");
    asking_reply_json(asking, &out);
}

static void answer_schema(struct asking *asking)
{
    struct bytes made = schemas_write(asking->bot->scratch, SCRATCH);

    asking_reply(asking, made, "application/msgpack", NULL);
}

/* Which verb is called: of a glob the first that it covers. */
static void answer_call(struct asking *asking, struct bytes payload)
{
    const char *name = strrchr(asking->key, '/') + 1;
    bool glob = strchr(name, '*') != NULL;

    for (const char *const *verb = verbs; *verb != NULL; verb++) {
        asking_covers(asking, asking->member->agent, "@call");
        key_add(asking->room, glob ? *verb : name);
        if (!key_covers(asking->key, asking->room))
            continue;
        asking_reply(asking, verbs_call(asking->bot, glob ? *verb : name, payload),
              "application/msgpack", NULL);
        if (!glob)
            return;
    }
}

/* -- sorting ------------------------------------------------------------------------ */

static void answer(struct asking *asking, struct bytes payload)
{
    const struct member *member = asking->member;
    const struct link *link = &asking->bot->link;

    if (asking_covers(asking, "stop/@holds", ""))
        tell_holds(asking);
    else if (asking_covers(asking, member->agent, "@stopped"))
        tell_stopped(asking);
    else if (member->refusal[0] == '\0' && asking_covers(asking, member->agent, "@schema"))
        answer_schema(asking);
    else if (asking_covers(asking, member->agent, "@why"))
        tell_why(asking);
    else if (member->refusal[0] != '\0') /* another one has its name: that one answers */
        link->refuse(link->self, asking->question, member->refusal);
    else if (asking_covers(asking, member->agent, "@lease")
             && strcmp(asking->key, asking->room) == 0) /* no glob: one robot is meant */
        lease_asked(asking->bot, asking->question, asking->key, payload);
    else if (asking_covers(asking, member->agent, "@lease/take")
             && strcmp(asking->key, asking->room) == 0)
        lease_taken(asking->bot, asking->question, asking->key, payload);
    else if (strstr(asking->key, "/@call/") != NULL)
        answer_call(asking, payload);
    else
        asking_values(asking);
}

void answers_asked(struct woodbot *bot, void *question, const char *key,
                   const char *parameters, struct bytes payload)
{
    struct asking asking = {bot, &bot->member, question, key,
                            key_asks(parameters, "format", "json"), ""};

    if (bot->member.seat != SEAT_NONE
        && (*key == '*' || member_within(&bot->member, key) != NULL))
        answer(&asking, payload);
}
