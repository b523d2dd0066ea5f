/* Decimals: numbers as people type them, to a thousandth. printf and strtod would take
 * memory from the heap, and more flash than the whole core.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef WOODBOT_DECIMAL_H
#define WOODBOT_DECIMAL_H

#include <stdbool.h>
#include <stddef.h>

/* Read `-12.345`; further digits are cut off. False for what is none, or past 1e6. */
bool decimal_read(const char *text, double *number);

/* Write it, rounded to a thousandth, without zeros at its end. False if it is past 1e6
 * (NaN too), or there is no room. */
bool decimal_write(double number, char *text, size_t room);

#endif
