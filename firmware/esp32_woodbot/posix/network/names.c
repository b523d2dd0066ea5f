/* Names: a lookup may take half a minute, so a thread of its own waits for it.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#include <arpa/inet.h>
#include <errno.h>
#include <netdb.h>
#include <netinet/in.h>
#include <poll.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <time.h>

#include "robot.h"

enum { ANSWER_MS = 300 /* that the link's thread waits */, SLOW = 20000 };

void names_start(struct names *names)
{
    pthread_mutex_init(&names->lock, NULL);
    pthread_cond_init(&names->changed, NULL);
}

/* The first IPv4 address, else the first one. */
static bool look_up(const char *host, char *address, size_t room)
{
    struct addrinfo hints = {.ai_family = AF_UNSPEC, .ai_socktype = SOCK_STREAM};
    struct addrinfo *all = NULL, *best;
    char text[INET6_ADDRSTRLEN];
    bool found;

    if (getaddrinfo(host, NULL, &hints, &all) != 0 || all == NULL)
        return false;
    for (best = all; best->ai_next != NULL && best->ai_family != AF_INET;)
        best = best->ai_next;
    found = getnameinfo(best->ai_addr, best->ai_addrlen, text, sizeof text, NULL, 0,
                        NI_NUMERICHOST) == 0;
    if (found)
        found = (size_t)snprintf(address, room,
                                 best->ai_family == AF_INET ? "%s" : "[%s]", text)
                < room;
    freeaddrinfo(all);
    return found;
}

static void *work(void *self)
{
    struct names *names = self;
    char host[PICO_ADDRESS], address[PICO_ADDRESS];
    enum names_mode mode;
    bool found;

    pthread_mutex_lock(&names->lock);
    memcpy(host, names->wanted, sizeof host);
    mode = names->mode;
    pthread_mutex_unlock(&names->lock);
    if (mode == NAMES_SLOW)
        poll(NULL, 0, SLOW);
    found = mode == NAMES_ON && look_up(host, address, sizeof address);
    pthread_mutex_lock(&names->lock);
    names->busy = false;
    if (found) {
        memcpy(names->host, host, sizeof host);
        memcpy(names->address, address, sizeof address);
        names->fresh = true;
    }
    pthread_cond_broadcast(&names->changed);
    pthread_mutex_unlock(&names->lock);
    return NULL;
}

static void begin(struct names *names, const char *host)
{
    pthread_t thread;

    snprintf(names->wanted, sizeof names->wanted, "%s", host);
    names->busy = pthread_create(&thread, NULL, work, names) == 0;
    if (names->busy)
        pthread_detach(thread);
}

bool names_resolve(struct names *names, const char *host, char *address, size_t room)
{
    struct timespec until;
    bool known, late = false;

    clock_gettime(CLOCK_REALTIME, &until);
    until.tv_nsec += ANSWER_MS * 1000000L;
    until.tv_sec += until.tv_nsec / 1000000000L;
    until.tv_nsec %= 1000000000L;
    pthread_mutex_lock(&names->lock);
    if (!names->busy && !(names->fresh && strcmp(names->host, host) == 0))
        begin(names, host);
    while (names->busy && !late)
        late = pthread_cond_timedwait(&names->changed, &names->lock, &until)
               == ETIMEDOUT;
    /* A name that no longer resolves most likely still is where it was. */
    known = strcmp(names->host, host) == 0 && strlen(names->address) < room;
    names->fresh = false; /* the next time it is looked up anew */
    if (known)
        memcpy(address, names->address, strlen(names->address) + 1);
    pthread_mutex_unlock(&names->lock);
    return known;
}
