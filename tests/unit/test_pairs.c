/* Claims about the pair search: every variant finds, to the bit, what a loop over all balls finds
 * that takes one after the other, in every form of the cells' rows and over several grids, for one
 * ball alone and for two together. */
#include "engine/pairs.h"

#include "base/memory.h"

#include "cells_fixture.h"

enum { KINDS = 3, GRIDS = 3, MOST_VARIANTS = 8 };

/* ---- balls in cells ---- */

/* A form of the rows, and what makes the grid choose it */
struct form {
    int32_t told; /* number of balls told to the grid */
    double least; /* [m] diameter of the smallest, as told */
    enum mill_cells_form form;
    bool crowd; /* put five balls into one cell first: packed rows widen */
    bool longer_rows;
};

#define DIAMETER 10e-3

static const struct form forms[] = {
    {2000, DIAMETER, MILL_CELLS_SHORT, false, false},
    {2000, 4e-3, MILL_CELLS_SHORT, false, true},
    {70000, DIAMETER, MILL_CELLS_PACKED, false, false},
    {70000, DIAMETER, MILL_CELLS_WIDE, true, false},
    {70000, 4e-3, MILL_CELLS_WIDE, false, true},
};
enum { FORMS = sizeof forms / sizeof *forms };

static const vec3 pull[] = {{0.0, 0.0, 0.0}, {0.0, 0.0, -9.81}, {3.0, -200.0, 150.0}};

/* Ball i is in the rows of grid i % grids. All grids have the same cells; each next one has the
 * next form of rows. */
struct field {
    int grids;
    struct mill_cells cells[GRIDS];
    const struct form *form[GRIDS];
    bool equal[GRIDS]; /* all balls in this grid are of the species with its number */
    struct mill_ball *ball;
    double radius[KINDS];
    struct mill_pairs pairs[MILL_PAIRS_TOGETHER];
    int32_t balls;
};

/* No ball has a place yet. variant: of the forms, and of the number of grids. The scratch is as
 * long as it must be and no longer. */
static void open_field(struct field *f, int variant, int32_t balls, vec3 g)
{
    const size_t room = (size_t)balls + MILL_PAIRS_ROOM;
    memset(f, 0, sizeof *f);
    f->grids = 1 + variant / FORMS;
    f->balls = balls;
    f->ball = mill_memory_get((size_t)balls, sizeof *f->ball);
    for (int k = 0; k < f->grids; k++) {
        f->equal[k] = true;
        f->form[k] = &forms[(variant + k) % FORMS];
        cut_box(&f->cells[k], corner_lo, corner_hi, DIAMETER, f->form[k]->least, f->form[k]->told);
    }
    for (int k = 0; k < KINDS; k++)
        f->radius[k] = 0.5 * DIAMETER / (1.0 + 0.7 * k);
    for (int k = 0; k < MILL_PAIRS_TOGETHER; k++) {
        struct mill_pairs *p = &f->pairs[k];
        p->ball = f->ball;
        p->radius = f->radius;
        p->g = g;
        p->near = malloc(room * sizeof *p->near);
        p->kept = malloc(room * sizeof *p->kept);
        p->terms = malloc(3 * room * sizeof *p->terms);
        if (!f->ball || !p->near || !p->kept || !p->terms)
            ck_abort_msg("out of memory");
    }
}

/* All balls have this radius. */
static void make_equal(struct field *f, double radius)
{
    for (int k = 0; k < KINDS; k++)
        f->radius[k] = radius;
}

static void close_field(struct field *f)
{
    for (int k = 0; k < f->grids; k++)
        mill_cells_release(&f->cells[k]);
    free(f->ball);
    for (int k = 0; k < MILL_PAIRS_TOGETHER; k++) {
        free(f->pairs[k].near);
        free(f->pairs[k].kept);
        free(f->pairs[k].terms);
    }
}

static struct mill_cells *grid_of(struct field *f, int32_t i)
{
    return &f->cells[i % f->grids];
}

static int32_t cell_of(const struct field *f, int32_t i)
{
    return f->cells[i % f->grids].cell[i];
}

/* A search for ball i in all cells around it, or in those ahead, in every grid; for odd balls in
 * threes if possible */
