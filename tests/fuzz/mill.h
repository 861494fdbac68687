/* What the targets that run a mill share: the claims that hold after any number of events, checked
 * over all pairs and all surfaces, without the loop's grid and books. */
#ifndef FUZZ_MILL_H
#define FUZZ_MILL_H

#include "fuzz.h"

#include "engine/sim_private.h"
#include "geometry/shape.h"
#include "millsim/sim.h"

#define DEEPEST 1e-9  /* [m] the promise: no two bodies overlap by more */
#define ROUNDED 1e-12 /* [m] what the rounding of decimals in a start file may do */
#define BALANCE 1e-9  /* of the energy turned over: the books close to this */

/* A ball that a blade pinched is let go: it may be inside blades until it is clear of them. */
static inline bool mill_let_go(const struct mill_sim *sim, int32_t i)
{
    return sim && sim->world->ball[i].relief;
}

/* How deep two bodies may overlap: at the start, or later */
static inline double mill_deepest(const struct mill_world *w, const struct mill_sim *sim)
{
    return sim ? DEEPEST : ROUNDED + 1e-15 * (w->drum_radius + w->drum_length);
}

static inline void mill_check_surfaces(const struct mill_world *w, const struct mill_sim *sim,
                                       int32_t i, vec3 r, double t)
{
    const double radius = w->species[w->ball[i].species].radius;
    for (int k = 0; k < w->shapes; k++) {
        const struct mill_shape *s = w->shape[k];
        const struct mill_pose pose = mill_shape_pose(s, t);
        const double gap = mill_shape_gap(s, r, radius, &pose);
        if (mill_let_go(sim, i) && s->pinches)
            continue;
        fuzz_require(gap >= -mill_deepest(w, sim),
                     "ball %ld (%.17g %.17g %.17g) is %g m inside a %s %d", (long)i, r.x, r.y, r.z,
                     -gap, mill_kind_name[s->kind], s->number);
    }
}

/* Nothing overlaps, nothing is lost, all numbers are numbers. sim may be NULL: before the run. */
static inline void mill_check_overlaps(const struct mill_world *w, const struct mill_sim *sim)
{
    const double t = sim ? mill_sim_local_time(sim) : 0.0;
    for (int32_t i = 0; i < w->balls; i++) {
        const vec3 r = mill_world_position(w, i, t), v = mill_world_velocity(w, i, t);
        fuzz_require(isfinite(vec3_norm(r)) && isfinite(vec3_norm(v)) &&
                         isfinite(vec3_norm(w->spin[i])),
                     "ball %ld is nowhere", (long)i);
        mill_check_surfaces(w, sim, i, r, t);
        for (int32_t j = 0; j < i; j++) {
            const vec3 d = vec3_sub(mill_world_position(w, j, t), r);
            const double reach =
                w->species[w->ball[i].species].radius + w->species[w->ball[j].species].radius;
            fuzz_require(vec3_norm(d) - reach >= -mill_deepest(w, sim),
                         "balls %ld and %ld overlap by %g m", (long)j, (long)i,
                         reach - vec3_norm(d));
        }
    }
}

static inline void mill_check_books(const struct mill_world *w, const struct mill_sim *sim)
{
    double error, turnover;
    mill_world_balance(w, mill_sim_local_time(sim), &error, &turnover);
    fuzz_require(error <= BALANCE * turnover, "energy: %g J of %g J are missing", error, turnover);
    fuzz_require(w->counts.overlaps == 0, "%llu overlaps, the deepest %g m",
                 (unsigned long long)w->counts.overlaps, w->counts.largest_overlap);
}

/* Runs `events` events in pieces of `piece` and checks after each; returns false when the run ended
 * itself with a message. */
static inline bool mill_run_checked(struct mill_sim *sim, double until, uint64_t events,
                                    uint64_t piece)
{
    struct mill_error error = {""};
    for (uint64_t done = 0; done < events; done += piece) {
        const double before = mill_sim_time(sim);
        const enum mill_status status = mill_sim_run(sim, until, piece, NULL, &error);
        fuzz_require(mill_sim_time(sim) >= before, "time runs backwards");
        mill_check_overlaps(sim->world, sim);
        mill_check_books(sim->world, sim);
        if (status != MILL_OK) {
            fuzz_require(status == MILL_FAILED, "status %d", (int)status);
            fuzz_require_message(error.text);
            fuzz_require(strncmp(error.text, "paranoid", 8) != 0, "%s", error.text);
            return false;
        }
        if (mill_sim_time(sim) >= until)
            break;
    }
    mill_sim_audit(sim);
    mill_check_books(sim->world, sim);
    return true;
}

#endif
