/* Bounds: a socket of zenoh-pico never waits longer than said here.
 *
 * zenoh-pico's own ports bound neither `connect` nor `send`, and the one of the ESP32
 * not even `recv`: one put took 50 s in an outage. So a port links its calls of
 * `connect` and `recv` to these, which take the true ones (posix/network/sockets.c; on
 * the board `-Wl,--wrap=lwip_connect,--wrap=lwip_recv`). There is one session, and so
 * one socket, in a program.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef WOODBOT_BOUNDS_H
#define WOODBOT_BOUNDS_H

#include <stdbool.h>
#include <stdint.h>
#include <sys/socket.h>
#include <sys/types.h>

enum {
    BOUNDS_CONNECT = 2000, /* ms: until the other side has taken the connection */
    BOUNDS_OPEN = 2400,    /* ms: until the session is open, that included */
    BOUNDS_SEND = 200,     /* ms that a full socket may hold up one message */
    BOUNDS_READ = 100      /* ms of one look for an answer while it is being opened */
};

typedef int (*bounds_connect_call)(int, const struct sockaddr *, socklen_t);
typedef ssize_t (*bounds_recv_call)(int, void *, size_t, int);

/* From here on a socket that connects is the session's; until `bounds_opened`. */
void bounds_opening(void);
void bounds_opened(void);

/* What `connect` and `recv` do instead of the true call. */
int bounds_connect(bounds_connect_call real, int fd, const struct sockaddr *address,
                   socklen_t size);
ssize_t bounds_recv(bounds_recv_call real, int fd, void *buffer, size_t size,
                    int flags);

/* Wait until something has come, at most `ms`. */
void bounds_wait(uint32_t ms);
/* Whether the last `recv` found nothing more; asking for it makes it no. */
bool bounds_dry(void);
/* Whether the other side has closed it, or it is broken. */
bool bounds_ended(void);
/* Whether a message can be sent without waiting. */
bool bounds_room(void);
/* Let all that is still sent fail at once. Unless it is `open`, zenoh-pico has closed
 * it, and its number may be another's by now. */
void bounds_cut(bool open);

#endif
