/* The test of the codec, on a PC.
 *
 *     test_codec golden FOLDER [BAD ...]   check the codec against the golden files
 *     test_codec table                     print the tables, for who knows the schemas
 *     test_codec try PORT FILE             decode many payloads and encode them again
 *
 * FILE holds payloads, each after its length: two bytes, the lower first.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#include "../core/woodbot_schemas.h"

#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_FILE = 4096 };

struct port {
    const char *name;
    const struct codec_schema *schema;
    double golden[CODEC_MAX_FIELDS]; /* the values in its golden payload */
};

static const struct port ports[] = {
    {"command", &woodbot_command_schema, {7.3, -1.25}},
    {"state", &woodbot_state_schema, {0.125, -0.0, 7.0}},
    {"sensors", &woodbot_sensors_schema, {0.25, 1.2, -0.6, 0.8, 0.001}},
};
enum { PORTS = sizeof ports / sizeof ports[0] };

static int failures;

static void check(bool good, const char *name, const char *what)
{
    printf("%s %s: %s\n", good ? "ok  " : "FAIL", name, what);
    failures += !good;
}

/* The bytes of a file, in a buffer of MAX_FILE; the run ends if it can't be read. */
static size_t read_file(const char *path, uint8_t *buffer)
{
    FILE *file = fopen(path, "rb");
    size_t size;

    if (file == NULL) {
        fprintf(stderr, "cannot read %s\n", path);
        exit(1);
    }
    size = fread(buffer, 1, MAX_FILE, file);
    fclose(file);
    return size;
}

static size_t read_golden(const char *folder, const char *name, const char *ending,
                          uint8_t *buffer)
{
    char path[1024];

    snprintf(path, sizeof path, "%s/%s.%s", folder, name, ending);
    return read_file(path, buffer);
}

/* The values of a port are doubles in the order of its table, and nothing else. */
static void check_table(const struct port *port)
{
    const struct codec_schema *schema = port->schema;
    bool all = strcmp(schema->port, port->name) == 0;
    size_t i;

    for (i = 0; i < schema->count; i++)
        all = all && schema->fields[i].offset == i * sizeof(double);
    check(all, port->name, "the table is of its struct");
}

static void check_values(const struct port *port, const uint8_t *bytes, size_t size)
{
    size_t length = port->schema->count * sizeof(double);
    double found[CODEC_MAX_FIELDS];
    struct codec_result done = codec_decode(port->schema, bytes, size, found);

    check(done.status == CODEC_OK, port->name, "the payload decodes");
    check(done.status == CODEC_OK && memcmp(found, port->golden, length) == 0,
          port->name, "to the values that were encoded, to the bit");
}

static void check_encoding(const struct port *port, const uint8_t *bytes, size_t size)
{
    uint8_t made[WOODBOT_MAX_PAYLOAD];
    double wrong[CODEC_MAX_FIELDS];
    size_t length, room;
    bool refused = true;

    codec_encode(port->schema, port->golden, made, sizeof made, &length);
    check(length == size && memcmp(made, bytes, size) == 0, port->name,
          "the values encode to the same bytes");
    for (room = 0; room < size; room++)
        refused = refused
                  && codec_encode(port->schema, port->golden, made, room, &length).status
                         == CODEC_NO_ROOM;
    check(refused && length == 0, port->name, "not into a buffer that is too small");
    memcpy(wrong, port->golden, sizeof wrong);
    wrong[1] = NAN;
    check(codec_encode(port->schema, wrong, made, sizeof made, &length).status
              == CODEC_OUT_OF_RANGE,
          port->name, "NaN is not encoded");
}

static void check_refusals(const struct port *port, const uint8_t *bytes, size_t size)
{
    double kept[CODEC_MAX_FIELDS];
    bool refused = true;
    size_t length;

    codec_defaults(port->schema, kept);
    for (length = 0; length < size; length++)
        refused = refused
                  && codec_decode(port->schema, bytes, length, kept).status
                         == CODEC_TRUNCATED;
    check(refused, port->name, "every beginning of the payload is truncated");
    for (length = 0; length < port->schema->count; length++)
        refused = refused && kept[length] == port->schema->fields[length].initial;
    check(refused, port->name, "what is refused changes nothing");
}

static void check_port(const struct port *port, const char *folder)
{
    uint8_t bytes[MAX_FILE];
    size_t size = read_golden(folder, port->name, "digest", bytes);

    check(size == strlen(port->schema->digest)
              && memcmp(bytes, port->schema->digest, size) == 0,
          port->name, "the digest");
    size = read_golden(folder, port->name, "schema", bytes);
    check(size == port->schema->description_size
              && memcmp(bytes, port->schema->description, size) == 0,
          port->name, "the description");
    check_table(port);
    size = read_golden(folder, port->name, "payload", bytes);
    check_values(port, bytes, size);
    check_encoding(port, bytes, size);
    check_refusals(port, bytes, size);
}

