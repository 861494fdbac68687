/* The kinds of balls, and how many balls of each kind there are: given, or computed from a mass or
 * a filling; the mass of the powder, if it is given as a share of theirs. */
#include "deck/deck_private.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define BULK_SOLID 0.6 /* solid part of balls at rest that lie at random, with their voids */

/* Converts what is given instead of the number of balls to that number. volume: [m^3] the free one;
 * < 0: not known yet */
static enum mill_status count_balls(const struct mill_deck *deck, struct mill_deck_balls *balls,
                                    double *volume)
{
    const double d = balls->diameter, one = MILL_PI / 6.0 * d * d * d;
    double given = balls->mass / balls->density / one;
    balls->given = "mass";
    if (balls->fill > 0.0) {
        balls->given = "fill";
        given = balls->fill * mill_deck_mill_volume(deck) / one;
    } else if (balls->bulk_fill > 0.0) {
        enum mill_status status = MILL_OK;
        balls->given = "bulk_fill";
        if (*volume < 0.0)
            status = mill_deck_setup_free_volume(deck, volume, deck->text.reading->error);
        if (status != MILL_OK)
            return status;
        given = BULK_SOLID * balls->bulk_fill * *volume / one;
    } else if (balls->mass == 0.0) {
        balls->given = "count";
        return MILL_OK;
    }
    const double count = round(given);
    if (!(count >= 1.0 && count <= MILL_DECK_MOST_BALLS))
        return mill_deck_wrong(&deck->text, balls->section, balls->given,
                               "gives %.3g balls of %g m; expected 1 to %d", given, d,
                               MILL_DECK_MOST_BALLS);
    balls->count = (long)count;
    return MILL_OK;
}

enum mill_status mill_deck_balls_list(struct mill_deck *deck)
{
    const struct mill_deck_section *s = NULL;
    struct mill_deck_mill *mill = &deck->mill;
    double volume = -1.0;
    mill->balls = calloc((size_t)deck->text.sections, sizeof *mill->balls);
    if (!mill->balls)
        return mill_deck_memory(&deck->text);
    while ((s = mill_deck_next_balls(&deck->text, s))) {
        struct mill_deck_balls *balls = s->form;
        balls->section = s->title;
        balls->name = strchr(s->title, '.') ? strchr(s->title, '.') + 1 : s->title;
        enum mill_status status = mill_deck_materials_density(deck, balls);
        if (status == MILL_OK)
            status = count_balls(deck, balls, &volume);
        if (status != MILL_OK)
            return status;
        mill->balls[mill->kinds++] = *balls;
        mill->all += balls->count;
    }
    return mill_deck_files_find(&deck->text, "balls", "start", &deck->given.start);
}

/* Converts the ratio of the masses of balls and powder to a mass of powder, and finds its table. */
enum mill_status mill_deck_balls_powder(struct mill_deck *deck)
{
    struct mill_deck_powder *powder = &deck->given.powder;
    double mass = 0.0;
    for (int k = 0; k < deck->mill.kinds; k++)
        mass += (double)deck->mill.balls[k].count * deck->mill.balls[k].density * MILL_PI / 6.0 *
                pow(deck->mill.balls[k].diameter, 3);
    if (powder->ball_to_powder > 0.0)
        powder->mass = mass / powder->ball_to_powder;
    return mill_deck_files_find(&deck->text, "powder", "table", &powder->table);
}
