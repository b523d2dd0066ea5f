/* zenoh-pico's calls of `connect` and `recv`, bounded (pico/bounds.h). The linker lets
 * them end here: platformio.ini, `--wrap`.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#include "bounds.h"

int __real_lwip_connect(int fd, const struct sockaddr *address, socklen_t size);
int __wrap_lwip_connect(int fd, const struct sockaddr *address, socklen_t size);
ssize_t __real_lwip_recv(int fd, void *buffer, size_t size, int flags);
ssize_t __wrap_lwip_recv(int fd, void *buffer, size_t size, int flags);

int __wrap_lwip_connect(int fd, const struct sockaddr *address, socklen_t size)
{
    return bounds_connect(__real_lwip_connect, fd, address, size);
}

ssize_t __wrap_lwip_recv(int fd, void *buffer, size_t size, int flags)
{
    return bounds_recv(__real_lwip_recv, fd, buffer, size, flags);
}
