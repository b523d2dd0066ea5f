/* SPDX-License-Identifier: Apache-2.0 */
#include "codec.h"

#include <float.h>
#include <stdbool.h>
#include <string.h>

#if defined __FAST_MATH__ || __FINITE_MATH_ONLY__ + 0
#error "NaN must not compare as in range: compile without -ffast-math"
#endif

/* Floats are copied bit by bit: both types must be those of IEEE 754. */
typedef char double_is_binary64[sizeof(double) == 8 && DBL_MANT_DIG == 53 ? 1 : -1];
typedef char float_is_binary32[sizeof(float) == 4 && FLT_MANT_DIG == 24 ? 1 : -1];

#define COUNT(table) (sizeof(table) / sizeof((table)[0]))

/* -- walking a table -------------------------------------------------------------
 *
 * A group is the fields from `first` to before `last`, whose paths agree in their
 * first `skip` bytes; its keys are the next chunks of those paths.
 */

struct group {
    size_t first, last, skip;
};

static size_t chunk_length(const char *chunk)
{
    return strcspn(chunk, "/");
}

/* The group that the key at `field` opens; its chunk has `length` bytes. */
static struct group inner(const struct codec_schema *schema, struct group outer,
                          size_t field, size_t length)
{
    const char *path = schema->fields[field].path;
    struct group made = {field, field + 1, outer.skip + length + 1};

    while (made.last < outer.last
           && strncmp(schema->fields[made.last].path, path, made.skip) == 0)
        made.last++;
    return made;
}

static bool is_group(const char *chunk)
{
    return chunk[chunk_length(chunk)] == '/';
}

/* The first field after the key at `field`. */
static size_t next_key(const struct codec_schema *schema, struct group group,
                       size_t field)
{
    const char *chunk = schema->fields[field].path + group.skip;

    if (!is_group(chunk))
        return field + 1;
    return inner(schema, group, field, chunk_length(chunk)).last;
}

static bool in_range(const struct codec_field *field, double value)
{
    return field->min <= value && value <= field->max; /* false for NaN */
}

static double load(const struct codec_field *field, const void *value)
{
    double found;

    memcpy(&found, (const char *)value + field->offset, sizeof found);
    return found;
}

static void store(const struct codec_field *field, void *value, double given)
{
    memcpy((char *)value + field->offset, &given, sizeof given);
}

static struct codec_result result(enum codec_status status, const char *path)
{
    struct codec_result made = {status, path};
    return made;
}

/* -- reading --------------------------------------------------------------------- */

enum {
    FIXMAP = 0x80, FIXSTR = 0xA0,
    FLOAT32 = 0xCA, FLOAT64 = 0xCB,
    UINT8 = 0xCC, UINT64 = 0xCF,
    INT8 = 0xD0, INT64 = 0xD3,
    STR8 = 0xD9, STR32 = 0xDB,
    MAP16 = 0xDE, MAP32 = 0xDF,
    NEGATIVE_FIXINT = 0xE0
};

struct reader {
    const struct codec_schema *schema;
    const uint8_t *payload;
    size_t size, at;
    const char *path; /* what a refusal is about */
    uint16_t seen;    /* a bit for each field: CODEC_MAX_FIELDS fit */
    double values[CODEC_MAX_FIELDS];
};

/* Read a big-endian number of `width` bytes. */
static bool read_bytes(struct reader *in, size_t width, uint64_t *found)
{
    uint64_t number = 0;

    if (in->size - in->at < width)
        return false;
    while (width-- > 0)
        number = number << 8 | in->payload[in->at++];
    *found = number;
    return true;
}

static enum codec_status read_map(struct reader *in, uint64_t *count)
{
    uint64_t head;

    if (!read_bytes(in, 1, &head))
        return CODEC_TRUNCATED;
    if ((head & 0xF0) == FIXMAP) {
        *count = head & 0x0F;
        return CODEC_OK;
    }
    if (head != MAP16 && head != MAP32)
        return CODEC_NOT_A_MAP;
    return read_bytes(in, head == MAP16 ? 2 : 4, count) ? CODEC_OK : CODEC_TRUNCATED;
}

static enum codec_status read_key(struct reader *in, const char **key, size_t *length)
{
    uint64_t head, count;

