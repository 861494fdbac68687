/* Claims about blades, which are boxes on a rotor, against closed forms and roots found
 * independently in long double. */
#include "shape_fixture.h"

#define TIP 0.06
#define WIDTH 0.012
#define THICK 0.007
#define RADIUS 0.0025

static const vec3 fall = {0.0, 0.0, -9.81};
static const struct mill_blade plain = {.tip_radius = TIP, .width = WIDTH, .thickness = THICK};

/* The blade's own axes, by their definition: width along x and thickness around the axis, both then
 * turned by the pitch about the radial line */
struct axes {
    vec3 w, s, h;
};

static struct axes axes_of(const struct mill_blade *spec, double turn)
{
    const double a = spec->angle + turn;
    const vec3 radial = vec3_make(0.0, cos(a), sin(a)), around = vec3_make(0.0, -sin(a), cos(a));
    const vec3 x = vec3_make(1.0, 0.0, 0.0);
    const struct axes out = {vec3_axpy(vec3_scale(x, cos(spec->pitch)), sin(spec->pitch), around),
                             radial,
                             vec3_axpy(vec3_scale(around, cos(spec->pitch)), -sin(spec->pitch), x)};
    return out;
}

static vec3 place(const struct mill_blade *spec, double turn, double w, double s, double h)
{
    const struct axes a = axes_of(spec, turn);
    vec3 r = vec3_make(spec->position, 0.0, 0.0);
    r = vec3_axpy(r, w, a.w);
    r = vec3_axpy(r, s, a.s);
    return vec3_axpy(r, h, a.h);
}

static struct mill_blade pitched(double pitch)
{
    struct mill_blade blade = plain;
    blade.pitch = pitch;
    return blade;
}

/* A coordinate in the low, middle or high third of a side from lo to hi, and how far it is out */
static double third(uint64_t *seed, int which, double lo, double hi, double *out)
{
    *out = which == 0 ? 0.0 : uniform(seed, 1e-6, 0.01);
    return which == 0 ? uniform(seed, lo, hi) : which < 0 ? lo - *out : hi + *out;
}

/* When a ball on this flight meets the blade, within the loop's horizon */
static double meets(const struct mill *m, vec3 r, vec3 v, vec3 g, bool touching)
{
    const struct flight f = {.path = {.r = r, .v = v, .g = g}, .radius = RADIUS};
    const struct mill_hit hit = ask(m->shape[BLADE], &f, 0.06, touching);
    ck_assert_int_ne(hit.state, MILL_HIT_ASK_AGAIN);
    return hit.t;
}

TEST(gap_normal_and_point_are_exact_at_all_faces_edges_and_corners)
{
    uint64_t seed = 1;
    for (int i = 0; i < 270; i++) {
        const int region[3] = {i % 3 - 1, i / 3 % 3 - 1, i / 9 % 3 - 1};
        struct mill_blade spec = pitched(i < 27 ? 0.0 : uniform(&seed, -4.0, 4.0));
        double out[3];
        spec.position = uniform(&seed, -0.03, 0.03);
        spec.angle = uniform(&seed, -7.0, 7.0);
        const double turn = uniform(&seed, -7.0, 7.0);
        const double w = third(&seed, region[0], -0.5 * WIDTH, 0.5 * WIDTH, &out[0]);
        const double s = third(&seed, region[1], 0.0, TIP, &out[1]);
        const double h = third(&seed, region[2], -0.5 * THICK, 0.5 * THICK, &out[2]);
        const double distance = sqrt(out[0] * out[0] + out[1] * out[1] + out[2] * out[2]);
        if (distance == 0.0)
            continue;
        struct mill m;
        mill_build(&m, &spec, 10.0, turn);
        const vec3 r = place(&spec, turn, w, s, h);
        const struct mill_contact c = contact_of(m.shape[BLADE], r, RADIUS, 0.0);
        const vec3 corner = place(&spec, turn, w - region[0] * out[0], s - region[1] * out[1],
                                  h - region[2] * out[2]);
        ck_assert_double_eq_tol(c.gap, distance - RADIUS, 1e-16);
        ck_assert_double_lt(vec3_norm(vec3_sub(c.point, corner)), 1e-15);
        ck_assert_double_lt(
            vec3_norm(vec3_sub(vec3_scale(c.normal, distance), vec3_sub(r, corner))), 1e-15);
        mill_demolish(&m);
    }
}

