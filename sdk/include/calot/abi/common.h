/*
 * Calot plugin contract: what all five kinds of plugin share.
 *
 * Pure C11. SI units, double precision. World frame: patient LPS as in DICOM (+x left, +y posterior, +z
 * superior). Quaternions are (w, x, y, z) and turn body coordinates into world coordinates.
 *
 * Every struct that is passed by pointer starts with its size in bytes, as the sender compiled it; fields are
 * only ever added at the end. Memory belongs to whoever made it: a callee that wants to keep data copies
 * them. Strings are UTF-8 with a length and no terminating zero.
 *
 * Every function carries one thread tag and one real-time tag in the comment above it:
 *   [main]           the thread that loaded the library; never while another call on the same instance runs
 *   [simulation]     the thread that steps the simulation
 *   [device]         the thread that owns the device; never at once with another call on the same instance
 *   [any]            any thread, also at once
 *   [real-time]      neither allocates, blocks, throws, starts threads nor changes the floating-point mode
 *   [not-real-time]  may take its time
 */
#ifndef CALOT_ABI_COMMON_H
#define CALOT_ABI_COMMON_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Version of the contract. Same major needed; while major is 0 the minor and the fingerprint must match
 * exactly. */
#define CALOT_ABI_MAJOR 0
#define CALOT_ABI_MINOR 2
/* FNV-1a over the tokens of the headers in this folder, this line left out; a test recomputes it. */
#define CALOT_ABI_FINGERPRINT 0x8af7a3d9fede93a7ull

/* ---- Plain data
 * ------------------------------------------------------------------------------------------------- */

typedef struct calot_string {
    const char* data;
    uint64_t size;
} calot_string;

typedef struct calot_bytes {
    const uint8_t* data;
    uint64_t size;
} calot_bytes;

typedef struct calot_bytes_out {
    uint8_t* data;
    uint64_t size;
} calot_bytes_out;

typedef struct calot_reals {
    const double* data;
    uint64_t size;
} calot_reals;

typedef struct calot_reals_out {
    double* data;
    uint64_t size;
} calot_reals_out;

typedef struct calot_indices {
    const uint32_t* data;
    uint64_t size;
} calot_indices;

typedef struct calot_indices_out {
    uint32_t* data;
    uint64_t size;
} calot_indices_out;

/* A span of structs: element i starts at data + i * stride, so that a newer, longer struct can still be
 * walked. */
typedef struct calot_structs {
    const void* data;
    uint64_t count;
    uint64_t stride; /* bytes */
} calot_structs;

/* As above, to be filled: the callee sets count, never beyond capacity. */
typedef struct calot_structs_out {
    void* data;
    uint64_t count;
    uint64_t capacity;
    uint64_t stride; /* bytes */
} calot_structs_out;

typedef struct calot_pose {
    double position[3];   /* m, world */
    double quaternion[4]; /* unit, body to world */
} calot_pose;

typedef struct calot_twist {
    double linear[3];  /* m/s, world, of the pose's origin */
    double angular[3]; /* rad/s, world */
} calot_twist;

typedef struct calot_wrench {
    double force[3];  /* N, world */
    double torque[3]; /* N m, world, about the point that the user of this struct names */
} calot_wrench;

/* ---- Errors
 * ----------------------------------------------------------------------------------------------------- */

typedef int32_t calot_status;
enum {
    CALOT_OK = 0,
    CALOT_DISCARD = 1, /* this input can't be used; nothing changed, try again with another */
    CALOT_ERROR = 2,   /* this call failed; the instance is unchanged and usable */
    CALOT_FATAL = 3    /* the library can't go on; it is quarantined */
};

enum {
    CALOT_CODE_NONE = 0,
    CALOT_CODE_INVALID_ARGUMENT = 1,
    CALOT_CODE_OUT_OF_RANGE = 2,
    CALOT_CODE_NOT_FINITE = 3,
    CALOT_CODE_WRONG_STATE = 4,
    CALOT_CODE_UNAVAILABLE = 5, /* hardware absent */
    CALOT_CODE_MISSING_ASSET = 6,
    CALOT_CODE_MISSING_SERVICE = 7,
    CALOT_CODE_CORRUPT_STATE = 8,
    CALOT_CODE_UNSUPPORTED = 9,
    CALOT_CODE_VERSION = 10,
    CALOT_CODE_CAPACITY = 11,
    CALOT_CODE_INTERNAL = 12
};

/* Filled by the callee when the status is not CALOT_OK. Texts are UTF-8 and zero-terminated. May be a null
 * pointer. */
typedef struct calot_error {
    uint64_t struct_size;
    int32_t code;      /* CALOT_CODE_... */
    uint32_t reserved; /* 0 */
    char field[96];    /* what is wrong, as the caller knows it: "setup.bending_x[3]" */
    char message[408]; /* what is wrong with it, and the remedy */
} calot_error;

/* ---- Streams of bytes (states, scenes)
 * --------------------------------------------------------------------------- */

