/*
 * Calot plugin contract: instruments, which go through a working channel, or a port in the abdominal wall.
 *
 * An instrument moves along the +z axis of its mount (the mouth of the channel, or the trocar). It yields
 * collision shapes, the poses of its drawn parts, and actions; what these met comes back one step later.
 */
#ifndef CALOT_ABI_INSTRUMENT_H
#define CALOT_ABI_INSTRUMENT_H

#include "contact.h"

#ifdef __cplusplus
extern "C" {
#endif

enum {
    CALOT_INSTRUMENT_OPENS = 1u,   /* has jaws */
    CALOT_INSTRUMENT_ROTATES = 2u, /* about its own axis */
    CALOT_INSTRUMENT_TRIGGERS = 4u,
    CALOT_INSTRUMENT_POWERED = 8u /* by a pedal */
};

typedef struct calot_instrument_sheet {
    uint64_t struct_size;
    calot_string title;
    uint32_t flags;
    uint32_t part_count;  /* drawn parts */
    uint32_t shape_count; /* collision shapes, at most */
    uint32_t reserved;
    double diameter;      /* m: the channel must be wider */
    double max_insertion; /* m beyond the channel's mouth */
    double max_opening;   /* rad between the jaws */
    double max_speed;     /* m/s along the channel */
    double stiffness;     /* N m2: flexural rigidity that it adds to the bending section */
} calot_instrument_sheet;

/* A drawn part in its own frame. Spans live as long as the instance. */
typedef struct calot_part {
    uint64_t struct_size;
    calot_string name;
    calot_string material;   /* "steel", "polymer", "ceramic" */
    calot_reals position;    /* 3V, m */
    calot_indices triangles; /* 3F */
} calot_part;

typedef struct calot_capsule {
    double from[3];
    double to[3];
    double radius;
} calot_capsule;

typedef struct calot_instrument_setup {
    uint64_t struct_size;
    double channel_diameter; /* m */
    uint32_t port;
    uint32_t is_laparoscopic; /* the mount is a trocar */
} calot_instrument_setup;

typedef struct calot_instrument_input {
    uint64_t struct_size;
    int64_t tick;
    calot_pose mount;
    calot_twist mount_twist;
    double insertion;        /* m beyond the mount, asked for */
    double opening;          /* 0 closed .. 1 open, asked for */
    double rotation;         /* rad, asked for */
    uint32_t trigger;        /* 1: pulled */
    uint32_t pedals;         /* bit 0: cut, bit 1: coagulate */
    calot_structs contacts;  /* of calot_contact; segment is the shape */
    calot_structs reactions; /* of calot_reaction, on the last step's actions */
} calot_instrument_input;

typedef struct calot_instrument_output {
    uint64_t struct_size;
    calot_structs_out shapes;            /* of calot_capsule, world */
    calot_structs_out parts;             /* of calot_pose, one for each drawn part */
    calot_structs_out actions;           /* of calot_action */
    calot_reals_out contact_impulse;     /* 3 for each contact, N s, on the instrument */
    calot_wrench mount;                  /* on the mount, torque about it, mean over the step */
    double insertion, opening, rotation; /* as they are */
    double smoke;                        /* kg/s */
} calot_instrument_output;

typedef struct calot_instrument {
    uint64_t struct_size;
    /* [main] [not-real-time] */
    calot_status (*sheet)(void* self, calot_instrument_sheet* out, calot_error* error);
    /* [main] [not-real-time] */
    calot_status (*part)(void* self, uint32_t index, calot_part* out, calot_error* error);
    /* Not while active. [main] [not-real-time] */
    calot_status (*configure)(void* self, const calot_instrument_setup* setup, calot_error* error);
    /* [simulation] [real-time] */
    calot_status (*step)(void* self, const calot_instrument_input* input, calot_instrument_output* output,
                         calot_error* error);
} calot_instrument;

#ifdef __cplusplus
}
#endif
#endif
