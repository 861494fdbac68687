/* A paranoid run: the program checks the changes of each event by brute force. The contact of a
 * pair depends only on the paths and plans of the two balls, and these change only at events of one
 * of them. So it is enough to check each ball of each event against all others. Then "no contact
 * comes before the next event of either" is true for all pairs at all times.
 *
 * The calendar is compared with a linear scan, the position of a ball with the box of its cell, and
 * the account with the energies. Contacts are checked without cells, lists or search intervals. For
 * a pair of balls: by the gap at the closest approach of their straight relative path, or at the
 * next event of either. For a surface: by its own search in a wide interval, and by samples of its
 * gap, so dense that the gap cannot close in between (the gap changes no faster than ball and
 * surface move).
 *
 * Two computed times of one grazing contact may differ, but its depth cannot. So all checks compare
 * an overlap in metres with the rounding errors of the positions. */
#include "proof/paranoid_state.h"

#include "geometry/shape.h"

#include <stdlib.h>

#define ACCOUNT_EVERY 1000 /* events: this check needs the energies of all balls */
#define DEEP 1e-9          /* [m] two bodies must not overlap by more */
#define LEISURE 1e-3       /* [s] how far the wide interval reaches beyond the horizon */
#define MOST_ASKED 1000
#define SAMPLES 200   /* of a gap that is almost closed */
enum { NEAREST = 2 }; /* as the image of a ball */

/* The maximum speed of all surfaces [m/s] */
static double fastest_surface(const struct mill_world *w)
{
    double fastest = 0.0;
    for (int k = 0; k < w->motions; k++)
        fastest = fmax(fastest, mill_motion_fastest(w->motion[k], &w->container.places));
    return fastest;
}

static double gap_at(const struct mill_world *w, int i, const struct mill_shape *shape, double t)
{
    const struct mill_pose pose = mill_shape_pose(shape, t);
    return mill_shape_gap(shape, mill_world_position(w, i, t), mill_world_radius(w, i), &pose);
}

/* Ball j, or its image so many periods along x, relative to ball i */
struct pair {
    vec3 d, u;              /* [m], [m/s] */
    double sum, gap, slack; /* [m] sum of the radii; gap; bound of the rounding errors of the gap */
};

static struct pair relate(const struct mill_sim *sim, int32_t i, int32_t j, int image, double t)
{
    const struct mill_world *w = sim->world;
    const struct mill_grids *grids = &sim->schedule->grids;
    const double *side = grids->own[grids->classes - 1].side;
    struct pair k;
    k.d = vec3_sub(mill_world_position(w, j, t), mill_world_position(w, i, t));
    k.u = vec3_sub(mill_world_velocity(w, j, t), mill_world_velocity(w, i, t));
    k.d.x = image == NEAREST ? mill_world_image(w, k.d.x) : k.d.x + image * grids->period;
    k.sum = mill_world_radius(w, i) + mill_world_radius(w, j);
    k.gap = vec3_norm(k.d) - k.sum;
    /* rounding of the squares of distances, up to those of the cells around, as errors of a gap */
    const double square = 4.0 * (side[0] * side[0] + side[1] * side[1] + side[2] * side[2]) / k.sum;
    k.slack = MILL_SIM_ROUNDINGS *
              (mill_paranoid_size(w) + square + vec3_norm(k.u) * sim->schedule->horizon);
    return k;
}

/* [m] Bound of the rounding errors of ball i's gap to a surface, from one local time to another: of
 * the squares of all distances on the way, and of what moves within the resolution of time */
static double surface_slack(const struct mill_sim *sim, int32_t i, double from, double to)
{
    const struct mill_world *w = sim->world;
    const double dt = fmax(to - from, 0.0);
    const double swift = vec3_norm(mill_world_velocity(w, i, from)) + dt * vec3_norm(w->g);
    const double reach = mill_paranoid_size(w) + dt * swift;
    const double ticks = (swift + fastest_surface(w)) * sim->schedule->horizon;
    return MILL_SIM_ROUNDINGS * (reach + reach * reach / mill_world_radius(w, i) + ticks);
}

