/* Contours from a few numbers have the sizes asked for; and which contours cross themselves. */
#include "contour_fixture.h"
#include "millsim/lining.h"

static struct mill_corner corner[4 * MOST_CORNERS];

static vec3 place_of(size_t k, size_t n)
{
    return vec3_make(corner[k % n].x, corner[k % n].y, 0.0);
}

/* The direction of side k where it begins (end 0) or ends (end 1) */
static vec3 direction_of(size_t k, size_t n, int end)
{
    const vec3 way = vec3_sub(place_of(k + 1, n), place_of(k, n));
    const double turn = (end ? 2.0 : -2.0) * atan(corner[k % n].bulge), l = vec3_norm(way);
    return vec3_make((cos(turn) * way.x - sin(turn) * way.y) / l,
                     (sin(turn) * way.x + cos(turn) * way.y) / l, 0.0);
}

/* Sine of the angle by which the line turns where side k begins */
static double turn_at(size_t k, size_t n)
{
    return vec3_cross(direction_of(k + n - 1, n, 1), direction_of(k, n, 0)).z;
}

static double radius_of(size_t k, size_t n)
{
    const double u = corner[k].bulge;
    const double l = vec3_norm(vec3_sub(place_of(k + 1, n), place_of(k, n)));
    return 0.25 * l * (1.0 + u * u) / u;
}

/* ---- lifters ---- */

static struct mill_lining random_lifters(uint64_t *seed, double rounding)
{
    struct mill_lining is;
    do {
        is = random_lining(seed, LIFTERS);
        is.rounding = rounding * is.width;
    } while (mill_lining_corners(&is, corner) == 0);
    return is;
}

/* Coordinates around and outward from the middle line of lifter k */
static vec3 seen_from(const struct mill_lining *is, long k, vec3 p)
{
    const double a = is->angle + 2.0 * PI * (double)k / (double)is->count;
    return vec3_make(cos(a) * p.y - sin(a) * p.x, cos(a) * p.x + sin(a) * p.y, 0.0);
}

TEST(lifters_have_the_height_the_width_and_the_faces_that_are_asked_for)
{
    uint64_t seed = 1;
    for (int i = 0; i < unit_draws(1000); i++) {
        const struct mill_lining is = random_lifters(&seed, 0.0);
        const size_t n = mill_lining_corners(&is, corner);
        ck_assert_uint_eq(n, 4 * (size_t)is.count);
        for (long k = 0; k < is.count; k++) {
            const size_t at = 4 * (size_t)k;
            const double top = is.radius - (k % 2 ? is.second : is.height);
            const vec3 foot[2] = {seen_from(&is, k, place_of(at, n)),
                                  seen_from(&is, k, place_of(at + 3, n))};
            const vec3 edge[2] = {seen_from(&is, k, place_of(at + 1, n)),
                                  seen_from(&is, k, place_of(at + 2, n))};
            for (int side = 0; side < 2; side++) {
                const double sign = side ? 1.0 : -1.0;
                const vec3 face = vec3_sub(foot[side], edge[side]);
                ck_assert_double_eq_tol(edge[side].x, sign * 0.5 * is.width, 1e-15);
                ck_assert_double_eq_tol(edge[side].y, top, 1e-15);
                ck_assert_double_eq_tol(vec3_norm(foot[side]), is.radius, 1e-15);
                ck_assert_double_eq_tol(atan2(sign * face.x, face.y), side ? is.front : is.back,
                                        1e-12);
            }
            ck_assert_double_eq_tol(radius_of(at + 3, n), is.radius, 1e-12); /* the plate */
            ck_assert_double_eq(corner[at].bulge, 0.0);
        }
    }
}

TEST(edges_of_lifters_are_rounded_by_tangent_arcs_of_the_radius_that_is_asked_for)
{
    uint64_t seed = 2;
    for (int i = 0; i < unit_draws(1000); i++) {
        const struct mill_lining is = random_lifters(&seed, 0.2);
        const size_t n = mill_lining_corners(&is, corner);
        ck_assert_uint_eq(n, 6 * (size_t)is.count);
        for (size_t k = 0; k < n; k++) {
            if (k % 6 == 1 || k % 6 == 3) {
                ck_assert_double_eq_tol(radius_of(k, n), -is.rounding, 1e-12);
                ck_assert_double_eq_tol(turn_at(k, n), 0.0, 1e-11);
                ck_assert_double_eq_tol(turn_at(k + 1, n), 0.0, 1e-11);
            }
        }
    }
}

