/* Contacts by brute force, for paranoid runs: no cells, no lists, no windows. A pair of balls is
 * judged by the point of closest approach of their straight relative course: whether the gap there,
 * or at the next event of either, is open. A surface is judged twice: by its own search in a
 * wide window, and by its gap alone, sampled so closely that it cannot have closed between (the gap
 * changes no faster than the ball and the surface move). Two times of one contact may differ where
 * it is grazing; its depth cannot, so all is measured in metres of overlap, against the roundings
 * of the positions it comes from. */
#include "engine/sim_paranoid.h"
#include "geometry/shape.h"

#include <stdlib.h>

#define DEEP 1e-9    /* [m] no two bodies ever overlap by more */
#define LEISURE 1e-3 /* [s] what the wide window reaches beyond the horizon */
#define MOST_ASKED 1000
#define SAMPLES 200 /* of a gap that is nearly closed */

static double radius_of(const struct mill_world *w, int32_t i)
{
    return w->species[w->ball[i].species].radius;
}

static vec3 place(const struct mill_world *w, int32_t i, double t)
{
    const struct mill_ball *b = &w->ball[i];
    const double dt = t - b->t;
    return vec3_axpy(b->r, dt, vec3_axpy(b->v, 0.5 * dt, w->g));
}

static vec3 velocity(const struct mill_world *w, int32_t i, double t)
{
    return vec3_axpy(w->ball[i].v, t - w->ball[i].t, w->g);
}

/* The fastest that any surface moves [m/s] */
static double fastest_surface(const struct mill_world *w)
{
    double fastest = 0.0;
    for (int k = 0; k < w->motions; k++) {
        const struct mill_motion_bounds b = mill_motion_bounds(w->motion[k]);
        fastest = fmax(fastest, b.speed + b.turning * w->drum_radius);
    }
    return fastest;
}

/* Ball j as seen from ball i */
struct pair {
    vec3 d, u;    /* [m], [m/s] */
    double sum;   /* [m] of the radii */
    double slack; /* [m] what roundings may make of a gap of the two */
};

static struct pair relate(const struct mill_schedule *q, int32_t i, int32_t j, double t)
{
    const struct mill_world *w = q->world;
    const double *side = q->cells.side;
    struct pair k;
    k.d = vec3_sub(place(w, j, t), place(w, i, t));
    k.u = vec3_sub(velocity(w, j, t), velocity(w, i, t));
    k.sum = radius_of(w, i) + radius_of(w, j);
    /* squares of distances up to those in the cells around, rounded, are gaps rounded thus */
    const double square = 4.0 * (side[0] * side[0] + side[1] * side[1] + side[2] * side[2]) / k.sum;
    k.slack =
        MILL_SIM_ROUNDINGS * (mill_sim_paranoid_size(w) + square + vec3_norm(k.u) * q->horizon);
    return k;
}

/* How far roundings may take the gap of ball i to a surface until local time `end` [m]: the squares
 * of all it travels through come in, and how far it and the surface get within a tick of the clock
 */
static double surface_slack(const struct mill_schedule *q, int32_t i, double now, double end)
{
    const struct mill_world *w = q->world;
    const double dt = fmax(end - now, 0.0);
    const double swift = vec3_norm(velocity(w, i, now)) + dt * vec3_norm(w->g);
    const double reach = mill_sim_paranoid_size(w) + dt * swift;
    const double ticks = (swift + fastest_surface(w)) * q->horizon;
    return MILL_SIM_ROUNDINGS * (reach + reach * reach / radius_of(w, i) + ticks);
}

/* ---- the contact a plan ends with ---- */