static bool touch_ball(struct mill_sim *sim, int32_t i, const struct mill_plan *plan)
{
    const struct mill_world *w = sim->world;
    const int32_t j = plan->partner;
    if (j < 0 || j >= w->balls || j == i)
        return mill_paranoid_fault(sim, NAN, "ball %d has a plan to meet ball %d: nobody", i, j);
    if (w->ball[j].contacts != plan->partner_contacts)
        return true; /* stale: the loop finds this when it is due */
    const struct pair k = relate(sim, i, j, NEAREST, plan->pair_t);
    /* overlapping and closing means a contact now; the depth is checked as an overlap */
    if (!(k.gap <= k.slack) || (k.gap < -k.slack && plan->pair_t > w->ball[i].t))
        return mill_paranoid_fault(sim, plan->pair_t,
                                   "ball %d and ball %d are due to meet with a gap of %.3g m", i, j,
                                   k.gap);
    const double opening = vec3_dot(k.d, k.u);
    /* as deep as they would have been at the closest approach */
    return opening <= 0.0 || opening * opening <= 2.0 * k.sum * vec3_dot(k.u, k.u) * k.slack ||
           mill_paranoid_fault(
               sim, plan->pair_t,
               "ball %d and ball %d are due to meet while they move apart at %.3g m/s", i, j,
               opening / k.sum);
}

static bool touch_surface(struct mill_sim *sim, int32_t i, const struct mill_plan *plan)
{
    const struct mill_world *w = sim->world;
    const double t = plan->shape_t, radius = mill_world_radius(w, i);
    if (plan->next == MILL_NEXT_SEARCH)
        return true; /* no contact: a search continues; how often, influences only the speed */
    if (plan->shape < 0 || plan->shape >= w->shapes)
        return mill_paranoid_fault(sim, NAN, "ball %d has a plan to meet surface %d: none", i,
                                   plan->shape);
    const struct mill_shape *shape = w->shape[plan->shape];
    const char *kind = w->kinds.name[shape->kind];
    const vec3 v = mill_world_velocity(w, i, t);
    const struct mill_pose pose = mill_shape_pose(shape, t);
    const vec3 r = mill_world_position(w, i, t);
    const struct mill_contact c = mill_shape_meet(shape, r, v, radius, &pose);
    const double slack = surface_slack(sim, i, w->ball[i].t, t);
    if (!(c.gap <= MILL_SHAPE_CLOSED + slack))
        return mill_paranoid_fault(
            sim, t, "ball %d is due to meet a surface (%s) with a gap of %.3g m", i, kind, c.gap);
    const double opening = vec3_dot(vec3_sub(v, c.velocity), c.normal);
    /* maximum second derivative of the gap, from the curvatures of ball and surface */
    const double swift = vec3_norm(v) + fastest_surface(w);
    const double around = (shape->hollow > radius ? shape->hollow : w->drum_radius) - radius;
    const double bend = vec3_norm(w->g) + swift * swift * (1.0 / radius + 1.0 / around);
    return opening <= DEEP || opening * opening <= 2.0 * bend * slack ||
           mill_paranoid_fault(
               sim, t, "ball %d is due to meet a surface (%s) while they move apart at %.3g m/s", i,
               kind, opening);
}

bool mill_paranoid_touch(struct mill_sim *sim, int32_t i, const struct mill_plan *plan)
{
    const double horizon = sim->schedule->horizon;
    return (!(plan->pair_t <= horizon) || touch_ball(sim, i, plan)) &&
           (!(plan->shape_t <= horizon) || touch_surface(sim, i, plan));
}

/* Does ball i touch what it has met by the plan that was due? A stale plan must do nothing. */
static bool has_met(struct mill_sim *sim, int32_t i)
{
    const struct mill_world *w = sim->world;
    const struct mill_plan *due = &mill_paranoid_of(sim)->due;
    if (due->next == MILL_NEXT_PAIR) {
        const struct pair k = relate(sim, i, due->partner, NEAREST, sim->now);
        return k.gap <= k.slack ||
               mill_paranoid_fault(sim, sim->now, "ball %d and ball %d met with a gap of %.3g m", i,
                                   due->partner, k.gap);
    }
    const struct mill_shape *shape = w->shape[due->shape];
    const double gap = gap_at(w, i, shape, sim->now);
    return gap <= MILL_SHAPE_CLOSED + surface_slack(sim, i, sim->now, sim->now) ||
           mill_paranoid_fault(sim, sim->now, "ball %d met a surface (%s) with a gap of %.3g m", i,
                               w->kinds.name[shape->kind], gap);
}

