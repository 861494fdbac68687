/* Which arcs of the wavy drum can a ball in a box touch? */
#include "wavy_fixture.h"

TEST(what_a_box_can_reach_is_all_that_a_flight_in_it_meets)
{
    uint64_t seed = 600 + (uint64_t)_i;
    int met = 0, out = 0;
    for (int i = 0; i < 5000; i++) {
        struct wavy_mill m;
        build_random(&seed, &m);
        const struct mill_shape *s = m.drum;
        const struct flight f = random_flight(&seed, &m);
        const double side = log_uniform(&seed, 1e-5, 0.02);
        const vec3 corner = vec3_make(side, side, side);
        const double share = uniform(&seed, 0.0, 1.0);
        vec3 lo = vec3_axpy(f.path.r, -share, corner),
             hi = vec3_axpy(f.path.r, 1.0 - share, corner);
        if (i % 7 == 0)
            hi.y = HUGE_VAL; /* as cells at the border are */
        if (i % 11 == 0)
            lo.z = -HUGE_VAL;
        double leaves = 0.0, step = 1e-3 * side / (1e-9 + vec3_norm(f.path.v) + 1.0);
        for (int k = 0; k < 3000; k++) {
            const vec3 r = vec3_fly(f.path.r, f.path.v, f.path.g, leaves + step);
            if (r.y < lo.y || r.y > hi.y || r.z < lo.z || r.z > hi.z)
                break;
            leaves += step;
        }
        struct mill_flight path = path_of(f.path.r, f.path.v, f.path.g);
        const double whole = s->type->next_contact(s, &path, f.radius, 0.0, leaves, false).t;
        path.parts = s->type->parts(s, lo, hi, f.radius * uniform(&seed, 1.0, 2.0));
        if (path.parts.count > 0) {
            const double t = s->type->next_contact(s, &path, f.radius, 0.0, leaves, false).t;
            ck_assert(isinf(whole) ? isinf(t) : fabs(t - whole) <= 1e-12 * whole);
        } else {
            ck_assert(isinf(whole));
            out++;
        }
        met += !isinf(whole);
        mill_demolish(&m.mill);
    }
    ck_assert_int_gt(met, 100);
    ck_assert_int_gt(out, 300);
}

TEST(a_cell_at_the_wall_has_one_to_three_arcs_and_one_inside_none)
{
    static const int buckles[] = {2, 5, 8, 12, 20};
    const double a = 0.0025, side = 0.005;
    for (int k = 0; k < 5; k++) {
        struct wavy_mill m;
        build(&m, buckles[k], 0.004, 0.1);
        const struct mill_shape *s = m.drum;
        int most = 0, cells = 0, parts = 0;
        for (double y = -0.08; y < 0.08; y += side) {
            for (double z = -0.08; z < 0.08; z += side) {
                const vec3 lo = vec3_make(0.0, y, z), hi = vec3_make(side, y + side, z + side);
                const double gap = wall_gap(&m, vec3_scale(vec3_add(lo, hi), 0.5), a);
                const struct mill_span span = s->type->parts(s, lo, hi, a);
                if (gap > 0.71 * side + 1e-5)
                    ck_assert_int_le(span.count, 1); /* a corner between two centres' lines */
                if (gap > side)
                    ck_assert_int_eq(span.count, 0);
                if (fabs(gap) < 0.5 * side) {
                    ck_assert_int_gt(span.count, 0);
                    cells++;
                    parts += span.count;
                    most = span.count > most ? span.count : most;
                }
            }
        }
        ck_assert_int_le(most, 3);
        ck_assert_int_lt(parts, 2 * cells);
        mill_demolish(&m.mill);
    }
}

int main(void)
{
    return unit_run("wavy_reach");
}
