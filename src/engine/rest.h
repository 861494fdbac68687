/* Balls at rest. On a bed at rest, each ball hops without end at the rebound floor. A ball that has
 * stayed where it is for a while therefore falls asleep: it stops, and has no events. Balls in
 * flight meet it as they would meet a wall. A hit above the speed `calm`, the push of a pressed
 * ball, or the loss of what holds it wakes it up. None falls asleep where a moving surface could
 * touch it (design.md). Sleepers have grids of their own, which a mill that moves never reads. */
#ifndef MILLSIM_REST_H
#define MILLSIM_REST_H

#include "engine/pairs.h"

struct mill_schedule;

struct mill_rest {
    double calm;     /* [m/s] maximum speed of a ball that falls asleep; 0: balls never do */
    double hop;      /* [m] how high a ball hops at this speed */
    int32_t epochs;  /* for which a ball must stay where it is before it falls asleep */
    double widening; /* of the grids, see mill_grids_init */
    vec3 up;         /* against gravity */
    /* Of each ball. place: where it has stayed [m]; a ball that moves away gets a new one, and what
     * it has held up wakes up. calm_epochs: it has been there, and calm, at the ends of so many */
    vec3 *place;
    int32_t *calm_epochs;
    struct mill_grids grids; /* sleeping balls in their rows; classes 0: not made yet */
};

/* Which balls of a new schedule can rest? widening: that of its grids. False when out of memory */
bool mill_rest_create(struct mill_schedule *schedule, double widening);

/* [m] How far a ball of this radius may move from its place and still count as being there */
static inline double mill_rest_room(const struct mill_rest *rest, double radius)
{
    return 0.05 * radius + rest->hop;
}

/* Do two balls of these species with centres at `lower` and `upper` nearly touch, and can the first
 * hold up the second? By friction a ball leans on a lower one, or, if not steep, a higher one. */
bool mill_rest_holds(const struct mill_schedule *schedule, int32_t species, vec3 lower,
                     int32_t upper_species, vec3 upper);

/* Moves ball i, whose record is asleep, into the rows of the sleeping balls. False: no memory */
bool mill_rest_lie_down(struct mill_schedule *schedule, int32_t i);

/* Ball i stops where it is: it is asleep and has no events. False when out of memory */
bool mill_rest_sleep(struct mill_schedule *schedule, int32_t i);

/* Ball i is awake at local time `now`, at rest. The caller plans it. False when out of memory */
bool mill_rest_wake(struct mill_schedule *schedule, int32_t i, double now);

/* Lists the sleeping balls near a ball of this species in this cell of the finest grid and returns
 * how many. `near` must have room for all balls and MILL_PAIRS_ROOM more. */
int32_t mill_rest_near(const struct mill_rest *rest, int32_t species, int32_t cell, int32_t *near);

/* Enters an earlier contact of ball i with a sleeping ball into its plan, which has the exit from
 * the cell and the contacts with other balls. If it may hold up sleeping balls, its plan also ends
 * when it can have left its place. Later contacts are not looked for: the search is done
 * again in the next cell. Of contacts at equal times, the one with the smaller ball is taken. */
void mill_rest_plan(struct mill_schedule *schedule, int32_t i, double now);

#endif
