/* Claims about the cell grid: neighbourhoods against all pairs, bookkeeping against a plain list,
 * exit times against a fine sampling of the flight. */
#include "cells.h"

#include "engine_fixture.h"

#include <stdbool.h>

static const vec3 corner_lo = {-0.06, -0.075, -0.075}, corner_hi = {0.06, 0.075, 0.075};

struct swarm {
    struct mill_cells cells;
    int32_t balls;
    vec3 *r;
    int32_t *near;
};

static struct swarm make_swarm(int32_t balls, double diameter, double least_diameter)
{
    struct swarm s;
    s.balls = balls;
    s.r = malloc(sizeof *s.r * (size_t)balls);
    s.near = malloc(sizeof *s.near * ((size_t)balls + MILL_CELL_ROW));
    if (!s.r || !s.near ||
        !mill_cells_init(&s.cells, corner_lo, corner_hi, diameter, least_diameter, balls))
        ck_abort_msg("out of memory");
    return s;
}

static void free_swarm(struct swarm *s)
{
    mill_cells_release(&s->cells);
    free(s->r);
    free(s->near);
}

static void place(struct swarm *s, int32_t ball, vec3 r)
{
    s->r[ball] = r;
    ck_assert(mill_cells_insert(&s->cells, ball, mill_cells_at(&s->cells, r)));
}

/* Pairs nearer than `reach` that the neighbourhoods miss, balls gathered twice, balls that gather
 * themselves not exactly once. */
static long faults(struct swarm *s, double reach)
{
    long wrong = 0;
    int32_t *seen = calloc((size_t)s->balls, sizeof *seen);
    for (int32_t i = 0; i < s->balls; i++) {
        const int32_t n =
            mill_cells_gather(&s->cells, s->cells.cell[i], s->cells.around, 27, s->near);
        memset(seen, 0, sizeof *seen * (size_t)s->balls);
        for (int32_t k = 0; k < n; k++)
            seen[s->near[k]]++;
        wrong += seen[i] != 1;
        for (int32_t j = 0; j < s->balls; j++) {
            const bool touches = vec3_norm(vec3_sub(s->r[i], s->r[j])) <= reach;
            wrong += seen[j] > 1 || (touches && seen[j] == 0);
        }
    }
    free(seen);
    return wrong;
}

START_TEST(every_ball_within_a_diameter_is_in_the_neighbourhood)
{
    static const double diameter[] = {2e-3, 5e-3, 20e-3, 70e-3, 0.119, 0.2};
    uint64_t seed = 1;
    for (int k = 0; k < 6; k++) {
        struct swarm s = make_swarm(1500, diameter[k], diameter[k]);
        for (int32_t i = 0; i < s.balls; i++)
            place(&s, i, point_in(&seed, corner_lo, corner_hi));
        ck_assert_int_eq(faults(&s, diameter[k]), 0);
        free_swarm(&s);
    }
}
END_TEST

START_TEST(balls_beyond_the_box_are_neighbours_too)
{
    struct swarm s = make_swarm(1000, 10e-3, 10e-3);
    uint64_t seed = 2;
    const vec3 margin = {5e-3, 5e-3, 5e-3};
    for (int32_t i = 0; i < s.balls; i++)
        place(&s, i, point_in(&seed, vec3_sub(corner_lo, margin), vec3_add(corner_hi, margin)));
    ck_assert_int_eq(faults(&s, 10e-3), 0);
    free_swarm(&s);
}
END_TEST

/* Balls in touch whose centres lie on faces, edges and corners of cells and a rounding beside them:
 * the last digit must not hide a pair. */
