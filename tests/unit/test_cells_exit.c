/* Claims about when and where a flight leaves its cell, against a fine sampling of the flight. */
#include "cells_fixture.h"

/* Distances to the six faces, > 0 inside */
static void face_gaps(vec3 lo, vec3 hi, vec3 r, double gap[6])
{
    gap[0] = r.x - lo.x;
    gap[1] = hi.x - r.x;
    gap[2] = r.y - lo.y;
    gap[3] = hi.y - r.y;
    gap[4] = r.z - lo.z;
    gap[5] = hi.z - r.z;
}

/* The first of many steps after which the flight is outside; INFINITY: never within `span`. */
static double sampled_exit(vec3 lo, vec3 hi, vec3 r, vec3 v, vec3 g, double span, int steps)
{
    for (int n = 1; n <= steps; n++) {
        const double t = span * n / steps;
        double gap[6];
        face_gaps(lo, hi, vec3_fly(r, v, g, t), gap);
        for (int face = 0; face < 6; face++) {
            if (gap[face] < 0.0)
                return t;
        }
    }
    return (double)INFINITY;
}

static vec3 any_gravity(uint64_t *seed)
{
    const vec3 axis[4] = {{0, 0, 0}, {0, 0, -9.81}, {9.81, 0, 0}, {0, 9.81, 0}};
    const int32_t k = below(seed, 6);
    return k < 4 ? axis[k] : vec3_scale(direction(seed), log_uniform(seed, 1e-3, 1e3));
}

/* Speed along the outward normal of a face */
static double outwards(vec3 v, int face)
{
    const double along[3] = {v.x, v.y, v.z};
    return face % 2 ? along[face / 2] : -along[face / 2];
}

/* Checks one exit; true when the ball does leave. */
static bool check_exit(const struct mill_cells *cells, vec3 r, vec3 v, vec3 g)
{
    enum { STEPS = 3000 };
    vec3 lo, hi;
    double gap[6];
    const int32_t cell = mill_cells_at(cells, r);
    mill_cells_box(cells, cell, &lo, &hi);
    const struct mill_cell_exit exit = mill_cells_exit(cells, cell, r, v, g);
    if (isinf(exit.dt)) {
        ck_assert(isinf(sampled_exit(lo, hi, r, v, g, 1e3, STEPS)));
        return false;
    }
    face_gaps(lo, hi, vec3_fly(r, v, g, exit.dt), gap);
    const double rounding = 1e-16 + 4e-16 * exit.dt * (vec3_norm(v) + exit.dt * vec3_norm(g));
    ck_assert_double_lt(fabs(gap[exit.face]), rounding);
    const double speed = outwards(vec3_axpy(v, exit.dt, g), exit.face);
    ck_assert_double_ge(speed, -1e-12 * vec3_norm(v));
    /* nothing before it; and it is out soon after, unless it only grazes the face */
    const double span = 1.25 * exit.dt;
    const double seen = sampled_exit(lo, hi, r, v, g, span, STEPS);
    ck_assert_double_ge(seen, exit.dt * (1.0 - 1e-9));
    const double hop = 2.0 * speed / fmax(-outwards(g, exit.face), 0.0); /* how long it stays out */
    if (hop > 2.0 * span / STEPS)
        ck_assert_double_le(seen, exit.dt + 2.0 * span / STEPS);
    return true;
}

TEST(the_exit_is_the_first_passage_through_a_face)
{
    struct swarm s = make_swarm(1, 10e-3, 10e-3);
    uint64_t seed = 6;
    int out = 0;
    for (int n = 0; n < 5000; n++) {
        const vec3 r = point_in(&seed, corner_lo, corner_hi);
        const vec3 v = vec3_scale(direction(&seed), log_uniform(&seed, 1e-3, 10.0));
        out += check_exit(&s.cells, r, v, any_gravity(&seed));
    }
    ck_assert_int_gt(out, 4000);
    ck_assert_int_lt(out, 5000); /* some in outermost cells never leave */
    free_swarm(&s);
}

/* A ball at the centre of an inner cell's face, `beyond` it by some roundings. */
struct at_face {
    int32_t cell;
    int face;
    vec3 r, outward;
};

