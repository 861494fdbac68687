/* The contact laws: what [contact] and [contact.KIND] give comes first, then the materials of the
 * balls and of what they hit. Reads the tables of restitutions that fall with the speed. */
#include "deck/deck_private.h"
#include "deck/textfile.h"

#include <assert.h>
#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- falling restitution ---- */

static enum mill_status read_rows(struct mill_deck_rows *in, struct mill_fall *fall,
                                  struct mill_error *error)
{
    double x[3];
    for (int n; (n = mill_deck_files_row(in, 2, x)) != 0; fall->points++) {
        const int k = fall->points;
        const char *wrong = n != 2 ? "expected 2 numbers 'v e': speed in m/s, restitution"
                            : k == MILL_FALL_POINTS        ? "there are more than 16 rows"
                            : !(x[0] >= 0.0 && x[0] < 1e9) ? "the speed must be 0 m/s or more"
                            : k > 0 && x[0] <= fall->speed[k - 1] ? "the speeds must ascend"
                            : !(x[1] >= 0.0 && x[1] <= 1.0) ? "a restitution is between 0 and 1"
                                                            : NULL;
        if (wrong)
            return mill_error_set(error, MILL_BAD_DECK, "%s:%ld: %s", in->path, in->line, wrong);
        fall->speed[k] = x[0];
        fall->restitution[k] = x[1];
    }
    if (ferror(in->in))
        return mill_error_set(error, MILL_FAILED, "%s: %s", in->path, strerror(errno));
    return fall->points > 1
               ? MILL_OK
               : mill_error_set(error, MILL_BAD_DECK, "%s: expected 2 to 16 rows 'v e'", in->path);
}

/* Finds and reads the table of a section, and checks that the section gives the restitution once.
 * general: what the section has inherited, as read before */
static enum mill_status settle(struct mill_deck *deck, const char *section,
                               struct mill_deck_law *law, const struct mill_deck_law *general,
                               struct mill_error *error)
{
    static const char key[] = "restitution_table";
    const struct mill_deck_section *s = mill_deck_section(&deck->text, section);
    struct mill_deck_rows in = {.line = 0};
    const char *wrong;
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
        return mill_deck_fault(&deck->text, error, section, twice,
                               "the 'restitution_table' already gives the restitution at each "
                               "speed; give only one of them");
    law->rows = mill_deck_materials_fall(law->table);
    if (law->rows)
        return MILL_OK;
    enum mill_status status =
        mill_deck_files_find(&deck->text, section, key, law->table, &law->table, error);
    struct mill_fall *rows = status == MILL_OK ? calloc(1, sizeof *rows) : NULL;
    if (!rows)
        return status == MILL_OK ? mill_error_set(error, MILL_FAILED, "out of memory") : status;
    mill_deck_files_keep(&deck->text, rows);
    law->rows = rows;
    in.path = law->table;
    in.in = mill_textfile_open(in.path, &wrong);
    if (!in.in)
        return mill_deck_fault(&deck->text, error, section, key,
                               wrong ? "'%s' %s" : "cannot read '%s': %s", in.path,
                               wrong ? wrong : strerror(errno));
    status = mill_deck_files_told(&deck->text, section, key, read_rows(&in, rows, error), error);
    fclose(in.in);
    return status;
}

static enum mill_status tell_missing(const struct mill_deck *deck, struct mill_error *error)
{
    return mill_deck_fault(&deck->text, error, "contact", "restitution",
                           "missing (normal coefficient of restitution); expected a plain number "
                           "such as '0.8', or 'material' of the balls and of what they hit");
}

enum mill_status mill_deck_laws_require(struct mill_deck *deck, struct mill_error *error)
{
    bool other =
        deck->given.between || deck->given.general.table || !isnan(deck->given.general.restitution);
    for (int i = 0; i < deck->text.sections; i++)
        other = other || mill_deck_entry(&deck->text.section[i], "material") ||
                strncmp(deck->text.section[i].title, "contact.", 8) == 0;
    return other ? MILL_OK : tell_missing(deck, error);
}

enum mill_status mill_deck_laws_settle(struct mill_deck *deck, struct mill_error *error)
{
    const struct mill_deck_law none = {.table = NULL};
    enum mill_status status = settle(deck, "contact", &deck->given.general, &none, error);
    for (int i = 0; i < deck->text.sections && status == MILL_OK; i++) {
        const struct mill_deck_section *s = &deck->text.section[i];
        const bool kind = strncmp(s->title, "contact.", 8) == 0;
        if (kind || strncmp(s->title, "material.", 9) == 0)
            status = settle(deck, s->title, s->form, kind ? &deck->given.general : &none, error);
    }
    return status;
}

/* ---- pairs ---- */

/* NaN: not known */
static double restitution_of(const struct mill_deck_law *law)
{
    return law->rows ? law->rows->restitution[0] : law->restitution;
}

