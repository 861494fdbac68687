/* First positions: random, without overlap. Dilute charges are dropped in one by one, each at a
 * random place that is free (random sequential addition). That jams near a solid fraction of 0.38,
 * so denser ones are dropped in as smaller balls and then grown to full size while overlapping
 * neighbours push each other apart, in small alternating steps, until nothing touches (as in
 * position-based relaxation of hard-sphere packings). Everything follows from the seed. */
#include "fill.h"

#include "cells.h"
#include "shape.h"

#include <gsl/gsl_randist.h>
#include <gsl/gsl_rng.h>
#include <stdlib.h>
#include <string.h>

#define DROP_FRACTION 0.18 /* of the free volume that single drops fill quickly */
#define DENSEST 0.60       /* of the free volume: beyond it no random packing is tried */
#define DROPS 4000         /* tries for one ball */
#define SPACING 2e-3       /* relative: the gap that pushing apart aims at */
#define PUSHES 1500        /* rounds of pushing before it is called too many */
#define VOLUME_POINTS 200000

struct fill {
    struct mill_world *world;
    struct mill_cells cells;
    gsl_rng *rng;
    int32_t *near;
    int32_t balls;  /* how many of the world's, in the order `order` */
    int32_t *order; /* large balls first: they find no room later */
    double *radius; /* [m] of each ball, at full size */
    bool *moved;    /* in the last round of pushing: only these and what they hit are looked at */
};

/* qsort has no context, so the keys travel with the items */
struct keyed {
    double key;
    int32_t ball;
    vec3 r;
};

static int by_key(const void *a, const void *b)
{
    const struct keyed *x = a, *y = b;
    if (x->key != y->key)
        return x->key < y->key ? -1 : 1;
    return (x->ball > y->ball) - (x->ball < y->ball);
}

/* Volume that balls may fill [m^3], by a lattice of points; the drum's box is sampled. */
static double free_volume(const struct mill_world *w)
{
    const double r = w->drum_radius, l = w->drum_length;
    const double cell = cbrt(4.0 * r * r * l / VOLUME_POINTS);
    const int nx = (int)fmax(ceil(l / cell), 8.0), ny = (int)fmax(ceil(2.0 * r / cell), 8.0);
    long inside = 0;
    for (int i = 0; i < nx; i++) {
        for (int j = 0; j < ny; j++) {
            for (int k = 0; k < ny; k++) {
                const vec3 p = {l * ((i + 0.5) / nx - 0.5), 2.0 * r * ((j + 0.5) / ny - 0.5),
                                2.0 * r * ((k + 0.5) / ny - 0.5)};
                inside += mill_world_gap(w, p, 0.0, w->turn) > 0.0;
            }
        }
    }
    return 4.0 * r * r * l * (double)inside / ((double)nx * ny * ny);
}

static bool shapes_clear(const struct mill_world *w, vec3 r, double radius)
{
    return mill_world_gap(w, r, radius, w->turn) > 0.0;
}

static bool balls_clear(struct fill *f, vec3 r, double radius, double scale)
{
    const struct mill_ball *ball = f->world->ball;
    const int32_t n =
        mill_cells_gather(&f->cells, mill_cells_at(&f->cells, r), f->cells.around, 27, f->near);
    for (int32_t k = 0; k < n; k++) {
        const vec3 d = vec3_sub(ball[f->near[k]].r, r);
        const double s = scale * (radius + f->radius[f->near[k]]);
        if (vec3_dot(d, d) <= s * s)
            return false;
    }
    return true;
}

/* Drops every ball, shrunk by `scale` against other balls only. False: one found no room. */
static bool drop_all(struct fill *f, double scale)
{
    const double r = f->world->drum_radius, l = f->world->drum_length;
    for (int32_t m = 0; m < f->balls; m++) {
        const int32_t i = f->order[m];
        const double a = f->radius[i];
        int tries = 0;
        for (;; tries++) {
            if (tries == DROPS)
                return false;
            vec3 p;
            p.x = (gsl_rng_uniform(f->rng) - 0.5) * (l - 2.0 * a);
            p.y = (2.0 * gsl_rng_uniform(f->rng) - 1.0) * (r - a);
            p.z = (2.0 * gsl_rng_uniform(f->rng) - 1.0) * (r - a);
            if (p.y * p.y + p.z * p.z >= (r - a) * (r - a))
                continue;
            if (!balls_clear(f, p, a, scale) || !shapes_clear(f->world, p, a))
                continue;
            f->world->ball[i].r = p;
            if (!mill_cells_insert(&f->cells, i, mill_cells_at(&f->cells, p)))
                return false;
            break;
        }
    }
    return true;
}

