/* Plans the next event of each ball. First the earliest pair contact (pairs.c), then surfaces
 * within the interval that this and the exit from the cell leave. The earliest event goes into the
 * calendar. The partner's plan stays: its count of contacts shows later whether it is stale. */
#include "engine/schedule.h"

#include "base/elementary.h"
#include "engine/slabs.h"
#include "geometry/solid.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

/* [radii] A ball that was let go is clear at this gap; at zero it would be pinched again. */
#define CLEAR 0.01
/* A dilute gas, of which the smallest cells hold on average fewer than DILUTE balls, gets cells
 * that hold HELD balls. They are at most WIDEST diameters wide. */
#define DILUTE 0.2
#define HELD 0.35
#define WIDEST 1.7
#define LATELY 0.01 /* [radii] how far a moving body may move before its pose is computed again */

/* Lists for each cell the shapes that a ball in it can meet. */
static bool list_surfaces(struct mill_schedule *p)
{
    const struct mill_world *w = p->world;
    const double widest = p->widest;
    const int32_t cells = mill_cells_count(p->cells);
    p->surface_start = mill_memory_take(&p->memory, (size_t)cells + 1, sizeof *p->surface_start);
    if (!p->surface_start)
        return false;
    struct mill_memory_list list = {.size = sizeof *p->surface};
    for (int32_t cell = 0; cell < cells; cell++) {
        vec3 lo, hi;
        p->surface_start[cell] = (int32_t)list.count;
        if (!mill_cells_is_inner(p->cells, cell))
            continue;
        mill_cells_box(p->cells, cell, &lo, &hi);
        for (int32_t k = 0; k < w->shapes; k++) {
            const struct mill_shape *shape = w->shape[k];
            if (!shape->type->reachable(shape, lo, hi, widest))
                continue;
            struct mill_surface *next = mill_memory_add(&list);
            p->surface = list.item;
            if (!next || list.count > INT32_MAX) /* the indices of the list have 32 bits */
                return false;
            *next = (struct mill_surface){.shape = (int16_t)k, .motion = MILL_NOBODY, .cos = -2.0f};
            if (shape->type->parts)
                next->parts = shape->type->parts(shape, lo, hi, widest);
            /* a flat wall has no use for the ball's place in its frame */
            if (shape->motion && !shape->fixed && (shape->wall < 0 || shape->type->parts))
                next->motion = (int16_t)shape->motion->number;
            if (next->motion != MILL_NOBODY && shape->type->sector) {
                const struct mill_sector s = shape->type->sector(shape, lo, hi, widest);
                next->y = (float)s.y;
                next->z = (float)s.z;
                next->cos = (float)(s.cos - 1e-6);
            }
        }
    }
    p->surface_start[cells] = (int32_t)list.count;
    return true;
}

/* How much wider than necessary the cells are. The smallest are fastest if balls are close, as in
 * every mill, where gravity or a rotor gathers them. In a dilute gas, larger ones are left less. */
static double widening_of(const struct mill_schedule *p)
{
    const struct mill_world *w = p->world;
    const double diameter = 2.0 * p->widest;
    const double room = MILL_PI * w->drum_radius * w->drum_radius * w->drum_length;
    /* balls per cell */
    const double held = (double)w->balls * diameter * diameter * diameter / room;
    bool gas = p->pull == 0.0;
    for (int k = 0; k < w->motions; k++)
        gas = gas && p->lately[k].drift <= 0.0;
    return gas && held < DILUTE ? fmin(mill_elementary_cbrt(HELD / held), WIDEST) : 1.0;
}

/* Bounds of the movement of balls relative to bodies on a motion; for how long a pose is used */
static struct mill_lately bounds_of(const struct mill_world *w, int motion, double thinnest)
{
    const struct mill_motion *m = w->motion[motion];
    const struct mill_motion_bounds b = mill_motion_bounds(m, vec3_make(0.0, 0.0, 0.0));
    const double reach = mill_motion_reach(m, &w->container.places);
    const double coriolis = 2.0 * b.turning, drift = b.speed + b.turning * reach;
    struct mill_lately l = {
        .most = fmin(LATELY * thinnest / drift, 1.0), /* long, if it does not move */
        .drift = drift,
        .acceleration = vec3_norm(w->g) + b.acceleration + coriolis * b.speed +
                        (b.turning * b.turning + b.spin_up) * reach,
        .coriolis = coriolis * (1.0 + 1e-9),
        .margin = 1e-9 * reach,
        .turns = !m->on && m->axial};
    if (l.turns) { /* for a rotor: y and z */
        const struct mill_pose frame = mill_part_frame(m->through, m->axis);
        l.p = frame.x;
        l.q = frame.y;
    }
    return l;
}

