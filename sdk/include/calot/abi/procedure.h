/*
 * Calot plugin contract: procedures, what the clinician performs.
 *
 * A procedure gives a scene, reads snapshots and issues commands. It runs at ticks 16k on the snapshot of
 * that tick; its commands act at tick 16(k+1). It never touches the mechanics.
 */
#ifndef CALOT_ABI_PROCEDURE_H
#define CALOT_ABI_PROCEDURE_H

#include "contact.h"
#include "device.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct calot_task {
    uint64_t struct_size;
    calot_string id;
    calot_string title;
    calot_string goal; /* one sentence to the operator */
    uint32_t is_required;
    uint32_t reserved;
} calot_task;

typedef struct calot_metric {
    uint64_t struct_size;
    calot_string id;
    calot_string title;
    calot_string unit;
    calot_string definition;
    calot_string task; /* id, "" for the whole case */
} calot_metric;

typedef struct calot_failure {
    uint64_t struct_size;
    calot_string id;
    calot_string title;
} calot_failure;

/* Who touches whom. */
typedef struct calot_contact_report {
    uint64_t id;
    uint32_t organ;   /* index in the scene's list; UINT32_MAX: the shaft itself */
    uint32_t region;  /* of the organ */
    uint32_t segment; /* of the shaft; UINT32_MAX - port: an instrument */
    uint32_t reserved;
    double point[3];
    double normal[3];
    double force[3]; /* N on the tissue, mean over the tick */
    double gap;      /* m */
} calot_contact_report;

typedef struct calot_clip {
    uint64_t id;
    uint32_t organ, region;
    uint32_t port;
    uint32_t is_closed; /* both walls are in its jaws */
    double position[3];
    double direction[3]; /* of the jaws */
    double angle;        /* rad between the jaws and the tube's axis */
} calot_clip;

typedef struct calot_snapshot {
    uint64_t struct_size;
    int64_t tick;
    void* self;
    calot_pose tip; /* of the endoscope's camera */
    calot_twist tip_twist;
    calot_pose retractor;
    calot_controls controls;
    calot_feedback feedback;
    calot_reals centreline;    /* 3N, m, base to tip */
    calot_reals velocity;      /* 3N, m/s */
    calot_structs contacts;    /* of calot_contact_report */
    calot_structs clips;       /* of calot_clip */
    calot_structs leaks;       /* of calot_leak (tissue.h) */
    calot_structs events;      /* of calot_tissue_event (tissue.h), since the last update */
    calot_structs strands;     /* of calot_seen_strand */
    calot_structs instruments; /* of calot_seen_instrument */
    calot_structs actions;     /* of calot_action, since the last update */
    /* Pose of an organ's landmark or body by its id ("viscerotomy"): 1, or 0 if there is none. [simulation]
     * [real-time] */
    uint32_t (*pose)(void* self, calot_string id, calot_pose* out);
    /* What the anatomy marks by this id ("viscerotomy", "path"): position, normal, radius and polyline are
     * filled, as it lies in the snapshot; the span lives until the update returns: 1, or 0 if there is none.
     * [simulation] [real-time] */
    uint32_t (*landmark)(void* self, calot_string id, calot_marker* out);
    /* Index of an organ in the scene by its id, UINT32_MAX if there is none. [simulation] [real-time] */
    uint32_t (*organ)(void* self, calot_string id);
    /* Blood, bile, smoke, gas and lens, which the host owns: "blood-volume" in m3 and the like: 1, or 0.
     * [simulation] [real-time] */
    uint32_t (*quantity)(void* self, calot_string id, double* out);
} calot_snapshot;

enum {
    CALOT_COMMAND_MARKER_SET = 1,    /* marker */
    CALOT_COMMAND_MARKER_REMOVE = 2, /* id */
    CALOT_COMMAND_TASK_BEGIN = 3,    /* id */
    CALOT_COMMAND_TASK_COMPLETE = 4, /* id */
    CALOT_COMMAND_METRIC = 5,        /* id, value; text: task */
    CALOT_COMMAND_EVENT = 6,         /* id, text */
    CALOT_COMMAND_MESSAGE = 7,       /* text, to the operator; value: seconds */
    CALOT_COMMAND_GRAVITY = 8,       /* vector, m/s2 */
    CALOT_COMMAND_FADE = 9,          /* value: 0 clear .. 1 black; paused while black */
    CALOT_COMMAND_ASSISTANT = 10,    /* id: what the assistant is asked for; pose */
    CALOT_COMMAND_FAILURE = 11,      /* id */
    CALOT_COMMAND_FINISH = 12        /* the procedure is over */
};

typedef struct calot_command {
    uint64_t struct_size;
    uint32_t kind;
    uint32_t reserved;
    calot_string id;
    calot_string text;
    double value;
    double vector[3];
    calot_pose pose;
    const calot_marker* marker;
} calot_command;

typedef struct calot_commands {
    uint64_t struct_size;
    void* self;
    /* Copied at once. CALOT_ERROR: the queue is full. [simulation] [real-time] */
    calot_status (*push)(void* self, const calot_command* command);
} calot_commands;

/* What the host tells the procedure about the scene it built. */
typedef struct calot_procedure_setup {
    uint64_t struct_size;
    double shaft_radius; /* m, at the tip */
    double shaft_length; /* m */
    uint32_t node_count; /* of the centreline */
    uint32_t reserved;
    const calot_snapshot* start; /* the scene before the first tick; lives until the call returns */
} calot_procedure_setup;

typedef struct calot_procedure {
    uint64_t struct_size;
    /* Writes the scene, TOML (docs/scenes.md). [main] [not-real-time] */
    calot_status (*scene)(void* self, const calot_sink* sink, calot_error* error);
    /* [main] [not-real-time] */
    uint32_t (*task_count)(void* self);
    /* In the order in which they are performed. [main] [not-real-time] */
    calot_status (*task)(void* self, uint32_t index, calot_task* out, calot_error* error);
    /* [main] [not-real-time] */
    uint32_t (*metric_count)(void* self);
    /* [main] [not-real-time] */
    calot_status (*metric)(void* self, uint32_t index, calot_metric* out, calot_error* error);
    /* [main] [not-real-time] */
    uint32_t (*failure_count)(void* self);
    /* [main] [not-real-time] */
    calot_status (*failure)(void* self, uint32_t index, calot_failure* out, calot_error* error);
    /* Not while active. [main] [not-real-time] */
    calot_status (*configure)(void* self, const calot_procedure_setup* setup, calot_error* error);
    /* [simulation] [real-time] */
    calot_status (*update)(void* self, const calot_snapshot* snapshot, const calot_commands* commands,
                           calot_error* error);
} calot_procedure;

#ifdef __cplusplus
}
#endif
#endif
