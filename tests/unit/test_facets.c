/* The contract of shapes for meshes on every motion: the first contact is closed, closing, nothing
 * comes before it, and its time is that of all triangles one by one in extended precision. */
#include "deck/deck_private.h"
#include "facets_fixture.h"

#define CLOSED 1e-12 /* [m] */
#define LATE 1e-12   /* [s] */

enum { WAYS = MOTION_KINDS + 2 };
static struct form form;
static const struct mill_reach places = {{-1.0, -1.0, -1.0}, {1.0, 1.0, 1.0}, INFINITY};

/* One mesh on its motions */
struct one {
    struct chain chain;
    struct mill_shape *shape;
};

static struct mill_shape *shape_of(const struct mill_body *is, const struct mill_motion *motion)
{
    struct mill_shape *shape = lone_shape(&mill_facets_solid, is, motion, &places);
    ck_assert_ptr_nonnull(shape);
    return shape;
}

/* way 0: it stands; 1..: kinds of motion alone; then chains. A lump or a box */
static void open_one(uint64_t *seed, struct one *o, bool inside, int way)
{
    const double radius = log_uniform(seed, inside ? 0.02 : 2e-3, 0.05);
    if (below(seed, 4)) {
        form_lump(seed, &form, 3 + below(seed, 8), 1 + below(seed, 5), radius,
                  uniform(seed, 0.0, 0.6));
    } else {
        form_open(&form);
        form_add_box(&form, nought,
                     vec3_scale(vec3_make(1.0, 0.7, uniform(seed, 0.1, 2.0)), radius));
    }
    place_body(seed, &form.is);
    form.is.inside = inside;
    o->chain = random_chain(seed, way);
    if (way == 0)
        o->chain.count = 0;
    chain_open(&o->chain);
    o->shape = shape_of(&form.is, o->chain.top);
}

static void close_one(struct one *o)
{
    lone_shape_free(o->shape);
    chain_close(&o->chain);
}

static real wide_gap_at(const struct one *o, const struct flight *f, real t)
{
    const struct mill_flight *p = &f->path;
    struct wide r = wide_axpy(wide_of(p->r), t, wide_of(p->v));
    r = wide_axpy(r, 0.5L * t * t, wide_of(p->g));
    return wide_from_mesh(&form.is, wide_in(&o->chain, r, f->now + t)) - f->radius;
}

/* A ball clear of the mesh; some are next to it, some fly at it or along with it */
static bool random_flight(uint64_t *seed, const struct one *o, struct flight *f)
{
    f->radius = log_uniform(seed, 2e-4, 5e-3);
    f->now = uniform(seed, 0.0, 0.06);
    const struct mill_pose pose = mill_motion_pose(o->chain.top, f->now);
    const vec3 near = vec3_axpy(form.is.centre, uniform(seed, 0.0, form.is.inside ? 0.02 : 0.06),
                                direction(seed));
    f->path.r = mill_pose_out(&pose, near);
    struct mill_contact c = contact_of(o->shape, f->path.r, f->radius, f->now);
    if (below(seed, 2)) { /* moved up to the mesh */
        f->path.r = vec3_axpy(f->path.r, log_uniform(seed, 1e-9, 1e-2) - c.gap, c.normal);
        c = contact_of(o->shape, f->path.r, f->radius, f->now);
    }
    f->path.v = vec3_scale(below(seed, 2) ? direction(seed) : vec3_scale(c.normal, -1.0),
                           below(seed, 5) ? log_uniform(seed, 1e-3, 10.0) : 0.0);
    if (below(seed, 3) == 0)
        f->path.v = vec3_add(f->path.v, c.velocity);
    f->path.g = below(seed, 3) ? vec3_scale(direction(seed), uniform(seed, 0.0, 20.0)) : nought;
    return wide_gap_at(o, f, 0.0L) > 1e-12L;
}

/* [s] by which the time is off: of a contact that is no graze */
static double lateness(const struct one *o, const struct flight *f, double t)
{
    const real h = 1e-7L, gap = wide_gap_at(o, f, t);
    const real rate = (wide_gap_at(o, f, t + h) - wide_gap_at(o, f, t - h)) / (2.0L * h);
    return rate < -1e-3L ? (double)fabsl(gap / rate) : 0.0;
}

