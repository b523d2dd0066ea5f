/* Cable: the link's session through the console's serial line, for where no Wi-Fi is.
 *
 * The session connects to a socket of the port's own; what it says goes in frames over
 * the line, between the console's lines, to `rems board bridge`, which connects to a router.
 * A frame stands between two bytes 0xC0 (no UTF-8 has that byte), escaped as in SLIP:
 *
 *     kind, connection (2, the lower byte first), number, payload, CRC-32 (4)
 *
 * Each side sends one frame of data, and the next when that one is acknowledged: it is
 * when its payload was passed on. What is lost or damaged is sent again. A connection
 * begins with its first frame, number 0, by the robot; either side closes it.
 *
 * A task of its own steps, so that the link may wait for its session to be opened.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef WOODBOT_CABLE_H
#define WOODBOT_CABLE_H

#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum {
    CABLE_PAYLOAD = 256,  /* bytes of data in a frame, at most */
    CABLE_FRAME = CABLE_PAYLOAD + 8,
    CABLE_RING = 512,     /* a power of 2: bytes of the console on their way */
    CABLE_BAUD = 921600   /* of a robot at the cable: 115200 is too slow at 50 Hz */
};

enum cable_kind { CABLE_DATA = 1, CABLE_ACK, CABLE_CLOSE };

/* Bytes from one task to another: one writes, one reads, neither waits. */
struct cable_ring {
    uint8_t bytes[CABLE_RING];
    atomic_size_t in, out;
};

/* What the port brings: the line itself, and the connection of the link's session. */
struct cable_port {
    void *line;
    size_t (*read)(void *line, uint8_t *bytes, size_t room);
    size_t (*write)(void *line, const uint8_t *bytes, size_t size);
    void *session;
    bool (*connected)(void *session);  /* false, too, once it was closed */
    size_t (*take)(void *session, uint8_t *bytes, size_t room);
    size_t (*give)(void *session, const uint8_t *bytes, size_t size);
    void (*drop)(void *session);       /* close it */
};

/* Which of the three a byte on the line belongs to. */
struct cable_place {
    enum { CABLE_TEXT, CABLE_PACKET, CABLE_INSIDE } what;
    size_t matched, left;           /* of Improv's start; of its packet */
};

struct cable {
    struct cable_port port;
    struct cable_ring in, out;      /* the console's */
    struct cable_place coming, going;
    uint8_t frame[CABLE_FRAME];     /* that comes in */
    size_t size;
    bool escaped, spoilt;
    uint8_t data[CABLE_PAYLOAD];    /* that came, on its way to the session */
    size_t given, got;
    uint8_t sent[CABLE_PAYLOAD];    /* that is not acknowledged yet */
    size_t waiting;                 /* its bytes; 0 for none */
    uint8_t line[64];               /* bytes for the line, as they stand on it */
    size_t from, to;
    uint8_t head[4];                /* of the frame that goes out */
    const uint8_t *payload;
    size_t payload_size, next, whole; /* 0 for no frame */
    uint32_t sum;
    uint16_t connection;            /* 0 for none */
    uint8_t number, expected, acked;
    bool acks, again;
    uint16_t closes;                /* the connection that is to be closed there; or 0 */
    uint64_t since, first, began;   /* us: sent last, sent first, the frame coming in */
};

void cable_start(struct cable *cable, const struct cable_port *port);
/* Once round the cable's loop; never waits. */
void cable_step(struct cable *cable, uint64_t now);

/* Whether it has anything to do that no byte will tell it of: step again soon. */
bool cable_busy(const struct cable *cable);

/* The console's side, in the link's task: as of struct hardware. */
size_t cable_read(struct cable *cable, uint8_t *bytes, size_t room);
size_t cable_write(struct cable *cable, const uint8_t *bytes, size_t size);

/* For its own files. Follow a byte that is of no frame: a packet of Improv may hold an
 * END. Bytes from one task to the other. */
void cable_follow(struct cable_place *place, uint8_t byte);
bool cable_put(struct cable_ring *ring, uint8_t byte);
bool cable_take(struct cable_ring *ring, uint8_t *byte);

#endif