static struct mill_pairs_search search_of(const struct field *f, int32_t i, int face, double window)
{
    const double mine = f->radius[f->ball[i].species];
    struct mill_pairs_search search = {.ball = i, .looks = f->grids, .best = {window, MILL_NOBODY}};
    static int64_t offset[GRIDS][7][27];
    for (int k = 0; k < f->grids; k++)
        search.look[k] = (struct mill_grids_look){
            .count = list_near(&f->cells[k], face, offset[k][face + 1]),
            .cells = &f->cells[k],
            .offset = offset[k][face + 1],
            .sum = f->equal[k] && f->equal[i % f->grids] ? mine + f->radius[k] : 0.0,
            .cell = cell_of(f, i),
            .threes = i % 2 && face < 4 && mill_cells_shortest(&f->cells[k])};
    return search;
}

/* Where the ball is at local time `now`, `ago` seconds after its record's time */
static void put(struct field *f, int32_t i, vec3 r, vec3 v, double now, double ago)
{
    struct mill_ball *b = &f->ball[i];
    ck_assert(mill_cells_insert(grid_of(f, i), i, mill_cells_at(grid_of(f, i), r)));
    b->species = i % f->grids;
    b->r = vec3_fly(r, v, f->pairs->g, -ago);
    b->v = vec3_axpy(v, -ago, f->pairs->g);
    b->t = now - ago;
}

static vec3 some_velocity(uint64_t *seed)
{
    return below(seed, 8) ? vec3_scale(direction(seed), log_uniform(seed, 1e-3, 5.0))
                          : vec3_make(0.0, 0.0, 0.0);
}

/* Places of balls at random, none in a row that is full; numbers in no order within the rows */
static void scatter(struct field *f, double now, uint64_t *seed)
{
    const vec3 spot = {1e-3, 1e-3, 1e-3};
    const int32_t shift = below(seed, f->balls);
    for (int32_t n = 0; n < f->balls; n++) {
        const int32_t i = (n * 7 + shift) % f->balls; /* every one once: 7 divides no count used */
        const struct mill_cells *c = grid_of(f, i);
        vec3 r = spot;
        if (!f->form[i % f->grids]->crowd || mill_cells_held(c, mill_cells_at(c, spot)) >= 5) {
            const int32_t room = c->row - (c->form == MILL_CELLS_PACKED ? 0 : 1);
            do
                r = point_in(seed, corner_lo, corner_hi);
            while (mill_cells_held(c, mill_cells_at(c, r)) == room);
        }
        put(f, i, r, some_velocity(seed), now, below(seed, 4) ? uniform(seed, 0.0, 1e-3) : 0.0);
        if (!f->equal[i % f->grids])
            f->ball[i].species = below(seed, KINDS);
    }
    for (int k = 0; k < f->grids; k++) {
        ck_assert_int_eq(f->cells[k].form, f->form[k]->form);
        ck_assert_int_eq(f->cells[k].row > MILL_CELL_ROW, f->form[k]->longer_rows);
    }
}

/* ---- the plain search ---- */

/* Is ball j's cell among those around ball i's, or has it come near since i crossed this face? */
static bool is_near(const struct field *f, int32_t i, int32_t j, int face)
{
    const struct mill_cells *c = &f->cells[0];
    int32_t at[3], to[3];
    bool near = true;
    mill_cells_index(c, cell_of(f, i), at);
    mill_cells_index(c, cell_of(f, j), to);
    for (int axis = 0; axis < 3; axis++)
        near = near && abs(to[axis] - at[axis]) <= 1;
    return near && (face < 0 || to[face / 2] - at[face / 2] == (face % 2 ? 1 : -1));
}

/* Time from `now` to the contact of two balls by the formula of the search, INFINITY: none */
static double meets(const struct field *f, const struct mill_ball *me, const struct mill_ball *o,
                    double now)
{
    const vec3 g = f->pairs->g;
    const double dt = now - o->t, half = 0.5 * dt * dt;
    const double s = f->radius[me->species] + f->radius[o->species];
    const double dx = o->r.x + o->v.x * dt + g.x * half - me->r.x;
    const double dy = o->r.y + o->v.y * dt + g.y * half - me->r.y;
    const double dz = o->r.z + o->v.z * dt + g.z * half - me->r.z;
    const double ux = o->v.x + g.x * dt - me->v.x;
    const double uy = o->v.y + g.y * dt - me->v.y;
    const double uz = o->v.z + g.z * dt - me->v.z;
    const double b = dx * ux + dy * uy + dz * uz;
    const double c = dx * dx + dy * dy + dz * dz - s * s;
    const double square = b * b - (ux * ux + uy * uy + uz * uz) * c;
    if (!(b < 0.0) || !(square > 0.0))
        return (double)INFINITY;
    return fmax(c, 0.0) / (sqrt(square) - b);
}

