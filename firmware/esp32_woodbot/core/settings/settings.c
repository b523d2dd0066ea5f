/* SPDX-License-Identifier: Apache-2.0 */
#include "../settings.h"

#include <string.h>

#include "decimal.h"
#include "utf8.h"

#define AT(member) offsetof(struct settings, member)
#define WHEEL(i, member) \
    (AT(servo) + (i) * sizeof(struct servo_settings) \
     + offsetof(struct servo_settings, member))

enum kind { TEXT, NUMBER, SWITCH };

static const char *check_name(const char *text);
static const char *check_source(const char *text);
static const char *check_plain(const char *text);
static const char *check_router(const char *text);

/* A setting: where it is in the struct, and what it may be. */
static const struct setting {
    const char *name;
    enum kind kind;
    bool hidden;
    size_t offset, room;                     /* of a text, its end included */
    const char *(*check)(const char *text);  /* of a text */
    double min, max;                         /* of a number */
    const char *range;                       /* the same, as a sentence */
} table[] = {
    {"name", TEXT, false, AT(name), SETTINGS_NAME, check_name, 0, 0, NULL},
    {"fabric", TEXT, false, AT(fabric), SETTINGS_NAME, check_name, 0, 0, NULL},
    {"source", TEXT, false, AT(source), SETTINGS_NAME, check_source, 0, 0, NULL},
    {"ssid", TEXT, false, AT(ssid), 33, check_plain, 0, 0, NULL},
    {"password", TEXT, true, AT(password), 65, check_plain, 0, 0, NULL},
    {"user", TEXT, false, AT(user), 65, check_plain, 0, 0, NULL},
    {"router", TEXT, false, AT(router[0]), SETTINGS_ROUTER, check_router, 0, 0, NULL},
    {"router2", TEXT, false, AT(router[1]), SETTINGS_ROUTER, check_router, 0, 0, NULL},
    {"router3", TEXT, false, AT(router[2]), SETTINGS_ROUTER, check_router, 0, 0, NULL},
#define SERVO(side, i) \
    {side "_trim", NUMBER, false, WHEEL(i, trim), 0, NULL, -500, 500, \
     "expected a number of microseconds from -500 to 500"}, \
    {side "_dead_band", NUMBER, false, WHEEL(i, dead_band), 0, NULL, 0, 200, \
     "expected a number of microseconds from 0 to 200"}, \
    {side "_top_speed", NUMBER, false, WHEEL(i, top_speed), 0, NULL, 0.1, 50, \
     "expected a number of rad/s from 0.1 to 50"}, \
    {side "_reversed", SWITCH, false, WHEEL(i, reversed), 0, NULL, 0, 0, NULL}
    SERVO("left", WHEEL_LEFT),
    SERVO("right", WHEEL_RIGHT),
    {"arena_radius", NUMBER, false, AT(arena_radius), 0, NULL, 0, 100,
     "expected a number of metres from 0 (none) to 100"},
};
enum { SETTINGS = sizeof(table) / sizeof(table[0]) };

/* -- what a text may be ---------------------------------------------------------- */

static bool is_letter(char c)
{
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
}

static const char *check_name(const char *text)
{
    for (size_t i = 0; text[i] != '\0' || i == 0; i++)
        if (!is_letter(text[i]) && (i == 0 || strchr("_.-", text[i]) == NULL
                                    || text[i] == '\0'))
            return "expected 1 to 32 letters, digits, '_', '-' or '.', first a letter "
                   "or a digit";
    return NULL;
}

/* "" or `input/keys`: two names. */
static const char *check_source(const char *text)
{
    static const char wrong[] = "expected KIND/NAME, such as input/keys, or nothing";
    char kind[SETTINGS_NAME] = "";
    const char *slash = strchr(text, '/');

    if (text[0] == '\0')
        return NULL;
    if (slash == NULL)
        return wrong;
    memcpy(kind, text, (size_t)(slash - text));
    return check_name(kind) != NULL || check_name(slash + 1) != NULL ? wrong : NULL;
}

static const char *check_plain(const char *text)
{
    return utf8_plain((const uint8_t *)text, strlen(text))
               ? NULL : "expected UTF-8 without control characters";
}

