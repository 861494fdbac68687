/* What the tests of the statistics share: a mill made by hand, and a loop that plays impacts to an
 * observer as the simulation would, keeping the world's books. */
#ifndef MILL_FIXTURE_H
#define MILL_FIXTURE_H

#include "observe/observers.h"
#include "observe/tally.h"
#include "surfaces.h"
#include "unit.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846

enum { FIXTURE_BALLS = 40 };

struct fixture {
    struct mill_motion *motion[1]; /* the rotor */
    char motion_name[1][MILL_MOTION_NAME];
    struct mill_observe asked;
    struct mill_world world;
    struct mill_ball ball[FIXTURE_BALLS];
    vec3 spin[FIXTURE_BALLS];
    struct mill_species species;
    struct mill_tally *tally;
    enum mill_status last;              /* of the tally's last sample, or MILL_ENDED by an impact */
    struct mill_tally_results *results; /* NULL before the run's end */
};

/* The rotor turns at this speed [rad/s]; 0: it stands. */
static inline void fixture_speed(struct fixture *f, double speed)
{
    f->world.rotor_speed = speed;
    f->world.period = speed != 0 ? 2 * PI / fabs(speed) : (double)INFINITY;
}

/* Drum of 75 mm x 120 mm, 1 s sampled from 0.5 s on, rotor at ten revolutions a second; the balls
 * rest on a ring of 60 mm. */
static inline void fixture_init(struct fixture *f)
{
    static struct mill_motion *rotor; /* one for all, until the program ends */
    memset(f, 0, sizeof *f);
    if (!rotor)
        rotor = mill_turn_type.create(&(struct mill_turn){.axis = {1, 0, 0}});
    f->motion[0] = rotor;
    strcpy(f->motion_name[0], "rotor");
    f->world.motions = 1;
    f->world.motion = f->motion;
    f->world.motion_name = f->motion_name;
    f->world.container.still = true;
    f->world.container.drum = true;
    f->world.container.radius = 0.075;
    f->world.container.frame = mill_pose_still;
    f->world.container.lo = vec3_make(-0.06, -0.075, -0.075);
    f->world.container.hi = vec3_make(0.06, 0.075, 0.075);
    mill_kinds_init(&f->world.kinds);
    f->asked.end = 1.5;
    f->asked.sample_from = 0.5;
    f->asked.strike_window = 1e-5;
    f->asked.hard = 1e-3;
    f->species.radius = 0.0025;
    f->species.mass = 0.0005;
    f->species.inertia = 0.4 * 0.0005 * 0.0025 * 0.0025;
    f->world.drum_radius = 0.075;
    f->world.drum_length = 0.12;
    fixture_speed(f, 2 * PI * 10);
    f->world.balls = FIXTURE_BALLS;
    f->world.ball = f->ball;
    f->world.spin = f->spin;
    f->world.species_count = 1;
    f->world.species = &f->species;
    for (int i = 0; i < FIXTURE_BALLS; i++) {
        const double angle = 2 * PI * i / FIXTURE_BALLS;
        f->ball[i].r = vec3_make(0.01, 0.06 * cos(angle), 0.06 * sin(angle));
    }
    for (int kind = 0; kind < MILL_KINDS; kind++)
        f->world.law[kind].restitution = 0.8;
    surfaces_give(&f->world);
}

static inline void fixture_create(struct fixture *f)
{
    f->tally =
        (struct mill_tally *)mill_observers_one(&mill_tally_type, &f->asked, &f->world, NULL);
    ck_assert_ptr_nonnull(f->tally);
}

static inline struct mill_impact impact_of(double time, enum mill_kind kind, int ball, int partner,
                                           double normal_speed, double dissipation)
{
    struct mill_impact impact = {.time = time,
                                 .kind = kind,
                                 .ball = ball,
                                 .partner = partner,
                                 .partner_species = kind == MILL_BALL_BALL ? 0 : -1,
                                 .position = {0, 0.01, 0.02},
                                 .normal_speed = normal_speed,
                                 .tangential_speed = 2 * normal_speed,
                                 .dissipation = dissipation};
    return impact;
}

/* Takes the samples due up to `time`. */
static inline void fixture_wait(struct fixture *f, double time)
{
    struct mill_observer *observer = &f->tally->observer;
    while (observer->next <= time) {
        const double before = observer->next;
        f->last = observer->type->sample(observer, &f->world, before - f->world.base, NULL);
        if ((f->last != MILL_OK && f->last != MILL_ENDED) || !(observer->next > before))
            ck_abort_msg("a sample failed or did not move on from %g", before);
    }
}

/* The impact happens: samples before it, books, impact. */
static inline void fixture_play(struct fixture *f, struct mill_impact impact)
{
    struct mill_observer *observer = &f->tally->observer;
    fixture_wait(f, impact.time);
    f->world.account.collisions[impact.kind]++;
    f->world.account.dissipation[impact.kind] += impact.dissipation;
    const enum mill_status status = observer->type->impact(observer, &impact, NULL);
    if (status == MILL_FAILED)
        ck_abort_msg("an impact failed");
    f->last = status == MILL_ENDED ? status : f->last;
}

/* The run ends at `time`. */
static inline void fixture_finish(struct fixture *f, double time)
{
    fixture_wait(f, time);
    ck_assert_int_eq(
        mill_tally_results_make(f->tally, &f->world, time - f->world.base, &f->results, NULL),
        MILL_OK);
}

static inline void fixture_free(struct fixture *f)
{
    mill_tally_results_free(f->results);
    if (f->tally)
        mill_observers_free_one(&f->tally->observer);
    f->results = NULL;
    f->tally = NULL;
}

static inline uint64_t impacts_of(const struct fixture *f, int row)
{
    return mill_spectrum_total(&f->results->sums.impacts[row].normal, 0).count;
}

/* Work of the rotor */
static inline void fixture_work(struct fixture *f, double work)
{
    f->world.account.work += work;
    f->world.account.motion[0].work += work;
}

static inline uint64_t strikes_of(const struct fixture *f, int row)
{
    return mill_spectrum_total(&f->results->sums.strikes[row].normal, 0).count;
}

static inline double random_share(uint64_t *state)
{
    uint64_t z = *state += UINT64_C(0x9E3779B97F4A7C15);
    z = (z ^ z >> 30) * UINT64_C(0xBF58476D1CE4E5B9);
    z = (z ^ z >> 27) * UINT64_C(0x94D049BB133111EB);
    return (double)((z ^ z >> 31) >> 11) * 0x1p-53;
}

#endif
