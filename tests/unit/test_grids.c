/* Claims about the grids of a mixture, against all pairs of balls: who is near whom, what the looks
 * gather, which sizes share a grid. Balls may overlap here: the grids know only their cells. */
#include "engine/grids.h"

#include "draws.h"

enum { SIZES = 7, MOST_PUT = 700 };

/* [mm] */
struct mixture {
    double box[3], diameter[SIZES];
    int32_t count[SIZES];
};

static const struct mixture mixtures[] = {
    {{30, 24, 20}, {3}, {700}},
    {{30, 24, 20}, {2, 2.8}, {400, 300}},
    {{30, 24, 20}, {2, 4}, {400, 300}},
    {{40, 24, 31}, {6, 2}, {200, 500}},
    {{40, 24, 31}, {1.4, 7}, {600, 100}},
    {{40, 24, 31}, {1, 10}, {660, 40}},
    {{40, 24, 31}, {1, 3, 10}, {400, 200, 100}},
    {{40, 24, 31}, {2, 2.5, 8, 9}, {200, 200, 150, 150}},
    {{50, 44, 38}, {1, 1.6, 2.6, 4.2, 6.8, 11}, {150, 150, 100, 100, 100, 100}},
    {{50, 44, 38}, {1, 1.6, 2.6, 4.2, 6.8, 11, 18}, {100, 100, 100, 100, 100, 100, 100}},
    {{10.2, 43, 10.5}, {1, 10}, {600, 100}},          /* narrower than two large balls */
    {{43, 3.1, 4}, {1, 3}, {500, 200}},               /* narrower than a coarse cell */
    {{40, 24, 1.9}, {1, 1.6}, {350, 350}},            /* one layer of cells */
    {{40, 24, 5.9}, {2, 5}, {350, 350}},              /* cells wider along z */
    {{35, 24, 31}, {3, 10}, {500, 200}},              /* periodic: too short for two grids */
    {{1000, 1000, 1000}, {1, 10}, {350, 350}},        /* cells wider than a large ball */
    {{3, 3, 3}, {1.6, 2.9}, {350, 350}},              /* a single cell */
    {{40, 24, 31}, {1, 3, 10}, {60000, 5000, 5000}},  /* packed rows */
    {{40, 24, 31}, {1, 1.2, 9}, {60000, 5000, 5000}}, /* packed and wide rows */
    {{100, 100, 100}, {1, 30}, {600, 100}},           /* a large ball sees many cells */
};
enum { MIXTURES = sizeof mixtures / sizeof *mixtures };

/* A mill with balls of which `put` are in cells */
struct heap {
    struct mill_world w;
    struct mill_species species[SIZES];
    struct mill_grids g;
    int32_t put;
    vec3 r[MOST_PUT];
    int32_t *near, *seen;
};

static struct mill_species *species_of(struct heap *h, int32_t i)
{
    return &h->species[h->w.ball[i].species];
}

static int32_t *cell_of(const struct heap *h, int32_t i)
{
    return &h->g.own[0].cell[i];
}

/* No ball is in a cell yet; those with small numbers are of all sizes. volume: [m^3] of the
 * container */
static void open_heap(struct heap *h, const struct mixture *m, double volume, bool periodic)
{
    uint64_t seed = 1;
    int32_t left[SIZES];
    memset(h, 0, sizeof *h);
    const vec3 half = {0.5e-3 * m->box[0], 0.5e-3 * m->box[1], 0.5e-3 * m->box[2]};
    h->w.container.places.lo = vec3_scale(half, -1.0);
    h->w.container.places.hi = half;
    h->w.container.volume = volume;
    h->w.container.period = periodic ? 2.0 * half.x : 0.0;
    h->w.species = h->species;
    for (int k = 0; k < SIZES && m->diameter[k] > 0.0; k++) {
        h->species[h->w.species_count++].radius = 0.5e-3 * m->diameter[k];
        h->w.balls += left[k] = m->count[k];
    }
    h->w.ball = calloc((size_t)h->w.balls, sizeof *h->w.ball);
    h->near = malloc(sizeof *h->near * (size_t)(h->w.balls + MILL_CELL_ROW));
    h->seen = calloc((size_t)h->w.balls, sizeof *h->seen);
    if (!h->w.ball || !h->near || !h->seen)
        ck_abort_msg("out of memory");
    for (int32_t i = 0; i < h->w.balls; i++) {
        int32_t k = below(&seed, h->w.species_count);
        while (left[k] == 0)
            k = (k + 1) % h->w.species_count;
        left[k]--;
        h->w.ball[i].species = k;
    }
    ck_assert(mill_grids_init(&h->g, &h->w, 1.0));
}

