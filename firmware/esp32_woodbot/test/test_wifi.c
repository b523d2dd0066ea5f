/* The board's Wi-Fi on a computer: its calls of ESP-IDF (idf.h), and what it makes of the
 * reasons with which IDF loses a network. Each check prints a line.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "board.h"
#include "idf.h"

const esp_event_base_t WIFI_EVENT = "wifi", IP_EVENT = "ip";
static esp_event_handler_t handler;
static wifi_config_t config;
static char hostname[64];
static int64_t now;
static unsigned connects, by_then; /* ... and when the hostname was set */

int64_t esp_timer_get_time(void) { return now += 10000; }
esp_netif_t *esp_netif_create_default_wifi_sta(void) { return (esp_netif_t *)&config; }

esp_err_t esp_netif_set_hostname(esp_netif_t *netif, const char *name)
{
    if (netif != (esp_netif_t *)&config || strlen(name) >= sizeof hostname)
        return -1;
    strcpy(hostname, name);
    by_then = connects;
    return ESP_OK;
}

esp_err_t esp_event_handler_register(esp_event_base_t base, int32_t event,
                                     esp_event_handler_t told, void *self)
{
    handler = base == WIFI_EVENT && event == ESP_EVENT_ANY_ID && self == NULL ? told
                                                                              : handler;
    return ESP_OK;
}

esp_err_t esp_wifi_connect(void)
{
    connects++;
    return ESP_OK;
}

esp_err_t esp_wifi_set_config(int interface, wifi_config_t *wanted)
{
    config = *wanted;
    return interface;
}

esp_err_t esp_wifi_init(const wifi_init_config_t *wanted) { return wanted->unused; }
esp_err_t esp_wifi_set_storage(int storage) { return storage - storage; }
esp_err_t esp_wifi_set_mode(int mode) { return mode - mode; }
esp_err_t esp_wifi_start(void) { return ESP_OK; }
esp_err_t esp_wifi_set_ps(int sleep) { return sleep; }
esp_err_t esp_wifi_disconnect(void) { return ESP_OK; }
esp_err_t esp_wifi_scan_start(const void *how, bool block)
{
    return how != NULL || block;
}


esp_err_t esp_wifi_scan_get_ap_records(uint16_t *count, wifi_ap_record_t *records)
{
    *count = 0;
    return records == NULL;
}

esp_err_t esp_wifi_sta_enterprise_enable(void) { return ESP_OK; }
esp_err_t esp_wifi_sta_enterprise_disable(void) { return ESP_OK; }

esp_err_t esp_eap_client_set_identity(const uint8_t *text, int size)
{
    return text == NULL || size < 0;
}

esp_err_t esp_eap_client_set_username(const uint8_t *text, int size)
{
    return text == NULL || size < 0;
}

esp_err_t esp_eap_client_set_password(const uint8_t *text, int size)
{
    return text == NULL || size < 0;
}

static void check(bool holds, const char *what)
{
    printf("%s %s\n", holds ? "ok" : "FAIL", what);
    if (!holds)
        exit(1);
}

static enum network after(uint8_t reason)
{
    wifi_event_sta_disconnected_t lost = {reason};

    handler(NULL, WIFI_EVENT, WIFI_EVENT_STA_DISCONNECTED, &lost);
    return wifi_network(NULL);
}

int main(void)
{
    struct network_settings settings = {"lab-net", "secret", "", "Wood_bot.7"};

    wifi_join(NULL, &settings);
    check(wifi_network(NULL) == NETWORK_JOINING && connects == 1, "it joins");
    check(config.sta.scan_method == WIFI_ALL_CHANNEL_SCAN
          && config.sta.sort_method == WIFI_CONNECT_AP_BY_SIGNAL,
          "the strongest of all channels");
    check(strcmp(hostname, "Wood-bot-7") == 0 && by_then == 0,
          "its name, as a hostname, before it joins");
    settings.name = "woodbot-of-thirty-two-characters";
    wifi_join(NULL, &settings);
    check(strcmp(hostname, settings.name) == 0, "a long name");

    check(after(WIFI_REASON_NO_AP_FOUND) == NETWORK_NOT_FOUND, "no such network");
    check(after(WIFI_REASON_NO_AP_FOUND_IN_RSSI_THRESHOLD) == NETWORK_NOT_FOUND,
          "one too weak");
    check(after(WIFI_REASON_4WAY_HANDSHAKE_TIMEOUT) == NETWORK_REFUSED,
          "another password");
    check(after(WIFI_REASON_NO_AP_FOUND_W_COMPATIBLE_SECURITY) == NETWORK_SECURITY,
          "no compatible security");
    check(after(WIFI_REASON_NO_AP_FOUND_IN_AUTHMODE_THRESHOLD) == NETWORK_SECURITY,
          "less security than a password asks for");
    check(after(WIFI_REASON_BEACON_TIMEOUT) == NETWORK_JOINING, "a lost access point");
    handler(NULL, IP_EVENT, IP_EVENT_STA_GOT_IP, NULL);
    check(wifi_network(NULL) == NETWORK_UP, "an address");
    return 0;
}