/* Checks that there is no overlap now, and none that grows until `end`. */
static bool check_pair(struct mill_sim *sim, int32_t i, int32_t j, int image, double end)
{
    const struct pair k = relate(sim, i, j, image, sim->now);
    mill_paranoid_of(sim)->checks.pairs++;
    if (!(k.gap >= -DEEP))
        return mill_paranoid_fault(sim, sim->now, "ball %d and ball %d overlap by %.3g m", i, j,
                                   -k.gap);
    const double b = vec3_dot(k.d, k.u), a = vec3_dot(k.u, k.u);
    if (b >= 0.0 || end <= sim->now)
        return true;
    const double nearest = -b / a;
    const double least = vec3_norm(vec3_axpy(k.d, fmin(nearest, end - sim->now), k.u));
    const double depth = fmin(k.sum, vec3_norm(k.d)) - least;
    if (depth <= k.slack)
        return true;
    const double miss = vec3_norm(vec3_axpy(k.d, nearest, k.u));
    const double dt = nearest - sqrt(fmax(k.sum * k.sum - miss * miss, 0.0) / a);
    return mill_paranoid_fault(
        sim, NAN,
        "ball %d and ball %d meet at t = %.17g s, unplanned: their next event is at "
        "%.17g s, when they would overlap by %.3g m",
        i, j, sim->world->base + sim->now + dt, sim->world->base + end, depth);
}

/* The least gap [m] to a surface or a sleeping ball found until local time `end`, and when [s] */
struct least {
    double end, gap, when;
};

/* Samples the gap from local time t to the end, to a surface; NULL: to ball j. It cannot close
 * sooner than gap / fastest. If the gap is small, the steps have a fixed minimum length. */
static void sample_gap(struct mill_sim *sim, int32_t i, const struct mill_shape *shape, int32_t j,
                       double t, struct least *least)
{
    const struct mill_world *w = sim->world;
    const double share = (least->end - t) / SAMPLES, dt = least->end - sim->now;
    const double fastest = vec3_norm(mill_world_velocity(w, i, sim->now)) + dt * vec3_norm(w->g) +
                           (shape && shape->motion ? fastest_surface(w) : 0.0);
    for (;;) {
        const double gap = shape ? gap_at(w, i, shape, t) : relate(sim, i, j, 0, t).gap;
        mill_paranoid_of(sim)->checks.samples++;
        if (!(gap >= least->gap)) {
            least->gap = gap;
            least->when = t;
        }
        if (!(t < least->end))
            return;
        const double next = t + fmax(gap / fastest, share);
        t = next > t && next < least->end ? next : least->end;
    }
}

static bool check_surface(struct mill_sim *sim, int32_t i, const struct mill_shape *shape,
                          double end, bool touching)
{
    const struct mill_world *w = sim->world;
    const char *kind = w->kinds.name[shape->kind];
    const double now = sim->now, gap = gap_at(w, i, shape, now);
    mill_paranoid_of(sim)->checks.surfaces++;
    if (!(gap >= -DEEP))
        return mill_paranoid_fault(sim, now, "ball %d overlaps a surface (%s) by %.3g m", i, kind,
                                   -gap);
    if (end <= now)
        return true;
    struct least least = {end, INFINITY, now};
    sample_gap(sim, i, shape, MILL_NOBODY, now, &least);
    /* the surface's own search, until it finds a contact or the end is passed */
    double t = now, contact = HUGE_VAL;
    for (int asked = 0; contact == HUGE_VAL && asked < MOST_ASKED && t < end; asked++) {
        const vec3 r = mill_world_position(w, i, t), v = mill_world_velocity(w, i, t);
        /* without a recent pose, so that bodies which the loop rejects by it are searched here */
        const vec3 g = vec3_scale(w->g, mill_world_asleep(w, i) ? 0.0 : 1.0);
        struct mill_flight f;
        mill_flight_set(&f, r, v, g, vec3_norm(g), &sim->world->counts.quartics);
        const double window = sim->schedule->horizon + LEISURE - t;
        const struct mill_hit hit = shape->type->next_contact(shape, &f, mill_world_radius(w, i), t,
                                                              window, touching && asked == 0);
        t += hit.t;
        contact = hit.state == MILL_HIT_ASK_AGAIN ? HUGE_VAL : t;
    }
    if (contact < end)
        sample_gap(sim, i, shape, MILL_NOBODY, contact, &least);
    return fmin(gap, 0.0) - least.gap <= surface_slack(sim, i, now, end) ||
           mill_paranoid_fault(
               sim, NAN,
               "ball %d meets a surface (%s) by t = %.17g s, unplanned: its next event is at %.17g "
               "s; they would overlap by %.3g m",
               i, kind, w->base + fmin(contact, least.when), w->base + end, -least.gap);
}

