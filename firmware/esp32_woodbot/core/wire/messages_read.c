/* SPDX-License-Identifier: Apache-2.0 */
#include "messages.h"

#include <float.h>
#include <string.h>

enum { MEMBER_BITS = 24, FIELDS = 16 };

#define RUNS ((uint64_t)1 << 40)
#define ANY_BADGE UINT64_MAX

uint64_t run_of(uint64_t badge)
{
    return badge >> MEMBER_BITS;
}

/* A pace, if it is not 0: as fast as the slowest host. */
static const double SLOWEST = 0.001, FASTEST = 1e4;

static bool is_within(double value, double low, double high)
{
    return low <= value && value <= high; /* false for NaN */
}

/* -- maps ------------------------------------------------------------------------ */

/* Which of these words is the key that comes next; COUNT of them for another. One that
 * comes twice is wrong. */
static size_t key_in(struct wire_reader *in, const char *const *words, size_t count,
                     unsigned *seen)
{
    struct bytes key = wire_read_text(in, FIELDS);
    size_t i = 0;

    while (i < count && !wire_is(key, words[i]))
        i++;
    if (i < count && *seen >> i & 1u)
        in->wrong = true;
    *seen |= 1u << i;
    return i;
}

#define COUNT(table) (sizeof(table) / sizeof((table)[0]))
#define ALL(table) ((1u << COUNT(table)) - 1)

/* -- lists ----------------------------------------------------------------------- */

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
        || !is_within(found.dt, DBL_MIN, 1e9)
        || !(is_within(found.pace, 0, 0) || is_within(found.pace, SLOWEST, FASTEST)))
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

bool claim_read(struct bytes message, struct claim *claim)
{
    struct wire_reader in = wire_read(message);
    struct claim found = {0, ""};
    struct bytes holder;

    if (wire_read_list(&in, 2) != 2)
        return false;
    found.badge = wire_read_whole(&in, 1, ANY_BADGE);
    holder = wire_read_text(&in, HOLDER_SIZE - 1);
    if (!wire_ended(&in))
        return false;
    for (size_t i = 0; i < holder.size; i++) {
        if (holder.at[i] < ' ' || holder.at[i] > '~')
            return false;
        found.holder[i] = (char)holder.at[i];
    }
    *claim = found;
    return true;
}

/* -- the others ------------------------------------------------------------------ */

bool admission_read(struct bytes message, struct admission *admission)
{
    static const char *const words[] = {"badge", "first", "stops", "dt", "patience"};
    struct wire_reader in = wire_read(message);
    struct admission found = {0, 0, 0, 0, 0};
    unsigned seen = 0;

    for (size_t left = wire_read_map(&in, COUNT(words)); left > 0 && !in.wrong; left--) {
        switch (key_in(&in, words, COUNT(words), &seen)) {
        case 0: found.badge = wire_read_whole(&in, 1, ANY_BADGE); break;
        case 1: found.first = wire_read_whole(&in, 1, WIRE_LAST_TICK); break;
        case 2: found.stops = wire_read_whole(&in, 0, WIRE_LAST_TICK); break;
        case 3: found.dt = wire_read_real(&in); break;
        case 4: found.patience = wire_read_real(&in); break;
        }
    }
    if (!wire_ended(&in) || seen != ALL(words) || !is_within(found.dt, 1e-9, 1e9)
        || !is_within(found.patience, 0, 1e9))
        return false;
    *admission = found;
    return true;
}

bool newest_read(struct bytes message, uint64_t *n)
{
    static const char *const words[] = {"n"};
    struct wire_reader in = wire_read(message);
    unsigned seen = 0;

    for (size_t left = wire_read_map(&in, FIELDS); left > 0 && !in.wrong; left--) {
        if (key_in(&in, words, COUNT(words), &seen) == 0)
            *n = wire_read_whole(&in, 0, WIRE_LAST_TICK);
        else
            wire_skip(&in);
    }
    return wire_ended(&in) && (seen & ALL(words)) == ALL(words);
}

bool call_read(struct bytes message)
{
    static const char *const words[] = {"args", "kwargs"};
    struct wire_reader in = wire_read(message);
    unsigned seen = 0;

    if (message.size == 0)
        return true;
    for (size_t left = wire_read_map(&in, COUNT(words)); left > 0 && !in.wrong; left--) {
        switch (key_in(&in, words, COUNT(words), &seen)) {
        case 0: wire_read_list(&in, 0); break;
        case 1: wire_read_map(&in, 0); break;
        default: in.wrong = true;
        }
    }
    return wire_ended(&in);
}
