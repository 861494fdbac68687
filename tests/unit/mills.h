/* Mills for the tests of start and loop, as plain numbers, and small ones with every kind of
 * contact between them. */
#ifndef MILLS_H
#define MILLS_H

#include "draws.h"
#include "millsim/start.h"
#include "parts.h"

#define RPM (PI / 30.0)
#define DEG (PI / 180.0)
#define STEEL 7800.0 /* [kg/m^3] */

enum { MODEL_BLADES = 6, MODEL_SPECIES = 3 };

/* A setup, and what its lists are made of */
struct model {
    struct mill_setup setup; /* gravity, drum, speed; seed 0: 1; rebound floor 0: 5 mm/s */
    bool floorless;          /* no rebound floor at all */
    struct mill_law law;     /* of all kinds of contact for which the setup has none */
    struct mill_setup_balls balls[MODEL_SPECIES]; /* diameter 0: no more */
    struct mill_turn rotor;                       /* about x; no shaft, no blade: none */
    double shaft;                                 /* [m] its radius; 0: none */
    int blades;
    /* where only the first of several is given all are like it, along the drum and around it */
    struct mill_blade blade[MODEL_BLADES];
};

/* The lists that a setup points to */
struct model_lists {
    struct mill_turn rotor;
    struct mill_setup_motion motion;
    struct mill_body shaft, blade[MODEL_BLADES];
    struct mill_setup_surface surface[MODEL_BLADES + 1];
};

static inline void model_add_rotor(const struct model *m, struct model_lists *lists,
                                   struct mill_setup *s)
{
    const double pitch = s->drum.length / (m->blades ? m->blades : 1);
    lists->rotor = m->rotor;
    lists->rotor.axis = vec3_make(1.0, 0.0, 0.0);
    lists->motion = (struct mill_setup_motion){
        .type = &mill_turn_type, .form = &lists->rotor, .on = MILL_STILL};
    s->motions = m->shaft > 0.0 || m->blades > 0;
    s->motion = &lists->motion;
    s->surface = lists->surface;
    lists->shaft = mill_setup_shaft(m->shaft, s->drum.length);
    if (m->shaft > 0.0)
        lists->surface[s->surfaces++] = shaft_surface(&lists->shaft);
    for (int k = 0; k < m->blades; k++) {
        struct mill_blade b = m->blade[k];
        if (m->blades > 1 && m->blade[1].tip_radius == 0.0) {
            b = m->blade[0];
            b.position = -0.5 * s->drum.length + (k + 0.5) * pitch;
            b.angle = k * 2.0 * PI / m->blades;
        }
        lists->blade[k] = mill_setup_blade(&b);
        lists->surface[s->surfaces++] = blade_surface(&lists->blade[k], k);
    }
}

static inline enum mill_fault_code model_start(const struct model *m,
                                               const struct mill_start_watch *watch,
                                               struct mill_world **world, struct mill_fault *fault)
{
    struct model_lists lists;
    struct mill_setup s = m->setup;
    s.seed = s.seed ? s.seed : 1;
    s.rebound_floor = s.rebound_floor == 0.0 && !m->floorless ? 5e-3 : s.rebound_floor;
    s.balls = m->balls;
    while (s.species < MODEL_SPECIES && m->balls[s.species].diameter > 0.0)
        s.species++;
    for (int kind = 0; kind < MILL_KINDS; kind++) {
        const struct mill_law *own = &s.law[kind];
        if (own->restitution == 0.0 && own->friction == 0.0 && own->tangential == 0.0)
            s.law[kind] = m->law;
    }
    model_add_rotor(m, &lists, &s);
    return mill_start_world(&s, watch, world, fault);
}

/* The world of a model that is known to be right. */
static inline struct mill_world *model_world(const struct model *m)
{
    struct mill_world *world;
    const enum mill_fault_code code = model_start(m, NULL, &world, NULL);
    ck_assert_msg(code == MILL_FAULT_NONE, "%s", mill_setup_fault_text(code));
    return world;
}

/* Between a ball's surface and the nearest surface of the world at local time t [m] */
static inline double world_gap(const struct mill_world *w, vec3 r, double radius, double t)
{
    double least = INFINITY;
    for (int k = 0; k < w->shapes; k++) {
        const struct mill_pose pose = mill_shape_pose(w->shape[k], t);
        least = fmin(least, mill_shape_gap(w->shape[k], r, radius, &pose));
    }
    return least;
}

