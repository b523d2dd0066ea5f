/* Codec: payloads, which are msgpack maps, read and written without an allocator.
 *
 * A schema is a table of fields. The same table drives decoding and encoding, so the
 * two cannot disagree. The rules are those of docs/defdict.md: decoders take the keys
 * in any order and any number where a float belongs, and refuse everything else.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef REMS_CODEC_H
#define REMS_CODEC_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum {
    CODEC_MAX_FIELDS = 15, /* in a schema; a fixmap holds no more keys than this */
    CODEC_MAX_KEY = 31,    /* bytes of a key; a fixstr holds no more than this */
    CODEC_MAX_DEPTH = 4    /* maps inside each other, and so the depth of recursion */
};

enum codec_status {
    CODEC_OK,
    CODEC_TOO_LONG,        /* longer than any payload of this schema */
    CODEC_TRUNCATED,       /* ends in the middle */
    CODEC_TRAILING,        /* goes on after its map */
    CODEC_NOT_A_MAP,       /* another type where a map of fields belongs */
    CODEC_NOT_A_KEY,       /* another type where the name of a field belongs */
    CODEC_NOT_A_NUMBER,    /* another type where a number belongs */
    CODEC_UNKNOWN_FIELD,
    CODEC_DUPLICATE_FIELD,
    CODEC_MISSING_FIELD,
    CODEC_OUT_OF_RANGE,    /* NaN and infinity too */
    CODEC_NO_ROOM          /* the buffer is too small */
};

/* What came of it, and the path of the field that it is about: NULL if of none. A
 * field that is repeated inside a group is named by the first path of its table. */
struct codec_result {
    enum codec_status status;
    const char *path;
};

/* A float: where it is in the payload, what it means, and where it is in the struct. */
struct codec_field {
    const char *path; /* groups end with "/" */
    const char *unit;
    double min, max;  /* inclusive */
    double initial;   /* the default */
    size_t offset;    /* of a double */
};

/* A port's; the tables are generated (woodbot_schemas.h). */
struct codec_schema {
    const char *port;
    const char *name;
    const char *digest;
    const char *encoding;             /* that its values are sent with */
    const struct codec_field *fields; /* in schema order; groups are not torn apart */
    size_t count;
    size_t max_size;                  /* of a payload, whoever encodes it */
    const uint8_t *description;       /* the schema itself, in msgpack */
    size_t description_size;
};

/* Fill the struct of a schema with its defaults: of a command, the safe one. */
void codec_defaults(const struct codec_schema *schema, void *value);

/* Read a payload into the struct of its schema; a refused payload changes nothing. */
struct codec_result codec_decode(const struct codec_schema *schema,
                                 const uint8_t *payload, size_t size, void *value);

/* Write the payload of a struct; `size` is its length, 0 if it is refused. */
struct codec_result codec_encode(const struct codec_schema *schema, const void *value,
                                 uint8_t *buffer, size_t room, size_t *size);

/* The name of a status, such as "out_of_range". */
const char *codec_name(enum codec_status status);

#ifdef __cplusplus
}
#endif

#endif
