/* What no single key can tell: do times fit together, do balls, shaft and blades fit into the drum?
 * A blade is a box from the axis to tip_radius, turned by its pitch about its radial mid-line, so
 * it is (w |cos p| + t |sin p|) long along the axis and (w |sin p| + t |cos p|) wide around it, and
 * its corners reach further out than tip_radius. */
#include "deck/deck_private.h"

#include "base/elementary.h"
#include "base/profile.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static const double most_samples = 1e8;
static const double rounding =
    1e-12; /* of the drum's length: blades may just touch the end walls */
static const double least_diameter = 1e-9; /* [m] */
static const double snug = 1e-11; /* of the drum's reach: wider than what wavy.c takes for equal */
static const double densest =
    0.7404804896930611; /* MILL_PI / sqrt(18): no packing of equal balls is denser */

static enum mill_status check_times(const struct mill_deck *deck, struct mill_error *error)
{
    if (deck->sample_from >= deck->time)
        return mill_deck_fault(deck, error, "run", "sample_from",
                               "must be before the end of the run, %g s", deck->time);
    if (deck->max_collisions != floor(deck->max_collisions))
        return mill_deck_fault(deck, error, "run", "max_collisions",
                               "must be a whole number, got %.15g", deck->max_collisions);
    if (deck->time / deck->series > most_samples)
        return mill_deck_fault(deck, error, "output", "series",
                               "too short: more than 1e8 samples until %g s", deck->time);
    if (deck->frames > 0.0 && deck->time / deck->frames > most_samples)
        return mill_deck_fault(deck, error, "output", "frames",
                               "too short: more than 1e8 frames until %g s", deck->time);
    return MILL_OK;
}

static struct mill_profile profile_of(const struct mill_deck *deck)
{
    return mill_profile_make((int)deck->buckles, deck->drum_radius, deck->buckle_height, 0.0);
}

/* Of the drum, across its axis [m^2] */
static double section_area(const struct mill_deck *deck)
{
    if (!deck->wavy)
        return MILL_PI * deck->drum_radius * deck->drum_radius;
    const struct mill_profile profile = profile_of(deck);
    return mill_profile_area(&profile);
}

/* Buckles must leave each other room. Height and number are bounded by each other, so the message
 * names the height: the number is more often what matters. */
static enum mill_status check_profile(const struct mill_deck *deck, struct mill_error *error)
{
    const struct mill_profile profile = profile_of(deck);
    if (mill_profile_is_sound(&profile))
        return MILL_OK;
    return mill_deck_fault(deck, error, "drum", "buckle_height",
                           "%ld buckles on a radius of %g m must be lower than %.4g m, or "
                           "neighbouring ones run into each other; got %g m",
                           deck->buckles, deck->drum_radius,
                           mill_profile_highest((int)deck->buckles, deck->drum_radius),
                           deck->buckle_height);
}

/* "balls" or "balls.NAME" */
static void name_kind(const struct mill_deck *deck, int kind, char title[80])
{
    const bool mixture = mill_deck_text_section(deck->text, DECK_BALLS_NAME, NULL) != NULL;
    snprintf(title, 80, "%s%s", mixture ? "balls." : "balls",
             mixture ? deck->balls[kind].name : "");
}

static enum mill_status check_sizes(const struct mill_deck *deck, struct mill_error *error)
{
    const double bore = mill_deck_drum_bore(deck);
    const char *between = deck->wavy ? " where its buckles come nearest to the axis" : "";
    char title[80];
    for (int k = 0; k < deck->kinds; k++) {
        const double d = deck->balls[k].diameter;
        name_kind(deck, k, title);
        if (d < least_diameter)
            return mill_deck_fault(deck, error, title, "diameter",
                                   "must be at least %g m, got %g m", least_diameter, d);
        /* one that just fits has no way to go: it would hit both sides for ever */
        if (d >= 2.0 * bore)
            return mill_deck_fault(deck, error, title, "diameter",
                                   "a ball of %g m does not fit into a drum of radius %g m%s", d,
                                   bore, between);
        /* it would touch all of an arc at once */
        if (deck->wavy && deck->buckle_height > 0.0 &&
            fabs(d - 2.0 * profile_of(deck).arc) <= snug * mill_deck_drum_reach(deck))
            return mill_deck_fault(deck, error, title, "diameter",
                                   "a ball of %g m is just as wide as a buckle of the drum, and "
                                   "stuck there: make it a little smaller or larger",
                                   d);
        if (d >= deck->drum_length)
            return mill_deck_fault(deck, error, title, "diameter",
                                   "a ball of %g m does not fit into a drum %g m long", d,
                                   deck->drum_length);
        if (deck->rotor && d >= bore - deck->shaft_radius)
            return mill_deck_fault(deck, error, title, "diameter",
                                   "a ball of %g m does not fit between the shaft and the drum, "
                                   "%g m apart%s",
                                   d, bore - deck->shaft_radius, between);
    }
    return MILL_OK;
}

