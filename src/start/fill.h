/* First positions of the balls: random and without overlap. Also what the search for them needs:
 * the room that the surfaces leave, and a lookup of balls by place. */
#ifndef MILLSIM_FILL_H
#define MILLSIM_FILL_H

#include "engine/cells.h"
#include "millsim/start.h"

#include <stdbool.h>
#include <stdint.h>

/* Places all balls of the world at random, without overlap with each other or with any surface at
 * its starting place. The shapes, the species and ball[i].species must be set. The random numbers
 * come from the setup's seed. Each ball gets the setup's speed in a random direction. watch may be
 * NULL. MILL_FAULT_NO_ROOM: they do not fit; `fault` then holds the numbers that would. */
void mill_fill_random(const struct mill_setup *setup, const struct mill_start_watch *watch,
                      struct mill_world *world, struct mill_fault *fault);

/* Relative to the radii: bodies nearer than CLOSE are pushed apart to SPACING. SPACING is larger,
 * so that a pushed pair is not pushed again at once, and the pushing comes to an end. */
#define MILL_FILL_CLOSE 4e-4
#define MILL_FILL_SPACING 4e-3

/* ---- the room (fill_lattice.c) ---- */

/* For every cell of a lattice over the container's box: which surfaces are near */
struct mill_fill_room {
    const struct mill_world *world;
    struct mill_pose *pose;    /* [shapes] at the start */
    double volume;             /* [m^3] not taken by the rotor */
    struct mill_cells lattice; /* only its lo, side and n: it holds no balls */
    uint64_t *near; /* bit k of a cell: one of the shapes k, k + 64, ... is within reach */
};

/* reach [m]: the largest radius for the functions below. false: no memory. Always free it. */
bool mill_fill_room_init(struct mill_fill_room *room, const struct mill_world *world, double reach);
void mill_fill_room_free(struct mill_fill_room *room);

/* Is a ball at r clear of all surfaces at their starting places? */
bool mill_fill_room_clear(const struct mill_fill_room *room, vec3 r, double radius);

/* Moves a ball away from the surfaces that it is too close to. true: the ball was moved. */
bool mill_fill_room_push(const struct mill_fill_room *room, vec3 *r, double radius);

/* ---- balls by place (fill_lattice.c) ---- */

enum { MILL_FILL_CLASSES = 16 };

struct mill_fill_place {
    vec3 r;        /* [m] */
    double radius; /* [m] */
    int16_t class;
    bool disturbed; /* the balls around it have to be checked */
};

/* The cells of balls of about one size */
struct mill_fill_grid {
    struct mill_cells cells;
    double widest;         /* [m] largest radius */
    int32_t balls, placed; /* balls of this size class; of these, balls in the cells */
};

struct mill_fill_grids {
    int32_t balls;
    struct mill_fill_place *place;
    bool failed; /* out of memory: balls are missing in the cells */
    struct mill_fill_grid grid[MILL_FILL_CLASSES];
};

/* With the balls and radii of the world, of which `widest` [m] is the largest; no ball is placed
 * yet. false: out of memory. The caller frees them in any case. */
bool mill_fill_grids_init(struct mill_fill_grids *s, const struct mill_world *w, double widest);
void mill_fill_grids_free(struct mill_fill_grids *grids);
void mill_fill_grids_clear(struct mill_fill_grids *grids);

/* place: puts ball i into its cell, at place[i].r. replace: again, after the ball was moved */
void mill_fill_grids_place(struct mill_fill_grids *grids, int32_t i);
void mill_fill_grids_replace(struct mill_fill_grids *grids, int32_t i);

/* Lists all placed balls that may be nearer than the spacing to a ball of this radius at r, and
 * some others. Who reads the list from its end gets the cells in order, and of each cell the ball
 * that came last first. `out` must have room for all balls and MILL_CELL_ROW more. */
int32_t mill_fill_grids_near(const struct mill_fill_grids *s, vec3 r, double radius, int32_t *out);

#endif
