/* A mill from plain numbers, without a deck or a file: counts its hard impacts for half a second.
 * After `make install`:
 *     cc -std=c99 impacts.c $(pkg-config --cflags --libs millsim) -o impacts && ./impacts */
#include <millsim/sim.h>
#include <millsim/start.h>
#include <stdio.h>

struct counter {
    struct mill_observer base; /* first: the event loop only knows this member */
    unsigned long all, hard;
};

static enum mill_status count(struct mill_observer *self, const struct mill_impact *impact,
                              struct mill_error *error)
{
    struct counter *counter = (struct counter *)self;
    (void)error;
    counter->all++;
    counter->hard += impact->normal_speed >= 1.0;
    return MILL_OK;
}

int main(void)
{
    static const struct mill_observer_type type = {.name = "counter", .impact = count};
    struct counter counter = {.base = {.type = &type, .next = INFINITY}};
    const struct mill_turn turn = {.axis = {1.0, 0.0, 0.0}, .speed = 100.0};
    const struct mill_setup_motion rotor = {
        .type = &mill_turn_type, .form = &turn, .on = MILL_STILL};
    const struct mill_blade plate = {.tip_radius = 0.034, .width = 0.01, .thickness = 0.005};
    const struct mill_body shaft = mill_setup_shaft(0.01, 0.05), blade = mill_setup_blade(&plate);
    const struct mill_setup_surface surface[] = {
        {.solid = &mill_prism_solid, .body = &shaft, .number = -1, .kind = MILL_BALL_SHAFT},
        {.solid = &mill_box_solid, .body = &blade, .kind = MILL_BALL_BLADE},
    };
    const struct mill_setup_balls balls = {"steel", 5e-3, 7800.0, 300};
    struct mill_setup setup = {.gravity = {0.0, 0.0, -9.81},
                               .drum = {.radius = 0.04, .length = 0.05},
                               .motions = 1,
                               .motion = &rotor,
                               .surfaces = 2,
                               .surface = surface,
                               .species = 1,
                               .balls = &balls,
                               .seed = 1,
                               .rebound_floor = 0.005};
    for (int kind = 0; kind < MILL_KINDS; kind++)
        setup.law[kind] = (struct mill_law){.restitution = 0.8, .friction = 0.3};

    struct mill_world *world;
    struct mill_fault fault;
    struct mill_sim *sim = NULL;
    struct mill_error error = {""};
    if (mill_start_world(&setup, NULL, &world, &fault) != MILL_FAULT_NONE)
        return fprintf(stderr, "impacts: %s\n", mill_setup_fault_text(fault.code)), 1;
    if (mill_sim_create(world, &sim, &error) != MILL_OK ||
        mill_sim_observe(sim, &counter.base) != MILL_OK ||
        mill_sim_run(sim, 0.5, UINT64_MAX, NULL, &error) != MILL_OK)
        return fprintf(stderr, "impacts: %s\n", error.text), 1;
    printf("%.3g s: %lu impacts, %lu of them at 1 m/s or more; the rotor has done %.3f J\n",
           mill_sim_time(sim), counter.all, counter.hard, world->account.work);
    mill_sim_free(sim);
    mill_world_free(world);
    return 0;
}
