/* SPDX-License-Identifier: Apache-2.0 */
#include "decimal.h"

#include <stdint.h>
#include <string.h>

enum { MOST = 1000000 };

bool decimal_read(const char *text, double *number)
{
    bool negative = *text == '-';
    int32_t whole = 0, thousandths = 0, weight = 100;
    const char *first;

    text += negative || *text == '+';
    for (first = text; *text >= '0' && *text <= '9' && whole <= MOST; text++)
        whole = 10 * whole + (*text - '0');
    if (text == first || whole > MOST)
        return false;
    if (*text == '.')
        for (text++; *text >= '0' && *text <= '9'; text++, weight /= 10)
            thousandths += weight * (*text - '0');
    if (*text != '\0')
        return false;
    /* One division, so that it is the double nearest to what was typed. */
    *number = (double)((int64_t)whole * 1000 + thousandths) / 1000.0;
    if (negative)
        *number = -*number;
    return true;
}

bool decimal_write(double number, char *text, size_t room)
{
    char digits[16];
    size_t size = sizeof digits;
    bool negative = number < 0;
    int32_t left;

    if (!(number >= -MOST && number <= MOST))
        return false;
    left = (int32_t)((negative ? -number : number) * 1000.0 + 0.5);
    digits[--size] = '\0';
    for (int i = 0; i < 3; i++, left /= 10)
        if (left % 10 != 0 || digits[size] != '\0')
            digits[--size] = (char)('0' + left % 10);
    if (digits[size] != '\0')
        digits[--size] = '.';
    do
        digits[--size] = (char)('0' + left % 10);
    while ((left /= 10) != 0);
    if (negative && strcmp(digits + size, "0") != 0)
        digits[--size] = '-';
    if (sizeof digits - size > room)
        return false;
    memcpy(text, digits + size, sizeof digits - size);
    return true;
}
