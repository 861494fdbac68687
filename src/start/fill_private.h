/* What the fill_*.c files share: the room that surfaces leave, the lookup of balls by place, and
 * the packing. */
#ifndef MILL_FILL_PRIVATE_H
#define MILL_FILL_PRIVATE_H

#include "base/random.h"
#include "millsim/start.h"
#include "millsim/status.h"

#include <stdbool.h>
#include <stdint.h>

/* Relative to the radii: two bodies nearer than the first are pushed apart to the second. The
 * difference makes a push suffice for a while, so the pushing comes to an end. */
#define MILL_FILL_CLOSE 4e-4
#define MILL_FILL_SPACING 4e-3

/* ---- the room (fill_room.c) ---- */

/* A lattice over the drum's box that knows, for every cell of it, which surfaces are near. */
struct mill_fill_room {
    const struct mill_world *world;
    struct mill_pose *pose; /* [shapes] at the start */
    double volume;          /* [m^3] not taken by the rotor */
    vec3 lo;                /* [m] corner of the first cell */
    double side[3];
    int32_t n[3];
    uint64_t *near; /* bit k of a cell: one of the shapes k, k + 64, ... is within reach */
};

/* reach [m]: the largest radius that will be asked for. False: out of memory. */
bool mill_fill_room_init(struct mill_fill_room *room, const struct mill_world *world, double reach);
void mill_fill_room_free(struct mill_fill_room *room);

/* Is a ball there clear of all surfaces? Rotor at its starting angle. */
bool mill_fill_room_clear(const struct mill_fill_room *room, vec3 r, double radius);

/* Moves a ball off the surfaces that it is too close to; true when it had to. */
bool mill_fill_room_push(const struct mill_fill_room *room, vec3 *r, double radius);

/* ---- balls by place (fill_grids.c) ---- */

#define MILL_FILL_CLASSES 16

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
    vec3 lo;
    double per_side[3]; /* [1/m] */
    int32_t n[3];
    double widest; /* [m] largest radius */
    int32_t balls; /* that belong here */
    int32_t placed;
    int32_t *head; /* first ball of each cell, -1: none */
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

/* ---- the packing (fill_pack.c) ---- */

/* Gives every ball of the world its r. fraction: of the room that the balls fill. MILL_BAD_DECK,
 * with no text: they do not fit. MILL_FAILED, with no text: out of memory. watch may be NULL. */
enum mill_status mill_fill_pack(struct mill_world *world, const struct mill_fill_room *room,
                                struct mill_random *random, double fraction,
                                const struct mill_start_watch *watch);

#endif