/* check_pair() for two balls of which one is asleep: by samples of the gap */
static bool check_sleeping(struct mill_sim *sim, int32_t i, int32_t j, double end)
{
    const struct mill_world *w = sim->world;
    const int32_t flying = mill_world_asleep(w, i) ? j : i, sleeping = flying == i ? j : i;
    const double gap = relate(sim, i, j, 0, sim->now).gap;
    struct least least = {end, gap, sim->now};
    mill_paranoid_of(sim)->checks.pairs++;
    if (gap >= -DEEP && end > sim->now)
        sample_gap(sim, flying, NULL, sleeping, sim->now, &least);
    return (gap >= -DEEP &&
            fmin(gap, 0.0) - least.gap <= surface_slack(sim, flying, sim->now, end)) ||
           mill_paranoid_fault(sim, least.when,
                               "ball %d meets ball %d, which is asleep, unplanned: %.3g m deep",
                               flying, sleeping, -least.gap);
}

bool mill_paranoid_ball(struct mill_sim *sim, int32_t i, bool fresh, int32_t touched)
{
    const struct mill_schedule *q = sim->schedule;
    struct mill_world *w = sim->world;
    const struct mill_poly_counts counts = w->counts.quartics;
    w->counts.quartics.check = sim->proof->check;
    const double mine = fmin(mill_plan_time(&q->plan[i]), q->horizon);
    bool holds = true;
    const int images = q->grids.period > 0.0 ? 3 : 1;
    for (int32_t n = 0; n < w->balls * images && holds; n++) {
        const int32_t j = n / images;
        const int image = n % images - images / 2;
        double end = fmin(mine, mill_plan_time(&q->plan[j]));
        if (mill_world_asleep(w, i) != mill_world_asleep(w, j)) {
            holds = check_sleeping(sim, i, j, end);
            continue;
        }
        if (fresh && mill_grids_near(&q->grids, w->ball[i].species, q->cells->cell[i],
                                     w->ball[j].species, q->cells->cell[j], image))
            end = fmin(q->plan[i].pair_t, q->horizon);
        holds = j == i || check_pair(sim, i, j, image, end);
    }
    for (int32_t s = 0; s < w->shapes && holds; s++)
        if (!w->ball[i].relief || !w->shape[s]->pinches)
            holds = check_surface(sim, i, w->shape[s], mine, s == touched);
    struct mill_paranoid *p = mill_paranoid_of(sim);
    p->checks.quartics = p->quartics.asked;
    if (holds && p->quartics.refuted + p->quartics.doubted > 0)
        holds = mill_paranoid_fault(
            sim, sim->now, "%s of a quartic contradicts the search for a contact of ball %d",
            p->quartics.refuted ? "the closed form" : "another solver", i);
    w->counts.quartics = counts; /* only the searches of the run count */
    return holds;
}

bool mill_paranoid_before(struct mill_sim *sim, int32_t i, double t)
{
    int32_t first;
    struct mill_paranoid *p = mill_paranoid_of(sim);
    p->due = sim->schedule->plan[i];
    p->contacts = sim->world->ball[i].contacts;
    p->asleep = sim->world->counts.asleep;
    if (!(t >= sim->now - MILL_SIM_ROUNDINGS * sim->schedule->horizon))
        return mill_paranoid_fault(sim, t, "the event of ball %d comes %.3g s too late", i,
                                   sim->now - t);
    if (!mill_paranoid_calendar(sim, &first))
        return false;
    const double due = mill_plan_time(&sim->schedule->plan[first]);
    if (first != i || due != t)
        return mill_paranoid_fault(sim, due,
                                   "the calendar takes ball %d at t = %.17g s, but ball %d is due",
                                   i, sim->world->base + t, first);
    return mill_paranoid_place(sim, i, t) && mill_paranoid_touch(sim, i, &p->due);
}

