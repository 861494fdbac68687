/* Gives each kind of contact its law: what [contact] and [contact.KIND] give comes first, then the
 * materials of the balls and of what they hit, which this file knows. Reads the tables of
 * restitutions that fall with the speed. */
#include "deck/deck_private.h"

/* ---- the table of materials; docs/deck.md gives the source of each number ---- */

/* Elastic-plastic spheres of hardened bearing steel with a yield speed of 0.78 m/s (C. Thornton, J.
 * Appl. Mech. 64 (1997) 383), at most 0.97 */
static const struct mill_fall steel = {
    10,
    {1, 1.5, 2, 3, 5, 7, 10, 15, 20, 30},
    {0.97, 0.937, 0.89, 0.819, 0.731, 0.676, 0.621, 0.562, 0.524, 0.474},
    0.0};

/* The value, or where it is not given (NaN) the other one */
static double first_of(double given, double other)
{
    return isnan(given) ? other : given;
}

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
    {"silicon_nitride|Si3N4", 3200, 0.95, 0.15, 0.4, "assumed", NULL},
    {"stainless_steel|stainless", 7900, 0.7, 0.25, 0.35, "assumed", NULL},
    {"rubber", 1150, 0.5, 0.7, 0.4, "assumed", NULL},
    {"powder", 0, 0.5, 0.5, 0, "estimates (0.3 to 0.75, friction 0.3 to 0.8)", NULL},
};
enum { KNOWN = sizeof known / sizeof *known };