/* Moves ball i away from surfaces that are nearer than the spacing. */
static void push_from_shapes(struct fill *f, int32_t i)
{
    const struct mill_world *w = f->world;
    const double margin = SPACING * f->radius[i];
    for (int k = 0; k < w->shapes; k++) {
        const struct mill_shape *s = w->shape[k];
        const struct mill_contact c = s->ops->contact(s, w->ball[i].r, f->radius[i], w->turn);
        if (c.gap < margin) {
            w->ball[i].r = vec3_axpy(w->ball[i].r, margin - c.gap, c.normal);
            f->moved[i] = true;
        }
    }
}

/* Moves ball i and its neighbours apart where they are nearer than the spacing. */
static void push_from_balls(struct fill *f, int32_t i)
{
    struct mill_ball *ball = f->world->ball;
    const int32_t n = mill_cells_gather(&f->cells, f->cells.cell[i], f->cells.around, 27, f->near);
    for (int32_t k = 0; k < n; k++) {
        const int32_t j = f->near[k];
        const double s = (1.0 + SPACING) * (f->radius[i] + f->radius[j]);
        const vec3 d = vec3_sub(ball[j].r, ball[i].r);
        const double square = vec3_dot(d, d);
        if (j == i || square >= s * s)
            continue;
        const double distance = sqrt(square);
        /* two centres at one place part along any fixed direction */
        const vec3 n_ij = distance > 0.0 ? vec3_scale(d, 1.0 / distance) : vec3_make(1.0, 0.0, 0.0);
        ball[i].r = vec3_axpy(ball[i].r, -0.5 * (s - distance), n_ij);
        ball[j].r = vec3_axpy(ball[j].r, 0.5 * (s - distance), n_ij);
        f->moved[i] = f->moved[j] = true;
    }
}

/* Is every ball clear of all others and of all surfaces at full size? */
static bool all_clear(struct fill *f)
{
    const struct mill_ball *ball = f->world->ball;
    for (int32_t m = 0; m < f->balls; m++) {
        const int32_t i = f->order[m];
        if (!shapes_clear(f->world, ball[i].r, f->radius[i]))
            return false;
        const int32_t n =
            mill_cells_gather(&f->cells, f->cells.cell[i], f->cells.around, 27, f->near);
        for (int32_t k = 0; k < n; k++) {
            const vec3 d = vec3_sub(ball[f->near[k]].r, ball[i].r);
            const double s = f->radius[i] + f->radius[f->near[k]];
            if (f->near[k] != i && vec3_dot(d, d) <= s * s)
                return false;
        }
    }
    return true;
}

/* Puts the moved balls into the cells they are in now; how many they are, -1: out of memory. */
static int32_t rehouse(struct fill *f)
{
    int32_t count = 0;
    for (int32_t i = 0; i < f->world->balls; i++) {
        if (!f->moved[i])
            continue;
        count++;
        const int32_t cell = mill_cells_at(&f->cells, f->world->ball[i].r);
        if (cell == f->cells.cell[i])
            continue;
        mill_cells_remove(&f->cells, i);
        if (!mill_cells_insert(&f->cells, i, cell))
            return -1;
    }
    return count;
}

static bool push_apart(struct fill *f)
{
    for (int32_t m = 0; m < f->balls; m++)
        f->moved[f->order[m]] = true;
    for (int round = 0; round < PUSHES; round++) {
        for (int32_t i = 0; i < f->world->balls; i++) {
            if (!f->moved[i])
                continue;
            f->moved[i] = false;
            push_from_balls(f, i);
            push_from_shapes(f, i);
        }
        const int32_t moved = rehouse(f);
        if (moved < 0)
            return false;
        if (moved == 0 || (round % 16 == 15 && all_clear(f)))
            return true;
    }
    return false;
}

static void empty(struct fill *f)
{
    memset(f->cells.bucket, 0,
           sizeof *f->cells.bucket * (size_t)f->cells.row * (size_t)mill_cells_count(&f->cells));
}

/* Numbers equal balls by place: neighbours in space become neighbours in memory. */
static bool sort_by_place(struct fill *f)
{
    struct mill_ball *ball = f->world->ball;
    struct keyed *item = malloc(sizeof *item * (size_t)f->balls);
    if (!item)
        return false;
    int32_t n = 0;
    for (int32_t i = 0; i < f->balls; i++) {
        item[n].key = (double)f->cells.cell[i];
        item[n].ball = i;
        item[n++].r = ball[i].r;
        if (i + 1 < f->balls && ball[i + 1].species == ball[i].species)
            continue;
        qsort(item, (size_t)n, sizeof *item, by_key);
        for (int32_t k = 0; k < n; k++)
            ball[i + 1 - n + k].r = item[k].r;
        n = 0;
    }
    free(item);
    empty(f);
    for (int32_t i = 0; i < f->balls; i++) {
        if (!mill_cells_insert(&f->cells, i, mill_cells_at(&f->cells, ball[i].r)))
            return false;
    }
    return true;
}

