/* Declarations shared by the parts of the event loop (sim*.c), and by what checks it (proof/) */
#ifndef MILL_SIM_PRIVATE_H
#define MILL_SIM_PRIVATE_H

#include "engine/bridge.h"
#include "engine/pinch.h"
#include "engine/schedule.h"
#include "millsim/sim.h"

enum { MILL_SIM_OBSERVERS = 8 }; /* at most */

struct mill_watch {
    double last;       /* [s] local time of the last event after which time had advanced */
    uint64_t standing; /* number of events since then */
    double since;      /* [s] local time at which the present millisecond began */
    uint64_t events;   /* number of events in this millisecond */
};

/* A contact, or the end of a relief: what the account and the observers get */
struct mill_sim_entry {
    struct mill_impact impact; /* at the end of a relief: only ball and time */
    double now;                /* [s] local time */
    double reduced_mass;       /* [kg] */
    vec3 velocity;             /* [m/s] of the surface, at the contact */
    double bridge;             /* [J] work of surfaces that slide past a bridge, at most */
    double pressed;            /* [s] for which the ball was pressed since its last contact */
    bool floored;              /* at the rebound floor */
    bool let_go, clear; /* a relief begins with this contact; it ends, and this is no contact */
};

/* Rules change if events come so fast, and the run may fail. */
static inline bool mill_sim_hastes(const struct mill_watch *watch)
{
    return watch->standing > 1000 || watch->events > 10000000;
}

/* Someone who looks at each event of a run on one thread, and at the searches for contacts. The
 * functions return true if all is well; otherwise they have set the sim's status and error. */
struct mill_sim_proof {
    struct mill_poly_check *check;
    bool (*before)(struct mill_sim *sim, int32_t i, double t); /* of the event of ball i */
    bool (*after)(struct mill_sim *sim, int32_t i);
    bool (*all)(struct mill_sim *sim, bool fresh); /* fresh: all balls have been planned now */
    bool (*account)(struct mill_sim *sim);         /* a call of mill_sim_run ends */
};

struct mill_soft;

struct mill_sim {
    struct mill_memory_pool memory; /* of pinches, bridges, met and touch */
    struct mill_world *world;
    struct mill_soft *soft; /* instead of the schedule and what belongs to it; NULL: hard spheres */
    struct mill_schedule *schedule;
    struct mill_pinches pinches;
    struct mill_bridges bridges;
    struct mill_watch watch;
    struct mill_sim_proof *proof; /* NULL: none. The sim frees it. */
    double now;                   /* [s] local */
    int observers;
    struct mill_observer *observer[MILL_SIM_OBSERVERS];
    int impact_observers; /* those of them that look at each impact */
    struct mill_observer *impact_observer[MILL_SIM_OBSERVERS];
    double *met;   /* [balls] [s] simulated time of the last contact; NULL: soft spheres */
    double *touch; /* [species] [s] how long a contact of two of its balls lasts */
    struct mill_sim_slabs *slabs;      /* other threads that carry out events; NULL: none */
    struct mill_memory_list *log;      /* of one of these threads: contacts only go there */
    struct mill_sim_entry entry;       /* the present contact, if there is no log */
    uint64_t told;                     /* the next contacts that the observers have got already, */
    enum mill_status told_status;      /* and what they said to the last of them */
    struct mill_error *error;          /* of the present call of mill_sim_run, as */
    const volatile sig_atomic_t *stop; /* not 0: the call ends; NULL: nothing stops it */
    enum mill_status status;
};

/* Carries out ball i's event at the present time (sim_contact.c). */
void mill_sim_happen(struct mill_sim *sim, int32_t i);

/* The relief of ball i is over (sim_contact.c). */
void mill_sim_clear(struct mill_sim *sim, int32_t i);

/* Ball i has been planned. Has this found it clear? */
static inline void mill_sim_look_clear(struct mill_sim *sim, int32_t i)
{
    if (sim->world->ball[i].relief == MILL_RELIEF_ENDS)
        mill_sim_clear(sim, i);
}