TEST(a_centre_inside_is_as_deep_as_the_nearest_face)
{
    uint64_t seed = 2;
    const struct mill_blade spec = pitched(0.4);
    struct mill m;
    mill_build(&m, &spec, 10.0, 0.7);
    for (int i = 0; i < 1000; i++) {
        const double w = uniform(&seed, -0.5, 0.5) * WIDTH, s = uniform(&seed, 0.0, 1.0) * TIP,
                     h = uniform(&seed, -0.5, 0.5) * THICK;
        const double depth =
            fmin(fmin(0.5 * WIDTH - fabs(w), 0.5 * THICK - fabs(h)), fmin(s, TIP - s));
        const vec3 r = place(&spec, 0.7, w, s, h);
        const struct mill_contact c = contact_of(m.shape[BLADE], r, RADIUS, 0.0);
        ck_assert_double_eq_tol(c.gap, -depth - RADIUS, 1e-16);
        ck_assert_double_eq_tol(gap_of(m.shape[BLADE], c.point, 0.0, 0.0), 0.0, 1e-16);
        ck_assert_double_eq_tol(vec3_norm(c.normal), 1.0, 1e-15);
    }
    mill_demolish(&m);
}

TEST(positive_pitch_turns_the_positive_x_edge_towards_increasing_rotor_angle)
{
    const double pitch = PI / 6, quarter = 1.0; /* [s] of a turn */
    struct mill_blade spec = pitched(pitch);
    struct mill m;
    spec.thickness = 1e-3;
    spec.position = 0.02;
    mill_build(&m, &spec, PI / 2.0, 0.0);
    const struct mill_shape *b = m.shape[BLADE];
    /* angle 0 points along +y, and the angle grows towards +z */
    const double x = 0.49 * WIDTH * cos(pitch), z = 0.49 * WIDTH * sin(pitch);
    ck_assert_double_lt(gap_of(b, vec3_make(0.02 + x, 0.03, z), 0.0, 0.0), 0.0);
    ck_assert_double_lt(gap_of(b, vec3_make(0.02 - x, 0.03, -z), 0.0, 0.0), 0.0);
    ck_assert_double_gt(gap_of(b, vec3_make(0.02 + x, 0.03, -z), 0.0, 0.0), 1e-3);
    ck_assert_double_gt(gap_of(b, vec3_make(0.02 - x, 0.03, z), 0.0, 0.0), 1e-3);
    /* a quarter turn on it points along +z, and the angle grows towards -y */
    ck_assert_double_lt(gap_of(b, vec3_make(0.02 + x, -z, 0.03), 0.0, quarter), 0.0);
    ck_assert_double_gt(gap_of(b, vec3_make(0.02 + x, z, 0.03), 0.0, quarter), 1e-3);
    mill_demolish(&m);
}

TEST(a_stroke_of_the_face_on_a_ball_at_rest_comes_at_the_closed_form_s_time)
{
    uint64_t seed = 3;
    for (int i = 0; i < 1000; i++) {
        const double omega = (i % 2 ? 1.0 : -1.0) * log_uniform(&seed, 10.0, 400.0);
        const double rho = uniform(&seed, 0.02, 0.055), ahead = uniform(&seed, 0.4, 0.5);
        struct mill_blade spec = plain;
        struct mill m;
        spec.angle = uniform(&seed, -PI, PI);
        mill_build(&m, &spec, omega, 0.0);
        const double at = spec.angle + copysign(ahead, omega);
        const double expected = (ahead - asin((0.5 * THICK + RADIUS) / rho)) / fabs(omega);
        const double t =
            meets(&m, vec3_make(0.004, rho * cos(at), rho * sin(at)), nought, nought, false);
        if (expected < 0.06)
            ck_assert_double_eq_tol((t - expected) * omega * rho, 0.0, 1.2 * MILL_SHAPE_CLOSED);
        else
            ck_assert(isinf(t));
        mill_demolish(&m);
    }
}