/* "", `cable`, or `tcp/HOST:PORT`. */
static const char *check_router(const char *text)
{
    static const char wrong[] =
        "expected tcp/ADDRESS:PORT, such as tcp/192.168.1.20:7447, or `cable`, or "
        "nothing (it looks for one)";
    const char *colon = strrchr(text, ':');
    unsigned long port = 0;

    if (text[0] == '\0' || strcmp(text, LINK_CABLE) == 0)
        return NULL;
    if (strncmp(text, "tcp/", 4) != 0 || colon == NULL || colon <= text + 4)
        return wrong;
    for (const char *at = text + 4; at < colon; at++)
        if (!is_letter(*at) && strchr(".-_:[]%", *at) == NULL)
            return wrong;
    for (const char *at = colon + 1; *at != '\0' && port <= 65535; at++) {
        if (*at < '0' || *at > '9')
            return wrong;
        port = 10 * port + (unsigned long)(*at - '0');
    }
    return port == 0 || port > 65535 ? wrong : NULL;
}

/* -- by name --------------------------------------------------------------------- */

static const struct setting *find(const char *name)
{
    for (size_t i = 0; i < SETTINGS; i++)
        if (strcmp(table[i].name, name) == 0)
            return &table[i];
    return NULL;
}

const char *settings_name(size_t i)
{
    return i < SETTINGS ? table[i].name : NULL;
}

static const char *set_text(const struct setting *it, char *place, const char *value)
{
    const char *wrong;

    if (strlen(value) >= it->room)
        return it->check == check_name ? check_name("") : "it is too long";
    wrong = it->check(value);
    if (wrong == NULL) {
        memset(place, 0, it->room); /* nothing of the old password stays behind */
        memcpy(place, value, strlen(value));
    }
    return wrong;
}

static const char *set_number(const struct setting *it, void *place, const char *value)
{
    double number;

    if (!decimal_read(value, &number) || number < it->min || number > it->max)
        return it->range;
    memcpy(place, &number, sizeof number);
    return NULL;
}

static const char *set_switch(void *place, const char *value)
{
    bool on = strcmp(value, "yes") == 0;

    if (!on && strcmp(value, "no") != 0)
        return "expected yes or no";
    memcpy(place, &on, sizeof on);
    return NULL;
}

const char *settings_set(struct settings *settings, const char *name,
                         const char *value)
{
    const struct setting *it = find(name);
    char *place;

    if (it == NULL)
        return "there is no setting of that name; `get` lists them";
    place = (char *)settings + it->offset;
    if (it->kind == TEXT)
        return set_text(it, place, value);
    return it->kind == NUMBER ? set_number(it, place, value) : set_switch(place, value);
}

bool settings_text(const struct settings *settings, size_t i, char *text, size_t room)
{
    const struct setting *it = &table[i];
    const char *place = (const char *)settings + it->offset;
    double number;
    bool on;

    if (it->kind == NUMBER) {
        memcpy(&number, place, sizeof number);
        return decimal_write(number, text, room);
    }
    if (it->kind == SWITCH) {
        memcpy(&on, place, sizeof on);
        place = on ? "yes" : "no";
    }
    if (strlen(place) >= room)
        return false;
    memcpy(text, place, strlen(place) + 1);
    return true;
}

bool settings_get(const struct settings *settings, const char *name, char *text,
                  size_t room)
{
    const struct setting *it = find(name);
    const char *said;

    if (it == NULL || room == 0)
        return false;
    if (!it->hidden)
        return settings_text(settings, (size_t)(it - table), text, room);
    said = ((const char *)settings)[it->offset] == '\0' ? "" : "(set)";
    if (strlen(said) >= room)
        return false;
    memcpy(text, said, strlen(said) + 1);
    return true;
}

bool settings_by_cable(const struct settings *settings)
{
    return strcmp(settings->router[0], LINK_CABLE) == 0;
}

void settings_default(struct settings *settings)
{
    memset(settings, 0, sizeof *settings);
    memcpy(settings->name, "woodbot", sizeof "woodbot");
    memcpy(settings->fabric, "rems", sizeof "rems");
    for (int i = 0; i < 2; i++)
        settings->servo[i].top_speed = WOODBOT_MAX_WHEEL_SPEED;
    settings->servo[WHEEL_RIGHT].reversed = true; /* it is mounted the other way */
}
