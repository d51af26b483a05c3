/* A driver in plain C that does nothing, with one thing wrong with its table. */
#include <stdlib.h>

#include "drivers/api/weft_driver.h"

struct weft_device {
  const weft_host_v1* host;
};

static weft_device* create(const char* config_json, const weft_host_v1* host) {
  weft_device* device = malloc(sizeof *device);
  (void)config_json;
  if (device != NULL) device->host = host;
  return device;
}
static void destroy(weft_device* device) { free(device); }
static int32_t open_device(weft_device* device) {
  const weft_identity_v1 nobody = {sizeof nobody, 0, 0, 0, NULL, NULL};
  device->host->identified(device->host->self, &nobody);
  device->host->state_changed(device->host->self, WEFT_OPEN);
  return 0;
}
static int32_t arm(weft_device* device) {
  device->host->state_changed(device->host->self, WEFT_ARMED);
  return 0;
}
static int32_t command(weft_device* device, const weft_command_v1* order, uint32_t* move_id) {
  const weft_error_v1 why = {sizeof why, WEFT_UNSUPPORTED, "nothing here moves", NULL, NULL, NULL,
                             NULL};
  (void)order;
  (void)move_id;
  device->host->refuse(device->host->self, &why);
  return WEFT_UNSUPPORTED;
}
static void stop(weft_device* device) { (void)device; }
static void close_device(weft_device* device) {
  device->host->state_changed(device->host->self, WEFT_CLOSED);
}

#ifdef FLAW_MISSING_SYMBOL
extern WEFT_DRIVER_EXPORT const weft_driver_entry_v1 weft_driver_v0;
#define weft_driver_v1 weft_driver_v0
#endif
const weft_driver_entry_v1 weft_driver_v1 = {
#ifdef FLAW_WRONG_ABI
    .abi_version = 99,
#else
    .abi_version = WEFT_DRIVER_ABI_VERSION,
#endif
#if defined(FLAW_WRONG_SIZE)
    .struct_size = sizeof(weft_driver_entry_v1) - 8,
#elif defined(FLAW_NEWER_SIZE)
    .struct_size = sizeof(weft_driver_entry_v1) + 8,
#else
    .struct_size = sizeof(weft_driver_entry_v1),
#endif
#ifdef FLAW_WRONG_FINGERPRINT
    .build_fingerprint = "weft C ABI 1, pdp11 | cc",
#else
    .build_fingerprint = WEFT_DRIVER_FINGERPRINT,
#endif
#ifdef FLAW_OTHER_NAME
    .name = "somebody_else",
#else
    .name = FLAW_NAME,
#endif
    .summary = "Does nothing",
    .config_schema_json = "{}",
    .create = create,
    .destroy = destroy,
    .open = open_device,
    .arm = arm,
    .command = command,
#ifndef FLAW_HOLE
    .stop = stop,
#endif
    .close = close_device,
};
#ifdef FLAW_HOLE
void unused_stop(weft_device* device);
void unused_stop(weft_device* device) { stop(device); }
#endif