/* A place of late and how far the ball gets are told as the schedule does: nothing changes. */
static void ask_as_the_schedule_does(uint64_t *seed, const struct one *o, const struct flight *f,
                                     double horizon, double t)
{
    struct mill_flight path = path_of(f->path.r, f->path.v, f->path.g);
    const struct mill_pose late = mill_motion_pose(o->chain.top, f->now - 1e-5);
    path.place = mill_pose_in(&late, path.r);
    path.travel = 0.0;
    for (int k = 0; k <= 100; k++) {
        const struct mill_pose pose = mill_motion_pose(o->chain.top, f->now + horizon * k / 100.0);
        const vec3 at = mill_pose_in(&pose, vec3_fly(path.r, path.v, path.g, horizon * k / 100.0));
        path.travel = fmax(path.travel, vec3_norm(vec3_sub(at, path.place)));
    }
    path.travel = path.travel * uniform(seed, 1.01, 1.5) + 1e-6;
    const struct mill_hit hit =
        o->shape->type->next_contact(o->shape, &path, f->radius, f->now, horizon, false);
    if (hit.state == MILL_HIT_ASK_AGAIN)
        return;
    ck_assert_int_eq(isinf(hit.t) != 0, isinf(t) != 0);
    if (isinf(t))
        return;
    /* but for rounding: other facets are in reach, and other steps are made */
    ck_assert_double_lt(fabs((double)wide_gap_at(o, f, hit.t)), CLOSED);
    ck_assert_double_le(lateness(o, f, hit.t), LATE);
}

/* Ten approaches to each of so many meshes */
static void contract(int way, bool inside, int meshes)
{
    meshes = unit_draws(meshes);
    uint64_t seed = 1 + (uint64_t)(10 * way + inside);
    int found = 0, none = 0, give_ups = 0, lost = 0;
    for (int i = 0; i < meshes; i++) {
        struct one o;
        struct flight f;
        open_one(&seed, &o, inside, way);
        for (int flights = 0; flights < 10; flights++) {
            if (!random_flight(&seed, &o, &f))
                continue;
            const double horizon = log_uniform(&seed, 1e-5, 0.03);
            const int asked = give_ups;
            const double t = first_contact(o.shape, &f, horizon, false, &give_ups);
            const double missed = first_below_any(&o.shape, 1, &f, fmin(t, horizon), CLOSED, &lost);
            ck_assert_msg(isinf(missed), "mesh %d: below at %.17g, before the contact at %.17g", i,
                          missed, t);
            none += isinf(t) != 0;
            found += !isinf(t);
            if (asked == give_ups)
                ask_as_the_schedule_does(&seed, &o, &f, horizon, t);
            if (isinf(t))
                continue;
            const double gap = (double)wide_gap_at(&o, &f, t), late = lateness(&o, &f, t);
            ck_assert_msg(fabs(gap) < CLOSED, "mesh %d: a gap of %g m at %.17g", i, gap, t);
            ck_assert_msg(late <= LATE, "mesh %d: off by %g s", i, late);
            ck_assert_double_lt(
                (double)(wide_gap_at(&o, &f, t + 1e-9L) - wide_gap_at(&o, &f, t - 1e-9L)), 2e-14);
        }
        close_one(&o);
    }
    ck_assert_int_gt(found, meshes);
    ck_assert_int_gt(none + inside * meshes, meshes / 2);
    ck_assert_int_lt(give_ups, 1 + meshes / 10);
    ck_assert_int_lt(lost, 2 + meshes / 10);
}

SLOW_TEST(meshes_are_met_from_outside_when_they_are, WAYS)
{
    contract(_i, false, 120);
}

SLOW_TEST(meshes_are_met_from_inside_when_they_are, WAYS)
{
    contract(_i, true, 80);
}

