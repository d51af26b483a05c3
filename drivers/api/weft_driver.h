/* The plugin ABI: a driver as tables of plain C functions, so that host and plugin may come from
 * different compilers. C11 and C++11. C++ drivers take drivers/api/plugin.hpp, which wraps it.
 *
 * A plugin is a shared object `weft-driver-NAME.so` that exports one symbol, `weft_driver_v1`.
 * The host reads abi_version and struct_size before anything else and refuses what it cannot call.
 *
 * Rules. Everything is called on the loop's own thread. Nothing may be thrown or jumped across.
 * Every call returns at once: a driver that keeps the loop waiting is faulted, one that never comes
 * back ends the process (the stages then stop by themselves). Texts are UTF-8 and end with a zero;
 * they and all structs live during the call only, unless it says otherwise. */
#ifndef WEFT_DRIVER_H
#define WEFT_DRIVER_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
#define WEFT_DRIVER_ASSERT(condition, text) static_assert(condition, text)
extern "C" {
#else
#define WEFT_DRIVER_ASSERT(condition, text) _Static_assert(condition, text)
#endif

/* Bumped when anything below changes meaning. What is only added at the end of a struct leaves it. */
#define WEFT_DRIVER_ABI_VERSION 1u

#if defined(__x86_64__)
#define WEFT_DRIVER_MACHINE "x86-64"
#elif defined(__aarch64__)
#define WEFT_DRIVER_MACHINE "aarch64"
#elif defined(__riscv) && __riscv_xlen == 64
#define WEFT_DRIVER_MACHINE "riscv64"
#else
#define WEFT_DRIVER_MACHINE "another machine"
#endif
#if defined(__clang__)
#define WEFT_DRIVER_COMPILER "clang " __VERSION__
#elif defined(__GNUC__)
#define WEFT_DRIVER_COMPILER "gcc " __VERSION__
#else
#define WEFT_DRIVER_COMPILER "another compiler"
#endif
/* What must agree is in front of the bar; behind it stands who built it, for messages. */
#define WEFT_DRIVER_FINGERPRINT "weft C ABI 1, " WEFT_DRIVER_MACHINE " | " WEFT_DRIVER_COMPILER

/* The numbers of weft::Errc. */
enum {
  WEFT_INVALID_ARGUMENT = 1,
  WEFT_PARSE = 2,
  WEFT_CHECKSUM = 3,
  WEFT_RANGE = 4,
  WEFT_NOT_FOUND = 5,
  WEFT_IO = 6,
  WEFT_TIMEOUT = 7,
  WEFT_WRONG_STATE = 8,
  WEFT_DEVICE = 9,
  WEFT_SAFETY = 10,
  WEFT_UNSUPPORTED = 11,
  WEFT_CORRUPT = 12,
  WEFT_DEVICE_SETTINGS = 13,
  WEFT_DEVICE_IDENTITY = 14,
  WEFT_DEVICE_DATA = 15,
  WEFT_DEVICE_MOTION = 16,
  WEFT_DEVICE_REFUSED = 17,
  WEFT_DEVICE_RESTARTED = 18,
  WEFT_DRIVER = 19,
  WEFT_MEASUREMENT = 20,
  WEFT_TRIALS_FAILED = 21,
  WEFT_NO_SPACE = 22,
  WEFT_BUSY = 23
};
enum { WEFT_LOG_DEBUG = 0, WEFT_LOG_INFO = 1, WEFT_LOG_WARNING = 2, WEFT_LOG_ERROR = 3 };
enum { WEFT_CLOSED = 0, WEFT_OPEN = 1, WEFT_ARMED = 2, WEFT_FAULTED = 3 };

/* One failure, as a sentence with its parts kept apart; NULL is an empty part. */
typedef struct weft_error_v1 {
  uint32_t struct_size;
  int32_t code;         /* WEFT_INVALID_ARGUMENT ... */
  const char* message;  /* what is wrong, one clause */
  const char* where;    /* JSON pointer into the configuration, or a part of the device */
  const char* expected;
  const char* got;
  const char* hint; /* what the reader can do */
} weft_error_v1;

/* Position from home: [m] on linear axes, [rad] on rotary ones. */
typedef struct weft_stage_sample_v1 {
  uint32_t struct_size;
  uint32_t move_id; /* number of the last motion command whose completion was confirmed */
  double position;
  uint8_t moving, homed, limit, unused[5];
} weft_stage_sample_v1;

/* In the sensor's frame; +Fz pushes the plate down. */
typedef struct weft_wrench_sample_v1 {
  uint32_t struct_size;
  uint32_t status; /* the device's status word */
  double force_n[3];
  double torque_nm[3];
  uint32_t valid; /* 0 when the status word says that values are wrong */
  uint32_t unused;
} weft_wrench_sample_v1;

typedef struct weft_taxel_sample_v1 {
  uint32_t struct_size;
  uint32_t taxel_count;
  const uint16_t* counts; /* one value per taxel */
  uint16_t proximity_counts, ambient_counts;
  uint32_t device_us; /* the sensor's own clock, wraps */
} weft_taxel_sample_v1;

/* A block of readings, evenly spaced in time: of an accelerometer x y z [m/s2], reading by reading; of a
 * microphone [Pa]. */
typedef struct weft_block_sample_v1 {
  uint32_t struct_size;
  uint32_t value_count; /* of all readings together */
  const double* values;
  double rate_hz;     /* readings a second by the sensor's clock */
  uint32_t device_us; /* the sensor's own clock at the first reading, wraps */
  uint32_t clipped;   /* values that stand at an end of the sensor's range */
} weft_block_sample_v1;

enum {
  WEFT_STAGE_SAMPLE = 1,
  WEFT_WRENCH_SAMPLE = 2,
  WEFT_TAXEL_SAMPLE = 3,
  WEFT_ACCELERATION_SAMPLE = 4, /* a weft_block_sample_v1 */
  WEFT_SOUND_SAMPLE = 5         /* a weft_block_sample_v1 */
};

typedef struct weft_sample_v1 {
  uint32_t struct_size;
  uint32_t kind;     /* WEFT_STAGE_SAMPLE ... */
  const void* value; /* a weft_stage_sample_v1 ..., as kind says */
  int64_t host_ns;   /* arrival on the host clock */
  uint32_t sequence; /* the device's number, or the driver's own where the wire has none */
  uint32_t lost;     /* frames missing right before this one */
} weft_sample_v1;

enum {
  WEFT_HOME = 1,  /* find the reference mark */
  WEFT_MOVE = 2,  /* go to target with speed and stop there */
  WEFT_SERVO = 3, /* move with velocity for at most horizon_ns, then stop by itself */
  WEFT_POLL = 4,  /* ask for one status reading now */
  WEFT_BIAS = 5   /* take the present reading as zero */
};
/* [m, m/s] for linear axes, [rad, rad/s] for rotary ones. */
typedef struct weft_command_v1 {
  uint32_t struct_size;
  uint32_t kind;
  double target, speed, velocity;
  int64_t horizon_ns;
} weft_command_v1;

typedef struct weft_reported_v1 {
  const char *key, *text;
} weft_reported_v1;
typedef struct weft_scale_v1 {
  const char* key;
  double value;
} weft_scale_v1;
/* Who a device is: what came over the wire, and what the driver turns counts into SI with. */
typedef struct weft_identity_v1 {
  uint32_t struct_size;
  uint32_t reported_count, scale_count, unused;
  const weft_reported_v1* reported;
  const weft_scale_v1* scale;
} weft_identity_v1;

typedef void (*weft_timer_v1)(void* context);
typedef void (*weft_received_v1)(void* context, const uint8_t* bytes, size_t size,
                                 int64_t arrival_ns);
typedef void (*weft_closed_v1)(void* context, const weft_error_v1* why);

/* One port of a device: moves bytes and stamps their arrival. `self` goes back into every call. */
typedef struct weft_link_v1 {
  uint32_t struct_size;
  uint32_t unused;
  void* self;
  /* 0, or the code of a failure that last_error then tells. */
  int32_t (*write)(void* self, const uint8_t* bytes, size_t size);
  const weft_error_v1* (*last_error)(void* self);
  /* Each replaces what it was given before; NULL stops delivery. A serial link delivers any chunking
   * of the stream, a datagram link one datagram a call. */
  void (*on_receive)(void* self, weft_received_v1 received, void* context);
  /* Called at most once, when the far end goes away. */
  void (*on_closed)(void* self, weft_closed_v1 closed, void* context);
} weft_link_v1;

/* What a driver gets from the program that runs it: its own loop, links and listener. Outlives the
 * driver. `self` goes back into every call. */
typedef struct weft_host_v1 {
  uint32_t struct_size;
  uint32_t abi_version;
  void* self;
  const weft_link_v1* link;
  const weft_link_v1* http; /* the device's HTTP port; NULL where the rig file gives none */

  int64_t (*now_ns)(void* self);
  /* Calls `run(context)` once at `when_ns`, never from inside this call. */
  uint64_t (*timer_at)(void* self, int64_t when_ns, weft_timer_v1 run, void* context);
  /* An id that already ran or never existed is ignored. */
  void (*timer_cancel)(void* self, uint64_t id);

  void (*publish)(void* self, const weft_sample_v1* sample);
  /* Once per conversation, before WEFT_OPEN is told. */
  void (*identified)(void* self, const weft_identity_v1* identity);
  /* Every change, right when it happens: the host knows the state from here alone. */
  void (*state_changed)(void* self, uint32_t state);
  /* The driver has left WEFT_ARMED or WEFT_OPEN for WEFT_FAULTED. */
  void (*fault)(void* self, const weft_error_v1* error);
  void (*log)(void* self, uint32_t level, const char* text);
  /* Why the call under way is refused; told right before it returns its failure. */
  void (*refuse)(void* self, const weft_error_v1* error);
  /* The driver's code threw `what` in the call under way. The device is faulted and not asked again. */
  void (*threw)(void* self, const char* what);
} weft_host_v1;

typedef struct weft_device weft_device; /* the plugin's own */

/* What a plugin exports as `const weft_driver_entry_v1 weft_driver_v1`. Calls return 0, or the code
 * of a failure after telling host->refuse. */
typedef struct weft_driver_entry_v1 {
  uint32_t abi_version;           /* WEFT_DRIVER_ABI_VERSION */
  uint32_t struct_size;           /* sizeof(weft_driver_entry_v1) */
  const char* build_fingerprint;  /* WEFT_DRIVER_FINGERPRINT */
  const char* name;               /* as in the file's name */
  const char* summary;            /* one sentence */
  const char* config_schema_json; /* JSON Schema of the configuration */

  /* NULL when refused. `config_json` is the rig file's, and need not live on. */
  weft_device* (*create)(const char* config_json, const weft_host_v1* host);
  /* No timer is left and no callback comes after it. */
  void (*destroy)(weft_device* device);

  /* Starts the conversation: identity is read, checked and told. */
  int32_t (*open)(weft_device* device);
  /* Makes the device ready: channel enabled, limits set, streams started. */
  int32_t (*arm)(weft_device* device);
  /* Armed only. `move_id` becomes the number to look for in weft_stage_sample_v1, or 0. */
  int32_t (*command)(weft_device* device, const weft_command_v1* command, uint32_t* move_id);
  /* Ends motion and streams now, in any state. */
  void (*stop)(weft_device* device);
  /* Leaves the device quiet. Any state -> WEFT_CLOSED. */
  void (*close)(weft_device* device);
} weft_driver_entry_v1;

/* Options that pack structs or change the size of pointers would be another ABI. */
WEFT_DRIVER_ASSERT(sizeof(void*) == 8, "the plugin ABI is for 64-bit machines");
WEFT_DRIVER_ASSERT(sizeof(weft_error_v1) == 48, "weft_error_v1");
WEFT_DRIVER_ASSERT(sizeof(weft_stage_sample_v1) == 24, "weft_stage_sample_v1");
WEFT_DRIVER_ASSERT(sizeof(weft_wrench_sample_v1) == 64, "weft_wrench_sample_v1");
WEFT_DRIVER_ASSERT(sizeof(weft_taxel_sample_v1) == 24, "weft_taxel_sample_v1");
WEFT_DRIVER_ASSERT(sizeof(weft_block_sample_v1) == 32, "weft_block_sample_v1");
WEFT_DRIVER_ASSERT(sizeof(weft_sample_v1) == 32, "weft_sample_v1");
WEFT_DRIVER_ASSERT(sizeof(weft_command_v1) == 40, "weft_command_v1");
WEFT_DRIVER_ASSERT(sizeof(weft_identity_v1) == 32, "weft_identity_v1");
WEFT_DRIVER_ASSERT(sizeof(weft_link_v1) == 48, "weft_link_v1");
WEFT_DRIVER_ASSERT(sizeof(weft_host_v1) == 112, "weft_host_v1");
WEFT_DRIVER_ASSERT(sizeof(weft_driver_entry_v1) == 96, "weft_driver_entry_v1");

#if defined(__GNUC__)
#define WEFT_DRIVER_EXPORT __attribute__((visibility("default")))
#else
#define WEFT_DRIVER_EXPORT
#endif
extern WEFT_DRIVER_EXPORT const weft_driver_entry_v1 weft_driver_v1;

#ifdef __cplusplus
}
#endif
#endif