static inline double radius_of(const struct mill_world *w, int32_t i)
{
    return w->species[w->ball[i].species].radius;
}

static const struct model mills[] = {
    /* every kind of contact, with friction */
    {.setup = {.gravity.z = -9.81, .drum = {.radius = 0.04, .length = 0.04}},
     .balls = {{.diameter = 0.005, .density = STEEL, .count = 200}},
     .rotor = {.speed = 1000 * RPM},
     .shaft = 0.008,
     .blades = 2,
     .blade = {{.tip_radius = 0.033, .width = 0.008, .thickness = 0.005, .pitch = 20 * DEG}},
     .law = {0.8, 0.3, 0.484}},
    /* a mixture, smooth, turning backwards, gravity askew */
    {.setup = {.gravity = {3.0, -4.0, -8.0}, .drum = {.radius = 0.04, .length = 0.04}},
     .balls = {{.diameter = 0.008, .density = STEEL, .count = 20},
               {.diameter = 0.003, .density = 2500.0, .count = 150}},
     .rotor = {.speed = -600 * RPM},
     .shaft = 0.008,
     .blades = 1,
     .blade = {{.tip_radius = 0.031, .width = 0.01, .thickness = 0.004}},
     .law = {.restitution = 0.9}},
    /* rough and bouncy without gravity, a law of its own for every kind */
    {.setup = {.drum = {.radius = 0.04, .length = 0.04},
               .speed = 2.0,
               .law = {[MILL_BALL_DRUM] = {0.5, 1.0, 1.0},
                       [MILL_BALL_WALL] = {1.0, 1.0, -1.0},
                       [MILL_BALL_BLADE] = {0.7, 0.0, 1.0},
                       [MILL_BALL_SHAFT] = {1.0, 5.0, 1.0}}},
     .balls = {{.diameter = 0.005, .density = STEEL, .count = 100}},
     .rotor = {.speed = 300 * RPM},
     .shaft = 0.008,
     .blades = 1,
     .blade = {{.tip_radius = 0.033, .width = 0.01, .thickness = 0.005, .pitch = -70 * DEG}},
     .law = {1.0, 1.0, 1.0}},
    /* a standing rotor in a frictional charge that comes to rest */
    {.setup = {.gravity.z = -9.81, .drum = {.radius = 0.04, .length = 0.04}, .speed = 3.0},
     .balls = {{.diameter = 0.005, .density = STEEL, .count = 150}},
     .rotor = {.angle = 70 * DEG},
     .shaft = 0.008,
     .blades = 3,
     .blade = {{.tip_radius = 0.033, .width = 0.006, .thickness = 0.005}},
     .law = {0.7, 0.5}},
};
enum { MILLS = sizeof mills / sizeof *mills };

/* Mills in which a blade presses balls into a wedge that friction keeps shut: at the tip, and a
 * pitched blade's face at the end wall. */
static const struct model pinching[] = {
    {.setup = {.gravity.z = -9.81, .drum = {.radius = 0.04, .length = 0.03}},
     .balls = {{.diameter = 0.005, .density = STEEL, .count = 60}},
     .rotor = {.speed = 300 * RPM},
     .shaft = 0.008,
     .blades = 1,
     .blade = {{.tip_radius = 0.03505, .width = 0.01, .thickness = 0.005}},
     .law = {0.8, 0.5}},
    {.setup = {.gravity.z = -9.81, .drum = {.radius = 0.04, .length = 0.03}},
     .balls = {{.diameter = 0.005, .density = STEEL, .count = 60}},
     .rotor = {.speed = -600 * RPM},
     .shaft = 0.008,
     .blades = 1,
     .blade = {{.tip_radius = 0.035, .width = 0.01, .thickness = 0.005, .pitch = 30 * DEG}},
     .law = {0.8, 0.5}},
    {.setup = {.gravity.z = -9.81, .drum = {.radius = 0.04, .length = 0.04}},
     .balls = {{.diameter = 0.005, .density = STEEL, .count = 200}},
     .rotor = {.speed = 1000 * RPM},
     .shaft = 0.008,
     .blades = 2,
     .blade = {{.tip_radius = 0.033, .width = 0.01, .thickness = 0.005, .pitch = 20 * DEG}},
     .law = {0.8, 0.3, 0.484}},
};
enum { PINCHING = sizeof pinching / sizeof *pinching };

#endif