static enum mill_status touch_ball(const struct mill_schedule *q, int32_t i,
                                   const struct mill_plan *plan, struct mill_error *error)
{
    const struct mill_world *w = q->world;
    if (plan->partner < 0 || plan->partner >= w->balls || plan->partner == i)
        return mill_error_set(error, MILL_FAILED, "paranoid: ball %ld plans to meet ball %ld",
                              (long)i, (long)plan->partner);
    if (w->ball[plan->partner].contacts != plan->partner_contacts)
        return MILL_OK; /* stale: found out when it is due */
    const struct pair k = relate(q, i, plan->partner, plan->pair_t);
    const double gap = vec3_norm(k.d) - k.sum;
    /* overlapping and closing means now; how deep is judged as an overlap */
    if (!(gap <= k.slack) || (gap < -k.slack && plan->pair_t > w->ball[i].t))
        return mill_error_set(error, MILL_FAILED,
                              "paranoid: ball %ld and ball %ld shall meet with a gap of %.3g m at "
                              "t = %.17g s",
                              (long)i, (long)plan->partner, gap, w->base + plan->pair_t);
    const double opening = vec3_dot(k.d, k.u);
    /* as deep as they would have been when closest */
    if (opening > 0.0 && !(opening * opening <= 2.0 * k.sum * vec3_dot(k.u, k.u) * k.slack))
        return mill_error_set(error, MILL_FAILED,
                              "paranoid: ball %ld and ball %ld shall meet while they part at %.3g "
                              "m/s at t = %.17g s",
                              (long)i, (long)plan->partner, opening / k.sum,
                              w->base + plan->pair_t);
    return MILL_OK;
}

static enum mill_status touch_surface(const struct mill_schedule *q, int32_t i,
                                      const struct mill_plan *plan, struct mill_error *error)
{
    const struct mill_world *w = q->world;
    const double t = plan->shape_t, radius = radius_of(w, i);
    if (plan->next == MILL_NEXT_SEARCH)
        return MILL_OK; /* no contact, a search to go on; how often costs time alone */
    if (plan->shape < 0 || plan->shape >= w->shapes)
        return mill_error_set(error, MILL_FAILED, "paranoid: ball %ld plans to meet surface %d",
                              (long)i, (int)plan->shape);
    const struct mill_shape *shape = w->shape[plan->shape];
    const char *kind = mill_kind_name[shape->type->kind];
    const vec3 v = velocity(w, i, t);
    const struct mill_pose pose = mill_shape_pose(shape, t);
    const struct mill_contact c = mill_shape_meet(shape, place(w, i, t), v, radius, &pose);
    const double slack = surface_slack(q, i, w->ball[i].t, t);
    if (!(c.gap <= MILL_SHAPE_CLOSED + slack))
        return mill_error_set(
            error, MILL_FAILED,
            "paranoid: ball %ld shall meet a surface (%s) with a gap of %.3g m at t = %.17g s",
            (long)i, kind, c.gap, w->base + t);
    const double opening = vec3_dot(vec3_sub(v, c.velocity), c.normal);
    /* the gap's second derivative, from the ball's and the surface's curvature, at most */
    const double swift = vec3_norm(v) + fastest_surface(w);
    const double around = (shape->hollow > radius ? shape->hollow : w->drum_radius) - radius;
    const double bend = vec3_norm(w->g) + swift * swift * (1.0 / radius + 1.0 / around);
    if (opening > DEEP && !(opening * opening <= 2.0 * bend * slack))
        return mill_error_set(error, MILL_FAILED,
                              "paranoid: ball %ld shall meet a surface (%s) while they part at "
                              "%.3g m/s at t = %.17g s",
                              (long)i, kind, opening, w->base + t);
    return MILL_OK;
}

enum mill_status mill_sim_paranoid_touch(const struct mill_sim_paranoid *p, int32_t i,
                                         const struct mill_plan *plan, struct mill_error *error)
{
    const struct mill_schedule *q = p->schedule;
    enum mill_status status = MILL_OK;
    if (plan->pair_t <= q->horizon)
        status = touch_ball(q, i, plan, error);
    if (status == MILL_OK && plan->shape_t <= q->horizon)
        status = touch_surface(q, i, plan, error);
    return status;
}

