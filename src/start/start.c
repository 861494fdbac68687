/* Builds the world of a setup: motions, surfaces, species, start positions. Those that were given
 * are checked: speeds, surfaces, pairs, in this order. */
#include "millsim/start.h"

#include "base/memory.h"
#include "geometry/shapes.h"
#include "start/fill.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_BALLS = 50000000, MOST_SHAPES = INT16_MAX - 3 };
/* [m] rounding of a decimal position may make touching balls overlap by this much */
#define SLACK 1e-12
/* [m/s] a speed beyond it is a slip of units, and its square may overflow */
#define LIGHT 299792458.0

static bool positive(double x)
{
    return x > 0.0 && x < (double)INFINITY;
}

static bool is_drum_sound(const struct mill_setup_drum *d)
{
    if (!positive(d->radius) || !positive(d->length))
        return false;
    if (d->buckles == 0)
        return true;
    if (!(d->buckles > 1 && d->buckle_height >= 0.0 && d->buckle_height < d->radius) ||
        !isfinite(d->buckle_angle))
        return false;
    const struct mill_chamber chamber = mill_shapes_chamber(d);
    return mill_profile_is_sound(&chamber.drum);
}

/* Motions ride on earlier ones. */
static bool are_bodies_sound(const struct mill_setup *s)
{
    bool good = s->motions >= 0 && s->surfaces >= 0 && s->surfaces <= MOST_SHAPES;
    for (int k = 0; good && k < s->motions; k++) {
        const struct mill_setup_motion *m = &s->motion[k];
        good = m->on >= MILL_STILL && m->on < k && m->type->is_sound(m->form);
    }
    for (int k = 0; good && k < s->surfaces; k++) {
        const struct mill_setup_surface *b = &s->surface[k];
        good = b->motion >= MILL_STILL && b->motion < s->motions && b->type->is_sound(b->form);
    }
    return good;
}

/* Every number that could make the loop meaningless or endless */
static bool is_sound(const struct mill_setup *s)
{
    int64_t balls = 0;
    bool good = is_drum_sound(&s->drum) && are_bodies_sound(s) && s->speed >= 0.0 &&
                isfinite(s->speed) && isfinite(vec3_norm(s->gravity)) && s->rebound_floor >= 0.0 &&
                isfinite(s->rebound_floor) && s->species > 0;
    for (int k = 0; good && k < s->species; k++) {
        const struct mill_setup_balls *b = &s->balls[k];
        good = positive(b->diameter) && positive(b->density) && b->count >= 0;
        balls += b->count;
    }
    for (int kind = 0; kind < MILL_KINDS; kind++) {
        const struct mill_law *law = &s->law[kind];
        good = good && law->restitution >= 0.0 && law->restitution <= 1.0 && law->friction >= 0.0 &&
               fabs(law->tangential) <= 1.0;
    }
    return good && balls > 0 && balls <= MOST_BALLS;
}

static bool make_motions(const struct mill_setup *setup, struct mill_world *w)
{
    w->motion = calloc((size_t)setup->motions + 1, sizeof(struct mill_motion *));
    for (int k = 0; w->motion && k < setup->motions; k++) {
        const struct mill_setup_motion *m = &setup->motion[k];
        assert(m->on >= MILL_STILL && m->on < k);
        w->motion[k] = m->type->create(m->form);
        if (!w->motion[k])
            return false;
        w->motions++;
        w->motion[k]->number = k;
        w->motion[k]->on = m->on == MILL_STILL ? NULL : w->motion[m->on];
    }
    if (w->motions > 0)
        w->rotor_speed = mill_motion_pose(w->motion[0], 0.0).angular_velocity.x;
    return w->motion != NULL;
}

/* What stands or turns about the drum's axis lies within the drum; a shaft has no other axis. */
static bool do_surfaces_fit(const struct mill_setup *setup, const struct mill_world *w,
                            struct mill_fault *fault)
{
    const struct mill_setup_drum *drum = &setup->drum;
    const bool wavy = drum->buckles > 0;
    const struct mill_shape_fit fit = {.bore = drum->radius - (wavy ? drum->buckle_height : 0.0),
                                       .wavy = wavy,
                                       .length = drum->length};
    char text[MILL_SHAPE_FAULT];
    bool fits = true;
    for (int k = 0; fits && k < setup->surfaces; k++) {
        const struct mill_setup_surface *s = &setup->surface[k];
        const bool axial =
            s->motion == MILL_STILL || mill_motion_pose(w->motion[s->motion], 0.0).about_x;
        if (s->type == &mill_cylinder_shaft_type)
            fits = axial && ((const struct mill_shaft *)s->form)->radius < fit.bore;
        else if (axial && s->type->fault)
            fits = !s->type->fault(s->form, &fit, text);
        if (!fits)
            *fault = (struct mill_fault){.code = MILL_FAULT_SURFACE, .other = k};
    }
    return fits;
}