/* Carries out all events before local time `limit` [s], or until the budget is 0 or it stops. */
void mill_sim_take_events(struct mill_sim *sim, double limit, uint64_t *budget);

/* Where to write the next contact (sim_account.c): into the log, or for a while into the loop */
struct mill_sim_entry *mill_sim_next_entry(struct mill_sim *sim);

/* This has happened: it goes to the account and the observers, if there is no log. */
void mill_sim_record(struct mill_sim *sim, const struct mill_sim_entry *entry);

/* Adds the work of a surface that gives this impulse [N s] to a ball, to the account and the part
 * of each motion: the work at the velocity that it adds to that of its carriers. Also the angular
 * impulse about its axis. poses: of all motions at local time `now`; NULL: they are computed. */
void mill_sim_book_work(struct mill_account *account, const struct mill_motion *motion,
                        const struct mill_pose *poses, double now, vec3 impulse, vec3 point,
                        vec3 velocity);

/* A contact of soft spheres has ended: as mill_sim_record, but work and losses are booked. */
void mill_sim_count(struct mill_sim *sim, const struct mill_sim_entry *entry);

/* An observer has returned this status. false: it has failed, and no other one is called any more.
 * If it ends the run, the others still get this event. */
static inline bool mill_sim_heed(struct mill_sim *sim, enum mill_status status)
{
    sim->status = status != MILL_OK ? status : sim->status;
    return sim->status == MILL_OK || sim->status == MILL_ENDED;
}

/* Is the run to stop? Not while the observers are ahead of the balls. */
static inline bool mill_sim_stops(const struct mill_sim *sim)
{
    return sim->told == 0 && sim->stop && *sim->stop;
}

/* The grids have found memory for a ball or, if not `found`, the run ends. */
static inline void mill_sim_need(struct mill_sim *sim, bool found)
{
    if (!found)
        sim->status = mill_error_set(sim->error, MILL_FAILED, "out of memory for the cell grid");
}

/* Moves ball i along its flight to local time t. A ball that is asleep remains where it is. */
static inline void mill_sim_move(struct mill_world *w, int32_t i, double t)
{
    struct mill_ball *b = &w->ball[i];
    if (b->t > t)
        return;
    const double dt = t - b->t;
    b->r = vec3_fly(b->r, b->v, w->g, dt);
    b->v = vec3_axpy(b->v, dt, w->g);
    b->t = t;
}

/* ---- the loop on several threads (sim_slabs.c) ---- */

/* balls, from which schedule_ahead.c saves more time than it takes */
enum { MILL_SIM_LARGE = 20000 };

/* insists: one thread never goes on alone because it is faster. NULL: no memory, or too short */
struct mill_sim_slabs *mill_sim_slabs_create(struct mill_sim *sim, int threads, bool insists);
void mill_sim_slabs_free(struct mill_sim_slabs *slabs);

/* Number of threads that carry out events */
int mill_sim_slabs_count(const struct mill_sim_slabs *slabs);

/* Begins and ends a call of mill_sim_run. Before and after it there is only one thread. */
void mill_sim_slabs_begin(struct mill_sim_slabs *slabs);
void mill_sim_slabs_end(struct mill_sim_slabs *slabs);

/* As mill_sim_take_events, on all threads. It ends with a whole window, also beyond the budget. */
void mill_sim_slabs_run(struct mill_sim *sim, double limit, uint64_t *budget);

/* An event at local time t: counts how many come within short times. */
void mill_sim_watch(struct mill_watch *watch, double t);

/* ---- balls at rest (sim_rest.c) ---- */

/* Before an epoch is planned: balls that have rested fall asleep; those that nothing holds wake. */
void mill_sim_rest_settle(struct mill_sim *sim);

/* Ball i and ball j, one of which may be asleep, meet now with this normal speed [m/s]. Returns the
 * one that stays asleep: it acts like a wall. MILL_NOBODY: both are awake now. */
int32_t mill_sim_rest_meet(struct mill_sim *sim, int32_t i, int32_t j, double speed);

/* Ball i has moved to its event, due now. If it has left its place, those that it held wake up. */
void mill_sim_rest_follow(struct mill_sim *sim, int32_t i);

#endif