static int32_t plain(const struct field *f, int32_t i, double now, int face, struct mill_pair *best)
{
    int32_t candidates = 0;
    for (int32_t j = 0; j < f->balls; j++) {
        if (!is_near(f, i, j, face))
            continue;
        candidates++;
        const double dt = j == i ? (double)INFINITY : meets(f, &f->ball[i], &f->ball[j], now);
        if (dt < best->dt) { /* of equal ones the first, which is the smaller */
            best->dt = dt;
            best->partner = j;
        }
    }
    return candidates;
}

/* ---- comparison ---- */

struct tally {
    /* what the comparisons came across; other: the partner is in another grid; equal, mixed: looks
     * with and without a sum of the radii */
    long searches, together, found, at_once, none, ahead, other, equal, mixed;
};

/* Ball i in the cells around it or in those ahead, and ball j in the cells around it: one after the
 * other, and both together. Equal ones cannot be searched together. */
static void compare(const struct field *f, int32_t i, int32_t j, double now, int face,
                    double window, struct tally *tally)
{
    const int32_t ball[2] = {i, j};
    const int faces[2] = {face, -1}, together = i == j ? 1 : 2;
    struct mill_pair expected[2];
    int32_t candidates[2];
    for (int s = 0; s < together; s++) {
        expected[s] = (struct mill_pair){window, MILL_NOBODY};
        candidates[s] = plain(f, ball[s], now, faces[s], &expected[s]);
    }
    const char *name = NULL;
    mill_pairs_fn *run;
    for (int k = 0; (run = mill_pairs_variant(k, &name)) != NULL; k++)
        for (int count = 1; count <= together; count++) {
            struct mill_pairs_search search[2] = {search_of(f, i, face, window),
                                                  search_of(f, j, -1, window)};
            const int32_t looked = run(f->pairs, search, count, now);
            ck_assert_msg(looked == candidates[0] + (count > 1 ? candidates[1] : 0),
                          "%s looks at %d balls", name, looked);
            for (int s = 0; s < count; s++)
                ck_assert_msg(search[s].best.partner == expected[s].partner &&
                                  memcmp(&search[s].best.dt, &expected[s].dt, sizeof(double)) == 0,
                              "%s, %d of %d: ball %d meets %d after %a s, not %d after %a s", name,
                              s, count, ball[s], search[s].best.partner, search[s].best.dt,
                              expected[s].partner, expected[s].dt);
        }
    tally->searches++;
    tally->together += together > 1;
    tally->found += expected->partner != MILL_NOBODY;
    tally->at_once += expected->dt == 0.0;
    tally->none += expected->partner == MILL_NOBODY;
    tally->ahead += face >= 0 && expected->partner != MILL_NOBODY;
    tally->other += expected->partner != MILL_NOBODY && (expected->partner - i) % f->grids != 0;
    const struct mill_pairs_search of = search_of(f, i, face, window);
    for (int k = 0; k < of.looks; k++)
        *(of.look[k].sum > 0.0 ? &tally->equal : &tally->mixed) += 1;
}

static void bring_to(struct field *f, int32_t i, double now)
{
    struct mill_ball *b = &f->ball[i];
    const double dt = now - b->t;
    b->r = vec3_fly(b->r, b->v, f->pairs->g, dt);
    b->v = vec3_axpy(b->v, dt, f->pairs->g);
    b->t = now;
}

