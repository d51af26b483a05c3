/* The plugin ABI: a driver as tables of plain C functions, so that host and plugin may come from
 * different compilers. C11 and C++11. C++ drivers use the wrapper drivers/api/plugin.hpp.
 *
 * A plugin is a shared object `weft-driver-NAME.so` that exports one symbol, `weft_driver_v1`.
 * The host first reads abi_version and struct_size, and refuses a plugin that it cannot call.
 *
 * Rules. All calls happen on the loop's own thread. No exception or longjmp may cross a call.
 * Every call returns at once. A driver that delays the loop is faulted; one that never returns
 * ends the process (the stages then stop by themselves). Texts are UTF-8 and end with a zero.
 * Texts and structs are valid during the call only, unless a comment states otherwise. */
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

/* Incremented if a meaning below changes. A member added at the end of a struct does not count. */
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
/* The part before the bar must agree; the part after it names the compiler, for messages. */
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

/* One failure: the parts of an error sentence; NULL is an empty part. */
typedef struct weft_error_v1 {
  uint32_t struct_size;
  int32_t code;         /* WEFT_INVALID_ARGUMENT ... */
  const char* message;  /* the problem, one clause */
  const char* where;    /* JSON pointer into the configuration, or a part of the device */
  const char* expected;
  const char* got;
  const char* hint; /* advice for the reader */
} weft_error_v1;

/* Position from home: [m] on linear axes, [rad] on rotary ones. */
typedef struct weft_stage_sample_v1 {
  uint32_t struct_size;
  uint32_t move_id; /* number of the last motion command with confirmed completion */
  double position;
  uint8_t moving, homed, limit, unused[5];
} weft_stage_sample_v1;

/* In the sensor's frame; +Fz pushes the plate down. */
typedef struct weft_wrench_sample_v1 {
  uint32_t struct_size;
  uint32_t status; /* the device's status word */
  double force_n[3];
  double torque_nm[3];
  uint32_t valid; /* 0 if the status word marks the values as wrong */
  uint32_t unused;
} weft_wrench_sample_v1;

typedef struct weft_taxel_sample_v1 {
  uint32_t struct_size;
  uint32_t taxel_count;
  const uint16_t* counts; /* one value per taxel */
  uint16_t proximity_counts, ambient_counts;
  uint32_t device_us; /* the sensor's own clock, wraps */
} weft_taxel_sample_v1;

/* A block of readings, evenly spaced in time. Accelerometer: x y z [m/s2], reading by
 * reading. Microphone: [Pa]. */
typedef struct weft_block_sample_v1 {
  uint32_t struct_size;
  uint32_t value_count; /* total of all readings */
  const double* values;
  double rate_hz;     /* readings per second of the sensor's clock */
  uint32_t device_us; /* the sensor's own clock at the first reading, wraps */
  uint32_t clipped;   /* values at an end of the sensor's range */
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
  const void* value; /* a weft_stage_sample_v1 ..., by kind */
  int64_t host_ns;   /* arrival on the host clock */
  uint32_t sequence; /* the device's number; the driver's own if the protocol has none */
  uint32_t lost;     /* frames missing right before this one */
} weft_sample_v1;

enum {
  WEFT_HOME = 1,  /* find the reference switch */
  WEFT_MOVE = 2,  /* go to target with speed and stop there */
  WEFT_SERVO = 3, /* move with velocity for at most horizon_ns, then stop by itself */
  WEFT_POLL = 4,  /* request one status reading now */
  WEFT_BIAS = 5   /* take the present reading as the bias */
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
/* Identity of a device: values received from it, and the driver's factors from counts to SI. */
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

/* One port of a device: moves bytes and stamps their arrival. Pass `self` to every call. */
typedef struct weft_link_v1 {
  uint32_t struct_size;
  uint32_t unused;
  void* self;
  /* 0, or the code of a failure; last_error then returns it. */
  int32_t (*write)(void* self, const uint8_t* bytes, size_t size);
  const weft_error_v1* (*last_error)(void* self);
  /* Each call replaces the earlier function; NULL stops delivery. A serial link delivers any
   * chunking of the stream, a datagram link one datagram per call. */
  void (*on_receive)(void* self, weft_received_v1 received, void* context);
  /* Called at most once, when the remote end closes. */
  void (*on_closed)(void* self, weft_closed_v1 closed, void* context);
} weft_link_v1;

/* Interface of the program that runs a driver: loop, links and listener. Outlives the driver. Pass
 * `self` to every call. */
typedef struct weft_host_v1 {
  uint32_t struct_size;
  uint32_t abi_version;
  void* self;
  const weft_link_v1* link;
  const weft_link_v1* http; /* the device's HTTP port; NULL if the rig file has none */

  int64_t (*now_ns)(void* self);
  /* Calls `run(context)` once at `when_ns`, never from inside this call. */
  uint64_t (*timer_at)(void* self, int64_t when_ns, weft_timer_v1 run, void* context);
  /* An id that already ran or never existed is ignored. */
  void (*timer_cancel)(void* self, uint64_t id);

  void (*publish)(void* self, const weft_sample_v1* sample);
  /* Called once per open, before state_changed(WEFT_OPEN). */
  void (*identified)(void* self, const weft_identity_v1* identity);
  /* Call at once for every change: the host has no other source of the state. */
  void (*state_changed)(void* self, uint32_t state);
  /* The driver has left WEFT_ARMED or WEFT_OPEN for WEFT_FAULTED. */
  void (*fault)(void* self, const weft_error_v1* error);
  void (*log)(void* self, uint32_t level, const char* text);
  /* Reports why the current call is refused; call it right before returning the failure. */
  void (*refuse)(void* self, const weft_error_v1* error);
  /* The driver's code threw `what` in the current call. The host faults the device for good. */
  void (*threw)(void* self, const char* what);
} weft_host_v1;

typedef struct weft_device weft_device; /* the plugin's own */

/* A plugin exports it as `const weft_driver_entry_v1 weft_driver_v1`. Calls return 0, or the code
 * of a failure after a call of host->refuse. */
typedef struct weft_driver_entry_v1 {
  uint32_t abi_version;           /* WEFT_DRIVER_ABI_VERSION */
  uint32_t struct_size;           /* sizeof(weft_driver_entry_v1) */
  const char* build_fingerprint;  /* WEFT_DRIVER_FINGERPRINT */
  const char* name;               /* as in the file's name */
  const char* summary;            /* one sentence */
  const char* config_schema_json; /* JSON Schema of the configuration */

  /* NULL if refused. `config_json` comes from the rig file; valid during the call only. */
  weft_device* (*create)(const char* config_json, const weft_host_v1* host);
  /* Leaves no timer; no callback follows. */
  void (*destroy)(weft_device* device);

  /* Starts communication: reads, checks and reports the identity. */
  int32_t (*open)(weft_device* device);
  /* Makes the device ready: channel enabled, limits set, streams started. */
  int32_t (*arm)(weft_device* device);
  /* Armed only. Sets `move_id` to the number that weft_stage_sample_v1 will show, or 0. */
  int32_t (*command)(weft_device* device, const weft_command_v1* command, uint32_t* move_id);
  /* Ends motion and streams at once, in any state. */
  void (*stop)(weft_device* device);
  /* Leaves the device idle. Any state -> WEFT_CLOSED. */
  void (*close)(weft_device* device);
} weft_driver_entry_v1;

/* Options that pack structs or change the size of pointers change the ABI. */
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
