/* SPDX-License-Identifier: Apache-2.0 */
#include "messages.h"

#include <float.h>
#include <string.h>

#include "../console.h"
#include "../woodbot_schemas.h"

enum { MEMBER_BITS = 24, MANY = 100000, PORTS_MOST = 100 };

#define RUNS ((uint64_t)1 << 40)
#define ANY_BADGE UINT64_MAX

uint64_t run_of(uint64_t badge)
{
    return badge >> MEMBER_BITS;
}

static bool is_within(double value, double low, double high)
{
    return low <= value && value <= high; /* false for NaN */
}

/* -- names ----------------------------------------------------------------------- */

static bool is_letter(uint8_t byte)
{
    return (byte >= '0' && byte <= '9') || (byte >= 'A' && byte <= 'Z')
           || (byte >= 'a' && byte <= 'z');
}

bool name_is(struct bytes text)
{
    if (text.size == 0 || text.size >= NAME_SIZE || !is_letter(text.at[0]))
        return false;
    for (size_t i = 1; i < text.size; i++) {
        if (!is_letter(text.at[i]) && (text.at[i] == 0 || !strchr("_.-", text.at[i])))
            return false;
    }
    return true;
}

bool source_is(struct bytes text)
{
    size_t chunks = 0;
    bool more = true;

    if (text.size >= SOURCE_SIZE)
        return false;
    while (more) {
        struct bytes chunk = {text.at, 0};
        while (chunk.size < text.size && chunk.at[chunk.size] != '/')
            chunk.size++;
        more = chunk.size < text.size;
        text.at += chunk.size + more;
        text.size -= chunk.size + more;
        if (!name_is(chunk))
            return false;
        chunks++;
    }
    return chunks == 2 || chunks == 3;
}

static void copy(char *room, struct bytes text)
{
    if (text.size > 0)
        memcpy(room, text.at, text.size);
    room[text.size] = '\0';
}

/* -- reading --------------------------------------------------------------------- */

bool beat_read(struct bytes message, struct beat *beat)
{
    struct wire_reader in = wire_read(message);
    struct beat found;

    if (wire_read_list(&in, 7) != 7)
        return false;
    found.run = wire_read_whole(&in, 1, RUNS - 1);
    found.n = wire_read_whole(&in, 1, WIRE_LAST_TICK);
    found.t = wire_read_real(&in);
    found.dt = wire_read_real(&in);
    found.pace = wire_read_real(&in);
    found.epoch = wire_read_whole(&in, 0, WIRE_LAST_TICK);
    found.stops = wire_read_whole(&in, 0, WIRE_LAST_TICK);
    if (!wire_ended(&in) || !is_within(found.t, DBL_MIN, 1e18)
        || !is_within(found.dt, DBL_MIN, 1e9) || !is_within(found.pace, 0, 1e6))
        return false;
    *beat = found;
    return true;
}

bool stop_read(struct bytes message)
{
    struct bytes stop = stop_write();

    return message.size == stop.size && message.at[0] == stop.at[0];
}

bool stamp_read(struct bytes message, struct stamp *stamp)
{
    struct wire_reader in = wire_read(message);
    size_t words = wire_read_list(&in, 4);
    struct stamp found = {0, 0, 0, 0};

    if (words < 2)
        return false;
    found.n = found.said = wire_read_whole(&in, 0, WIRE_LAST_TICK);
    found.t = wire_read_real(&in);
    if (words > 2)
        found.badge = wire_read_whole(&in, 0, ANY_BADGE);
    if (words > 3)
        found.said = wire_read_whole(&in, 0, found.n);
    if (!wire_ended(&in) || !is_within(found.t, -DBL_MAX, DBL_MAX))
        return false;
    *stamp = found;
    return true;
}

bool admission_read(struct bytes message, struct admission *admission)
{
    struct wire_reader in = wire_read(message);
    struct admission found = {0, 0, 0, 0, 0};
    unsigned seen = 0;

    if (wire_read_map(&in, 5) != 5)
        return false;
    for (int i = 0; i < 5 && !in.wrong; i++) {
        struct bytes key = wire_read_text(&in, 16);

        if (wire_is(key, "badge")) {
            found.badge = wire_read_whole(&in, 1, ANY_BADGE);
            seen |= 1;
        } else if (wire_is(key, "first")) {
            found.first = wire_read_whole(&in, 1, WIRE_LAST_TICK);
            seen |= 2;
        } else if (wire_is(key, "dt")) {
            found.dt = wire_read_real(&in);
            seen |= 4;
        } else if (wire_is(key, "stops")) {
            found.stops = wire_read_whole(&in, 0, WIRE_LAST_TICK);
            seen |= 8;
        } else if (wire_is(key, "patience")) {
            found.patience = wire_read_real(&in);
            seen |= 16;
        } else {
            return false;
        }
    }
    if (!wire_ended(&in) || seen != 31 || !is_within(found.dt, 1e-9, 1e9)
        || !is_within(found.patience, 0, 1e9))
        return false;
    *admission = found;
    return true;
}

