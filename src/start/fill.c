/* First positions: random, without overlap. fill_pack.c does the packing; here stand what it starts
 * from, the speeds, and the answer when the balls do not fit. Everything follows from the seed. */
#include "start/fill.h"

#include "start/fill_private.h"

#include <gsl/gsl_randist.h>
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

static enum mill_status pack(struct mill_world *w, const struct mill_fill_room *room, gsl_rng *rng,
                             unsigned long seed, const struct mill_start_watch *watch)
{
    gsl_rng_set(rng, seed);
    return mill_fill_pack(w, room, rng, solid_volume(w) / room->volume, watch);
}

/* Gives `fewer` this part of the balls of each kind, rounded down but at least one, in the order
 * that a deck with these counts would give them. count: of each species, set to what is left. */
static void thin_out(const struct mill_world *w, double part, struct mill_world *fewer, long *count)
{
    memset(count, 0, sizeof *count * (size_t)w->species_count);
    for (int32_t i = 0; i < w->balls; i++)
        count[w->ball[i].species]++;
    for (int k = 0; k < w->species_count; k++)
        count[k] = (long)fmax(floor(part * (double)count[k]), 1.0);
    fewer->balls = 0;
    for (int32_t i = 0, in_kind = 0; i < w->balls; i++) {
        const int32_t species = w->ball[i].species;
        in_kind = i > 0 && w->ball[i - 1].species == species ? in_kind + 1 : 0;
        if (in_kind < count[species])
            fewer->ball[fewer->balls++].species = species;
    }
}

/* "384 big, 3072 small" */
static void name_counts(const struct mill_deck *deck, const long *count, char *text, size_t size)
{
    size_t used = 0;
    for (int k = 0; k < deck->kinds && used < size; k++)
        used += (size_t)snprintf(text + used, size - used, "%s%ld %s", k ? ", " : "", count[k],
                                 deck->balls[k].name);
}

static enum mill_status refuse(const struct mill_deck *deck, const struct mill_world *w,
                               double fraction, const long *count, struct mill_error *error)
{
    char section[MILL_NAME_LENGTH + 8] = "balls", counts[512];
    const bool mixture = deck->kinds > 1;
    if (mixture || strcmp(deck->balls[0].name, "balls") != 0)
        snprintf(section, sizeof section, "balls.%s", deck->balls[0].name);
    if (!count)
        return mill_deck_fault(deck, error, section, "count",
                               "not a single ball%s fits: make balls or rotor smaller",
                               mixture ? " of each kind" : "");
    name_counts(deck, count, counts, sizeof counts);
    if (!mixture)
        snprintf(counts, sizeof counts, "%ld", count[0]);
    return mill_deck_fault(deck, error, section, "count",
                           "%ld balls do not fit (solid fraction %.3f of the free volume); "
                           "%s do",
                           (long)w->balls, fraction, counts);
}

/* They do not fit: finds a number that does, by packing fewer of the same mixture exactly as a deck
 * that asks for them would. */
static enum mill_status say_what_fits(const struct mill_deck *deck, const struct mill_world *w,
                                      const struct mill_fill_room *room, gsl_rng *rng,
                                      const struct mill_start_watch *watch,
                                      struct mill_error *error)
{
    const double fraction = solid_volume(w) / room->volume;
    struct mill_world fewer = *w;
    fewer.ball = calloc((size_t)w->balls, sizeof *fewer.ball);
    long *count = calloc((size_t)w->species_count, sizeof *count);
    enum mill_status status = fewer.ball && count ? MILL_BAD_DECK : MILL_FAILED;
    int32_t tried = w->balls;
    double part = fmin(0.97, LIKELY / fraction);
    while (status == MILL_BAD_DECK && tried > w->species_count) {
        thin_out(w, part, &fewer, count);
        if (fewer.balls < tried) {
            tried = fewer.balls;
            status = pack(&fewer, room, rng, deck->seed, watch);
        }
        part *= 0.95;
    }
    if (status == MILL_FAILED)
        status = mill_error_set(error, status, "out of memory for the start positions");
    else
        status = refuse(deck, w, fraction, status == MILL_OK ? count : NULL, error);
    free(fewer.ball);
    free(count);
    return status;
}

static enum mill_status fill(const struct mill_deck *deck, struct mill_world *w,
                             const struct mill_fill_room *room, gsl_rng *rng,
                             const struct mill_start_watch *watch, struct mill_error *error)
{
    const enum mill_status status = pack(w, room, rng, deck->seed, watch);
    if (status == MILL_FAILED)
        return mill_error_set(error, status, "out of memory for %ld start positions",
                              (long)w->balls);
    if (status != MILL_OK)
        return say_what_fits(deck, w, room, rng, watch, error);
    for (int32_t i = 0; i < w->balls; i++) {
        vec3 u = {0.0, 0.0, 0.0};
        if (deck->speed > 0.0)
            gsl_ran_dir_3d(rng, &u.x, &u.y, &u.z);
        w->ball[i].v = vec3_scale(u, deck->speed);
    }
    return MILL_OK;
}

enum mill_status mill_fill_random(const struct mill_deck *deck,
                                  const struct mill_start_watch *watch, struct mill_world *world,
                                  struct mill_error *error)
{
    struct mill_fill_room room;
    double widest = 0.0;
    for (int k = 0; k < world->species_count; k++)
        widest = fmax(widest, world->species[k].radius);
    gsl_rng *rng = gsl_rng_alloc(gsl_rng_mt19937);
    enum mill_status status = MILL_FAILED;
    if (rng && mill_fill_room_init(&room, world, widest)) {
        status = fill(deck, world, &room, rng, watch, error);
        mill_fill_room_free(&room);
    } else {
        mill_error_set(error, status, "out of memory for the start positions");
    }
    if (rng)
        gsl_rng_free(rng);
    return status;
}
