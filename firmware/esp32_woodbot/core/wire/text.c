/* SPDX-License-Identifier: Apache-2.0 */
#include "text.h"

#include <float.h>
#include <string.h>

enum { DIGITS = 9 };

struct text text_in(char *room, size_t size)
{
    struct text made = {room, size, 0};

    room[0] = '\0';
    return made;
}

static void add(struct text *text, const char *words, size_t size)
{
    size_t left = text->room - 1 - text->size;

    if (size > left)
        size = left;
    memcpy(text->at + text->size, words, size);
    text->size += size;
    text->at[text->size] = '\0';
}

void text_say(struct text *text, const char *words)
{
    add(text, words, strlen(words));
}

void text_join(struct text *text, const char *one, const char *two, const char *three)
{
    text_say(text, one);
    text_say(text, two);
    text_say(text, three);
}

void text_quote(struct text *text, const char *words)
{
    add(text, "\"", 1);
    for (; *words != '\0'; words++) {
        if (*words == '"' || *words == '\\')
            add(text, "\\", 1);
        add(text, ' ' <= *words && *words <= '~' ? words : "?", 1);
    }
    add(text, "\"", 1);
}

void text_whole(struct text *text, uint64_t number)
{
    char digits[20];
    size_t first = sizeof digits;

    do
        digits[--first] = (char)('0' + number % 10);
    while ((number /= 10) > 0);
    add(text, digits + first, sizeof digits - first);
}

/* The digits of a number in [0.1, 1), after the point, without zeros at the end. */
static size_t spell(double number, char digits[DIGITS])
{
    uint32_t whole = (uint32_t)(number * 1e9 + 0.5);
    size_t count = DIGITS;

    for (size_t i = DIGITS; i-- > 0; whole /= 10)
        digits[i] = (char)('0' + whole % 10);
    while (count > 1 && digits[count - 1] == '0')
        count--;
    return count;
}

/* `digits` with a point after the first `point` of them, which may be outside. */
static void place(struct text *text, const char *digits, int count, int point)
{
    if (point <= 0)
        add(text, "0.", 2);
    for (int i = point; i < 0; i++)
        add(text, "0", 1);
    for (int i = 0; i < count || i < point; i++) {
        if (i == point && point > 0)
            add(text, ".", 1);
        add(text, i < count ? digits + i : "0", 1);
    }
}

void text_real(struct text *text, double number)
{
    char digits[DIGITS];
    int point = 0;
    size_t count;

    if (!(-DBL_MAX <= number && number <= DBL_MAX)) {
        text_say(text, "null");
        return;
    }
    if (number < 0) {
        add(text, "-", 1);
        number = -number;
    }
    if (number == 0) {
        text_say(text, "0.0");
        return;
    }
    for (; number >= 0.9999999995; point++)
        number /= 10;
    for (; number < 0.09999999995; point--)
        number *= 10;
    count = spell(number, digits);
    if (-4 < point && point < 16) {
        place(text, digits, (int)count, point);
        if ((int)count <= point)
            text_say(text, ".0");
    } else {
        place(text, digits, (int)count, 1);
        text_say(text, point > 0 ? "e" : "e-");
        text_whole(text, (uint64_t)(point > 0 ? point - 1 : 1 - point));
    }
}

struct bytes text_bytes(const struct text *text)
{
    struct bytes made = {(const uint8_t *)text->at, text->size};

    return made;
}
