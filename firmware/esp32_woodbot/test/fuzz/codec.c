/* Fuzzing the codec: whatever comes is refused and changes nothing, or is a value in
 * range that comes back the same; and nothing is written past the room that there is.
 *
 *     cd firmware/esp32_woodbot
 *     clang -g -O1 -fsanitize=fuzzer,address,undefined -fno-sanitize-recover=all \
 *         -Icore core/codec.c core/woodbot_schemas.c test/fuzz/codec.c -o fuzz_codec
 *     ./fuzz_codec -runs=10000000 -max_len=200
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#include <stdlib.h>
#include <string.h>

#include "woodbot_schemas.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

enum { FIELDS = 5 /* of the largest struct */, ROOM = 256 };

static void must(int holds)
{
    if (!holds)
        abort();
}

static int in_range(const struct codec_schema *schema, const double *values)
{
    for (size_t i = 0; i < schema->count; i++) {
        double value = values[schema->fields[i].offset / sizeof value];
        if (!(schema->fields[i].min <= value && value <= schema->fields[i].max))
            return 0;
    }
    return 1;
}

/* Encoded into exactly so much room, which ends where memory does. */
static size_t encode(const struct codec_schema *schema, const double *values,
                     uint8_t *into, size_t room)
{
    uint8_t *buffer = malloc(room > 0 ? room : 1);
    struct codec_result done;
    size_t size;

    if (buffer == NULL)
        return 0;
    done = codec_encode(schema, values, buffer, room, &size);
    must((done.status == CODEC_OK) == (size > 0));
    must(size <= room && size <= schema->max_size);
    must((done.status == CODEC_OUT_OF_RANGE) == !in_range(schema, values));
    memcpy(into, buffer, size);
    free(buffer);
    return size;
}

static void decode(const struct codec_schema *schema, const uint8_t *data, size_t size)
{
    double values[FIELDS], before[FIELDS], again[FIELDS];
    uint8_t *payload = malloc(size > 0 ? size : 1), written[ROOM];
    struct codec_result done;
    size_t length;

    if (payload == NULL)
        return;
    memcpy(payload, data, size);
    memset(before, 0x55, sizeof before);
    memcpy(values, before, sizeof before);
    done = codec_decode(schema, payload, size, values);
    free(payload);
    must(strcmp(codec_name(done.status), "unknown_status") != 0);
    if (done.status != CODEC_OK) {
        must(memcmp(values, before, sizeof before) == 0);
        return;
    }
    must(size <= schema->max_size && in_range(schema, values));
    length = encode(schema, values, written, sizeof written);
    memcpy(again, before, sizeof before);
    must(codec_decode(schema, written, length, again).status == CODEC_OK);
    must(memcmp(values, again, sizeof values) == 0);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    const struct codec_schema *schema;
    double values[FIELDS] = {0};
    uint8_t written[ROOM];

    if (size < 2)
        return 0;
    schema = woodbot_schemas[data[0] % WOODBOT_PORTS];
    decode(schema, data + 2, size - 2);
    memcpy(values, data + 2, size - 2 < sizeof values ? size - 2 : sizeof values);
    encode(schema, values, written, data[1]);
    return 0;
}
