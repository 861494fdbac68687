/* Builds the world of a setup: motions, surfaces, species, start positions. Bodies must not run
 * into each other (clash.h). Given positions are checked in this order: speeds, surfaces, pairs. */
#include "millsim/start.h"

#include "base/elementary.h"
#include "base/memory.h"
#include "engine/grids.h"
#include "geometry/shapes.h"
#include "start/clash.h"
#include "start/fill.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_BALLS = 50000000, MOST_SHAPES = INT16_MAX - 3 };
/* Upper limit of the period of averages, in periods of the slowest motion. Example: the angle of a
 * round jar repeats only after fifty turns of its disk, but the mill repeats after one. */
enum { MOST_SINGLES = 12 };
/* [m] rounding of decimal positions may make touching balls overlap by this much */
#define SLACK 1e-12
/* Relative: so far beyond a periodic end, rounded positions of single precision are on it */
#define ON_END 1e-6
/* [m/s] a higher speed is a mistake in the units, and its square may overflow */
#define LIGHT 299792458.0
#define FLOOR 0.03         /* of the speed of a fall through the charge */
#define FLOOR_AT_REST 5e-3 /* [m/s] where nothing pushes the balls */

/* A motion can only be carried by an earlier one. */
static bool are_bodies_sound(const struct mill_setup *s)
{
    bool good = s->motions >= 0 && s->motions <= MILL_MOTIONS_MOST && s->surfaces >= 0 &&
                s->surfaces <= MOST_SHAPES && s->kinds >= 0 &&
                s->kinds <= MILL_KINDS_MOST - MILL_KINDS && s->rotor >= MILL_STILL;
    for (int k = 0; good && k < s->motions; k++) {
        const struct mill_setup_motion *m = &s->motion[k];
        good = m->on >= MILL_STILL && m->on < k && m->type->is_sound(m->form);
    }
    for (int k = 0; good && k < s->surfaces; k++) {
        const struct mill_setup_surface *b = &s->surface[k];
        good = b->motion >= MILL_STILL && b->motion < s->motions &&
               mill_solid_is_sound(b->solid, b->body) && b->kind > MILL_BALL_BALL &&
               b->kind < MILL_KINDS + s->kinds && b->ends >= 0 && b->ends < MILL_KINDS;
    }
    return good;
}

static bool is_fall_sound(const struct mill_fall *fall)
{
    bool good = fall->points >= 0 && fall->points <= MILL_FALL_POINTS &&
                (fall->points != 1 || fall->speed[0] > 0.0);
    for (int k = 0; good && k < fall->points; k++)
        good = fall->restitution[k] >= 0.0 && fall->restitution[k] <= 1.0 &&
               (k == 0 ? fall->speed[0] >= 0.0 : fall->speed[k] > fall->speed[k - 1]) &&
               isfinite(fall->speed[k]);
    return good;
}

/* Checks every number that could make the event loop meaningless or endless, but those of bodies */
static bool is_sound(const struct mill_setup *s)
{
    int64_t balls = 0;
    bool good = s->speed >= 0.0 && isfinite(s->speed) && isfinite(vec3_norm(s->gravity)) &&
                !(s->rebound_floor < 0.0) && !isinf(s->rebound_floor) && s->horizon >= 0.0 &&
                isfinite(s->horizon) && s->species > 0;
    for (int k = 0; good && k < s->species; k++) {
        const struct mill_setup_balls *b = &s->balls[k];
        good = b->diameter > 0.0 && isfinite(b->diameter) && b->density > 0.0 &&
               isfinite(b->density) && b->count >= 0;
        balls += b->count;
    }
    for (int kind = 0; kind < MILL_KINDS + s->kinds; kind++) {
        const struct mill_law *law = &s->law[kind];
        good = good && law->restitution >= 0.0 && law->restitution <= 1.0 && law->friction >= 0.0 &&
               fabs(law->tangential) <= 1.0 && is_fall_sound(&s->fall[kind]);
    }
    return good && balls > 0 && balls <= MOST_BALLS;
}

