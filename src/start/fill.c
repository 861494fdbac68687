/* First positions: random and without overlap. In a dilute charge each ball is dropped at a random
 * free place, one after the other (random sequential addition). That fails near a solid fraction of
 * 0.38. So the balls of a denser charge are dropped at a smaller size. Then, at full size, they
 * push each other apart in small alternating steps until nothing touches (as in position-based
 * relaxation of hard-sphere packings). The seed alone determines the result. */
#include "start/fill.h"

#include "base/elementary.h"
#include "base/random.h"

#include <assert.h>
#include <stdlib.h>

#define DROP_FRACTION 0.20 /* of the room: single drops fill this much quickly */
#define DENSEST 0.59       /* of the room: no random packing is tried above this */
#define LIKELY 0.55        /* of the room: first try for a number that fits; packs in seconds */
#define DROPS 4000         /* tries for one ball */
#define TOLD 4096          /* drops between two reports */
/* checks of each ball; the pushing must decrease by a tenth within this many */
#define PATIENCE 40

struct pack {
    const struct mill_setup *setup;
    const struct mill_start_watch *watch;
    struct mill_world *world;
    struct mill_pose frame; /* the container's, at the start */
    double widest;          /* [m] largest radius of a ball */
    struct mill_fill_room room;
    struct mill_random random;
    struct mill_fill_grids grids;
    int32_t *near;
};

/* qsort has no context, so the items contain the keys */
struct keyed {
    int32_t species, cell, ball;
    vec3 r;
};

static int by_place(const void *a, const void *b)
{
    const struct keyed *x = a, *y = b;
    if (x->species != y->species)
        return x->species < y->species ? -1 : 1;
    if (x->cell != y->cell)
        return x->cell < y->cell ? -1 : 1;
    return (x->ball > y->ball) - (x->ball < y->ball);
}

static void tell(const struct pack *p, const char *what, int32_t done)
{
    if (p->watch)
        p->watch->tell(p->watch->self, what, done, p->world->balls);
}

/* Is ball i, shrunk like all others by `scale`, clear of those placed so far? */
static bool balls_clear(const struct pack *p, int32_t i, double scale)
{
    const struct mill_fill_place *place = p->grids.place, *me = &place[i];
    const int32_t n = mill_fill_grids_near(&p->grids, me->r, me->radius, p->near);
    for (int32_t k = n - 1; k >= 0; k--) {
        const struct mill_fill_place *o = &place[p->near[k]];
        const vec3 d = vec3_sub(o->r, me->r);
        const double s = scale * (me->radius + o->radius);
        if (o != me && vec3_dot(d, d) <= s * s)
            return false;
    }
    return true;
}

/* Drops ball i, shrunk by `scale` in the check against others. false: it found no free place. */
static bool drop(struct pack *p, int32_t i, double scale)
{
    struct mill_fill_place *place = &p->grids.place[i];
    const double a = place->radius, r = p->world->drum_radius - a;
    for (int tries = 0; tries < DROPS; tries++) {
        double y, z;
        do {
            y = (2.0 * mill_random_uniform(&p->random) - 1.0) * r;
            z = (2.0 * mill_random_uniform(&p->random) - 1.0) * r;
        } while (y * y + z * z > r * r);
        const double x =
            (mill_random_uniform(&p->random) - 0.5) * (p->world->drum_length - 2.0 * a);
        place->r = mill_pose_out(&p->frame, vec3_make(x, y, z));
        if (mill_fill_room_clear(&p->room, place->r, a) && balls_clear(p, i, scale)) {
            mill_fill_grids_place(&p->grids, i);
            return true;
        }
    }
    return false;
}

/* Drops all balls, the largest first, because large balls would find no free place later. */
static bool drop_all(struct pack *p, double scale)
{
    const struct mill_world *w = p->world;
    double last = (double)INFINITY;
    mill_fill_grids_clear(&p->grids);
    for (int32_t dropped = 0; dropped < w->balls;) {
        double a = 0.0; /* the next smaller radius */
        for (int k = 0; k < w->species_count; k++)
            if (w->species[k].radius < last)
                a = fmax(a, w->species[k].radius);
        for (int32_t i = 0; i < w->balls; i++) {
            if (p->grids.place[i].radius != a)
                continue;
            if (!drop(p, i, scale))
                return false;
            if (++dropped % TOLD == 0)
                tell(p, "dropping balls", dropped);
        }
        last = a;
    }
    return true;
}