/* Height of a falling ball's centre over the leading face's plane, less its radius; pitch 0 */
static long double over_face(const struct mill_flight *f, long double omega, long double t)
{
    const long double y = f->r.y + f->v.y * t + f->g.y * t * t / 2;
    const long double z = f->r.z + f->v.z * t + f->g.z * t * t / 2;
    return cosl(omega * t) * z - sinl(omega * t) * y - 0.5L * THICK - RADIUS;
}

TEST(a_stroke_on_a_ball_in_flight_comes_at_the_root_found_in_long_double)
{
    uint64_t seed = 4;
    int met = 0;
    const struct mill_blade wide = {.tip_radius = 0.07, .width = 0.1, .thickness = THICK};
    for (int i = 0; i < 2000; i++) {
        const double omega = uniform(&seed, 10.0, 200.0);
        const vec3 r = vec3_make(0.0, uniform(&seed, 0.03, 0.05), 0.03);
        const vec3 v = vec3_scale(direction(&seed), uniform(&seed, 0.0, 0.3));
        const struct mill_flight f = path_of(r, v, fall);
        struct mill m;
        mill_build(&m, &wide, omega, 0.0);
        long double lo = 0.0L, hi = 0.0L;
        while (over_face(&f, omega, hi) > 0.0L)
            hi += 1e-5L;
        for (int k = 0; k < 80; k++) {
            const long double mid = 0.5L * (lo + hi);
            *(over_face(&f, omega, mid) > 0.0L ? &lo : &hi) = mid;
        }
        /* only where the ball meets the face, not the tip's edge */
        const vec3 at = vec3_fly(r, v, fall, (double)lo);
        const double radial = cos(omega * (double)lo) * at.y + sin(omega * (double)lo) * at.z;
        if (radial < 0.069 && radial > 0.001 && lo < 0.05L) {
            met++;
            const double t = meets(&m, r, v, fall, false);
            const long double speed =
                (over_face(&f, omega, lo - 1e-7L) - over_face(&f, omega, lo + 1e-7L)) / 2e-7L;
            ck_assert_double_eq_tol((t - (double)lo) * (double)speed, 0.0, 2e-15);
        }
        mill_demolish(&m);
    }
    ck_assert_int_gt(met, 1000);
}

TEST(a_ball_that_falls_on_the_tip_edge_or_corner_of_a_standing_blade_meets_it_exactly)
{
    struct mill_blade spec = pitched(0.3);
    struct mill m;
    spec.angle = PI / 2; /* upwards */
    mill_build(&m, &spec, 0.0, 0.0);
    for (int i = 0; i < 3; i++) {
        const double out[2] = {i > 0 ? 0.001 : -0.001, i > 1 ? 0.0015 : -0.0015};
        const double across =
            fmax(out[0], 0.0) * fmax(out[0], 0.0) + fmax(out[1], 0.0) * fmax(out[1], 0.0);
        const double top = TIP + sqrt(RADIUS * RADIUS - across), drop = 0.008;
        const vec3 r = place(&spec, 0.0, 0.5 * WIDTH + out[0], top + drop, -0.5 * THICK - out[1]);
        ck_assert_double_eq_tol(meets(&m, r, nought, fall, false), sqrt(2.0 * drop / 9.81), 1e-14);
    }
    mill_demolish(&m);
}