static enum mill_fault_code check_mill(const struct mill_setup *s)
{
    int containers = 0;
    if (!are_bodies_sound(s))
        return MILL_FAULT_NUMBER;
    for (int k = 0; k < s->surfaces; k++)
        containers += s->surface[k].body->inside != 0;
    return containers == 1 ? MILL_FAULT_NONE : MILL_FAULT_CONTAINER;
}

static bool make_motions(const struct mill_setup *setup, struct mill_world *w)
{
    w->motion = calloc((size_t)setup->motions + 1, sizeof(struct mill_motion *));
    w->motion_name = calloc((size_t)setup->motions + 1, sizeof *w->motion_name);
    w->rotor = setup->rotor < setup->motions ? setup->rotor : MILL_STILL;
    for (int k = 0; w->motion && w->motion_name && k < setup->motions; k++) {
        const struct mill_setup_motion *m = &setup->motion[k];
        assert(m->on >= MILL_STILL && m->on < k);
        w->motion[k] = m->type->create(m->form);
        if (!w->motion[k])
            return false;
        w->motions++;
        w->motion[k]->number = k;
        w->motion[k]->on = m->on == MILL_STILL ? NULL : w->motion[m->on];
        const char *name = m->name ? m->name : k == w->rotor ? "rotor" : "";
        strncpy(w->motion_name[k], name, sizeof w->motion_name[k] - 1);
    }
    if (w->rotor >= 0)
        w->rotor_speed = mill_motion_pose(w->motion[w->rotor], 0.0).angular_velocity.x;
    return w->motion && w->motion_name;
}

/* The cylinder around the container */
static void make_container(const struct mill_setup *setup, struct mill_world *w)
{
    const struct mill_setup_surface *s = mill_shapes_container(setup);
    const struct mill_body *is = s->body;
    const struct mill_hull hull = mill_solid_hull(s->solid, is);
    const struct mill_wall wall =
        mill_body_wall(s->solid, is, s->solid->walls ? 0 : MILL_SOLID_WHOLE);
    struct mill_container *c = &w->container;
    c->motion = s->motion >= 0 ? w->motion[s->motion] : NULL;
    c->frame = (struct mill_pose){.place = is->centre, .x = is->z, .y = is->x, .z = is->y};
    /* round ends extend beyond the hull's line; flat ones do not */
    const bool flat = s->solid->walls && (wall.flat || isinf(wall.half));
    w->drum_radius = hull.radius;
    w->drum_length = 2.0 * (hull.half + (flat ? 0.0 : hull.radius));
    c->volume = s->solid->volume(is);
    c->drum = s->solid->moving && s->ends > 0;
    c->radius = c->drum ? is->radius : hull.radius;
    c->period = is->open ? is->length : 0.0;
    c->still = c->drum && !c->motion;
    const struct mill_motion *m = c->motion;
    const bool round = s->solid->round || c->drum || is->corners > 0;
    const bool turns =
        m && m->axial && round && vec3_norm(vec3_cross(m->axis, c->frame.x)) <= 1e-9 &&
        vec3_norm(vec3_cross(vec3_sub(c->frame.place, m->through), m->axis)) <= 1e-9 * c->radius;
    c->mapped = turns ? m->on : m;
}

/* Extends the box [lo, hi] to contain the cylinder in this frame. */
static void take_in(const struct mill_world *w, const struct mill_pose *frame, double margin,
                    vec3 *lo, vec3 *hi)
{
    const double r = w->drum_radius, half = 0.5 * w->drum_length;
    const vec3 x = frame->x, at = frame->place;
    /* half extent across the axis: r times the sine of the angle */
    const vec3 e = {half * fabs(x.x) + r * sqrt(fmax(0.0, 1.0 - x.x * x.x)) + margin,
                    half * fabs(x.y) + r * sqrt(fmax(0.0, 1.0 - x.y * x.y)) + margin,
                    half * fabs(x.z) + r * sqrt(fmax(0.0, 1.0 - x.z * x.z)) + margin};
    *lo = vec3_make(fmin(lo->x, at.x - e.x), fmin(lo->y, at.y - e.y), fmin(lo->z, at.z - e.z));
    *hi = vec3_make(fmax(hi->x, at.x + e.x), fmax(hi->y, at.y + e.y), fmax(hi->z, at.z + e.z));
}