/* Is the box long enough for periodic ends? */
static bool is_long(const struct mixture *m)
{
    double widest = 0.0;
    for (int k = 0; k < SIZES; k++)
        widest = fmax(widest, m->diameter[k]);
    return m->box[0] > 3.1 * widest;
}

static void close_heap(struct heap *h)
{
    mill_grids_release(&h->g);
    free(h->w.ball);
    free(h->near);
    free(h->seen);
}

static void put(struct heap *h, int32_t i, vec3 r)
{
    const vec3 lo = h->w.container.places.lo, hi = h->w.container.places.hi;
    h->r[i] = r;
    if (h->g.period > 0.0) /* no ball is beyond the ends */
        h->r[i].x = fmin(fmax(r.x, lo.x), hi.x);
    ck_assert(
        mill_grids_insert(&h->g, i, h->w.ball[i].species, mill_cells_at(&h->g.own[0], h->r[i])));
}

/* In the box, beyond it, or on faces of the finest cells and a rounding beside them */
static vec3 somewhere(const struct heap *h, uint64_t *seed)
{
    const vec3 lo = h->w.container.places.lo, hi = h->w.container.places.hi,
               out = {2e-3, 2e-3, 2e-3};
    const struct mill_cells *c = &h->g.own[0];
    const int32_t how = below(seed, 4);
    if (how < 2)
        return point_in(seed, lo, hi);
    if (how == 2)
        return point_in(seed, vec3_sub(lo, out), vec3_add(hi, out));
    double x[3] = {lo.x, lo.y, lo.z};
    for (int axis = 0; axis < 3; axis++) {
        x[axis] += c->side[axis] * (double)below(seed, c->n[axis] - 2 * c->margin + 1);
        x[axis] = below(seed, 3) ? nextafter(x[axis], below(seed, 2) ? 1.0 : -1.0) : x[axis];
    }
    return vec3_make(x[0], x[1], x[2]);
}