static bool make_balls(const struct mill_setup *setup, struct mill_world *w)
{
    for (int k = 0; k < setup->species; k++)
        w->balls += setup->balls[k].count;
    w->species_count = setup->species;
    w->species = calloc((size_t)setup->species, sizeof *w->species);
    w->spin = mill_memory_get((size_t)w->balls, sizeof *w->spin);
    w->ball = mill_memory_get((size_t)w->balls, sizeof *w->ball);
    if (!w->species || !w->spin || !w->ball)
        return false;
    int32_t i = 0;
    for (int k = 0; k < setup->species; k++) {
        const struct mill_setup_balls *of = &setup->balls[k];
        struct mill_species *s = &w->species[k];
        if (of->name)
            strncpy(s->name, of->name, sizeof s->name - 1);
        s->radius = 0.5 * of->diameter;
        s->mass = of->density * (4.0 / 3.0) * MILL_PI * s->radius * s->radius * s->radius;
        s->inertia = 0.4 * s->mass * s->radius * s->radius;
        for (int32_t n = 0; n < of->count; n++)
            w->ball[i++].species = k;
    }
    return true;
}

static double radius_of(const struct mill_world *w, int32_t i)
{
    return w->species[w->ball[i].species].radius;
}

/* Fills in the fault of the first ball that is too fast, or else of the first one in a surface. */
static void check_balls(const struct mill_world *w, struct mill_fault *fault)
{
    for (int32_t i = 0; i < w->balls; i++) {
        if (vec3_norm(w->ball[i].v) <= LIGHT && vec3_norm(w->spin[i]) * radius_of(w, i) <= LIGHT)
            continue;
        *fault = (struct mill_fault){.code = MILL_FAULT_SPEED, .ball = i};
        return;
    }
    for (int32_t i = 0; i < w->balls && fault->code == MILL_FAULT_NONE; i++) {
        for (int k = 0; k < w->shapes && fault->code == MILL_FAULT_NONE; k++) {
            const struct mill_shape *s = w->shape[k];
            const struct mill_pose pose = mill_shape_pose(s, 0.0);
            const double gap = mill_shape_gap(s, w->ball[i].r, radius_of(w, i), &pose);
            if (!(gap >= -SLACK))
                *fault = (struct mill_fault){.code = MILL_FAULT_BALL_IN_SHAPE,
                                             .ball = i,
                                             .kind = s->type->kind,
                                             .amount = -gap};
        }
    }
}

/* Of balls that the first one overlaps, the first is told. */
static void check_pairs(const struct mill_world *w, struct mill_fault *fault)
{
    struct mill_fill_grids grids = {.balls = 0};
    int32_t *near = malloc(sizeof *near * (size_t)w->balls);
    if (!near || !mill_fill_grids_init(&grids, w))
        fault->code = MILL_FAULT_MEMORY;
    for (int32_t i = 0; i < w->balls && fault->code == MILL_FAULT_NONE; i++) {
        const vec3 r = grids.place[i].r = w->ball[i].r;
        const int32_t n = mill_fill_grids_near(&grids, r, radius_of(w, i), near);
        for (int32_t k = 0; k < n; k++) {
            const double distance = vec3_norm(vec3_sub(r, w->ball[near[k]].r));
            const double gap = distance - (radius_of(w, i) + radius_of(w, near[k]));
            if (!(gap >= -SLACK) && (fault->code == MILL_FAULT_NONE || near[k] < fault->other))
                *fault = (struct mill_fault){MILL_FAULT_BALL_IN_BALL, i, near[k], .amount = -gap};
        }
        mill_fill_grids_place(&grids, i);
    }
    mill_fill_grids_free(&grids);
    free(near);
}

static void place_balls(const struct mill_setup *setup, const struct mill_start_watch *watch,
                        struct mill_world *w, struct mill_fault *fault)
{
    if (!setup->start) {
        mill_fill_random(setup, watch, w, fault);
        return;
    }
    for (int32_t i = 0; i < w->balls; i++) {
        w->ball[i].r = setup->start[i].position;
        w->ball[i].v = setup->start[i].velocity;
        w->spin[i] = setup->start[i].spin;
    }
    check_balls(w, fault);
    if (fault->code == MILL_FAULT_NONE)
        check_pairs(w, fault);
}

enum mill_fault_code mill_start_world(const struct mill_setup *setup,
                                      const struct mill_start_watch *watch,
                                      struct mill_world **world, struct mill_fault *fault)
{
    struct mill_fault unread = {.code = MILL_FAULT_NONE};
    fault = fault ? fault : &unread;
    *fault = (struct mill_fault){.code = MILL_FAULT_NONE};
    *world = NULL;
    if (!is_sound(setup))
        return fault->code = MILL_FAULT_NUMBER;
    struct mill_world *w = calloc(1, sizeof *w);
    if (!w || !make_motions(setup, w) || !make_balls(setup, w) ||
        !mill_shapes_create(setup, w->motion, &w->counts.quartics, &w->shape, &w->shapes)) {
        mill_world_free(w);
        return fault->code = MILL_FAULT_MEMORY;
    }
    w->g = setup->gravity;
    w->drum_radius =
        setup->drum.radius + (setup->drum.buckles > 0 ? setup->drum.buckle_height : 0.0);
    w->drum_length = setup->drum.length;
    memcpy(w->law, setup->law, sizeof w->law);
    w->rebound_floor = setup->rebound_floor;
    if (do_surfaces_fit(setup, w, fault))
        place_balls(setup, watch, w, fault);
    if (fault->code == MILL_FAULT_NONE) {
        w->start = mill_world_energy(w, 0.0);
        *world = w;
    } else {
        mill_world_free(w);
    }
    return fault->code;
}