TEST(lifters_that_touch_each_other_are_refused)
{
    struct mill_lining is = {
        .form = MILL_LINING_LIFTERS, .radius = 1.0, .count = 12, .height = 0.1, .second = 0.1};
    const double most = 2.0 * sin(PI / 12.0); /* faces along the radius, feet side by side */
    is.width = most * (1.0 - 1e-6);
    ck_assert_uint_eq(mill_lining_corners(&is, corner), 48);
    is.width = most * (1.0 + 1e-6);
    ck_assert_uint_eq(mill_lining_corners(&is, corner), 0);
    is.width = 0.1;
    is.count = 24;
    is.front = 1.4; /* the face meets the plate at the next lifter */
    ck_assert_uint_eq(mill_lining_corners(&is, corner), 0);
}

TEST(lifters_whose_edges_do_not_exist_are_refused)
{
    struct mill_lining is = {.form = MILL_LINING_LIFTERS,
                             .radius = 1.0,
                             .count = 12,
                             .height = 0.1,
                             .second = 0.1,
                             .width = 0.1};
    is.rounding = 0.0499; /* half of the width, less than the height */
    ck_assert_uint_eq(mill_lining_corners(&is, corner), 72);
    is.rounding = 0.0501;
    ck_assert_uint_eq(mill_lining_corners(&is, corner), 0);
    is.rounding = 0.0;
    is.height = 1e-4; /* the corners of the top are beyond the plate */
    ck_assert_uint_eq(mill_lining_corners(&is, corner), 0);
}

/* ---- free lines ---- */

static double radius_at(const struct mill_lining *is, double share)
{
    double r = is->radius;
    for (int k = 0; k < MILL_LINING_WAVES; k++) {
        const double a = 2.0 * PI * share * (double)is->count * (k + 1);
        r += is->wave[k] * cos(a) + is->lean[k] * sin(a);
    }
    return r;
}

/* Of two arcs over an angle h: 2/3 of its cube times the greatest change of curvature is far above
 * the error, h^3 / 324 of it (D. S. Meek, D. J. Walton, J. Comput. Appl. Math. 59 (1995) 221). */
static double line_error(const struct mill_lining *is, double h)
{
    double most = 0.0;
    for (int k = 0; k < MILL_LINING_WAVES; k++)
        most += (fabs(is->wave[k]) + fabs(is->lean[k])) * pow((double)is->count * (k + 1), 3.0);
    return most * h * h * h / 50.0;
}

TEST(a_free_line_is_at_its_radius_at_every_angle_but_for_the_error_of_its_arcs)
{
    uint64_t seed = 3;
    double worst = 0.0;
    for (int i = 0; i < unit_draws(300); i++) {
        const struct mill_lining is = random_lining(&seed, HARMONICS);
        const size_t n = mill_lining_corners(&is, corner);
        const double error = line_error(&is, 4.0 * PI / (double)n);
        ck_assert_uint_eq(n, mill_lining_most(&is));
        for (size_t k = 0; k < n; k++)
            for (int s = 0; s < 8; s++) {
                vec3 normal;
                const vec3 p = contour_at(&corner[k], &corner[(k + 1) % n], 0.125 * s, &normal);
                const double share = (atan2(p.z, p.y) - is.angle) / (2.0 * PI);
                const double off = hypot(p.y, p.z) - radius_at(&is, share);
                worst = fmax(worst, fabs(off) / error);
                ck_assert_double_le(fabs(off), 1e-9 + error);
                if (s == 0 && k % 2 == 0)
                    ck_assert_double_le(fabs(off), 1e-14);
            }
    }
    ck_assert_double_gt(worst, 1e-3); /* the bound is not far from what there is */
}