/* Finds a box that contains the container at all times: of many places in a period, with a margin
 * for half the time between two. Without a common period, of the ball that it never leaves. */
static void find_places(struct mill_world *w)
{
    enum { LOOKS = 512, MOST = 100000 };
    struct mill_container *c = &w->container;
    const double r = w->drum_radius, half = 0.5 * w->drum_length, size = sqrt(r * r + half * half);
    const bool axial = c->motion && mill_motion_pose(c->motion, 0.0).about_x &&
                       vec3_norm(c->frame.place) == 0.0 && c->frame.x.x == 1.0;
    struct mill_reach *places = &c->places;
    *places = (struct mill_reach){{-half, -r, -r}, {half, r, r}, r};
    c->lo = places->lo;
    c->hi = places->hi;
    if (c->still || axial)
        return;
    const struct mill_pose begin = mill_world_frame(w, 0.0);
    c->lo = vec3_make(INFINITY, INFINITY, INFINITY);
    c->hi = vec3_scale(c->lo, -1.0);
    *places = (struct mill_reach){c->lo, c->hi, INFINITY};
    take_in(w, &begin, 1e-9 * size, &c->lo, &c->hi);
    struct mill_motion *chain = (struct mill_motion *)c->motion;
    const struct mill_motion_cycle cycle = mill_motion_cycle(&chain, 1);
    const struct mill_motion_bounds b = mill_motion_bounds(c->motion, c->frame.place);
    const int n = cycle.singles * LOOKS, looks = cycle.single <= 0.0 ? 1 : n < MOST ? n : MOST;
    const double between = looks > 1 ? cycle.period / looks : 0.0;
    const double margin = 0.5 * between * (b.speed + b.turning * size) + 1e-9 * size;
    for (int k = 0; k < looks; k++) {
        const struct mill_pose frame = mill_world_frame(w, k * between);
        take_in(w, &frame, margin, &places->lo, &places->hi);
    }
    if (looks > 0)
        return;
    const double far = b.far + size;
    places->lo = vec3_make(b.home.x - far, b.home.y - far, b.home.z - far);
    places->hi = vec3_make(b.home.x + far, b.home.y + far, b.home.z + far);
}