enum mill_status mill_sim_paranoid_met(const struct mill_sim_paranoid *p, int32_t i, double now,
                                       struct mill_error *error)
{
    const struct mill_world *w = p->schedule->world;
    const struct mill_plan *due = &p->due;
    if (due->next == MILL_NEXT_PAIR) {
        const struct pair k = relate(p->schedule, i, due->partner, now);
        const double gap = vec3_norm(k.d) - k.sum;
        if (!(gap <= k.slack))
            return mill_error_set(error, MILL_FAILED,
                                  "paranoid: ball %ld and ball %ld met with a gap of %.3g m at t = "
                                  "%.17g s",
                                  (long)i, (long)due->partner, gap, w->base + now);
    } else {
        const struct mill_shape *shape = w->shape[due->shape];
        const struct mill_pose pose = mill_shape_pose(shape, now);
        const double gap = mill_shape_gap(shape, place(w, i, now), radius_of(w, i), &pose);
        if (!(gap <= MILL_SHAPE_CLOSED + surface_slack(p->schedule, i, now, now)))
            return mill_error_set(error, MILL_FAILED,
                                  "paranoid: ball %ld met a surface (%s) with a gap of %.3g m at t "
                                  "= %.17g s",
                                  (long)i, mill_kind_name[shape->type->kind], gap, w->base + now);
    }
    return MILL_OK;
}

/* ---- balls ---- */

static bool are_neighbours(const struct mill_cells *c, int32_t a, int32_t b)
{
    const int32_t plane = c->n[1] * c->n[2];
    return abs(a / plane - b / plane) <= 1 && abs(a % plane / c->n[2] - b % plane / c->n[2]) <= 1 &&
           abs(a % c->n[2] - b % c->n[2]) <= 1;
}

/* No overlap at `now`, and none that grows until `end`. */
static enum mill_status check_pair(const struct mill_schedule *q, int32_t i, int32_t j, double now,
                                   double end, struct mill_error *error)
{
    const struct pair k = relate(q, i, j, now);
    const double distance = vec3_norm(k.d);
    if (!(k.sum - distance <= DEEP))
        return mill_error_set(error, MILL_FAILED,
                              "paranoid: ball %ld and ball %ld overlap by %.3g m at t = %.17g s",
                              (long)i, (long)j, k.sum - distance, q->world->base + now);
    const double b = vec3_dot(k.d, k.u), a = vec3_dot(k.u, k.u);
    if (b >= 0.0 || end <= now)
        return MILL_OK;
    const double nearest = -b / a;
    const double least = vec3_norm(vec3_axpy(k.d, fmin(nearest, end - now), k.u));
    const double depth = fmin(k.sum, distance) - least;
    if (depth <= k.slack)
        return MILL_OK;
    const double miss = vec3_norm(vec3_axpy(k.d, nearest, k.u));
    const double dt = nearest - sqrt(fmax(k.sum * k.sum - miss * miss, 0.0) / a);
    return mill_error_set(error, MILL_FAILED,
                          "paranoid: ball %ld and ball %ld meet at t = %.17g s, unplanned: next is "
                          "%.17g s, when they would overlap by %.3g m",
                          (long)i, (long)j, q->world->base + now + dt, q->world->base + end, depth);
}

static enum mill_status check_balls(struct mill_sim_paranoid *p, int32_t i, double now, bool fresh,
                                    struct mill_error *error)
{
    const struct mill_schedule *q = p->schedule;
    const double mine = mill_plan_time(&q->plan[i]);
    for (int32_t j = 0; j < q->world->balls; j++) {
        if (j == i)
            continue;
        double end = fmin(mine, mill_plan_time(&q->plan[j]));
        if (fresh && are_neighbours(&q->cells, q->cells.cell[i], q->cells.cell[j]))
            end = q->plan[i].pair_t;
        const enum mill_status status = check_pair(q, i, j, now, fmin(end, q->horizon), error);
        if (status != MILL_OK)
            return status;
        p->checks.pairs++;
    }
    return MILL_OK;
}

/* ---- surfaces ---- */

/* A ball's flight past one surface */
struct pass {
    const struct mill_world *world;
    const struct mill_shape *shape;
    int32_t ball;
    double now; /* [s] local */
};

static double gap_at(const struct pass *k, double t)
{
    const struct mill_pose pose = mill_shape_pose(k->shape, t);
    return mill_shape_gap(k->shape, place(k->world, k->ball, t), radius_of(k->world, k->ball),
                          &pose);
}

