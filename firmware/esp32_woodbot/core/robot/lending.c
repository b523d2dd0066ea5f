/* SPDX-License-Identifier: Apache-2.0 */
#include <string.h>

#include "../wire/keys.h"
#include "../wire/text.h"
#include "../woodbot_private.h"

enum { /* us */
    LOOK = 2500000,   /* for the clock that it shall be lent to */
    ASK = 500000,
    ENTER = 6000000,  /* to be let in there */
    TELL = 1500000    /* the clock at home, before who asked is told */
};

#define QUESTION UINT32_MAX /* the number of its own question */

/* -- who asked ---------------------------------------------------------------------- */

static void done(struct woodbot *bot)
{
    struct lending *lending = &bot->lending;

    if (lending->kept != NULL)
        bot->link.done(bot->link.self, lending->kept);
    lending->kept = NULL;
}

static void refuse(struct woodbot *bot, const struct text *why)
{
    struct lending *lending = &bot->lending;

    if (lending->kept != NULL)
        bot->link.refuse(bot->link.self, lending->kept, why->at);
    done(bot);
}

/* Say on which fabric it is, at whichever of its two keys was asked. */
static void answer(struct woodbot *bot)
{
    struct lending *lending = &bot->lending;
    const struct member *there = woodbot_lent(bot) ? &bot->guest : &bot->home;
    const struct member *asked = lending->abroad ? &bot->guest : &bot->home;
    struct wire_writer out = wire_write(bot->scratch, SCRATCH);
    char room[LINK_KEY];

    if (lending->kept == NULL)
        return;
    wire_put_text(&out, there->fabric);
    bot->link.reply(bot->link.self, lending->kept,
                    key_of(room, asked->fabric, asked->agent, "@lend"),
                    wire_written(&out), "application/msgpack", (struct bytes){NULL, 0});
    done(bot);
}

static struct text sentence(struct woodbot *bot)
{
    return text_in((char *)bot->scratch, SCRATCH);
}

/* -- coming back -------------------------------------------------------------------- */

static void tell_clock(struct woodbot *bot, const char *fabric)
{
    struct member *home = &bot->home;
    struct text lent = text_in(home->lent, sizeof home->lent);

    text_say(&lent, fabric);
    home->is_known = false;
    home->lent_due = 0;
}

/* Leave the borrower. before, behind: why, with the name of its own fabric in between;
 * nothing where it was let go. */
static void come_back(struct woodbot *bot, const char *before, const char *behind)
{
    struct lending *lending = &bot->lending;
    char early[REFUSAL_SIZE];
    struct text text = text_in(early, sizeof early);

    if (*before != '\0') {
        text_join(&text, before, bot->home.fabric, behind);
    }
    member_leave(&bot->guest, early);
    commands_forget(bot, &bot->guest);
    answers_forget(bot, &bot->guest);
    member_forget(&bot->guest);
    if (lending->where == AWAY)
        tell_clock(bot, "");
    lending->where = AT_HOME;
    lending->until = woodbot_now(bot) + TELL;
    commands_clear(bot);
    motors_stop(&bot->motors, WHY_LEFT); /* what was said there does not count here */
    bot->held = WHY_LEFT;
}

static void stay(struct woodbot *bot, const struct text *why)
{
    refuse(bot, why);
    come_back(bot, "", "");
}

/* -- being asked -------------------------------------------------------------------- */

static void refuse_at_once(struct woodbot *bot, void *question, const char *one,
                           const char *two, const char *three)
{
    struct text text = sentence(bot);

    text_join(&text, one, two, three);
    bot->link.refuse(bot->link.self, question, text.at);
}

static void go(struct woodbot *bot, const struct loan *loan)
{
    struct lending *lending = &bot->lending;

    member_start(&bot->guest, &bot->link, loan->fabric, bot->settings.name,
                 loan->source, bot->home.identity, true);
    lending->where = LOOKING;
    lending->until = woodbot_now(bot) + LOOK;
    lending->asked = 0;
}

void lending_asked(struct woodbot *bot, void *question, const struct member *member,
                   struct bytes payload)
{
    struct lending *lending = &bot->lending;
    struct loan loan;
    bool back;

    if (!loan_read(payload, &loan)) {
        refuse_at_once(bot, question, "expected a loan: ", "{fabric, sources}, ",
                       "each source without a glob.");
        return;
    }
    back = loan.fabric[0] == '\0' || strcmp(loan.fabric, bot->home.fabric) == 0;
    if (lending->kept != NULL || lending->where == LOOKING
        || lending->where == ENTERING) {
        refuse_at_once(bot, question, "it is between two fabrics; ", "ask again", "");
    } else if (back && !woodbot_lent(bot)) {
        refuse_at_once(bot, question, "it is on '", bot->home.fabric, "', and not lent");
    } else if (!back && woodbot_lent(bot)) {
        refuse_at_once(bot, question, "it is lent already. Type: rems return ",
                       bot->home.agent, "");
    } else if (bot->home.seat != SEAT_IN) {
        refuse_at_once(bot, question, "no clock has let it in on '", bot->home.fabric,
                       "'");
    } else if ((lending->kept = bot->link.keep(bot->link.self, question)) == NULL) {
        refuse_at_once(bot, question, "it is too busy; ", "ask again", "");
    } else {
        lending->abroad = member == &bot->guest;
        lending->back = back;
        if (!back)
            go(bot, &loan);
    }
}

