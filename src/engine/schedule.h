/* The schedule: what happens next to each ball (pair contact, surface contact, cell crossing), and
 * the calendar that puts these events in order. */
#ifndef MILLSIM_SCHEDULE_H
#define MILLSIM_SCHEDULE_H

#include "engine/calendar.h"
#include "engine/cells.h"
#include "engine/pairs.h"
#include "geometry/shape.h"
#include "millsim/world.h"

/* What a ball's next event is; of equally early ones the first of this list */
enum mill_next {
    MILL_NEXT_PAIR,    /* a contact with a ball */
    MILL_NEXT_SURFACE, /* a contact with a surface */
    MILL_NEXT_SEARCH,  /* no contact: a search that took too long goes on */
    MILL_NEXT_EXIT     /* it leaves its cell */
};

/* Local times [s], INFINITY: never. One cache line. */
struct mill_plan {
    double pair_t;
    double shape_t; /* of a contact or of a search to go on with; within the cell only */
    double exit_t;
    int32_t partner;
    uint32_t partner_contacts; /* the partner's count when this was found: another now = stale */
    int16_t shape;
    int16_t let_go; /* a pinch was relieved: what pinches is ignored until it is clear of it */
    int16_t face;
    int16_t next;            /* enum mill_next: the earliest of the three times */
    struct mill_event event; /* in the calendar */
};

/* When that is: the calendar has the ball at this time. */
static inline double mill_plan_time(const struct mill_plan *plan)
{
    return mill_least(mill_least(plan->pair_t, plan->shape_t), plan->exit_t);
}

/* A shape within reach of a cell, and what of it */
struct mill_surface {
    int16_t shape;
    int16_t motion; /* of a body that moves, else MILL_NOBODY */
    struct mill_span parts;
    float y, z, cos; /* its sector, a little wider: short, for these lists are read at every plan */
};

/* A motion's pose not long ago: enough to tell which bodies are far away */
struct mill_lately {
    double t, until; /* [s] local: of the pose, NAN: none yet; it serves up to there */
    double most;     /* [s] between poses */
    struct mill_pose pose;
    bool turns;      /* about a line that stands still, across it: */
    vec3 p, q;       /* unit: directions of the laboratory, */
    double cos, sin; /* and of the angle that p has turned by */
    /* what bodies on it see of a ball: */
    double drift;        /* [m/s] of themselves, at most */
    double acceleration; /* [m/s^2] of a ball that stands still, at most */
    double coriolis;     /* [1/s] times its speed: further acceleration */
    double margin;       /* [m] outweighs all rounding */
};

enum { MILL_SCHEDULE_FORESEEN = 8 };

struct mill_schedule {
    struct mill_world *world;
    struct mill_cells cells;
    struct mill_calendar *calendar;
    struct mill_plan *plan;
    struct mill_lately *lately; /* [motions] */
    double pull;                /* [m/s^2] of gravity */
    double horizon;             /* [s] local time beyond which surfaces need not be searched */
    double *radius;             /* [m] of each species */
    int32_t *surface_start;     /* [cells + 1] into surface: the shapes within reach of each cell */
    struct mill_surface *surface;
    int32_t foreseen[MILL_SCHEDULE_FORESEEN]; /* balls whose events come up soon, or MILL_NOBODY */
    uint32_t foresights;                      /* how often the ring above was written */
    mill_pairs_fn *search;
    struct mill_pairs pairs;
    void *scratch; /* of the search */
};

/* Places all balls in cells and plans nothing yet. */
enum mill_status mill_schedule_create(struct mill_world *world, struct mill_schedule **schedule,
                                      struct mill_error *error);
void mill_schedule_free(struct mill_schedule *schedule);

/* Local time begins anew, to be planned as far as `horizon` [s]: nothing is in the calendar, and no
 * pose is known. Every ball must then be planned. */
void mill_schedule_begin(struct mill_schedule *schedule, double horizon);

/* Files the plans, set from outside, and puts each ball i into cell[i]: the order within a cell
 * decides nothing. False when out of memory. */
bool mill_schedule_restore(struct mill_schedule *schedule, const int32_t *cell);

/* Plans ball i anew at local time `now`; its record must stand at `now`. touched: the shape it has
 * just met, or MILL_NOBODY. */
void mill_schedule_ball(struct mill_schedule *schedule, int32_t i, double now, int32_t touched);

/* Takes ball i through the face of its plan: looks only into the cells that came near and keeps the
 * pair contact known so far. Its record must stand at `now`. False when out of memory. */
bool mill_schedule_cross(struct mill_schedule *schedule, int32_t i, double now);

/* Fetches into the cache what events soon to come will need: for mills too large for it, once an
 * event. */
void mill_schedule_ahead(struct mill_schedule *schedule);

/* Deepest overlap of ball i with its neighbours and the surfaces at local time t [m], <= 0: none.
 * What pinches does not count for a ball that was let go. INFINITY: its place is no number. */
double mill_schedule_overlap(struct mill_schedule *schedule, int32_t i, double t);

#endif
