/* What happens next to a ball: the next pair contact, surface contact and cell crossing. */
#ifndef MILLSIM_PREDICT_H
#define MILLSIM_PREDICT_H

#include "engine/calendar.h"
#include "engine/cells.h"
#include "engine/pairs.h"
#include "geometry/shape.h"
#include "millsim/world.h"

/* Local times [s], INFINITY: never. The earliest of the three is the ball's event. One cache line.
 */
struct mill_plan {
    double pair_t;
    double shape_t; /* searched within the cell only */
    double exit_t;
    int32_t partner;
    uint32_t
        partner_contacts; /* the partner's count when this was found: another one now = stale */
    int16_t shape;
    int16_t let_go; /* a pinch was relieved: blades are ignored until the ball is clear of them */
    int16_t face;
    int16_t again; /* shape_t is no contact: a search took too long and goes on from there */
    struct mill_event event; /* in the calendar */
};

/* A shape within reach of a cell, and what of it */
struct mill_surface {
    int32_t shape;
    struct mill_span parts;
};

enum { MILL_PREDICT_FORESEEN = 8 };

struct mill_predict {
    struct mill_world *world;
    struct mill_cells cells;
    struct mill_calendar *calendar;
    struct mill_plan *plan;
    double known_turn;         /* [rad] an angle of the rotor not long ago, */
    struct mill_heading known; /* and its direction */
    double horizon;            /* [s] local time beyond which surfaces need not be searched */
    double *radius;            /* [m] of each species */
    int32_t *surface_start;    /* [cells + 1] into surface: the shapes within reach of each cell */
    struct mill_surface *surface;
    int32_t foreseen[MILL_PREDICT_FORESEEN]; /* balls whose events come up soon, or MILL_NOBODY */
    uint32_t turns;
    mill_pairs_fn *search;
    struct mill_pairs pairs;
};

/* Places all balls in cells and plans nothing yet. */
enum mill_status mill_predict_create(struct mill_world *world, struct mill_predict **predict,
                                     struct mill_error *error);
void mill_predict_free(struct mill_predict *predict);

/* Files the plans, set from outside, and puts each ball i into cell[i]: the order within a cell
 * decides nothing. False when out of memory. */
bool mill_predict_restore(struct mill_predict *predict, const int32_t *cell);

/* Plans ball i anew at local time `now`; its record must stand at `now`. touched: the shape it has
 * just met, or MILL_NOBODY. */
void mill_predict_ball(struct mill_predict *predict, int32_t i, double now, int32_t touched);

/* Takes ball i through the face of its plan: looks only into the cells that came near and keeps the
 * pair contact known so far. Its record must stand at `now`. False when out of memory. */
bool mill_predict_cross(struct mill_predict *predict, int32_t i, double now);

/* Fetches into the cache what events soon to come will need: for mills too large for it, once an
 * event. */
void mill_predict_ahead(struct mill_predict *predict);

/* Deepest overlap of ball i with its neighbours and the surfaces at local time t [m], <= 0: none.
 * Blades do not count for a ball that was let go. */
double mill_predict_overlap(struct mill_predict *predict, int32_t i, double t);

#endif