START_TEST(touching_balls_on_the_faces_of_cells_are_found)
{
    const double d = 5e-3;
    struct swarm s = make_swarm(2000, d, d);
    uint64_t seed = 3;
    for (int32_t i = 0; i < s.balls; i += 2) {
        double x[3];
        const double lo[3] = {corner_lo.x, corner_lo.y, corner_lo.z};
        for (int axis = 0; axis < 3; axis++) {
            x[axis] = lo[axis] + s.cells.side[axis] * (double)below(&seed, s.cells.n[axis] - 1);
            x[axis] = nextafter(x[axis], below(&seed, 2) ? 1.0 : -1.0);
        }
        const vec3 r = vec3_make(x[0], x[1], x[2]);
        const vec3 axis[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
        place(&s, i, r);
        place(&s, i + 1, vec3_axpy(r, below(&seed, 2) ? d : -d, axis[below(&seed, 3)]));
    }
    ck_assert_int_eq(faults(&s, d), 0);
    free_swarm(&s);
}
END_TEST

/* Small balls ten to a large one's diameter, most of them crowded into a corner: far more in one
 * cell than the grid made room for. */
START_TEST(crowded_cells_of_a_mixture_grow)
{
    struct swarm s = make_swarm(6000, 20e-3, 2e-3);
    uint64_t seed = 4;
    const int32_t row = s.cells.row;
    const vec3 crowd = {-0.05, -0.065, -0.065};
    for (int32_t i = 0; i < s.balls; i++)
        place(&s, i, point_in(&seed, corner_lo, i % 8 ? crowd : corner_hi));
    ck_assert_int_gt(s.cells.row, row);
    ck_assert_int_eq(faults(&s, 20e-3), 0);
    free_swarm(&s);
}
END_TEST

/* ---- bookkeeping ---- */

/* Is every ball in its bucket once, at its slot, and nobody else anywhere? */
static long ledger_faults(const struct mill_cells *c, const int32_t *cell_of, int32_t balls)
{
    long wrong = 0, housed = 0, counted = 0;
    for (int32_t cell = 0; cell < mill_cells_count(c); cell++)
        counted += c->bucket[(int64_t)cell * c->row];
    for (int32_t i = 0; i < balls; i++) {
        if (cell_of[i] < 0)
            continue;
        housed++;
        wrong +=
            c->cell[i] != cell_of[i] || c->bucket[(int64_t)cell_of[i] * c->row + c->slot[i]] != i;
    }
    return wrong + labs(housed - counted);
}

START_TEST(inserting_removing_and_crossing_keep_the_ledger)
{
    enum { BALLS = 400 };
    struct swarm s = make_swarm(BALLS, 30e-3, 3e-3);
    int32_t cell_of[BALLS];
    uint64_t seed = 5;
    long crossings = 0;
    for (int32_t i = 0; i < BALLS; i++)
        cell_of[i] = -1;
    for (int step = 0; step < 100000; step++) {
        const int32_t i = below(&seed, BALLS);
        if (cell_of[i] < 0) {
            cell_of[i] = mill_cells_at(&s.cells, point_in(&seed, corner_lo, corner_hi));
            ck_assert(mill_cells_insert(&s.cells, i, cell_of[i]));
        } else if (below(&seed, 4) == 0) {
            mill_cells_remove(&s.cells, i);
            cell_of[i] = -1;
        } else {
            /* only through faces that have a cell behind them: the others lie at infinity */
            const int32_t face = below(&seed, 6);
            vec3 lo, hi;
            mill_cells_box(&s.cells, cell_of[i], &lo, &hi);
            const double at[6] = {lo.x, hi.x, lo.y, hi.y, lo.z, hi.z};
            if (isinf(at[face]))
                continue;
            ck_assert(mill_cells_cross(&s.cells, i, face));
            cell_of[i] = s.cells.cell[i];
            crossings++;
        }
        if (step % 1000 == 0)
            ck_assert_int_eq(ledger_faults(&s.cells, cell_of, BALLS), 0);
    }
    ck_assert_int_gt(crossings, 10000);
    free_swarm(&s);
}
END_TEST

START_TEST(crossing_a_face_leads_into_the_cell_behind_it_and_back)
{
    struct swarm s = make_swarm(1, 20e-3, 20e-3);
    const int32_t inner[3] = {s.cells.n[0] - 2, s.cells.n[1] - 2, s.cells.n[2] - 2};
    for (int32_t n = 0; n < inner[0] * inner[1] * inner[2]; n++) {
        const int32_t i[3] = {n / (inner[1] * inner[2]), n / inner[2] % inner[1], n % inner[2]};
        const vec3 middle = {corner_lo.x + (i[0] + 0.5) * s.cells.side[0],
                             corner_lo.y + (i[1] + 0.5) * s.cells.side[1],
                             corner_lo.z + (i[2] + 0.5) * s.cells.side[2]};
        const int32_t home = mill_cells_at(&s.cells, middle);
        ck_assert(mill_cells_insert(&s.cells, 0, home));
        for (int32_t face = 0; face < 6; face++) {
            if (i[face / 2] == (face % 2 ? inner[face / 2] - 1 : 0))
                continue;
            double to[3] = {middle.x, middle.y, middle.z};
            to[face / 2] += (face % 2 ? 1 : -1) * s.cells.side[face / 2];
            ck_assert(mill_cells_cross(&s.cells, 0, face));
            ck_assert_int_eq(s.cells.cell[0],
                             mill_cells_at(&s.cells, vec3_make(to[0], to[1], to[2])));
            ck_assert(mill_cells_cross(&s.cells, 0, face ^ 1));
            ck_assert_int_eq(s.cells.cell[0], home);
        }
        mill_cells_remove(&s.cells, 0);
    }
    free_swarm(&s);
}
END_TEST

/* What is new after a crossing is exactly what the neighbourhood now has and had not before. */
START_TEST(the_cells_ahead_are_those_that_came_near)
{
    struct swarm s = make_swarm(1, 20e-3, 20e-3);
    const int32_t step[3] = {s.cells.n[1] * s.cells.n[2], s.cells.n[2], 1};
    const int32_t home = mill_cells_at(&s.cells, vec3_make(0.0, 0.0, 0.0));
    for (int face = 0; face < 6; face++) {
        const int32_t to = home + (face % 2 ? step[face / 2] : -step[face / 2]);
        int32_t fresh = 0;
        for (int a = 0; a < 27; a++) {
            bool old = false, ahead = false;
            for (int b = 0; b < 27; b++)
                old |= home + s.cells.around[b] == to + s.cells.around[a];
            for (int b = 0; b < 9; b++)
                ahead |= s.cells.ahead[face][b] == s.cells.around[a];
            ck_assert_int_eq(ahead, !old);
            fresh += !old;
        }
        ck_assert_int_eq(fresh, 9);
    }
    free_swarm(&s);
}
END_TEST

START_TEST(the_outermost_cells_reach_to_infinity)
{
    struct swarm s = make_swarm(10, 20e-3, 20e-3);
    vec3 lo, hi;
    mill_cells_box(&s.cells, mill_cells_at(&s.cells, vec3_make(-1e3, -1e3, -1e3)), &lo, &hi);
    ck_assert(isinf(lo.x) && isinf(lo.y) && isinf(lo.z));
    ck_assert(isfinite(hi.x) && isfinite(hi.y) && isfinite(hi.z));
    const vec3 far = {1e3, 1e3, 1e3}, away = {5.0, 6.0, 7.0}, g = {1.0, 0.0, 9.81};
    const int32_t last = mill_cells_at(&s.cells, far);
    mill_cells_box(&s.cells, last, &lo, &hi);
    ck_assert(isinf(hi.x) && isinf(hi.y) && isinf(hi.z));
    ck_assert(isinf(mill_cells_exit(&s.cells, last, corner_hi, away, g).dt));
    free_swarm(&s);
}
END_TEST

START_TEST(a_huge_empty_box_is_not_cut_into_endless_cells)
{
    struct mill_cells cells;
    ck_assert(mill_cells_init(&cells, vec3_make(-5.0, -2.0, -2.0), vec3_make(5.0, 2.0, 2.0), 1e-4,
                              1e-4, 100));
    ck_assert_int_lt(mill_cells_count(&cells), 20000);
    mill_cells_release(&cells);
}
END_TEST

/* ---- exits ---- */

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

START_TEST(the_exit_is_the_first_passage_through_a_face)
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
END_TEST

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

START_TEST(a_ball_on_a_face_leaves_when_it_moves_outwards)
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
END_TEST

START_TEST(a_ball_on_a_face_stays_when_it_rests_or_moves_inwards)
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
END_TEST

/* Rounding put the ball so far out that its throw inwards never reaches the face: it has left when
 * it turns back. */
START_TEST(a_ball_that_never_gets_in_leaves_at_its_turning_point)
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
END_TEST

/* Following the exits from cell to cell gives the cells that a sampling of the flight gives. */
START_TEST(a_long_flight_is_never_outside_its_cell)
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
            ck_assert(mill_cells_cross(&s.cells, 0, e.face));
            crossings++;
        }
        mill_cells_remove(&s.cells, 0);
    }
    ck_assert_int_gt(crossings, 3000);
    free_swarm(&s);
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("cells");
    TCase *tests = tcase_create("cells");
    tcase_set_timeout(tests, 60);
    tcase_add_test(tests, every_ball_within_a_diameter_is_in_the_neighbourhood);
    tcase_add_test(tests, balls_beyond_the_box_are_neighbours_too);
    tcase_add_test(tests, touching_balls_on_the_faces_of_cells_are_found);
    tcase_add_test(tests, crowded_cells_of_a_mixture_grow);
    tcase_add_test(tests, inserting_removing_and_crossing_keep_the_ledger);
    tcase_add_test(tests, crossing_a_face_leads_into_the_cell_behind_it_and_back);
    tcase_add_test(tests, the_cells_ahead_are_those_that_came_near);
    tcase_add_test(tests, the_outermost_cells_reach_to_infinity);
    tcase_add_test(tests, a_huge_empty_box_is_not_cut_into_endless_cells);
    tcase_add_test(tests, the_exit_is_the_first_passage_through_a_face);
    tcase_add_test(tests, a_ball_on_a_face_leaves_when_it_moves_outwards);
    tcase_add_test(tests, a_ball_on_a_face_stays_when_it_rests_or_moves_inwards);
    tcase_add_test(tests, a_ball_that_never_gets_in_leaves_at_its_turning_point);
    tcase_add_test(tests, a_long_flight_is_never_outside_its_cell);
    suite_add_tcase(suite, tests);
    SRunner *runner = srunner_create(suite);
    srunner_run_all(runner, CK_NORMAL);
    const int failed = srunner_ntests_failed(runner);
    srunner_free(runner);
    return failed != 0;
}
