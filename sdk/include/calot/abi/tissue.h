/*
 * Calot plugin contract: tissue models, the mechanics of deformable bodies.
 *
 * What hangs together is one instance: regions of solid (tetrahedra), shell (triangles) and strand (edges),
 * each with a material and a name, over one set of vertices. Attachments to other bodies are anchors:
 * vertices that the host moves and whose forces come back. A step begins at a tick 3k and becomes visible at
 * 3k + 3.
 *
 * Topology: the largest vertex and triangle counts are declared at configure. What a cut changes comes as a
 * generation number, ranges of removed and added surface triangles and, for each new vertex, its parent edge
 * and weight.
 */
#ifndef CALOT_ABI_TISSUE_H
#define CALOT_ABI_TISSUE_H

#include "contact.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct calot_material {
    uint64_t struct_size;
    calot_string name;
    double density;     /* kg/m3, > 0 */
    double youngs;      /* Pa, > 0 */
    double poisson;     /* [0, 0.5) */
    double loss_factor; /* at 1 Hz, >= 0 */
    double thickness;   /* m: of a shell's wall or a strand's diameter */
    double friction;    /* Coulomb coefficient against a bare sheath */
    double tear_force;  /* N: a strand or a tube tears at this pull; 0: never */
    double tear_stress; /* Pa: a solid or shell tears at this stress; 0: never */
    double burn_energy; /* J/m3 to part it by heat; 0: heat does nothing */
} calot_material;

enum { CALOT_REGION_SOLID = 0, CALOT_REGION_SHELL = 1, CALOT_REGION_STRAND = 2 };
enum {
    CALOT_REGION_TUBE = 1u /* has a lumen: it bleeds or leaks where cut unless clipped */
};

typedef struct calot_region {
    uint64_t struct_size;
    calot_string name;
    uint32_t kind;
    uint32_t flags;
    uint32_t material; /* index */
    uint32_t first;    /* first element of its kind's list */
    uint32_t count;    /* elements */
    uint32_t reserved;
    double lumen_pressure; /* Pa */
} calot_region;

typedef struct calot_tissue_setup {
    uint64_t struct_size;
    calot_reals position;         /* 3V, m, at rest and unloaded */
    calot_indices tetrahedra;     /* 4T */
    calot_indices shells;         /* 3S */
    calot_indices strands;        /* 2E */
    calot_indices surface;        /* 3F: the boundary, outward; what collides and is drawn */
    calot_indices surface_region; /* F */
    calot_structs materials;      /* of calot_material */
    calot_structs regions;        /* of calot_region */
    calot_indices anchors;        /* vertices that the host moves */
    uint32_t max_vertices;        /* V at most, after cuts */
    uint32_t max_triangles;       /* F at most, after cuts */
} calot_tissue_setup;

/* An impulse on a surface point; the sum of a contact's over the ticks since the last step. */
typedef struct calot_surface_impulse {
    uint64_t contact_id;
    uint32_t triangle;
    uint32_t reserved;
    double weight[3];  /* of the triangle's corners, sum 1 */
    double impulse[3]; /* N s, on the tissue */
} calot_surface_impulse;

typedef struct calot_tissue_input {
    uint64_t struct_size;
    int64_t tick; /* at the step's begin */
    double gravity[3];
    calot_reals anchor_position; /* 3 for each anchor, m, at the step's end */
    calot_structs impulses;      /* of calot_surface_impulse */
    calot_structs actions;       /* of calot_action */
} calot_tissue_input;

enum {
    CALOT_TISSUE_EVENT_TORN = 1,
    CALOT_TISSUE_EVENT_BURNT = 2,
    CALOT_TISSUE_EVENT_CUT = 3,
    CALOT_TISSUE_EVENT_CLIPPED = 4,
    CALOT_TISSUE_EVENT_PERFORATED = 5
};

typedef struct calot_tissue_event {
    uint32_t kind;
    uint32_t region;
    uint32_t element; /* of the region */
    uint32_t reserved;
    uint64_t action_id; /* what caused it, or 0 */
    double position[3];
    double amount; /* N for torn, J for burnt, m2 for cut */
} calot_tissue_event;

/* A place where a tube is open: blood or bile comes from it. */
typedef struct calot_leak {
    uint32_t region;
    uint32_t open; /* 0: closed by a clip */
    double position[3];
    double direction[3];
    double radius; /* m */
} calot_leak;

typedef struct calot_range {
    uint32_t first;
    uint32_t count;
} calot_range;

typedef struct calot_new_vertex {
    uint32_t vertex;
    uint32_t parent[2];
    uint32_t reserved;
    double weight; /* position = (1 - weight) parent[0] + weight parent[1] */
} calot_new_vertex;

typedef struct calot_tissue_output {
    uint64_t struct_size;
    calot_reals_out position;     /* 3 max_vertices, m */
    calot_reals_out velocity;     /* 3 max_vertices, m/s */
    calot_reals_out anchor_force; /* 3 for each anchor, N, on whatever holds it */
    calot_structs_out dirty;      /* of calot_range: vertices that moved */
    calot_structs_out reactions;  /* of calot_reaction, one for each action */
    calot_structs_out events;     /* of calot_tissue_event */
    calot_structs_out leaks;      /* of calot_leak: all that there are */
    uint32_t vertex_count;
    uint32_t triangle_count;
    uint64_t generation;              /* of the topology; the lists below are empty while it stays */
    calot_indices_out surface;        /* 3 max_triangles */
    calot_indices_out surface_region; /* max_triangles */
    calot_structs_out removed;        /* of calot_range: triangles of the last generation */
    calot_structs_out added;          /* of calot_range: triangles of this one */
    calot_structs_out new_vertices;   /* of calot_new_vertex */
    double kinetic_energy, elastic_energy, gravity_energy; /* J */
} calot_tissue_output;

/* A surface point, and how it answers: for the contact law. */
typedef struct calot_surface_answer {
    uint32_t triangle;
    uint32_t reserved;
    double weight[3];
    double free_position[3]; /* m, at the step's end, without the contact */
    double compliance[9];    /* m/(N s), row-major */
} calot_surface_answer;

typedef struct calot_tissue {
    uint64_t struct_size;
    /* Not while active. [main] [not-real-time] */
    calot_status (*configure)(void* self, const calot_tissue_setup* setup, calot_error* error);
    /* One step. DISCARD or ERROR: the state is as before. [simulation] [real-time] */
    calot_status (*step)(void* self, const calot_tissue_input* input, calot_tissue_output* output,
                         calot_error* error);
    /* The present state, without a step. [simulation] [real-time] */
    calot_status (*read)(void* self, calot_tissue_output* output, calot_error* error);
    /* Fills free_position and compliance of each answer, whose triangle and weight are given. [simulation]
     * [real-time] */
    calot_status (*answer)(void* self, calot_structs_out* answers, calot_error* error);
    /* The surface point nearest to a world point. [simulation] [real-time] */
    calot_status (*closest)(void* self, const double point[3], uint32_t* triangle, double weight[3],
                            calot_error* error);
} calot_tissue;

#ifdef __cplusplus
}
#endif
#endif
