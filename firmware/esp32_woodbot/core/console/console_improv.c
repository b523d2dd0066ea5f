/* SPDX-License-Identifier: Apache-2.0 */
#include <string.h>

#include "../console.h"
#include "../settings/decimal.h"
#include "../settings/utf8.h"

enum {
    /* us; Improv's own clients give up after 30 s */
    JOIN_TIME = 25000000,
    FIND_TIME = 8000000     /* an access point is missed by a scan now and then */
};

static void tell(struct console *console, enum improv_type type, uint8_t what)
{
    uint8_t packet[16];

    console_packet(console, packet,
                   improv_write(packet, sizeof packet, type, &what, 1));
}

static void result(struct console *console, enum improv_command command,
                   const char *const *texts)
{
    uint8_t packet[IMPROV_PACKET + 2];

    console_packet(console, packet,
                   improv_result(packet, sizeof packet, command, texts));
}

static void tell_state(struct console *console)
{
    const struct link *link = console->link;

    tell(console, IMPROV_STATE,
         console->provisioning                         ? IMPROV_PROVISIONING
         : link->network(link->self) == NETWORK_UP     ? IMPROV_PROVISIONED
                                                       : IMPROV_READY);
}

static const char *const nothing[] = {NULL}; /* the robot has no page to go on at */

/* -- commands -------------------------------------------------------------------- */

/* A text with its length before it; false if it does not fit what is left. */
static bool next_text(const uint8_t **at, size_t *left, char *text, size_t room)
{
    size_t length = *left > 0 ? **at : 0;

    if (*left < 1 + length || length >= room
        || memchr(*at + 1, '\0', length) != NULL)
        return false;
    memcpy(text, *at + 1, length);
    text[length] = '\0';
    *at += 1 + length;
    *left -= 1 + length;
    return true;
}

static void restore(struct console *console)
{
    memcpy(console->settings->ssid, console->ssid, sizeof console->ssid);
    memcpy(console->settings->password, console->password, sizeof console->password);
    memset(console->password, 0, sizeof console->password);
}

static bool set_wifi(struct console *console, const uint8_t *data, size_t size)
{
    struct settings *settings = console->settings;
    char ssid[33], password[65];
    bool good = next_text(&data, &size, ssid, sizeof ssid)
                && next_text(&data, &size, password, sizeof password) && size == 0
                && ssid[0] != '\0';

    if (good && console->provisioning)
        restore(console); /* what was tried last is not what comes back */
    if (good) {
        memcpy(console->ssid, settings->ssid, sizeof console->ssid);
        memcpy(console->password, settings->password, sizeof console->password);
        good = settings_set(settings, "ssid", ssid) == NULL
               && settings_set(settings, "password", password) == NULL;
        if (!good)
            restore(console);
    }
    memset(password, 0, sizeof password);
    return good;
}

static void provision(struct console *console, const uint8_t *data, size_t size,
                      uint64_t now)
{
    if (!set_wifi(console, data, size)) {
        tell(console, IMPROV_ERROR, IMPROV_INVALID);
        return;
    }
    if (settings_by_cable(console->settings)) /* who joins a network wants it used */
        console->settings->router[0][0] = '\0';
    console->provisioning = true;
    console->since = now;
    console->host.changed(console->host.self);
    tell_state(console);
}

static void tell_info(struct console *console)
{
    const char *const info[] = {"rems_net woodbot", WOODBOT_VERSION, WOODBOT_CHIP,
                                console->settings->name, NULL};

    result(console, IMPROV_GET_INFO, info);
}

static void set_name(struct console *console, const uint8_t *data, size_t size)
{
    char name[SETTINGS_NAME] = "";
    const char *const texts[] = {console->settings->name, NULL};

    if (size >= sizeof name) {
        tell(console, IMPROV_ERROR, IMPROV_BAD_NAME);
        return;
    }
    if (size > 0) {
        memcpy(name, data, size);
        if (strlen(name) != size
            || settings_set(console->settings, "name", name) != NULL) {
            tell(console, IMPROV_ERROR, IMPROV_BAD_NAME);
            return;
        }
        settings_store(console->settings, console->hardware);
        console->host.changed(console->host.self);
    }
    result(console, IMPROV_NAME, texts);
}