/* Room of the buffers [balls]: a multiple of a cache line, so that no vector crosses two lines */
static size_t room_of(const struct mill_world *w)
{
    return ((size_t)w->balls + MILL_PAIRS_ROOM + 7) / 8 * 8;
}

/* The buffers of the search; only a few pages of them are ever used. False when out of memory */
static bool make_buffers(struct mill_schedule *p)
{
    const size_t n = room_of(p->world);
    p->scratch = NULL;
    if (posix_memalign(&p->scratch, 64,
                       MILL_PAIRS_TOGETHER * n * (3 * sizeof(double) + 2 * sizeof(int32_t))) != 0)
        return false;
    double *terms = p->scratch;
    void *numbers = terms + MILL_PAIRS_TOGETHER * 3 * n;
    for (int s = 0; s < MILL_PAIRS_TOGETHER; s++, terms += 3 * n) {
        int32_t *near = (int32_t *)numbers + 2 * s * n;
        p->pairs[s] =
            (struct mill_pairs){p->world->ball, p->radius, p->world->g, near, near + n, terms};
    }
    return true;
}

/* False when out of memory */
static bool build(struct mill_schedule *p, struct mill_world *w)
{
    const size_t n = room_of(w);
    mill_schedule_ahead_again(p);
    p->world = w;
    p->search = mill_pairs_choose();
    p->pull = vec3_norm(w->g);
    p->thinnest = INFINITY;
    p->lately = mill_memory_take(&p->memory, (size_t)w->motions + 1, sizeof *p->lately);
    p->radius = mill_memory_take(&p->memory, (size_t)w->species_count, sizeof *p->radius);
    p->plan = mill_memory_take(&p->memory, n, sizeof *p->plan);
    p->calendar = p->plan ? mill_calendar_create(w->balls, &p->plan->event, sizeof *p->plan) : NULL;
    if (p->memory.failed || !p->calendar || !make_buffers(p))
        return false;
    for (int k = 0; k < w->species_count; k++) {
        p->radius[k] = w->species[k].radius;
        p->widest = fmax(p->widest, p->radius[k]);
        p->thinnest = fmin(p->thinnest, p->radius[k]);
    }
    for (int k = 0; k < w->motions; k++)
        p->lately[k] = bounds_of(w, k, p->thinnest);
    const double widening = widening_of(p);
    bool made = mill_grids_init(&p->grids, w, widening) && mill_rest_create(p, widening);
    p->cells = p->grids.own;
    made = made && list_surfaces(p);
    for (int32_t i = 0; i < w->balls && made; i++)
        made = mill_grids_insert(&p->grids, i, w->ball[i].species,
                                 mill_cells_at(p->cells, w->ball[i].r));
    return made;
}

enum mill_status mill_schedule_create(struct mill_world *world, struct mill_schedule **schedule,
                                      struct mill_error *error)
{
    struct mill_schedule *p = *schedule = calloc(1, sizeof *p);
    if (p && build(p, world))
        return MILL_OK;
    mill_schedule_free(p);
    *schedule = NULL;
    return mill_error_set(error, MILL_FAILED, "out of memory for the event list");
}

static void clear(struct mill_schedule *p)
{
    if (p->slabs)
        mill_slabs_begin(p->slabs);
    else
        mill_calendar_clear(p->calendar, 0.0);
}

bool mill_schedule_restore(struct mill_schedule *p, const int32_t *cell)
{
    for (int k = 0; k < p->grids.classes; k++)
        mill_cells_clear(&p->grids.own[k]);
    clear(p);
    bool made = true;
    for (int32_t i = 0; i < p->world->balls && made; i++) {
        made = mill_grids_insert(&p->grids, i, p->world->ball[i].species, cell[i]);
        mill_schedule_enter(p, i, mill_plan_time(&p->plan[i]));
        if (mill_world_asleep(p->world, i))
            made = made && mill_rest_lie_down(p, i);
    }
    return made;
}

void mill_schedule_free(struct mill_schedule *p)
{
    if (!p)
        return;
    mill_calendar_free(p->calendar);
    mill_grids_release(&p->grids);
    mill_grids_release(&p->rest.grids);
    mill_memory_drop(&p->memory);
    free(p->scratch);
    free(p->surface);
    free(p);
}

bool mill_schedule_share(const struct mill_schedule *p, struct mill_world *world,
                         struct mill_schedule *copy)
{
    const size_t motions = (size_t)world->motions + 1;
    *copy = *p;
    copy->world = world;
    copy->scratch = NULL;
    copy->lately = malloc(motions * sizeof *copy->lately);
    if (!copy->lately || !make_buffers(copy))
        return false;
    memcpy(copy->lately, p->lately, motions * sizeof *copy->lately);
    mill_schedule_forget(copy);
    return true;
}

