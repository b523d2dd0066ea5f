/* SPDX-License-Identifier: Apache-2.0 */
#include "messages.h"

#include <stdlib.h>
#include <string.h>

enum { RUN = 77 };

struct bytes input;
struct times times;

/* -- the input -------------------------------------------------------------------- */

uint8_t take(void)
{
    if (input.size == 0)
        return 0;
    input.size--;
    return *input.at++;
}

struct bytes take_some(size_t most)
{
    struct bytes taken = {input.at, take()};

    if (taken.size > 0)
        taken.at++;
    if (taken.size > most)
        taken.size = most;
    if (taken.size > input.size)
        taken.size = input.size;
    input.at += taken.size;
    input.size -= taken.size;
    return taken;
}

/* A copy that ends where its memory does, so that reading on is noticed. */
struct bytes copy(struct bytes bytes)
{
    uint8_t *made = malloc(bytes.size > 0 ? bytes.size : 1);

    world_must(made != NULL);
    if (bytes.size > 0)
        memcpy(made, bytes.at, bytes.size);
    return (struct bytes){made, bytes.size};
}

void drop(struct bytes copied)
{
    free((void *)(uintptr_t)copied.at);
}

/* Some text of the input, without an end inside. */
const char *take_text(char room[LINK_KEY])
{
    struct bytes taken = take_some(LINK_KEY - 1);

    if (taken.size > 0)
        memcpy(room, taken.at, taken.size);
    room[taken.size] = '\0';
    return room;
}

/* -- what is made as a clock makes it --------------------------------------------- */

struct bytes beat(uint8_t room[MESSAGE])
{
    struct wire_writer out = wire_write(room, MESSAGE);

    times.n++;
    wire_put_list(&out, 7);
    wire_put_whole(&out, RUN);
    wire_put_whole(&out, times.n);
    wire_put_real(&out, (double)times.n * 0.02);
    wire_put_real(&out, 0.02);
    wire_put_real(&out, 1);
    wire_put_whole(&out, 1);
    wire_put_whole(&out, times.stops);
    return wire_written(&out);
}

struct bytes admission(uint8_t room[MESSAGE])
{
    struct wire_writer out = wire_write(room, MESSAGE);

    wire_put_map(&out, 5);
    wire_put_text(&out, "badge");
    wire_put_whole(&out, ((uint64_t)RUN << 24) + 1);
    wire_put_text(&out, "first");
    wire_put_whole(&out, times.n + 1);
    wire_put_text(&out, "dt");
    wire_put_real(&out, 0.02);
    wire_put_text(&out, "stops");
    wire_put_whole(&out, times.stops);
    wire_put_text(&out, "patience");
    wire_put_real(&out, 30);
    return wire_written(&out);
}

struct bytes age(uint8_t room[MESSAGE], uint8_t which)
{
    struct wire_writer out = wire_write(room, MESSAGE);

    wire_put_list(&out, 3);
    wire_put_whole(&out, RUN);
    wire_put_real(&out, (which >> 4 & 7) * 0.03);
    wire_put_whole(&out, times.stops);
    return wire_written(&out);
}

struct bytes newest(uint8_t room[MESSAGE])
{
    struct wire_writer out = wire_write(room, MESSAGE);

    wire_put_map(&out, 1);
    wire_put_text(&out, "n");
    wire_put_whole(&out, times.n);
    return wire_written(&out);
}

/* Of one of two holders, who may give it back. */
struct bytes claim(uint8_t room[MESSAGE])
{
    struct wire_writer out = wire_write(room, MESSAGE);
    uint8_t which = take();

    wire_put_list(&out, 2);
    wire_put_whole(&out, 6u + which % 2);
    wire_put_text(&out, which % 8 < 2 ? "" : "robot/mine of a laptop");
    return wire_written(&out);
}

struct bytes command(uint8_t room[MESSAGE])
{
    struct woodbot_command made = {(take() - 128) * 0.06, (take() - 128) * 0.06};
    struct bytes written = {room, 0};

    codec_encode(&woodbot_command_schema, &made, room, MESSAGE, &written.size);
    return written;
}

struct bytes stamp(uint8_t room[STAMP_SIZE])
{
    uint8_t which = take();
    struct stamp made = {times.n + which % 8, 0, 0, 1.0};

    made.n = made.n > 4 ? made.n - 4 : made.n;
    made.said = made.n > which / 64u ? made.n - which / 64u : made.n;
    made.badge = which % 16 < 6 ? 0 : which % 16 < 8 ? 6u + which % 2
                                                     : ((uint64_t)RUN << 24) + 5;
    return which == 0 ? (struct bytes){room, 0} : stamp_write(room, &made);
}

/* Some of it is damaged on its way. */
struct bytes damaged(struct bytes made, uint8_t room[MESSAGE])
{
    uint8_t how = take();

    if (how < 200 || made.size == 0)
        return made;
    memmove(room, made.at, made.size);
    room[take() % made.size] ^= take();
    return (struct bytes){room, how > 240 ? made.size - 1 : made.size};
}
