/* SPDX-License-Identifier: Apache-2.0 */
#include "cable.h"

#include <string.h>

#include "../core/settings/crc32.h"

enum {
    END = 0xC0, ESCAPE = 0xDB, ESCAPED_END = 0xDC, ESCAPED_ESCAPE = 0xDD,
    HEAD = 4, SUM = 4,
    AGAIN = 200000,       /* us until a frame is sent again */
    GIVE_UP = 3000000,    /* us without an answer: nobody is there */
    FRAME_TIME = 1000000  /* us that a frame may take to come in */
};

/* -- the connection -------------------------------------------------------------- */

static void close_connection(struct cable *cable, bool tell)
{
    if (tell)
        cable->closes = cable->connection;
    cable->connection = 0;
    cable->waiting = cable->got = cable->given = 0;
    cable->acks = cable->again = false;
    cable->port.drop(cable->port.session);
}

/* Its number is another after each start: by then the old one may not be closed yet. */
static void open_connection(struct cable *cable, uint64_t now)
{
    cable->connection = (uint16_t)(now >> 4 ^ now >> 20);
    if (cable->connection == 0 || cable->connection == cable->closes)
        cable->connection++;
    cable->number = cable->expected = 0;
}

static uint32_t little_endian(const uint8_t *bytes)
{
    return (uint32_t)bytes[0] | (uint32_t)bytes[1] << 8 | (uint32_t)bytes[2] << 16
           | (uint32_t)bytes[3] << 24;
}

/* Data is passed on if it is the next, acknowledged if it was passed on before. */
static void hear_data(struct cable *cable, uint8_t number, const uint8_t *data,
                      size_t size)
{
    if (number == (uint8_t)(cable->expected - 1)) {
        cable->acks = true;
        cable->acked = number;
    } else if (number == cable->expected && cable->got == 0 && size > 0) {
        memcpy(cable->data, data, size);
        cable->got = size;
        cable->given = 0;
    }
}

static void hear_frame(struct cable *cable)
{
    const uint8_t *frame = cable->frame;
    uint16_t connection;
    size_t size = cable->size - SUM;

    if (cable->spoilt || cable->size < HEAD + SUM
        || little_endian(frame + size) != crc32_of(frame, size))
        return;
    connection = (uint16_t)(frame[1] | frame[2] << 8);
    if (connection == 0 || connection != cable->connection) {
        if (frame[0] == CABLE_DATA) /* of before: it is over */
            cable->closes = connection;
    } else if (frame[0] == CABLE_CLOSE) {
        close_connection(cable, false);
    } else if (frame[0] == CABLE_DATA) {
        hear_data(cable, frame[3], frame + HEAD, size - HEAD);
    } else if (frame[0] == CABLE_ACK && cable->waiting > 0
               && frame[3] == cable->number) {
        cable->waiting = 0;
        cable->number++;
    }
}

/* -- from the line --------------------------------------------------------------- */

static void hear_inside(struct cable *cable, uint8_t byte)
{
    if (byte == END) {
        if (cable->size == 0 && !cable->spoilt)
            return; /* the end of one frame, and the beginning of another */
        hear_frame(cable);
        cable->coming.what = CABLE_TEXT;
        return;
    }
    if (byte == ESCAPE) {
        cable->escaped = true;
        return;
    }
    if (cable->escaped && byte != ESCAPED_END && byte != ESCAPED_ESCAPE)
        cable->spoilt = true;
    if (cable->escaped)
        byte = byte == ESCAPED_END ? END : ESCAPE;
    cable->escaped = false;
    if (cable->size == CABLE_FRAME)
        cable->spoilt = true;
    else
        cable->frame[cable->size++] = byte;
}

static void hear(struct cable *cable, uint64_t now)
{
    uint8_t bytes[64];
    size_t size;

    if (cable->coming.what == CABLE_INSIDE && now - cable->began > FRAME_TIME)
        cable->coming.what = CABLE_TEXT; /* its end was lost */
    size = cable->port.read(cable->port.line, bytes, sizeof bytes);
    for (size_t i = 0; i < size; i++) {
        if (cable->coming.what == CABLE_INSIDE) {
            hear_inside(cable, bytes[i]);
        } else if (cable->coming.what == CABLE_TEXT && bytes[i] == END) {
            cable->coming.what = CABLE_INSIDE;
            cable->size = 0;
            cable->escaped = cable->spoilt = false;
            cable->began = now;
        } else {
            cable_follow(&cable->coming, bytes[i]);
            cable_put(&cable->in, bytes[i]); /* a console that is stuck loses them */
        }
    }
}

/* -- to the line ----------------------------------------------------------------- */

