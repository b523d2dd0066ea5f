/* The cable of a Woodbot on the standard streams: what a session says to the address
 * that stands on the first line, goes in frames over them. Its console echoes.
 *
 *     test_cable             until the other side closes
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#define _POSIX_C_SOURCE 200809L

#include <errno.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "../cable/cable_socket.h"

static bool closed;

static size_t line_read(void *line, uint8_t *bytes, size_t room)
{
    struct pollfd ready = {STDIN_FILENO, POLLIN, 0};
    ssize_t size;

    (void)line;
    if (poll(&ready, 1, 0) <= 0)
        return 0;
    size = read(STDIN_FILENO, bytes, room);
    closed = size == 0 || (size < 0 && errno != EINTR);
    return size > 0 ? (size_t)size : 0;
}

static size_t line_write(void *line, const uint8_t *bytes, size_t size)
{
    ssize_t written = write(STDOUT_FILENO, bytes, size);

    (void)line;
    return written > 0 ? (size_t)written : 0;
}

static uint64_t now(void)
{
    struct timespec time;

    clock_gettime(CLOCK_MONOTONIC, &time);
    return (uint64_t)time.tv_sec * 1000000u + (uint64_t)time.tv_nsec / 1000u;
}

int main(void)
{
    static struct cable cable;
    static struct cable_socket end;
    struct cable_port port = {.read = line_read, .write = line_write};
    uint8_t bytes[64];

    signal(SIGPIPE, SIG_IGN);
    if (!cable_socket_open(&end, &port))
        return 1;
    cable_start(&cable, &port);
    fprintf(stderr, "%s\n", end.locator);
    while (!closed) {
        struct pollfd ready[] = {{STDIN_FILENO, POLLIN, 0}};
        size_t size;

        cable_step(&cable, now());
        size = cable_read(&cable, bytes, sizeof bytes);
        cable_write(&cable, bytes, size);
        if (size == 0 && !cable_busy(&cable))
            poll(ready, 1, 1);
    }
    return 0;
}
