/* Asking: what robot/answers.c and robot/values.c share.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef WOODBOT_ASKING_H
#define WOODBOT_ASKING_H

#include "../woodbot_private.h"

/* One question, while it is answered. */
struct asking {
    struct woodbot *bot;
    const struct member *member; /* on whose fabric it was asked */
    void *question;
    const char *key;
    bool json;
    char room[LINK_KEY];         /* the key of an answer */
};

/* Whether it is asked for this key of the robot's; it is in the room then. */
bool asking_covers(struct asking *asking, const char *one, const char *two);
/* Answer at the key in the room; a stamp may be NULL. */
void asking_reply(struct asking *asking, struct bytes payload, const char *encoding,
                  const struct stamp *stamp);
/* Text in the scratch memory, and the answer that is in there, for people. */
struct text asking_text(struct asking *asking);
void asking_reply_json(struct asking *asking, const struct text *text);
/* The beginning of such a text: `{"tick": 412, "time": 8.24`. */
void asking_say_when(struct text *text, const struct stamp *stamp);

/* robot/values.c: every port that it covers, and fields of ports. */
void asking_values(struct asking *asking);

#endif
