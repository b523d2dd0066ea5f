/* Wi-Fi: joins a network, joins it again whenever it is lost, and looks for others.
 *
 * Events come in a task of IDF's own and only leave a word; what follows from it is
 * done when the link's task asks how things are.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#include <ctype.h>
#include <stdatomic.h>
#include <string.h>

#include <esp_err.h>
#include <esp_event.h>
#include <esp_idf_version.h>
#include <esp_netif.h>
#include <esp_timer.h>
#include <esp_wifi.h>
#if ESP_IDF_VERSION >= ESP_IDF_VERSION_VAL(5, 1, 0)
#include <esp_eap_client.h>
#else
#include <esp_wpa2.h>
#endif

#include "board.h"

enum {
    AGAIN = 1000000, /* us between two attempts to join */
    FOUND = 16,
    HOSTNAME = 33    /* bytes with their end */
};

static esp_netif_t *station;

static atomic_int network = NETWORK_OFF;
static atomic_bool wanted;           /* it has a network to join */
static atomic_bool waiting, scanned; /* to join again; for the results of a scan */
static bool started, scanning;
static uint64_t tried;

static enum network why(uint8_t reason)
{
    switch (reason) {
    case WIFI_REASON_NO_AP_FOUND:
#if ESP_IDF_VERSION >= ESP_IDF_VERSION_VAL(5, 2, 0)
    case WIFI_REASON_NO_AP_FOUND_IN_RSSI_THRESHOLD:
#endif
        return NETWORK_NOT_FOUND;
#if ESP_IDF_VERSION >= ESP_IDF_VERSION_VAL(5, 2, 0)
    case WIFI_REASON_NO_AP_FOUND_W_COMPATIBLE_SECURITY:
    case WIFI_REASON_NO_AP_FOUND_IN_AUTHMODE_THRESHOLD:
        return NETWORK_SECURITY;
#endif
    case WIFI_REASON_MIC_FAILURE:
    case WIFI_REASON_4WAY_HANDSHAKE_TIMEOUT:
    case WIFI_REASON_HANDSHAKE_TIMEOUT:
    case WIFI_REASON_802_1X_AUTH_FAILED:
    case WIFI_REASON_AUTH_FAIL:
        return NETWORK_REFUSED;
    default: /* a weak signal, a busy access point */
        return NETWORK_JOINING;
    }
}

static void heard(void *self, esp_event_base_t base, int32_t event, void *data)
{
    (void)self;
    if (base == IP_EVENT && event == IP_EVENT_STA_GOT_IP) {
        atomic_store(&network, NETWORK_UP);
    } else if (base == IP_EVENT && event == IP_EVENT_STA_LOST_IP) {
        atomic_store(&network, NETWORK_JOINING);
    } else if (base == WIFI_EVENT && event == WIFI_EVENT_STA_DISCONNECTED
               && atomic_load(&wanted)) {
        const wifi_event_sta_disconnected_t *lost = data;

        atomic_store(&network, (int)why(lost->reason));
        atomic_store(&waiting, true);
    } else if (base == WIFI_EVENT && event == WIFI_EVENT_SCAN_DONE) {
        atomic_store(&scanned, true);
    }
}

static void start(void)
{
    const wifi_init_config_t config = WIFI_INIT_CONFIG_DEFAULT();

    if (started)
        return;
    station = esp_netif_create_default_wifi_sta();
    ESP_ERROR_CHECK(esp_wifi_init(&config));
    ESP_ERROR_CHECK(
        esp_event_handler_register(WIFI_EVENT, ESP_EVENT_ANY_ID, heard, NULL));
    ESP_ERROR_CHECK(
        esp_event_handler_register(IP_EVENT, ESP_EVENT_ANY_ID, heard, NULL));
    /* Settings are the core's: IDF keeps no copy of the password. */
    ESP_ERROR_CHECK(esp_wifi_set_storage(WIFI_STORAGE_RAM));
    ESP_ERROR_CHECK(esp_wifi_set_mode(WIFI_MODE_STA));
    ESP_ERROR_CHECK(esp_wifi_start());
    /* Asleep between beacons it hears everything 100 to 500 ms late. */
    ESP_ERROR_CHECK(esp_wifi_set_ps(WIFI_PS_NONE));
    started = true;
}

