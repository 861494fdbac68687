/* Claims about the cell grid: neighbourhoods against all pairs, bookkeeping against a plain list.
 */
#include "cells_fixture.h"

/* Pairs nearer than `reach` that the neighbourhoods miss, balls gathered twice, balls that gather
 * themselves not exactly once. */
static long faults(struct swarm *s, double reach)
{
    long wrong = 0;
    int32_t *seen = calloc((size_t)s->balls, sizeof *seen);
    for (int32_t i = 0; i < s->balls; i++) {
        const int32_t n = gather(&s->cells, s->cells.cell[i], 1, s->near);
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

TEST(every_ball_within_a_diameter_is_in_the_neighbourhood)
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

TEST(balls_beyond_the_box_are_neighbours_too)
{
    struct swarm s = make_swarm(1000, 10e-3, 10e-3);
    uint64_t seed = 2;
    const vec3 margin = {5e-3, 5e-3, 5e-3};
    for (int32_t i = 0; i < s.balls; i++)
        place(&s, i, point_in(&seed, vec3_sub(corner_lo, margin), vec3_add(corner_hi, margin)));
    ck_assert_int_eq(faults(&s, 10e-3), 0);
    free_swarm(&s);
}

/* Balls in touch whose centres lie on faces, edges and corners of cells and a rounding beside them:
 * the last digit must not hide a pair. */
TEST(touching_balls_on_the_faces_of_cells_are_found)
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

/* Small balls ten to a large one's diameter, most of them crowded into a corner: far more in one
 * cell than the grid made room for. */
TEST(crowded_cells_of_a_mixture_grow)
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

/* ---- bookkeeping ---- */

/* Is every ball in its cell's row once, and nobody else anywhere? */
static long ledger_faults(const struct mill_cells *c, const int32_t *cell_of, int32_t balls)
{
    long wrong = 0, housed = 0, counted = 0;
    for (int32_t cell = 0; cell < mill_cells_count(c); cell++)
        counted += mill_cells_held(c, cell);
    for (int32_t i = 0; i < balls; i++) {
        if (cell_of[i] < 0)
            continue;
        housed++;
        int times = 0;
        for (int32_t k = 0; k < mill_cells_held(c, cell_of[i]); k++)
            times += mill_cells_ball(c, cell_of[i], k) == i;
        wrong += c->cell[i] != cell_of[i] || times != 1;
    }
    return wrong + labs(housed - counted);
}

TEST(inserting_removing_and_crossing_keep_the_ledger)
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
            cross(&s, i, face);
            cell_of[i] = s.cells.cell[i];
            crossings++;
        }
        if (step % 1000 == 0)
            ck_assert_int_eq(ledger_faults(&s.cells, cell_of, BALLS), 0);
    }
    ck_assert_int_gt(crossings, 10000);
    free_swarm(&s);
}

TEST(crossing_a_face_leads_into_the_cell_behind_it_and_back)
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
            cross(&s, 0, face);
            ck_assert_int_eq(s.cells.cell[0],
                             mill_cells_at(&s.cells, vec3_make(to[0], to[1], to[2])));
            cross(&s, 0, face ^ 1);
            ck_assert_int_eq(s.cells.cell[0], home);
        }
        mill_cells_remove(&s.cells, 0);
    }
    free_swarm(&s);
}

TEST(the_outermost_cells_reach_to_infinity)
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

TEST(a_huge_empty_box_is_not_cut_into_endless_cells)
{
    struct mill_cells cells;
    cut_box(&cells, vec3_make(-5.0, -2.0, -2.0), vec3_make(5.0, 2.0, 2.0), 1e-4, 1e-4, 100);
    ck_assert_int_lt(mill_cells_count(&cells), 20000);
    mill_cells_release(&cells);
}

int main(void)
{
    return unit_run("cells");
}
