/* Claims about the rows of the cell grid: short, packed and wide ones hold, hand out and lose
 * balls, and keep them when they grow. */
#include "cells_fixture.h"

/* A form of the rows, and what makes the grid choose it */
struct form {
    int32_t told; /* number of balls told to the grid */
    double diameter, least;
    enum mill_cells_form form;
    int32_t row; /* 0: longer than MILL_CELL_ROW */
};

static const struct form forms[] = {
    {1, 20e-3, 20e-3, MILL_CELLS_SHORT, 8},      {65535, 20e-3, 20e-3, MILL_CELLS_SHORT, 8},
    {65535, 20e-3, 4e-3, MILL_CELLS_SHORT, 0},   {65536, 20e-3, 20e-3, MILL_CELLS_PACKED, 4},
    {1000000, 5e-3, 5e-3, MILL_CELLS_PACKED, 4}, {65536, 20e-3, 4e-3, MILL_CELLS_WIDE, 0},
    {1000000, 20e-3, 10e-3, MILL_CELLS_WIDE, 0},
};
enum { FORMS = sizeof forms / sizeof *forms };

static struct swarm open_swarm(const struct form *f)
{
    return make_swarm(f->told, f->diameter, f->least);
}

LOOP_TEST(the_form_follows_the_number_of_balls_and_the_room_they_need, FORMS)
{
    struct swarm s = open_swarm(&forms[_i]);
    ck_assert_int_eq(s.cells.form, forms[_i].form);
    if (forms[_i].row > 0)
        ck_assert_int_eq(s.cells.row, forms[_i].row);
    else
        ck_assert_int_gt(s.cells.row, MILL_CELL_ROW);
    free_swarm(&s);
}

/* ---- a plain list beside the grid ---- */

enum { MOST = 300, SPOTS = 4 };

struct ledger {
    int32_t ball[MOST]; /* their numbers */
    int32_t cell[MOST]; /* or -1: nowhere */
};

/* Numbers from the first to the very last of those told, all different */
static int32_t choose_numbers(struct ledger *l, int32_t told)
{
    const int32_t balls = told < MOST ? told : MOST;
    for (int32_t n = 0; n < balls; n++) {
        l->ball[n] = (int32_t)((int64_t)(told - 1) * n / (balls > 1 ? balls - 1 : 1));
        l->cell[n] = -1;
    }
    return balls;
}

/* Cells that hold other balls than the list says, balls handed out twice or not at all */
static long faults(const struct swarm *s, const struct ledger *l, int32_t balls)
{
    long wrong = 0, held = 0, housed = 0;
    for (int32_t cell = 0; cell < mill_cells_count(&s->cells); cell++)
        held += mill_cells_held(&s->cells, cell);
    for (int32_t n = 0; n < balls; n++) {
        if (l->cell[n] < 0)
            continue;
        int times = 0;
        housed++;
        for (int32_t k = 0; k < mill_cells_held(&s->cells, l->cell[n]); k++)
            times += mill_cells_ball(&s->cells, l->cell[n], k) == l->ball[n];
        wrong += times != 1 || s->cells.cell[l->ball[n]] != l->cell[n];
    }
    return wrong + labs(held - housed);
}

/* The balls gathered around a cell, each times `scale`, are those the list says. */
static long gather_faults(const struct swarm *s, const struct ledger *l, int32_t balls,
                          int32_t cell, int32_t scale)
{
    long wrong = 0, expected = 0;
    const int32_t n = gather(&s->cells, cell, scale, s->near);
    int64_t around[27];
    list_near(&s->cells, -1, around);
    for (int32_t m = 0; m < balls; m++) {
        bool near = false;
        for (int k = 0; k < 27; k++)
            near |= l->cell[m] == cell + around[k] / s->cells.row;
        int times = 0;
        for (int32_t k = 0; k < n; k++)
            times += s->near[k] == l->ball[m] * scale;
        wrong += times != near;
        expected += near;
    }
    return wrong + labs(n - expected);
}

/* Balls gather in a few cells, which fill and empty; others are anywhere. */
LOOP_TEST(balls_are_held_handed_out_and_lost, FORMS)
{
    struct swarm s = open_swarm(&forms[_i]);
    struct ledger l;
    const int32_t balls = choose_numbers(&l, forms[_i].told);
    const int32_t room = s.cells.form == MILL_CELLS_PACKED ? s.cells.row : s.cells.row - 1;
    vec3 spot[SPOTS];
    uint64_t seed = 1;
    long most = 0;
    for (int k = 0; k < SPOTS; k++)
        spot[k] = point_in(&seed, corner_lo, corner_hi);
    for (int step = 0; step < 30000; step++) {
        const int32_t n = below(&seed, balls);
        const vec3 r =
            below(&seed, 2) ? spot[below(&seed, SPOTS)] : point_in(&seed, corner_lo, corner_hi);
        const int32_t cell = mill_cells_at(&s.cells, r), held = mill_cells_held(&s.cells, cell);
        if (l.cell[n] >= 0 && below(&seed, 3)) {
            mill_cells_remove(&s.cells, l.ball[n]);
            l.cell[n] = -1;
        } else if (l.cell[n] < 0 && held < room) { /* full rows stay as they are here */
            ck_assert(mill_cells_insert(&s.cells, l.ball[n], cell));
            l.cell[n] = cell;
            most = held + 1 > most ? held + 1 : most;
        }
        if (step % 300 == 0) {
            ck_assert_int_eq(faults(&s, &l, balls), 0);
            ck_assert_int_eq(gather_faults(&s, &l, balls, cell, 1), 0);
            ck_assert_int_eq(gather_faults(&s, &l, balls, cell, 8), 0);
        }
    }
    ck_assert_int_eq(s.cells.form, forms[_i].form);
    ck_assert_int_ge(most, balls == 1 ? 1 : room < 8 ? room : 8);
    free_swarm(&s);
}