/* Every second ball touches the one before it, along an axis or not. */
static void fill_heap(struct heap *h, uint64_t *seed)
{
    static const vec3 axis[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    h->put = h->w.balls < MOST_PUT ? h->w.balls : MOST_PUT;
    for (int32_t i = 0; i < h->put; i++) {
        if (i % 2 == 0) {
            put(h, i, somewhere(h, seed));
            continue;
        }
        const vec3 way = below(seed, 2) ? axis[below(seed, 3)] : direction(seed);
        const double sum = species_of(h, i - 1)->radius + species_of(h, i)->radius;
        put(h, i, vec3_axpy(h->r[i - 1], below(seed, 2) ? sum : -sum, way));
    }
}

static void open_full(struct heap *h, int n, uint64_t seed)
{
    const struct mixture *m = &mixtures[n % MIXTURES];
    open_heap(h, m, 1e-12,
              n >= MIXTURES &&
                  is_long(m)); /* so small that no class has too few balls for a grid */
    fill_heap(h, &seed);
}

/* In a periodic box: itself or an image */
static bool near(const struct heap *h, int32_t i, int32_t i_cell, int32_t j)
{
    bool is = false;
    for (int image = -(h->g.period > 0.0); image <= (h->g.period > 0.0); image++)
        is |= mill_grids_near(&h->g, h->w.ball[i].species, i_cell, h->w.ball[j].species,
                              *cell_of(h, j), image);
    return is;
}

/* ---- who is near whom ---- */

/* [m] between the boxes of two finest cells along x, y, z; in a periodic box, of the nearest image
 */
static vec3 between(const struct mill_grids *g, int32_t a, int32_t b)
{
    vec3 la, ha, lb, hb;
    mill_cells_box(&g->own[0], a, &la, &ha);
    mill_cells_box(&g->own[0], b, &lb, &hb);
    double x = fmax(0.0, fmax(la.x - hb.x, lb.x - ha.x));
    if (g->period > 0.0)
        x = fmin(x, fmax(0.0, g->period + fmin(la.x - hb.x, lb.x - ha.x)));
    return vec3_make(x, fmax(0.0, fmax(la.y - hb.y, lb.y - ha.y)),
                     fmax(0.0, fmax(la.z - hb.z, lb.z - ha.z)));
}

LOOP_TEST(balls_that_can_touch_before_one_leaves_its_cell_are_near_each_other, 2 * MIXTURES)
{
    struct heap h;
    long touching = 0;
    open_full(&h, _i, 10);
    for (int32_t i = 0; i < unit_draws(h.put); i++) {
        for (int32_t j = 0; j < h.put; j++) {
            const double sum = species_of(&h, i)->radius + species_of(&h, j)->radius;
            const vec3 gap = between(&h.g, *cell_of(&h, i), *cell_of(&h, j));
            const bool touch = vec3_norm(vec3_sub(h.r[i], h.r[j])) <= sum;
            touching += touch && i != j;
            if (touch || vec3_norm(gap) <= sum)
                ck_assert_msg(near(&h, i, *cell_of(&h, i), j), "%d is not near %d", j, i);
            ck_assert_msg(near(&h, i, *cell_of(&h, i), j) == near(&h, j, *cell_of(&h, j), i),
                          "of %d and %d, one is near the other", i, j);
        }
    }
    ck_assert_int_gt(touching, unit_draws(h.put) / 4);
    close_heap(&h);
}

/* [m] */
static double largest_in_class(const struct heap *h, int class)
{
    double largest = 0.0;
    for (int k = 0; k < h->w.species_count; k++)
        if (h->g.class_of[k] == class)
            largest = fmax(largest, h->species[k].radius);
    return largest;
}

LOOP_TEST(balls_near_each_other_are_two_cells_beyond_their_reach_at_most, 2 * MIXTURES)
{
    struct heap h;
    open_full(&h, _i, 11);
    for (int32_t i = 0; i < unit_draws(h.put); i++) {
        for (int32_t j = 0; j < h.put; j++) {
            const int a = h.g.class_of[h.w.ball[i].species], b = h.g.class_of[h.w.ball[j].species];
            const double *side = h.g.own[a < b ? a : b].side;
            const double reach = (largest_in_class(&h, a) + largest_in_class(&h, b)) * (1.0 + 1e-8);
            const vec3 gap = between(&h.g, *cell_of(&h, i), *cell_of(&h, j));
            ck_assert_msg(!near(&h, i, *cell_of(&h, i), j) ||
                              (gap.x < reach + 2.0 * side[0] && gap.y < reach + 2.0 * side[1] &&
                               gap.z < reach + 2.0 * side[2]),
                          "%d is near %d", j, i);
        }
    }
    close_heap(&h);
}

/* ---- what the looks gather ---- */

/* How often each ball is gathered, in h->seen */
static void gather(struct heap *h, int32_t i, int32_t face)
{
    struct mill_grids_look look[MILL_GRIDS_LOOKS];
    const int looks = mill_grids_look(&h->g, h->w.ball[i].species, *cell_of(h, i), face, look);
    memset(h->seen, 0, sizeof *h->seen * (size_t)h->w.balls);
    ck_assert_msg(looks <= h->g.classes * (h->g.period > 0.0 ? 2 : 1), "%d looks", looks);
    for (int l = 0; l < looks; l++) {
        const double mine = species_of(h, i)->radius;
        const struct mill_grids_look *k = &look[l];
        const int32_t n =
            mill_cells_gather(k->cells, k->cell, k->offset, k->count, k->threes, 1, h->near);
        for (int32_t m = 0; m < n; m++) {
            h->seen[h->near[m]]++;
            ck_assert_msg(k->sum == 0.0 || k->sum == mine + species_of(h, h->near[m])->radius,
                          "look %d has another sum", l);
        }
    }
}

static void check_looks(struct heap *h, const char *when)
{
    for (int32_t i = 0; i < unit_draws(h->put); i++) {
        gather(h, i, -1);
        for (int32_t j = 0; j < h->put; j++) {
            const bool expected = i == j || near(h, i, *cell_of(h, i), j);
            ck_assert_msg(h->seen[j] == 1 || (h->seen[j] == 0 && !expected),
                          "%s: ball %d gathers ball %d %d times", when, i, j, h->seen[j]);
        }
    }
}

LOOP_TEST(the_looks_of_a_ball_gather_itself_and_every_ball_near_it_once, 2 * MIXTURES)
{
    struct heap h;
    open_full(&h, _i, 12);
    check_looks(&h, "at the start");
    close_heap(&h);
}

TEST(equal_balls_look_into_a_cell_and_the_26_around_it)
{
    struct heap h;
    struct mill_grids_look look[MILL_GRIDS_LOOKS];
    open_heap(&h, &mixtures[0], 1.0, false);
    const struct mill_cells *c = h.g.own;
    const int64_t step[3] = {(int64_t)c->n[1] * c->n[2], c->n[2], 1};
    ck_assert_int_eq(mill_grids_look(&h.g, 0, 0, -1, look), 1);
    ck_assert_int_eq(look->count, 27);
    for (int k = 0; k < 27; k++)
        ck_assert_int_eq(
            look->offset[k],
            c->row * ((k / 9 - 1) * step[0] + (k / 3 % 3 - 1) * step[1] + (k % 3 - 1) * step[2]));
    close_heap(&h);
}

/* What is new after a crossing is exactly what the neighbourhood now has and had not before. */
TEST(the_cells_ahead_are_those_that_came_near)
{
    struct heap h;
    struct mill_grids_look look[MILL_GRIDS_LOOKS], ahead[MILL_GRIDS_LOOKS];
    open_heap(&h, &mixtures[0], 1.0, false);
    mill_grids_look(&h.g, 0, 0, -1, look);
    for (int face = 0; face < 6; face++) {
        const int64_t way = (int64_t)mill_cells_step(h.g.own, face) * h.g.own->row;
        int32_t fresh = 0;
        ck_assert_int_eq(mill_grids_look(&h.g, 0, 0, face, ahead), 1);
        ck_assert_int_eq(ahead->count, 9);
        for (int a = 0; a < 27; a++) {
            bool old = false, is_ahead = false;
            for (int b = 0; b < 27; b++)
                old |= look->offset[b] == way + look->offset[a];
            for (int b = 0; b < 9; b++)
                is_ahead |= ahead->offset[b] == look->offset[a];
            ck_assert_int_eq(is_ahead, !old);
            fresh += !old;
        }
        ck_assert_int_eq(fresh, 9);
    }
    close_heap(&h);
}

TEST(equal_balls_come_with_the_sum_of_the_radii)
{
    struct heap h;
    struct mill_grids_look look[MILL_GRIDS_LOOKS];
    open_full(&h, 7, 13); /* 2, 2.5, 8, 9 mm in two grids */
    ck_assert_int_eq(mill_grids_look(&h.g, 0, *cell_of(&h, 0), -1, look), 2);
    ck_assert(look[0].sum == 0.0 && look[1].sum == 0.0);
    close_heap(&h);
    open_full(&h, 6, 13); /* 1, 3, 10 mm */
    ck_assert_int_eq(mill_grids_look(&h.g, 1, *cell_of(&h, 0), -1, look), 3);
    for (int k = 0; k < 3; k++)
        ck_assert_double_eq(look[k].sum, h.species[1].radius + h.species[k].radius);
    close_heap(&h);
}

/* ---- crossings ---- */

/* Through which face a ball can leave its cell of the finest grid: the others lie at infinity */
static bool can_cross(const struct heap *h, int32_t i, int32_t face)
{
    vec3 lo, hi;
    mill_cells_box(&h->g.own[0], *cell_of(h, i), &lo, &hi);
    const double at[6] = {lo.x, hi.x, lo.y, hi.y, lo.z, hi.z};
    return isfinite(at[face]);
}

/* Moves a ball, of which the looks ahead must gather every ball that has come near. True if there
 * was one. */
static bool cross(struct heap *h, int32_t i, int32_t face)
{
    const int32_t from = *cell_of(h, i);
    bool any = false;
    double shift, out;
    const int32_t to = mill_grids_across(&h->g, from, face, &shift);
    ck_assert_msg(mill_grids_cross(&h->g, i, h->w.ball[i].species, face, &out) &&
                      *cell_of(h, i) == to,
                  "ball %d does not cross face %d", i, face);
    const double over = to == from + mill_cells_step(&h->g.own[0], face) ? 0.0 : h->g.period;
    ck_assert_msg(shift == (face ? -over : over) && out == shift, "ball %d is moved by %g m", i,
                  shift);
    gather(h, i, face);
    for (int32_t j = 0; j < h->put; j++) {
        const bool fresh = j != i && near(h, i, *cell_of(h, i), j) && !near(h, i, from, j);
        ck_assert_msg(h->seen[j] == 1 || (h->seen[j] == 0 && !fresh),
                      "ball %d gathers ball %d %d times after face %d", i, j, h->seen[j], face);
        any |= fresh;
    }
    return any;
}

static long walk(struct heap *h, int steps, uint64_t *seed)
{
    long met = 0;
    for (int n = 0; n < steps; n++) {
        const int32_t i = below(seed, h->put), face = below(seed, 6);
        for (int far = below(seed, 12); far >= 0 && can_cross(h, i, face); far--)
            met += cross(h, i, face);
    }
    return met;
}

SLOW_TEST(after_a_crossing_the_looks_ahead_gather_every_ball_that_came_near, 2 * MIXTURES)
{
    struct heap h;
    uint64_t seed = 14;
    open_full(&h, _i, 14);
    const bool one_cell = mill_cells_count(&h.g.own[0]) == 27 || h.g.own[0].n[0] <= 3;
    ck_assert(walk(&h, unit_draws(1000), &seed) > 10 || one_cell ||
              mixtures[_i % MIXTURES].box[0] >= 1000);
    check_looks(&h, "after crossings");
    close_heap(&h);
}

/* ---- rows ---- */

/* Is every ball in the row of its class's cell once, around its finest cell, and nobody else
 * anywhere? out: balls in no cell; NULL: none */
static void check_rows(const struct heap *h, const bool *out)
{
    long held[MILL_GRIDS_MOST] = {0};
    const struct mill_cells *fine = &h->g.own[0];
    for (int32_t i = 0; i < h->put; i++) {
        if (out && out[i])
            continue;
        const int class = h->g.class_of[h->w.ball[i].species];
        const struct mill_cells *c = &h->g.own[class];
        int32_t at[3];
        mill_cells_index(fine, *cell_of(h, i), at);
        const vec3 middle = {fine->lo.x + (at[0] - fine->margin + 0.5) * fine->side[0],
                             fine->lo.y + (at[1] - fine->margin + 0.5) * fine->side[1],
                             fine->lo.z + (at[2] - fine->margin + 0.5) * fine->side[2]};
        const int32_t cell = mill_cells_at(c, middle);
        int times = 0;
        for (int32_t k = 0; k < mill_cells_held(c, cell); k++)
            times += mill_cells_ball(c, cell, k) == i;
        ck_assert_msg(times == 1, "ball %d is in its cell %d times", i, times);
        held[class]--;
    }
    for (int class = 0; class < h->g.classes; class ++) {
        for (int32_t cell = 0; cell < mill_cells_count(&h->g.own[class]); cell++)
            held[class] += mill_cells_held(&h->g.own[class], cell);
        ck_assert_int_eq(held[class], 0);
    }
}

LOOP_TEST(inserting_removing_and_crossing_keep_the_rows, 2 * MIXTURES)
{
    struct heap h;
    bool out[MOST_PUT] = {false};
    uint64_t seed = 15;
    double shift;
    open_full(&h, _i, 15);
    for (int n = 0; n < unit_draws(3000); n++) {
        const int32_t i = below(&seed, h.put), face = below(&seed, 6);
        if (out[i])
            put(&h, i, somewhere(&h, &seed));
        else if (below(&seed, 3) == 0)
            mill_grids_remove(&h.g, i, h.w.ball[i].species);
        else {
            if (can_cross(&h, i, face))
                ck_assert(mill_grids_cross(&h.g, i, h.w.ball[i].species, face, &shift));
            continue;
        }
        out[i] = !out[i];
        if (n % 100 == 0)
            check_rows(&h, out);
    }
    check_rows(&h, out);
    close_heap(&h);
}

/* All balls of a size come into one cell, size after size. */
SLOW_TEST(rows_that_grow_keep_what_is_near, 2 * MIXTURES)
{
    struct heap h;
    uint64_t seed = 16;
    open_full(&h, _i, 16);
    for (int k = 0; k < h.w.species_count; k++) {
        const struct mill_cells *c = &h.g.own[h.g.class_of[k]];
        const int32_t row = c->row;
        const vec3 spot = somewhere(&h, &seed);
        int32_t crowd = 0;
        for (int32_t i = 0; i < h.put; i++) {
            if (h.w.ball[i].species != k)
                continue;
            mill_grids_remove(&h.g, i, k);
            put(&h, i, spot);
            crowd++;
        }
        ck_assert(crowd < row || c->row > row);
    }
    check_rows(&h, NULL);
    check_looks(&h, "crowded");
    walk(&h, unit_draws(100), &seed);
    check_looks(&h, "crowded, after crossings");
    close_heap(&h);
}

/* ---- classes ---- */

struct sorted {
    struct mixture mixture;
    double volume; /* [mm^3] */
    int classes;
    int8_t class_of[SIZES];
};

static const struct sorted sorted[] = {
    {{{30, 30, 30}, {3}, {10}}, 27000, 1, {0}},
    {{{30, 30, 30}, {3, 3}, {10, 10}}, 27000, 1, {0, 0}},
    {{{30, 30, 30}, {3, 4.49}, {9000, 10}}, 27000, 1, {0, 0}},
    {{{30, 30, 30}, {4.51, 3}, {10, 9000}}, 27000, 2, {1, 0}},
    {{{30, 30, 30}, {3, 4.2, 5.6}, {9000, 9000, 10}}, 27000, 2, {0, 0, 1}},
    {{{30, 30, 30}, {9, 3, 4, 27}, {10, 9000, 9000, 2}}, 27000, 3, {1, 0, 0, 2}},
    /* four balls in a volume of the next diameter, or fewer: 27000 = 2700 * 10 */
    {{{30, 30, 30}, {3, 10}, {108, 1}}, 27000, 2, {0, 1}},
    {{{30, 30, 30}, {3, 10}, {107, 1}}, 27000, 1, {0, 0}},
    /* the medium ones join the large ones, or both of the smaller do */
    {{{30, 30, 30}, {1, 3, 10}, {4000, 100, 1}}, 27000, 2, {0, 1, 1}},
    {{{30, 30, 30}, {1, 3, 10}, {100, 100, 1}}, 27000, 2, {0, 0, 1}},
    {{{30, 30, 30}, {1, 3, 10}, {50, 50, 1}}, 27000, 1, {0, 0, 0}},
    /* a kind without a ball */
    {{{30, 30, 30}, {1, 3, 10}, {0, 200, 1}}, 27000, 2, {0, 0, 1}},
    /* no more than six */
    {{{30, 30, 30}, {1, 2, 4, 8, 16, 32, 64}, {1, 1, 1, 1, 1, 1, 1}},
     1e-3,
     6,
     {0, 1, 2, 3, 4, 5, 5}},
};
enum { SORTED = sizeof sorted / sizeof *sorted };

LOOP_TEST(sizes_share_a_grid_if_they_are_alike_or_if_the_smaller_are_few, SORTED)
{
    struct heap h;
    open_heap(&h, &sorted[_i].mixture, 1e-9 * sorted[_i].volume, false);
    ck_assert_int_eq(h.g.classes, sorted[_i].classes);
    for (int k = 0; k < h.w.species_count; k++)
        ck_assert_int_eq(h.g.class_of[k], sorted[_i].class_of[k]);
    for (int k = 0; k < h.w.species_count; k++) {
        bool equal = true;
        for (int m = 0; m < h.w.species_count; m++)
            equal &=
                h.g.class_of[m] != h.g.class_of[k] || h.species[m].radius == h.species[k].radius;
        const int class = h.g.class_of[k];
        ck_assert_double_eq(h.g.view[class][class].sum, equal ? 2.0 * h.species[k].radius : 0.0);
    }
    close_heap(&h);
}

LOOP_TEST(a_grid_has_cells_as_wide_as_its_largest_ball_and_made_of_whole_finer_cells, MIXTURES)
{
    struct heap h;
    open_heap(&h, &mixtures[_i], 1e-12, false);
    for (int a = 0; a < h.g.classes; a++) {
        const struct mill_cells *c = &h.g.own[a], *finer = &h.g.own[a > 0 ? a - 1 : 0];
        for (int axis = 0; axis < 3; axis++) {
            const double times = c->side[axis] / finer->side[axis];
            ck_assert_double_eq_tol(times, round(times), 1e-9);
            ck_assert(c->side[axis] > 2.0 * largest_in_class(&h, a) ||
                      h.g.own[0].n[axis] - 2 * h.g.own[0].margin == 1);
        }
    }
    close_heap(&h);
}

int main(void)
{
    return unit_run("grids");
}
