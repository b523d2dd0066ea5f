/* As much of ESP-IDF as esp32/network/wifi.c uses, for a computer: test_wifi.c has its
 * functions. Numbers of reasons and events are those of IDF 5.3.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef WOODBOT_TEST_IDF_H
#define WOODBOT_TEST_IDF_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define ESP_IDF_VERSION_VAL(major, minor, patch) \
    ((major) << 16 | (minor) << 8 | (patch))
#define ESP_IDF_VERSION ESP_IDF_VERSION_VAL(5, 3, 0)
#define ESP_ERROR_CHECK(call) ((void)(call))
#define WIFI_INIT_CONFIG_DEFAULT() {0}

typedef int esp_err_t;
typedef const char *esp_event_base_t;
typedef struct esp_netif esp_netif_t;
typedef void (*esp_event_handler_t)(void *, esp_event_base_t, int32_t, void *);
typedef struct { int unused; } wifi_init_config_t;

enum { ESP_OK, ESP_EVENT_ANY_ID = -1 };
enum { WIFI_EVENT_SCAN_DONE = 1, WIFI_EVENT_STA_DISCONNECTED = 5 };
enum { IP_EVENT_STA_GOT_IP, IP_EVENT_STA_LOST_IP };
enum { WIFI_STORAGE_RAM = 1, WIFI_MODE_STA = 1, WIFI_PS_NONE = 0, WIFI_IF_STA = 0 };
enum { WIFI_AUTH_OPEN };
enum {
    WIFI_REASON_MIC_FAILURE = 14,
    WIFI_REASON_4WAY_HANDSHAKE_TIMEOUT = 15,
    WIFI_REASON_802_1X_AUTH_FAILED = 23,
    WIFI_REASON_BEACON_TIMEOUT = 200,
    WIFI_REASON_NO_AP_FOUND = 201,
    WIFI_REASON_AUTH_FAIL = 202,
    WIFI_REASON_HANDSHAKE_TIMEOUT = 204,
    WIFI_REASON_NO_AP_FOUND_W_COMPATIBLE_SECURITY = 210,
    WIFI_REASON_NO_AP_FOUND_IN_AUTHMODE_THRESHOLD = 211,
    WIFI_REASON_NO_AP_FOUND_IN_RSSI_THRESHOLD = 212
};
typedef enum { WIFI_FAST_SCAN, WIFI_ALL_CHANNEL_SCAN } wifi_scan_method_t;
typedef enum {
    WIFI_CONNECT_AP_BY_SIGNAL, WIFI_CONNECT_AP_BY_SECURITY
} wifi_sort_method_t;

typedef struct {
    struct {
        uint8_t ssid[32], password[64];
        wifi_scan_method_t scan_method;
        wifi_sort_method_t sort_method;
    } sta;
} wifi_config_t;
typedef struct { uint8_t ssid[33]; int8_t rssi; int authmode; } wifi_ap_record_t;
typedef struct { uint8_t reason; } wifi_event_sta_disconnected_t;

extern const esp_event_base_t WIFI_EVENT, IP_EVENT;

int64_t esp_timer_get_time(void);
esp_netif_t *esp_netif_create_default_wifi_sta(void);
esp_err_t esp_netif_set_hostname(esp_netif_t *netif, const char *hostname);
esp_err_t esp_event_handler_register(esp_event_base_t base, int32_t event,
                                     esp_event_handler_t handler, void *self);
esp_err_t esp_wifi_init(const wifi_init_config_t *config);
esp_err_t esp_wifi_set_storage(int storage);
esp_err_t esp_wifi_set_mode(int mode);
esp_err_t esp_wifi_start(void);
esp_err_t esp_wifi_set_ps(int sleep);
esp_err_t esp_wifi_connect(void);
esp_err_t esp_wifi_disconnect(void);
esp_err_t esp_wifi_set_config(int interface, wifi_config_t *config);
esp_err_t esp_wifi_scan_start(const void *config, bool block);
esp_err_t esp_wifi_scan_get_ap_records(uint16_t *count, wifi_ap_record_t *records);
esp_err_t esp_wifi_sta_enterprise_enable(void);
esp_err_t esp_wifi_sta_enterprise_disable(void);
esp_err_t esp_eap_client_set_identity(const uint8_t *text, int size);
esp_err_t esp_eap_client_set_username(const uint8_t *text, int size);
esp_err_t esp_eap_client_set_password(const uint8_t *text, int size);

#endif
