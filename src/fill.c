/* First positions: random, without overlap. Dilute charges are dropped in one by one, each at a random
 * place that is free (random sequential addition). That jams near a solid fraction of 0.38, so denser
 * ones are dropped in as smaller balls and then grown to full size while overlapping neighbours push each
 * other apart, in small alternating steps, until nothing touches (as in position-based relaxation of
 * hard-sphere packings). Everything follows from the seed. */
#include "fill.h"

#include "cells.h"
#include "shape.h"

#include <gsl/gsl_randist.h>
#include <gsl/gsl_rng.h>
#include <stdlib.h>
#include <string.h>

#define DROP_FRACTION 0.24 /* of the free volume that single drops fill quickly */
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
    int32_t balls;     /* how many of the world's, in the order `order` */
    int32_t *order;    /* large balls first: they find no room later */
    double *radius;    /* [m] of each ball, at full size */
};

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

/* Moves ball i away from surfaces that are nearer than `margin`; true if it had to. */
static bool push_from_shapes(struct fill *f, int32_t i, double margin)
{
    const struct mill_world *w = f->world;
    bool moved = false;
    for (int k = 0; k < w->shapes; k++) {
        const struct mill_shape *s = w->shape[k];
        const struct mill_contact c =
            s->ops->contact(s, w->ball[i].r, f->radius[i], w->turn);
        if (c.gap < margin) {
            w->ball[i].r = vec3_axpy(w->ball[i].r, margin - c.gap, c.normal);
            moved = true;
        }
    }
    return moved;
}

/* Moves ball i and its neighbours apart where they are nearer than the spacing; true if they were. */
static bool push_from_balls(struct fill *f, int32_t i)
{
    struct mill_ball *ball = f->world->ball;
    bool moved = false;
    const int32_t n =
        mill_cells_gather(&f->cells, f->cells.cell[i], f->cells.around, 27, f->near);
    for (int32_t k = 0; k < n; k++) {
        const int32_t j = f->near[k];
        const double s = (1.0 + SPACING) * (f->radius[i] + f->radius[j]);
        const vec3 d = vec3_sub(ball[j].r, ball[i].r);
        const double square = vec3_dot(d, d);
        if (j == i || square >= s * s)
            continue;
        const double distance = sqrt(square);
        /* two centres at one place part along any fixed direction */
        const vec3 n_ij =
            distance > 0.0 ? vec3_scale(d, 1.0 / distance) : vec3_make(1.0, 0.0, 0.0);
        ball[i].r = vec3_axpy(ball[i].r, -0.5 * (s - distance), n_ij);
        ball[j].r = vec3_axpy(ball[j].r, 0.5 * (s - distance), n_ij);
        moved = true;
    }
    return moved;
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

static bool push_apart(struct fill *f)
{
    struct mill_ball *ball = f->world->ball;
    for (int round = 0; round < PUSHES; round++) {
        bool moved = false;
        for (int32_t m = 0; m < f->balls; m++) {
            const int32_t i = f->order[m];
            moved |= push_from_balls(f, i);
            moved |= push_from_shapes(f, i, SPACING * f->radius[i]);
        }
        for (int32_t m = 0; m < f->balls; m++) {
            const int32_t i = f->order[m];
            const int32_t cell = mill_cells_at(&f->cells, ball[i].r);
            if (cell == f->cells.cell[i])
                continue;
            mill_cells_remove(&f->cells, i);
            if (!mill_cells_insert(&f->cells, i, cell))
                return false;
        }
        if (!moved || (round % 8 == 7 && all_clear(f)))
            return true;
    }
    return false;
}

static void empty(struct fill *f)
{
    memset(f->cells.bucket, 0,
           sizeof *f->cells.bucket * (size_t)f->cells.row *
               (size_t)mill_cells_count(&f->cells));
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
            return scale == 1.0 || (push_apart(f) && all_clear(f));
    }
    return false;
}

/* qsort has no context, so the keys travel with the items */
struct sized {
    double radius;
    int32_t ball;
};

static int by_size(const void *a, const void *b)
{
    const struct sized *x = a, *y = b;
    if (x->radius != y->radius)
        return x->radius > y->radius ? -1 : 1;
    return (x->ball > y->ball) - (x->ball < y->ball);
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
    struct sized *sized = malloc(sizeof *sized * n);
    if (!f->rng || !f->near || !f->order || !f->radius || !sized) {
        free(sized);
        return false;
    }
    gsl_rng_set(f->rng, seed);
    for (int32_t i = 0; i < w->balls; i++) {
        f->radius[i] = w->species[w->ball[i].species].radius;
        widest = fmax(widest, f->radius[i]);
        least = fmin(least, f->radius[i]);
        sized[i].radius = f->radius[i];
        sized[i].ball = i;
    }
    qsort(sized, n, sizeof *sized, by_size);
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