bool age_read(struct bytes message, struct age *age)
{
    struct wire_reader in = wire_read(message);
    struct age found;

    if (wire_read_list(&in, 3) != 3)
        return false;
    found.run = wire_read_whole(&in, 1, RUNS);
    found.seconds = wire_read_real(&in);
    found.stops = wire_read_whole(&in, 0, WIRE_LAST_TICK);
    if (!wire_ended(&in) || !(found.seconds >= 0))
        return false;
    *age = found;
    return true;
}

/* The sources of a loan: that of the command counts, a robot has no other In. */
static bool sources_read(struct wire_reader *in, struct loan *loan)
{
    size_t count = wire_read_map(in, PORTS_MOST);

    while (count-- > 0 && !in->wrong) {
        struct bytes port = wire_read_text(in, NAME_SIZE - 1);
        struct bytes source = wire_read_text(in, SOURCE_SIZE - 1);

        if (!name_is(port) || !source_is(source))
            return false;
        if (wire_is(port, "command"))
            copy(loan->source, source);
    }
    return true;
}

bool loan_read(struct bytes message, struct loan *loan)
{
    struct wire_reader in = wire_read(message);
    struct loan found = {"", ""};
    unsigned seen = 0;

    if (wire_read_map(&in, 2) != 2)
        return false;
    for (int i = 0; i < 2 && !in.wrong; i++) {
        struct bytes key = wire_read_text(&in, 16);

        if (wire_is(key, "fabric")) {
            struct bytes fabric = wire_read_text(&in, NAME_SIZE - 1);
            if (fabric.size > 0 && !name_is(fabric))
                return false;
            copy(found.fabric, fabric);
            seen |= 1;
        } else if (wire_is(key, "sources")) {
            if (!sources_read(&in, &found))
                return false;
            seen |= 2;
        }
    }
    if (!wire_ended(&in) || seen != 3)
        return false;
    *loan = found;
    return true;
}

/* Whether the entry that begins here carries the badge. */
static bool entry_is(struct wire_reader *in, uint64_t badge)
{
    size_t count = wire_read_map(in, 16);
    bool found = false;

    while (count-- > 0 && !in->wrong) {
        if (wire_is(wire_read_text(in, 16), "badge"))
            found = wire_read_whole(in, 0, ANY_BADGE) == badge;
        else
            wire_skip(in);
    }
    return found;
}

bool roster_read(struct bytes message, uint64_t badge, struct mention *mention)
{
    struct wire_reader in = wire_read(message);
    struct mention found = {0, 0, 0, false};
    size_t count = wire_read_map(&in, 6);
    bool agents = false;

    if (count != 6)
        return false;
    while (count-- > 0 && !in.wrong) {
        struct bytes key = wire_read_text(&in, 16);

        if (wire_is(key, "run")) {
            found.run = wire_read_whole(&in, 1, RUNS);
        } else if (wire_is(key, "epoch")) {
            found.epoch = wire_read_whole(&in, 0, WIRE_LAST_TICK);
        } else if (wire_is(key, "first")) {
            found.first = wire_read_whole(&in, 1, WIRE_LAST_TICK);
        } else if (wire_is(key, "agents")) {
            size_t entries = wire_read_list(&in, MANY);
            agents = true;
            while (entries-- > 0 && !in.wrong)
                found.named |= entry_is(&in, badge);
        } else {
            wire_skip(&in);
        }
    }
    if (!wire_ended(&in) || !agents || found.run == 0)
        return false;
    *mention = found;
    return true;
}

bool newest_read(struct bytes message, uint64_t *n, double *pace)
{
    struct wire_reader in = wire_read(message);
    size_t count = wire_read_map(&in, 16);
    unsigned seen = 0;

    while (count-- > 0 && !in.wrong) {
        struct bytes key = wire_read_text(&in, 16);

        if (wire_is(key, "n")) {
            *n = wire_read_whole(&in, 0, WIRE_LAST_TICK);
            seen |= 1;
        } else if (wire_is(key, "pace")) {
            *pace = wire_read_real(&in);
            seen |= 2;
        } else {
            wire_skip(&in);
        }
    }
    return wire_ended(&in) && seen == 3 && is_within(*pace, 0, 1e6);
}

bool call_read(struct bytes message)
{
    struct wire_reader in = wire_read(message);
    size_t count;

    if (message.size == 0)
        return true;
    count = wire_read_map(&in, 2);
    while (count-- > 0 && !in.wrong) {
        if (wire_is(wire_read_text(&in, 16), "args"))
            wire_read_list(&in, 0);
        else
            wire_read_map(&in, 0);
    }
    return wire_ended(&in);
}

/* -- writing --------------------------------------------------------------------- */