LOOP_TEST(every_variant_finds_the_bits_of_a_plain_search, FORMS *GRIDS)
{
    static const int32_t counts[] = {16, 50, 499, 1500};
    struct tally tally = {0};
    uint64_t seed = 100 + (uint64_t)_i;
    for (int n = 0; n < 4 * 2 * 3; n++) {
        struct field f;
        const int32_t balls = counts[n % 4];
        const double now = uniform(&seed, 0.0, 0.06);
        open_field(&f, _i, balls, pull[n / 8]);
        for (int k = 0; k < f.grids; k++)
            f.equal[k] = below(&seed, 2);
        scatter(&f, now, &seed);
        for (int k = 0; k < unit_draws(150); k++) {
            const int32_t i = below(&seed, balls), j = below(&seed, balls);
            bring_to(&f, i, now);
            bring_to(&f, j, now);
            const double window = below(&seed, 2) ? HUGE_VAL : log_uniform(&seed, 1e-7, 0.06);
            compare(&f, i, j, now, below(&seed, 7) - 1, window, &tally);
            compare(&f, i, j, now, -1, window, &tally);
        }
        close_field(&f);
    }
    ck_assert_int_eq(tally.searches, 2 * 24 * unit_draws(150));
    ck_assert_int_gt(tally.together, 24 * unit_draws(150));
    ck_assert_int_gt(tally.found, unit_draws(800));
    ck_assert_int_gt(tally.ahead, unit_draws(100));
    ck_assert_int_gt(tally.at_once, unit_draws(400));
    ck_assert_int_gt(tally.none, unit_draws(500));
    ck_assert_int_gt(tally.equal, unit_draws(500));
    ck_assert_int_gt(tally.mixed, unit_draws(500));
    ck_assert(_i < FORMS || tally.other > unit_draws(300));
}

/* ---- single claims, of every variant ---- */

static const vec3 rest = {0.0, 0.0, 0.0};

static struct mill_pair ask(const struct field *f, int k, int32_t i, double window)
{
    const char *name;
    struct mill_pairs_search search = search_of(f, i, -1, window);
    mill_pairs_variant(k, &name)(f->pairs, &search, 1, 0.0);
    return search.best;
}

static int variants(void)
{
    const char *name;
    int n = 0;
    while (n < MOST_VARIANTS && mill_pairs_variant(n, &name))
        n++;
    return n;
}

/* Six balls come from six sides to the same instant, by powers of two: the times are the same bits.
 * The smallest number wins wherever it stands, in whichever row and grid. */
LOOP_TEST(of_partners_equally_early_the_smaller_wins, FORMS *GRIDS)
{
    static const vec3 side[6] = {{1, 0, 0},  {-1, 0, 0}, {0, 1, 0},
                                 {0, -1, 0}, {0, 0, 1},  {0, 0, -1}};
    const vec3 middle = {0x1p-9, 0x1p-9, 0x1p-9};
    uint64_t seed = 7;
    for (int n = 0; n < 200; n++) {
        struct field f;
        open_field(&f, _i, 12, pull[0]);
        make_equal(&f, 0x1p-8);
        const int32_t mine = below(&seed, 7), skipped = below(&seed, 6), turn = below(&seed, 6);
        int32_t least = 12;
        put(&f, mine, middle, rest, 0.0, 0.0);
        for (int32_t k = 0; k < 6; k++) {
            const int32_t way = (k + turn) % 6, number = k + (k >= mine);
            if (way == skipped)
                continue;
            put(&f, number, vec3_axpy(middle, 0x1p-7 + 0x1p-9, side[way]),
                vec3_scale(side[way], -0.5), 0.0, 0.0);
            least = number < least ? number : least;
        }
        for (int k = 0; k < variants(); k++) {
            const struct mill_pair found = ask(&f, k, mine, HUGE_VAL);
            ck_assert_double_eq(found.dt, 0x1p-8);
            ck_assert_int_eq(found.partner, least);
        }
        close_field(&f);
    }
}

LOOP_TEST(overlapping_balls_meet_at_once_when_they_close_and_not_when_they_part, FORMS *GRIDS)
{
    struct field f;
    open_field(&f, _i, 2, pull[1]);
    make_equal(&f, 0.5 * DIAMETER);
    const vec3 right = {1.0, 0.0, 0.0}, by = {0.9 * DIAMETER, 0.0, 0.0};
    put(&f, 0, rest, right, 0.0, 0.0);
    put(&f, 1, by, rest, 0.0, 0.0);
    for (int k = 0; k < variants(); k++) {
        const struct mill_pair found = ask(&f, k, 0, HUGE_VAL);
        ck_assert(found.dt == 0.0 && found.partner == 1);
        ck_assert_int_eq(ask(&f, k, 1, 1e-300).partner, 0);
    }
    f.ball[1].v = vec3_scale(right, 2.0);
    for (int k = 0; k < variants(); k++)
        ck_assert_int_eq(ask(&f, k, 0, HUGE_VAL).partner, MILL_NOBODY);
    f.ball[1].v = right; /* neither */
    for (int k = 0; k < variants(); k++)
        ck_assert_int_eq(ask(&f, k, 0, HUGE_VAL).partner, MILL_NOBODY);
    close_field(&f);
}

