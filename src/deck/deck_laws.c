/* Gives each kind of contact its law: what [contact] and [contact.KIND] give comes first, then the
 * materials of the balls and of what they hit. Reads the tables of restitutions that fall with the
 * speed. */
#include "deck/deck_private.h"
#include "deck/textfile.h"

#include <assert.h>
#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SECTION = sizeof((struct mill_deck_contact *)0)->section };

/* ---- falling restitution ---- */

/* Reads a table into *fall. */
static enum mill_status read_table(struct mill_deck_rows *rows, struct mill_fall *fall,
                                   struct mill_error *error)
{
    enum mill_status status = mill_deck_files_read(rows, error);
    for (long k = 0; k < rows->count && status == MILL_OK; k++) {
        const double *x = rows->row[k];
        const char *wrong = !(x[0] >= 0.0 && x[0] < 1e9) ? "the speed must be 0 m/s or more"
                            : k > 0 && x[0] <= fall->speed[k - 1] ? "the speeds must ascend"
                            : !(x[1] >= 0.0 && x[1] <= 1.0) ? "a restitution is between 0 and 1"
                                                            : NULL;
        if (wrong)
            return mill_deck_files_wrong(rows, rows->line[k], error, "%s", wrong);
        fall->speed[k] = x[0];
        fall->restitution[k] = x[1];
    }
    fall->points = (int)rows->count;
    if (status != MILL_OK || rows->count > 1)
        return status;
    mill_error_set(error, MILL_BAD_DECK, "%s: expected 2 to 16 rows 'v e'", rows->path);
    return mill_deck_files_told(rows->text, rows->section, rows->key, MILL_BAD_DECK);
}

/* Finds and reads the table of a section, and checks that the section gives the restitution once.
 * general: what the section has inherited, as read before */
static enum mill_status settle(struct mill_deck_text *text, const char *section,
                               struct mill_deck_law *law, const struct mill_deck_law *general)
{
    static const char key[] = "restitution_table";
    const struct mill_deck_section *s = mill_deck_section(text, section);
    const char *twice = mill_deck_entry(s, "restitution")         ? "restitution"
                        : mill_deck_entry(s, "restitution_speed") ? "restitution_speed"
                                                                  : NULL;
    if (!mill_deck_entry(s, key)) {
        law->table = twice ? NULL : general->table;
        law->rows = twice ? NULL : general->rows;
        return MILL_OK;
    }
    law->restitution = twice ? law->restitution : (double)NAN; /* not the inherited one */
    if (!law->table)                                           /* "none" */
        return MILL_OK;
    if (twice)
        return mill_deck_wrong(text, section, twice,
                               "the 'restitution_table' already gives the restitution at each "
                               "speed; give only one of them");
    law->rows = mill_deck_materials_fall(law->table);
    if (law->rows)
        return MILL_OK;
    enum mill_status status = mill_deck_files_find(text, section, key, &law->table);
    struct mill_fall *fall = status == MILL_OK ? calloc(1, sizeof *fall) : NULL;
    if (!fall)
        return status == MILL_OK ? mill_deck_memory(text) : status;
    mill_deck_files_keep(text, fall);
    law->rows = fall;
    struct mill_deck_rows rows = {.text = text,
                                  .section = section,
                                  .key = key,
                                  .path = law->table,
                                  .form = "2 numbers 'v e': speed in m/s, restitution",
                                  .columns = 1u << 2,
                                  .most = MILL_FALL_POINTS,
                                  .many = "there are more than %ld rows"};
    status = read_table(&rows, fall, text->reading->error);
    free(rows.row);
    free(rows.line);
    return status;
}

