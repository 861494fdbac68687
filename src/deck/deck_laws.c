/* Gives each kind of contact its law: what [contact] and [contact.KIND] give comes first, then the
 * materials of the balls and of what they hit. Reads the tables of restitutions that fall with the
 * speed. */
#include "deck/deck_private.h"

/* ---- falling restitution ---- */

/* Takes the rows of a table. */
static bool take_rows(const struct mill_deck_rows *rows, struct mill_fall *fall)
{
    const double(*row)[MILL_DECK_COLUMNS] = rows->row.item;
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
    law->rows = mill_deck_materials_fall(law->table);
    if (law->rows)
        return true;
    struct mill_fall *fall = mill_deck_keep(text, calloc(1, sizeof *fall));
    law->rows = fall;
    if (!fall || !mill_deck_files_find(text, s->title, key, &law->table))
        return false;
    struct mill_deck_rows rows = {.text = text,
                                  .section = s->title,
                                  .key = key,
                                  .path = law->table,
                                  .form = "2 numbers 'v e': speed in m/s, restitution",
                                  .columns = 1u << 2,
                                  .most = MILL_FALL_POINTS,
                                  .many = "there are more than %ld rows"};
    const bool good = mill_deck_files_read(&rows) && take_rows(&rows, fall);
    free(rows.row.item);
    free(rows.line.item);
    return good;
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
    const struct mill_fall power = {1, {law->speed}, {law->restitution}}, none = {0};
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

static bool are_equal(const struct mill_deck_law *a, const struct mill_deck_law *b)
{
    return restitution_of(a) == restitution_of(b) && a->speed == b->speed && a->rows == b->rows &&
           a->friction == b->friction && a->tangential == b->tangential;
}

/* The law of a kind of contact by its materials */
struct search {
    const struct mill_deck *deck;
    int kind;
    bool known; /* all materials are given */
    struct mill_deck_law law;
    char remark[MILL_DECK_REMARK]; /* of what pair it is; "": there is none yet */
};

/* Adds the laws of all kinds of balls with a partner of this material, which `section` gives. They
 * must not differ. */
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
        if (*by->remark && !are_equal(&law, &by->law))
            return mill_deck_wrong(&deck->text, s->title, "material",
                                   "contacts %s have one law, but join several pairs of materials: "
                                   "give the law in [contact.%s]",
                                   kind, kind);
        by->law = law;
        memcpy(by->remark, remark, sizeof remark);
    }
    return true;
}

/* The material of body k, or with k = -1 of drum, walls, shaft and blades, and the section that
 * gives it. NULL: not given */
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
        is->takes = (struct mill_deck_takes){!falls, isnan(law->friction), isnan(law->tangential)};
        snprintf(is->assumed, MILL_DECK_REMARK, "%.*s",
                 (int)(falls ? strcspn(by.remark, ":") : strlen(by.remark)), by.remark);
        const double speed = law->speed > 0.0 ? law->speed : by.law.speed;
        *law = falls ? *law : by.law;
        law->speed = falls ? law->speed : speed;
        law->friction = mill_deck_laws_first(given->friction, by.law.friction);
        law->tangential = mill_deck_laws_first(given->tangential, by.law.tangential);
    }
    law->friction = mill_deck_laws_first(law->friction, 0.0);
    law->tangential = mill_deck_laws_first(law->tangential, 0.0);
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

/* The sections of the printed deck: those of the text, and if laws follow from materials, one for
 * each kind of contact. The [contact.KIND] have the laws. */
static void list_printed(struct mill_deck *deck)
{
    struct mill_deck_mill *mill = &deck->mill;
    struct mill_deck_text *printed = &mill->printed;
    struct mill_deck_law *general = &deck->given.general;
    struct mill_deck_section **end = &printed->section, *copy;
    bool assumed = false;
    printed->reading = deck->text.reading;
    for (const struct mill_deck_section *s = deck->text.section; s; s = s->next) {
        *end = copy = mill_deck_keep(&deck->text, malloc(sizeof *copy));
        if (!copy)
            return;
        *copy = *s;
        end = &copy->next;
    }
    *end = NULL;
    for (int kind = 0; kind < mill->contacts.count; kind++)
        assumed = assumed || mill->contact[kind].assumed[0];
    for (int kind = 0; kind < mill->contacts.count; kind++) {
        struct mill_deck_contact *contact = &mill->contact[kind];
        struct mill_deck_section *s = mill_deck_section(printed, contact->section);
        if (contact->occurs && assumed && !s)
            s = mill_deck_section_add(printed, contact->section);
        if (contact->occurs && s)
            s->form = &contact->law;
    }
    if (!assumed && restitution_of(general) >= 0.0) {
        general->friction = mill_deck_laws_first(general->friction, 0.0);
        general->tangential = mill_deck_laws_first(general->tangential, 0.0);
    }
    printed->reading = NULL;
}

/* The values of the section [TITLE.KIND], or `general` */
static const void *find_values(const struct mill_deck *deck, const char *title, int kind,
                               const void *general)
{
    const struct mill_deck_section *s = NULL;
    while ((s = mill_deck_named(&deck->text, title, s)) &&
           strcmp(mill_deck_name(s), deck->mill.contacts.name[kind]) != 0)
        continue;
    return s ? s->form : general;
}

/* Checks that the kinds of all [TITLE.KIND] occur. */
static void check_kinds(struct mill_deck *deck, const char *title)
{
    const struct mill_kinds *kinds = &deck->mill.contacts;
    const struct mill_deck_section *s = NULL;
    while ((s = mill_deck_named(&deck->text, title, s))) {
        char known[MILL_KINDS_MOST * (MILL_KINDS_LENGTH + 2)] = "";
        bool there = false;
        for (int kind = 0; kind < kinds->count; kind++)
            if (deck->mill.contact[kind].occurs) {
                strcat(strcat(known, kind > 0 ? ", " : ""), kinds->name[kind]);
                there = there || strcmp(mill_deck_name(s), kinds->name[kind]) == 0;
            }
        if (!there)
            mill_deck_wrong(&deck->text, s->title, NULL, "unknown kind of contact; there are %s",
                            known);
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
    list_printed(deck);
    check_kinds(deck, "wear");
}
