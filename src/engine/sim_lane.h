/* Lanes: what the threads of the event loop work with. Each carries out events and writes down what
 * it has done, so that the loop can order the contacts of all of them, or take all back. */
#ifndef MILL_SIM_LANE_H
#define MILL_SIM_LANE_H

#include "engine/sim_private.h"
#include "engine/slabs.h"

/* An event that was carried out, and how many entries it made */
struct mill_lane_event {
    double t;
    int32_t ball, entries;
};

/* A ball before an event has changed it */
struct mill_lane_before {
    int32_t ball, cell;
    struct mill_ball record;
    vec3 spin;
    double met;
    struct mill_plan plan;
    struct mill_bridge bridge; /* in a mill that can have bridges */
    struct mill_pinch pinch;   /* if it meets a surface, in a mill that can pinch balls */
};

/* What a thread writes down in a window. late: balls whose events it has put off */
struct mill_lane_log {
    struct mill_memory_list event, entry, before, late;
    struct mill_counts counts;
};

/* What a thread works with: copies of world, schedule and loop, which share the balls, and the logs
 * of this window and the last. The last lane is for the events that were put off. */
struct mill_lane {
    struct mill_sim sim;
    struct mill_world world;
    struct mill_schedule schedule;
    struct mill_error error;
    struct mill_lane_log log[2];
    uint64_t done; /* events since the threads' work was last compared */
    bool failed;
};

/* A window. Its number modulo 2 is that of its logs. */
struct mill_window {
    double begin, end; /* [s] local time */
    uint32_t number;
};

/* The lanes of a mill: one for each slab, and the last one */
struct mill_lanes {
    struct mill_sim *sim;
    struct mill_slabs *slabs;
    struct mill_lane *lane;
    int count;
};

/* False when out of memory; free in any case */
bool mill_sim_lane_create(struct mill_lanes *lanes, struct mill_sim *sim, struct mill_slabs *slabs);
void mill_sim_lane_free(struct mill_lanes *lanes);

/* Begins a window: makes the copies as the loop is, and empties the logs. */
void mill_sim_lane_begin(struct mill_lanes *lanes, const struct mill_window *window);

/* Carries out all events of the window inside slab k. It fails after more than `most` events. */
void mill_sim_lane_work(struct mill_lanes *s, int k, const struct mill_window *w, double most);

/* Carries out what was put off, and what comes from it. false: one was too early, or it failed */
bool mill_sim_lane_work_off(struct mill_lanes *lanes, const struct mill_window *window);

/* Takes back all events of a window. Of two, that of the later one comes first. */
void mill_sim_lane_undo(struct mill_lanes *lanes, const struct mill_window *window);

/* Number of events of a window */
uint64_t mill_sim_lane_events(const struct mill_lanes *lanes, const struct mill_window *window);

/* The lane with the first event of a window from numbers at[lanes] on; -1: none, or two at once */
int mill_sim_lane_first(const struct mill_lanes *s, const struct mill_window *w, const size_t *at);

#endif
