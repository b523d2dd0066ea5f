/* Text: sentences and JSON, put together in memory that is there. printf would take
 * some from the heap.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef WOODBOT_TEXT_H
#define WOODBOT_TEXT_H

#include "../link.h"

struct text {
    char *at;
    size_t room, size; /* of the room one byte is the end's */
};

struct text text_in(char *room, size_t size);
/* What does not fit is left out; it always ends. */
void text_say(struct text *text, const char *words);
void text_join(struct text *text, const char *one, const char *two, const char *three);
/* As a string of JSON, in its marks; what is not printable ASCII becomes `?`. */
void text_quote(struct text *text, const char *words);
void text_whole(struct text *text, uint64_t number);
/* A number, of nine digits that count; `null` for what is none in JSON. */
void text_real(struct text *text, double number);
struct bytes text_bytes(const struct text *text);

#endif
