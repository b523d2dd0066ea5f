/* The link seam over zenoh-pico: shared by the ESP32 and by a process on a computer.
 *
 * What differs between them, Wi-Fi and names, is a `struct pico_port`. All bounds of
 * link.h hold if the port links `connect` and `recv` to those of bounds.h.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef WOODBOT_LINK_PICO_H
#define WOODBOT_LINK_PICO_H

#include <zenoh-pico.h>

#include "link.h"
#include "woodbot.h"

#if Z_FEATURE_MULTI_THREAD || Z_FEATURE_AUTO_RECONNECT
#error "zenoh-pico has to be built with -DZ_FEATURE_MULTI_THREAD=0 and \
-DZ_FEATURE_AUTO_RECONNECT=0: its own threads and reconnection stall, or give up."
#endif

enum {
    PICO_DECLARED = 32, /* keys at a time */
    PICO_ASKED = 8,     /* questions at a time */
    PICO_FOUND = 4,     /* routers' addresses that a search brings */
    PICO_SEARCH = 500,  /* ms of a search */
    PICO_ADDRESS = 64
};

/* What the link asks of the port; `join`, `network` and `scan` are those of link.h. */
struct pico_port {
    void *self;
    void (*join)(void *self, const struct network_settings *settings);
    enum network (*network)(void *self);
    int (*scan)(void *self, struct access_point *found, size_t room);
    /* The numeric address of a host's name, without waiting; false: not known (yet). */
    bool (*resolve)(void *self, const char *host, char *address, size_t room);
    /* What to open for LINK_CABLE: the address at which the port takes the session, and
     * carries it over its serial line (cable/cable.h); NULL if it can't. */
    const char *(*cable)(void *self);
};

enum declared_kind { DECLARED_NOT, DECLARED_SUBSCRIBER, DECLARED_QUERYABLE,
                     DECLARED_TOKEN };

struct declared {
    enum declared_kind kind;
    char key[LINK_KEY];
    union {
        z_owned_subscriber_t subscriber;
        z_owned_queryable_t queryable;
        z_owned_liveliness_token_t token;
    } as;
};

struct link_pico;

/* A question of ours that may still be answered. */
struct asked {
    struct link_pico *pico;
    uint32_t id;            /* 0: none */
};

struct link_pico {
    struct woodbot *bot;
    struct pico_port port;
    z_owned_session_t session;
    bool open, inside, close_later;
    struct declared declared[PICO_DECLARED];
    struct asked asked[PICO_ASKED];
    char found[PICO_FOUND][PICO_ADDRESS];
    size_t found_count, found_next;
    uint8_t payload[LINK_PAYLOAD], attachment[64]; /* of what is being told */
    char key[LINK_KEY], text[LINK_KEY];
};

/* Fill in the seam; `pico` lives as long as it is used. */
struct link link_pico(struct link_pico *pico, struct woodbot *bot,
                      const struct pico_port *port);

/* For its own files. */
bool pico_subscribe(void *self, const char *key);
bool pico_answer(void *self, const char *key);
bool pico_token(void *self, const char *key);
void pico_forget(void *self, const char *key);
void pico_forget_all(struct link_pico *pico);
bool pico_ask(void *self, const char *selector, struct bytes payload, uint32_t id,
              uint32_t timeout);
bool pico_reply(void *self, void *question, const char *key, struct bytes payload,
                const char *encoding, struct bytes attachment);
bool pico_refuse(void *self, void *question, const char *sentence);
/* The next address of a router that is found by multicast. */
bool pico_search(struct link_pico *pico, char *locator, size_t room);
/* A copy of what zenoh-pico holds; false if it has no room. */
bool pico_copy(const z_loaned_bytes_t *from, uint8_t *to, size_t room,
               struct bytes *bytes);
bool pico_encoding(z_owned_encoding_t *encoding, const char *text);
bool pico_text(const z_loaned_keyexpr_t *key, char *text, size_t room);

#endif
