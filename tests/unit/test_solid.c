/* What all of the program asks a solid: support, hull, outline and the gap to a wall, held against
 * each other, against the distances of extended.h and against many directions. */
#include "clash_fixture.h"
#include "deck/deck_private.h"
#include "geometry/mesh.h"
#include "shape_fixture.h"

#include <stddef.h>

static vec3 any_place(uint64_t *seed)
{
    return vec3_scale(direction(seed), uniform(seed, 0.0, 0.2));
}

static struct mill_mesh outline_of(const struct lone *o, double tolerance)
{
    struct mill_mesh mesh = {0};
    o->kind->outline(&o->body, MILL_SOLID_WHOLE, tolerance, &mesh);
    ck_assert(!mesh.failed && mesh.triangles > 0);
    return mesh;
}

/* ---- sizes ---- */

TEST(no_size_is_less_than_a_nanometre)
{
    static const size_t at[] = {
        offsetof(struct mill_body, size.x), offsetof(struct mill_body, size.y),
        offsetof(struct mill_body, size.z), offsetof(struct mill_body, radius),
        offsetof(struct mill_body, length)};
    static const int first[KINDS] = {0, 3, 3, 3, 3}, last[KINDS] = {3, 5, 5, 5, 4};
    for (int kind = 0; kind < KINDS; kind++)
        for (int k = first[kind]; k < last[kind]; k++) {
            struct mill_body is = {.x = {1.0, 0.0, 0.0},
                                   .y = {0.0, 1.0, 0.0},
                                   .z = {0.0, 0.0, 1.0},
                                   .size = {1.0, 1.0, 1.0},
                                   .radius = 1.0,
                                   .end_radius = 1.0,
                                   .length = 1.0};
            double *size = (double *)(void *)((char *)&is + at[k]);
            *size = 1e-9;
            ck_assert(mill_solid_is_sound(kinds[kind], &is));
            *size = 0.999e-9;
            ck_assert(!mill_solid_is_sound(kinds[kind], &is));
            *size = 0.0; /* a cone may end in a tip, and a capsule may be a sphere */
            ck_assert_int_eq(mill_solid_is_sound(kinds[kind], &is),
                             (kind == 2 && k == 3) || (kind == 3 && k == 4));
            *size = (double)NAN;
            ck_assert(!mill_solid_is_sound(kinds[kind], &is));
            *size = (double)INFINITY;
            ck_assert(!mill_solid_is_sound(kinds[kind], &is));
        }
}

/* ---- support ---- */

/* The point that is told is on the surface, and no point of the outline is farther. The outline of
 * a box has no rounding. */
LOOP_TEST(the_support_is_the_farthest_point_of_the_outline, KINDS)
{
    uint64_t seed = 1 + (uint64_t)_i;
    double worst = 0;
    for (int n = 0; n < unit_draws(300); n++) {
        struct lone o;
        lone_open(&seed, &o, _i, any_place(&seed));
        const bool sharp = o.kind != &mill_box_solid || o.body.rounding == 0.0;
        /* the number of its triangles is limited: it is no nearer than this */
        const double tolerance = 0.02 * o.solid.part->around;
        const struct mill_part *p = o.solid.part;
        struct mill_mesh mesh = outline_of(&o, tolerance);
        for (int k = 0; k < 20; k++) {
            const vec3 way = direction(&seed);
            const vec3 at = vec3_axpy(mill_part_support(p, way), p->core.grown, way);
            const double extent = mill_part_extent(p, way);
            double farthest = -INFINITY;
            for (size_t i = 0; i < mesh.points; i++)
                farthest = fmax(farthest, vec3_dot(way, mesh.point[i]));
            ck_assert_double_eq_tol((double)wide_gap(o.kind, &o.body, wide_of(at)), 0.0, 1e-15);
            ck_assert_double_eq_tol(vec3_dot(way, at), extent, 1e-15);
            worst = fmax(worst, (extent - farthest) / tolerance);
            ck_assert(!sharp || farthest <= extent + 1e-15);
            ck_assert_double_le(vec3_norm(vec3_sub(at, p->centre)), p->around * (1.0 + 1e-12));
        }
        mill_mesh_free(&mesh);
        mill_clash_solid_free(&o.solid);
    }
}

/* ---- hulls ---- */

/* [m] by which a place is outside a hull of the body */
static double outside(const struct mill_hull *h, const struct mill_body *is, vec3 place)
{
    const vec3 along[] = {is->z, is->x, is->y};
    const vec3 q = vec3_sub(place, is->centre);
    const double z = vec3_dot(q, along[h->axis]);
    const double line = fmax(-h->half, fmin(h->half, z));
    return vec3_norm(vec3_axpy(q, -line, along[h->axis])) - h->radius;
}