/* Numbers equal balls by place, so that neighbours in space are neighbours in memory. */
static bool sort_by_place(struct pack *p)
{
    struct mill_fill_place *place = p->grids.place;
    const int32_t balls = p->world->balls;
    struct keyed *item = malloc(sizeof *item * (size_t)balls);
    if (!item)
        return false;
    for (int32_t i = 0; i < balls; i++)
        item[i] = (struct keyed){p->world->ball[i].species,
                                 p->grids.grid[place[i].class].cells.cell[i], i, place[i].r};
    qsort(item, (size_t)balls, sizeof *item, by_place);
    mill_fill_grids_clear(&p->grids);
    for (int32_t i = balls - 1; i >= 0; i--) {
        place[i].r = item[i].r;
        mill_fill_grids_place(&p->grids, i);
    }
    free(item);
    return true;
}

/* Moves ball i and its neighbours apart where they are nearer than the spacing. Returns the sum of
 * the displacements, relative to the sums of the radii. */
static double push_from_balls(struct pack *p, int32_t i)
{
    struct mill_fill_place *place = p->grids.place, *me = &place[i];
    const int32_t n = mill_fill_grids_near(&p->grids, me->r, me->radius, p->near);
    double pushed = 0.0;
    for (int32_t k = n - 1; k >= 0; k--) {
        struct mill_fill_place *o = &place[p->near[k]];
        const double sum = me->radius + o->radius;
        const double close = (1.0 + MILL_FILL_CLOSE) * sum;
        const vec3 d = vec3_sub(o->r, me->r);
        const double square = vec3_dot(d, d);
        if (o == me || square >= close * close)
            continue;
        const double distance = sqrt(square);
        /* two centres at the same place are separated in a fixed direction */
        const vec3 n_io = distance > 0.0 ? vec3_scale(d, 1.0 / distance) : vec3_make(1.0, 0.0, 0.0);
        const double push = (1.0 + MILL_FILL_SPACING) * sum - distance;
        /* the smaller ball is moved more, because it finds room sooner */
        me->r = vec3_axpy(me->r, -push * (o->radius / sum), n_io);
        o->r = vec3_axpy(o->r, push * (me->radius / sum), n_io);
        me->disturbed = o->disturbed = true;
        mill_fill_grids_replace(&p->grids, p->near[k]);
        pushed += push / sum;
    }
    return pushed;
}

/* A pass over all whose neighbourhood has changed, counted in *looks. Returns the sum of pushes. */
static double push_round(struct pack *p, uint64_t *looks)
{
    struct mill_fill_place *place = p->grids.place;
    const int32_t balls = p->world->balls;
    double pushed = 0.0;
    for (int32_t i = 0; i < balls; i++) {
        if (!place[i].disturbed)
            continue;
        ++*looks;
        place[i].disturbed = false;
        pushed += push_from_balls(p, i);
        if (mill_fill_room_push(&p->room, &place[i].r, place[i].radius))
            place[i].disturbed = true;
        mill_fill_grids_replace(&p->grids, i);
    }
    return pushed;
}

/* Is every ball clear of all others and of all surfaces at full size? */
static bool all_clear(const struct pack *p)
{
    for (int32_t i = 0; i < p->world->balls; i++) {
        const struct mill_fill_place *me = &p->grids.place[i];
        if (!mill_fill_room_clear(&p->room, me->r, me->radius) || !balls_clear(p, i, 1.0))
            return false;
    }
    return true;
}

/* false: the balls are jammed. */
static bool push_apart(struct pack *p)
{
    const uint64_t balls = (uint64_t)p->world->balls;
    double least = (double)INFINITY;
    uint64_t looks = 0; /* since the last progress */
    for (int32_t i = 0; i < p->world->balls; i++)
        p->grids.place[i].disturbed = true;
    for (int round = 1; looks < PATIENCE * balls; round++) {
        const uint64_t before = looks;
        const double pushed = push_round(p, &looks);
        tell(p, "pushing balls apart", (int32_t)(balls - (looks - before)));
        if (looks == before)
            return all_clear(p);
        if (round % 16 == 0 && all_clear(p))
            return true;
        if (pushed < 0.9 * least) {
            least = pushed;
            looks = 0;
        }
    }
    return false;
}

/* Solid fraction: the volume of the balls over that of the room */
static double solid_fraction(const struct pack *p)
{
    const struct mill_world *w = p->world;
    double v = 0.0;
    for (int32_t i = 0; i < w->balls; i++) {
        const double a = mill_world_radius(w, i);
        v += (4.0 / 3.0) * MILL_PI * a * a * a;
    }
    return v / p->room.volume;
}

static enum mill_fault_code settle(struct pack *p, double fraction)
{
    const bool packed = p->world->balls > 1 && fraction > DROP_FRACTION;
    double scale = packed ? mill_elementary_cbrt(DROP_FRACTION / fraction) : 1.0;
    while (!drop_all(p, scale)) {
        scale *= 0.93;
        if (scale < 0.4)
            return MILL_FAULT_NO_ROOM;
    }
    if (!sort_by_place(p))
        return MILL_FAULT_MEMORY;
    return scale == 1.0 || push_apart(p) ? MILL_FAULT_NONE : MILL_FAULT_NO_ROOM;
}

