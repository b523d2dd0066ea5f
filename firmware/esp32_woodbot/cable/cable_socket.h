/* The cable's end towards the session: a socket on this very computer, or chip.
 *
 * zenoh-pico connects to it as to a router; what it says, cable.c carries. BSD
 * sockets, as Linux, macOS and lwIP have them.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef WOODBOT_CABLE_SOCKET_H
#define WOODBOT_CABLE_SOCKET_H

#include <stdbool.h>
#include <stddef.h>

#include "cable.h"

struct cable_socket {
    int listener, session; /* -1: none */
    bool gone;             /* the last session is, and nobody was told yet */
    char locator[32];      /* to be opened instead of LINK_CABLE */
};

/* Listen, and fill in the session's half of a port; false if there is no socket. */
bool cable_socket_open(struct cable_socket *end, struct cable_port *port);
void cable_socket_close(struct cable_socket *end);

#endif