LOOP_TEST(hulls_enclose_the_outline, KINDS + 1)
{
    uint64_t seed = 11 + (uint64_t)_i;
    for (int n = 0; n < unit_draws(300); n++) {
        struct lone o;
        lone_open(&seed, &o, _i, any_place(&seed));
        struct mill_body container = o.body;
        container.inside = 1;
        const struct mill_hull hull[] = {mill_solid_hull(o.kind, &container),
                                         mill_solid_hull(o.kind, &o.body)};
        const double size = hull[0].half + hull[0].radius;
        struct mill_mesh mesh = outline_of(&o, 1e-2 * size);
        ck_assert_int_eq(hull[0].axis, 0);
        for (int k = 0; k < 2; k++) {
            double least = INFINITY;
            for (size_t i = 0; i < mesh.points; i++) {
                const double out = outside(&hull[k], &o.body, mesh.point[i]);
                /* the outline of a box has no rounding */
                if (o.body.rounding == 0.0 || o.kind != &mill_box_solid)
                    ck_assert_double_le(out, 1e-12 * size);
                least = fmin(least, fabs(out));
            }
            for (int i = 0; i < 200; i++)
                ck_assert_double_le(outside(&hull[k], &o.body, place_of(&seed, &o)), 1e-12 * size);
            if (o.body.rounding == 0.0)
                ck_assert_double_lt(least, 0.3 * size); /* it is not far away */
        }
        mill_mesh_free(&mesh);
        mill_clash_solid_free(&o.solid);
    }
}

TEST(the_hull_of_a_box_is_about_its_longest_side)
{
    uint64_t seed = 21;
    for (int n = 0; n < 300; n++) {
        struct mill_body is = {
            .size = point_in(&seed, vec3_make(1e-3, 1e-3, 1e-3), vec3_make(0.1, 0.1, 0.1))};
        place_body(&seed, &is);
        is.rounding = below(&seed, 2) ? 4e-4 : 0.0;
        const vec3 s = is.size;
        const double longest = fmax(s.x, fmax(s.y, s.z));
        const struct mill_hull hull = mill_solid_hull(&mill_box_solid, &is);
        ck_assert(((const double[]){s.z, s.x, s.y})[hull.axis] == longest);
        ck_assert_double_eq_tol(hull.half, 0.5 * longest, 1e-16);
        ck_assert_double_eq_tol(
            hull.radius, 0.5 * sqrt(s.x * s.x + s.y * s.y + s.z * s.z - longest * longest), 1e-16);
    }
}

/* A tip is as far from the axis as the farthest point of the outline, and a mesh has only those. */
LOOP_TEST(the_reach_is_that_of_the_farthest_point, KINDS + 1)
{
    uint64_t seed = 25 + (uint64_t)_i;
    for (int n = 0; n < unit_draws(300); n++) {
        struct lone o;
        lone_open(&seed, &o, _i, any_place(&seed));
        const bool exact = _i == KINDS || (_i == 0 && o.body.rounding == 0.0);
        /* the fewest triangles around a narrow place are far between */
        const double coarse = exact ? 1e-15 : 0.1 * o.solid.part->around;
        struct mill_mesh mesh = outline_of(&o, 0.05 * o.solid.part->around);
        double far = 0.0, in = 0.0;
        for (size_t i = 0; i < mesh.points; i++)
            far = fmax(far, hypot(mesh.point[i].y, mesh.point[i].z));
        for (int k = 0; k < 1000; k++) {
            const vec3 place = place_of(&seed, &o);
            in = fmax(in, hypot(place.y, place.z));
        }
        const double reach = mill_deck_bodies_reach(o.kind, &o.body);
        ck_assert_double_ge(reach, in - 1e-15);
        if (_i > 0 || o.body.rounding == 0.0)
            ck_assert_double_eq_tol(reach, far, coarse);
        mill_mesh_free(&mesh);
        mill_clash_solid_free(&o.solid);
    }
}

/* ---- the gap to a wall ---- */

enum { FLAT_WALL, CYLINDER_WALL, CONE_WALL, CAPSULE_WALL, SPHERE_WALL, WALLS };

static struct mill_wall any_wall(uint64_t *seed, int kind)
{
    struct mill_body is = {.inside = true, .length = uniform(seed, 0.1, 0.6)};
    struct mill_wall wall[MILL_WALLS];
    static const struct mill_solid *const of[] = {[CYLINDER_WALL] = &mill_round_cylinder_solid,
                                                  [CONE_WALL] = &mill_round_cone_solid,
                                                  [CAPSULE_WALL] = &mill_round_capsule_solid,
                                                  [SPHERE_WALL] = &mill_round_sphere_solid};
    is.radius = uniform(seed, 0.1, 0.4);
    is.end_radius = below(seed, 4) ? uniform(seed, 0.1, 0.4) : 0.0;
    if (kind == FLAT_WALL)
        return (struct mill_wall){
            .flat = true, .point = any_place(seed), .normal = direction(seed)};
    of[kind]->walls(&is, wall);
    return wall[0];
}