/* Gap, normal, point and velocity belong together, and are those of all facets one by one. */
LOOP_TEST(a_contact_is_with_the_nearest_of_all_facets, WAYS)
{
    uint64_t seed = 7 + (uint64_t)_i;
    int behind = 0;
    for (int i = 0; i < unit_draws(400); i++) {
        struct one o;
        struct flight f;
        open_one(&seed, &o, i % 2, _i);
        for (int n = 0; n < 5; n++) {
            random_flight(&seed, &o, &f);
            if (n > 2) { /* also from behind */
                const struct mill_contact c = contact_of(o.shape, f.path.r, 0.0, f.now);
                f.path.r = vec3_axpy(c.point, uniform(&seed, -2e-3, 0.0), c.normal);
            }
            const struct mill_contact c = contact_of(o.shape, f.path.r, f.radius, f.now);
            const double h = 1e-9;
            const double rate = (gap_of(o.shape, f.path.r, f.radius, f.now + h) -
                                 gap_of(o.shape, f.path.r, f.radius, f.now - h)) /
                                (2.0 * h);
            behind += c.gap < -f.radius;
            ck_assert_double_eq_tol(c.gap, (double)wide_gap_at(&o, &f, 0.0L), 1e-15);
            ck_assert_double_eq_tol(vec3_norm(c.normal), 1.0, 1e-14);
            ck_assert_double_eq_tol(fabs(gap_of(o.shape, c.point, 0.0, f.now)), 0.0, 1e-15);
            ck_assert_double_eq_tol(vec3_norm(vec3_sub(f.path.r, c.point)), fabs(c.gap + f.radius),
                                    1e-15);
            if (n <= 2) /* behind the surface the nearest place may leap */
                ck_assert_double_eq_tol(vec3_dot(c.velocity, c.normal), -rate, 1e-4);
        }
        close_one(&o);
    }
    ck_assert_int_gt(behind, unit_draws(300));
}

SLOW_TEST(many_facets_are_found_as_few_are, 1)
{
    uint64_t seed = 11;
    form_lump(&seed, &form, 50, 50, 0.05, 0.1);
    struct one o = {.shape = shape_of(&form.is, NULL)};
    for (int i = 0; i < unit_draws(1500); i++) {
        struct flight f = {.radius = log_uniform(&seed, 1e-4, 1e-2)};
        f.path.r = vec3_scale(direction(&seed), uniform(&seed, 0.0, 0.08));
        ck_assert_double_eq_tol(gap_of(o.shape, f.path.r, f.radius, 0.0),
                                (double)wide_gap_at(&o, &f, 0.0L), 1e-15);
    }
    close_one(&o);
}

/* ---- a box ---- */

LOOP_TEST(a_box_of_facets_is_met_as_a_box_is, WAYS)
{
    uint64_t seed = 21 + (uint64_t)_i;
    int met = 0;
    for (int i = 0; i < 200; i++) {
        form_open(&form);
        place_body(&seed, &form.is);
        form.is.size = vec3_make(log_uniform(&seed, 1e-3, 0.04), log_uniform(&seed, 1e-3, 0.04),
                                 log_uniform(&seed, 1e-3, 0.04));
        form_add_box(&form, nought, form.is.size);
        struct one o = {.chain = random_chain(&seed, _i)};
        chain_open(&o.chain);
        struct mill_shape *box = lone_shape(&mill_box_solid, &form.is, o.chain.top, &places);
        o.shape = shape_of(&form.is, o.chain.top);
        for (int n = 0; n < 10; n++) {
            struct flight f;
            if (!random_flight(&seed, &o, &f))
                continue;
            const double t = first_contact(o.shape, &f, 0.02, false, NULL);
            const double with_box = first_contact(box, &f, 0.02, false, NULL);
            if (isinf(t) && isinf(with_box))
                continue;
            if (lateness(&o, &f, fmin(t, with_box)) > 0.0) { /* no graze */
                ck_assert_double_eq_tol(t, with_box, LATE);
                met++;
            }
        }
        lone_shape_free(box);
        close_one(&o);
    }
    ck_assert_int_gt(met, 100);
}

/* ---- edges and corners ---- */

/* Thrown at a place of the box's surface from direction n, and thrown back */
static void throw_at(const struct mill_shape *s, vec3 at, vec3 n, vec3 slide)
{
    struct flight f = {.radius = 2e-3};
    f.path.v = vec3_axpy(slide, -1.0, n);
    f.path.r = vec3_axpy(vec3_axpy(at, f.radius, n), -0.01, f.path.v);
    const double t = first_contact(s, &f, 0.1, false, NULL);
    ck_assert_double_eq_tol(t, 0.01, 1e-13);
    f = later(&f, t);
    const struct mill_contact c =
        mill_shape_meet(s, f.path.r, f.path.v, f.radius, &mill_pose_still);
    ck_assert_double_lt(vec3_norm(vec3_sub(c.normal, n)), 1e-12);
    for (double rebound = 5e-3; rebound < 2.0; rebound *= 3.0) {
        struct flight back = f;
        back.path.v = vec3_axpy(f.path.v, rebound - vec3_dot(f.path.v, c.normal), c.normal);
        ck_assert_double_eq(first_contact(s, &back, 0.06, true, NULL), (double)INFINITY);
    }
}