TEST(a_turning_corner_meets_a_ball_at_rest_when_it_is_a_radius_away)
{
    uint64_t seed = 5;
    for (int i = 0; i < 1000; i++) {
        /* beyond the corner at +w, tip, +h as it will be after a time; thereafter not nearer */
        const double then = uniform(&seed, 1e-3, 0.02), turn = uniform(&seed, -3.0, 3.0);
        const double third_axis = 1.0 / sqrt(3.0);
        struct mill m;
        mill_build(&m, &plain, 100.0, turn);
        const vec3 r = place(&plain, turn + 100.0 * then, 0.5 * WIDTH + RADIUS * third_axis,
                             TIP + RADIUS * third_axis, 0.5 * THICK + RADIUS * third_axis);
        const double t = meets(&m, r, nought, nought, false);
        const double speed = 100.0 * (TIP - 0.5 * THICK) * third_axis;
        ck_assert_double_eq_tol((t - then) * speed, 0.0, 2e-15);
        mill_demolish(&m);
    }
}

/* The tip's edge sweeps past a ball at rest again and again, `clear` [m] from it. */
static double sweep(double omega, double pitch, double clear)
{
    const struct mill_blade spec = pitched(pitch);
    struct mill m;
    mill_build(&m, &spec, omega, 0.1);
    const double across = 0.5 * (WIDTH * fabs(sin(pitch)) + THICK * fabs(cos(pitch)));
    /* where the corner passes: the ball's centre straight beyond it */
    const double x = 0.5 * (WIDTH * cos(pitch) - THICK * sin(pitch));
    const double rho = hypot(TIP, across) + RADIUS + clear;
    const double t = meets(&m, vec3_make(pitch == 0.0 ? 0.0 : x, 0.0, -rho), nought, nought, false);
    mill_demolish(&m);
    return t;
}

TEST(a_tip_that_passes_by_a_nanometre_misses_and_one_that_is_a_nanometre_too_long_hits)
{
    const double pitches[] = {0.0, 0.5};
    const double speeds[] = {105.0, -105.0, 400.0, 200.0};
    for (int p = 0; p < 2; p++) {
        for (int s = 0; s < 4; s++) {
            ck_assert(isinf(sweep(speeds[s], pitches[p], 1e-9)));
            ck_assert(sweep(speeds[s], pitches[p], -1e-9) < 0.06);
            ck_assert(isinf(sweep(speeds[s], pitches[p], 1e-13)));
            ck_assert(sweep(speeds[s], pitches[p], -1e-13) < 0.06);
        }
    }
}

TEST(a_ball_that_flies_along_a_face_or_past_a_corner_a_nanometre_off_misses)
{
    const struct mill_blade spec = pitched(0.3);
    struct mill m;
    mill_build(&m, &spec, 0.0, 0.0);
    const struct axes a = axes_of(&spec, 0.0);
    for (int side = -1; side <= 1; side += 2) {
        const double off = side * 1e-9;
        const vec3 beside = place(&spec, 0.0, -0.01, 0.02, 0.5 * THICK + RADIUS + off);
        const vec3 along = vec3_axpy(vec3_scale(a.w, 2.0), 0.1, a.s);
        const double along_face = meets(&m, beside, along, nought, false);
        /* past the corner, square to the line from it to the centre */
        const double reach = (RADIUS + off) / sqrt(3.0);
        const vec3 past = vec3_scale(vec3_sub(a.w, a.s), 1.0 / sqrt(2.0));
        const vec3 top = place(&spec, 0.0, 0.5 * WIDTH + reach, TIP + reach, 0.5 * THICK + reach);
        const double by_corner = meets(&m, vec3_axpy(top, -0.01, past), past, nought, false);
        if (side > 0) {
            ck_assert(isinf(along_face));
            ck_assert(isinf(by_corner));
        } else {
            /* half the chord before the nearest point, by Pythagoras */
            const double half = sqrt(RADIUS * RADIUS - (RADIUS + off) * (RADIUS + off));
            ck_assert_double_eq_tol(by_corner, 0.01 - half, 1e-12);
            ck_assert(along_face < 0.06);
        }
    }
    mill_demolish(&m);
}