bool mill_deck_materials_find(const struct mill_deck *deck, const char *section, const char *key,
                              const char *name, struct mill_deck_found *found)
{
    char list[400] = "";
    const struct known *k = known;
    while (k < known + KNOWN && !mill_deck_is_among(k->names, '|', name))
        k++;
    const bool is_known = k < known + KNOWN;
    *found = (struct mill_deck_found){.remark = ""};
    snprintf(found->name, sizeof found->name, "%.*s",
             (int)(is_known ? strcspn(k->names, "|") : strlen(name)), is_known ? k->names : name);
    const struct mill_deck_section *own = mill_deck_find(&deck->text, "material", name);
    if (!own) /* under its first name: [material.steel] also for "Steel" */
        own = mill_deck_find(&deck->text, "material", found->name);
    found->is = own ? *(struct mill_deck_material *)own->form : deck->given.unknown;
    if (is_known) {
        struct mill_deck_law *law = &found->is.law;
        if (isnan(law->restitution) && !law->table) {
            found->remark = k->remark;
            law->restitution = k->restitution;
            law->table = k->fall ? "steel" : NULL;
            law->rows = k->fall;
        }
        law->friction = first_of(law->friction, k->friction);
        law->tangential = first_of(law->tangential, k->tangential);
        if (found->is.density == 0.0)
            found->is.density = k->density;
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

/* ---- falling restitution ---- */

static bool take_rows(const struct mill_deck_rows *rows, struct mill_fall *fall)
{
    const double(*row)[2] = rows->row.item;
    fall->points = (int)rows->row.count;
    for (int k = 0; k < fall->points; k++) {
        const double *x = row[k];
        const char *wrong = !(x[0] >= 0.0 && x[0] < 1e9) ? "the speed must be 0 m/s or more"
                            : k > 0 && x[0] <= fall->speed[k - 1] ? "the speeds must ascend"
                            : !(x[1] >= 0.0 && x[1] <= 1.0) ? "a restitution is between 0 and 1"
                                                            : NULL;
        if (wrong)
            return mill_deck_files_wrong(rows, ((long *)rows->line.item)[k], "%s", wrong);
        fall->speed[k] = x[0];
        fall->restitution[k] = x[1];
    }
    return fall->points > 1 || mill_deck_wrong(rows->text, rows->section, rows->key,
                                               "%s: expected 2 to 16 rows 'v e'", rows->path);
}

/* Finds and reads the table of a section, and checks that the section gives the restitution once.
 * general: what the section has inherited, as read before */
static bool settle(struct mill_deck_text *text, const struct mill_deck_section *s,
                   struct mill_deck_law *law, const struct mill_deck_law *general)
{
    static const char key[] = "restitution_table";
    static const char form[] = "2 numbers 'v e': speed in m/s, restitution";
    const char *twice = mill_deck_entry(s, "restitution")         ? "restitution"
                        : mill_deck_entry(s, "restitution_speed") ? "restitution_speed"
                                                                  : NULL;
    if (!mill_deck_entry(s, key)) {
        law->table = twice ? NULL : general->table;
        law->rows = twice ? NULL : general->rows;
        return true;
    }
    law->restitution = twice ? law->restitution : (double)NAN; /* not the inherited one */
    if (!law->table)                                           /* "none" */
        return true;
    if (twice)
        return mill_deck_wrong(text, s->title, twice,
                               "the 'restitution_table' already gives the restitution at each "
                               "speed; give only one of them");
    law->rows = strcmp(law->table, "steel") == 0 ? &steel : NULL;
    if (law->rows)
        return true;
    struct mill_fall *fall = mill_deck_keep(text, calloc(1, sizeof *fall));
    law->rows = fall;
    if (!fall || !mill_deck_files_find(text, s->title, key, &law->table))
        return false;
    struct mill_deck_rows rows = {
        text, s->title, key, law->table, form, 1u << 2, .most = MILL_FALL_POINTS};
    return mill_deck_files_read(&rows) && take_rows(&rows, fall);
}

static bool settle_all(struct mill_deck *deck)
{
    const struct mill_deck_law none = {.table = NULL};
    struct mill_deck_law *general = &deck->given.general;
    const struct mill_deck_section *s = NULL;
    bool good = settle(&deck->text, mill_deck_section(&deck->text, "contact"), general, &none);
    while (good && (s = mill_deck_named(&deck->text, "contact", s)))
        good = settle(&deck->text, s, s->form, general);
    while (good && (s = mill_deck_named(&deck->text, "material", s)))
        good = settle(&deck->text, s, s->form, &none);
    return good;
}

/* ---- pairs of materials ---- */

/* NaN: not known */
static double restitution_of(const struct mill_deck_law *law)
{
    return law->rows ? law->rows->restitution[0] : law->restitution;
}

struct mill_fall mill_deck_laws_fall(const struct mill_deck_law *law)
{
    const struct mill_fall power = {1, {law->speed}, {law->restitution}, 0.0}, none = {0};
    return law->rows ? *law->rows : law->speed > 0.0 ? power : none;
}

/* At the speed of a hard impact, for comparing materials; NaN: not known */
static double usual_of(const struct mill_deck_law *law)
{
    const struct mill_fall fall = mill_deck_laws_fall(law);
    return fall.points > 0 ? mill_impact_restitution(&fall, 3.0) : law->restitution;
}

/* The law of two materials, and the remark about it. Where the deck gives no values for this pair:
 * those of the softer one, that is the lower ones. */
static struct mill_deck_law pair(const struct mill_deck_found *a, const struct mill_deck_found *b,
                                 char *remark)
{
    if (strcmp(a->name, b->name) == 0) {
        snprintf(remark, MILL_DECK_REMARK, "%s on %s%s%s", a->name, a->name, *a->remark ? ": " : "",
                 a->remark);
        return a->is.law;
    }
    const double e = usual_of(&a->is.law);
    struct mill_deck_law law = (isnan(e) || usual_of(&b->is.law) < e ? b : a)->is.law;
    /* fmin ignores NaN */
    law.friction = fmin(a->is.law.friction, b->is.law.friction);
    law.tangential = fmin(a->is.law.tangential, b->is.law.tangential);
    snprintf(remark, MILL_DECK_REMARK, "%s on %s: the lower values of both", a->name, b->name);
    return law;
}

/* The law of a kind of contact by its materials */
struct search {
    const struct mill_deck *deck;
    int kind;
    bool known; /* all materials are given */
    struct mill_deck_law law;
    char remark[MILL_DECK_REMARK]; /* of what pair it is; "": there is none yet */
};

/* Adds the laws of all kinds of balls with a material, given in `section`. They must not differ. */
static bool add_pairs(struct search *by, const char *section, const char *material)
{
    const struct mill_deck *deck = by->deck;
    const struct mill_deck_section *s = NULL;
    const char *kind = deck->mill.contacts.name[by->kind];
    struct mill_deck_found with, ball;
    by->known = by->known && material;
    if (by->known && !mill_deck_materials_find(deck, section, "material", material, &with))
        return false;
    while (by->known && (s = mill_deck_next_balls(&deck->text, s))) {
        const struct mill_deck_balls *balls = s->form;
        char remark[MILL_DECK_REMARK];
        by->known = balls->material != NULL;
        if (!by->known)
            break;
        if (!mill_deck_materials_find(deck, s->title, "material", balls->material, &ball))
            return false;
        const struct mill_deck_law law = pair(&ball, &with, remark);
        if (*by->remark &&
            (restitution_of(&law) != restitution_of(&by->law) || law.speed != by->law.speed ||
             law.rows != by->law.rows || law.friction != by->law.friction ||
             law.tangential != by->law.tangential))
            return mill_deck_wrong(&deck->text, s->title, "material",
                                   "contacts %s have one law, but join several pairs of materials: "
                                   "give the law in [contact.%s]",
                                   kind, kind);
        by->law = law;
        memcpy(by->remark, remark, sizeof remark);
    }
    return true;
}

/* The material of body k (-1: drum, walls, shaft and blades), and its section. NULL: not given */
static const char *material_of(const struct mill_deck *deck, int kind, int k, const char **section)
{
    const struct mill_deck_body *own = NULL;
    const char *holder = mill_deck_holder(deck);
    bool rides = kind == MILL_BALL_SHAFT || kind == MILL_BALL_BLADE;
    if (k >= 0) {
        *section = mill_deck_section_of(deck, k);
        own = mill_deck_section(&deck->text, *section)->form;
        rides = deck->mill.rotor && deck->setup.surface[k].motion == 0;
    }
    if (own && own->material)
        return own->material;
    *section = rides && deck->given.rotor_material ? "rotor" : "drum";
    if (rides && deck->given.rotor_material)
        return deck->given.rotor_material;
    own = deck->mill.container ? mill_deck_section(&deck->text, holder)->form : NULL;
    return deck->given.drum_material ? deck->given.drum_material : own ? own->material : NULL;
}

static bool find_pair(struct search *by)
{
    const struct mill_deck *deck = by->deck;
    const struct mill_deck_section *first = mill_deck_next_balls(&deck->text, NULL);
    const char *section = first->title, *between = deck->given.between;
    struct mill_deck_found with;
    bool good = true;
    if (between) {
        good = mill_deck_materials_find(deck, "contact", "between", between, &with);
        by->law = with.is.law;
        if (good)
            snprintf(by->remark, MILL_DECK_REMARK, "%s between%s%s", with.name,
                     *with.remark ? ": " : "", with.remark);
    } else if (by->kind == MILL_BALL_BALL) {
        good = add_pairs(by, section, ((const struct mill_deck_balls *)first->form)->material);
    } else {
        for (int k = deck->mill.parts - 1; k < deck->setup.surfaces && good; k++) {
            const bool part = k < deck->mill.parts;
            if (part ? deck->mill.drum && by->kind < MILL_KINDS
                     : deck->setup.surface[k].kind == by->kind) {
                const char *material = material_of(deck, by->kind, part ? -1 : k, &section);
                good = add_pairs(by, section, material);
            }
        }
    }
    if (!by->known)
        by->remark[0] = '\0';
    return good;
}

/* ---- the law of each kind ---- */

static bool tell_missing(const struct mill_deck *deck)
{
    return mill_deck_wrong(&deck->text, "contact", "restitution",
                           "missing (normal coefficient of restitution); expected a plain number "
                           "such as '0.8', or 'material' of the balls and of what they hit");
}

void mill_deck_laws_require(struct mill_deck *deck)
{
    const struct mill_deck_given *given = &deck->given;
    bool other = given->between || given->general.table || !isnan(given->general.restitution) ||
                 mill_deck_named(&deck->text, "contact", NULL);
    for (const struct mill_deck_section *s = deck->text.section; s; s = s->next)
        other = other || mill_deck_entry(s, "material");
    if (!other)
        tell_missing(deck);
}

/* The law of a kind of contact: as given, by its materials, or without friction */
static bool resolve(const struct mill_deck *deck, int kind, const struct mill_deck_law *given,
                    struct mill_deck_contact *is)
{
    const bool falls = given->rows || !isnan(given->restitution);
    struct search by = {deck, kind, true, deck->given.unknown.law, ""};
    struct mill_deck_law *law = &is->law;
    *law = *given;
    if ((!falls || isnan(law->friction) || isnan(law->tangential)) && !find_pair(&by))
        return false;
    if (by.remark[0]) {
        is->takes.restitution = !falls;
        is->takes.friction = isnan(law->friction);
        is->takes.tangential = isnan(law->tangential);
        snprintf(is->assumed, MILL_DECK_REMARK, "%.*s",
                 (int)(falls ? strcspn(by.remark, ":") : strlen(by.remark)), by.remark);
        const double speed = law->speed > 0.0 ? law->speed : by.law.speed;
        *law = falls ? *law : by.law;
        law->speed = falls ? law->speed : speed;
        law->friction = first_of(given->friction, by.law.friction);
        law->tangential = first_of(given->tangential, by.law.tangential);
    }
    law->friction = first_of(law->friction, 0.0);
    law->tangential = first_of(law->tangential, 0.0);
    if (isnan(restitution_of(law)))
        return tell_missing(deck);
    if (law->rows && law->speed > 0.0)
        return mill_deck_wrong(&deck->text, "contact", "restitution_speed",
                               "the restitution of %s is a table of all speeds: leave it out",
                               deck->mill.contacts.name[kind]);
    if (law->rows)
        law->restitution = (double)NAN; /* the table gives it */
    return true;
}

/* The deck prints laws, not materials: if some follow from these, a [contact.KIND] for each */
static void list_printed(struct mill_deck *deck)
{
    struct mill_deck_mill *mill = &deck->mill;
    struct mill_deck_law *general = &deck->given.general;
    bool assumed = false;
    for (int kind = 0; kind < mill->contacts.count; kind++)
        assumed = assumed || mill->contact[kind].assumed[0];
    for (int kind = 0; kind < mill->contacts.count; kind++) {
        struct mill_deck_contact *contact = &mill->contact[kind];
        struct mill_deck_section *s = mill_deck_section(&deck->text, contact->section);
        if (contact->occurs && assumed && !s)
            s = mill_deck_section_add(&deck->text, contact->section);
        if (contact->occurs && s)
            s->form = &contact->law;
    }
    if (!assumed && restitution_of(general) >= 0.0) {
        general->friction = first_of(general->friction, 0.0);
        general->tangential = first_of(general->tangential, 0.0);
    }
}

/* The values of the section [TITLE.KIND], or `general` */
static const void *find_values(const struct mill_deck *deck, const char *title, int kind,
                               const void *general)
{
    const struct mill_deck_section *s =
        mill_deck_find(&deck->text, title, deck->mill.contacts.name[kind]);
    return s ? s->form : general;
}

/* Checks that the kinds of all [TITLE.KIND] occur. */
static void check_kinds(struct mill_deck *deck, const char *title)
{
    const struct mill_kinds *kinds = &deck->mill.contacts;
    const struct mill_deck_section *s = NULL;
    while ((s = mill_deck_named(&deck->text, title, s))) {
        char names[MILL_KINDS_MOST * (MILL_KINDS_LENGTH + 2)] = "";
        bool there = false;
        for (int kind = 0; kind < kinds->count; kind++)
            if (deck->mill.contact[kind].occurs) {
                strcat(strcat(names, kind > 0 ? ", " : ""), kinds->name[kind]);
                there = there || strcmp(mill_deck_name(s), kinds->name[kind]) == 0;
            }
        if (!there)
            mill_deck_wrong(&deck->text, s->title, NULL, "unknown kind of contact; there are %s",
                            names);
    }
}

void mill_deck_laws_list(struct mill_deck *deck)
{
    struct mill_deck_mill *mill = &deck->mill;
    if (!settle_all(deck))
        return;
    for (int kind = 0; kind < mill->contacts.count; kind++) {
        struct mill_deck_contact *is = &mill->contact[kind];
        /* does any surface of the mill have this kind of contact? */
        is->occurs = mill->drum || kind == MILL_BALL_BALL || kind >= MILL_KINDS;
        for (int k = mill->parts; k < deck->setup.surfaces && !is->occurs; k++)
            is->occurs = deck->setup.surface[k].kind == kind;
        snprintf(is->section, sizeof is->section, "contact.%s", mill->contacts.name[kind]);
    }
    check_kinds(deck, "contact");
    for (int kind = 0; kind < mill->contacts.count; kind++) {
        struct mill_deck_law *law = &mill->contact[kind].law;
        if (mill->contact[kind].occurs &&
            !resolve(deck, kind, find_values(deck, "contact", kind, &deck->given.general),
                     &mill->contact[kind]))
            return;
        deck->setup.law[kind] =
            (struct mill_law){restitution_of(law), law->friction, law->tangential};
        deck->setup.fall[kind] = mill_deck_laws_fall(law);
        deck->observe.wear[kind] =
            *(const struct mill_wear_law *)find_values(deck, "wear", kind, &deck->given.worn);
    }
    check_kinds(deck, "wear");
    list_printed(deck);
}
