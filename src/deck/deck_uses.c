/* The keys of [powder], [heat] and [wear]: what programs compute from the impacts of a run. These
 * sections do not influence the run. */
#include "deck/deck_keys.h"

#include <string.h>

/* clang-format off */
#define OPTIONAL MILL_KEY_NOT_NEGATIVE, .zero_is_off = true
#define POWDER(member) IN(mill_deck_powder, member)
const struct mill_key mill_deck_uses_powder[] = {
    {"mass", "mass of the powder", .unit = "kg", MILL_KEY_POSITIVE, POWDER(mass)},
    {"ball_to_powder", "mass of the balls divided by that of the powder; gives its mass", MILL_KEY_POSITIVE,
     .instead = "mass", POWDER(ball_to_powder)},
    {"density", "density of the powder's material", .unit = "kg/m^3", .lo = 1e-3,
     .hi = MILL_KEY_LARGEST, POWDER(density)},
    {"size", "diameter of a particle; 0 m: not known", .unit = "m", OPTIONAL, .preset = "0 m",
     POWDER(size)},
    {"packing", "share of a layer of powder that the particles fill", .unit = "1", .lo = 0,
     .above = true, .hi = 1, .preset = "0.6", POWDER(packing)},
    {"capture", "powder that an impact catches: a layer of one particle, the volume between the "
     "surfaces, or a layer on the Hertz contact", .type = MILL_KEY_CHOICE, .preset = "monolayer",
     POWDER(capture), .words = "monolayer|volume|layer"},
    {"layer", "thickness of the powder on a surface; 0 m: not known", .unit = "m", OPTIONAL,
     .preset = "0 m", POWDER(layer)},
    {"modulus", "reduced elastic modulus of the surfaces, for the Hertz contact", .unit = "Pa",
     .lo = 1, .hi = 1e13, .preset = "115 GPa", POWDER(modulus)},
    {"energy", "energy of an impact: of the normal approach, with the slip, or lost",
     .type = MILL_KEY_CHOICE, .preset = "normal", POWDER(energy),
     .words = "normal|total|dissipated"},
    {"threshold", "impacts with this energy or more are hard", .unit = "J", MILL_KEY_POSITIVE,
     .preset = "1 mJ", POWDER(threshold)},
    {"law", "what an impact of energy E does: c (E / 1 J)^n, c from the threshold on, breakage after "
     "Vogel & Peukert, or a table", .type = MILL_KEY_CHOICE, .preset = "none", POWDER(law),
     .words = "none|power|threshold|vogel_peukert|table"},
    {"coefficient", "c of the law", OPTIONAL, .preset = "0", POWDER(coefficient)},
    {"exponent", "n of the law", OPTIONAL, .preset = "0", POWDER(exponent)},
    {"strength", "f_Mat of Vogel & Peukert", .unit = "kg/J/m", OPTIONAL, .preset = "0 kg/J/m",
     POWDER(strength)},
    {"least", "x W_m,min of Vogel & Peukert", .unit = "J m/kg", OPTIONAL, .preset = "0 J m/kg",
     POWDER(least)},
    {"table", "a file with a row 'E k' for each energy [J], ascending", .type = MILL_KEY_FILE,
     .preset = "none", POWDER(table), .words = "none"},
    {.name = NULL},
};

#define HEAT(member) IN(mill_deck_heat, member)
#define CAPACITY .unit = "J/kg/K"
const struct mill_key mill_deck_uses_heat[] = {
    {"ball_heat_capacity", "specific heat capacity of the balls", CAPACITY, MILL_KEY_POSITIVE,
     HEAT(ball_capacity)},
    {"powder_heat_capacity", "specific heat capacity of the powder; 0: it is not counted", CAPACITY,
     OPTIONAL, .preset = "0 J/kg/K", HEAT(powder_capacity)},
    {"jar_heat_capacity", "specific heat capacity of the jar or drum", CAPACITY, MILL_KEY_POSITIVE,
     HEAT(jar_capacity)},
    {"jar_mass", "mass of the jar or drum", .unit = "kg", MILL_KEY_POSITIVE, HEAT(jar_mass)},
    {"ball_to_jar", "heat that flows from the balls to the jar, for each kelvin", .unit = "W/K",
     MILL_KEY_POSITIVE, HEAT(ball_to_jar)},
    {"jar_to_room", "heat that flows from the jar to the room, for each kelvin", .unit = "W/K",
     MILL_KEY_NOT_NEGATIVE, HEAT(jar_to_room)},
    {"room", "temperature of the room, and of everything at the start", .unit = "K", MILL_KEY_POSITIVE,
     .preset = "293.15 K", HEAT(room)},
    {"share", "share of the power that heats the balls; the rest heats the jar", .unit = "1",
     .lo = 0, .hi = 1, .preset = "0.5", HEAT(share)},
    {.name = NULL},
};

const struct mill_key mill_deck_uses_wear[] = {
    {"archard", "Archard's coefficient K; 0: not known", OPTIONAL, .preset = "0",
     IN(mill_deck_wear, archard)},
    {"hardness", "hardness of the surface", .unit = "Pa", .lo = 0, .hi = 1e12, .zero_is_off = true,
     .preset = "0 Pa", IN(mill_deck_wear, hardness)},
    {"erosion", "Finnie's coefficient k: mass removed for each joule; 0: not known",
     .unit = "kg/J", OPTIONAL, .preset = "0 kg/J", IN(mill_deck_wear, erosion)},
    {.name = NULL},
};

/* Keys that other keys of [powder] need */
void mill_deck_uses_checks(const struct mill_deck *deck, struct mill_deck_check *list)
{
    const struct mill_deck_powder *p = &deck->given.powder;
    const bool vogel = p->law == MILL_DECK_VOGEL, power = p->law == MILL_DECK_POWER;
    const struct mill_deck_check all[] = {
        {.wrong = (power || p->law == MILL_DECK_THRESHOLD) && p->coefficient == 0.0, "powder", "coefficient",
         "this law needs the coefficient c of each impact"},
        {.wrong = power && p->exponent == 0.0, "powder", "exponent", "the power law needs its exponent n"},
        {.wrong = vogel && p->strength == 0.0, "powder", "strength", "the law needs the material's f_Mat"},
        {.wrong = vogel && p->size == 0.0, "powder", "size", "the law needs the diameter of a particle"},
        {.wrong = p->law == MILL_DECK_RATES && !p->table, "powder", "table",
         "the law needs a file with a row 'E k' for each energy"},
        {.wrong = p->capture == MILL_DECK_LAYER && p->layer == 0.0, "powder", "layer",
         "this capture needs the thickness of the powder on a surface"},
    };
    if (p->mass > 0.0)
        memcpy(list, all, sizeof all);
}
/* clang-format on */
