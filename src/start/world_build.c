/* Builds the world of a deck: species, surfaces, start positions. It stands above what it calls
 * (fill and start need the world's state), which is why it is not in world.c. */
#include "base/memory.h"
#include "geometry/walls.h"
#include "millsim/world.h"
#include "start/fill.h"
#include "start/start.h"

#include <stdlib.h>
#include <string.h>

static enum mill_status make_species(const struct mill_deck *deck, struct mill_world *w,
                                     struct mill_error *error)
{
    int64_t balls = 0;
    for (int k = 0; k < deck->kinds; k++)
        balls += deck->balls[k].count;
    w->balls = (int32_t)balls;
    w->species_count = deck->kinds;
    w->species = calloc((size_t)deck->kinds, sizeof *w->species);
    w->spin = mill_memory_get((size_t)balls, sizeof *w->spin);
    w->ball = mill_memory_get((size_t)balls, sizeof *w->ball);
    if (!w->species || !w->spin || !w->ball)
        return mill_error_set(error, MILL_FAILED, "out of memory for %lld balls", (long long)balls);
    int32_t i = 0;
    for (int k = 0; k < deck->kinds; k++) {
        const struct mill_deck_balls *kind = &deck->balls[k];
        struct mill_species *s = &w->species[k];
        memcpy(s->name, kind->name, sizeof s->name);
        s->radius = 0.5 * kind->diameter;
        s->mass = kind->density * (4.0 / 3.0) * MILL_PI * s->radius * s->radius * s->radius;
        s->inertia = 0.4 * s->mass * s->radius * s->radius;
        for (long n = 0; n < kind->count; n++)
            w->ball[i++].species = k;
    }
    return MILL_OK;
}

enum mill_status mill_world_create(const struct mill_deck *deck, struct mill_world **world,
                                   struct mill_error *error)
{
    return mill_world_create_watched(deck, NULL, world, error);
}

enum mill_status mill_world_create_watched(const struct mill_deck *deck,
                                           const struct mill_start_watch *watch,
                                           struct mill_world **world, struct mill_error *error)
{
    struct mill_world *w = calloc(1, sizeof *w);
    *world = NULL;
    if (!w)
        return mill_error_set(error, MILL_FAILED, "out of memory");
    w->g = deck->gravity;
    w->drum_radius = mill_deck_drum_reach(deck);
    w->drum_length = deck->drum_length;
    w->rotor_speed = deck->rotor ? deck->rotor_speed : 0.0;
    w->turn = deck->rotor ? fmod(deck->rotor_angle, 2.0 * MILL_PI) : 0.0;
    memcpy(w->law, deck->law, sizeof w->law);
    w->rebound_floor = deck->rebound_floor;
    enum mill_status status = make_species(deck, w, error);
    if (status == MILL_OK)
        status = mill_walls_create(deck, &w->counts.quartics, &w->shape, &w->shapes, error);
    if (status == MILL_OK)
        status = deck->start ? mill_start_read(deck, watch, w, error)
                             : mill_fill_random(deck, watch, w, error);
    if (status != MILL_OK) {
        mill_world_free(w);
        return status;
    }
    w->start = mill_world_energy(w, 0.0);
    *world = w;
    return MILL_OK;
}
