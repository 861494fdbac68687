/* First positions: random, without overlap. And what finding them takes: the room that surfaces
 * leave, and the lookup of balls by place. */
#ifndef MILLSIM_FILL_H
#define MILLSIM_FILL_H

#include "millsim/start.h"

#include <stdbool.h>
#include <stdint.h>

/* Places all balls of the world (shapes and species are there, ball[i].species set) at random
 * without overlap with each other, or with any shape as it stands at the start, by the setup's
 * seed, and gives each the setup's speed in a random direction. watch may be NULL.
 * MILL_FAULT_NO_ROOM with the numbers that would fit when they do not. */
void mill_fill_random(const struct mill_setup *setup, const struct mill_start_watch *watch,
                      struct mill_world *world, struct mill_fault *fault);

/* Relative to the radii: two bodies nearer than the first are pushed apart to the second. The
 * difference makes a push suffice for a while, so the pushing comes to an end. */
#define MILL_FILL_CLOSE 4e-4
#define MILL_FILL_SPACING 4e-3

/* Cells over the drum's box */
struct mill_fill_lattice {
    vec3 lo;            /* [m] corner of the first cell */
    double per_side[3]; /* [1/m] */
    int32_t n[3];
};

/* ---- the room (fill_lattice.c) ---- */

/* Knows, for every cell of a lattice, which surfaces are near. */
struct mill_fill_room {
    const struct mill_world *world;
    struct mill_pose *pose; /* [shapes] at the start */
    double volume;          /* [m^3] not taken by the rotor */
    struct mill_fill_lattice lattice;
    uint64_t *near; /* bit k of a cell: one of the shapes k, k + 64, ... is within reach */
};

/* reach [m]: the largest radius that will be asked for. False: out of memory. */
bool mill_fill_room_init(struct mill_fill_room *room, const struct mill_world *world, double reach);
void mill_fill_room_free(struct mill_fill_room *room);

/* Is a ball there clear of all surfaces? Rotor at its starting angle. */
bool mill_fill_room_clear(const struct mill_fill_room *room, vec3 r, double radius);

/* Moves a ball off the surfaces that it is too close to; true when it had to. */
bool mill_fill_room_push(const struct mill_fill_room *room, vec3 *r, double radius);

/* ---- balls by place (fill_lattice.c) ---- */

enum { MILL_FILL_CLASSES = 16 };

struct mill_fill_place {
    vec3 r;        /* [m] */
    double radius; /* [m] */
    int32_t next;  /* in its cell's list, -1 at the end */
    int32_t cell;
    int16_t class;
    bool disturbed; /* its neighbourhood has to be looked at */
};

/* The cells of balls of about one size */
struct mill_fill_grid {
    struct mill_fill_lattice lattice;
    double widest;         /* [m] largest radius */
    int32_t balls, placed; /* that belong here; that are in the lists */
    int32_t *head;         /* first ball of each cell, -1: none */
};

struct mill_fill_grids {
    int32_t balls;
    struct mill_fill_place *place;
    struct mill_fill_grid grid[MILL_FILL_CLASSES];
};

/* Balls and radii of the world, none placed. False: out of memory. */
bool mill_fill_grids_init(struct mill_fill_grids *grids, const struct mill_world *world);
void mill_fill_grids_free(struct mill_fill_grids *grids);
void mill_fill_grids_clear(struct mill_fill_grids *grids);

/* Puts ball i, at its place's r, into the lists; again after it was moved. */
void mill_fill_grids_place(struct mill_fill_grids *grids, int32_t i);
void mill_fill_grids_replace(struct mill_fill_grids *grids, int32_t i);

/* Lists all placed balls that a ball of this radius at r may be nearer to than the spacing, and
 * some others; `out` must have room for all balls. */
int32_t mill_fill_grids_near(const struct mill_fill_grids *grids, vec3 r, double radius,
                             int32_t *out);

#endif