TEST(the_arcs_of_a_free_line_are_tangent_to_each_other)
{
    uint64_t seed = 4;
    for (int i = 0; i < unit_draws(1000); i++) {
        const struct mill_lining is = random_lining(&seed, HARMONICS);
        const size_t n = mill_lining_corners(&is, corner);
        for (size_t k = 0; k < n; k++)
            ck_assert_double_eq_tol(turn_at(k, n), 0.0, 1e-11);
    }
}

/* ---- buckles ---- */

TEST(a_wavy_lining_has_the_arcs_of_its_profile)
{
    uint64_t seed = 5;
    for (int i = 0; i < unit_draws(1000); i++) {
        struct mill_lining is = random_lining(&seed, WAVY);
        const struct mill_profile p =
            mill_lining_profile((int)is.count, is.radius, is.height, is.angle);
        const size_t n = mill_lining_corners(&is, corner);
        ck_assert_uint_eq(n, 2 * (size_t)is.count);
        for (size_t k = 0; k < n; k++) {
            const bool outer = k % 2 == 0;
            const double far = outer ? p.outer : p.inner, sign = outer ? 1.0 : -1.0;
            const double a = is.angle + PI * (double)k / (double)is.count;
            const vec3 centre = vec3_make(0.0, far * cos(a), far * sin(a));
            for (int s = 0; s <= 4; s++) {
                vec3 normal;
                const vec3 on = contour_at(&corner[k], &corner[(k + 1) % n], 0.25 * s, &normal);
                ck_assert_double_eq_tol(vec3_norm(vec3_sub(on, centre)), p.arc, 1e-13);
                ck_assert_double_eq_tol(vec3_dot(vec3_sub(centre, on), normal), sign * p.arc,
                                        1e-13);
            }
            ck_assert_double_eq_tol(4.0 * atan(fabs(corner[k].bulge)),
                                    2.0 * (outer ? p.half_outer : p.half_inner), 1e-12);
        }
    }
}

/* ---- crossings ---- */

static bool crosses(size_t n, const struct mill_corner *is)
{
    size_t at[2];
    return mill_lining_crosses(is, n, at);
}

TEST(lines_that_cross_touch_or_fold_back_are_told)
{
    const struct mill_corner square[] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
    const struct mill_corner bow[] = {{0, 0, 0}, {1, 1, 0}, {1, 0, 0}, {0, 1, 0}};
    const struct mill_corner on_side[] = {{0, 0, 0}, {2, 0, 0}, {2, 1, 0}, {1, 0, 0}, {0, 1, 0}};
    const struct mill_corner back[] = {{0, 0, 0}, {2, 0, 0}, {1, 0, 0}, {1, 1, 0}};
    const struct mill_corner twice[] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 0, 0}, {-1, 1, 0}};
    ck_assert(!crosses(4, square));
    ck_assert(crosses(4, bow));
    ck_assert(crosses(5, on_side));
    ck_assert(crosses(4, back));
    ck_assert(crosses(5, twice));
}

TEST(arcs_that_cross_a_line_an_arc_or_their_neighbour_a_second_time_are_told)
{
    const struct mill_corner lens[] = {{-1, 0, 0.5}, {1, 0, 0.5}};
    const struct mill_corner moon[] = {{-1, 0, 0.5}, {1, 0, -0.4}};
    const struct mill_corner same[] = {{-1, 0, 0.5}, {1, 0, -0.5}};
    const struct mill_corner line[] = {{-1, 0, 0}, {1, 0, 0}, {1, 1, 1.2}, {-1, 1, 0}};
    const struct mill_corner free_of_it[] = {{-1, 0, 0}, {1, 0, 0}, {1, 1, 0.9}, {-1, 1, 0}};
    const struct mill_corner dips[] = {{-1, 0, 0}, {1, 0, 0}, {1, 1, -0.9}, {-1, 1, 0}};
    const struct mill_corner through[] = {{-1, 0, 0}, {1, 0, 0}, {1, 1, -1.1}, {-1, 1, 0}};
    const struct mill_corner neighbour[] = {{0, 0, 0}, {1, 0, -2.5}, {0.9, 0.1, 0}, {0, 0.1, 0}};
    ck_assert(!crosses(2, lens));
    ck_assert(!crosses(2, moon));
    ck_assert(crosses(2, same));
    ck_assert(!crosses(4, free_of_it));
    ck_assert(!crosses(4, line));
    ck_assert(!crosses(4, dips));
    ck_assert(crosses(4, through));
    ck_assert(crosses(4, neighbour));
}

