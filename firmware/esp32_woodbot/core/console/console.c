/* SPDX-License-Identifier: Apache-2.0 */
#include "../console.h"

#include <string.h>

#include "../settings/utf8.h"

enum {
    PACKET_TIME = 1000000,  /* us that a packet may take to come in */
    TAKEN_AT_ONCE = 512     /* bytes: the link's task has more to do */
};

static const char help[] =
    "status          how the robot is\r\n"
    "get [NAME]      its settings\r\n"
    "set NAME VALUE  change one, or empty it\r\n"
    "test servos     turn each wheel a little\r\n"
    "test sensors    read each sensor once\r\n"
    "reset           start again\r\n"
    "forget          forget all settings\r\n";

/* -- what is written ------------------------------------------------------------- */

static void append(struct console *console, const void *bytes, size_t size, size_t end)
{
    size_t room = end > console->to ? end - console->to : 0;

    if (size > room)
        size = room;
    memcpy(console->out + console->to, bytes, size);
    console->to += size;
}

void console_say(struct console *console, const char *text)
{
    append(console, text, strlen(text), CONSOLE_OUT - CONSOLE_SPARE);
}

void console_packet(struct console *console, const uint8_t *data, size_t size)
{
    if (size <= CONSOLE_OUT - console->to)
        append(console, data, size, CONSOLE_OUT);
}

/* The last line of an answer. */
static void end(struct console *console, const char *wrong)
{
    if (console->to > 0 && console->out[console->to - 1] != '\n')
        append(console, "\r\n", 2, CONSOLE_OUT);
    if (wrong != NULL) {
        append(console, "error: ", 7, CONSOLE_OUT);
        append(console, wrong, strlen(wrong), CONSOLE_OUT - 2);
    } else {
        append(console, "ok", 2, CONSOLE_OUT);
    }
    append(console, "\r\n", 2, CONSOLE_OUT);
}

static void flush(struct console *console)
{
    const struct hardware *hardware = console->hardware;

    if (console->from < console->to)
        console->from += hardware->write(hardware->self, console->out + console->from,
                                         console->to - console->from);
    if (console->from >= console->to)
        console->from = console->to = 0;
}

/* -- lines of text --------------------------------------------------------------- */

static void show(struct console *console, const char *name)
{
    char text[72];

    if (!settings_get(console->settings, name, text, sizeof text))
        return;
    console_say(console, name);
    console_say(console, " ");
    console_say(console, text);
    console_say(console, "\r\n");
}

static const char *get(struct console *console, const char *name)
{
    const char *known;

    for (size_t i = 0; (known = settings_name(i)) != NULL; i++) {
        if (*name == '\0' || strcmp(known, name) == 0)
            show(console, known);
        if (strcmp(known, name) == 0)
            return NULL;
    }
    return *name == '\0' ? NULL : "there is no setting of that name; `get` lists them";
}

static const char *changed(struct console *console)
{
    bool stored = settings_store(console->settings, console->hardware);

    console->host.changed(console->host.self);
    return stored ? NULL : "it could not be stored; it holds until the robot is reset";
}

static const char *set(struct console *console, char *rest)
{
    char *value = strchr(rest, ' ');
    const char *wrong;

    if (value != NULL)
        *value++ = '\0';
    if (*rest == '\0')
        return "expected: set NAME VALUE";
    wrong = settings_set(console->settings, rest, value != NULL ? value : "");
    if (wrong != NULL)
        return wrong;
    console->provisioning = false; /* what was set last holds */
    return changed(console);
}

/* What is to be written by the robot around. */
static void ask(struct console *console, const char *what)
{
    char *text = (char *)console->out + console->to;
    size_t room = CONSOLE_OUT - CONSOLE_SPARE - console->to;

    *text = '\0';
    if (what != NULL)
        console->host.test(console->host.self, what, text, room);
    else
        console->host.status(console->host.self, text, room);
    text[room - 1] = '\0';
    console->to += strlen(text);
}

