/* The kinds of balls, and how many balls of each kind there are: given, or computed from a mass or
 * a filling; the mass of the powder, if it is given as a share of theirs. */
#include "deck/deck_private.h"

#define BULK_SOLID 0.6 /* solid part of balls at rest that lie at random, with their voids */

/* Converts what is given instead of the number of balls to that number. volume: [m^3] the free one;
 * < 0: not known yet */
static bool count_balls(const struct mill_deck *deck, struct mill_deck_balls *balls, double *volume)
{
    const double d = balls->diameter, one = MILL_PI / 6.0 * d * d * d;
    double given = (double)balls->count;
    if (balls->fill > 0.0) {
        balls->given = "fill";
        given = balls->fill * mill_deck_checks_volume(deck) / one;
    } else if (balls->bulk_fill > 0.0) {
        balls->given = "bulk_fill";
        if (*volume < 0.0 && !mill_deck_setup_free_volume(deck, volume))
            return false;
        given = BULK_SOLID * balls->bulk_fill * *volume / one;
    } else if (balls->mass > 0.0) {
        balls->given = "mass";
        given = balls->mass / balls->density / one;
    } else {
        balls->given = "count";
    }
    if (!(given >= 0.5 && given < MILL_DECK_MOST_BALLS + 0.5))
        return mill_deck_wrong(&deck->text, balls->section, balls->given,
                               "gives %.3g balls of %g m; expected 1 to %d", given, d,
                               MILL_DECK_MOST_BALLS);
    balls->count = lround(given);
    return true;
}

/* Sets the density of balls whose section gives only a material. */
static bool find_density(const struct mill_deck *deck, struct mill_deck_balls *balls)
{
    struct mill_deck_found found = {.is = {.density = 0.0}};
    if (balls->material &&
        !mill_deck_materials_find(deck, balls->section, "material", balls->material, &found))
        return false;
    if (!(balls->density > 0.0))
        balls->density = found.is.density;
    return balls->density > 0.0 ||
           mill_deck_wrong(&deck->text, balls->section, "material",
                           "the density of '%s' is not known: give 'density'", found.name);
}

void mill_deck_balls_list(struct mill_deck *deck)
{
    const struct mill_deck_section *s = NULL;
    struct mill_deck_mill *mill = &deck->mill;
    size_t most = 1;
    double volume = -1.0;
    while ((s = mill_deck_next_balls(&deck->text, s)))
        most++;
    struct mill_setup_balls *all = mill_deck_keep(&deck->text, calloc(most, sizeof *all));
    mill->balls = mill_deck_keep(&deck->text, calloc(most, sizeof *mill->balls));
    deck->setup.balls = all;
    while (all && mill->balls && (s = mill_deck_next_balls(&deck->text, s))) {
        struct mill_deck_balls *balls = s->form;
        balls->section = s->title;
        if (!find_density(deck, balls) || !count_balls(deck, balls, &volume))
            return;
        mill->all += balls->count;
        all[deck->setup.species] = (struct mill_setup_balls){.name = mill_deck_name(s),
                                                             .diameter = balls->diameter,
                                                             .density = balls->density,
                                                             .count = (int32_t)balls->count};
        mill->balls[deck->setup.species++] = *balls;
    }
    mill_deck_files_find(&deck->text, "balls", "start", &deck->given.start);
}

/* Converts the ratio of the masses of balls and powder to a mass of powder, and finds its table. */
void mill_deck_balls_powder(struct mill_deck *deck)
{
    struct mill_deck_powder *powder = &deck->given.powder;
    double mass = 0.0;
    for (int k = 0; k < deck->setup.species; k++)
        mass += (double)deck->mill.balls[k].count * deck->mill.balls[k].density * MILL_PI / 6.0 *
                pow(deck->mill.balls[k].diameter, 3);
    if (powder->ball_to_powder > 0.0)
        powder->mass = mass / powder->ball_to_powder;
    mill_deck_files_find(&deck->text, "powder", "table", &powder->table);
}
