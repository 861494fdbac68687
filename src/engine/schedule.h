/* The schedule: the next event of each ball (contact with a ball, contact with a surface, exit from
 * its cell), and the calendar, which orders these events by time. */
#ifndef MILLSIM_SCHEDULE_H
#define MILLSIM_SCHEDULE_H

#include "base/memory.h"
#include "engine/calendar.h"
#include "engine/grids.h"
#include "engine/pairs.h"
#include "engine/rest.h"
#include "geometry/shape.h"
#include "millsim/world.h"

/* The type of a ball's next event; of equal times, the first of this list is taken */
enum mill_next {
    MILL_NEXT_PAIR,    /* a contact with a ball */
    MILL_NEXT_SURFACE, /* a contact with a surface */
    MILL_NEXT_SEARCH,  /* no contact: an interrupted search continues */
    MILL_NEXT_EXIT     /* it leaves its cell */
};

/* Local times [s], INFINITY: never. One cache line. */
struct mill_plan {
    double pair_t;
    double shape_t; /* of a contact, or of the continuation of a search; only within the cell */
    double exit_t;
    int32_t partner;
    uint32_t partner_contacts; /* the partner's count then; if it has changed, the plan is stale */
    int16_t shape;
    int16_t face;
    int32_t next;            /* enum mill_next: which of the three times is the earliest */
    struct mill_event event; /* in the calendar */
};

/* The time of the plan's event, which is the ball's time in the calendar */
static inline double mill_plan_time(const struct mill_plan *plan)
{
    return mill_least(mill_least(plan->pair_t, plan->shape_t), plan->exit_t);
}

/* A shape that balls in a cell can touch, and which parts of it */
struct mill_surface {
    int16_t shape;
    int16_t motion; /* of a moving body, else MILL_NOBODY */
    struct mill_span parts;
    /* its sector, slightly widened. Floats, because every plan reads these lists. */
    float y, z, cos;
};

/* A recent pose of a motion. It suffices to find which bodies are far away. */
struct mill_lately {
    double t, until; /* [s] local time of the pose, NAN: none yet; the pose is used until `until` */
    double most;     /* [s] between poses */
    struct mill_pose pose;
    bool turns;      /* it turns about a line at rest. Normal to this line: */
    vec3 p, q;       /* unit directions of the laboratory */
    double cos, sin; /* of the angle by which p has turned */
    /* bounds of the movement of a ball, relative to bodies on this motion: */
    double drift;        /* [m/s] maximum speed of the bodies */
    double acceleration; /* [m/s^2] maximum acceleration of a ball at rest */
    double coriolis;     /* [1/s] times the speed of the ball: additional acceleration */
    double margin;       /* [m] larger than all rounding errors */
};

enum { MILL_SCHEDULE_FORESEEN = 8 };

struct mill_slabs;
struct mill_slab_mark;

struct mill_schedule {
    struct mill_memory_pool memory; /* of plans, poses, radii and what rests */
    struct mill_world *world;
    struct mill_grids grids;
    const struct mill_cells *cells; /* of the finest grid */
    struct mill_rest rest;          /* sleeping balls; they are not in the rows of `grids` */
    struct mill_calendar *calendar;
    struct mill_slabs *slabs; /* they have calendars of their own (slabs.h). NULL: no slabs */
    const struct mill_slab_mark *marks; /* of their cells, to load them ahead; NULL: none */
    struct mill_plan *plan;
    struct mill_lately *lately; /* [motions] */
    double pull;                /* [m/s^2] of gravity */
    double horizon;             /* [s] local time up to which surfaces are searched */
    double *radius;             /* [m] of each species */
    double thinnest, widest;    /* [m] of these radii */
    int32_t *surface_start; /* [cells + 1] into surface: the shapes in reach of balls in a cell */
    struct mill_surface *surface;
    int32_t foreseen[MILL_SCHEDULE_FORESEEN]; /* balls whose events are due soon, or MILL_NOBODY */
    uint32_t foresights;                      /* how often this ring was written */
    mill_pairs_fn *search;
    struct mill_pairs pairs[MILL_PAIRS_TOGETHER];
    void *scratch; /* buffers of the search */
};

/* Puts all balls into cells. Plans no events yet. */
enum mill_status mill_schedule_create(struct mill_world *world, struct mill_schedule **schedule,
                                      struct mill_error *error);
void mill_schedule_free(struct mill_schedule *schedule);

/* A schedule for another thread: it shares all with `schedule` but calendar, slabs, buffers, poses
 * and world; the caller sets the first two. False when out of memory */
bool mill_schedule_share(const struct mill_schedule *schedule, struct mill_world *world,
                         struct mill_schedule *copy);
void mill_schedule_unshare(struct mill_schedule *copy);

/* Begins a new epoch, with plans up to local time `horizon` [s]. The calendar is empty and no pose
 * is known. The caller must then plan every ball. */
void mill_schedule_begin(struct mill_schedule *schedule, double horizon);

/* Forgets all poses: local time has been restarted. */
void mill_schedule_forget(struct mill_schedule *schedule);

/* Enters the plans, which the caller has set, into the calendar, and puts each ball i into cell[i].
 * The order of balls in a cell has no influence on the run. False when out of memory. */
bool mill_schedule_restore(struct mill_schedule *schedule, const int32_t *cell);

/* Makes a new plan for ball i at local time `now`; the time of its record must be `now`. touched:
 * the shape that it has met now, or MILL_NOBODY. */
void mill_schedule_ball(struct mill_schedule *schedule, int32_t i, double now, int32_t touched);

/* Makes new plans for two balls that have met, at the same time: faster than one after the other */
void mill_schedule_two(struct mill_schedule *schedule, int32_t i, int32_t j, double now);

/* Moves ball i into the next cell, as planned, and searches only the cells that are new around it;
 * it keeps the earliest pair contact found before. Its record must be of `now`. False: no memory */
bool mill_schedule_cross(struct mill_schedule *schedule, int32_t i, double now);

/* Loads the data of events due soon. Called once per event, for mills larger than the cache. */
void mill_schedule_ahead(struct mill_schedule *schedule);

/* Forgets which events are due soon: some may be in other hands now. */
void mill_schedule_ahead_again(struct mill_schedule *schedule);

/* Lists in pairs->near the balls near ball i, itself and those asleep too; returns how many. */
int32_t mill_schedule_near(struct mill_schedule *schedule, int32_t i);

/* Deepest overlap of ball i with its neighbours and the surfaces at local time t [m]; <= 0: none. A
 * ball that was let go ignores bodies that can pinch. INFINITY: its position is not a number. */
double mill_schedule_overlap(struct mill_schedule *schedule, int32_t i, double t);

#endif
