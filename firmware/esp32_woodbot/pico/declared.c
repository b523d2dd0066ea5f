/* Declarations: what is told of at a key, and what comes there.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#include <string.h>

#include "link_pico.h"

bool pico_copy(const z_loaned_bytes_t *from, uint8_t *to, size_t room,
               struct bytes *bytes)
{
    z_bytes_reader_t reader;

    bytes->at = to;
    bytes->size = from == NULL ? 0 : z_bytes_len(from);
    if (bytes->size > room)
        return false;
    if (bytes->size == 0)
        return true;
    reader = z_bytes_get_reader(from);
    return z_bytes_reader_read(&reader, to, bytes->size) == bytes->size;
}

static bool copy_text(const char *from, size_t size, char *text, size_t room)
{
    if (size >= room)
        return false;
    if (size > 0)
        memcpy(text, from, size);
    text[size] = '\0';
    return true;
}

bool pico_text(const z_loaned_keyexpr_t *key, char *text, size_t room)
{
    z_view_string_t view;

    z_keyexpr_as_view_string(key, &view);
    return copy_text(z_string_data(z_view_string_loan(&view)),
                     z_string_len(z_view_string_loan(&view)), text, room);
}

/* One that Zenoh has no number for is "custom" to everybody else; zenoh-pico sends it
 * as `zenoh/bytes;...`, and reads such a one as `;...`. */
bool pico_encoding(z_owned_encoding_t *encoding, const char *text)
{
    if (text[0] == '\0' || z_encoding_from_str(encoding, text) < 0)
        return false;
    if (encoding->_val.id == 0 && strncmp(text, "zenoh/bytes", 11) != 0)
        encoding->_val.id = UINT16_MAX;
    return true;
}

static bool read_encoding(const z_loaned_encoding_t *encoding, char *text, size_t room)
{
    z_owned_string_t copy;
    const char *start;
    size_t size;
    bool fits;

    if (z_encoding_to_string(encoding, &copy) < 0)
        return false;
    start = z_string_data(z_string_loan(&copy));
    size = z_string_len(z_string_loan(&copy));
    if (size > 0 && start[0] == ';') {
        start++;
        size--;
    }
    fits = copy_text(start, size, text, room);
    z_string_drop(z_string_move(&copy));
    return fits;
}

static void heard(z_loaned_sample_t *sample, void *context)
{
    struct link_pico *pico = context;
    struct bytes payload, attachment;

    if (pico->close_later || z_sample_kind(sample) != Z_SAMPLE_KIND_PUT
        || !pico_text(z_sample_keyexpr(sample), pico->key, sizeof pico->key)
        || !pico_copy(z_sample_payload(sample), pico->payload, sizeof pico->payload,
                      &payload)
        || !pico_copy(z_sample_attachment(sample), pico->attachment,
                      sizeof pico->attachment, &attachment)
        || !read_encoding(z_sample_encoding(sample), pico->text, sizeof pico->text))
        return;
    woodbot_heard(pico->bot, pico->key, payload, pico->text, attachment);
}

static void asked(z_loaned_query_t *query, void *context)
{
    struct link_pico *pico = context;
    struct bytes payload;
    z_view_string_t parameters;

    z_query_parameters(query, &parameters);
    if (pico->close_later
        || !pico_text(z_query_keyexpr(query), pico->key, sizeof pico->key)
        || !copy_text(z_string_data(z_view_string_loan(&parameters)),
                      z_string_len(z_view_string_loan(&parameters)), pico->text,
                      sizeof pico->text)
        || !pico_copy(z_query_payload(query), pico->payload, sizeof pico->payload,
                      &payload))
        return;
    woodbot_asked(pico->bot, query, pico->key, pico->text, payload);
}

/* A free place for this key; NULL if it can't be declared. */
static struct declared *place(struct link_pico *pico, const char *key,
                              z_view_keyexpr_t *at)
{
    if (!pico->open || pico->close_later || z_view_keyexpr_from_str(at, key) < 0)
        return NULL;
    for (size_t i = 0; i < PICO_DECLARED; i++)
        if (pico->declared[i].kind == DECLARED_NOT
            && copy_text(key, strlen(key), pico->declared[i].key, LINK_KEY))
            return &pico->declared[i];
    return NULL;
}

bool pico_subscribe(void *self, const char *key)
{
    struct link_pico *pico = self;
    z_view_keyexpr_t at;
    z_owned_closure_sample_t told;
    struct declared *one = place(pico, key, &at);

    if (one == NULL)
        return false;
    z_closure_sample(&told, heard, NULL, pico);
    if (z_declare_subscriber(z_session_loan(&pico->session), &one->as.subscriber,
                             z_view_keyexpr_loan(&at), z_closure_sample_move(&told),
                             NULL) < 0)
        return false;
    one->kind = DECLARED_SUBSCRIBER;
    return true;
}

bool pico_answer(void *self, const char *key)
{
    struct link_pico *pico = self;
    z_view_keyexpr_t at;
    z_owned_closure_query_t told;
    struct declared *one = place(pico, key, &at);

    if (one == NULL)
        return false;
    z_closure_query(&told, asked, NULL, pico);
    if (z_declare_queryable(z_session_loan(&pico->session), &one->as.queryable,
                            z_view_keyexpr_loan(&at), z_closure_query_move(&told),
                            NULL) < 0)
        return false;
    one->kind = DECLARED_QUERYABLE;
    return true;
}

bool pico_token(void *self, const char *key)
{
    struct link_pico *pico = self;
    z_view_keyexpr_t at;
    struct declared *one = place(pico, key, &at);

    if (one == NULL
        || z_liveliness_declare_token(z_session_loan(&pico->session), &one->as.token,
                                      z_view_keyexpr_loan(&at), NULL) < 0)
        return false;
    one->kind = DECLARED_TOKEN;
    return true;
}

static void forget(struct declared *one)
{
    switch (one->kind) {
    case DECLARED_SUBSCRIBER:
        z_undeclare_subscriber(z_subscriber_move(&one->as.subscriber));
        break;
    case DECLARED_QUERYABLE:
        z_undeclare_queryable(z_queryable_move(&one->as.queryable));
        break;
    case DECLARED_TOKEN:
        z_liveliness_undeclare_token(z_liveliness_token_move(&one->as.token));
        break;
    case DECLARED_NOT:
        break;
    }
    one->kind = DECLARED_NOT;
}

void pico_forget(void *self, const char *key)
{
    struct link_pico *pico = self;

    for (size_t i = 0; i < PICO_DECLARED; i++)
        if (strcmp(pico->declared[i].key, key) == 0)
            forget(&pico->declared[i]);
}

void pico_forget_all(struct link_pico *pico)
{
    for (size_t i = 0; i < PICO_DECLARED; i++)
        forget(&pico->declared[i]);
}
