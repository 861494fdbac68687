/* The contract of shapes for every body on every motion: the first contact is closed, closing, and
 * nothing comes before it, by a march along the gap that knows nothing but the greatest speed; and
 * its time is that of an oracle in extended precision. */
#include "extended.h"
#include "shape_fixture.h"

#define CLOSED 1e-12 /* [m] */
#define LATE 1e-12   /* [s] */

enum { BODIES = 5, WAYS = MOTION_KINDS + 3 };
static const struct mill_solid *const kinds[BODIES] = {
    &mill_box_solid, &mill_round_cylinder_solid, &mill_round_cone_solid, &mill_round_capsule_solid,
    &mill_round_sphere_solid};

/* One body, as its surfaces, on its motions */
struct one {
    struct chain chain;
    const struct mill_solid *solid;
    struct mill_body body;
    struct mill_shape **shape;
    int shapes;
};

static void size_body(uint64_t *seed, struct one *o, bool inside)
{
    struct mill_body *b = &o->body;
    const double lo = inside ? 0.02 : 1e-3, hi = inside ? 0.06 : 0.04;
    b->inside = inside;
    b->size =
        vec3_make(log_uniform(seed, lo, hi), log_uniform(seed, lo, hi), log_uniform(seed, lo, hi));
    b->radius = log_uniform(seed, lo, 0.5 * hi);
    b->end_radius = log_uniform(seed, lo, 0.5 * hi);
    b->length = log_uniform(seed, lo, 2.0 * hi);
    if (!inside && o->solid == &mill_round_cone_solid && below(seed, 4) == 0)
        b->end_radius = 0.0;
    if (!inside && below(seed, 2))
        for (b->rounding = 1e-2; b->rounding > 0.0 && !o->solid->is_sound(b);)
            b->rounding = b->rounding > 1e-6 ? 0.7 * b->rounding : 0.0;
    ck_assert(o->solid->is_sound(b));
}

/* way 0: it stands; 1..: kinds of motion alone; then chains; the last: round ones about their axis
 */
static void open_one(uint64_t *seed, struct one *o, int kind, bool inside, int way)
{
    *o = (struct one){.solid = kinds[kind]};
    place_body(seed, &o->body);
    size_body(seed, o, inside);
    o->chain = random_chain(seed, way == WAYS - 1 ? 1 : way);
    if (way == 0)
        o->chain.count = 0;
    if (way == WAYS - 1) { /* about its own axis, perhaps carried around a parallel one */
        o->chain.count = 1 + below(seed, 2);
        random_link(seed, &o->chain.is[1], TURN);
        o->chain.is[0].turn.axis = o->body.z;
        o->chain.is[1].turn.axis = vec3_scale(o->body.z, -3.0);
        o->chain.is[o->chain.count - 1].turn.centre = o->body.centre;
        if (o->chain.count == 2)
            o->chain.is[0].turn.angle = 0.0;
    }
    chain_open(&o->chain);
    const struct mill_setup_surface surface = {
        .solid = o->solid, .body = &o->body, .motion = o->chain.count - 1, .kind = MILL_KINDS};
    const struct mill_setup setup = {.motions = o->chain.count, .surfaces = 1, .surface = &surface};
    const struct mill_reach places = {{-1.0, -1.0, -1.0}, {1.0, 1.0, 1.0}, INFINITY};
    ck_assert(mill_shapes_create(&setup, &places, o->chain.link, &o->shape, &o->shapes));
}

static void close_one(struct one *o)
{
    mill_shapes_free(o->shape, o->shapes);
    chain_close(&o->chain);
}

/* The surface nearest to a place */
static const struct mill_shape *nearest(const struct one *o, vec3 r, double t)
{
    const struct mill_shape *best = o->shape[0];
    for (int k = 1; k < o->shapes; k++)
        if (gap_of(o->shape[k], r, 0.0, t) < gap_of(best, r, 0.0, t))
            best = o->shape[k];
    return best;
}

static real wide_gap_at(const struct one *o, const struct flight *f, real t)
{
    const struct mill_flight *p = &f->path;
    struct wide r = wide_axpy(wide_of(p->r), t, wide_of(p->v));
    r = wide_axpy(r, 0.5L * t * t, wide_of(p->g));
    return wide_gap(o->solid, &o->body, wide_in(&o->chain, r, f->now + t)) - f->radius;
}