void mill_schedule_unshare(struct mill_schedule *copy)
{
    free(copy->lately);
    free(copy->scratch);
}

/* Is a ball that was let go clear again of all bodies that can pinch? */
static bool is_clear(const struct mill_schedule *p, int32_t i, double now)
{
    const struct mill_world *w = p->world;
    const double radius = p->radius[w->ball[i].species];
    bool clear = true;
    for (int k = 0; k < w->shapes && clear; k++) {
        const struct mill_shape *s = w->shape[k];
        const struct mill_pose pose = mill_shape_pose(s, now);
        clear = !s->pinches || mill_shape_gap(s, w->ball[i].r, radius, &pose) > CLEAR * radius;
    }
    return clear;
}

/* A recent pose of the motion. Poses are of fixed times, so that a resumed run uses the same. */
static const struct mill_lately *look_lately(struct mill_schedule *p, int32_t motion, double now)
{
    struct mill_lately *l = &p->lately[motion];
    if (now >= l->t && now < l->until)
        return l;
    double k = floor(now / l->most);
    k -= now < k * l->most;
    k += now >= (k + 1.0) * l->most;
    l->t = k * l->most;
    l->until = (k + 1.0) * l->most;
    if (!(now >= l->t && now < l->until))
        l->t = l->until = now; /* the motion is too fast for the resolution of time */
    l->pose = mill_motion_pose(p->world->motion[motion], l->t);
    if (l->turns) {
        const vec3 turned = mill_pose_turn_out(&l->pose, l->p);
        l->cos = vec3_dot(turned, l->p);
        l->sin = vec3_dot(turned, l->q);
    }
    return l;
}

/* The flight of a ball within `window` [s] relative to bodies on a motion. In their frame its speed
 * changes by gravity, Coriolis, centrifugal, Euler parts; the frame has moved since its pose. */
static void place_in(const struct mill_lately *l, double now, double window, struct mill_flight *f)
{
    const double age = now - l->t;
    const vec3 frame = mill_pose_velocity(&l->pose, f->r);
    const double v = fabs(f->v.x) + fabs(f->v.y) + fabs(f->v.z) + f->pull * window;
    const double a = l->acceleration + l->coriolis * v;
    f->place = mill_pose_in(&l->pose, vec3_axpy(f->r, -age, frame));
    f->course = vec3_sub(f->v, frame);
    f->pose = &l->pose;
    f->window = window;
    f->slack = window * a * (age + 0.5 * window) + 0.5 * age * age * l->acceleration + l->margin;
    f->travel = window * vec3_norm(f->course) + f->slack;
}

/* The first contact with a surface that balls in the cell can touch, within the search interval
 * `window` [s] that the pair contact and the exit leave */
static void search_surfaces(struct mill_schedule *p, int32_t i, double now, double window,
                            int32_t touched)
{
    const struct mill_world *w = p->world;
    struct mill_plan *plan = &p->plan[i];
    const struct mill_ball *ball = &w->ball[i];
    const int32_t cell = p->cells->cell[i];
    const double radius = p->radius[ball->species];
    struct mill_flight flight;
    const struct mill_lately *l = NULL; /* of the motion `seen` */
    int32_t seen = MILL_NOBODY;
    double turn = 0.0; /* [rad] maximum turn of the motion from its pose to the interval's end */
    bool placed = false;
    mill_flight_set(&flight, ball->r, ball->v, w->g, p->pull, &p->world->counts.quartics);
    const struct mill_surface *end = p->surface + p->surface_start[cell + 1];
    for (const struct mill_surface *near = p->surface + p->surface_start[cell]; near < end;
         near++) {
        if (near->motion == MILL_NOBODY) {
            flight.slack = flight.travel = INFINITY; /* those are of a previous body */
            placed = false;
        } else {
            if (near->motion != seen) {
                l = look_lately(p, near->motion, now);
                turn = 0.5 * l->coriolis * (window + (now - l->t));
                seen = near->motion;
                placed = false;
            }
            /* most bodies are out of reach by their angle, for any path of the ball in its cell */
            if (l->cos * (double)near->y + l->sin * (double)near->z < (double)near->cos - turn)
                continue;
            if (!placed)
                place_in(l, now, window, &flight);
            placed = true;
        }
        const struct mill_shape *shape = w->shape[near->shape];
        if (ball->relief == MILL_RELIEF_LASTS && shape->pinches)
            continue;
        flight.parts = near->parts;
        const struct mill_hit hit =
            shape->type->next_contact(shape, &flight, radius, now, window, near->shape == touched);
        if (hit.t <= window) {
            window = hit.t;
            plan->shape_t = now + hit.t;
            plan->shape = (int16_t)near->shape;
            plan->next = hit.state == MILL_HIT_ASK_AGAIN ? MILL_NEXT_SEARCH : MILL_NEXT_SURFACE;
        }
    }
}

