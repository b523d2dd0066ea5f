/* Settings in a file: replaced as a whole, so that a loss of power leaves one of both.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "robot.h"

void store_open(struct robot *robot)
{
    const char *path = robot->options.settings;
    const int fd = path == NULL ? -1 : open(path, O_RDONLY | O_CLOEXEC);
    ssize_t size = 0;

    if (fd >= 0) {
        size = read(fd, robot->stored, sizeof robot->stored);
        close(fd);
    } else if (path != NULL && errno != ENOENT) {
        fprintf(stderr, "woodbot-posix: %s: %s\n", path, strerror(errno));
    }
    robot->stored_size = size > 0 ? (size_t)size : 0;
}

size_t store_load(void *self, uint8_t *bytes, size_t room)
{
    const struct robot *robot = self;

    if (robot->stored_size > room)
        return 0;
    memcpy(bytes, robot->stored, robot->stored_size);
    return robot->stored_size;
}

static bool replace(const char *path, const uint8_t *bytes, size_t size)
{
    char beside[1024];
    int fd;
    bool good;

    if ((size_t)snprintf(beside, sizeof beside, "%s.new", path) >= sizeof beside)
        return false;
    fd = open(beside, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600); /* a password */
    if (fd < 0)
        return false;
    good = write(fd, bytes, size) == (ssize_t)size && fsync(fd) == 0;
    good = close(fd) == 0 && good;
    return good && rename(beside, path) == 0;
}

bool store_store(void *self, const uint8_t *bytes, size_t size)
{
    struct robot *robot = self;

    if (size > sizeof robot->stored)
        return false;
    if (robot->options.settings != NULL
        && !replace(robot->options.settings, bytes, size))
        return false;
    memcpy(robot->stored, bytes, size);
    robot->stored_size = size;
    return true;
}