static enum mill_status check_amount(const struct mill_deck *deck, struct mill_error *error)
{
    const double shaft = deck->rotor ? deck->shaft_radius : 0.0;
    const double room = (section_area(deck) - MILL_PI * shaft * shaft) * deck->drum_length;
    double volume = 0.0;
    long total = 0;
    char title[80];
    for (int k = 0; k < deck->kinds; k++) {
        const double d = deck->balls[k].diameter;
        const char *amount = deck->balls[k].fill > 0 ? "fill" : "count";
        name_kind(deck, k, title);
        total += deck->balls[k].count;
        if (total > MILL_DECK_MOST_BALLS)
            return mill_deck_fault(deck, error, title, amount, "more than %d balls in all",
                                   MILL_DECK_MOST_BALLS);
        volume += (double)deck->balls[k].count * MILL_PI / 6.0 * d * d * d;
        if (volume > (deck->kinds == 1 ? densest : 1.0) * room)
            return mill_deck_fault(deck, error, title, amount,
                                   "%ld balls do not fit: they fill %.3g litres of the drum's %.3g",
                                   total, 1e3 * volume, 1e3 * room);
    }
    if (deck->start && deck->speed != 0.0)
        return mill_deck_fault(deck, error, "balls", "speed",
                               "is for a random start only; the start file holds its own speeds");
    return MILL_OK;
}

/* Largest distance of a blade's corner from the axis [m]. */
static double blade_reach(const struct mill_deck_blade *blade)
{
    const double across = 0.5 * (blade->width * fabs(mill_elementary_sin(blade->pitch)) +
                                 blade->thickness * fabs(mill_elementary_cos(blade->pitch)));
    return sqrt(blade->tip_radius * blade->tip_radius + across * across);
}

/* Half of what the pitched blade takes along the axis [m]. */
static double blade_along(const struct mill_deck_blade *blade)
{
    return 0.5 * (blade->width * fabs(mill_elementary_cos(blade->pitch)) +
                  blade->thickness * fabs(mill_elementary_sin(blade->pitch)));
}

static const char *less_buckles(const struct mill_deck *deck)
{
    return deck->wavy ? " less the height of its buckles" : "";
}

static enum mill_status check_blade(const struct mill_deck *deck, const char *title, int number,
                                    struct mill_error *error)
{
    const struct mill_deck_blade *blade = &deck->blade[number];
    const double reach = blade_reach(blade), bore = mill_deck_drum_bore(deck);
    const double along = blade_along(blade);
    const bool turned = mill_elementary_sin(blade->pitch) != 0.0;
    if (blade->tip_radius <= deck->shaft_radius)
        return mill_deck_fault(deck, error, title, "tip_radius",
                               "must be greater than the shaft's radius, %g m, got %g m",
                               deck->shaft_radius, blade->tip_radius);
    if (blade->tip_radius >= bore)
        return mill_deck_fault(deck, error, title, "tip_radius",
                               "must be less than the drum's radius%s, %g m, got %g m",
                               less_buckles(deck), bore, blade->tip_radius);
    if (reach >= bore)
        return mill_deck_fault(deck, error, title, "tip_radius",
                               "the blade's corners reach %g m and stand out of the drum%s, %g m",
                               reach, deck->wavy ? ", whose buckles come as near as" : "", bore);
    if (fabs(blade->position) + along > (0.5 + rounding) * deck->drum_length)
        return mill_deck_fault(
            deck, error, title, strcmp(title, "blades") == 0 ? "width" : "position",
            "blade %s reaches from x = %g m to %g m%s, out of the drum's "
            "%g m to %g m",
            blade->name, blade->position - along, blade->position + along,
            turned ? " with its pitch" : "", -0.5 * deck->drum_length, 0.5 * deck->drum_length);
    return MILL_OK;
}