static void begin(struct cable *cable, enum cable_kind kind, uint16_t connection,
                  uint8_t number, size_t size)
{
    uint8_t whole[HEAD + CABLE_PAYLOAD];

    whole[0] = cable->head[0] = (uint8_t)kind;
    whole[1] = cable->head[1] = (uint8_t)connection;
    whole[2] = cable->head[2] = (uint8_t)(connection >> 8);
    whole[3] = cable->head[3] = number;
    memcpy(whole + HEAD, cable->sent, size);
    cable->sum = crc32_of(whole, HEAD + size);
    cable->payload = cable->sent;
    cable->payload_size = size;
    cable->next = 0;
    cable->whole = HEAD + size + SUM;
}

/* Choose what is to be said next, if there is anything. */
static void choose(struct cable *cable, uint64_t now)
{
    if (cable->closes != 0) {
        begin(cable, CABLE_CLOSE, cable->closes, 0, 0);
        cable->closes = 0;
    } else if (cable->acks) {
        begin(cable, CABLE_ACK, cable->connection, cable->acked, 0);
        cable->acks = false;
    } else if (cable->again) {
        begin(cable, CABLE_DATA, cable->connection, cable->number, cable->waiting);
        cable->again = false;
        cable->since = now;
    }
}

/* Byte `i` of the frame that goes out. */
static uint8_t byte_of(const struct cable *cable, size_t i)
{
    if (i < HEAD)
        return cable->head[i];
    i -= HEAD;
    if (i < cable->payload_size)
        return cable->payload[i];
    return (uint8_t)(cable->sum >> (8 * (i - cable->payload_size)));
}

static void put(struct cable *cable, uint8_t byte)
{
    cable->line[cable->to++] = byte;
}

/* The next bytes of a frame; with its ends, and escaped. */
static void put_frame(struct cable *cable)
{
    if (cable->next == 0)
        put(cable, END);
    while (cable->next < cable->whole && cable->to < sizeof cable->line - 2) {
        uint8_t byte = byte_of(cable, cable->next++);

        if (byte == END || byte == ESCAPE) {
            put(cable, ESCAPE);
            byte = byte == END ? ESCAPED_END : ESCAPED_ESCAPE;
        }
        put(cable, byte);
    }
    if (cable->next == cable->whole) {
        put(cable, END);
        cable->whole = 0;
    }
}

static void say(struct cable *cable, uint64_t now)
{
    uint8_t byte;

    if (cable->from == cable->to) {
        cable->from = cable->to = 0;
        /* No frame in the middle of a packet of Improv. */
        if (cable->whole == 0 && cable->going.what == CABLE_TEXT
            && cable->going.matched == 0)
            choose(cable, now);
        if (cable->whole > 0)
            put_frame(cable);
        else
            while (cable->to < sizeof cable->line && cable_take(&cable->out, &byte)) {
                cable_follow(&cable->going, byte);
                put(cable, byte);
            }
    }
    if (cable->from < cable->to)
        cable->from += cable->port.write(cable->port.line, cable->line + cable->from,
                                         cable->to - cable->from);
}

/* -- the session's side ---------------------------------------------------------- */

static void pass_on(struct cable *cable)
{
    if (cable->got == 0)
        return;
    cable->given += cable->port.give(cable->port.session, cable->data + cable->given,
                                     cable->got - cable->given);
    if (cable->given == cable->got) {
        cable->got = 0;
        cable->acks = true;
        cable->acked = cable->expected++;
    }
}

static void fetch(struct cable *cable, uint64_t now)
{
    if (cable->waiting > 0) {
        if (now - cable->first > GIVE_UP)
            close_connection(cable, true);
        else if (now - cable->since > AGAIN)
            cable->again = true;
        return;
    }
    if (cable->whole > 0)
        return; /* it may be of `sent` still */
    cable->waiting = cable->port.take(cable->port.session, cable->sent, CABLE_PAYLOAD);
    if (cable->waiting > 0) {
        cable->again = true;
        cable->first = cable->since = now;
    }
}

void cable_start(struct cable *cable, const struct cable_port *port)
{
    memset(cable, 0, sizeof *cable);
    cable->port = *port;
}

bool cable_busy(const struct cable *cable)
{
    return cable->from < cable->to || cable->whole > 0 || cable->got > 0 || cable->acks
           || cable->again || cable->closes != 0;
}

void cable_step(struct cable *cable, uint64_t now)
{
    hear(cable, now);
    if (cable->port.connected(cable->port.session)) {
        if (cable->connection == 0)
            open_connection(cable, now);
        pass_on(cable);
        fetch(cable, now);
    } else if (cable->connection != 0) {
        close_connection(cable, true);
    }
    say(cable, now);
}