static bool make_mill(const struct mill_setup *setup, struct mill_world *w)
{
    if (!make_motions(setup, w))
        return false;
    const struct mill_motion_cycle cycle = mill_motion_cycle(w->motion, w->motions);
    w->period = cycle.singles <= MOST_SINGLES ? cycle.period : cycle.single;
    make_container(setup, w);
    find_places(w);
    return mill_shapes_create(setup, &w->container.places, w->motion, &w->shape, &w->shapes);
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

/* The fault of the first ball too fast or beyond a periodic end, else of one in a surface */
static void check_balls(const struct mill_world *w, struct mill_fault *fault)
{
    const double period = w->container.period;
    for (int32_t i = 0; i < w->balls && fault->code == MILL_FAULT_NONE; i++)
        if (!(vec3_norm(w->ball[i].v) <= LIGHT &&
              vec3_norm(w->spin[i]) * mill_world_radius(w, i) <= LIGHT))
            *fault = (struct mill_fault){.code = MILL_FAULT_SPEED, .ball = i};
    for (int32_t i = 0; i < w->balls && period > 0.0 && fault->code == MILL_FAULT_NONE; i++) {
        const double x = fabs(w->ball[i].r.x);
        if (!(x <= 0.5 * period))
            *fault = (struct mill_fault){.code = MILL_FAULT_BALL_OUTSIDE, .ball = i, .amount = x};
    }
    for (int32_t i = 0; i < w->balls && fault->code == MILL_FAULT_NONE; i++) {
        for (int k = 0; k < w->shapes && fault->code == MILL_FAULT_NONE; k++) {
            const struct mill_shape *s = w->shape[k];
            const struct mill_pose pose = mill_shape_pose(s, 0.0);
            const double gap = mill_shape_gap(s, w->ball[i].r, mill_world_radius(w, i), &pose);
            if (!(gap >= -SLACK))
                *fault = (struct mill_fault){
                    .code = MILL_FAULT_BALL_IN_SHAPE, .ball = i, .kind = s->kind, .amount = -gap};
        }
    }
}

/* Reports the first ball that overlaps an earlier one, and the first of these. */
static void check_pairs(const struct mill_world *w, struct mill_fault *fault)
{
    struct mill_grids grids;
    int32_t *near = malloc(sizeof *near * ((size_t)w->balls + MILL_CELL_ROW));
    bool made = mill_grids_init(&grids, w, 1.0) && near;
    for (int32_t i = 0; i < w->balls && made && fault->code == MILL_FAULT_NONE; i++) {
        const struct mill_ball *ball = &w->ball[i];
        const int32_t cell = mill_cells_at(grids.own, ball->r);
        const int32_t n = mill_grids_gather(&grids, ball->species, cell, near);
        for (int32_t k = 0; k < n; k++) {
            vec3 d = vec3_sub(ball->r, w->ball[near[k]].r);
            d.x = mill_world_image(w, d.x);
            const double gap =
                vec3_norm(d) - (mill_world_radius(w, i) + mill_world_radius(w, near[k]));
            if (!(gap >= -SLACK) && (fault->code == MILL_FAULT_NONE || near[k] < fault->other))
                *fault = (struct mill_fault){
                    .code = MILL_FAULT_BALL_IN_BALL, .ball = i, .other = near[k], .amount = -gap};
        }
        made = mill_grids_insert(&grids, i, ball->species, cell);
    }
    if (!made)
        fault->code = MILL_FAULT_MEMORY;
    mill_grids_release(&grids);
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
        if (fabs(w->ball[i].r.x) <= 0.5 * w->container.period * (1.0 + ON_END))
            w->ball[i].r.x = mill_world_image(w, w->ball[i].r.x);
        w->ball[i].v = setup->start[i].velocity;
        w->spin[i] = setup->start[i].spin;
    }
    check_balls(w, fault);
    if (fault->code == MILL_FAULT_NONE)
        check_pairs(w, fault);
}

/* A setup with its drum as the first of the surfaces */
struct written {
    struct mill_setup setup;
    struct mill_setup_surface *surface;
    struct mill_body drum;
};

static bool write_out(const struct mill_setup *setup, struct written *w)
{
    const struct mill_setup_drum *drum = &setup->drum;
    const int first = drum->radius != 0.0 || drum->corners > 0;
    w->setup = *setup;
    w->setup.surface = w->surface =
        calloc((size_t)(setup->surfaces > 0 ? setup->surfaces : 0) + 1, sizeof *w->surface);
    if (!w->surface)
        return false;
    if (first) {
        w->drum = mill_setup_drum_body(drum);
        w->surface[0] = (struct mill_setup_surface){.solid = mill_setup_drum_solid(drum),
                                                    .body = &w->drum,
                                                    .number = -1,
                                                    .motion = drum->rides - 1,
                                                    .kind = MILL_BALL_DRUM,
                                                    .ends = MILL_BALL_WALL};
    }
    for (int k = 0; k < setup->surfaces; k++)
        w->surface[first + k] = setup->surface[k];
    w->setup.surfaces += first;
    return true;
}

/* [m/s^2] The greatest acceleration of a motion, as far from the container's centre as its wall */
static double push_of(const struct mill_world *w, const struct mill_motion *motion)
{
    const vec3 centre = vec3_scale(vec3_add(w->container.lo, w->container.hi), 0.5);
    const double r = w->container.radius;
    double most = 0.0;
    for (int k = 0; k < 6; k++) {
        const double side = k % 2 ? r : -r;
        const vec3 to = {k / 2 == 0 ? side : 0.0, k / 2 == 1 ? side : 0.0, k / 2 == 2 ? side : 0.0};
        const vec3 place = mill_motion_in(motion, 0.0, vec3_add(centre, to));
        most = fmax(most, mill_motion_bounds(motion, place).acceleration);
    }
    return most;
}

/* [m/s] A small part of the speed of a fall through the charge; but so low that impacts from
 * MILL_WORLD_SLOW on, and of the energy `asked` [J], do not depend on it (docs/physics.md) */