/* A ball clear of the body; some are next to it, some fly at it or along with it */
static bool random_flight(uint64_t *seed, const struct one *o, struct flight *f)
{
    f->radius = log_uniform(seed, 2e-4, 5e-3);
    f->now = uniform(seed, 0.0, 0.06);
    const struct mill_pose pose = mill_motion_pose(o->chain.top, f->now);
    const double size = o->body.inside ? 0.02 : 0.05;
    const vec3 near = vec3_axpy(o->body.centre, uniform(seed, 0.0, size), direction(seed));
    f->path.r = mill_pose_out(&pose, near);
    const struct mill_shape *s = nearest(o, f->path.r, f->now);
    struct mill_contact c = contact_of(s, f->path.r, f->radius, f->now);
    if (below(seed, 2)) { /* moved up to the body */
        f->path.r = vec3_axpy(f->path.r, log_uniform(seed, 1e-9, 1e-2) - c.gap, c.normal);
        c = contact_of(s, f->path.r, f->radius, f->now);
    }
    f->path.v = vec3_scale(below(seed, 2) ? direction(seed) : vec3_scale(c.normal, -1.0),
                           below(seed, 5) ? log_uniform(seed, 1e-3, 10.0) : 0.0);
    if (below(seed, 3) == 0)
        f->path.v = vec3_add(f->path.v, c.velocity);
    f->path.g = below(seed, 3) ? vec3_scale(direction(seed), uniform(seed, 0.0, 20.0)) : nought;
    return wide_gap_at(o, f, 0.0L) > 1e-12L;
}

/* The first of all surfaces' contacts */
static double first_of_all(const struct one *o, const struct flight *f, double horizon,
                           int *give_ups)
{
    double t = INFINITY;
    for (int k = 0; k < o->shapes; k++)
        t = fmin(t, first_contact(o->shape[k], f, fmin(horizon, t), false, give_ups));
    return t;
}

/* [s] by which the time is off: of a contact that is no graze */
static double lateness(const struct one *o, const struct flight *f, double t)
{
    const real h = 1e-7L, gap = wide_gap_at(o, f, t);
    const real rate = (wide_gap_at(o, f, t + h) - wide_gap_at(o, f, t - h)) / (2.0L * h);
    return rate < -1e-3L ? (double)fabsl(gap / rate) : 0.0;
}

static void contract(int kind, bool inside, int way)
{
    const int approaches = unit_draws(300);
    uint64_t seed = 1 + (uint64_t)(kind + 10 * inside + 100 * way);
    int found = 0, none = 0, give_ups = 0, lost = 0;
    for (int i = 0; i < approaches; i++) {
        struct one o;
        struct flight f;
        open_one(&seed, &o, kind, inside, way);
        if (random_flight(&seed, &o, &f)) {
            const double horizon = log_uniform(&seed, 1e-5, 0.03);
            const double t = first_of_all(&o, &f, horizon, &give_ups);
            const double missed =
                first_below_any(o.shape, o.shapes, &f, fmin(t, horizon), CLOSED, &lost);
            ck_assert_msg(isinf(missed), "flight %d: below at %.17g, before the contact at %.17g",
                          i, missed, t);
            none += isinf(t) != 0;
            found += !isinf(t);
            if (!isinf(t)) {
                const double gap = (double)wide_gap_at(&o, &f, t), late = lateness(&o, &f, t);
                ck_assert_msg(fabs(gap) < CLOSED, "flight %d: a gap of %g m at %.17g", i, gap, t);
                ck_assert_msg(late <= LATE, "flight %d: off by %g s", i, late);
                ck_assert_double_lt(
                    (double)(wide_gap_at(&o, &f, t + 1e-9L) - wide_gap_at(&o, &f, t - 1e-9L)),
                    2e-14);
            }
        }
        close_one(&o);
    }
    ck_assert_int_gt(found, approaches / 20);
    ck_assert_int_gt(none + inside * approaches, approaches / 20);
    ck_assert_int_lt(give_ups, 1 + approaches / 100);
    ck_assert_int_lt(lost, 2 + approaches / 100);
}

SLOW_TEST(bodies_are_met_from_outside_when_they_are, BODIES *WAYS)
{
    contract(_i % BODIES, false, _i / BODIES);
}

SLOW_TEST(bodies_are_met_from_inside_when_they_are, BODIES *WAYS)
{
    contract(_i % BODIES, true, _i / BODIES);
}

/* Gap, normal, point and velocity of a contact belong together. */
LOOP_TEST(a_contact_is_what_the_body_does_there, WAYS)
{
    uint64_t seed = 7 + (uint64_t)_i;
    for (int i = 0; i < unit_draws(1500); i++) {
        struct one o;
        struct flight f;
        open_one(&seed, &o, i % BODIES, i / BODIES % 2, _i);
        if (random_flight(&seed, &o, &f)) {
            const struct mill_shape *s = nearest(&o, f.path.r, f.now);
            const struct mill_contact c = contact_of(s, f.path.r, f.radius, f.now);
            const double h = 1e-9;
            const double rate = (gap_of(s, f.path.r, f.radius, f.now + h) -
                                 gap_of(s, f.path.r, f.radius, f.now - h)) /
                                (2.0 * h);
            ck_assert_double_eq_tol(c.gap, (double)wide_gap_at(&o, &f, 0.0L), 1e-15);
            ck_assert_double_eq_tol(vec3_dot(c.velocity, c.normal), -rate, 1e-4);
            ck_assert_double_eq_tol(vec3_norm(c.normal), 1.0, 1e-14);
            ck_assert_double_eq_tol(gap_of(s, c.point, 0.0, f.now), 0.0, 1e-15);
            ck_assert_double_eq_tol(vec3_norm(vec3_sub(f.path.r, c.point)), c.gap + f.radius,
                                    1e-15);
        }
        close_one(&o);
    }
}