/* -- going -------------------------------------------------------------------------- */

static void look(struct woodbot *bot, uint64_t now)
{
    struct lending *lending = &bot->lending;
    struct text text = sentence(bot);
    char room[LINK_KEY];

    if (now > lending->until) {
        text_join(&text, "there is no fabric '", bot->guest.fabric,
                  "' at its router, or its clock does not answer yet");
        refuse(bot, &text);
        lending->where = AT_HOME;
    } else if (now - lending->asked > ASK) {
        lending->asked = now;
        if (!bot->link.ask(bot->link.self,
                           key_of(room, bot->guest.fabric, "clock/tick", ""),
                           (struct bytes){NULL, 0}, QUESTION, ASK / 1000))
            woodbot_broken(bot);
    }
}

/* The clock that it shall be lent to answers: it is there. */
bool lending_answered(struct woodbot *bot, uint32_t id, struct bytes payload)
{
    struct lending *lending = &bot->lending;
    struct text text = sentence(bot);
    uint64_t n;
    double pace;

    if (id != QUESTION || lending->where != LOOKING
        || !newest_read(payload, &n, &pace))
        return false;
    if (pace > 0) {
        lending->where = ENTERING;
        lending->until = 0; /* declared in the next step, not in here */
        return true;
    }
    text_join(&text, "the run on '", bot->guest.fabric,
              "' is as fast as it can be, and a lent robot lives in real time; "
              "give that run a pace: --pace 1");
    refuse(bot, &text);
    lending->where = AT_HOME;
    return true;
}

static void enter(struct woodbot *bot, uint64_t now)
{
    struct lending *lending = &bot->lending;
    const struct member *guest = &bot->guest;
    struct text text = sentence(bot);

    if (lending->until == 0) {
        lending->until = now + ENTER;
        if (!lending_declare(bot, now))
            woodbot_broken(bot);
    } else if (guest->seat == SEAT_IN) {
        lending->where = AWAY;
        lending->until = now + TELL;
        tell_clock(bot, guest->fabric);
        commands_clear(bot);
    } else if (guest->refusal[0] != '\0' || now > lending->until) {
        text_join(&text, "'", guest->fabric, "' does not take it: ");
        text_join(&text,
                  guest->refusal[0] != '\0' ? guest->refusal
                                            : "its clock does not answer.",
                  " A run takes it that was started with `--elsewhere ", guest->agent);
        text_say(&text, "`.");
        stay(bot, &text);
    }
}

bool lending_declare(struct woodbot *bot, uint64_t now)
{
    if (bot->lending.where != ENTERING && bot->lending.where != AWAY)
        return true;
    return commands_declare(bot, &bot->guest) && answers_declare(bot, &bot->guest)
           && member_declare(&bot->guest, now);
}

/* -- away --------------------------------------------------------------------------- */

static bool has_lost(const struct member *member, uint64_t now)
{
    return member->seat != SEAT_IN
           && (member->parting != PARTING_NONE || member->refusal[0] != '\0'
               || now - member->seen > member->most);
}

static void live(struct woodbot *bot, uint64_t now)
{
    const struct lending *lending = &bot->lending;

    if (lending->kept != NULL && lending->back)
        come_back(bot, "was returned to '", "'");
    else if (has_lost(&bot->home, now))
        come_back(bot, "its own fabric, '", "', is gone");
    else if (has_lost(&bot->guest, now))
        come_back(bot, "", "");
}

void lending_step(struct woodbot *bot, uint64_t now)
{
    struct lending *lending = &bot->lending;

    if (lending->where == LOOKING)
        look(bot, now);
    else if (lending->where == ENTERING)
        enter(bot, now);
    else if (lending->where == AWAY)
        live(bot, now);
    /* Who asked is told when the clock at home knows: `rems list` says the same. */
    if (lending->kept != NULL && lending->where != LOOKING && lending->where != ENTERING
        && lending->back == (lending->where == AT_HOME)
        && (bot->home.is_known || now > lending->until))
        answer(bot);
}

void lending_gone(struct woodbot *bot)
{
    struct lending *lending = &bot->lending;

    done(bot);
    if (lending->where != AWAY)
        lending->where = AT_HOME;
}