/* Finds a position for every ball of p->world. */
static enum mill_fault_code pack(struct pack *p)
{
    const struct mill_world *w = p->world;
    const double fraction = solid_fraction(p);
    enum mill_fault_code code = MILL_FAULT_MEMORY;
    assert(fraction > 0.0);
    if (w->balls > 1 && fraction > DENSEST) /* a single ball may fill two thirds of the drum */
        return MILL_FAULT_NO_ROOM;
    mill_random_seed(&p->random, p->setup->seed);
    p->near = malloc(sizeof *p->near * ((size_t)w->balls + MILL_CELL_ROW));
    if (p->near && mill_fill_grids_init(&p->grids, w, p->widest))
        code = settle(p, fraction);
    code = p->grids.failed ? MILL_FAULT_MEMORY : code;
    for (int32_t i = 0; code == MILL_FAULT_NONE && i < w->balls; i++)
        w->ball[i].r = p->grids.place[i].r;
    mill_fill_grids_free(&p->grids);
    free(p->near);
    return code;
}

/* Leaves this part of each kind in the world, rounded down but at least one. count: of each kind */
static void thin_out(const struct mill_setup *s, double part, struct mill_world *w, int32_t *count)
{
    w->balls = 0;
    for (int k = 0; k < s->species; k++) {
        const double left = floor(part * (double)s->balls[k].count);
        count[k] = s->balls[k].count > 0 ? (int32_t)fmax(left, 1.0) : 0;
        for (int32_t n = 0; n < count[k]; n++)
            w->ball[w->balls++].species = (int16_t)k;
    }
}

/* Finds how many fit: packs fewer balls of the same mixture, as a setup that asks for them does. */
static enum mill_fault_code find_what_fits(struct pack *p, struct mill_fault *fault)
{
    const struct mill_world *w = p->world;
    struct mill_world fewer = *w;
    fewer.ball = calloc((size_t)w->balls, sizeof *fewer.ball);
    int32_t *count = calloc((size_t)w->species_count, sizeof *count), tried = w->balls;
    enum mill_fault_code code = fewer.ball && count ? MILL_FAULT_NO_ROOM : MILL_FAULT_MEMORY;
    fault->amount = solid_fraction(p);
    p->world = &fewer;
    if (code == MILL_FAULT_NO_ROOM) /* where not even one of each kind fits, no number does */
        thin_out(p->setup, 0.0, &fewer, count);
    const bool one = code == MILL_FAULT_NO_ROOM && pack(p) == MILL_FAULT_NONE;
    for (double part = fmin(0.97, LIKELY / fault->amount);
         one && code == MILL_FAULT_NO_ROOM && tried > w->species_count; part *= 0.95) {
        thin_out(p->setup, part, &fewer, count);
        if (fewer.balls < tried) {
            tried = fewer.balls;
            code = pack(p);
        }
    }
    for (int k = 0; code == MILL_FAULT_NONE && k < w->species_count && k < MILL_FAULT_SPECIES; k++)
        fault->fits[k] = count[k];
    free(fewer.ball);
    free(count);
    return code == MILL_FAULT_MEMORY ? code : MILL_FAULT_NO_ROOM;
}

void mill_fill_random(const struct mill_setup *setup, const struct mill_start_watch *watch,
                      struct mill_world *world, struct mill_fault *fault)
{
    struct pack p = {.setup = setup, .watch = watch, .world = world};
    p.frame = mill_world_frame(world, 0.0);
    const bool moves = !world->container.still && !setup->at_rest;
    for (int k = 0; k < world->species_count; k++)
        p.widest = fmax(p.widest, world->species[k].radius);
    fault->code = MILL_FAULT_MEMORY;
    if (mill_fill_room_init(&p.room, world, p.widest)) {
        fault->code = pack(&p);
        if (fault->code == MILL_FAULT_NO_ROOM)
            fault->code = find_what_fits(&p, fault);
    }
    mill_fill_room_free(&p.room);
    for (int32_t i = 0; fault->code == MILL_FAULT_NONE && i < world->balls && setup->speed > 0.0;
         i++)
        world->ball[i].v = vec3_scale(mill_random_direction(&p.random), setup->speed);
    for (int32_t i = 0; fault->code == MILL_FAULT_NONE && i < world->balls && moves; i++) {
        const vec3 v = mill_pose_velocity(&p.frame, world->ball[i].r);
        world->ball[i].v = vec3_add(world->ball[i].v, v);
        world->spin[i] = p.frame.angular_velocity;
    }
}