TEST(a_line_that_is_tangent_to_an_arc_takes_no_time_whether_it_touches_or_not)
{
    uint64_t seed = 6;
    for (int i = 0; i < unit_draws(300); i++) {
        const double u = log_uniform(&seed, 1e-3, 1.0), sag = u; /* of a chord of 2 m */
        const double gap = below(&seed, 3) ? log_uniform(&seed, 1e-9, 0.1) : 0.0;
        const double side = below(&seed, 2) ? 1.0 : -1.0, y = sag + side * gap;
        /* the arc from (1, 0) to (-1, 0) is below the line at y */
        const struct mill_corner arc[] = {{1, 0, u},  {-1, 0, 0}, {-1, -1, 0}, {-2, -1, 0},
                                          {-2, y, 0}, {2, y, 0},  {2, -1, 0},  {1, -1, 0}};
        const bool told = crosses(8, arc);
        ck_assert(gap <= 0.0 || told == (side < 0.0));
    }
}

/* Chords of all sides, in their order; fills the points */
static int chords(const struct contour *c, vec3 *p)
{
    enum { CUT = 24 };
    int n = 0;
    for (size_t k = 0; k < c->n; k++)
        for (int s = 0; s < CUT; s++) {
            vec3 normal;
            p[n++] =
                contour_at(&c->corner[k], &c->corner[(k + 1) % c->n], (double)s / CUT, &normal);
        }
    return n;
}

static double side_of(vec3 a, vec3 b, vec3 c)
{
    return vec3_cross(vec3_sub(b, a), vec3_sub(c, a)).x;
}

/* What is told agrees with chords, except where these are not near enough to the arcs. */
TEST(of_random_contours_those_that_cross_are_told_and_no_others)
{
    static vec3 p[24 * 24];
    uint64_t seed = 7;
    int cross = 0, clear = 0;
    for (int i = 0; i < unit_draws(1000); i++) {
        struct contour c = {.n = 3 + (size_t)below(&seed, 8)};
        for (size_t k = 0; k < c.n; k++)
            c.corner[k] = (struct mill_corner){uniform(&seed, -1.0, 1.0), uniform(&seed, -1.0, 1.0),
                                               random_bulge(&seed)};
        if (below(&seed, 2))
            for (size_t k = 0; k < c.n; k++)
                c.corner[k] = (struct mill_corner){cos(2.0 * PI * (double)k / (double)c.n),
                                                   sin(2.0 * PI * (double)k / (double)c.n),
                                                   uniform(&seed, -0.5, 1.0)};
        const int n = chords(&c, p);
        double least = INFINITY; /* between chords that are no neighbours */
        bool meet = false;
        for (int a = 0; a < n; a++)
            for (int b = a + 2; b < n; b++) {
                const int a1 = (a + 1) % n, b1 = (b + 1) % n;
                if (b1 == a)
                    continue;
                const double at = side_of(p[a], p[a1], p[b]), bt = side_of(p[a], p[a1], p[b1]);
                const double as = side_of(p[b], p[b1], p[a]), bs = side_of(p[b], p[b1], p[a1]);
                meet = meet || (at * bt < 0.0 && as * bs < 0.0);
                least = fmin(least, fabs(vec3_norm(vec3_sub(p[a], p[b]))));
            }
        if (crosses(c.n, c.corner))
            cross++;
        else
            clear += !meet;
        if (meet)
            ck_assert_msg(crosses(c.n, c.corner) || least < 0.02, "contour %d crosses", i);
    }
    ck_assert_int_gt(cross, unit_draws(1000) / 10);
    ck_assert_int_gt(clear, unit_draws(1000) / 10);
}

int main(void)
{
    return unit_run("lining");
}