/* "blades" or "blade.NAME" */
static void name_blade(const struct mill_deck *deck, int number, char title[80])
{
    const bool single = number >= deck->text->blades.count;
    snprintf(title, 80, "%s%s", single ? "blade." : "blades",
             single ? deck->blade[number].name : "");
}

static enum mill_status check_rotor(const struct mill_deck *deck, struct mill_error *error)
{
    char title[80];
    if (!deck->rotor && deck->blades > 0) {
        name_blade(deck, 0, title);
        return mill_deck_fault(deck, error, title, NULL,
                               "blades need a section [rotor] that carries them");
    }
    if (deck->rotor && deck->shaft_radius >= mill_deck_drum_bore(deck))
        return mill_deck_fault(deck, error, "rotor", "shaft_radius",
                               "must be less than the drum's radius%s, %g m", less_buckles(deck),
                               mill_deck_drum_bore(deck));
    for (int k = 0; k < deck->blades; k++) {
        name_blade(deck, k, title);
        const enum mill_status status = check_blade(deck, title, k, error);
        if (status != MILL_OK)
            return status;
    }
    return MILL_OK;
}

static void warn_of_gap(const struct mill_deck *deck, int number, const char *key,
                        const char *where, double gap, double diameter,
                        void (*warn)(const char *line))
{
    char title[80];
    struct mill_error line;
    name_blade(deck, number, title);
    mill_deck_fault(deck, &line, title, key,
                    "the gap of %.3g mm between blade and %s is %s a ball's diameter of %.3g mm: "
                    "balls can be pinched in it",
                    1e3 * gap, where, gap < diameter * (1.0 - 1e-9) ? "less than" : "just",
                    1e3 * diameter);
    warn(line.text);
}

/* Random balls are put wherever there is room. */
static void warn_of_mouths(const struct mill_deck *deck, void (*warn)(const char *line))
{
    struct mill_error line;
    const struct mill_profile p = profile_of(deck);
    /* between the inner arcs on both sides of a buckle that overhangs */
    const double mouth = 2.0 * (p.inner * mill_elementary_sin(MILL_PI / p.buckles) - p.arc);
    if (p.half_outer <= 0.5 * MILL_PI || deck->start)
        return;
    for (int k = 0; k < deck->kinds; k++) {
        const double d = deck->balls[k].diameter;
        if (d <= mouth || d >= 2.0 * p.arc)
            continue;
        mill_deck_fault(
            deck, &line, "drum", "buckle_height",
            "buckles open only %.3g mm wide, less than a ball's diameter of %.3g mm: balls "
            "that start in one stay there",
            1e3 * mouth, 1e3 * d);
        warn(line.text);
        return;
    }
}

/* One line for the equal blades, whose tips and outermost sides are alike; one for each single one.
 */
static void warn_of_gaps(const struct mill_deck *deck, void (*warn)(const char *line))
{
    double diameter = 0.0;
    for (int k = 0; k < deck->kinds; k++)
        diameter = fmax(diameter, deck->balls[k].diameter);
    for (int k = 0; k < deck->blades; k++) {
        const struct mill_deck_blade *blade = &deck->blade[k];
        const double tip = mill_deck_drum_bore(deck) - blade_reach(blade);
        const double side = 0.5 * deck->drum_length - fabs(blade->position) - blade_along(blade);
        const bool equal = k < deck->text->blades.count;
        if (tip < diameter * (1.0 - 1e-9) && (k == 0 || !equal))
            warn_of_gap(deck, k, "tip_radius", "drum", tip, diameter, warn);
        /* a gap of nothing but rounding lets no ball in; one of a diameter and rounding pinches it
         */
        if (side > rounding * deck->drum_length && side <= diameter * (1.0 + 1e-9) &&
            (k == 0 || !equal))
            warn_of_gap(deck, k, equal ? "width" : "position", "end wall", side, diameter, warn);
    }
}

enum mill_status mill_deck_check(const struct mill_deck *deck, void (*warn)(const char *line),
                                 struct mill_error *error)
{
    enum mill_status status = check_times(deck, error);
    if (status == MILL_OK && deck->wavy)
        status = check_profile(deck, error);
    if (status == MILL_OK)
        status = check_rotor(deck, error);
    if (status == MILL_OK)
        status = check_sizes(deck, error);
    if (status == MILL_OK)
        status = check_amount(deck, error);
    if (status == MILL_OK && warn && deck->wavy)
        warn_of_mouths(deck, warn);
    if (status == MILL_OK && warn)
        warn_of_gaps(deck, warn);
    return status;
}
