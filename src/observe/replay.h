/* The run of another program, told to the observers of a run: a world whose balls and account are
 * set from outside, and which no event loop touches. States, impacts and accounts come in the order
 * of time, each kind for itself. They wait for the next account: then all that is before it is
 * gone through in the order of time, impacts one by one, and samples when observers want them. At a
 * sample the balls are those of the nearest state, on a free flight to that time; the account is
 * linear between the two around it. */
#ifndef MILL_REPLAY_H
#define MILL_REPLAY_H

#include "observe/observers.h"

/* As in the stream: docs/file-format.md */
struct mill_replay_impact {
    double time;                                        /* [s] */
    double normal_speed, tangential_speed, dissipation; /* [m/s], [J] its normal part */
    double position[3], normal[3];                      /* [m]; unit, into the ball */
    int32_t kind, ball, partner, nothing;
};

/* Cumulative from t = 0; NaN: not known */
struct mill_replay_account {
    double time;    /* [s] */
    double elastic; /* [J] in springs, now */
    struct {
        double work, impulse; /* [J], [N m s] about its axis */
    } motion[MILL_MOTIONS_MOST];
    struct {
        double all, normal; /* [J] lost */
    } loss[MILL_KINDS_MOST];
};

/* Items of one size that wait, the first one first */
struct mill_replay_queue {
    size_t size, begin, end, room; /* [bytes] of an item; of those that wait; there are */
    char *bytes;
};

struct mill_replay {
    struct mill_world *world;
    const struct mill_observers *observers;
    double apart; /* [s] a sample and its state are, at most */
    double end;   /* [s] of the run as planned: nobody samples later */
    /* ---- how far it is ---- */
    double now;       /* [s] all before it has been told */
    double at;        /* [s] of the state that the balls are in; -INFINITY: none yet */
    double impact_at; /* [s] of the last impact that was given */
    double state_at;  /* [s] of the last state that was given */
    double elastic;   /* [J] now */
    uint64_t accounts;
    struct mill_replay_account before, last; /* accounts */
    struct mill_replay_queue impacts, states;
};

/* Of a world at t = 0; both must outlive it. Free it in any case. */
void mill_replay_init(struct mill_replay *replay, struct mill_world *world,
                      const struct mill_observers *observers, double apart, double end);
void mill_replay_free(struct mill_replay *replay);

/* MILL_FAILED, and in one line why what is given cannot be; it is then not taken. */

/* values[9 N]: positions [m], velocities [m/s], angular velocities [rad/s], (N, 3) each */
enum mill_status mill_replay_state(struct mill_replay *replay, double time, const double *values,
                                   struct mill_error *error);
enum mill_status mill_replay_impacts(struct mill_replay *replay, size_t count,
                                     const struct mill_replay_impact *impact,
                                     struct mill_error *error);
enum mill_status mill_replay_account(struct mill_replay *replay,
                                     const struct mill_replay_account *account,
                                     struct mill_error *error);

/* The run ends at `time`; from the last account on it goes on as between the last two. */
enum mill_status mill_replay_end(struct mill_replay *replay, double time, struct mill_error *error);

#endif
