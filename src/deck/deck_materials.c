/* The table of materials. docs/deck.md gives the source of each number. */
#include "deck/deck_private.h"

#include <strings.h>

/* Elastic-plastic spheres of hardened bearing steel with a yield speed of 0.78 m/s (C. Thornton, J.
 * Appl. Mech. 64 (1997) 383), at most 0.97 */
static const struct mill_fall steel = {
    10,
    {1, 1.5, 2, 3, 5, 7, 10, 15, 20, 30},
    {0.97, 0.937, 0.89, 0.819, 0.731, 0.676, 0.621, 0.562, 0.524, 0.474}};

/* What millsim knows of a material, in contact with itself */
static const struct known {
    const char *names; /* the first one is used in messages */
    double density, restitution, friction, tangential;
    const char *remark;
    const struct mill_fall
        *fall; /* in place of the restitution; NULL: it is the same at any speed */
} known[] = {
    {"steel", 7800, NAN, 0.2, 0.35, "e computed by Thornton 1997; others estimated", &steel},
    {"tungsten_carbide|WC|WC-Co", 14900, 0.92, 0.15, 0.4, "estimates", NULL},
    {"zirconia|ZrO2|YSZ|Y-TZP", 6050, 0.92, 0.15, 0.4, "values of other simulations, not measured",
     NULL},
    {"alumina|Al2O3|corundum", 3850, 0.98, 0.09, 0.4, "Kharaz 2001, on glass, below 2 m/s", NULL},
    {"agate", 2650, 0.9, 0.15, 0.4, "estimates", NULL},
    {"glass|soda-lime", 2500, 0.97, 0.092, 0.44, "Foerster 1994, 3 mm balls, near 1 m/s", NULL},
    {"PTFE|teflon", 2200, 0.7, 0.08, 0.4, "estimates", NULL},
    {"powder", 0, 0.5, 0.5, 0, "estimates (0.3 to 0.75, friction 0.3 to 0.8)", NULL},
};
enum { KNOWN = sizeof known / sizeof *known };

/* Is `name` one of "first|second"? Upper and lower case are equal. */
static bool is_among(const char *names, const char *name)
{
    const size_t length = strlen(name);
    for (const char *p = names; p; p = strchr(p, '|'), p += p != NULL)
        if (strcspn(p, "|") == length && strncasecmp(p, name, length) == 0)
            return true;
    return false;
}

bool mill_deck_materials_find(const struct mill_deck *deck, const char *section, const char *key,
                              const char *name, struct mill_deck_found *found)
{
    char title[MILL_NAME_LENGTH + 16], list[400] = "";
    const struct known *k = known;
    while (k < known + KNOWN && !is_among(k->names, name))
        k++;
    snprintf(title, sizeof title, "material.%.63s", name);
    const struct mill_deck_section *own = mill_deck_section(&deck->text, title);
    if (!own && k < known + KNOWN) { /* under its first name: [material.steel] also for "Steel" */
        snprintf(title, sizeof title, "material.%.*s", (int)strcspn(k->names, "|"), k->names);
        own = mill_deck_section(&deck->text, title);
    }
    *found = (struct mill_deck_found){
        .is = own ? *(struct mill_deck_material *)own->form : deck->given.unknown, .remark = ""};
    snprintf(found->name, sizeof found->name, "%s", name);
    if (k < known + KNOWN) {
        struct mill_deck_law *law = &found->is.law;
        if (isnan(law->restitution) && !law->table)
            found->remark = k->remark;
        if (!law->table && isnan(law->restitution) && k->fall) {
            law->table = "steel";
            law->rows = k->fall;
        } else if (!law->table) {
            law->restitution = mill_deck_laws_first(law->restitution, k->restitution);
        }
        law->friction = mill_deck_laws_first(law->friction, k->friction);
        law->tangential = mill_deck_laws_first(law->tangential, k->tangential);
        if (found->is.density == 0.0)
            found->is.density = k->density;
        snprintf(found->name, sizeof found->name, "%.*s", (int)strcspn(k->names, "|"), k->names);
    } else if (!own) {
        for (k = known; k < known + KNOWN; k++)
            snprintf(list + strlen(list), sizeof list - strlen(list), "%s%.*s", *list ? ", " : "",
                     (int)strcspn(k->names, "|"), k->names);
        return mill_deck_wrong(&deck->text, section, key,
                               "unknown material '%.63s'; there are %s, or add a section "
                               "[material.%.63s]",
                               name, list, name);
    }
    return true;
}

const struct mill_fall *mill_deck_materials_fall(const char *name)
{
    return strcmp(name, "steel") == 0 ? &steel : NULL;
}