static void print_result(char *text, size_t room, struct codec_result done)
{
    snprintf(text, room, "%s%s%s", codec_name(done.status), done.path ? " " : "",
             done.path ? done.path : "");
}

/* NAME.bad is a command; NAME.refusal says with which status, about which field. */
static void check_bad(const char *folder, const char *name)
{
    uint8_t bytes[MAX_FILE], wanted[MAX_FILE];
    struct woodbot_command command;
    char got[128];
    size_t size = read_golden(folder, name, "bad", bytes);
    size_t length = read_golden(folder, name, "refusal", wanted);

    print_result(got, sizeof got,
                 codec_decode(&woodbot_command_schema, bytes, size, &command));
    check(length == strlen(got) && memcmp(got, wanted, length) == 0, name, got);
}

static int golden(const char *folder, char **bad, int count)
{
    int i;

    for (i = 0; i < PORTS; i++)
        check_port(&ports[i], folder);
    for (i = 0; i < count; i++)
        check_bad(folder, bad[i]);
    return failures != 0;
}

static int table(void)
{
    size_t i, j;

    for (i = 0; i < PORTS; i++) {
        const struct codec_schema *schema = ports[i].schema;
        printf("%s,%s,%s,%s,%u,", ports[i].name, schema->name, schema->digest,
               schema->encoding, (unsigned)schema->max_size);
        for (j = 0; j < schema->description_size; j++)
            printf("%02x", schema->description[j]);
        printf("\n");
        for (j = 0; j < schema->count; j++) {
            const struct codec_field *field = &schema->fields[j];
            printf(",%s,%s,%a,%a,%a\n", field->path, field->unit, field->min,
                   field->max, field->initial);
        }
    }
    printf("bounds,%d,%d,%d,%d\n", WOODBOT_MAX_PAYLOAD, CODEC_MAX_FIELDS, CODEC_MAX_KEY,
           CODEC_MAX_DEPTH);
    printf("sizes,%d,%d,%d\n", WOODBOT_MAX_DESCRIPTION, WOODBOT_SCHEMA_ANSWER,
           WOODBOT_PORTS);
    printf("robot,%a,%u,%a,%a\n", WOODBOT_MAX_AGE, WOODBOT_MAX_AGE_US,
           WOODBOT_WHEEL_RADIUS, WOODBOT_TRACK);
    return 0;
}

/* Print "ok", the values and the bytes that they encode to; or the refusal. */
static void try_payload(const struct codec_schema *schema, const uint8_t *payload,
                        size_t size)
{
    double values[CODEC_MAX_FIELDS];
    uint8_t made[WOODBOT_MAX_PAYLOAD];
    char text[128];
    struct codec_result done = codec_decode(schema, payload, size, values);
    size_t i, length = 0;

    print_result(text, sizeof text, done);
    printf("%s", text);
    for (i = 0; done.status == CODEC_OK && i < schema->count; i++)
        printf(" %a", values[i]);
    if (done.status == CODEC_OK) {
        codec_encode(schema, values, made, sizeof made, &length);
        printf(" ");
    }
    for (i = 0; i < length; i++)
        printf("%02x", made[i]);
    printf("\n");
}

static int try_all(const struct codec_schema *schema, FILE *file)
{
    int low, high;

    while ((low = getc(file)) != EOF && (high = getc(file)) != EOF) {
        size_t size = (size_t)low | (size_t)high << 8;
        /* The payload ends where its memory does, so a sanitizer sees one byte more. */
        uint8_t *memory = malloc(size + 1);
        if (memory == NULL || fread(memory + 1, 1, size, file) != size)
            return 1;
        try_payload(schema, memory + 1, size);
        free(memory);
    }
    return 0;
}

static int try_file(const char *name, const char *path)
{
    FILE *file = fopen(path, "rb");
    int i, status = 1;

    for (i = 0; file != NULL && i < PORTS; i++) {
        if (strcmp(ports[i].name, name) == 0)
            status = try_all(ports[i].schema, file);
    }
    if (file != NULL)
        fclose(file);
    return status;
}

int main(int argc, char **argv)
{
    if (argc >= 3 && strcmp(argv[1], "golden") == 0)
        return golden(argv[2], argv + 3, argc - 3);
    if (argc == 2 && strcmp(argv[1], "table") == 0)
        return table();
    if (argc == 4 && strcmp(argv[1], "try") == 0)
        return try_file(argv[2], argv[3]);
    fprintf(stderr, "test_codec golden FOLDER [BAD ...] | table | try PORT FILE\n");
    return 1;
}
