/* A mill with everything at once: a jar that turns on a sun wheel that shakes, a pin on the jar,
 * and a paddle that swings in it. It is run with all observers, into a file. */
#ifndef PLANETARY_H
#define PLANETARY_H

#include "mills.h"
#include "millsim/sim.h"
#include "output_fixture.h"

#include "observe/observers.h"
#include "observe/tally.h"

enum { SHAKE, SUN, JAR, PADDLE, PLANETARY_MOTIONS };
enum { BALL_JAR = MILL_KINDS, BALL_PIN, BALL_PADDLE, PLANETARY_KINDS };

enum { PLANETARY_BALLS = 60 };

#define PERIOD 0.2  /* [s] of all motions together */
#define WINDOW 0.65 /* [s] */

struct planetary {
    char path[64];
    struct mill_observe asked;
    struct mill_world *world;
    struct mill_sim *sim;
    struct mill_observers observers;
    struct mill_h5 *file;
};

static inline struct mill_world *planetary_world(void)
{
    static const char *const kind[] = {"jar", "pin", "paddle"};
    static const struct mill_shift shake = {.amplitude = {0, 0, 1e-3}, .frequency = 20};
    static const struct mill_turn sun = {.axis = {0, 0, 1}, .speed = 2 * PI * 5},
                                  jar = {.centre = {0.1, 0, 0},
                                         .axis = {0, 0, 1},
                                         .speed = -2 * PI * 5,
                                         .angle = 0.3};
    static const struct mill_swing paddle = {
        .centre = {0.1, 0, 0}, .axis = {0, 0, 1}, .amplitude = 0.5, .frequency = 20};
    static const struct mill_setup_motion motion[] = {
        {.type = &mill_shift_type, .form = &shake, .on = MILL_STILL, .name = "shake"},
        {.type = &mill_turn_type, .form = &sun, .on = SHAKE, .name = "sun"},
        {.type = &mill_turn_type, .form = &jar, .on = SUN, .name = "jar"},
        {.type = &mill_swing_type, .form = &paddle, .on = JAR, .name = "paddle"}};
#define UPRIGHT .x = {1, 0, 0}, .y = {0, 1, 0}, .z = { 0, 0, 1 }
    static const struct mill_body
        can = {.inside = true, .centre = {0.1, 0, 0}, UPRIGHT, .radius = 0.03, .length = 0.04},
        pin = {.centre = {0.123, 0, 0}, UPRIGHT, .radius = 0.004, .length = 0.03},
        plate = {.centre = {0.0835, 0, 0}, UPRIGHT, .size = {0.017, 0.003, 0.03}};
    static const struct mill_setup_surface surface[] = {
        {.solid = &mill_round_cylinder_solid, .body = &can, .motion = JAR, .kind = BALL_JAR},
        {.solid = &mill_round_cylinder_solid, .body = &pin, .motion = JAR, .kind = BALL_PIN},
        {.solid = &mill_box_solid, .body = &plate, .motion = PADDLE, .kind = BALL_PADDLE}};
    static const struct mill_setup_balls balls[] = {
        {.name = "steel", .diameter = 0.004, .density = STEEL, .count = PLANETARY_BALLS}};
    struct mill_setup s = {.gravity = {0, 0, -9.81},
                           .motions = PLANETARY_MOTIONS,
                           .motion = motion,
                           .rotor = MILL_STILL,
                           .surfaces = 3,
                           .surface = surface,
                           .species = 1,
                           .balls = balls,
                           .seed = 1,
                           .kinds = 3,
                           .kind = kind,
                           .rebound_floor = 5e-3};
    struct mill_world *world;
    for (int k = 0; k < PLANETARY_KINDS; k++)
        s.law[k] = (struct mill_law){0.9, 0.2, 0.4};
    const enum mill_fault_code code = mill_start_world(&s, NULL, &world, NULL);
    ck_assert_msg(code == MILL_FAULT_NONE, "%s", mill_setup_fault_text(code));
    return world;
}

/* All of it but the run; how: into a file of its own, or one that is gone on with */
static inline void planetary_open(struct planetary *p, enum mill_h5_open how)
{
    struct mill_error error = {""};
    snprintf(p->path, sizeof p->path, "/tmp/millsim_planetary_%ld.h5", (long)getpid());
    p->asked = (struct mill_observe){.end = 0.75,
                                     .sample_from = 0.1,
                                     .strike_window = 1e-5,
                                     .frames = 0.05,
                                     .series = 0.01,
                                     .log_impacts = true};
    p->world = planetary_world();
    ck_assert_int_eq(mill_sim_create(p->world, &p->sim, &error), MILL_OK);
    ck_assert_int_eq(mill_observers_create(&p->asked, p->world, &p->observers, &error), MILL_OK);
    ck_assert_int_eq(mill_h5_create(p->path, how, &p->file, &error), MILL_OK);
}

static inline void planetary_run(struct planetary *p, double until)
{
    struct mill_error error = {""};
    const enum mill_status status = mill_sim_run(p->sim, until, UINT64_MAX, NULL, &error);
    ck_assert_msg(status == MILL_OK, "%s", error.text);
}

/* The results into the file, which is finished. */
static inline void planetary_finish(struct planetary *p)
{
    struct mill_error error = {""};
    struct mill_tally_results *results = NULL;
    struct mill_sink_file to;
    mill_sink_file(&to, p->file, "");
    ck_assert_int_eq(mill_observers_results(&p->observers, p->world, mill_sim_local_time(p->sim),
                                            &to.sink, &results, &error),
                     MILL_OK);
    mill_tally_results_free(results);
    ck_assert(mill_observers_finish(&p->observers, p->world, NULL));
    ck_assert_int_eq(mill_h5_close(p->file, &error), MILL_OK);
}

static inline void planetary_free(struct planetary *p)
{
    mill_observers_free(&p->observers);
    mill_sim_free(p->sim);
    mill_world_free(p->world);
}

#endif
