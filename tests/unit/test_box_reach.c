/* Claims about boxes that are told at once to be out of reach: it never hides a contact, and it
 * happens often. The boxes are blades on a rotor. */
#include "shape_fixture.h"

struct shot {
    struct flight flight;
    double horizon; /* [s] the ball stays inside the drum until then */
};

/* The turn, and how often its pose was asked for: no search by steps goes without. */
static long poses;

static struct mill_pose counted_pose(const struct mill_motion *motion, double t)
{
    poses++;
    return mill_turn_type.pose(motion, t);
}

/* Beside an edge or a corner of the box, in any direction from there */
static vec3 near_edge(uint64_t *seed, const struct mill_shape *box, const struct flight *f)
{
    const struct mill_body *is = mill_body_is(box);
    const struct mill_pose pose = mill_shape_pose(box, f->now);
    double share[3];
    for (int k = 0; k < 3; k++)
        share[k] = below(seed, 2) ? 0.5 : -0.5;
    if (below(seed, 3))
        share[below(seed, 3)] = uniform(seed, -0.5, 0.5);
    const vec3 edge = {share[0] * is->size.x, share[1] * is->size.y, share[2] * is->size.z};
    const vec3 off = vec3_scale(direction(seed), f->radius + log_uniform(seed, 1e-9, 1e-3));
    return mill_pose_out(&pose, mill_body_out(is, vec3_add(edge, off)));
}

/* A rotor and a ball not far from the blade along the axis, as it is asked by the loop, half of
 * them next to it, some of these at an edge, half of them flying towards it or along with it */
static struct shot random_shot(uint64_t *seed, struct mill *m)
{
    static struct mill_motion_type counted;
    static const double speeds[] = {0.0, 10.0, 105.0, -105.0, 400.0};
    const struct mill_blade spec = {.position = uniform(seed, -0.03, 0.03),
                                    .angle = uniform(seed, -7.0, 7.0),
                                    .tip_radius = uniform(seed, 0.02, 0.07),
                                    .width = log_uniform(seed, 1e-3, 0.05),
                                    .thickness = log_uniform(seed, 1e-3, 0.02),
                                    .pitch = uniform(seed, -4.0, 4.0)};
    struct shot s;
    struct flight *f = &s.flight;
    mill_build(m, &spec, speeds[below(seed, 5)], uniform(seed, -7.0, 7.0));
    counted = mill_turn_type;
    counted.pose = counted_pose;
    m->rotor->type = &counted;
    f->radius = log_uniform(seed, 5e-4, 5e-3);
    f->now = uniform(seed, 0.0, 0.06);
    const struct mill_shape *b = m->shape[BLADE];
    const double near = uniform(seed, 0.0, 1.0) < 0.5 ? 1e-3 : HUGE_VAL;
    const bool at_edge = below(seed, 3) == 0;
    double gap;
    do {
        const double rho = drum_radius * sqrt(uniform(seed, 0.0, 1.0));
        const double a = uniform(seed, 0.0, 2.0 * PI);
        f->path.r =
            vec3_make(spec.position + uniform(seed, -0.02, 0.02), rho * cos(a), rho * sin(a));
        if (at_edge)
            f->path.r = near_edge(seed, b, f);
        gap = gap_of(b, f->path.r, f->radius, f->now);
    } while (gap < 0.0 || gap > near || hypot(f->path.r.y, f->path.r.z) > drum_radius);
    const vec3 at_it = vec3_scale(contact_of(b, f->path.r, f->radius, f->now).normal, -1.0);
    const vec3 way = uniform(seed, 0.0, 1.0) < 0.5 ? direction(seed) : at_it;
    f->path.v = vec3_scale(way, log_uniform(seed, 0.1, 10.0));
    if (uniform(seed, 0.0, 1.0) < 0.5) { /* so that only what pulls counts */
        const vec3 r = f->path.r;
        f->path.v = vec3_axpy(vec3_make(0.0, -m->omega * r.z, m->omega * r.y),
                              log_uniform(seed, 1e-3, 0.1), way);
    }
    f->path.g = vec3_scale(direction(seed), uniform(seed, 0.0, 1.0) < 0.5 ? 9.81 : 0.0);
    const double v = vec3_norm(f->path.v) + 0.06 * vec3_norm(f->path.g);
    const double far = drum_radius - hypot(f->path.r.y, f->path.r.z);
    s.horizon = fmin(log_uniform(seed, 1e-4, 0.06), far / v);
    return s;
}

