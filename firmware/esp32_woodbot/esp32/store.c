/* Settings in NVS. It writes a new entry before it drops the old one: whenever the
 * power fails, one of the two is there.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#include <nvs.h>
#include <nvs_flash.h>

#include "board.h"

static const char space[] = "woodbot", entry[] = "settings";

size_t store_load(void *self, uint8_t *bytes, size_t room)
{
    nvs_handle_t nvs;
    size_t size = room;

    (void)self;
    if (nvs_open(space, NVS_READONLY, &nvs) != ESP_OK)
        return 0;
    if (nvs_get_blob(nvs, entry, bytes, &size) != ESP_OK)
        size = 0;
    nvs_close(nvs);
    return size;
}

bool store_save(void *self, const uint8_t *bytes, size_t size)
{
    nvs_handle_t nvs;
    bool stored;

    (void)self;
    if (nvs_open(space, NVS_READWRITE, &nvs) != ESP_OK)
        return false;
    stored = nvs_set_blob(nvs, entry, bytes, size) == ESP_OK
             && nvs_commit(nvs) == ESP_OK;
    nvs_close(nvs);
    return stored;
}