/* Plans what the search found and an earlier exit from the cell, then surfaces within the remaining
 * interval, then enters the earliest event into the calendar. */
static inline void finish(struct mill_schedule *p, int32_t i, double now, int32_t touched,
                          const struct mill_cell_exit *out, const struct mill_pair *found)
{
    struct mill_plan *plan = &p->plan[i];
    const int32_t cell = p->cells->cell[i];
    if (found->partner != MILL_NOBODY) {
        plan->pair_t = now + found->dt;
        plan->partner = found->partner;
        plan->partner_contacts = p->world->ball[found->partner].contacts;
    }
    plan->exit_t = now + out->dt;
    plan->face = (int16_t)out->face;
    plan->shape_t = INFINITY;
    plan->shape = MILL_NOBODY;
    plan->next = MILL_NEXT_SURFACE;
    if (p->world->counts.asleep > 0)
        mill_rest_plan(p, i, now);
    struct mill_ball *ball = &p->world->ball[i];
    if (ball->relief)
        ball->relief = is_clear(p, i, now) ? MILL_RELIEF_ENDS : MILL_RELIEF_LASTS;
    if (p->surface_start[cell] < p->surface_start[cell + 1]) {
        const double until = mill_least(mill_least(plan->pair_t, plan->shape_t), p->horizon);
        search_surfaces(p, i, now, mill_least(until, plan->exit_t) - now, touched);
    }
    /* arithmetic instead of branches, half of which would be mispredicted */
    const int pair = (plan->pair_t <= plan->shape_t) & (plan->pair_t <= plan->exit_t);
    const int surface = plan->shape_t <= plan->exit_t;
    const int other = surface * plan->next + (1 - surface) * MILL_NEXT_EXIT;
    plan->next = (1 - pair) * other + pair * MILL_NEXT_PAIR;
    mill_schedule_enter(p, i, mill_plan_time(plan));
}

/* Plans balls at the same time. face: which the ball has crossed, or -1: all cells around are
 * searched. The exit from the cell comes first: it is computed while that waits for memory. */
static inline __attribute__((always_inline)) void plan_balls(struct mill_schedule *p,
                                                             const int32_t *ball,
                                                             const int together, double now,
                                                             int32_t face, int32_t touched)
{
    struct mill_cell_exit out[MILL_PAIRS_TOGETHER];
    struct mill_pairs_search search[MILL_PAIRS_TOGETHER];
    for (int s = 0; s < together; s++) {
        const int32_t i = ball[s], cell = p->cells->cell[i];
        const struct mill_ball *b = &p->world->ball[i];
        assert(b->t == now);
        if (face < 0) {
            p->world->counts.predictions++;
            p->plan[i].pair_t = INFINITY;
            p->plan[i].partner = MILL_NOBODY;
        }
        out[s] = mill_cells_exit(p->cells, cell, b->r, b->v, p->world->g);
        search[s].ball = i;
        search[s].looks = mill_grids_look(&p->grids, b->species, cell, face, search[s].look);
        search[s].best = (struct mill_pair){p->plan[i].pair_t - now, MILL_NOBODY};
        __builtin_prefetch(&p->surface[p->surface_start[cell]]); /* they are searched next */
    }
    p->world->counts.pair_tests += (uint64_t)p->search(p->pairs, search, together, now);
    for (int s = 0; s < together; s++)
        finish(p, ball[s], now, touched, &out[s], &search[s].best);
}

void mill_schedule_begin(struct mill_schedule *p, double horizon)
{
    clear(p);
    p->horizon = horizon;
    mill_schedule_forget(p);
}

void mill_schedule_forget(struct mill_schedule *p)
{
    for (int k = 0; k < p->world->motions; k++)
        p->lately[k].t = NAN;
}

void mill_schedule_ball(struct mill_schedule *p, int32_t i, double now, int32_t touched)
{
    plan_balls(p, &i, 1, now, -1, touched);
}

void mill_schedule_two(struct mill_schedule *p, int32_t i, int32_t j, double now)
{
    const int32_t ball[MILL_PAIRS_TOGETHER] = {i, j};
    plan_balls(p, ball, MILL_PAIRS_TOGETHER, now, -1, MILL_NOBODY);
}

bool mill_schedule_cross(struct mill_schedule *p, int32_t i, double now)
{
    assert(p->plan[i].next == MILL_NEXT_EXIT);
    const int32_t face = p->plan[i].face;
    double shift;
    if (!mill_grids_cross(&p->grids, i, p->world->ball[i].species, face, &shift))
        return false;
    p->world->ball[i].r.x += shift; /* plans hold: partners are found in all images */
    p->world->counts.cell_crossings++;
    plan_balls(p, &i, 1, now, face, MILL_NOBODY);
    return true;
}