/* ---- growth ---- */

/* Fills a cell beyond its room, ball by ball; all that was anywhere stays. */
LOOP_TEST(a_row_that_overflows_grows_and_keeps_everything, FORMS)
{
    struct swarm s = open_swarm(&forms[_i]);
    struct ledger l;
    const int32_t balls = choose_numbers(&l, forms[_i].told);
    const int32_t row = s.cells.row;
    const int32_t full = mill_cells_at(&s.cells, vec3_make(1e-3, 1e-3, 1e-3));
    uint64_t seed = 2;
    for (int32_t n = 0; n < balls; n++) {
        const vec3 r = point_in(&seed, corner_lo, corner_hi);
        l.cell[n] = n % 3 ? full : mill_cells_at(&s.cells, r);
        ck_assert(mill_cells_insert(&s.cells, l.ball[n], l.cell[n]));
        if (n % 10 == 0)
            ck_assert_int_eq(faults(&s, &l, n + 1), 0);
    }
    ck_assert_int_eq(faults(&s, &l, balls), 0);
    ck_assert_int_eq(gather_faults(&s, &l, balls, full, 1), 0);
    ck_assert_int_eq(gather_faults(&s, &l, balls, full, 8), 0);
    if (balls > 1) {
        ck_assert_int_gt(s.cells.row, row);
        ck_assert_int_eq(s.cells.form,
                         forms[_i].form == MILL_CELLS_SHORT ? MILL_CELLS_SHORT : MILL_CELLS_WIDE);
    }
    for (int32_t n = 0; n < balls; n++) {
        mill_cells_remove(&s.cells, l.ball[n]);
        l.cell[n] = -1;
    }
    ck_assert_int_eq(faults(&s, &l, balls), 0);
    free_swarm(&s);
}

TEST(a_fifth_ball_makes_packed_rows_wide)
{
    struct swarm s = make_swarm(70000, 20e-3, 20e-3);
    struct ledger l;
    const int32_t balls = choose_numbers(&l, 70000);
    uint64_t seed = 3;
    for (int32_t n = 0; n < balls; n++) {
        int32_t cell;
        do
            cell = mill_cells_at(&s.cells, point_in(&seed, corner_lo, corner_hi));
        while (mill_cells_held(&s.cells, cell) == 4 && n < balls - 1);
        if (n == balls - 1) { /* the fifth somewhere */
            for (cell = 0; mill_cells_held(&s.cells, cell) < 4; cell++)
                ;
        }
        ck_assert_int_eq(s.cells.form, MILL_CELLS_PACKED);
        l.cell[n] = cell;
        ck_assert(mill_cells_insert(&s.cells, l.ball[n], cell));
    }
    ck_assert_int_eq(s.cells.form, MILL_CELLS_WIDE);
    ck_assert_int_eq(s.cells.row, 8);
    ck_assert_int_eq(faults(&s, &l, balls), 0);
    ck_assert_int_eq(gather_faults(&s, &l, balls, l.cell[balls - 1], 8), 0);
    free_swarm(&s);
}

/* Numbers with all bits that a packed word has for them. The grid is told of fewer, and given a
 * table of cells that is long enough: its pages are not touched. */
TEST(packed_rows_hold_the_largest_numbers)
{
    static const int32_t number[] = {MILL_CELLS_BALL, MILL_CELLS_BALL - 1, 1 << 27, 0};
    struct swarm s = make_swarm(70000, 20e-3, 20e-3);
    free(s.cells.cell);
    s.cells.cell = calloc((size_t)MILL_CELLS_BALL + 1, sizeof *s.cells.cell);
    ck_assert_ptr_nonnull(s.cells.cell);
    const int32_t cell = mill_cells_at(&s.cells, vec3_make(1e-3, 1e-3, 1e-3));
    for (int turn = 0; turn < 4; turn++) { /* each stands first, beside the count, once */
        for (int k = 0; k < 4; k++)
            ck_assert(mill_cells_insert(&s.cells, number[(turn + k) % 4], cell));
        ck_assert_int_eq(s.cells.form, MILL_CELLS_PACKED);
        ck_assert_int_eq(mill_cells_held(&s.cells, cell), 4);
        for (int k = 0; k < 4; k++)
            ck_assert_int_eq(mill_cells_ball(&s.cells, cell, k), number[(turn + k) % 4]);
        ck_assert_int_eq(gather(&s.cells, cell, 1, s.near), 4);
        for (int k = 0; k < 4; k++)
            ck_assert_int_eq(s.near[k], number[(turn + k) % 4]);
        for (int k = 0; k < 4; k++) {
            mill_cells_remove(&s.cells, number[(turn + 2 * k + k / 2) % 4]);
            ck_assert_int_eq(mill_cells_held(&s.cells, cell), 3 - k);
        }
    }
    free_swarm(&s);
}

int main(void)
{
    return unit_run("cells_rows");
}