static const char *obey(struct console *console, char *word, char *rest)
{
    if (strcmp(word, "get") == 0)
        return get(console, rest);
    if (strcmp(word, "set") == 0)
        return set(console, rest);
    if (strcmp(word, "test") == 0) {
        if (strcmp(rest, "servos") != 0 && strcmp(rest, "sensors") != 0)
            return "expected: test servos, or test sensors";
        ask(console, rest);
        return NULL;
    }
    if (*rest != '\0')
        return "there is no such command; `help` lists them";
    if (strcmp(word, "help") == 0)
        console_say(console, help);
    else if (strcmp(word, "status") == 0)
        ask(console, NULL);
    else if (strcmp(word, "reset") == 0)
        console->resetting = true; /* once that is answered */
    else if (strcmp(word, "forget") == 0) {
        console->provisioning = false;
        settings_default(console->settings);
        return changed(console);
    } else
        return "there is no such command; `help` lists them";
    return NULL;
}

/* What is wrong is said without a word of the line: it may have been a password. */
static void read_line(struct console *console)
{
    char *word = (char *)console->line;
    char *rest;

    if (console->skipping) {
        end(console, "the line is too long");
    } else if (console->length > 0) {
        console->line[console->length] = '\0';
        if (utf8_plain(console->line, console->length)) {
            word += strspn(word, " ");
            rest = word + strcspn(word, " ");
            if (*rest != '\0')
                *rest++ = '\0';
            end(console, obey(console, word, rest));
        } else {
            end(console, "expected a line of UTF-8 text");
        }
    }
    console->skipping = false;
    console->length = 0;
    memset(console->line, 0, sizeof console->line);
}

/* -- bytes ----------------------------------------------------------------------- */

/* Whether Improv's start is complete with this byte, wherever it came. */
static bool starts_packet(struct console *console, uint8_t byte)
{
    if (byte != improv_start[console->matched])
        console->matched = 0;
    if (byte == improv_start[console->matched])
        console->matched++;
    if (console->matched < IMPROV_START)
        return false;
    console->matched = 0;
    return true;
}

static void rub_out(struct console *console)
{
    while (console->length > 0 && (console->line[--console->length] & 0xC0) == 0x80)
        continue; /* all bytes of its character */
}

static void take(struct console *console, uint8_t byte, uint64_t now)
{
    if (console->packet) {
        console->line[console->length++] = byte;
        if (console->length == improv_length(console->line, console->length)) {
            console_rpc(console, now);
            console->packet = false;
            console->length = 0;
            memset(console->line, 0, sizeof console->line);
        }
    } else if (starts_packet(console, byte)) {
        memcpy(console->line, improv_start, IMPROV_START);
        console->length = IMPROV_START;
        console->packet = true;
        console->skipping = false;
        console->since = now;
    } else if (byte == '\n' || byte == '\r') {
        read_line(console);
    } else if (byte == '\b' || byte == 0x7F) {
        rub_out(console);
    } else if (console->length == CONSOLE_LINE - 1) {
        console->skipping = true;
    } else {
        console->line[console->length++] = byte;
    }
}

void console_start(struct console *console)
{
    console->length = console->matched = console->from = console->to = 0;
    console->packet = console->skipping = console->scanning = false;
    console->provisioning = console->resetting = false;
    console_say(console, "\r\nThis is Woodbot ");
    console_say(console, console->settings->name);
    console_say(console, ". Type help.\r\n");
}

void console_step(struct console *console, uint64_t now)
{
    const struct hardware *hardware = console->hardware;
    uint8_t byte;

    flush(console);
    if (console->packet && now - console->since > PACKET_TIME) {
        console->packet = false;
        console->length = 0;
    }
    /* One answer after the other: each finds the whole of the room. */
    for (int left = TAKEN_AT_ONCE; left > 0 && console->to == 0
         && !console->resetting; left--) {
        if (hardware->read(hardware->self, &byte, 1) != 1)
            break;
        take(console, byte, now);
        flush(console);
    }
    if (console->to == 0 && console->resetting) {
        console->resetting = false;
        console->host.reset(console->host.self);
    } else if (console->to == 0) {
        console_provision(console, now);
    }
    flush(console);
}