TEST(a_slow_hop_on_a_standing_blade_lasts_as_long_as_a_throw)
{
    struct mill m;
    mill_build(&m, &plain, 0.0, 0.0);
    const vec3 on = place(&plain, 0.0, 0.001, 0.03, 0.5 * THICK + RADIUS);
    for (double v = 1e-6; v < 0.2; v *= 1.5)
        ck_assert_double_eq_tol(meets(&m, on, vec3_make(0.0, 0.0, v), fall, true), 2.0 * v / 9.81,
                                1e-15 * 9.81 / v + 1e-15);
    mill_demolish(&m);
}

/* A ball that a rising blade lifts and throws outwards in small hops */
TEST(a_ball_hops_along_a_turning_blade_without_a_contact_missed_or_too_early)
{
    struct mill m;
    const struct mill_blade spec = {
        .tip_radius = 0.067, .width = WIDTH, .thickness = THICK, .pitch = 0.1};
    int hops = 0, give_ups = 0;
    mill_build(&m, &spec, 60.0, 0.0);
    const struct mill_shape *b = m.shape[BLADE];
    struct flight f = {.path = {.r = place(&spec, 0.0, 0.0, 0.02, 0.5 * THICK + RADIUS), .g = fall},
                       .radius = RADIUS};
    for (double t = 0.0; !isinf(t); hops++) {
        f = later(&f, t);
        const struct mill_contact c = contact_of(b, f.path.r, f.radius, f.now);
        ck_assert_double_le(fabs(c.gap), 1e-12);
        const double u_n = vec3_dot(vec3_sub(f.path.v, c.velocity), c.normal);
        f.path.v = vec3_axpy(f.path.v, fmax(0.5 * fabs(u_n), 5e-3) - u_n, c.normal);
        const double drum = first_contact(m.shape[DRUM], &f, 0.06, false, NULL);
        t = first_contact(b, &f, fmin(0.06, drum), true, &give_ups);
        ck_assert_double_gt(t, 0.0);
        ck_assert(isinf(first_below(b, &f, fmin(t, drum), 1e-12)));
    }
    ck_assert_int_gt(hops, 20);
    ck_assert_int_eq(give_ups, 0);
    mill_demolish(&m);
}

/* The face draws back from a falling ball by some nanometres a second: every certain step is next
 * to nothing. */
TEST(a_ball_that_glides_along_a_face_drawing_back_is_not_met)
{
    struct mill m;
    const struct mill_blade spec = {.tip_radius = 0.067, .width = WIDTH, .thickness = THICK};
    mill_build(&m, &spec, -1e-7, 0.0);
    const struct flight f = {
        .path = {.r = {0.0, 0.06, 0.5 * THICK + RADIUS}, .g = {0.0, -9.81, 0.0}}, .radius = RADIUS};
    ck_assert_double_eq_tol(gap_at(m.shape[BLADE], &f, 0.0), 0.0, 1e-17);
    ck_assert(isinf(first_contact(m.shape[BLADE], &f, 0.06, true, NULL)));
    mill_demolish(&m);
}

/* The same on a fast rotor, where a bound of all accelerations makes certain steps tiny, and from a
 * gap closed by a rounding: a place that the fuzzer found */
TEST(a_ball_that_a_fast_blade_leaves_without_a_push_is_not_met)
{
    const struct mill_blade spec = {.position = 0.074999991059303286,
                                    .angle = 6.9999991655349731,
                                    .tip_radius = 0.0675,
                                    .width = 0.0075,
                                    .thickness = 0.0075,
                                    .pitch = -6.9942330121994019};
    const struct flight f = {
        .path = {.r = {0.08778864037072634, -0.00037923657435112994, 0.00013357732643832105},
                 .v = {1.0416347359160957e-09, 0.0, 0.0}},
        .radius = 0.0075};
    struct mill m;
    mill_build(&m, &spec, 9990.8691594912507, 6.9999991655349731);
    ck_assert_int_ne(ask(m.shape[BLADE], &f, 1e-6, true).state, MILL_HIT_CONTACT);
    mill_demolish(&m);
}

