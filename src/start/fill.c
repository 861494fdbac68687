/* First positions: random, without overlap. fill_pack.c does the packing; here stand what it starts
 * from, the speeds, and the answer when the balls do not fit. Everything follows from the seed. */
#include "start/fill.h"

#include "start/fill_private.h"

#include <stdlib.h>
#include <string.h>

#define LIKELY 0.55 /* of the room: what an answer tries at first; it packs in seconds */

static double solid_volume(const struct mill_world *w)
{
    double v = 0.0;
    for (int32_t i = 0; i < w->balls; i++) {
        const double a = w->species[w->ball[i].species].radius;
        v += (4.0 / 3.0) * MILL_PI * a * a * a;
    }
    return v;
}

static enum mill_status pack(struct mill_world *w, const struct mill_fill_room *room,
                             struct mill_random *random, unsigned long seed,
                             const struct mill_start_watch *watch)
{
    mill_random_seed(random, seed);
    return mill_fill_pack(w, room, random, solid_volume(w) / room->volume, watch);
}

/* Gives `fewer` this part of the balls of each kind, rounded down but at least one, in the order
 * that a setup with these counts would give them. count: of each species, set to what is left. */
static void thin_out(const struct mill_world *w, double part, struct mill_world *fewer,
                     int32_t *count)
{
    memset(count, 0, sizeof *count * (size_t)w->species_count);
    for (int32_t i = 0; i < w->balls; i++)
        count[w->ball[i].species]++;
    for (int k = 0; k < w->species_count; k++)
        count[k] = (int32_t)fmax(floor(part * (double)count[k]), 1.0);
    fewer->balls = 0;
    for (int32_t i = 0, in_kind = 0; i < w->balls; i++) {
        const int32_t species = w->ball[i].species;
        in_kind = i > 0 && w->ball[i - 1].species == species ? in_kind + 1 : 0;
        if (in_kind < count[species])
            fewer->ball[fewer->balls++].species = species;
    }
}

/* They do not fit: finds a number that does, by packing fewer of the same mixture exactly as a
 * setup that asks for them would. */
static enum mill_fault_code
find_what_fits(const struct mill_setup *setup, const struct mill_world *w,
               const struct mill_fill_room *room, struct mill_random *random,
               const struct mill_start_watch *watch, struct mill_fault *fault)
{
    const double fraction = solid_volume(w) / room->volume;
    struct mill_world fewer = *w;
    fewer.ball = calloc((size_t)w->balls, sizeof *fewer.ball);
    int32_t *count = calloc((size_t)w->species_count, sizeof *count);
    enum mill_status status = fewer.ball && count ? MILL_BAD_DECK : MILL_FAILED;
    int32_t tried = w->balls;
    double part = fmin(0.97, LIKELY / fraction);
    while (status == MILL_BAD_DECK && tried > w->species_count) {
        thin_out(w, part, &fewer, count);
        if (fewer.balls < tried) {
            tried = fewer.balls;
            status = pack(&fewer, room, random, setup->seed, watch);
        }
        part *= 0.95;
    }
    fault->code = status == MILL_FAILED ? MILL_FAULT_MEMORY : MILL_FAULT_NO_ROOM;
    fault->amount = fraction;
    for (int k = 0; status == MILL_OK && k < w->species_count && k < MILL_FAULT_SPECIES; k++)
        fault->fits[k] = count[k];
    free(fewer.ball);
    free(count);
    return fault->code;
}

enum mill_fault_code mill_fill_random(const struct mill_setup *setup,
                                      const struct mill_start_watch *watch,
                                      struct mill_world *world, struct mill_fault *fault)
{
    struct mill_fill_room room;
    struct mill_random random;
    double widest = 0.0;
    for (int k = 0; k < world->species_count; k++)
        widest = fmax(widest, world->species[k].radius);
    if (!mill_fill_room_init(&room, world, widest))
        return fault->code = MILL_FAULT_MEMORY;
    const enum mill_status status = pack(world, &room, &random, setup->seed, watch);
    if (status == MILL_FAILED)
        fault->code = MILL_FAULT_MEMORY;
    else if (status != MILL_OK)
        find_what_fits(setup, world, &room, &random, watch, fault);
    mill_fill_room_free(&room);
    if (fault->code != MILL_FAULT_NONE)
        return fault->code;
    for (int32_t i = 0; i < world->balls && setup->speed > 0.0; i++)
        world->ball[i].v = vec3_scale(mill_random_direction(&random), setup->speed);
    return MILL_FAULT_NONE;
}
