/* The verb `servos`: what its servos are like, told and set over the fabric.
 *
 * `servos()` returns it; `servos(left_trim=12, right_dead_band=45.5)` changes it, all
 * or nothing, and stores it: `rems board calibrate` does. Nothing else of the settings can be
 * seen or changed from the fabric, and no servo while it is driven.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#include <string.h>

#include "../settings/decimal.h"
#include "../woodbot_private.h"

enum { NAME = 24, VALUE = 24, SENTENCE = 128 };

static const char *const names[] = {
    "left_trim", "left_dead_band", "left_top_speed", "left_reversed",
    "right_trim", "right_dead_band", "right_top_speed", "right_reversed",
};
enum { NAMES = sizeof names / sizeof names[0] };

/* -- reading -----------------------------------------------------------------------  */

static bool copy(struct bytes from, char *to, size_t room)
{
    if (from.size >= room)
        return false;
    memcpy(to, from.at, from.size);
    to[from.size] = '\0';
    return true;
}

/* A whole number below 0, which nothing else of the protocol has. */
static double read_negative(struct wire_reader *in)
{
    const size_t width = *in->at >= 0xE0 ? 0 : *in->at == 0xD0 ? 1 : 2;
    double number;

    if (in->left <= width) {
        in->wrong = true;
        return 0;
    }
    number = width == 0 ? (int8_t)in->at[0]
             : width == 1 ? (int8_t)in->at[1]
                          : (int16_t)(uint16_t)(in->at[1] << 8 | in->at[2]);
    in->at += width + 1;
    in->left -= width + 1;
    return number;
}

/* A text, a number or a flag, as the text that settings.h takes. */
static bool read_value(struct wire_reader *in, char *value, size_t room)
{
    const uint8_t head = in->left > 0 ? *in->at : 0xC0;
    double number;

    if (head == 0xC2 || head == 0xC3)
        return copy(wire_read_flag(in) ? (struct bytes){(const uint8_t *)"yes", 3}
                                       : (struct bytes){(const uint8_t *)"no", 2},
                    value, room);
    if ((head & 0xE0) == 0xA0)
        return copy(wire_read_text(in, room - 1), value, room) && !in->wrong;
    if (head == 0xCA || head == 0xCB)
        number = wire_read_real(in);
    else if (head >= 0xE0 || head == 0xD0 || head == 0xD1)
        number = read_negative(in);
    else
        number = (double)wire_read_whole(in, 0, WIRE_LAST_TICK);
    return !in->wrong && decimal_write(number, value, room);
}

static bool is_name(const char *name)
{
    for (size_t i = 0; i < NAMES; i++) {
        if (strcmp(names[i], name) == 0)
            return true;
    }
    return false;
}

/* Set what the call says in `settings`; NULL, or what is wrong with it. */
static const char *change(struct settings *settings, struct bytes message,
                          size_t *changed, char sentence[SENTENCE])
{
    struct wire_reader in = wire_read(message);
    size_t parts = message.size > 0 ? wire_read_map(&in, 2) : 0;

    while (parts-- > 0 && !in.wrong) {
        if (wire_is(wire_read_text(&in, 16), "args")) {
            wire_read_list(&in, 0);
            continue;
        }
        for (size_t left = wire_read_map(&in, NAMES); left > 0 && !in.wrong; left--) {
            char name[NAME], value[VALUE];
            struct text text = text_in(sentence, SENTENCE);
            const char *wrong = "there is no such setting of a servo";

            if (!copy(wire_read_text(&in, NAME - 1), name, sizeof name)
                || !read_value(&in, value, sizeof value))
                break;
            if (is_name(name))
                wrong = settings_set(settings, name, value);
            text_say(&text, name);
            text_say(&text, ": ");
            if (wrong != NULL) {
                text_say(&text, wrong);
                return sentence;
            }
            ++*changed;
        }
    }
    return message.size == 0 || wire_ended(&in)
               ? NULL : "expected settings by their names, such as left_trim=12";
}

/* -- the verb ----------------------------------------------------------------------  */

static void tell(const struct settings *settings, struct wire_writer *out)
{
    char value[VALUE];

    wire_put_map(out, 1);
    wire_put_text(out, "result");
    wire_put_map(out, NAMES);
    for (size_t i = 0; i < NAMES; i++) {
        wire_put_text(out, names[i]);
        settings_get(settings, names[i], value, sizeof value);
        wire_put_text(out, value);
    }
}

static const char *keep(struct woodbot *bot, const struct settings *settings)
{
    if (motors_motion(&bot->motors).why == WHY_DRIVEN)
        return "it is driven; its servos are set while it stands";
    if (!settings_store(settings, &bot->hardware))
        return "it could not be stored";
    bot->settings = *settings;
    motors_set(&bot->motors, settings->servo);
    return NULL;
}

void servos_call(struct woodbot *bot, struct bytes message, struct wire_writer *out)
{
    struct settings settings = bot->settings;
    char sentence[SENTENCE];
    size_t changed = 0;
    const char *wrong = change(&settings, message, &changed, sentence);

    if (wrong == NULL && changed > 0)
        wrong = keep(bot, &settings);
    if (wrong == NULL) {
        tell(&bot->settings, out);
    } else {
        wire_put_map(out, 1);
        wire_put_text(out, "error");
        wire_put_text(out, wrong);
    }
    memset(&settings, 0, sizeof settings); /* the password is among them */
}