/* The place of the ball in the body's frame is told, as the loop does: what is then said to be far
 * is not met, and nothing else changes. */
SLOW_TEST(a_known_place_hides_no_contact, WAYS - 1)
{
    const int way = 1 + _i;
    uint64_t seed = 11 + (uint64_t)way;
    int found = 0, none = 0;
    for (int i = 0; i < unit_draws(3000); i++) {
        struct one o;
        struct flight f;
        open_one(&seed, &o, i % BODIES, false, way);
        if (random_flight(&seed, &o, &f)) {
            const double window = log_uniform(&seed, 1e-5, 0.03);
            const double ago = below(&seed, 2) ? log_uniform(&seed, 1e-9, 1e-3) : 0.0;
            struct mill_flight path = path_of(f.path.r, f.path.v, f.path.g);
            tell_place(o.chain.top, &f, window, ago, &path);
            const struct mill_shape *s = o.shape[0];
            const struct mill_hit plain = ask(s, &f, window, false);
            const struct mill_hit told =
                s->type->next_contact(s, &path, f.radius, f.now, window, false);
            if (told.state == MILL_HIT_NONE) {
                ck_assert(isinf(first_contact(s, &f, window, false, NULL)));
            } else {
                ck_assert_int_eq(told.state, plain.state);
                ck_assert_double_eq(told.t, plain.t);
            }
            found += told.state == MILL_HIT_CONTACT;
            none += told.state == MILL_HIT_NONE;
        }
        close_one(&o);
    }
    ck_assert_int_gt(found, unit_draws(150));
    ck_assert_int_gt(none, unit_draws(150));
}

/* The quick proof of the search, with the longest time for which it holds */
LOOP_TEST(a_gap_that_is_said_to_stay_open_does, WAYS)
{
    uint64_t seed = 13 + (uint64_t)_i;
    int said = 0;
    for (int i = 0; i < unit_draws(3000); i++) {
        struct one o;
        struct flight f;
        open_one(&seed, &o, i % BODIES, false, _i);
        if (random_flight(&seed, &o, &f)) {
            const struct mill_convex *c = (const struct mill_convex *)o.shape[0];
            const struct mill_flight path = path_of(f.path.r, f.path.v, f.path.g);
            const struct mill_pose pose = mill_shape_pose(&c->base, f.now);
            const struct mill_contact k = contact_of(&c->base, path.r, f.radius, f.now);
            const vec3 centre = mill_pose_out(&pose, c->centre), q = vec3_sub(path.r, centre);
            const vec3 u = vec3_sub(path.v, mill_pose_velocity(&pose, centre));
            const double d1 =
                vec3_dot(k.normal, vec3_sub(path.v, mill_pose_velocity(&pose, path.r)));
            double least = 0.0, most = 0.1;
            for (int n = 0; n < 50; n++) {
                const double h = 0.5 * (least + most);
                *(mill_convex_stays_open(c, &path, q, u, h, k.gap, d1) ? &least : &most) = h;
            }
            for (int n = 1; n <= 50; n++)
                ck_assert_double_gt(gap_at(&c->base, &f, least * n / 50.0), 0.0);
            said += least > 1e-5;
        }
        close_one(&o);
    }
    ck_assert_int_gt(said, unit_draws(1000));
}

/* No ball whose centre is in a box touches what is said to be out of its reach. */
SLOW_TEST(reach_is_never_denied_wrongly, WAYS)
{
    uint64_t seed = 9 + (uint64_t)_i;
    int out = 0;
    for (int i = 0; i < 400; i++) {
        struct one o;
        open_one(&seed, &o, i % BODIES, i / BODIES % 2, _i);
        for (int n = 0; n < 20; n++) {
            const double radius = log_uniform(&seed, 1e-3, 1e-2);
            const vec3 lo = vec3_scale(direction(&seed), uniform(&seed, 0.0, 0.3));
            const vec3 hi =
                vec3_add(lo, vec3_make(uniform(&seed, 0.0, 0.02), uniform(&seed, 0.0, 0.02), 0.01));
            for (int k = 0; k < o.shapes; k++) {
                if (o.shape[k]->type->reachable(o.shape[k], lo, hi, radius))
                    continue;
                out++;
                for (int at = 0; at < 20; at++)
                    ck_assert_double_gt(gap_of(o.shape[k], point_in(&seed, lo, hi), radius,
                                               uniform(&seed, 0.0, 1.0)),
                                        0.0);
            }
        }
        close_one(&o);
    }
    ck_assert_int_gt(out, 500);
}

int main(void)
{
    return unit_run("bodies");
}