    if (!read_bytes(in, 1, &head))
        return CODEC_TRUNCATED;
    if ((head & 0xE0) == FIXSTR)
        count = head & 0x1F;
    else if (head < STR8 || head > STR32)
        return CODEC_NOT_A_KEY;
    else if (!read_bytes(in, (size_t)1 << (head - STR8), &count))
        return CODEC_TRUNCATED;
    if (in->size - in->at < count)
        return CODEC_TRUNCATED;
    *key = (const char *)in->payload + in->at;
    *length = (size_t)count;
    in->at += *length;
    return CODEC_OK;
}

static double from_float32(uint64_t bits)
{
    uint32_t low = (uint32_t)bits;
    float found;

    memcpy(&found, &low, sizeof found);
    return found;
}

static double from_float64(uint64_t bits)
{
    double found;

    memcpy(&found, &bits, sizeof found);
    return found;
}

/* Two's complement of `width` bytes, without relying on how the compiler casts. */
static double from_signed(uint64_t bits, size_t width)
{
    uint64_t sign = (uint64_t)1 << (8 * width - 1);
    uint64_t below = sign - 1;

    if (bits & sign)
        return -(double)((~bits & below) + 1);
    return (double)bits;
}

static enum codec_status read_number(struct reader *in, double *value)
{
    uint64_t head, bits;
    size_t width;

    if (!read_bytes(in, 1, &head))
        return CODEC_TRUNCATED;
    if (head < FIXMAP || head >= NEGATIVE_FIXINT) {
        *value = from_signed(head, 1);
        return CODEC_OK;
    }
    if (head < FLOAT32 || head > INT64)
        return CODEC_NOT_A_NUMBER;
    if (head < UINT8)
        width = head == FLOAT32 ? 4 : 8;
    else
        width = (size_t)1 << (head - (head <= UINT64 ? UINT8 : INT8));
    if (!read_bytes(in, width, &bits))
        return CODEC_TRUNCATED;
    if (head == FLOAT32)
        *value = from_float32(bits);
    else if (head == FLOAT64)
        *value = from_float64(bits);
    else
        *value = head <= UINT64 ? (double)bits : from_signed(bits, width);
    return CODEC_OK;
}

/* The field where a key of the group begins; `group.last` if it is not one. */
static size_t find_key(const struct codec_schema *schema, struct group group,
                       const char *key, size_t length)
{
    size_t i;

    for (i = group.first; i < group.last; i = next_key(schema, group, i)) {
        const char *chunk = schema->fields[i].path + group.skip;
        if (chunk_length(chunk) == length && memcmp(chunk, key, length) == 0)
            return i;
    }
    return group.last;
}

static enum codec_status read_leaf(struct reader *in, size_t field)
{
    enum codec_status status = read_number(in, &in->values[field]);

    if (status == CODEC_OK && !in_range(&in->schema->fields[field], in->values[field]))
        status = CODEC_OUT_OF_RANGE;
    if (status == CODEC_OK)
        in->seen |= (uint16_t)(1u << field);
    return status;
}

static enum codec_status check_all_seen(struct reader *in, struct group group)
{
    size_t i;

    for (i = group.first; i < group.last; i++) {
        if (!((unsigned)in->seen >> i & 1u)) {
            in->path = in->schema->fields[i].path;
            return CODEC_MISSING_FIELD;
        }
    }
    return CODEC_OK;
}

/* Calls itself once for each chunk of the longest path: CODEC_MAX_DEPTH at most. */
static enum codec_status read_group(struct reader *in, struct group group)
{
    const struct codec_schema *schema = in->schema;
    uint64_t count;
    enum codec_status status = read_map(in, &count);

    if (status != CODEC_OK)
        return status;
    /* However many keys are promised, each takes a byte of a bounded payload. */
    while (count-- > 0) {
        const char *key, *chunk;
        size_t length, field;

        in->path = NULL;
        status = read_key(in, &key, &length);
        if (status != CODEC_OK)
            return status;
        field = find_key(schema, group, key, length);
        if (field == group.last)
            return CODEC_UNKNOWN_FIELD;
        in->path = schema->fields[field].path;
        if ((unsigned)in->seen >> field & 1u) /* a group that was read has its first */
            return CODEC_DUPLICATE_FIELD;
        chunk = in->path + group.skip;
        status = is_group(chunk) ? read_group(in, inner(schema, group, field, length))
                                 : read_leaf(in, field);
        if (status != CODEC_OK)
            return status;
    }
    return check_all_seen(in, group);
}

