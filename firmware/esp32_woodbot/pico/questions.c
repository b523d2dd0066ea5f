/* Questions: ours with their answers, and the answers to those of others.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#include <string.h>

#include "bounds.h"
#include "link_pico.h"

static void answered(z_loaned_reply_t *reply, void *context)
{
    struct asked *asked = context;
    struct link_pico *pico = asked->pico;
    struct bytes payload, attachment = {NULL, 0};
    const bool good = z_reply_is_ok(reply);
    const z_loaned_bytes_t *said = good ? z_sample_payload(z_reply_ok(reply))
                                        : z_reply_err_payload(z_reply_err(reply));

    if (pico->close_later || asked->id == 0
        || !pico_copy(said, pico->payload, sizeof pico->payload, &payload))
        return;
    if (good && !pico_copy(z_sample_attachment(z_reply_ok(reply)), pico->attachment,
                           sizeof pico->attachment, &attachment))
        return;
    woodbot_answered(pico->bot, asked->id, !good, payload, attachment);
}

static void over(void *context)
{
    struct asked *asked = context;

    asked->id = 0;
}

bool pico_ask(void *self, const char *selector, struct bytes payload, uint32_t id,
              uint32_t timeout)
{
    struct link_pico *pico = self;
    char key[LINK_KEY];
    const char *mark = strchr(selector, '?');
    const size_t size = mark == NULL ? strlen(selector) : (size_t)(mark - selector);
    z_view_keyexpr_t at;
    z_get_options_t options;
    z_owned_bytes_t bytes;
    z_owned_closure_reply_t told;
    struct asked *asked = NULL;

    for (size_t i = 0; i < PICO_ASKED && asked == NULL; i++)
        if (pico->asked[i].id == 0)
            asked = &pico->asked[i];
    if (!pico->open || pico->close_later || asked == NULL || size >= sizeof key)
        return false;
    memcpy(key, selector, size);
    key[size] = '\0';
    if (z_view_keyexpr_from_str(&at, key) < 0)
        return false;
    asked->pico = pico;
    asked->id = id;
    z_get_options_default(&options);
    options.timeout_ms = timeout;
    options.consolidation = z_query_consolidation_none();
    if (payload.size > 0) {
        z_bytes_copy_from_buf(&bytes, payload.at, payload.size);
        options.payload = z_bytes_move(&bytes);
    }
    z_closure_reply(&told, answered, over, asked);
    if (z_get(z_session_loan(&pico->session), z_view_keyexpr_loan(&at),
              mark == NULL ? "" : mark + 1, z_closure_reply_move(&told), &options) < 0)
        asked->id = 0;
    return asked->id != 0;
}

bool pico_reply(void *self, void *question, const char *key, struct bytes payload,
                const char *encoding, struct bytes attachment)
{
    z_view_keyexpr_t at;
    z_owned_bytes_t bytes, stamp;
    z_owned_encoding_t kind;
    z_query_reply_options_t options;

    (void)self;
    if (bounds_ended() || z_view_keyexpr_from_str(&at, key) < 0)
        return false;
    z_query_reply_options_default(&options);
    if (pico_encoding(&kind, encoding))
        options.encoding = z_encoding_move(&kind);
    if (attachment.size > 0
        && z_bytes_copy_from_buf(&stamp, attachment.at, attachment.size) == 0)
        options.attachment = z_bytes_move(&stamp);
    z_bytes_copy_from_buf(&bytes, payload.at, payload.size);
    return z_query_reply(question, z_view_keyexpr_loan(&at), z_bytes_move(&bytes),
                         &options) >= 0;
}

bool pico_refuse(void *self, void *question, const char *sentence)
{
    z_owned_bytes_t bytes;

    (void)self;
    if (bounds_ended() || z_bytes_copy_from_str(&bytes, sentence) < 0)
        return false;
    return z_query_reply_err(question, z_bytes_move(&bytes), NULL) >= 0;
}
