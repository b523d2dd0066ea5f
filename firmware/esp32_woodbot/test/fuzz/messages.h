/* Messages: the input, and what is made of it as a clock and a driver make it.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef FUZZ_MESSAGES_H
#define FUZZ_MESSAGES_H

#include "world.h"

enum { MESSAGE = 640 };

extern struct bytes input;          /* what is left of it */
extern struct times {
    uint64_t n, stops;
} times;                            /* what the clock has come to */

uint8_t take(void);
struct bytes take_some(size_t most);
/* Some text of the input, without an end inside. */
const char *take_text(char room[LINK_KEY]);

/* A copy that ends where its memory does, so that reading on is noticed. */
struct bytes copy(struct bytes bytes);
void drop(struct bytes copied);

/* The clock's next tick, and its answers. */
struct bytes beat(uint8_t room[MESSAGE]);
struct bytes admission(uint8_t room[MESSAGE]);
struct bytes age(uint8_t room[MESSAGE], uint8_t which);
struct bytes newest(uint8_t room[MESSAGE]);
/* What others ask of the robot. */
struct bytes claim(uint8_t room[MESSAGE]);
struct bytes command(uint8_t room[MESSAGE]);
struct bytes stamp(uint8_t room[STAMP_SIZE]);
/* The same, or in the room, if it was damaged on its way. */
struct bytes damaged(struct bytes made, uint8_t room[MESSAGE]);

#endif
