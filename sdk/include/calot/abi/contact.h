/*
 * Calot plugin contract: contacts and actions, which rods, tissues and instruments share.
 *
 * The contact law: contact geometry is one tick old. So a contact carries the other side's contact-free
 * surface position at the tick's end, its compliance and a persistent id. The rod (or the instrument) solves
 * the normal and friction impulses with that compliance; the host applies exactly these, negated, to the
 * owner of the surface.
 */
#ifndef CALOT_ABI_CONTACT_H
#define CALOT_ABI_CONTACT_H

#include "common.h"

#ifdef __cplusplus
extern "C" {
#endif

enum {
    CALOT_CONTACT_SELF = 1u /* the other side is the same rod, at other_segment and other_t */
};

/* One contact, seen from the rod (or the instrument, whose collision shapes then stand for segments). */
typedef struct calot_contact {
    uint64_t id; /* the same from tick to tick while the contact lasts; never 0 */
    uint32_t flags;
    uint32_t segment;     /* which segment of the chain, from the base: 0 .. N-2 */
    double t;             /* where on its axis: 0 at node segment, 1 at node segment + 1 */
    double axis_point[3]; /* m, that point of the axis when the query was made */
    double point[3];      /* m, on the other side's surface: found by the query, moved on with the surface to
                             the step's begin */
    double normal[3];     /* unit, from the other side to the rod */
    double gap; /* m, from point's surface to the rod's about axis_point, along normal; negative inside */
    double friction; /* Coulomb coefficient of the other side, multiplied by the segment's factor */
    double
        free_position[3]; /* m, where point will be at the end of the tick if this contact gave no impulse */
    double compliance[9]; /* m/(N s), row-major: displacement of point at the tick's end for a unit impulse; 0
                             if rigid */
    uint32_t other_segment; /* of a self contact */
    uint32_t reserved;
    double other_t;
} calot_contact;

/* What instruments do to tissue. A grip, a heat or a cut that lasts has a begin and an end with the same id.
 */
enum {
    CALOT_ACTION_GRIP_BEGIN = 1, /* jaw capsule from..to with radius; extent: how wide it stands open, m */
    CALOT_ACTION_GRIP_MOVE = 2,  /* pose of the jaw at the end of the step */
    CALOT_ACTION_GRIP_END = 3,
    CALOT_ACTION_CLIP = 4, /* closed across from..to */
    CALOT_ACTION_CUT = 5,  /* blade: the triangle from, to, from + sweep */
    CALOT_ACTION_HEAT = 6  /* capsule from..to with radius; amount: J delivered in this step */
};

typedef struct calot_action {
    uint64_t id; /* pairs begin, move and end */
    uint32_t kind;
    uint32_t port;     /* which port's instrument does it */
    double from[3];    /* m */
    double to[3];      /* m */
    double sweep[3];   /* m, how far the blade moved since the last step */
    double normal[3];  /* unit: across the jaws or the blade */
    double radius;     /* m */
    double extent;     /* m */
    double amount;     /* J for heat, N for a grip's pinch */
    calot_pose pose;   /* of the jaw */
    calot_twist twist; /* of the jaw */
} calot_action;

/* What an action met: the wrench on the tool, and what happened. Filled by the tissue, handed to the
 * instrument. */
typedef struct calot_reaction {
    uint64_t id;             /* of the action */
    uint32_t held;           /* a grip holds something */
    uint32_t region;         /* of the tissue, that took it; UINT32_MAX: none */
    double wrench_force[3];  /* N, mean over the step, on the tool */
    double wrench_torque[3]; /* N m, about the action's pose */
    double amount;           /* J absorbed, or area cut in m2 */
} calot_reaction;

#ifdef __cplusplus
}
#endif
#endif
