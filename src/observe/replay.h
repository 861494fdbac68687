/* Feeds another program's run to the observers. The balls and the account of the world come from
 * outside. States, impacts and accounts must each come in the order of time, and wait for the next
 * account. Then all before it is processed in the order of time: impacts one by one, and samples
 * when observers want them. At a sample the balls are those of the nearest state, moved in free
 * flight. The account is interpolated linearly between the two accounts around it. */
#ifndef MILL_REPLAY_H
#define MILL_REPLAY_H

#include "base/memory.h"
#include "observe/kinds.h"
#include "observe/observers.h"

/* As in the stream: docs/file-format.md */
struct mill_replay_impact {
    double time;                                        /* [s] */
    double normal_speed, tangential_speed, dissipation; /* [m/s], [J] its normal part */
    double position[3], normal[3];                      /* [m]; unit, into the ball */
    int32_t kind, ball, partner, nothing;
};

/* Numbers of an account: time [s]; energy in springs at this time [J]; for each motion work [J] and
 * impulse about its axis [N m s]; for each kind of contact the energy lost, in all and in the
 * normal direction [J]. Cumulative from t = 0, except the springs'; NaN: not known */
enum { MILL_REPLAY_ACCOUNT = 2 * (1 + MILL_MOTIONS_MOST + MILL_KINDS_MOST) };
size_t mill_replay_length(const struct mill_world *world); /* the same of this world */

/* Waiting items of equal size, the oldest first */
struct mill_replay_queue {
    struct mill_memory_list list;
    size_t begin; /* the first of the list that still waits */
};

struct mill_replay {
    struct mill_world *world;
    struct mill_listed kinds; /* that its impacts can have */
    const struct mill_observers *observers;
    double apart; /* [s] maximum time between a sample and its state */
    double end;   /* [s] planned end of the run: no samples later */
    /* ---- progress ---- */
    double now;       /* [s] everything before this has been processed */
    double at;        /* [s] of the state that the balls are in; -INFINITY: no state yet */
    double impact_at; /* [s] of the last impact received */
    double state_at;  /* [s] of the last state received */
    uint64_t accounts;
    double before[MILL_REPLAY_ACCOUNT], last[MILL_REPLAY_ACCOUNT]; /* accounts */
    struct mill_replay_queue impacts, states;
};

/* For a world at t = 0. World and observers must outlive it. The caller frees it in all cases. */
void mill_replay_init(struct mill_replay *replay, struct mill_world *world,
                      const struct mill_observers *observers, double apart, double end);
void mill_replay_free(struct mill_replay *replay);

/* These return MILL_FAILED, and a line that says why, for impossible input, which is ignored. */

/* values[9 N]: positions [m], velocities [m/s], angular velocities [rad/s], (N, 3) each */
enum mill_status mill_replay_state(struct mill_replay *replay, double time, const double *values,
                                   struct mill_error *error);
enum mill_status mill_replay_impacts(struct mill_replay *replay, size_t count,
                                     const struct mill_replay_impact *impact,
                                     struct mill_error *error);
enum mill_status mill_replay_account(struct mill_replay *replay, const double *account,
                                     struct mill_error *error);

/* Ends the run at `time`. After the last account, works and losses continue at their last rates. */
enum mill_status mill_replay_end(struct mill_replay *replay, double time, struct mill_error *error);

#endif