typedef struct calot_sink {
    uint64_t struct_size;
    void* self;
    /* Takes all of the bytes, or fails. [any] [not-real-time] */
    calot_status (*write)(void* self, calot_bytes bytes);
} calot_sink;

typedef struct calot_source {
    uint64_t struct_size;
    void* self;
    /* Fills up to buffer.size bytes and returns how many: 0 at the end. Pieces may be of any size. [any]
     * [not-real-time] */
    uint64_t (*read)(void* self, calot_bytes_out buffer);
} calot_source;

/* ---- Parameters
 * -------------------------------------------------------------------------------------------------- */

typedef struct calot_parameter {
    uint64_t struct_size;
    calot_string id;    /* stable, lower-case words with hyphens */
    calot_string title; /* for people */
    calot_string unit;  /* SI, "" for a plain number */
    double minimum;
    double maximum;
    double initial;
    uint32_t is_integer;
    uint32_t reserved;
} calot_parameter;

/* ---- An instance and its life
 * ------------------------------------------------------------------------------------- */
/*
 *   create -> init -> configure (of the kind) -> activate -> step ... -> deactivate -> configure again, or
 * destroy
 *
 * Any call out of this order returns CALOT_ERROR with CALOT_CODE_WRONG_STATE and changes nothing.
 */

typedef struct calot_activation {
    uint64_t struct_size;
    int64_t step_nanoseconds; /* length of one step */
    uint64_t seed;
    uint32_t max_contacts; /* the longest contact list that a step will see */
    uint32_t max_actions;  /* the longest list of actions in one step */
} calot_activation;

typedef struct calot_instance {
    uint64_t struct_size;
    void* self;
    const void* kind; /* functions of the kind: calot_rod, calot_tissue, calot_instrument, calot_device,
                         calot_procedure */
    /* Second part of construction; may read assets. [main] [not-real-time] */
    calot_status (*init)(void* self, calot_error* error);
    /* Sizes every buffer; afterwards steps may run. [main] [not-real-time] */
    calot_status (*activate)(void* self, const calot_activation* activation, calot_error* error);
    /* Ends stepping, joins every thread it started. [main] [not-real-time] */
    calot_status (*deactivate)(void* self, calot_error* error);
    /* Active: back to the state just after activate, with this seed. [main] [not-real-time] */
    calot_status (*reset)(void* self, uint64_t seed, calot_error* error);
    /* In any state; the instance is gone afterwards. [main] [not-real-time] */
    void (*destroy)(void* self);
    /* Active: everything that steers the future, warm starts included. [main] [not-real-time] */
    calot_status (*save_state)(void* self, const calot_sink* sink, calot_error* error);
    /* Active and configured as when saved: goes on bit-exactly. [main] [not-real-time] */
    calot_status (*load_state)(void* self, const calot_source* source, calot_error* error);
    /* [main] [not-real-time] */
    uint32_t (*parameter_count)(void* self);
    /* [main] [not-real-time] */
    calot_status (*parameter_info)(void* self, uint32_t index, calot_parameter* out, calot_error* error);
    /* [main] [not-real-time] */
    calot_status (*get_parameter)(void* self, uint32_t index, double* out, calot_error* error);
    /* Not while active. Out of bounds: clamped, CALOT_OK; not finite: CALOT_DISCARD. [main] [not-real-time]
     */
    calot_status (*set_parameter)(void* self, uint32_t index, double value, calot_error* error);
    /* Functions of an optional feature ("calot.cost/1"), or null. [main] [not-real-time] */
    const void* (*extension)(void* self, calot_string id);
} calot_instance;

/* Extension of any instance: what the parts of the last step cost, for benchmarks. */
#define CALOT_EXTENSION_COST "calot.cost/1"
typedef struct calot_cost {
    uint64_t struct_size;
    /* Measuring is off until asked for. [main] [not-real-time] */
    void (*enable)(void* self, uint32_t on);
    /* [any] [real-time] */
    uint32_t (*part_count)(void* self);
    /* Name of a part ("constraints"), and the seconds that it took in the last step. [simulation] [real-time]
     */
    void (*part)(void* self, uint32_t index, calot_string* name, double* seconds);
} calot_cost;

/* ---- Host and its services
 * ---------------------------------------------------------------------------------------- */

typedef struct calot_host {
    uint64_t struct_size;
    void* self;
    uint32_t abi_major;
    uint32_t abi_minor;
    uint64_t abi_fingerprint;
    /* Functions of a service below, or null if this host lacks it. [any] [not-real-time] */
    const void* (*service)(const struct calot_host* host, calot_string id);
} calot_host;

enum { CALOT_LOG_DEBUG = 0, CALOT_LOG_INFO = 1, CALOT_LOG_WARNING = 2, CALOT_LOG_ERROR = 3 };