TEST(a_ball_that_meets_what_facets_share_meets_it_once)
{
    form_open(&form);
    form_add_box(&form, nought, vec3_make(0.02, 0.02, 0.02));
    struct mill_shape *s = shape_of(&form.is, NULL);
    uint64_t seed = 31;
    for (int i = 0; i < unit_draws(200); i++) {
        const vec3 slide = {uniform(&seed, -3.0, 3.0), uniform(&seed, -3.0, 3.0), 0.0};
        const double x = uniform(&seed, -0.0099, 0.0099), a = uniform(&seed, 0.05, 1.5);
        throw_at(s, vec3_make(x, x, 0.01), vec3_make(0.0, 0.0, 1.0), slide);
        throw_at(s, vec3_make(x, -x, 0.01), vec3_make(0.0, 0.0, 1.0), slide);
        throw_at(s, vec3_make(x, 0.01, 0.01), vec3_make(0.0, sin(a), cos(a)), nought);
        const vec3 n = vec3_make(uniform(&seed, 0.1, 1.0), uniform(&seed, 0.1, 1.0), 0.5);
        throw_at(s, vec3_make(0.01, 0.01, 0.01), vec3_scale(n, 1.0 / vec3_norm(n)), nought);
    }
    lone_shape_free(s);
}

/* More facets in one corner than a search lists */
TEST(a_corner_of_hundreds_of_facets_is_met_as_any_other)
{
    uint64_t seed = 41;
    form_lump(&seed, &form, 400, 3, 0.02, 0.0);
    struct mill_shape *s = shape_of(&form.is, NULL);
    for (int i = 0; i < 50; i++)
        throw_at(s, vec3_make(0.0, 0.0, 0.02), vec3_make(0.0, 0.0, 1.0),
                 vec3_scale(direction(&seed), 1e-3 * (i % 2)));
    lone_shape_free(s);
}

/* Two flats that meet in a hollow edge: a ball in it touches both. */
SLOW_TEST(a_ball_in_a_hollow_edge_meets_one_flat_after_the_other, 2)
{
    uint64_t seed = 51 + (uint64_t)_i;
    int together = 0;
    form_open(&form);
    const double y = 0.05, deep = _i ? 0.02 : 0.05;
    const vec3 low[2] = {{0.0, -y, -deep}, {0.0, y, -deep}};
    const vec3 left[2] = {{-0.05, -y, 0.0}, {-0.05, y, 0.0}};
    const vec3 right[2] = {{0.05, -y, 0.0}, {0.05, y, 0.0}};
    const vec3 foot[2] = {{0.0, -y, -0.1}, {0.0, y, -0.1}};
    form_add_quad(&form, left[0], low[0], low[1], left[1]);
    form_add_quad(&form, low[0], right[0], right[1], low[1]);
    form_add_quad(&form, foot[0], left[0], left[1], foot[1]);
    form_add_quad(&form, right[0], foot[0], foot[1], right[1]);
    form_add_quad(&form, left[0], foot[0], right[0], low[0]);
    form_add_quad(&form, left[1], low[1], right[1], foot[1]);
    struct heard heard;
    form_unite(&form, &heard);
    ck_assert_msg(heard.count == 0, "%s", heard.said[0]);
    struct mill_shape *s = shape_of(&form.is, NULL);
    for (int i = 0; i < unit_draws(300); i++) {
        struct flight f = {.radius = 3e-3};
        f.path.r = vec3_make(i % 2 ? 0.0 : uniform(&seed, -0.005, 0.005), 0.0, 0.01);
        f.path.g = vec3_make(0.0, 0.0, -9.81);
        for (int hop = 0; hop < 40; hop++) {
            const double t = first_contact(s, &f, 1.0, hop > 0, NULL);
            ck_assert(!isinf(t));
            ck_assert(isinf(first_below(s, &f, t, CLOSED)));
            f = later(&f, t);
            const struct mill_contact c =
                mill_shape_meet(s, f.path.r, f.path.v, f.radius, &mill_pose_still);
            const double v_n = vec3_dot(f.path.v, c.normal);
            ck_assert_double_lt(fabs(c.gap), CLOSED);
            ck_assert_double_le(v_n, 1e-9);
            together += t < 1e-9;
            f.path.v = vec3_axpy(f.path.v, fmax(-0.5 * v_n, 5e-3) - v_n, c.normal);
        }
    }
    if (_i == 0) /* at a right angle one rebound leaves the other flat's contact as it was */
        ck_assert_int_gt(together, unit_draws(100));
    lone_shape_free(s);
}

