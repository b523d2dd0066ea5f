/* The sketch: all that Arduino does is to begin.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#include <Arduino.h>

#include "board.h"

void setup() { robot_begin(); }

void loop() { vTaskDelete(nullptr); }
