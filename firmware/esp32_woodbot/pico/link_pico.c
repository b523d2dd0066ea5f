/* SPDX-License-Identifier: Apache-2.0 */
#include "link_pico.h"

#include <string.h>
#include <sys/poll.h>

#include "bounds.h"

enum { BATCH = 64 /* messages that one `poll` takes, so that a flood ends */ };

/* -- open and close -------------------------------------------------------------- */

/* `tcp/room1:7447` with the address instead of the name. */
static bool resolve(struct link_pico *pico, const char *locator, char *numeric,
                    size_t room)
{
    char host[PICO_ADDRESS], address[PICO_ADDRESS];
    const char *start = strchr(locator, '/'), *colon = strrchr(locator, ':');
    size_t scheme, name, had, port;

    if (start == NULL || colon == NULL || colon <= ++start)
        return false;
    scheme = (size_t)(start - locator);
    name = (size_t)(colon - start);
    if (name >= sizeof host)
        return false;
    memcpy(host, start, name);
    host[name] = '\0';
    if (strspn(host, "0123456789.") == name || host[0] == '[')
        memcpy(address, host, name + 1);
    else if (!pico->port.resolve(pico->port.self, host, address, sizeof address))
        return false;
    had = strlen(address);
    port = strlen(colon) + 1;
    if (scheme + had + port > room)
        return false;
    memcpy(numeric, locator, scheme);
    memcpy(numeric + scheme, address, had);
    memcpy(numeric + scheme + had, colon, port);
    return true;
}

static bool open_session(void *self, const char *locator)
{
    struct link_pico *pico = self;
    char found[PICO_ADDRESS], numeric[PICO_ADDRESS];
    z_owned_config_t config;

    if (pico->open)
        return false;
    if (locator[0] == '\0') {
        if (!pico_search(pico, found, sizeof found))
            return false;
        locator = found;
    }
    if (strcmp(locator, LINK_CABLE) == 0)
        locator = pico->port.cable(pico->port.self);
    if (locator == NULL || !resolve(pico, locator, numeric, sizeof numeric)
        || z_config_default(&config) < 0)
        return false;
    zp_config_insert(z_config_loan_mut(&config), Z_CONFIG_MODE_KEY, "client");
    zp_config_insert(z_config_loan_mut(&config), Z_CONFIG_CONNECT_KEY, numeric);
    bounds_opening();
    pico->open = z_open(&pico->session, z_config_move(&config), NULL) == 0;
    bounds_opened();
    return pico->open;
}

static void count(const z_id_t *id, void *context)
{
    (void)id;
    ++*(unsigned *)context;
}

/* Whether it has its router, and so its socket. */
static bool has_router(const struct link_pico *pico)
{
    unsigned routers = 0;
    z_owned_closure_zid_t counter;

    z_closure_zid(&counter, count, NULL, &routers);
    z_info_routers_zid(z_session_loan(&pico->session), z_closure_zid_move(&counter));
    return routers > 0;
}

static void close_session(void *self)
{
    struct link_pico *pico = self;

    /* Inside of a callback the session is still in use. */
    pico->close_later = pico->inside;
    if (!pico->open || pico->inside)
        return;
    pico->open = false;
    bounds_cut(has_router(pico));
    pico_forget_all(pico);
    z_close(z_session_loan_mut(&pico->session), NULL);
    z_session_drop(z_session_move(&pico->session));
}

static bool up(void *self)
{
    struct link_pico *pico = self;

    return pico->open && !pico->close_later && !bounds_ended() && has_router(pico);
}

/* -- what goes, and what comes --------------------------------------------------- */

static bool put(void *self, const char *key, struct bytes payload, const char *encoding,
                struct bytes attachment, bool urgent)
{
    struct link_pico *pico = self;
    z_view_keyexpr_t at;
    z_owned_bytes_t bytes, stamp;
    z_owned_encoding_t kind;
    z_put_options_t options;

    if (!up(pico))
        return false;
    if (!urgent && !bounds_room())
        return true; /* dropped: something newer comes soon */
    if (z_view_keyexpr_from_str(&at, key) < 0)
        return false;
    z_put_options_default(&options);
    if (urgent) {
        options.congestion_control = Z_CONGESTION_CONTROL_BLOCK;
        options.priority = Z_PRIORITY_INTERACTIVE_HIGH;
    } else {
        options.congestion_control = Z_CONGESTION_CONTROL_DROP;
    }
    if (pico_encoding(&kind, encoding))
        options.encoding = z_encoding_move(&kind);
    if (attachment.size > 0
        && z_bytes_copy_from_buf(&stamp, attachment.at, attachment.size) == 0)
        options.attachment = z_bytes_move(&stamp);
    z_bytes_copy_from_buf(&bytes, payload.at, payload.size);
    return z_put(z_session_loan(&pico->session), z_view_keyexpr_loan(&at),
                 z_bytes_move(&bytes), &options) >= 0;
}

static void take(void *self, uint32_t ms)
{
    struct link_pico *pico = self;
    struct pollfd nobody = {-1, 0, 0};

    if (!up(pico)) {
        poll(&nobody, 1, (int)ms); /* the ESP32's takes no empty list */
        return;
    }
    bounds_wait(ms);
    pico->inside = true;
    bounds_dry();
    for (int i = 0; i < BATCH && !pico->close_later && !bounds_ended(); i++) {
        zp_spin_once(z_session_loan(&pico->session));
        if (bounds_dry())
            break;
    }
    pico->inside = false;
    if (pico->close_later)
        close_session(pico);
}

/* -- the port's own -------------------------------------------------------------- */

static void join(void *self, const struct network_settings *settings)
{
    struct link_pico *pico = self;

    pico->port.join(pico->port.self, settings);
}

static enum network network(void *self)
{
    struct link_pico *pico = self;

    return pico->port.network(pico->port.self);
}

static int scan(void *self, struct access_point *found, size_t room)
{
    struct link_pico *pico = self;

    return pico->port.scan(pico->port.self, found, room);
}

struct link link_pico(struct link_pico *pico, struct woodbot *bot,
                      const struct pico_port *port)
{
    struct link link = {
        .self = pico, .join = join, .network = network, .scan = scan,
        .open = open_session, .close = close_session, .up = up,
        .subscribe = pico_subscribe, .answer = pico_answer, .token = pico_token,
        .forget = pico_forget, .put = put, .ask = pico_ask, .reply = pico_reply,
        .refuse = pico_refuse, .poll = take,
    };

    memset(pico, 0, sizeof *pico);
    pico->bot = bot;
    pico->port = *port;
    return link;
}