struct bytes stop_write(void)
{
    static const uint8_t yes = 0xC3;
    struct bytes made = {&yes, 1};

    return made;
}

struct bytes stamp_write(uint8_t room[STAMP_SIZE], const struct stamp *stamp)
{
    struct wire_writer out = wire_write(room, STAMP_SIZE);

    wire_put_list(&out, stamp->said == stamp->n ? 3 : 4);
    wire_put_whole(&out, stamp->n);
    wire_put_real(&out, stamp->t);
    wire_put_whole(&out, stamp->badge);
    if (stamp->said != stamp->n)
        wire_put_whole(&out, stamp->said);
    return wire_written(&out);
}

struct bytes done_write(uint8_t room[STAMP_SIZE], uint64_t badge, uint64_t n)
{
    struct wire_writer out = wire_write(room, STAMP_SIZE);

    wire_put_list(&out, 2);
    wire_put_whole(&out, badge);
    wire_put_whole(&out, n);
    return wire_written(&out);
}

struct bytes lent_write(uint8_t *room, size_t size, uint64_t badge, const char *fabric)
{
    struct wire_writer out = wire_write(room, size);

    wire_put_list(&out, 2);
    wire_put_whole(&out, badge);
    wire_put_text(&out, fabric);
    return wire_written(&out);
}

static struct bytes description(const struct codec_schema *schema)
{
    struct bytes found = {schema->description, schema->description_size};

    return found;
}

static void put_entry(struct wire_writer *out, const struct request *request)
{
    bool reads = request->source[0] != '\0';

    wire_put_map(out, 8);
    wire_put_text(out, "key");
    wire_put_text(out, request->agent);
    wire_put_text(out, "host");
    wire_put_text(out, request->agent);
    wire_put_text(out, "outs");
    wire_put_map(out, WOODBOT_PORTS);
    for (size_t i = 0; i < WOODBOT_PORTS; i++) {
        wire_put_text(out, woodbot_schemas[i]->port);
        wire_put_text(out, woodbot_schemas[i]->digest);
    }
    wire_put_text(out, "reads");
    wire_put_list(out, reads);
    if (reads)
        wire_put_text(out, request->source);
    wire_put_text(out, "every");
    wire_put_whole(out, 1);
    wire_put_text(out, "lockstep");
    wire_put_flag(out, false);
    wire_put_text(out, "since");
    wire_put_whole(out, 1);
    wire_put_text(out, "badge");
    wire_put_whole(out, 0);
}

struct bytes request_write(uint8_t *room, size_t size, const struct request *request)
{
    struct wire_writer out = wire_write(room, size);

    wire_put_map(&out, 9);
    wire_put_text(&out, "host");
    wire_put_text(&out, request->agent);
    wire_put_text(&out, "machine");
    wire_put_text(&out, strchr(request->agent, '/') + 1);
    wire_put_text(&out, "pid");
    wire_put_whole(&out, request->identity);
    wire_put_text(&out, "closing");
    wire_put_text(&out, "");
    wire_put_text(&out, "agents");
    wire_put_list(&out, 1);
    put_entry(&out, request);
    wire_put_text(&out, "schemas");
    wire_put_map(&out, WOODBOT_PORTS);
    for (size_t i = 0; i < WOODBOT_PORTS; i++) {
        wire_put_text(&out, woodbot_schemas[i]->digest);
        wire_put_bytes(&out, description(woodbot_schemas[i]));
    }
    wire_put_text(&out, "stopped");
    wire_put_flag(&out, request->stopped);
    wire_put_text(&out, "ticket");
    wire_put_whole(&out, 0);
    wire_put_text(&out, "numerics");
    wire_put_text(&out, "Woodbot " WOODBOT_VERSION " on " WOODBOT_CHIP);
    return wire_written(&out);
}

struct bytes schemas_write(uint8_t *room, size_t size)
{
    struct wire_writer out = wire_write(room, size);

    wire_put_map(&out, WOODBOT_PORTS);
    for (size_t i = 0; i < WOODBOT_PORTS; i++) {
        wire_put_text(&out, woodbot_schemas[i]->port);
        wire_put_bytes(&out, description(woodbot_schemas[i]));
    }
    return wire_written(&out);
}

struct bytes farewell_write(uint8_t *room, size_t size, uint64_t badge,
                            const char *agent, const char *cause)
{
    struct wire_writer out = wire_write(room, size);

    wire_put_map(&out, 3);
    wire_put_text(&out, "badge");
    wire_put_whole(&out, badge);
    wire_put_text(&out, "made");
    wire_put_list(&out, 0);
    wire_put_text(&out, "failed");
    if (cause[0] == '\0') {
        wire_put_nothing(&out);
    } else {
        wire_put_list(&out, 2);
        wire_put_text(&out, agent);
        wire_put_text(&out, cause);
    }
    return wire_written(&out);
}