/* The search, with the place known or not; *steps: poses that it needed */
static double answer(const struct mill *m, const struct shot *s, bool known, double ago,
                     long *steps)
{
    const struct flight *f = &s->flight;
    struct mill_flight path = path_of(f->path.r, f->path.v, f->path.g);
    if (known)
        tell_place(m->rotor, f, s->horizon, ago, &path);
    poses = 0;
    const struct mill_shape *b = m->shape[BLADE];
    const struct mill_hit hit =
        b->type->next_contact(b, &path, f->radius, f->now, s->horizon, false);
    *steps = poses;
    return hit.t;
}

SLOW_TEST(a_known_place_changes_no_contact, 1)
{
    uint64_t seed = 1;
    long met = 0, missed = 0, steps;
    for (int n = 0; n < unit_draws(30000); n++) {
        struct mill m;
        const struct shot s = random_shot(&seed, &m);
        const double searched = answer(&m, &s, false, 0.0, &steps);
        ck_assert_int_gt(steps, 0);
        ck_assert_double_eq(answer(&m, &s, true, 0.0, &steps), searched);
        ck_assert_double_eq(answer(&m, &s, true, log_uniform(&seed, 1e-9, 1e-3), &steps), searched);
        met += !isinf(searched);
        missed += isinf(searched);
        mill_demolish(&m);
    }
    ck_assert_int_gt(met, unit_draws(600));
    ck_assert_int_gt(missed, unit_draws(1500));
}

/* Nothing but the gap is asked here. */
SLOW_TEST(a_box_that_is_said_to_be_missed_is_nowhere_entered, 1)
{
    uint64_t seed = 2;
    long missed = 0, steps;
    for (int n = 0; n < unit_draws(20000); n++) {
        struct mill m;
        const struct shot s = random_shot(&seed, &m);
        if (isinf(answer(&m, &s, true, 0.0, &steps))) {
            const double in = first_below(m.shape[BLADE], &s.flight, s.horizon, 1e-9);
            ck_assert_msg(isinf(in), "inside at %g s of %g s", in, s.horizon);
            missed++;
        }
        mill_demolish(&m);
    }
    ck_assert_int_gt(missed, unit_draws(5000));
}

TEST(most_boxes_that_are_missed_are_rejected_at_once)
{
    uint64_t seed = 3;
    long missed = 0, rejected = 0, steps;
    for (int n = 0; n < unit_draws(5000); n++) {
        struct mill m;
        const struct shot s = random_shot(&seed, &m);
        missed += isinf(answer(&m, &s, true, 0.0, &steps));
        rejected += steps == 0;
        mill_demolish(&m);
    }
    ck_assert_msg(2 * rejected > missed, "%ld of %ld rejected", rejected, missed);
}

/* Told for a box of places, at angles of the rotor at which the blade touches a ball there: it may
 * be met then. At most others it cannot. */
SLOW_TEST(a_box_touches_no_ball_of_a_cell_outside_its_sector, 1)
{
    uint64_t seed = 4;
    long touched = 0, out = 0;
    for (int n = 0; n < unit_draws(20000); n++) {
        struct mill m;
        const struct shot s = random_shot(&seed, &m);
        const struct mill_shape *b = m.shape[BLADE];
        const double side = 2.0 * s.flight.radius * uniform(&seed, 1.0, 1.7);
        const vec3 corner = {side, side, side};
        vec3 lo = vec3_axpy(s.flight.path.r, -uniform(&seed, 0.0, 1.0), corner);
        vec3 hi = vec3_add(lo, corner);
        lo.y = below(&seed, 20) ? lo.y : -HUGE_VAL; /* as cells at the border are */
        hi.z = below(&seed, 20) ? hi.z : HUGE_VAL;
        const struct mill_sector sector = b->type->sector(b, lo, hi, s.flight.radius);
        for (int k = 0; k < 40; k++) {
            const double t = uniform(&seed, 0.0, 2.0 * PI) / fmax(fabs(m.omega), 1.0);
            const vec3 y = mill_motion_pose(m.rotor, t).y;
            const bool told = y.y * sector.y + y.z * sector.z >= sector.cos;
            vec3 r = vec3_add(s.flight.path.r, point_in(&seed, vec3_scale(corner, -1.0), corner));
            r = vec3_make(r.x, fmin(fmax(r.y, lo.y), hi.y), fmin(fmax(r.z, lo.z), hi.z));
            const bool inside = hypot(r.y, r.z) < drum_radius;
            const bool touches = inside && gap_of(b, r, s.flight.radius, t) <= 0.0;
            ck_assert(told || !touches);
            touched += touches;
            out += !told;
        }
        mill_demolish(&m);
    }
    ck_assert_int_gt(touched, unit_draws(20000));
    ck_assert_int_gt(out, unit_draws(200000));
}

int main(void)
{
    return unit_run("box_reach");
}