LOOP_TEST(a_contact_not_sooner_than_the_best_known_leaves_it_as_it_is, FORMS *GRIDS)
{
    struct field f;
    open_field(&f, _i, 2, pull[0]);
    make_equal(&f, 0.5 * DIAMETER);
    const vec3 right = {1.0, 0.0, 0.0}, by = {1.5 * DIAMETER, 1e-3, 0.0};
    put(&f, 0, rest, right, 0.0, 0.0);
    put(&f, 1, by, rest, 0.0, 0.0);
    for (int k = 0; k < variants(); k++) {
        const double dt = ask(&f, k, 0, HUGE_VAL).dt;
        const struct mill_pair same = ask(&f, k, 0, dt), sooner = ask(&f, k, 0, 0.5 * dt);
        ck_assert(same.partner == MILL_NOBODY && same.dt == dt);
        ck_assert(sooner.partner == MILL_NOBODY && sooner.dt == 0.5 * dt);
        ck_assert_int_eq(ask(&f, k, 0, dt * (1.0 + 1e-15)).partner, 1);
    }
    close_field(&f);
}

/* Nearly touching and head on: the bound by which candidates are sorted out is as sharp as it gets.
 */
LOOP_TEST(a_contact_a_little_sooner_than_the_best_known_is_found, FORMS *GRIDS)
{
    for (double away = 1e-12; away < 1e-3; away *= 3.0) {
        struct field f;
        open_field(&f, _i, 2, pull[0]);
        make_equal(&f, 0.5 * DIAMETER);
        put(&f, 0, rest, vec3_make(1.0, 0.0, 0.0), 0.0, 0.0);
        put(&f, 1, vec3_make(DIAMETER + away, 0.0, 0.0), rest, 0.0, 0.0);
        for (int k = 0; k < variants(); k++) {
            const struct mill_pair found = ask(&f, k, 0, HUGE_VAL);
            const struct mill_pair again = ask(&f, k, 0, found.dt * (1.0 + 1e-14));
            ck_assert(again.partner == 1 && again.dt == found.dt);
        }
        close_field(&f);
    }
}

LOOP_TEST(a_ball_alone_meets_nobody_and_looks_at_itself, FORMS *GRIDS)
{
    struct field f;
    const char *name;
    open_field(&f, _i, 1, pull[2]);
    put(&f, 0, rest, vec3_make(1.0, 2.0, 3.0), 0.0, 0.0);
    for (int k = 0; k < variants(); k++) {
        mill_pairs_fn *run = mill_pairs_variant(k, &name);
        struct mill_pairs_search around = search_of(&f, 0, -1, HUGE_VAL);
        ck_assert_int_eq(run(f.pairs, &around, 1, 0.0), 1);
        ck_assert(isinf(around.best.dt) && around.best.partner == MILL_NOBODY);
        struct mill_pairs_search ahead = search_of(&f, 0, 3, HUGE_VAL);
        ck_assert_int_eq(run(f.pairs, &ahead, 1, 0.0), 0);
        ck_assert(isinf(ahead.best.dt) && ahead.best.partner == MILL_NOBODY);
    }
    close_field(&f);
}

TEST(the_last_variant_is_chosen_and_each_has_a_name)
{
    const char *name = NULL;
    const int count = variants();
    ck_assert_int_ge(count, 1);
    ck_assert_int_lt(count, MOST_VARIANTS);
    for (int k = 0; k < count; k++) {
        mill_pairs_fn *search = mill_pairs_variant(k, &name);
        ck_assert(name && *name);
        ck_assert((search == mill_pairs_choose()) == (k == count - 1));
    }
    ck_assert(mill_pairs_variant(count, &name) == NULL);
}

int main(void)
{
    return unit_run("pairs");
}
