/* Names of hosts, looked up without waiting: lwIP asks, and tells when it knows.
 *
 * `getaddrinfo` would hold up the link's task for as long as a name server is silent.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#include <stdatomic.h>
#include <string.h>

#include <freertos/FreeRTOS.h>
#include <freertos/task.h>
#include <lwip/dns.h>
#include <lwip/tcpip.h>

#include "board.h"

enum { HOST = 64, ANSWER_MS = 300 /* that the link's task waits */ };
enum { IDLE, ASKING, FOUND, NOT_FOUND };

static atomic_int state = IDLE;
static char wanted[HOST];               /* of the task that finds `state` IDLE */
static ip_addr_t result;                /* of lwIP's task, before it says FOUND */
static char host_known[HOST], known[IPADDR_STRLEN_MAX];

static void told(const char *name, const ip_addr_t *address, void *self)
{
    (void)name;
    (void)self;
    if (address != NULL)
        result = *address;
    atomic_store(&state, address != NULL ? FOUND : NOT_FOUND);
}

/* In lwIP's own task. */
static void ask(void *self)
{
    ip_addr_t address;
    const err_t error = dns_gethostbyname(wanted, &address, told, self);

    if (error != ERR_INPROGRESS)
        told(wanted, error == ERR_OK ? &address : NULL, self);
}

bool names_resolve(void *self, const char *host, char *address, size_t room)
{
    (void)self;
    if (strlen(host) >= HOST)
        return false;
    if (atomic_load(&state) == IDLE) {
        strcpy(wanted, host);
        atomic_store(&state, ASKING);
        if (tcpip_callback(ask, NULL) != ERR_OK)
            atomic_store(&state, NOT_FOUND);
    }
    for (int i = 0; i < ANSWER_MS / 10 && atomic_load(&state) == ASKING; i++)
        vTaskDelay(pdMS_TO_TICKS(10));
    if (atomic_load(&state) == FOUND) {
        ipaddr_ntoa_r(&result, known, sizeof known);
        strcpy(host_known, wanted);
    }
    if (atomic_load(&state) != ASKING)
        atomic_store(&state, IDLE);
    /* A name that no longer resolves most likely still is where it was. */
    if (strcmp(host_known, host) != 0 || strlen(known) >= room)
        return false;
    strcpy(address, known);
    return true;
}