static enum codec_status read_payload(struct reader *in)
{
    struct group all = {0, 0, 0};
    enum codec_status status;

    all.last = in->schema->count;
    if (in->size > in->schema->max_size)
        return CODEC_TOO_LONG;
    status = read_group(in, all);
    if (status != CODEC_OK)
        return status;
    in->path = NULL;
    return in->at == in->size ? CODEC_OK : CODEC_TRAILING;
}

struct codec_result codec_decode(const struct codec_schema *schema,
                                 const uint8_t *payload, size_t size, void *value)
{
    struct reader in = {0};
    enum codec_status status;
    size_t i;

    in.schema = schema;
    in.payload = payload;
    in.size = size;
    status = read_payload(&in);
    for (i = 0; status == CODEC_OK && i < schema->count; i++)
        store(&schema->fields[i], value, in.values[i]);
    return result(status, in.path);
}

/* -- writing --------------------------------------------------------------------- */

struct writer {
    const struct codec_schema *schema;
    const void *value;
    uint8_t *buffer;
    size_t room, size;
    bool full; /* something did not fit: nothing more is written */
};

static void put(struct writer *out, const void *bytes, size_t count)
{
    out->full = out->full || out->room - out->size < count;
    if (out->full)
        return;
    memcpy(out->buffer + out->size, bytes, count);
    out->size += count;
}

static void put_byte(struct writer *out, size_t byte)
{
    uint8_t one = (uint8_t)byte;
    put(out, &one, 1);
}

static void put_key(struct writer *out, const char *key, size_t length)
{
    put_byte(out, FIXSTR | length);
    put(out, key, length);
}

static void put_double(struct writer *out, double value)
{
    uint64_t bits;
    int shift;

    memcpy(&bits, &value, sizeof bits);
    put_byte(out, FLOAT64);
    for (shift = 56; shift >= 0; shift -= 8)
        put_byte(out, (size_t)(bits >> shift & 0xFF));
}

static size_t count_keys(const struct codec_schema *schema, struct group group)
{
    size_t i, count = 0;

    for (i = group.first; i < group.last; i = next_key(schema, group, i))
        count++;
    return count;
}

/* Calls itself once for each chunk of the longest path: CODEC_MAX_DEPTH at most. */
static void put_group(struct writer *out, struct group group)
{
    const struct codec_schema *schema = out->schema;
    size_t i;

    put_byte(out, FIXMAP | count_keys(schema, group));
    for (i = group.first; i < group.last; i = next_key(schema, group, i)) {
        const char *chunk = schema->fields[i].path + group.skip;
        size_t length = chunk_length(chunk);

        put_key(out, chunk, length);
        if (is_group(chunk))
            put_group(out, inner(schema, group, i, length));
        else
            put_double(out, load(&schema->fields[i], out->value));
    }
}

struct codec_result codec_encode(const struct codec_schema *schema, const void *value,
                                 uint8_t *buffer, size_t room, size_t *size)
{
    struct writer out = {0};
    struct group all = {0, 0, 0};
    size_t i;

    *size = 0;
    for (i = 0; i < schema->count; i++) {
        if (!in_range(&schema->fields[i], load(&schema->fields[i], value)))
            return result(CODEC_OUT_OF_RANGE, schema->fields[i].path);
    }
    out.schema = schema;
    out.value = value;
    out.buffer = buffer;
    out.room = room;
    all.last = schema->count;
    put_group(&out, all);
    if (out.full)
        return result(CODEC_NO_ROOM, NULL);
    *size = out.size;
    return result(CODEC_OK, NULL);
}

/* -------------------------------------------------------------------------------- */

void codec_defaults(const struct codec_schema *schema, void *value)
{
    size_t i;

    for (i = 0; i < schema->count; i++)
        store(&schema->fields[i], value, schema->fields[i].initial);
}

const char *codec_name(enum codec_status status)
{
    static const char *const names[] = {
        "ok", "too_long", "truncated", "trailing", "not_a_map", "not_a_key",
        "not_a_number", "unknown_field", "duplicate_field", "missing_field",
        "out_of_range", "no_room",
    };

    return (size_t)status < COUNT(names) ? names[status] : "unknown_status";
}