static bool check_ball(struct mill_sim *sim, int32_t i, bool fresh, int32_t touched)
{
    mill_paranoid_of(sim)->checks.predictions++;
    return mill_paranoid_place(sim, i, sim->now) &&
           mill_paranoid_touch(sim, i, &sim->schedule->plan[i]) &&
           mill_paranoid_ball(sim, i, fresh, touched);
}

static bool check_balls(struct mill_sim *sim, bool fresh)
{
    bool holds = true;
    for (int32_t i = 0; i < sim->world->balls && holds; i++)
        holds = check_ball(sim, i, fresh, MILL_NOBODY);
    return holds;
}

bool mill_paranoid_after(struct mill_sim *sim, int32_t i)
{
    struct mill_paranoid *p = mill_paranoid_of(sim);
    const struct mill_plan *due = &p->due;
    const bool met = sim->world->ball[i].contacts != p->contacts;
    const bool pair = met && due->next == MILL_NEXT_PAIR;
    const int32_t touched = met && !pair ? due->shape : MILL_NOBODY;
    const bool woken = p->asleep != sim->world->counts.asleep;
    p->checks.events++;
    return (!met || has_met(sim, i)) && check_ball(sim, i, due->next != MILL_NEXT_EXIT, touched) &&
           (!pair || check_ball(sim, due->partner, true, MILL_NOBODY)) &&
           (!woken || check_balls(sim, false)) &&
           (p->checks.events % ACCOUNT_EVERY != 0 || mill_paranoid_account(sim));
}

bool mill_paranoid_all(struct mill_sim *sim, bool fresh)
{
    int32_t i;
    return mill_paranoid_calendar(sim, &i) && check_balls(sim, fresh) && mill_paranoid_account(sim);
}

/* ---- start and end ---- */

/* A polynomial that begins above zero may be above zero until it rises. */
void mill_paranoid_look(struct mill_poly_check *check, const double c[5], double t_end,
                        bool at_root, double t)
{
    struct mill_paranoid_quartics *q = (struct mill_paranoid_quartics *)check;
    const bool below = at_root || c[0] == 0.0 ? c[1] < 0.0 : c[0] < 0.0;
    if (c[4] == 0.0 || !below || !(t < HUGE_VAL || t_end < HUGE_VAL))
        return;
    q->asked++;
    q->refuted += !mill_quartic_agrees(c, t_end, at_root, t);
    q->doubted += q->second && !q->second(c, t_end, at_root, t);
}

enum mill_status mill_paranoid_start(struct mill_sim *sim, mill_paranoid_opinion *second,
                                     struct mill_error *error)
{
    mill_paranoid_stop(sim);
    struct mill_paranoid *p = calloc(1, sizeof *p);
    if (!p)
        return mill_error_set(error, MILL_FAILED, "out of memory for the checks");
    mill_sim_use_threads(sim, 1); /* the checks look at all balls after each event */
    p->quartics = (struct mill_paranoid_quartics){.check = {mill_paranoid_look}, .second = second};
    p->proof =
        (struct mill_sim_proof){&p->quartics.check, mill_paranoid_before, mill_paranoid_after,
                                mill_paranoid_all, mill_paranoid_account};
    sim->proof = &p->proof;
    sim->error = error;
    sim->status = MILL_OK;
    mill_paranoid_all(sim, false);
    sim->error = NULL;
    return sim->status;
}

void mill_paranoid_stop(struct mill_sim *sim)
{
    free(sim->proof);
    sim->proof = NULL;
}

struct mill_paranoid_checks mill_paranoid_done(const struct mill_sim *sim)
{
    return sim->proof ? mill_paranoid_of(sim)->checks : (struct mill_paranoid_checks){0};
}