/* The surface's own search until it says when, or `end` is passed. */
static double meet(const struct pass *k, double window_end, double end, bool touching)
{
    const struct mill_world *w = k->world;
    double t = k->now;
    for (int asked = 0; asked < MOST_ASKED && t < end; asked++) {
        /* no pose of late: what the loop rejects by it is searched here */
        const struct mill_flight f = {.r = place(w, k->ball, t),
                                      .v = velocity(w, k->ball, t),
                                      .g = w->g,
                                      .pull = vec3_norm(w->g),
                                      .travel = INFINITY};
        const struct mill_hit hit = k->shape->type->next_contact(
            k->shape, &f, radius_of(w, k->ball), t, window_end - t, touching && asked == 0);
        if (hit.state != MILL_HIT_ASK_AGAIN)
            return t + hit.t;
        t += hit.t;
    }
    return INFINITY;
}

/* Least gap in [from, to] and when. A gap g cannot close sooner than g / fastest; where it is small
 * the steps are no shorter than a share of the whole. */
static double least_gap(struct mill_sim_paranoid *p, const struct pass *k, double from, double to,
                        double *when)
{
    const struct mill_world *w = k->world;
    const double dt = to - k->now;
    const double fastest = vec3_norm(velocity(w, k->ball, k->now)) + dt * vec3_norm(w->g) +
                           (k->shape->motion ? fastest_surface(w) : 0.0);
    double least = INFINITY;
    for (double t = from;;) {
        const double gap = gap_at(k, t);
        p->checks.samples++;
        if (!(gap >= least)) {
            least = gap;
            *when = t;
        }
        if (!(t < to))
            return least;
        const double next = t + fmax(gap / fastest, (to - from) / SAMPLES);
        t = next > t && next < to ? next : to;
    }
}

static enum mill_status check_surface(struct mill_sim_paranoid *p, const struct pass *k, double end,
                                      bool touching, struct mill_error *error)
{
    const struct mill_world *w = k->world;
    const char *kind = mill_kind_name[k->shape->type->kind];
    const double gap = gap_at(k, k->now);
    p->checks.surfaces++;
    if (!(gap >= -DEEP))
        return mill_error_set(error, MILL_FAILED,
                              "paranoid: ball %ld overlaps a surface (%s) by %.3g m at t = %.17g s",
                              (long)k->ball, kind, -gap, w->base + k->now);
    if (end <= k->now)
        return MILL_OK;
    const double slack = surface_slack(p->schedule, k->ball, k->now, end);
    double when = k->now;
    double least = least_gap(p, k, k->now, end, &when);
    const double contact = meet(k, p->schedule->horizon + LEISURE, end, touching);
    if (contact < end)
        least = fmin(least, least_gap(p, k, contact, end, &when));
    if (!(fmin(gap, 0.0) - least <= slack))
        return mill_error_set(error, MILL_FAILED,
                              "paranoid: ball %ld meets a surface (%s) by t = %.17g s, unplanned: "
                              "next is %.17g s; they would overlap by %.3g m",
                              (long)k->ball, kind, w->base + fmin(contact, when), w->base + end,
                              -least);
    return MILL_OK;
}

enum mill_status mill_sim_paranoid_ball(struct mill_sim_paranoid *p, int32_t i, double now,
                                        bool fresh, int32_t touched, struct mill_error *error)
{
    const struct mill_schedule *q = p->schedule;
    struct mill_world *w = q->world;
    const struct mill_poly_counts counts = w->counts.quartics;
    w->counts.quartics.checked = true;
    const double end = fmin(mill_plan_time(&q->plan[i]), q->horizon);
    enum mill_status status = check_balls(p, i, now, fresh, error);
    for (int32_t s = 0; s < w->shapes && status == MILL_OK; s++) {
        const struct pass k = {w, w->shape[s], i, now};
        if (!q->plan[i].let_go || !w->shape[s]->type->pinches)
            status = check_surface(p, &k, end, s == touched, error);
    }
    if (status == MILL_OK && w->counts.quartics.refuted > 0)
        status = mill_error_set(error, MILL_FAILED,
                                "paranoid: the turns of a quartic refute a contact of ball "
                                "%ld, or that there is none, at t = %.17g s",
                                (long)i, w->base + now);
    w->counts.quartics = counts; /* the searches of the run alone are counted */
    return status;
}