/* A user makes it an enterprise network: PEAP or TTLS, the certificate unchecked. */
static void set_user(const char *user, const char *password)
{
    const uint8_t *name = (const uint8_t *)user, *word = (const uint8_t *)password;
    const int name_size = (int)strlen(user), word_size = (int)strlen(password);

#if ESP_IDF_VERSION >= ESP_IDF_VERSION_VAL(5, 1, 0)
    if (name_size == 0) {
        esp_wifi_sta_enterprise_disable();
        return;
    }
    esp_eap_client_set_identity(name, name_size);
    esp_eap_client_set_username(name, name_size);
    esp_eap_client_set_password(word, word_size);
    esp_wifi_sta_enterprise_enable();
#else
    if (name_size == 0) {
        esp_wifi_sta_wpa2_ent_disable();
        return;
    }
    esp_wifi_sta_wpa2_ent_set_identity(name, name_size);
    esp_wifi_sta_wpa2_ent_set_username(name, name_size);
    esp_wifi_sta_wpa2_ent_set_password(word, word_size);
    esp_wifi_sta_wpa2_ent_enable();
#endif
}

/* The robot's name, of the characters that a hostname has. */
static void set_hostname(const char *name)
{
    char host[HOSTNAME] = "";
    size_t i;

    for (i = 0; name[i] != '\0' && i < sizeof host - 1; i++)
        host[i] = isalnum((unsigned char)name[i]) ? name[i] : '-';
    esp_netif_set_hostname(station, host);
}

void wifi_join(void *self, const struct network_settings *settings)
{
    wifi_config_t config = {0};

    (void)self;
    atomic_store(&wanted, settings->ssid[0] != '\0');
    if (!atomic_load(&wanted)) {
        if (started)
            esp_wifi_disconnect();
        atomic_store(&waiting, false);
        atomic_store(&network, NETWORK_OFF);
        return;
    }
    start();
    esp_wifi_disconnect();
    set_hostname(settings->name);
    /* Of several access points of that name the nearest, whatever its channel. */
    config.sta.scan_method = WIFI_ALL_CHANNEL_SCAN;
    config.sta.sort_method = WIFI_CONNECT_AP_BY_SIGNAL;
    /* Neither of these needs its end where it is as long as it may be. */
    strncpy((char *)config.sta.ssid, settings->ssid, sizeof config.sta.ssid);
    if (settings->user[0] == '\0')
        strncpy((char *)config.sta.password, settings->password,
                sizeof config.sta.password);
    set_user(settings->user, settings->password);
    esp_wifi_set_config(WIFI_IF_STA, &config);
    atomic_store(&network, NETWORK_JOINING);
    atomic_store(&waiting, true);
    tried = 0;
}

enum network wifi_network(void *self)
{
    const uint64_t now = (uint64_t)esp_timer_get_time();

    (void)self;
    if (atomic_load(&waiting) && !scanning && (tried == 0 || now - tried >= AGAIN)) {
        atomic_store(&waiting, false);
        tried = now;
        esp_wifi_connect();
    }
    return (enum network)atomic_load(&network);
}

int wifi_scan(void *self, struct access_point *found, size_t room)
{
    static wifi_ap_record_t records[FOUND];
    uint16_t count = FOUND;

    (void)self;
    if (!scanning) {
        start();
        atomic_store(&scanned, false);
        /* Refused while it joins: asked again at the next call. */
        scanning = esp_wifi_scan_start(NULL, false) == ESP_OK;
        return -1;
    }
    if (!atomic_load(&scanned))
        return -1;
    scanning = false;
    if (esp_wifi_scan_get_ap_records(&count, records) != ESP_OK)
        count = 0;
    if (count > room)
        count = (uint16_t)room;
    for (size_t i = 0; i < count; i++) {
        memset(&found[i], 0, sizeof found[i]);
        memcpy(found[i].ssid, records[i].ssid, sizeof found[i].ssid - 1);
        found[i].rssi = records[i].rssi;
        found[i].open = records[i].authmode == WIFI_AUTH_OPEN;
    }
    return count;
}