#define CALOT_SERVICE_LOG "calot.log/1"
typedef struct calot_log {
    uint64_t struct_size;
    void* self;
    /* [any] [not-real-time] */
    void (*write)(void* self, int32_t level, calot_string message);
    /* Wait-free: copied into a ring and cut at 200 bytes; a full ring drops it and counts. [any] [real-time]
     */
    void (*write_realtime)(void* self, int32_t level, calot_string message);
} calot_log;

#define CALOT_SERVICE_ASSETS "calot.assets/1"
typedef struct calot_assets {
    uint64_t struct_size;
    void* self;
    /* Bytes of an asset that the manifest names, by its path there; they live as long as the instance.
     * [main] [not-real-time] */
    calot_status (*read)(void* self, calot_string path, calot_bytes* out, calot_error* error);
} calot_assets;

#define CALOT_SERVICE_SETTINGS "calot.settings/1"
typedef struct calot_settings {
    uint64_t struct_size;
    void* self;
    /* A setting of this case by its key ("operator.skill"): 1 and the text, or 0. [main] [not-real-time] */
    uint32_t (*text)(void* self, calot_string key, calot_string* out);
} calot_settings;

#define CALOT_SERVICE_RANDOM "calot.random/1"
typedef struct calot_random {
    uint64_t struct_size;
    void* self;
    /* Counter-based (Philox 4x32-10): the same seed, stream and counter always give the same 64 bits. [any]
     * [real-time] */
    uint64_t (*bits)(void* self, uint64_t seed, uint64_t stream, uint64_t counter);
    /* As above, a double in [0, 1). [any] [real-time] */
    double (*uniform)(void* self, uint64_t seed, uint64_t stream, uint64_t counter);
    /* As above, normal with mean 0 and deviation 1. [any] [real-time] */
    double (*normal)(void* self, uint64_t seed, uint64_t stream, uint64_t counter);
} calot_random;

#define CALOT_SERVICE_JOBS "calot.jobs/1"
typedef struct calot_jobs {
    uint64_t struct_size;
    void* self;
    /* Runs job(context, i) for i in [0, count) on the workers and returns when all have ended. Chunks are
     * fixed, so the number of workers changes nothing; reduce what they wrote in index order. [simulation]
     * [real-time] */
    void (*run)(void* self, uint32_t count, void (*job)(void* context, uint32_t index), void* context);
} calot_jobs;

#define CALOT_SERVICE_METRICS "calot.metrics/1"
typedef struct calot_metrics {
    uint64_t struct_size;
    void* self;
    /* Adds one observation of a quantity to the case's record, at this tick. Not finite: dropped and counted.
     * [simulation] [real-time] */
    void (*observe)(void* self, calot_string id, int64_t tick, double value);
} calot_metrics;

/* ---- The library and its factories
 * -------------------------------------------------------------------------------- */

typedef struct calot_model_info {
    uint64_t struct_size;
    calot_string id; /* reverse DNS */
    calot_string title;
    calot_string version; /* of the model: "1.2.0" */
} calot_model_info;

typedef struct calot_factory {
    uint64_t struct_size;
    void* self;
    /* [main] [not-real-time] */
    uint32_t (*count)(void* self);
    /* [main] [not-real-time] */
    calot_status (*info)(void* self, uint32_t index, calot_model_info* out, calot_error* error);
    /* An instance of the model with exactly this id. The host lives longer than the instance. [main]
     * [not-real-time] */
    calot_status (*create)(void* self, calot_string id, const calot_host* host, calot_instance* out,
                           calot_error* error);
} calot_factory;

#define CALOT_KIND_ROD "rod"
#define CALOT_KIND_TISSUE "tissue"
#define CALOT_KIND_INSTRUMENT "instrument"
#define CALOT_KIND_DEVICE "device"
#define CALOT_KIND_PROCEDURE "procedure"

typedef struct calot_library {
    uint64_t struct_size;
    void* self;
    /* The factory for a kind (CALOT_KIND_...), or null. [main] [not-real-time] */
    const calot_factory* (*factory)(void* self, calot_string kind);
} calot_library;

#define CALOT_MAGIC "CALOTPLG"
typedef struct calot_descriptor {
    char magic[8]; /* CALOT_MAGIC, without the terminating zero */
    uint32_t abi_major;
    uint32_t abi_minor;
    uint64_t abi_fingerprint;
} calot_descriptor;

/* A library exports exactly two symbols: the descriptor, a datum that is read before anything of the library
 * is called, and the entry, which is called once, with out->struct_size set. A host that the library can't
 * serve: CALOT_ERROR with CALOT_CODE_VERSION. [main] [not-real-time] */
#define CALOT_DESCRIPTOR_SYMBOL "calot_plugin_descriptor"
#define CALOT_ENTRY_SYMBOL "calot_plugin_entry"
typedef calot_status (*calot_entry)(const calot_host* host, calot_library* out, calot_error* error);

#if defined(__GNUC__)
#define CALOT_EXPORT __attribute__((visibility("default")))
#else
#define CALOT_EXPORT
#endif

#ifdef __cplusplus
}
#endif
#endif
