/* Test: one thread writes as fast as it can, another one reads; nothing is ever torn.
 *
 *     test_handover WRITES        prints: reads, how many found something, changes
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#include "safety/handover.h"

#include <inttypes.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct value {
    uint32_t words[HANDOVER_WORDS - 1];
    uint8_t odd; /* a size that is no multiple of a word's */
};

static struct handover handover;
static uint32_t writes;

static struct value of(uint32_t number)
{
    struct value made;

    memset(&made, 0, sizeof made);
    for (size_t i = 0; i < HANDOVER_WORDS - 1; i++)
        made.words[i] = number * 2654435761u + (uint32_t)i;
    made.odd = (uint8_t)number;
    return made;
}

/* What number was written; ends the program if these are of two. */
static uint32_t number(const struct value *found)
{
    uint32_t made = found->words[0] * 244002641u; /* the inverse, modulo 2^32 */
    struct value whole = of(made);

    if (memcmp(&whole, found, sizeof whole) != 0) {
        printf("torn after %" PRIu32 "\n", made);
        exit(1);
    }
    return made;
}

static void *write_all(void *nothing)
{
    for (uint32_t i = 1; i <= writes; i++) {
        struct value next = of(i);
        handover_write(&handover, &next, sizeof next);
    }
    return nothing;
}

/* A writer that is interrupted half-way: its slot is spoilt, and nobody waits for it. */
static void interrupt(void)
{
    struct value found;
    uint32_t next = atomic_load(&handover.count) + 1;

    for (size_t i = 0; i < HANDOVER_WORDS / 2; i++)
        atomic_store(&handover.slots[next & 1][i], UINT32_C(0xDEADBEEF));
    if (!handover_read(&handover, &found, sizeof found) || number(&found) != writes) {
        printf("a writer that stands still holds its reader\n");
        exit(1);
    }
}

int main(int count, char **words)
{
    uint32_t reads = 0, good = 0, changes = 0, last = 0;
    struct value found = of(0);
    pthread_t writer;

    writes = count > 1 ? (uint32_t)strtoul(words[1], NULL, 10) : 1000000;
    handover_write(&handover, &found, sizeof found);
    if (pthread_create(&writer, NULL, write_all, NULL) != 0)
        return 2;
    while (last != writes) {
        reads++;
        if (!handover_read(&handover, &found, sizeof found))
            continue;
        good++;
        if (number(&found) < last) {
            printf("it went back after %" PRIu32 "\n", last);
            return 1;
        }
        changes += number(&found) != last;
        last = number(&found);
    }
    pthread_join(writer, NULL);
    interrupt();
    printf("%" PRIu32 " %" PRIu32 " %" PRIu32 "\n", reads, good, changes);
    return 0;
}