/* What a tangent plane of the wall, in a direction, leaves of the part [m] */
static double left_in(const struct mill_wall *w, const struct mill_part *p, vec3 u)
{
    const double lean = sqrt(1.0 + w->slope * w->slope);
    if (isinf(w->half)) {
        const double across = hypot(u.x, u.y);
        return (w->radius - mill_part_extent(p, vec3_make(u.x / across, u.y / across, -w->slope))) /
               lean;
    }
    return w->radius + w->half * fabs(u.z) - mill_part_extent(p, u);
}

/* The least of many directions and of smaller and smaller changes of the best of them; at: the
 * point of the core that is farthest in the best one */
static double sampled_gap(uint64_t *seed, const struct mill_wall *w, const struct mill_part *p,
                          vec3 *at)
{
    double least = INFINITY;
    vec3 best = direction(seed);
    *at = mill_part_support(p, vec3_scale(w->normal, -1.0));
    if (w->flat)
        return -vec3_dot(w->normal, w->point) - mill_part_extent(p, vec3_scale(w->normal, -1.0));
    for (int k = 0; k < 4000; k++) {
        const double step = k < 2000 ? 10.0 : pow(10.0, -7.0 * (k - 2000) / 2000.0);
        vec3 sum = vec3_axpy(best, step, direction(seed));
        sum.z = k % 3 && isfinite(w->half) ? sum.z : 0.0; /* between both ends */
        const vec3 u = vec3_scale(sum, 1.0 / vec3_norm(sum));
        const double gap = left_in(w, p, u);
        best = gap < least ? u : best;
        least = fmin(least, gap);
    }
    const double across = hypot(best.x, best.y);
    *at =
        mill_part_support(p, isinf(w->half) ? vec3_make(best.x, best.y, -w->slope * across) : best);
    return least;
}

static long looks; /* how often the part was asked for its support */
static vec3 (*asked)(const struct mill_core *, vec3 way);

static vec3 counted(const struct mill_core *core, vec3 way)
{
    looks++;
    return asked(core, way);
}

static struct mill_part_gap counted_gap(const struct mill_part *part, const struct mill_wall *w,
                                        double near)
{
    struct mill_part p = *part;
    asked = p.support;
    p.support = counted;
    looks = 0;
    return mill_part_to_wall(&p, w, near);
}

LOOP_TEST(the_bounds_of_a_gap_to_a_wall_enclose_it_and_are_near_to_each_other, (KINDS + 1) * WALLS)
{
    uint64_t seed = 31 + (uint64_t)_i;
    for (int n = 0; n < unit_draws(120); n++) {
        struct lone o;
        vec3 centre = below(&seed, 5) ? any_place(&seed) : nought;
        if (_i % WALLS == CONE_WALL && below(&seed, 2)) /* where the cone is very narrow or wide */
            centre.z *= 20.0;
        lone_open(&seed, &o, _i / WALLS, centre);
        const struct mill_wall w = any_wall(&seed, _i % WALLS);
        const double near = log_uniform(&seed, 1e-7, 1e-3);
        const struct mill_part_gap gap = counted_gap(o.solid.part, &w, near);
        vec3 at;
        const double truth = sampled_gap(&seed, &w, o.solid.part, &at);
        const double coarse = 1e-3 * o.solid.part->around, grown = o.solid.part->core.grown;
        ck_assert_msg(gap.least <= truth + 1e-15, "%.12g is more than %.12g", gap.least, truth);
        ck_assert_msg(gap.most >= truth - coarse, "%.12g is less than %.12g", gap.most, truth);
        ck_assert_double_le(gap.least, gap.most);
        ck_assert_double_le(gap.most - gap.least,
                            fmax((isinf(w.half) ? 1e-4 : 1e-2) * fabs(gap.most), 0.05 * near) +
                                1e-15);
        ck_assert_int_eq(gap.looks, looks - (w.slope != 0.0));
        ck_assert_double_eq_tol(mill_part_wall_gap(&w, at), truth + grown, coarse);
        for (int k = 0; k < 100; k++)
            ck_assert_double_ge(mill_part_wall_gap(&w, place_of(&seed, &o)), gap.least - 1e-15);
        mill_clash_solid_free(&o.solid);
    }
}

/* Also where all directions are alike: a body in the middle of a sphere */
LOOP_TEST(the_gap_to_a_wall_is_soon_found, KINDS + 1)
{
    uint64_t seed = 71 + (uint64_t)_i;
    for (int n = 0; n < unit_draws(30); n++) {
        struct lone o;
        lone_open(&seed, &o, _i, n % 2 ? nought : vec3_scale(direction(&seed), 1e-3));
        for (int kind = FLAT_WALL; kind < WALLS; kind++) {
            struct mill_wall w = any_wall(&seed, kind);
            w.radius = o.solid.part->around * (1.0 + log_uniform(&seed, 1e-2, 1.0));
            const double size = w.radius;
            counted_gap(o.solid.part, &w, 2e-6 * size);
            ck_assert_msg(looks < 10000, "%ld looks at wall %d", looks, kind);
        }
        mill_clash_solid_free(&o.solid);
    }
}

int main(void)
{
    return unit_run("solid");
}