static double floor_of(const struct mill_world *w, double asked)
{
    double bulk = 0.0, push = 0.0, mass = 0.0; /* [m^3] of the heap of balls, [m/s^2], [kg] */
    for (int32_t i = 0; i < w->balls; i++) {
        const double a = mill_world_radius(w, i);
        bulk += 4.0 / 3.0 * MILL_PI * a * a * a / MILL_START_PACKING;
        mass = fmax(mass, w->species[w->ball[i].species].mass);
    }
    for (int k = 0; k < w->motions; k++)
        push = fmax(push, push_of(w, w->motion[k]));
    push += vec3_norm(w->g);
    const double depth = fmin(w->container.radius, mill_elementary_cbrt(bulk));
    const double slow = asked > 0.0 ? sqrt(2.0 * asked / mass) : MILL_WORLD_SLOW;
    const double most = fmax(fmin(slow, MILL_WORLD_SLOW) / MILL_WORLD_FLOORS, FLOOR_AT_REST);
    return push > 0.0 ? fmin(FLOOR * sqrt(push * depth), most) : FLOOR_AT_REST;
}

enum mill_fault_code mill_start_world(const struct mill_setup *setup,
                                      const struct mill_start_watch *watch,
                                      struct mill_world **world, struct mill_fault *fault)
{
    struct mill_fault unread = {.code = MILL_FAULT_NONE};
    struct written out;
    struct mill_world *w = calloc(1, sizeof *w);
    fault = fault ? fault : &unread;
    *fault = (struct mill_fault){.code = MILL_FAULT_MEMORY, .unchecked.when = INFINITY};
    for (int k = 0; k < MILL_FAULT_PASSINGS; k++)
        fault->narrowest[k].gap = INFINITY;
    *world = NULL;
    if (write_out(setup, &out) && w)
        fault->code = is_sound(&out.setup) ? check_mill(&out.setup) : MILL_FAULT_NUMBER;
    setup = &out.setup;
    if (fault->code == MILL_FAULT_NONE && !(make_mill(setup, w) && make_balls(setup, w)))
        fault->code = MILL_FAULT_MEMORY;
    if (fault->code == MILL_FAULT_NONE) {
        mill_kinds_init(&w->kinds);
        for (int k = 0; k < setup->kinds; k++)
            mill_kinds_add(&w->kinds, setup->kind[k]);
        w->g = setup->gravity;
        memcpy(w->law, setup->law, sizeof w->law);
        memcpy(w->fall, setup->fall, sizeof w->fall);
        for (int k = 0; k < w->kinds.count; k++)
            if (w->fall[k].points == 1)
                w->fall[k].loss = mill_impact_loss(w->fall[k].restitution[0]);
        w->rebound_floor =
            isnan(setup->rebound_floor) ? floor_of(w, setup->asked) : setup->rebound_floor;
        w->soft = setup->soft;
        if (mill_ends_fit(setup, w->motion, fault) &&
            !mill_clash_find(setup, watch, w->motion, fault))
            fault->code = MILL_FAULT_MEMORY;
    }
    if (fault->code == MILL_FAULT_NONE)
        place_balls(setup, watch, w, fault);
    if (fault->code == MILL_FAULT_NONE) {
        w->start = mill_world_energy(w, 0.0);
        *world = w;
    } else {
        mill_world_free(w);
    }
    free(out.surface);
    return fault->code;
}

enum mill_fault_code mill_start_free_volume_of(const struct mill_setup *setup, double *volume)
{
    struct written out;
    struct mill_world *w = calloc(1, sizeof *w);
    enum mill_fault_code code = MILL_FAULT_MEMORY;
    if (write_out(setup, &out) && w)
        code = check_mill(&out.setup);
    if (code == MILL_FAULT_NONE) {
        *volume = make_mill(&out.setup, w) ? mill_start_free_volume(w) : -1.0;
        code = *volume < 0.0 ? MILL_FAULT_MEMORY : MILL_FAULT_NONE;
    }
    mill_world_free(w);
    free(out.surface);
    return code;
}