void console_rpc(struct console *console, uint64_t now)
{
    size_t size;
    const uint8_t *data = improv_data(console->line, IMPROV_RPC, &size);

    if (data == NULL || size < 2 || data[1] != size - 2) {
        tell(console, IMPROV_ERROR, IMPROV_INVALID);
        return;
    }
    tell(console, IMPROV_ERROR, IMPROV_FINE);
    switch (data[0]) {
    case IMPROV_WIFI:
        provision(console, data + 2, size - 2, now);
        break;
    case IMPROV_GET_STATE:
        tell_state(console);
        if (!console->provisioning
            && console->link->network(console->link->self) == NETWORK_UP)
            result(console, IMPROV_GET_STATE, nothing);
        break;
    case IMPROV_GET_INFO:
        tell_info(console);
        break;
    case IMPROV_SCAN:
        console->scanning = true;
        break;
    case IMPROV_NAME:
        set_name(console, data + 2, size - 2);
        break;
    default:
        tell(console, IMPROV_ERROR, IMPROV_UNKNOWN);
    }
}

/* -- what goes on ---------------------------------------------------------------- */

/* What is in the air under a name that nobody can type, or twice, is left out. */
static bool worth_telling(const struct access_point *found, int i)
{
    const char *ssid = found[i].ssid;

    for (int before = 0; before < i; before++)
        if (strcmp(found[before].ssid, ssid) == 0)
            return false;
    return *ssid != '\0' && utf8_plain((const uint8_t *)ssid, strlen(ssid));
}

static void scan(struct console *console)
{
    const struct link *link = console->link;
    struct access_point found[CONSOLE_FOUND];
    int count = link->scan(link->self, found, CONSOLE_FOUND);

    if (count < 0)
        return;
    console->scanning = false;
    for (int i = 0; i < count && i < CONSOLE_FOUND; i++) {
        char rssi[12] = "";
        const char *const texts[] = {found[i].ssid, rssi,
                                     found[i].open ? "NO" : "YES", NULL};

        found[i].ssid[sizeof found[i].ssid - 1] = '\0';
        if (worth_telling(found, i) && decimal_write(found[i].rssi, rssi, sizeof rssi))
            result(console, IMPROV_SCAN, texts);
    }
    result(console, IMPROV_SCAN, nothing);
}

/* The network is up: what was tried is what is stored. */
static void joined(struct console *console)
{
    console->provisioning = false;
    memset(console->password, 0, sizeof console->password);
    console_say(console, settings_store(console->settings, console->hardware)
                             ? "wifi: joined "
                             : "wifi: joined, but it could not be stored: ");
    console_say(console, console->settings->ssid);
    console_say(console, "\r\n");
    tell_state(console);
    result(console, IMPROV_WIFI, nothing);
}

const char *network_describe(enum network network)
{
    static const char *const sentences[] = {
        "is off", "is tried", "is joined", "is not to be found here",
        "refuses: the password, or the user, is wrong",
        "has another security: a password is missing, or one too many",
    };

    return sentences[network];
}

static void failed(struct console *console, const char *why)
{
    console->provisioning = false;
    console_say(console, "wifi: ");
    console_say(console, console->settings->ssid);
    console_say(console, " ");
    console_say(console, why);
    console_say(console, "\r\n");
    restore(console);
    console->host.changed(console->host.self);
    tell(console, IMPROV_ERROR, IMPROV_NOT_CONNECTED);
    tell_state(console);
}

void console_provision(struct console *console, uint64_t now)
{
    const struct link *link = console->link;
    uint64_t lasts = now - console->since;
    enum network network;

    if (console->scanning)
        scan(console);
    if (!console->provisioning || lasts == 0) /* what is said of before is not asked */
        return;
    network = link->network(link->self);
    if (network == NETWORK_UP)
        joined(console);
    else if (network >= NETWORK_REFUSED
             || (network == NETWORK_NOT_FOUND && lasts > FIND_TIME))
        failed(console, network_describe(network));
    else if (lasts > JOIN_TIME)
        failed(console, "does not let the robot in");
}
