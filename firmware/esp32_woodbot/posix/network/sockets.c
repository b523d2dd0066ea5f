/* zenoh-pico's calls of `connect` and `recv`, bounded (pico/bounds.h).
 *
 * It is linked in as a static library, so these two stand before libc's; the true ones
 * are asked of the dynamic linker, on Linux as on macOS.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#include <dlfcn.h>
#include <string.h>

#include "bounds.h"

int connect(int fd, const struct sockaddr *address, socklen_t size)
{
    static bounds_connect_call real;

    if (real == NULL) {
        void *found = dlsym(RTLD_NEXT, "connect");

        memcpy(&real, &found, sizeof real);
    }
    return bounds_connect(real, fd, address, size);
}

ssize_t recv(int fd, void *buffer, size_t size, int flags)
{
    static bounds_recv_call real;

    if (real == NULL) {
        void *found = dlsym(RTLD_NEXT, "recv");

        memcpy(&real, &found, sizeof real);
    }
    return bounds_recv(real, fd, buffer, size, flags);
}
