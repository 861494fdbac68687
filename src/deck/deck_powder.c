/* The powder of a deck: its mass from the ratio to that of the balls, and which keys need others.
 */
#include "deck/deck_private.h"

#include <math.h>

/* Converts the ratio of the masses of balls and powder to a mass of powder, and finds its table. */
enum mill_status mill_deck_powder_list(struct mill_deck *deck, struct mill_error *error)
{
    struct mill_deck_powder *powder = &deck->given.powder;
    double mass = 0.0;
    for (int k = 0; k < deck->mill.kinds; k++)
        mass += (double)deck->mill.balls[k].count * deck->mill.balls[k].density * MILL_PI / 6.0 *
                pow(deck->mill.balls[k].diameter, 3);
    if (powder->ball_to_powder > 0.0)
        powder->mass = mass / powder->ball_to_powder;
    return powder->table ? mill_deck_files_find(&deck->text, "powder", "table", powder->table,
                                                &powder->table, error)
                         : MILL_OK;
}

/* Keys that other keys of [powder] need */
enum mill_status mill_deck_powder_check(struct mill_deck *deck, struct mill_error *error)
{
    const struct mill_deck_powder *p = &deck->given.powder;
    const bool vogel = p->law == MILL_DECK_VOGEL;
    const struct {
        bool wrong;
        const char *key, *why;
    } list[] = {
        {(p->law == MILL_DECK_POWER || p->law == MILL_DECK_THRESHOLD) && p->coefficient == 0.0,
         "coefficient", "this law needs the coefficient c of each impact"},
        {p->law == MILL_DECK_POWER && p->exponent == 0.0, "exponent",
         "the power law needs its exponent n"},
        {vogel && p->strength == 0.0, "strength", "the law needs the material's f_Mat"},
        {vogel && p->size == 0.0, "size", "the law needs the diameter of a particle"},
        {p->law == MILL_DECK_RATES && !p->table, "table",
         "the law needs a file with a row 'E k' for each energy"},
        {p->capture == MILL_DECK_LAYER && p->layer == 0.0, "layer",
         "this capture needs the thickness of the powder on a surface"},
    };
    for (size_t i = 0; p->mass > 0.0 && i < sizeof list / sizeof *list; i++)
        if (list[i].wrong)
            return mill_deck_fault(&deck->text, error, "powder", list[i].key, "%s", list[i].why);
    return MILL_OK;
}
