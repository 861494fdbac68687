/* Gaps of the check for clashes: bounds, held against samples of the bodies. */
#include "clash_fixture.h"

static double segment_distance(vec3 p, vec3 a, vec3 b)
{
    const vec3 way = vec3_sub(b, a);
    const double t = vec3_dot(vec3_sub(p, a), way) / vec3_dot(way, way);
    return vec3_norm(vec3_sub(p, vec3_axpy(a, fmin(fmax(t, 0.0), 1.0), way)));
}

/* Of a place from a body, by the formulas of extended.h, or from a triangle */
static double place_distance(const struct lone *o, vec3 p)
{
    const vec3 *c = o->corner;
    if (o->kind != &mill_facets_solid)
        return fmax((double)wide_gap(o->kind, &o->body, wide_of(p)), 0.0);
    double least = INFINITY;
    const vec3 cross = vec3_cross(vec3_sub(c[1], c[0]), vec3_sub(c[2], c[0]));
    const vec3 n = vec3_scale(cross, 1.0 / vec3_norm(cross));
    bool over = true;
    for (int k = 0; k < 3; k++) {
        const vec3 a = c[k], b = c[(k + 1) % 3];
        least = fmin(least, segment_distance(p, a, b));
        over = over && vec3_dot(vec3_cross(vec3_sub(b, a), vec3_sub(p, a)), n) >= 0.0;
    }
    return over ? fabs(vec3_dot(vec3_sub(p, c[0]), n)) : least;
}

/* The distance to a convex body is a convex function: from the best of many places smaller and
 * smaller steps towards any others lead to the least. */
static double sampled_distance(uint64_t *seed, const struct lone *a, const struct lone *b)
{
    vec3 at = place_of(seed, a);
    double least = place_distance(b, at), step = 1.0;
    for (int k = 0; k < 4000; k++) {
        const vec3 q = place_of(seed, a);
        const vec3 trial = vec3_axpy(at, step * uniform(seed, 0.0, 1.0), vec3_sub(q, at));
        const double d = place_distance(b, trial);
        step = k % 50 == 49 && k > 500 ? 0.8 * step : step;
        if (d >= least)
            continue;
        least = d;
        at = trial;
    }
    return least;
}

SLOW_TEST(a_distance_is_never_greater_than_the_truth_and_near_to_it, (KINDS + 1) * (KINDS + 1))
{
    const int p = _i / (KINDS + 1), q = _i % (KINDS + 1);
    uint64_t seed = 1 + (uint64_t)_i;
    int apart = 0;
    for (int n = 0; n < unit_draws(60); n++) {
        struct lone a, b;
        lone_open(&seed, &a, p, vec3_scale(direction(&seed), 0.1));
        lone_open(&seed, &b, q, vec3_scale(direction(&seed), uniform(&seed, 0.0, 0.2)));
        const double near = 1e-6 * (a.solid.all.radius + b.solid.all.radius);
        const struct mill_part_gap gap =
            mill_clash_gap_solids(&a.solid, &b.solid, &mill_pose_still, near);
        const struct mill_part_gap exact = mill_clash_gap_parts(a.solid.part, b.solid.part, near);
        const double truth = fmin(sampled_distance(&seed, &a, &b), sampled_distance(&seed, &b, &a));
        ck_assert_msg(gap.least <= truth + 1e-15, "%d: %.12g is more than %.12g", n, gap.least,
                      truth);
        ck_assert_msg(exact.least <= truth + 1e-15, "%d: %.12g is more than %.12g", n, exact.least,
                      truth);
        /* sampling is the coarser of the two */
        const double least = fmin(gap.least, exact.least);
        ck_assert_msg(fmax(least, 0.0) >= 0.8 * truth - 1e-3, "%d: %.12g is far from %.12g", n,
                      least, truth);
        ck_assert_msg(exact.most >= exact.least - 1e-15 &&
                          exact.most <= 1.06 * fmax(exact.least, 0.0) + near,
                      "%d: %.12g to %.12g", n, exact.least, exact.most);
        apart += truth > 0.0;
        mill_clash_solid_free(&a.solid);
        mill_clash_solid_free(&b.solid);
    }
    ck_assert_int_gt(apart, unit_draws(30));
}

/* Walls are those of containers of every kind, the solids anywhere within or not. */
SLOW_TEST(a_gap_to_a_wall_is_never_greater_than_the_truth_and_near_to_it, (KINDS + 1) * KINDS)
{
    const int kind = _i % (KINDS + 1), of = _i / (KINDS + 1);
    uint64_t seed = 101 + (uint64_t)_i;
    for (int n = 0; n < unit_draws(100); n++) {
        struct lone a;
        struct mill_body is = {.inside = true, .size = {0.3, 0.4, 0.5}, .length = 0.4};
        struct mill_wall wall[MILL_WALLS];
        is.radius = uniform(&seed, 0.1, 0.3);
        is.end_radius = uniform(&seed, 0.1, 0.3);
        const int walls = kinds[of]->walls(&is, wall);
        lone_open(&seed, &a, kind, vec3_scale(direction(&seed), uniform(&seed, 0.0, 0.2)));
        for (int k = 0; k < walls; k++) {
            const struct mill_wall *w = &wall[k];
            const double near = 1e-6;
            const double gap = mill_clash_gap_wall(w, &a.solid, &mill_pose_still, near).least;
            double truth = INFINITY;
            for (int m = 0; m < 3000; m++) {
                const vec3 p = place_of(&seed, &a);
                const double z = fmax(fabs(p.z) - w->half, 0.0);
                const double d =
                    w->flat ? vec3_dot(w->normal, vec3_sub(p, w->point))
                            : (w->radius + w->slope * p.z - sqrt(p.x * p.x + p.y * p.y + z * z)) /
                                  sqrt(1.0 + w->slope * w->slope);
                truth = fmin(truth, d);
            }
            ck_assert_msg(gap <= truth + 1e-15, "%.12g is more than %.12g", gap, truth);
            ck_assert_msg(gap >= truth - 0.1 * fabs(truth) - 0.1 * a.solid.all.radius,
                          "%.12g is far from %.12g", gap, truth);
        }
        mill_clash_solid_free(&a.solid);
    }
}

int main(void)
{
    return unit_run("clash_gap");
}
