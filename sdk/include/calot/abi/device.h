/*
 * Calot plugin contract: devices, what the operator's hands hold.
 *
 * A device yields controls and takes forces. Hardware is polled on the device thread, and its samples are
 * latched once a tick. A device that computes (the virtual operator, a replayed case) runs in lockstep on the
 * simulation thread, and may see an observation: only what the screen shows and the hands feel. Devices never
 * read the keyboard themselves: the host hands input events to those that take them.
 */
#ifndef CALOT_ABI_DEVICE_H
#define CALOT_ABI_DEVICE_H

#include "common.h"

#ifdef __cplusplus
extern "C" {
#endif

#define CALOT_MAX_PORTS 3 /* two working channels and the assistant's port */

typedef struct calot_port_controls {
    uint32_t instrument; /* index in the tray, 0: none; exchanged only when withdrawn */
    uint32_t trigger;
    double insertion; /* m beyond the port's mouth; negative: withdrawn */
    double opening;   /* 0 closed .. 1 open */
    double rotation;  /* rad */
} calot_port_controls;

enum { CALOT_PEDAL_CUT = 1u, CALOT_PEDAL_COAGULATE = 2u };
enum {
    CALOT_BUTTON_PAUSE = 1u, /* pause while set */
    CALOT_BUTTON_RESET = 2u  /* the hose is being re-set: insertion and rotation move without effect */
};

/* All values are where things are, not how far they moved. Wheels stay where they are left. */
typedef struct calot_controls {
    uint64_t struct_size;
    double insertion; /* m that the shaft has been pushed in since the case began */
    double rotation;  /* rad about the shaft's axis since then, positive as the base's +z (into the patient)
                         turns right-handed */
    double wheel[2];  /* rad: up (+) and down, left (+) and right */
    uint32_t brake[2];
    calot_port_controls port[CALOT_MAX_PORTS];
    uint32_t pedals;
    uint32_t buttons;
    double suction, air, water; /* 0 .. 1 */
    calot_pose retractor;       /* the assistant's instrument: the pose asked for */
    double retractor_grip;      /* 0 open .. 1 closed */
    double table_tilt[2];       /* rad: head down, left side down */
} calot_controls;

enum {
    CALOT_FEEDBACK_INSERTION = 1u,
    CALOT_FEEDBACK_ROTATION = 2u,
    CALOT_FEEDBACK_WHEELS = 4u,
    CALOT_FEEDBACK_PORTS = 8u
};

typedef struct calot_feedback {
    uint64_t struct_size;
    int64_t tick;
    double insertion_force;             /* N on the operator's hand, + outwards of the patient */
    double rotation_torque;             /* N m, against + rotation */
    double wheel_torque[2];             /* N m */
    double port_force[CALOT_MAX_PORTS]; /* N */
    uint32_t stopped;                   /* the case is paused or ended: forces are zero */
    uint32_t reserved;
} calot_feedback;

typedef struct calot_device_sheet {
    uint64_t struct_size;
    calot_string title;
    uint32_t in_lockstep;      /* polled on the simulation thread once a tick */
    uint32_t feedback;         /* CALOT_FEEDBACK_... that it can render */
    double travel;             /* m of insertion before it must be re-set; 0: unlimited */
    double max_force;          /* N */
    double max_torque;         /* N m */
    double stiffness_limit[2]; /* N/m, N m/rad that its damping and delay allow; 0: any */
    double watchdog;           /* s without send after which it falls to zero force; 0: feels nothing */
    double rate;               /* Hz */
} calot_device_sheet;

typedef struct calot_device {
    uint64_t struct_size;
    /* [main] [not-real-time] */
    calot_status (*sheet)(void* self, calot_device_sheet* out, calot_error* error);
    /* The controls as the case begins: the device goes on from these. Not while active. [main]
     * [not-real-time] */
    calot_status (*configure)(void* self, const calot_controls* start, calot_error* error);
    /* Where the controls are. CALOT_ERROR with CALOT_CODE_UNAVAILABLE: unplugged; the case pauses. Called on
     * the simulation thread if in_lockstep. [device] [real-time] */
    calot_status (*poll)(void* self, int64_t tick, calot_controls* out, calot_error* error);
    /* [device] [real-time] */
    calot_status (*send)(void* self, const calot_feedback* feedback, calot_error* error);
} calot_device;

/* ---- Extension: input events of the host's window
 * ----------------------------------------------------------------- */

enum {
    CALOT_EVENT_KEY = 1,          /* code: SDL scancode; value: 1 down, 0 up */
    CALOT_EVENT_MOUSE_MOVE = 2,   /* x, y: pixels moved */
    CALOT_EVENT_MOUSE_BUTTON = 3, /* code: 1 left, 2 middle, 3 right; value: 1 down, 0 up */
    CALOT_EVENT_MOUSE_WHEEL = 4,  /* y: notches, + away from the user */
    CALOT_EVENT_GAMEPAD_AXIS = 5, /* code: SDL axis; value: -1 .. 1 */
    CALOT_EVENT_GAMEPAD_BUTTON = 6,
    CALOT_EVENT_FOCUS = 7 /* value: 0 lost; everything held is let go */
};

typedef struct calot_input_event {
    uint64_t struct_size;
    uint32_t kind;
    uint32_t code;
    double value;
    double x, y;
} calot_input_event;

typedef struct calot_help_line {
    uint64_t struct_size;
    calot_string input;  /* "W / S" */
    calot_string effect; /* "push the endoscope in / pull it out" */
} calot_help_line;

#define CALOT_EXTENSION_EVENTS "calot.device.events/1"
typedef struct calot_device_events {
    uint64_t struct_size;
    /* Between polls, on the same thread. [device] [real-time] */
    void (*event)(void* self, const calot_input_event* event);
    /* What the help overlay shows. [main] [not-real-time] */
    uint32_t (*help_count)(void* self);
    /* [main] [not-real-time] */
    calot_status (*help)(void* self, uint32_t index, calot_help_line* out, calot_error* error);
} calot_device_events;

/* ---- Extension: observation
 * ----------------------------------------------------------------------------------------- */

enum {
    CALOT_MARKER_PATH = 1,  /* polyline: the optimal path */
    CALOT_MARKER_RING = 2,  /* position, normal (the way to go through), radius: the incision */
    CALOT_MARKER_POINT = 3, /* position, normal: where and how to clip or cut */
    CALOT_MARKER_LINE = 4   /* polyline: connective tissue */
};

typedef struct calot_marker {
    uint64_t struct_size;
    calot_string id;
    uint32_t kind;
    uint32_t is_done; /* drawn dimmed */
    double position[3];
    double normal[3];
    double radius; /* m */
    double colour[4];
    calot_reals polyline; /* 3 for each point, m */
} calot_marker;

typedef struct calot_seen_instrument {
    uint32_t port;
    uint32_t instrument;
    calot_pose tip;
    double opening;
    double protrusion; /* m beyond the channel's mouth */
} calot_seen_instrument;

typedef struct calot_seen_strand {
    uint32_t id;
    uint32_t is_parted;
    double from[3];
    double to[3];
} calot_seen_strand;

typedef struct calot_observation {
    uint64_t struct_size;
    int64_t tick;              /* of the snapshot that it shows */
    calot_pose view;           /* of the endoscope's camera */
    double field_of_view;      /* rad, full angle */
    double fade;               /* 0 clear .. 1 black */
    calot_string task;         /* id of the task at hand, "" between tasks */
    calot_structs markers;     /* of calot_marker */
    calot_structs instruments; /* of calot_seen_instrument */
    calot_structs strands;     /* of calot_seen_strand */
    calot_feedback felt;
} calot_observation;

#define CALOT_EXTENSION_OBSERVATION "calot.device.observation/1"
typedef struct calot_device_observation {
    uint64_t struct_size;
    /* Before each poll, of the snapshot one tick back. Its spans live until the call returns. [simulation]
     * [real-time] */
    calot_status (*observe)(void* self, const calot_observation* observation, calot_error* error);
} calot_device_observation;

#ifdef __cplusplus
}
#endif
#endif