static struct at_face put_at_face(const struct swarm *s, int face, double beyond)
{
    struct at_face p;
    vec3 lo, hi;
    const vec3 axis[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    p.face = face;
    p.cell = mill_cells_at(&s->cells, vec3_make(1e-3, 1e-3, 1e-3));
    mill_cells_box(&s->cells, p.cell, &lo, &hi);
    p.outward = vec3_scale(axis[face / 2], face % 2 ? 1.0 : -1.0);
    p.r = vec3_scale(vec3_add(lo, hi), 0.5);
    const double at[6] = {lo.x, hi.x, lo.y, hi.y, lo.z, hi.z};
    const double x = at[face] + (face % 2 ? beyond : -beyond);
    if (face / 2 == 0)
        p.r.x = x;
    else if (face / 2 == 1)
        p.r.y = x;
    else
        p.r.z = x;
    return p;
}

static struct mill_cell_exit exit_at(const struct swarm *s, const struct at_face *p, double speed,
                                     double gravity)
{
    return mill_cells_exit(&s->cells, p->cell, p->r, vec3_scale(p->outward, speed),
                           vec3_scale(p->outward, gravity));
}

TEST(a_ball_on_a_face_leaves_when_it_moves_outwards)
{
    struct swarm s = make_swarm(1, 10e-3, 10e-3);
    static const double beyond[] = {0.0, 1e-17, 1e-12};
    for (int face = 0; face < 6; face++) {
        for (int k = 0; k < 3; k++) {
            const struct at_face p = put_at_face(&s, face, beyond[k]);
            struct mill_cell_exit e = exit_at(&s, &p, 0.1, 0.0);
            ck_assert(e.dt == 0.0 && e.face == face);
            e = exit_at(&s, &p, 0.1, -9.81);
            ck_assert(e.dt == 0.0 && e.face == face);
            e = exit_at(&s, &p, 0.0, 9.81); /* at rest, about to fall out */
            ck_assert(e.dt == 0.0 && e.face == face);
        }
    }
    free_swarm(&s);
}

TEST(a_ball_on_a_face_stays_when_it_rests_or_moves_inwards)
{
    struct swarm s = make_swarm(1, 10e-3, 10e-3);
    static const double beyond[] = {0.0, 1e-17, 1e-12};
    for (int face = 0; face < 6; face++) {
        const double side = s.cells.side[face / 2];
        for (int k = 0; k < 3; k++) {
            const struct at_face p = put_at_face(&s, face, beyond[k]);
            ck_assert(isinf(exit_at(&s, &p, 0.0, 0.0).dt));
            /* inwards: out at the opposite face */
            struct mill_cell_exit e = exit_at(&s, &p, -0.1, 0.0);
            ck_assert_int_eq(e.face, face ^ 1);
            ck_assert_double_eq_tol(e.dt, side / 0.1, 1e-6 * side / 0.1);
            /* at rest, falling inwards: likewise */
            e = exit_at(&s, &p, 0.0, -9.81);
            ck_assert_int_eq(e.face, face ^ 1);
            ck_assert_double_eq_tol(e.dt, sqrt(2.0 * side / 9.81), 1e-6);
            /* thrown inwards, too slow to arrive: back at the same face */
            e = exit_at(&s, &p, -0.1, 9.81);
            ck_assert_int_eq(e.face, face);
            ck_assert_double_eq_tol(e.dt, 0.2 / 9.81, 1e-6);
        }
    }
    free_swarm(&s);
}

/* Rounding put the ball so far out that its throw inwards never reaches the face: it has left when
 * it turns back. */
TEST(a_ball_that_never_gets_in_leaves_at_its_turning_point)
{
    struct swarm s = make_swarm(1, 10e-3, 10e-3);
    for (int face = 0; face < 6; face++) {
        const struct at_face p = put_at_face(&s, face, 1e-9);
        const struct mill_cell_exit e = exit_at(&s, &p, -1e-6, 9.81);
        ck_assert_int_eq(e.face, face);
        ck_assert_double_eq_tol(e.dt, 1e-6 / 9.81, 1e-12);
    }
    free_swarm(&s);
}

/* Following the exits from cell to cell gives the cells that a sampling of the flight gives. */
TEST(a_long_flight_is_never_outside_its_cell)
{
    struct swarm s = make_swarm(1, 5e-3, 5e-3);
    uint64_t seed = 7;
    long crossings = 0;
    for (int n = 0; n < 300; n++) {
        vec3 r = point_in(&seed, corner_lo, corner_hi);
        vec3 v = vec3_scale(direction(&seed), log_uniform(&seed, 0.03, 3.0));
        const vec3 g = any_gravity(&seed);
        place(&s, 0, r);
        for (int hop = 0; hop < 200; hop++) {
            const struct mill_cell_exit e = mill_cells_exit(&s.cells, s.cells.cell[0], r, v, g);
            if (isinf(e.dt))
                break;
            vec3 lo, hi;
            double gap[6];
            mill_cells_box(&s.cells, s.cells.cell[0], &lo, &hi);
            face_gaps(lo, hi, vec3_fly(r, v, g, 0.5 * e.dt), gap);
            for (int face = 0; face < 6; face++)
                ck_assert_double_ge(gap[face], -1e-14);
            r = vec3_fly(r, v, g, e.dt);
            v = vec3_axpy(v, e.dt, g);
            cross(&s, 0, e.face);
            crossings++;
        }
        mill_cells_remove(&s.cells, 0);
    }
    ck_assert_int_gt(crossings, 3000);
    free_swarm(&s);
}

/* ---- face by face ---- */

/* When a ball reaches one face. gap: inwards [m]; speed and gravity: outwards. Beyond the face, on
 * its way inwards: when it turns back there. */
static double reach(double gap, double speed, double gravity)
{
    const double square = speed * speed + 2.0 * gravity * gap;
    if (gap <= 0.0 && (speed > 0.0 || (speed == 0.0 && gravity > 0.0)))
        return 0.0;
    if (gap <= 0.0)
        return gravity > 0.0 ? (sqrt(fmax(square, 0.0)) - speed) / gravity : HUGE_VAL;
    if (isinf(gap) || square < 0.0)
        return HUGE_VAL;
    if (speed > 0.0)
        return 2.0 * gap / (speed + sqrt(square));
    return gravity > 0.0 ? (sqrt(square) - speed) / gravity : HUGE_VAL;
}

/* Does the exit come through the face that is reached first? tally: at once, later, never */
static void compare_faces(const struct mill_cells *c, int32_t cell, vec3 r, vec3 v, vec3 g,
                          long tally[3])
{
    vec3 lo, hi;
    double gap[6], dt[6], first = HUGE_VAL;
    const struct mill_cell_exit e = mill_cells_exit(c, cell, r, v, g);
    mill_cells_box(c, cell, &lo, &hi);
    face_gaps(lo, hi, r, gap);
    for (int face = 0; face < 6; face++)
        first = fmin(first, dt[face] = reach(gap[face], outwards(v, face), outwards(g, face)));
    tally[e.dt == 0.0 ? 0 : isinf(e.dt) ? 2 : 1]++;
    if (isinf(first)
            ? !isinf(e.dt)
            : !(fabs(e.dt - first) <= 1e-12 * first && dt[e.face] <= first * (1.0 + 1e-12)))
        ck_abort_msg("out after %a s through face %d, not after %a s", e.dt, e.face, first);
}

TEST(the_exit_is_through_the_face_that_is_reached_first)
{
    struct swarm s = make_swarm(1, 10e-3, 10e-3);
    uint64_t seed = 8;
    long tally[3] = {0, 0, 0};
    for (int n = 0; n < 200000; n++) {
        const bool out = below(&seed, 20) == 0; /* of the box, and on outwards */
        const vec3 r = vec3_scale(point_in(&seed, corner_lo, corner_hi), out ? 10.0 : 1.0);
        const vec3 away = out ? r : direction(&seed);
        const vec3 v = vec3_scale(away, log_uniform(&seed, 1e-3, 10.0)), g = any_gravity(&seed);
        compare_faces(&s.cells, mill_cells_at(&s.cells, r), r, v, g, tally);
    }
    ck_assert_int_gt(tally[1], 150000);
    ck_assert_int_gt(tally[2], 100);
    free_swarm(&s);
}

/* Balls on a face and some roundings beside it */
TEST(a_ball_at_a_face_leaves_through_the_face_that_is_reached_first)
{
    struct swarm s = make_swarm(1, 10e-3, 10e-3);
    static const double beyond[] = {-1e-17, 0.0, 1e-17, 1e-12, 1e-9};
    static const double speed[] = {-1e-6, 0.0, 1e-6, 0.1}, gravity[] = {-9.81, 0.0, 9.81};
    long tally[3] = {0, 0, 0};
    for (int n = 0; n < 6 * 5 * 4 * 3; n++) {
        const struct at_face p = put_at_face(&s, n % 6, beyond[n / 6 % 5]);
        const vec3 v = vec3_scale(p.outward, speed[n / 30 % 4]);
        const vec3 g = vec3_scale(p.outward, gravity[n / 120]);
        compare_faces(&s.cells, p.cell, p.r, v, g, tally);
    }
    ck_assert_int_gt(tally[0], 100);
    ck_assert_int_gt(tally[1], 100);
    ck_assert_int_gt(tally[2], 10);
    free_swarm(&s);
}

int main(void)
{
    return unit_run("cells_exit");
}