/* Another such place: the search takes a hundred thousand steps and more, and the gap is still
 * below 1e-12 m. What it returns meanwhile is no contact. */
TEST(a_ball_that_leaves_a_fast_blade_by_a_nanometre_a_second_is_not_met_however_long_it_takes)
{
    const struct mill_blade spec = {.position = 0.00067312381483771171,
                                    .angle = 6.9999991655349731,
                                    .tip_radius = 0.0009122809104659572,
                                    .width = 0.00010136454560732858,
                                    .thickness = 0.00010136454560732858};
    const struct mill_setup_drum drum = {.radius = 0.0010136454560732858, .length = 0.01};
    const struct flight f = {
        .path = {.r = {0.00082517063324870452, -4.5480205673886505e-05, 4.1167912762866911e-05},
                 .v = {1.0341034232116775e-09, -8.6214722027632334e-11, -9.0554154375061404e-11}},
        .radius = 0.00010136454560732858};
    struct mill m;
    mill_build_in(&m, &drum, &spec, 9990.8691594912507, 6.9999991655349731);
    double t = 0.0;
    int asked = 0;
    for (; t < 0.0003; asked++) {
        const struct flight from = later(&f, t);
        const struct mill_hit hit = ask(m.shape[BLADE], &from, 0.01, asked == 0);
        ck_assert_msg(hit.state == MILL_HIT_ASK_AGAIN, "met at %g s", t + hit.t);
        t += hit.t;
    }
    ck_assert_int_gt(asked, 20);
    mill_demolish(&m);
}

TEST(a_ball_at_rest_against_a_standing_blade_is_left_alone_without_gravity)
{
    struct mill m;
    mill_build(&m, &plain, 0.0, 0.0);
    const vec3 r = {0.0, 0.03, 0.5 * THICK + RADIUS};
    ck_assert_double_eq_tol(gap_of(m.shape[BLADE], r, RADIUS, 0.0), 0.0, 1e-17);
    ck_assert(isinf(meets(&m, r, nought, nought, false)));
    mill_demolish(&m);
}

/* Horizon and gravity make no product that is not a number. */
TEST(a_search_without_end_and_gravity_finds_what_a_long_one_finds)
{
    for (int turning = 0; turning < 2; turning++) {
        struct mill m;
        mill_build(&m, &plain, turning ? 20.0 : 0.0, 0.0);
        struct flight f = {.path = {.r = {0.0, 0.03, 0.05}, .v = {0.0, 0.0, -1.0}},
                           .radius = RADIUS};
        const struct mill_hit hit = ask(m.shape[BLADE], &f, (double)INFINITY, false);
        const struct mill_hit within = ask(m.shape[BLADE], &f, 0.06, false);
        ck_assert_int_eq(hit.state, MILL_HIT_CONTACT);
        ck_assert_int_eq(within.state, MILL_HIT_CONTACT);
        ck_assert_double_eq_tol(hit.t, within.t, 1e-14);
        if (!turning)
            ck_assert_double_eq_tol(hit.t, 0.05 - RADIUS - 0.5 * THICK, 1e-15);
        f.path.v.z = 1.0; /* away from it, for ever */
        const struct mill_hit away = ask(m.shape[BLADE], &f, (double)INFINITY, false);
        ck_assert(away.state == MILL_HIT_NONE || away.state == MILL_HIT_ASK_AGAIN);
        ck_assert_double_gt(away.t, 0.06);
        mill_demolish(&m);
    }
}

int main(void)
{
    return unit_run("blade");
}
