/* Wire: msgpack as the protocol of docs/time.md has it, read with checks and written.
 *
 * A reader goes through bytes that came, and remembers whether anything was wrong: ask
 * `wire_ended` at the end, and believe nothing before. A writer remembers whether
 * anything did not fit. Neither takes memory, nor goes past its bytes.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef WOODBOT_WIRE_H
#define WOODBOT_WIRE_H

#include "../link.h"

#define WIRE_LAST_TICK ((uint64_t)1 << 53)

struct wire_reader {
    const uint8_t *at;
    size_t left;
    bool wrong;
};

struct wire_reader wire_read(struct bytes message);
/* Whether all was as it was asked for, and nothing is left. */
bool wire_ended(const struct wire_reader *in);
/* How many items follow; at most `most`. */
size_t wire_read_list(struct wire_reader *in, size_t most);
size_t wire_read_map(struct wire_reader *in, size_t most);
/* A whole number in [low, high]. */
uint64_t wire_read_whole(struct wire_reader *in, uint64_t low, uint64_t high);
/* A float, NaN and infinity too; whole numbers are none. */
double wire_read_real(struct wire_reader *in);
bool wire_read_flag(struct wire_reader *in);
/* Text of at most `longest` bytes. It stays where it came. */
struct bytes wire_read_text(struct wire_reader *in, size_t longest);
struct bytes wire_read_bytes(struct wire_reader *in, size_t longest);
/* Whatever comes next, with all that is inside. */
void wire_skip(struct wire_reader *in);
/* Whether these bytes are this text. */
bool wire_is(struct bytes bytes, const char *text);

struct wire_writer {
    uint8_t *at;
    size_t room, size;
    bool full;
};

struct wire_writer wire_write(uint8_t *buffer, size_t room);
/* What was written; nothing if it did not fit. */
struct bytes wire_written(const struct wire_writer *out);
void wire_put_list(struct wire_writer *out, size_t count);
void wire_put_map(struct wire_writer *out, size_t count);
void wire_put_whole(struct wire_writer *out, uint64_t number);
void wire_put_real(struct wire_writer *out, double number);
void wire_put_flag(struct wire_writer *out, bool flag);
void wire_put_text(struct wire_writer *out, const char *text);
void wire_put_bytes(struct wire_writer *out, struct bytes bytes);
void wire_put_nothing(struct wire_writer *out);

#endif
