/* SPDX-License-Identifier: Apache-2.0 */
#include "cable_socket.h"

#include <arpa/inet.h>
#include <errno.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

static void drop(void *self)
{
    struct cable_socket *end = self;

    if (end->session < 0)
        return;
    close(end->session);
    end->session = -1;
    end->gone = true;
}

static bool never_waits(int fd)
{
    return fcntl(fd, F_SETFL, fcntl(fd, F_GETFL, 0) | O_NONBLOCK) == 0;
}

/* One at a time; that one is gone is said before there is another. */
static bool connected(void *self)
{
    struct cable_socket *end = self;
    const int at_once = 1;

    if (end->session >= 0 || end->gone) {
        end->gone = false;
        return end->session >= 0;
    }
    end->session = accept(end->listener, NULL, NULL);
    if (end->session >= 0
        && (!never_waits(end->session)
            || setsockopt(end->session, IPPROTO_TCP, TCP_NODELAY, &at_once,
                          sizeof at_once) < 0))
        drop(end);
    return end->session >= 0;
}

static bool is_later(void)
{
    return errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR;
}

static size_t take(void *self, uint8_t *bytes, size_t room)
{
    struct cable_socket *end = self;
    ssize_t got = read(end->session, bytes, room);

    if (got == 0 || (got < 0 && !is_later()))
        drop(end);
    return got > 0 ? (size_t)got : 0;
}

static size_t give(void *self, const uint8_t *bytes, size_t size)
{
    struct cable_socket *end = self;
    ssize_t put = end->session < 0 ? 0 : write(end->session, bytes, size);

    if (put < 0 && !is_later())
        drop(end);
    return put > 0 ? (size_t)put : 0;
}

void cable_socket_close(struct cable_socket *end)
{
    drop(end);
    if (end->listener >= 0)
        close(end->listener);
    end->listener = -1;
}

bool cable_socket_open(struct cable_socket *end, struct cable_port *port)
{
    struct sockaddr_in here = {.sin_family = AF_INET};
    socklen_t size = sizeof here;

    here.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    end->session = -1;
    end->gone = false;
    end->listener = socket(AF_INET, SOCK_STREAM, 0);
    if (end->listener < 0 || !never_waits(end->listener)
        || bind(end->listener, (struct sockaddr *)&here, size) < 0
        || listen(end->listener, 1) < 0
        || getsockname(end->listener, (struct sockaddr *)&here, &size) < 0) {
        cable_socket_close(end);
        return false;
    }
    snprintf(end->locator, sizeof end->locator, "tcp/127.0.0.1:%u",
             (unsigned)ntohs(here.sin_port));
    port->session = end;
    port->connected = connected;
    port->take = take;
    port->give = give;
    port->drop = drop;
    return true;
}
