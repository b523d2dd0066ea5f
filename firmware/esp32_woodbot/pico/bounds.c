/* SPDX-License-Identifier: Apache-2.0 */
#include "bounds.h"

#include <errno.h>
#include <fcntl.h>
#include <stddef.h>
#include <sys/poll.h>
#include <sys/time.h>
#include <time.h>

static struct {
    int fd;             /* -1: there is none */
    uint64_t deadline;  /* ms */
    bool opening, dry, ended;
} bounds = {-1, 0, false, false, false};

static uint64_t now(void)
{
    struct timespec time;

    clock_gettime(CLOCK_MONOTONIC, &time);
    return (uint64_t)time.tv_sec * 1000u + (uint64_t)time.tv_nsec / 1000000u;
}

void bounds_opening(void)
{
    bounds.fd = -1;
    bounds.deadline = now() + BOUNDS_OPEN;
    bounds.opening = true;
    bounds.dry = bounds.ended = false;
}

void bounds_opened(void)
{
    bounds.opening = false;
}

/* What the socket itself can bound. */
static void set(int fd)
{
    const struct timeval send = {0, BOUNDS_SEND * 1000}, read = {0, BOUNDS_READ * 1000};
    const struct linger none = {1, 0}; /* a close waits for nobody */

    setsockopt(fd, SOL_SOCKET, SO_SNDTIMEO, &send, sizeof send);
    setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &read, sizeof read);
    setsockopt(fd, SOL_SOCKET, SO_LINGER, &none, sizeof none);
}

/* What came of a connection that goes on by itself. */
static int finish(int fd)
{
    struct pollfd one = {fd, POLLOUT, 0};
    int error = 0;
    socklen_t size = sizeof error;
    int ready = poll(&one, 1, BOUNDS_CONNECT);

    if (ready > 0 && getsockopt(fd, SOL_SOCKET, SO_ERROR, &error, &size) == 0
        && error == 0)
        return 0;
    errno = ready == 0 ? ETIMEDOUT : error != 0 ? error : errno;
    return -1;
}

int bounds_connect(bounds_connect_call real, int fd, const struct sockaddr *address,
                   socklen_t size)
{
    int flags, result;

    if (!bounds.opening)
        return real(fd, address, size);
    set(fd);
    flags = fcntl(fd, F_GETFL, 0);
    if (flags < 0 || fcntl(fd, F_SETFL, flags | O_NONBLOCK) < 0)
        return -1;
    result = real(fd, address, size);
    if (result < 0 && errno == EINPROGRESS)
        result = finish(fd);
    if (result == 0 && fcntl(fd, F_SETFL, flags) < 0)
        result = -1;
    if (result == 0)
        bounds.fd = fd;
    return result;
}

ssize_t bounds_recv(bounds_recv_call real, int fd, void *buffer, size_t size, int flags)
{
    ssize_t got;

    if (fd != bounds.fd)
        return real(fd, buffer, size, flags);
    /* A router that takes a connection and says nothing: as if it had closed. */
    if (bounds.opening && now() >= bounds.deadline)
        return 0;
    got = real(fd, buffer, size, bounds.opening ? flags : flags | MSG_DONTWAIT);
    bounds.dry = got < 0;
    if (size > 0 && (got == 0 || (got < 0 && errno != EAGAIN && errno != EWOULDBLOCK
                                  && errno != EINTR)))
        bounds.ended = true;
    return got;
}

void bounds_wait(uint32_t ms)
{
    struct pollfd one = {bounds.fd, POLLIN, 0};

    poll(&one, 1, (int)ms); /* a negative one is left out */
}

bool bounds_dry(void)
{
    const bool dry = bounds.dry;

    bounds.dry = false;
    return dry;
}

bool bounds_ended(void)
{
    return bounds.ended;
}

bool bounds_room(void)
{
    struct pollfd one = {bounds.fd, POLLOUT, 0};

    return bounds.fd < 0 || poll(&one, 1, 0) != 0;
}

void bounds_cut(bool open)
{
    if (open && bounds.fd >= 0)
        shutdown(bounds.fd, SHUT_RDWR);
    bounds.fd = -1;
}
