/* Search: routers that answer by multicast, for a robot that was told no address.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#include <string.h>

#include "link_pico.h"

#if Z_FEATURE_SCOUTING

static void found(z_loaned_hello_t *hello, void *context)
{
    struct link_pico *pico = context;
    const z_loaned_string_array_t *all = zp_hello_locators(hello);

    for (size_t i = 0; i < z_string_array_len(all); i++) {
        const z_loaned_string_t *one = z_string_array_get(all, i);
        const char *text = z_string_data(one);
        const size_t size = z_string_len(one);

        /* IPv6 addresses of one link need its name, too; who has those has IPv4. */
        if (pico->found_count < PICO_FOUND && size < PICO_ADDRESS && size > 4
            && memcmp(text, "tcp/", 4) == 0 && memchr(text, '[', size) == NULL) {
            memcpy(pico->found[pico->found_count], text, size);
            pico->found[pico->found_count++][size] = '\0';
        }
    }
}

static void search(struct link_pico *pico)
{
    z_owned_config_t config;
    z_owned_closure_hello_t told;
    const z_scout_options_t options = {PICO_SEARCH, Z_WHAT_ROUTER};

    pico->found_count = pico->found_next = 0;
    if (z_config_default(&config) < 0)
        return;
    z_closure_hello(&told, found, NULL, pico);
    z_scout(z_config_move(&config), z_closure_hello_move(&told), &options);
}

#else

static void search(struct link_pico *pico)
{
    pico->found_count = pico->found_next = 0;
}

#endif

/* One address at a time: each may take as long as a call may. */
bool pico_search(struct link_pico *pico, char *locator, size_t room)
{
    if (pico->found_next >= pico->found_count) {
        search(pico);
        return false;
    }
    if (room < PICO_ADDRESS)
        return false;
    memcpy(locator, pico->found[pico->found_next++], PICO_ADDRESS);
    return true;
}
