/* Small mills with every kind of contact between them, and when two runs are the same. */
#ifndef SIM_MILLS_H
#define SIM_MILLS_H

#include "engine/sim_private.h"
#include "sim_fixture.h"
#include "state_fixture.h"

static const char *const mills[] = {
    /* every kind of contact, with friction */
    "[run]\ntime = 1 s\n[balls]\ncount = 200\ndiameter = 5 mm\ndensity = 7800 kg/m^3\n"
    "[drum]\nradius = 40 mm\nlength = 40 mm\n[rotor]\nspeed = 1000 rpm\nshaft_radius = 8 mm\n"
    "[blades]\ncount = 2\ntip_radius = 33 mm\nwidth = 8 mm\nthickness = 5 mm\npitch = 20 deg\n"
    "[contact]\nrestitution = 0.8\nfriction = 0.3\ntangential_restitution = 0.484\n",
    /* a mixture, smooth, turning backwards, gravity askew */
    "[run]\ntime = 1 s\n[gravity]\nacceleration = 3 -4 -8 m/s^2\n[balls.big]\ncount = 20\n"
    "diameter = 8 mm\ndensity = 7800 kg/m^3\n[balls.small]\ncount = 150\ndiameter = 3 mm\n"
    "density = 2500 kg/m^3\n[drum]\nradius = 40 mm\nlength = 40 mm\n[rotor]\nspeed = -600 rpm\n"
    "shaft_radius = 8 mm\n[blades]\ncount = 1\ntip_radius = 31 mm\nwidth = 10 mm\n"
    "thickness = 4 mm\n[contact]\nrestitution = 0.9\n",
    /* rough and bouncy without gravity, a law of its own for every kind */
    "[run]\ntime = 1 s\n[gravity]\nacceleration = 0 0 0 m/s^2\n[balls]\ncount = 100\n"
    "diameter = 5 mm\ndensity = 7800 kg/m^3\nspeed = 2 m/s\n[drum]\nradius = 40 mm\n"
    "length = 40 mm\n[rotor]\nspeed = 300 rpm\nshaft_radius = 8 mm\n[blades]\ncount = 1\n"
    "tip_radius = 33 mm\nwidth = 10 mm\nthickness = 5 mm\npitch = -70 deg\n"
    "[contact]\nrestitution = 1\nfriction = 1\ntangential_restitution = 1\n"
    "[contact.ball_drum]\nrestitution = 0.5\n[contact.ball_wall]\ntangential_restitution = -1\n"
    "[contact.ball_blade]\nrestitution = 0.7\nfriction = 0\n[contact.ball_shaft]\nfriction = 5\n",
    /* a standing rotor in a frictional charge that comes to rest */
    "[run]\ntime = 1 s\n[balls]\ncount = 150\ndiameter = 5 mm\ndensity = 7800 kg/m^3\n"
    "speed = 3 m/s\n[drum]\nradius = 40 mm\nlength = 40 mm\n[rotor]\nspeed = 0 rpm\n"
    "shaft_radius = 8 mm\nangle = 70 deg\n[blades]\ncount = 3\ntip_radius = 33 mm\n"
    "width = 6 mm\nthickness = 5 mm\n[contact]\nrestitution = 0.7\nfriction = 0.5\n",
};
enum { MILLS = sizeof mills / sizeof *mills };

/* Mills in which a blade presses balls into a wedge that friction keeps shut: at the tip, and a
 * pitched blade's face at the end wall. */
static const char *const pinching[] = {
    "[run]\ntime = 1 s\n[balls]\ncount = 60\ndiameter = 5 mm\ndensity = 7800 kg/m^3\n"
    "[drum]\nradius = 40 mm\nlength = 30 mm\n[rotor]\nspeed = 300 rpm\nshaft_radius = 8 mm\n"
    "[blades]\ncount = 1\ntip_radius = 35.05 mm\nwidth = 10 mm\nthickness = 5 mm\n"
    "[contact]\nrestitution = 0.8\nfriction = 0.5\n",
    "[run]\ntime = 1 s\n[balls]\ncount = 60\ndiameter = 5 mm\ndensity = 7800 kg/m^3\n"
    "[drum]\nradius = 40 mm\nlength = 30 mm\n[rotor]\nspeed = -600 rpm\nshaft_radius = 8 mm\n"
    "[blades]\ncount = 1\ntip_radius = 35 mm\nwidth = 10 mm\nthickness = 5 mm\npitch = 30 deg\n"
    "[contact]\nrestitution = 0.8\nfriction = 0.5\n",
    "[run]\ntime = 1 s\n[balls]\ncount = 200\ndiameter = 5 mm\ndensity = 7800 kg/m^3\n"
    "[drum]\nradius = 40 mm\nlength = 40 mm\n[rotor]\nspeed = 1000 rpm\nshaft_radius = 8 mm\n"
    "[blades]\ncount = 2\ntip_radius = 33 mm\nwidth = 10 mm\nthickness = 5 mm\npitch = 20 deg\n"
    "[contact]\nrestitution = 0.8\nfriction = 0.3\ntangential_restitution = 0.484\n",
};
enum { PINCHING = sizeof pinching / sizeof *pinching };

static inline void runs_are_alike(const struct bench *a, const struct bench *b)
{
    const struct mill_world *v = a->world, *w = b->world;
    ck_assert_double_eq(mill_sim_time(a->sim), mill_sim_time(b->sim));
    ck_assert_mem_eq(v->ball, w->ball, sizeof *v->ball * (size_t)v->balls);
    ck_assert_mem_eq(v->spin, w->spin, sizeof *v->spin * (size_t)v->balls);
    ck_assert_mem_eq(&v->account, &w->account, sizeof v->account);
    ck_assert_mem_eq(&v->counts, &w->counts, sizeof v->counts);
}

/* Takes out of a state where the calendar has filed the plans' events: it files them anew. */
static inline void forget_places(struct kept *state, const char *plans)
{
    struct kept_field *field = kept_find(state, plans);
    struct mill_plan *plan = (struct mill_plan *)(void *)field->value;
    for (size_t i = 0; i < field->bytes / sizeof *plan; i++) {
        plan[i].event.next = 0;
        plan[i].event.prev = 0;
        plan[i].event.place = 0;
    }
}

#endif
