/* Woodbot: the whole robot but its parts and its link. No heap, no platform, no waiting.
 *
 * A port makes one `struct woodbot` (of static memory), fills in the two seams, calls
 * `woodbot_start`, and then two functions for ever: `woodbot_drive` every MOTORS_PERIOD
 * ms in a task of its own, and `woodbot_run` in another. Several robots in one process
 * are several structs.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef WOODBOT_H
#define WOODBOT_H

#include "hardware.h"
#include "link.h"

#ifdef __cplusplus
extern "C" {
#endif

struct woodbot;

/* Bytes of a `struct woodbot`: for who allocates one without its definition. */
size_t woodbot_size(void);

/* Begin: settings are loaded, motors stand. The seams are copied. */
void woodbot_start(struct woodbot *bot, const struct hardware *hardware,
                   const struct link *link);

/* Once round the motors' loop. */
void woodbot_drive(struct woodbot *bot);

/* Once round the link's loop: the console, the link, sensors, what is to be said. It
 * waits in link.poll for at most `ms`, and for LINK_STALL where a session is opened. */
void woodbot_run(struct woodbot *bot, uint32_t ms);

/* What the link tells, from inside its `poll`. An encoding is as in the put, such as
 * "application/msgpack;woodbot.command@89202e31ab7525a5"; "" where there is none. */
void woodbot_heard(struct woodbot *bot, const char *key, struct bytes payload,
                   const char *encoding, struct bytes attachment);
void woodbot_asked(struct woodbot *bot, void *question, const char *key,
                   const char *parameters, struct bytes payload);
/* An answer to `ask`; a refusal has its sentence as payload. */
void woodbot_answered(struct woodbot *bot, uint32_t id, bool refused,
                      struct bytes payload, struct bytes attachment);

#ifdef __cplusplus
}
#endif

#endif