/* A centre behind the surface: pressed there, it is met while it goes on, and gets out. */
TEST(a_ball_pressed_through_the_surface_gets_out)
{
    form_open(&form);
    form_add_box(&form, nought, vec3_make(0.02, 0.02, 0.02));
    struct mill_shape *s = shape_of(&form.is, NULL);
    struct flight f = {.radius = 2e-3, .path = {.r = {0.001, 0.002, 0.0095}}};
    f.path.v = vec3_make(0.0, 0.0, -1.0);
    ck_assert_double_eq(first_contact(s, &f, 0.06, false, NULL), 0.0);
    ck_assert_double_eq(mill_shape_meet(s, f.path.r, f.path.v, f.radius, &mill_pose_still).normal.z,
                        1.0);
    f.path.v.z = 1.0;
    ck_assert_double_eq(first_contact(s, &f, 0.06, false, NULL), (double)INFINITY);
    lone_shape_free(s);
}

/* ---- as a body ---- */

SLOW_TEST(reach_is_never_denied_wrongly, WAYS)
{
    uint64_t seed = 9 + (uint64_t)_i;
    int out = 0;
    for (int i = 0; i < 200; i++) {
        struct one o;
        open_one(&seed, &o, i % 2, _i);
        for (int n = 0; n < 20; n++) {
            const double radius = log_uniform(&seed, 1e-3, 1e-2);
            const vec3 lo = vec3_scale(direction(&seed), uniform(&seed, 0.0, 0.2));
            const vec3 hi =
                vec3_add(lo, vec3_make(uniform(&seed, 0.0, 0.02), uniform(&seed, 0.0, 0.02), 0.01));
            if (o.shape->type->reachable(o.shape, lo, hi, radius))
                continue;
            out++;
            for (int at = 0; at < 50; at++)
                ck_assert_double_gt(
                    fabs(gap_of(o.shape, point_in(&seed, lo, hi), 0.0, uniform(&seed, 0.0, 1.0))),
                    radius);
        }
        close_one(&o);
    }
    if (_i < 3)
        ck_assert_int_gt(out, 500);
}

TEST(hull_volume_and_outline_are_those_of_the_solid)
{
    uint64_t seed = 61;
    form_open(&form);
    form_add_box(&form, vec3_make(0.01, 0.0, 0.0), vec3_make(0.02, 0.03, 0.05));
    place_body(&seed, &form.is);
    const struct mill_hull hull = mill_facets_solid.hull(&form.is);
    ck_assert_double_eq_tol(mill_facets_solid.volume(&form.is), 3e-5, 1e-19);
    double far = 0.0;
    for (int k = 0; k < 36; k++) {
        const vec3 at = mill_body_out(&form.is, form.facet[k / 3][k % 3]);
        far = fmax(far, hypot(at.y, at.z));
    }
    ck_assert_double_eq_tol(mill_deck_bodies_reach(&mill_facets_solid, &form.is), far, 1e-16);
    ck_assert_double_eq_tol(hull.half, 0.025, 1e-16);
    ck_assert_double_eq_tol(hull.radius, sqrt(0.02 * 0.02 + 0.015 * 0.015), 1e-16);
    for (int inside = 0; inside < 2; inside++) {
        struct mill_mesh mesh = {0};
        double sum = 0.0;
        form.is.inside = inside;
        mill_facets_solid.outline(&form.is, MILL_SOLID_WHOLE, 1e-3, &mesh);
        ck_assert_uint_eq(mesh.triangles, 12);
        for (size_t k = 0; k < mesh.triangles; k++) {
            const int64_t *c = mesh.corner[k];
            const vec3 a = vec3_sub(mesh.point[c[0]], form.is.centre);
            sum += vec3_dot(a, vec3_cross(vec3_sub(mesh.point[c[1]], form.is.centre),
                                          vec3_sub(mesh.point[c[2]], form.is.centre))) /
                   6.0;
        }
        ck_assert_double_eq_tol(sum, inside ? -3e-5 : 3e-5, 1e-18);
        mill_mesh_free(&mesh);
    }
}

int main(void)
{
    return unit_run("facets");
}