/* At the speed of a hard impact, for comparing materials; NaN: not known */
static double usual_of(const struct mill_deck_law *law)
{
    const struct mill_fall power = {1, {law->speed}, {law->restitution}};
    if (!law->rows && !(law->speed > 0.0))
        return law->restitution;
    return mill_impact_restitution(law->rows ? law->rows : &power, 3.0);
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

/* Finds what the balls hit in contacts of this kind: the next after *k, which is -1 for drum,
 * walls, shaft and blades, and otherwise the number of a body. Starts from -2. false: there is
 * nothing more. *material NULL: not given */
static bool next_partner(const struct mill_deck *deck, int kind, int *k, const char **material,
                         const char **section)
{
    const char *container = NULL;
    do
        ++*k;
    while (*k < deck->mill.bodies.count && !(*k < 0 ? deck->mill.drum && kind < MILL_KINDS
                                                    : deck->mill.bodies.surface[*k].kind == kind));
    if (*k >= deck->mill.bodies.count)
        return false;
    for (int i = 0; i < deck->mill.bodies.count; i++) {
        const struct mill_deck_body *given =
            mill_deck_section(&deck->text, deck->mill.bodies.section[i])->form;
        if (given->is.inside)
            container = given->material;
    }
    const bool rides = *k < 0 ? kind == MILL_BALL_SHAFT || kind == MILL_BALL_BLADE
                              : deck->mill.rotor && deck->mill.bodies.surface[*k].motion == 0;
    const struct mill_deck_body *own =
        *k < 0 ? NULL : mill_deck_section(&deck->text, deck->mill.bodies.section[*k])->form;
    *section = own && own->material ? deck->mill.bodies.section[*k] : "drum";
    *material = own && own->material ? own->material : rides ? deck->given.rotor_material : NULL;
    if (rides && *material && !(own && own->material))
        *section = "rotor";
    if (!*material)
        *material = deck->given.drum_material ? deck->given.drum_material : container;
    return true;
}

static bool are_equal(const struct mill_deck_law *a, const struct mill_deck_law *b)
{
    return restitution_of(a) == restitution_of(b) && a->speed == b->speed && a->rows == b->rows &&
           a->friction == b->friction && a->tangential == b->tangential;
}

/* Adds the laws of all kinds of balls with this partner (NULL: with balls of the same kind and of
 * each other kind) to *law, from which they must not differ. *remark "": there is no law yet. false
 * in *known_all: a material is not given. */
static enum mill_status add_pairs(const struct mill_deck *deck, int kind,
                                  const struct mill_deck_found *with, struct mill_deck_law *law,
                                  char *remark, bool *known_all, struct mill_error *error)
{
    const struct mill_deck_block named = {.title = "balls", .named = true};
    const struct mill_deck_section *s = mill_deck_next(&deck->text, &named, NULL);
    struct mill_deck_found ball, first = {.remark = NULL};
    do {
        const struct mill_deck_balls *balls = s ? s->form : &deck->given.alike;
        const char *title = s ? s->title : "balls";
        char text[MILL_DECK_REMARK];
        if (!balls->material) {
            *known_all = false;
            return MILL_OK;
        }
        const enum mill_status status =
            mill_deck_materials_find(deck, title, "material", balls->material, &ball, error);
        if (status != MILL_OK)
            return status;
        if (!first.remark)
            first = ball;
        const struct mill_deck_law is = pair(&ball, with ? with : &first, text);
        if (*remark && !are_equal(&is, law))
            return mill_deck_fault(&deck->text, error, title, "material",
                                   "contacts %s have one law, but join several pairs of materials: "
                                   "give the law in [contact.%s]",
                                   deck->mill.contacts.name[kind], deck->mill.contacts.name[kind]);
        *law = is;
        memcpy(remark, text, sizeof text);
    } while (s && (s = mill_deck_next(&deck->text, &named, s)));
    return MILL_OK;
}

/* The law of this kind of contact by its materials. *remark "": they are not given */
static enum mill_status find_pair(const struct mill_deck *deck, int kind, struct mill_deck_law *law,
                                  char *remark, struct mill_error *error)
{
    const char *material, *section;
    struct mill_deck_found with;
    bool known_all = true;
    enum mill_status status = MILL_OK;
    *remark = '\0';
    if (deck->given.between) {
        status =
            mill_deck_materials_find(deck, "contact", "between", deck->given.between, &with, error);
        *law = with.is.law;
        if (status == MILL_OK)
            snprintf(remark, MILL_DECK_REMARK, "%s between%s%s", with.name,
                     *with.remark ? ": " : "", with.remark);
        return status;
    }
    if (kind == MILL_BALL_BALL)
        status = add_pairs(deck, kind, NULL, law, remark, &known_all, error);
    for (int k = -2; kind != MILL_BALL_BALL && status == MILL_OK && known_all &&
                     next_partner(deck, kind, &k, &material, &section);) {
        known_all = material != NULL;
        if (known_all)
            status = mill_deck_materials_find(deck, section, "material", material, &with, error);
        if (status == MILL_OK && known_all)
            status = add_pairs(deck, kind, &with, law, remark, &known_all, error);
    }
    if (!known_all)
        *remark = '\0';
    return status;
}

/* Fills in what the deck does not say of this kind of contact. */
static enum mill_status complete(struct mill_deck *deck, int kind, struct mill_error *error)
{
    struct mill_deck_law *law = &deck->mill.law[kind], by = {0};
    char remark[MILL_DECK_REMARK];
    const bool falls = law->rows || !isnan(law->restitution);
    if (falls && !isnan(law->friction) && !isnan(law->tangential))
        return MILL_OK;
    const enum mill_status status = find_pair(deck, kind, &by, remark, error);
    if (status != MILL_OK || !*remark)
        return status;
    const struct mill_deck_takes takes = {!falls, isnan(law->friction), isnan(law->tangential)};
    if (!falls) {
        law->restitution = by.restitution;
        law->speed = law->speed > 0.0 ? law->speed : by.speed;
        law->table = by.table;
        law->rows = by.rows;
    }
    law->friction = mill_deck_laws_first(law->friction, by.friction);
    law->tangential = mill_deck_laws_first(law->tangential, by.tangential);
    snprintf(deck->mill.assumed[kind], MILL_DECK_REMARK, "%.*s",
             (int)(falls ? strcspn(remark, ":") : strlen(remark)), remark);
    deck->mill.takes[kind] = takes;
    return MILL_OK;
}

/* Makes the law of a kind of contact from what is given and from the materials. */
static enum mill_status make_law(struct mill_deck *deck, int kind, struct mill_error *error)
{
    struct mill_deck_law *law = &deck->mill.law[kind];
    const enum mill_status status = complete(deck, kind, error);
    if (status != MILL_OK)
        return status;
    law->restitution = restitution_of(law);
    law->friction = mill_deck_laws_first(law->friction, 0.0);
    law->tangential = mill_deck_laws_first(law->tangential, 0.0);
    if (isnan(law->restitution))
        return tell_missing(deck, error);
    if (law->rows && law->speed > 0.0)
        return mill_deck_fault(&deck->text, error, "contact", "restitution_speed",
                               "the restitution of %s is a table of all speeds: leave it out",
                               deck->mill.contacts.name[kind]);
    if (law->rows)
        deck->mill.fall[kind] = *law->rows;
    else if (law->speed > 0.0)
        deck->mill.fall[kind] = (struct mill_fall){1, {law->speed}, {law->restitution}};
    return MILL_OK;
}

/* The sections [contact.KIND] of the printed deck hold the laws. If some follow from materials,
 * each kind has such a section. */
static enum mill_status keep_laws(struct mill_deck *deck, const bool *has, struct mill_error *error)
{
    bool assumed = false;
    for (int kind = 0; kind < deck->mill.contacts.count; kind++)
        assumed = assumed || deck->mill.assumed[kind][0];
    for (int kind = 0; kind < deck->mill.contacts.count; kind++) {
        char title[MILL_NAME_LENGTH + 16];
        snprintf(title, sizeof title, "contact.%s", deck->mill.contacts.name[kind]);
        struct mill_deck_section *s = mill_deck_section(&deck->text, title);
        if (has[kind] && assumed && !s) {
            char *copy = strdup(title);
            void *form = calloc(1, sizeof deck->mill.law[kind]);
            if (!copy || !form || mill_deck_section_add(&deck->text, copy, error) != MILL_OK) {
                free(copy);
                free(form);
                return mill_error_set(error, MILL_FAILED, "out of memory");
            }
            mill_deck_files_keep(&deck->text, copy);
            s = &deck->text.section[deck->text.sections - 1];
            s->form = form;
        }
        if (!s || !has[kind])
            continue;
        memcpy(s->form, &deck->mill.law[kind], sizeof deck->mill.law[kind]);
        if (deck->mill.law[kind].rows) /* the table gives it */
            ((struct mill_deck_law *)s->form)->restitution = (double)NAN;
    }
    if (!assumed && restitution_of(&deck->given.general) >= 0.0) {
        deck->given.general.friction = mill_deck_laws_first(deck->given.general.friction, 0.0);
        deck->given.general.tangential = mill_deck_laws_first(deck->given.general.tangential, 0.0);
    }
    return MILL_OK;
}

enum mill_status mill_deck_laws_list(struct mill_deck *deck, const bool *has,
                                     struct mill_error *error)
{
    const struct mill_deck_law none = {0};
    enum mill_status status = MILL_OK;
    for (int kind = 0; kind < deck->mill.contacts.count && status == MILL_OK; kind++) {
        if (has[kind])
            status = make_law(deck, kind, error);
        else
            deck->mill.law[kind] = none;
    }
    return status == MILL_OK ? keep_laws(deck, has, error) : status;
}
