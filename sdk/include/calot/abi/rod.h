/*
 * Calot plugin contract: rod models, the mechanics of an endoscope's shaft.
 *
 * A rod is a chain of N nodes and N-1 segments from base to tip. Each segment has a material frame (a unit
 * quaternion, material to world) whose third axis is the segment's tangent; at the tip +z looks forward, +y
 * is up and +x is left on the screen. Curvatures are components of the Darboux vector in the material frame:
 * about x, about y, twist about z. The node count is fixed; the length that is not yet in the patient lies in
 * the guide, a straight half-line in which the centreline is held to the axis without friction.
 */
#ifndef CALOT_ABI_ROD_H
#define CALOT_ABI_ROD_H

#include "contact.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Properties of each segment. All spans have N-1 reals; an empty one leaves the property as it is. */
typedef struct calot_rod_segments {
    uint64_t struct_size;
    calot_reals mass_per_length; /* kg/m, > 0 */
    calot_reals radius;          /* m, > 0 */
    calot_reals
        bending_x; /* N m2: flexural rigidity about the material x axis (bends in the y-z plane), > 0 */
    calot_reals bending_y;       /* N m2: about the material y axis, > 0 */
    calot_reals torsion;         /* N m2: torsional rigidity GJ, > 0 */
    calot_reals bending_damping; /* s: ratio of internal viscous moment per curvature rate to flexural
                                    rigidity, >= 0 */
    calot_reals torsion_damping; /* s: likewise for twist, >= 0 */
    calot_reals drag;            /* N s/m2: external drag per length and velocity, >= 0 */
    calot_reals friction; /* factor on the other side's Coulomb coefficient, >= 0; 1 for a bare sheath */
} calot_rod_segments;

typedef struct calot_guide {
    uint32_t present;
    uint32_t reserved;
    double exit[3];      /* m: where the guide ends and the patient begins */
    double direction[3]; /* unit, into the patient */
} calot_guide;

typedef struct calot_rod_setup {
    uint64_t struct_size;
    uint32_t node_count; /* N >= 3 */
    uint32_t reserved;
    calot_reals position; /* 3N, m: where the nodes start */
    calot_reals frame;  /* 4(N-1): material frames; empty: twist-free from the first segment on, y nearest to
                           world -y */
    calot_reals length; /* N-1, m, > 0: rest lengths; empty: as placed */
    calot_reals rest_darboux; /* 3(N-1), 1/m: intrinsic curvature; empty: straight */
    calot_rod_segments segments;
    calot_guide guide;
} calot_rod_setup;

enum {
    CALOT_END_FREE = 0,
    CALOT_END_CLAMPED = 1, /* the end's cross-section is held at pose (all six) */
    CALOT_END_COUPLED = 2, /* base only: held to the guide, driven by the host's virtual coupling */
    CALOT_END_LOADED = 3   /* wrench acts on the end's cross-section, constant over the step */
};

/* The virtual coupling: a capped spring-damper for each base axis, owned by the host, evaluated by the rod
 * within the step so that its stiffness may be high. The target moves at its velocity during the step. */
typedef struct calot_coupling {
    double target;    /* m along the guide, or rad about it, at the step's begin */
    double velocity;  /* m/s or rad/s */
    double stiffness; /* N/m or N m/rad */
    double damping;   /* N s/m or N m s/rad */
    double limit;     /* N or N m: the magnitude never exceeds it */
} calot_coupling;

typedef struct calot_rod_end {
    uint32_t mode;
    uint32_t reserved;
    calot_pose pose;          /* CLAMPED: at the end of the step */
    calot_wrench wrench;      /* LOADED: torque about the end's cross-section */
    calot_coupling insertion; /* COUPLED */
    calot_coupling rotation;  /* COUPLED */
} calot_rod_end;

typedef struct calot_rod_input {
    uint64_t struct_size;
    int64_t tick;      /* at the step's begin */
    double gravity[3]; /* m/s2 */
    calot_rod_end base;
    calot_rod_end tip;
    calot_reals rest_darboux; /* 3(N-1), 1/m: steering; empty: as before */
    calot_structs contacts;   /* of calot_contact */
    double duration; /* s, of this step, no longer than the activation's; 0: the activation's. What the
                        contract says of a step's end is of this one's */
    double farthest; /* m: once a node has gone so far from where the step found it the rod may end the step,
                        so that contacts are looked up anew for the rest of it; 0: it takes all of it */
} calot_rod_input;

/* All spans are the caller's; an empty one is not filled. */
typedef struct calot_rod_output {
    uint64_t struct_size;
    calot_reals_out position;         /* 3N, m */
    calot_reals_out velocity;         /* 3N, m/s */
    calot_reals_out frame;            /* 4(N-1), unit quaternions */
    calot_reals_out angular_velocity; /* 3(N-1), rad/s, world */
    calot_reals_out contact_impulse;  /* 3 for each contact, in its order, N s over the step, on the rod */
    calot_wrench base;                /* on the rod at its base, mean over the step */
    calot_wrench tip;                 /* on the rod at its tip, mean over the step */
    double insertion; /* m: the base's place along the guide, 0 at its exit, negative outside the patient */
    double rotation;  /* rad: the base's turn about the guide since configure, not wrapped */
    double insertion_force; /* N: of the coupling on the rod, along the guide, mean over the step */
    double rotation_torque; /* N m: of the coupling on the rod, about the guide, mean over the step */
    double kinetic_energy;  /* J, at the step's end */
    double bending_energy;  /* J */
    double twist_energy;    /* J */
    double gravity_energy;  /* J, 0 at the world's origin */
    double elapsed; /* s that the step took of its duration; what is clamped has gone the same share of its
                       way. A rod that leaves it 0 took all, and is never asked for less than the activation's
                       step */
} calot_rod_output;

typedef struct calot_rod {
    uint64_t struct_size;
    /* The rod's shape and properties. Not while active. [main] [not-real-time] */
    calot_status (*configure)(void* self, const calot_rod_setup* setup, calot_error* error);
    /* Changes properties between steps (an instrument stiffens the bending section). [simulation] [real-time]
     */
    calot_status (*set_segments)(void* self, const calot_rod_segments* segments, calot_error* error);
    /* One step. DISCARD or ERROR: the state is as before. [simulation] [real-time] */
    calot_status (*step)(void* self, const calot_rod_input* input, calot_rod_output* output,
                         calot_error* error);
    /* The present state, without a step; impulses and wrenches are those of the last step. [simulation]
     * [real-time] */
    calot_status (*read)(void* self, calot_rod_output* output, calot_error* error);
} calot_rod;

#ifdef __cplusplus
}
#endif
#endif