/* Tries to place the first f->balls of the order, whose solid fraction is `fraction`. */
static bool place(struct fill *f, double fraction)
{
    if (fraction > DENSEST)
        return false;
    double scale = fraction > DROP_FRACTION ? cbrt(DROP_FRACTION / fraction) : 1.0;
    for (; scale > 0.4; scale *= 0.93) {
        empty(f);
        if (drop_all(f, scale))
            return (f->balls < f->world->balls || sort_by_place(f)) &&
                   (scale == 1.0 || (push_apart(f) && all_clear(f)));
    }
    return false;
}

static bool prepare(struct fill *f, struct mill_world *w, unsigned long seed)
{
    const size_t n = (size_t)w->balls;
    double widest = 0.0, least = INFINITY;
    memset(f, 0, sizeof *f);
    f->world = w;
    f->balls = w->balls;
    f->rng = gsl_rng_alloc(gsl_rng_mt19937);
    f->near = malloc(sizeof *f->near * (n + MILL_CELL_ROW));
    f->order = malloc(sizeof *f->order * n);
    f->radius = malloc(sizeof *f->radius * n);
    f->moved = malloc(n);
    struct keyed *sized = calloc(n, sizeof *sized);
    if (!f->rng || !f->near || !f->order || !f->radius || !f->moved || !sized) {
        free(sized);
        return false;
    }
    gsl_rng_set(f->rng, seed);
    for (int32_t i = 0; i < w->balls; i++) {
        f->radius[i] = w->species[w->ball[i].species].radius;
        widest = fmax(widest, f->radius[i]);
        least = fmin(least, f->radius[i]);
        sized[i].key = -f->radius[i];
        sized[i].ball = i;
    }
    qsort(sized, n, sizeof *sized, by_key);
    for (size_t i = 0; i < n; i++)
        f->order[i] = sized[i].ball;
    free(sized);
    const double r = w->drum_radius, l = 0.5 * w->drum_length;
    return mill_cells_init(&f->cells, vec3_make(-l, -r, -r), vec3_make(l, r, r),
                           2.0 * widest * (1.0 + SPACING), 2.0 * least, w->balls);
}

static void release(struct fill *f)
{
    if (f->rng)
        gsl_rng_free(f->rng);
    free(f->near);
    free(f->order);
    free(f->radius);
    free(f->moved);
    mill_cells_release(&f->cells);
}

static double solid_volume(const struct fill *f)
{
    double v = 0.0;
    for (int32_t m = 0; m < f->balls; m++)
        v += (4.0 / 3.0) * 3.14159265358979323846 * pow(f->radius[f->order[m]], 3.0);
    return v;
}

/* They do not fit: finds a number that does, by trying fewer of the same mixture. */
static enum mill_status say_what_fits(struct fill *f, const struct mill_deck *deck, double room,
                                      double solid, struct mill_error *error)
{
    const int32_t asked = f->world->balls;
    const double fraction = solid / room;
    char section[MILL_NAME_LENGTH + 8] = "balls";
    if (deck->kinds > 1 || strcmp(deck->balls[0].name, "balls") != 0)
        snprintf(section, sizeof section, "balls.%s", deck->balls[0].name);
    gsl_ran_shuffle(f->rng, f->order, (size_t)asked, sizeof *f->order);
    memset(f->moved, 0, (size_t)asked);
    for (double part = fmin(0.97, 0.56 / fraction); part * asked >= 1.0; part *= 0.95) {
        f->balls = (int32_t)(part * asked);
        if (place(f, solid_volume(f) / room))
            return mill_deck_fault(deck, error, section, "count",
                                   "%ld balls do not fit (solid fraction %.3f of the free volume);"
                                   " about %ld would",
                                   (long)asked, fraction, (long)f->balls);
    }
    return mill_deck_fault(deck, error, section, "count", "not a single ball fits");
}

enum mill_status mill_fill_random(const struct mill_deck *deck, struct mill_world *world,
                                  struct mill_error *error)
{
    struct fill f;
    enum mill_status status = MILL_OK;
    if (!prepare(&f, world, deck->seed)) {
        release(&f);
        return mill_error_set(error, MILL_FAILED, "out of memory for %ld start positions",
                              (long)world->balls);
    }
    const double room = free_volume(world), solid = solid_volume(&f);
    if (!place(&f, solid / room))
        status = say_what_fits(&f, deck, room, solid, error);
    for (int32_t i = 0; i < world->balls && status == MILL_OK; i++) {
        vec3 u = {0.0, 0.0, 0.0};
        if (deck->speed > 0.0)
            gsl_ran_dir_3d(f.rng, &u.x, &u.y, &u.z);
        world->ball[i].v = vec3_scale(u, deck->speed);
    }
    release(&f);
    return status;
}
