/* What should a reader of the summary be warned of? Rules with stated bounds, from the books alone:
 * - ring: in the last tenth of the window the rotor had at most one in 200 of all contacts; nine
 * tenths of the kinetic energy are in the charge's turning about the axis, L^2 / 2I with angular
 * momentum L and moment of inertia I; and it turns so fast that it stays up, w^2 r > g with w = L /
 * I, r^2 = I / m. A smooth drum without friction ends like that, as nothing brakes the balls: a
 * thick ring at nearly the rotor's speed, a thin one slower, once the rotor does not reach it any
 * more.
 * - not steady: over the window the rotor's power and the dissipation differ by more than a
 * twentieth.
 * - a pinch relieved: the 30 000 contacts before each relief are in the statistics.
 * - restitution of 0.6 or less together with friction, or three tenths of the ball-ball contacts at
 * the rebound floor: the charge collapses inelastically and the floor shapes the result. */
#include "app/summary.h"

#include <math.h>
#include <stdarg.h>
#include <string.h>

/* Angular speed of the ring that the charge has become [rad/s]; 0 when it has not. */
static double ring_speed(const struct mill_world *world, const struct mill_tally_results *r,
                         double t)
{
    if (world->rotor_speed == 0 || !r->late)
        return 0;
    uint64_t all = 0, rotor = 0; /* contacts in the last tenth */
    for (int kind = 0; kind < MILL_KINDS; kind++) {
        const uint64_t late = r->at_end.collisions[kind] - r->at_late.collisions[kind];
        all += late;
        rotor += kind == MILL_BALL_SHAFT || kind == MILL_BALL_BLADE ? late : 0;
    }
    if (all < (uint64_t)world->balls || (double)rotor > 5e-3 * (double)all)
        return 0;
    double mass = 0, inertia = 0, momentum = 0;
    for (int32_t i = 0; i < world->balls; i++) {
        const double m = world->species[world->ball[i].species].mass;
        const vec3 x = mill_world_position(world, i, t), v = mill_world_velocity(world, i, t);
        mass += m;
        inertia += m * (x.y * x.y + x.z * x.z);
        momentum += m * (x.y * v.z - x.z * v.y);
    }
    const double speed = momentum / inertia, gravity = hypot(world->g.y, world->g.z);
    const bool turning =
        0.5 * momentum * speed >= 0.9 * mill_world_energy(world, t).kinetic && speed != 0;
    return turning && speed * speed * sqrt(inertia / mass) > gravity ? speed : 0;
}

/* Does the charge still gain or lose energy over the window, so that its means describe no steady
 * mill? */
static bool unsteady(const struct mill_world *world, const struct mill_tally_results *r)
{
    double dissipated = 0;
    for (int kind = 0; kind < MILL_KINDS; kind++)
        dissipated += r->at_end.dissipation[kind] - r->at_begin.dissipation[kind];
    dissipated = mill_tally_per_second(r, dissipated);
    const double power = mill_tally_power(r);
    return world->rotor_speed != 0 && r->duration > 0 &&
           fabs(power - dissipated) > 0.05 * fmax(fabs(power), fabs(dissipated));
}

/* A kind that occurred and whose law is too inelastic for hard spheres; MILL_KINDS: none */
static int too_inelastic(const struct mill_world *world)
{
    for (int kind = 0; kind < MILL_KINDS; kind++)
        if (world->account.collisions[kind] > 0 && world->law[kind].friction > 0 &&
            world->law[kind].restitution <= 0.6)
            return kind;
    return MILL_KINDS;
}

/* The next note, to be filled */
__attribute__((format(printf, 2, 3))) static void add(struct mill_summary *s, const char *format,
                                                      ...)
{
    va_list list;
    va_start(list, format);
    vsnprintf(s->note[s->notes++], sizeof s->note[0], format, list);
    va_end(list);
}

void mill_summary_note(struct mill_summary *s)
{
    const struct mill_world *world = s->world;
    const struct mill_tally_results *r = s->results;
    const double floored = mill_tally_floor_share(r, MILL_BALL_BALL);
    const double ring = ring_speed(world, r, s->facts->local);
    const int kind = too_inelastic(world);
    if (strcmp(s->facts->status, "stopped") == 0)
        add(s, "stopped at %.6g s of %.6g s; the file holds everything up to then.", s->facts->time,
            s->facts->end);
    if (!(r->duration > 0))
        add(s, "nothing was sampled: the run has not got beyond run.sample_from = %.6g s.",
            r->tally->begin);
    if (ring != 0)
        add(s,
            "the charge has come off the rotor and turns as a ring, at %.0f %% of the rotor's "
            "speed%s.",
            100 * ring / world->rotor_speed,
            world->law[MILL_BALL_DRUM].friction > 0
                ? ""
                : ": nothing brakes the balls in a smooth drum without friction");
    else if (unsteady(world, r))
        add(s, "not steady: the rotor's power and the dissipated power differ by more than 5 %% "
               "over the sampled window. Sample later or for longer.");
    if (kind < MILL_KINDS)
        add(s,
            "%s has friction and a restitution of %.3g: hard spheres are meant for 0.7 and more; "
            "in dense beds below that their power no longer agrees with soft spheres.",
            mill_kind_name[kind], world->law[kind].restitution);
    if (world->counts.reliefs > 0)
        add(s,
            "pinched balls were let go %llu times. The thousands of contacts before each spoil "
            "counts and medians (strikes less); wider gaps around the blades help, though chains "
            "of balls may still be pressed.",
            (unsigned long long)world->counts.reliefs);
    if (floored > 0.3)
        add(s,
            "%.0f %% of the ball-ball contacts are at the rebound floor: medians over all contacts "
            "depend on it; rather use those above 50 mm/s.",
            100 * floored);
}