static enum mill_status settle_all(struct mill_deck *deck)
{
    const struct mill_deck_law none = {.table = NULL};
    struct mill_deck_law *general = &deck->given.general;
    enum mill_status status = settle(&deck->text, "contact", general, &none);
    for (int i = 0; i < deck->text.sections && status == MILL_OK; i++) {
        const struct mill_deck_section *s = &deck->text.section[i];
        const bool kind = strncmp(s->title, "contact.", 8) == 0;
        if (kind || strncmp(s->title, "material.", 9) == 0)
            status = settle(&deck->text, s->title, s->form, kind ? general : &none);
    }
    return status;
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
static enum mill_status add_pairs(struct search *by, const char *section, const char *material)
{
    const struct mill_deck *deck = by->deck;
    const struct mill_deck_section *s = NULL;
    const char *kind = deck->mill.contacts.name[by->kind];
    struct mill_deck_found with, ball;
    enum mill_status status = MILL_OK;
    by->known = by->known && material;
    if (by->known)
        status = mill_deck_materials_find(deck, section, "material", material, &with);
    while (status == MILL_OK && by->known && (s = mill_deck_next_balls(&deck->text, s))) {
        const struct mill_deck_balls *balls = s->form;
        char remark[MILL_DECK_REMARK];
        by->known = balls->material != NULL;
        if (by->known)
            status = mill_deck_materials_find(deck, s->title, "material", balls->material, &ball);
        if (status != MILL_OK || !by->known)
            break;
        const struct mill_deck_law law = pair(&ball, &with, remark);
        if (*by->remark && !are_equal(&law, &by->law))
            return mill_deck_wrong(&deck->text, s->title, "material",
                                   "contacts %s have one law, but join several pairs of materials: "
                                   "give the law in [contact.%s]",
                                   kind, kind);
        by->law = law;
        memcpy(by->remark, remark, sizeof remark);
    }
    return status;
}

/* The material of body k, or with k = -1 of drum, walls, shaft and blades, and the section that
 * gives it. NULL: not given */
static const char *material_of(const struct mill_deck *deck, int kind, int k, const char **section)
{
    const struct mill_deck_mill *mill = &deck->mill;
    const struct mill_deck_body *own =
        k < 0 ? NULL : mill_deck_section(&deck->text, mill->bodies.section[k])->form;
    const bool rides = k < 0 ? kind == MILL_BALL_SHAFT || kind == MILL_BALL_BLADE
                             : mill->rotor && mill->bodies.surface[k].motion == 0;
    const char *container = NULL;
    if (mill->container)
        container = mill->bodies.section[mill->container - mill->bodies.surface];
    if (own && own->material) {
        *section = mill->bodies.section[k];
        return own->material;
    }
    *section = rides && deck->given.rotor_material ? "rotor" : "drum";
    if (rides && deck->given.rotor_material)
        return deck->given.rotor_material;
    own = container ? mill_deck_section(&deck->text, container)->form : NULL;
    return deck->given.drum_material ? deck->given.drum_material : own ? own->material : NULL;
}

static enum mill_status find_pair(struct search *by)
{
    const struct mill_deck *deck = by->deck;
    const struct mill_deck_section *first = mill_deck_next_balls(&deck->text, NULL);
    const char *section = first->title, *between = deck->given.between;
    struct mill_deck_found with;
    enum mill_status status = MILL_OK;
    if (between) {
        status = mill_deck_materials_find(deck, "contact", "between", between, &with);
        by->law = with.is.law;
        if (status == MILL_OK)
            snprintf(by->remark, MILL_DECK_REMARK, "%s between%s%s", with.name,
                     *with.remark ? ": " : "", with.remark);
    } else if (by->kind == MILL_BALL_BALL) {
        status = add_pairs(by, section, ((const struct mill_deck_balls *)first->form)->material);
    } else {
        for (int k = -1; k < deck->mill.bodies.count && status == MILL_OK; k++)
            if (k < 0 ? deck->mill.drum && by->kind < MILL_KINDS
                      : deck->mill.bodies.surface[k].kind == by->kind) {
                const char *material = material_of(deck, by->kind, k, &section);
                status = add_pairs(by, section, material);
            }
    }
    if (!by->known)
        by->remark[0] = '\0';
    return status;
}

/* ---- the law of each kind ---- */

static enum mill_status tell_missing(const struct mill_deck *deck)
{
    return mill_deck_wrong(&deck->text, "contact", "restitution",
                           "missing (normal coefficient of restitution); expected a plain number "
                           "such as '0.8', or 'material' of the balls and of what they hit");
}

enum mill_status mill_deck_laws_require(struct mill_deck *deck)
{
    const struct mill_deck_given *given = &deck->given;
    bool other = given->between || given->general.table || !isnan(given->general.restitution);
    for (int i = 0; i < deck->text.sections; i++)
        other = other || mill_deck_entry(&deck->text.section[i], "material") ||
                strncmp(deck->text.section[i].title, "contact.", 8) == 0;
    return other ? MILL_OK : tell_missing(deck);
}

/* The law of a kind of contact: as given, by its materials, or without friction */
static enum mill_status resolve(const struct mill_deck *deck, int kind,
                                const struct mill_deck_law *given, struct mill_deck_contact *is)
{
    const bool falls = given->rows || !isnan(given->restitution);
    struct search by = {deck, kind, true, deck->given.unknown.law, ""};
    struct mill_deck_law *law = &is->law;
    *law = *given;
    if (!falls || isnan(law->friction) || isnan(law->tangential)) {
        const enum mill_status status = find_pair(&by);
        if (status != MILL_OK)
            return status;
    }
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
    return MILL_OK;
}

/* The sections of the printed deck: those of the text, and if laws follow from materials, one for
 * each kind of contact. The [contact.KIND] have the laws. */
static enum mill_status list_printed(struct mill_deck *deck)
{
    struct mill_deck_mill *mill = &deck->mill;
    struct mill_deck_text *printed = &mill->printed;
    struct mill_deck_law *general = &deck->given.general;
    const size_t most = (size_t)deck->text.sections + MILL_KINDS_MOST;
    bool assumed = false;
    printed->section = calloc(most, sizeof *printed->section);
    if (!printed->section)
        return mill_deck_memory(&deck->text);
    printed->sections = deck->text.sections;
    for (int i = 0; i < deck->text.sections; i++)
        printed->section[i] = deck->text.section[i];
    for (int kind = 0; kind < mill->contacts.count; kind++)
        assumed = assumed || mill->contact[kind].assumed[0];
    for (int kind = 0; kind < mill->contacts.count; kind++) {
        struct mill_deck_contact *contact = &mill->contact[kind];
        struct mill_deck_section *s = mill_deck_section(printed, contact->section);
        if (contact->occurs && assumed && !s) {
            s = &printed->section[printed->sections++];
            s->title = contact->section;
        }
        if (contact->occurs && s)
            s->form = &contact->law;
    }
    if (!assumed && restitution_of(general) >= 0.0) {
        general->friction = mill_deck_laws_first(general->friction, 0.0);
        general->tangential = mill_deck_laws_first(general->tangential, 0.0);
    }
    return MILL_OK;
}

/* Does any surface of the mill have this kind of contact? */
static bool occurs(const struct mill_deck_mill *mill, int kind)
{
    bool has = mill->drum || kind == MILL_BALL_BALL || kind >= MILL_KINDS;
    for (int k = 0; k < mill->bodies.count && !has; k++)
        has = mill->bodies.surface[k].kind == kind;
    return has;
}

/* Names the section [TITLE.KIND]. */
static void name_section(const struct mill_deck *deck, const char *title, int kind,
                         char name[SECTION])
{
    char kind_name[MILL_KINDS_LENGTH];
    memcpy(kind_name, deck->mill.contacts.name[kind], sizeof kind_name);
    snprintf(name, SECTION, "%s.%s", title, kind_name);
}

/* The values of the section [TITLE.KIND], or `general` */
static const void *find_values(const struct mill_deck *deck, const char *title, int kind,
                               const void *general)
{
    char name[SECTION];
    name_section(deck, title, kind, name);
    const struct mill_deck_section *s = mill_deck_section(&deck->text, name);
    return s ? s->form : general;
}

/* Checks that the kinds of all [TITLE.KIND] occur. */
static enum mill_status check_kinds(struct mill_deck *deck, const char *title)
{
    const struct mill_kinds *kinds = &deck->mill.contacts;
    const struct mill_deck_section *s = NULL;
    enum mill_status status = MILL_OK;
    while (status == MILL_OK && (s = mill_deck_named(&deck->text, title, s))) {
        char known[MILL_KINDS_MOST * (MILL_KINDS_LENGTH + 2)] = "";
        bool there = false;
        for (int kind = 0; kind < kinds->count; kind++)
            if (deck->mill.contact[kind].occurs) {
                strcat(strcat(known, kind > 0 ? ", " : ""), kinds->name[kind]);
                there = there || strcmp(strchr(s->title, '.') + 1, kinds->name[kind]) == 0;
            }
        if (there)
            continue;
        mill_deck_wrong(&deck->text, s->title, NULL, "unknown kind of contact; there are %s",
                        known);
        status = mill_deck_faults_keep(&deck->text, MILL_BAD_DECK);
    }
    return status;
}

enum mill_status mill_deck_laws_list(struct mill_deck *deck)
{
    struct mill_deck_mill *mill = &deck->mill;
    enum mill_status status = settle_all(deck);
    for (int kind = 0; kind < mill->contacts.count; kind++) {
        mill->contact[kind].occurs = occurs(mill, kind);
        name_section(deck, "contact", kind, mill->contact[kind].section);
    }
    if (status == MILL_OK)
        status = check_kinds(deck, "contact");
    for (int kind = 0; kind < mill->contacts.count && status == MILL_OK; kind++)
        if (mill->contact[kind].occurs)
            status = resolve(deck, kind, find_values(deck, "contact", kind, &deck->given.general),
                             &mill->contact[kind]);
    if (status == MILL_OK)
        status = list_printed(deck);
    if (status == MILL_OK)
        status = check_kinds(deck, "wear");
    for (int kind = 0; kind < mill->contacts.count; kind++)
        memcpy(&mill->contact[kind].wear, find_values(deck, "wear", kind, &deck->given.worn),
               sizeof mill->contact[kind].wear);
    return status;
}
