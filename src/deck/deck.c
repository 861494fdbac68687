/* The deck's public functions, and the values: for every key of the table, in every section that
 * has it, the value of the entry or the default. This file checks what concerns one key alone
 * (missing, unit, range), and computes the values that follow from other keys. The rest:
 * deck_parse.c reads the file, deck_table.c lists what it may contain, deck_value.c converts
 * between text and numbers, deck_check.c checks keys against each other. */
#include "deck/deck_private.h"

#include <assert.h>
#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The struct that the block's keys of this section are in */
static void *values_of(const struct mill_deck *deck, const struct mill_deck_block *block,
                       const struct mill_deck_section *section)
{
    return block->named ? section->form : (char *)deck + block->values;
}

/* True if [TITLE.NAME] sections of this deck have the block's keys instead */
static bool is_elsewhere(const struct mill_deck *deck, const struct mill_deck_block *block)
{
    const struct mill_deck_block named = {.title = block->title, .named = true};
    return block->unless_named && mill_deck_next(deck, &named, NULL);
}

static enum mill_status fill_key(struct mill_deck *deck, const struct mill_deck_block *block,
                                 const struct mill_key *key,
                                 const struct mill_deck_section *section, struct mill_error *error)
{
    const struct mill_deck_entry *entry = mill_deck_entry(section, key->name);
    const struct mill_deck_entry *other =
        key->instead ? mill_deck_entry(section, key->instead) : NULL;
    void *values = values_of(deck, block, section);
    const bool elsewhere = is_elsewhere(deck, block), hidden = key->needs && key->hidden(values);
    const char *wrong = NULL;
    struct mill_error why;
    char wanted[120];
    if (!entry && key->hidden && key->hidden(values)) {
        return MILL_OK;
    } else if (elsewhere || hidden) {
        if (entry)
            wrong = hidden ? key->needs : "belongs in the sections [balls.NAME] of this mixture";
    } else if (entry && other && !entry->origin.override == !other->origin.override) {
        wrong = "'count' and 'fill' both set the number of balls; give only one of them";
    } else if (other && !(entry && entry->origin.override)) {
        return MILL_OK; /* an override of one key replaces the other */
    } else if (!entry && (key->derived || block->inherits)) {
        return MILL_OK;
    } else if (!entry && !key->preset) {
        mill_deck_value_wanted(key, false, wanted, sizeof wanted);
        return mill_deck_fault(deck, error, section->title, key->name, "missing (%s); expected %s",
                               key->meaning, wanted);
    } else if (entry && entry->quoted && key->type != MILL_KEY_FILE) {
        wrong = "double quotes are only allowed around the name of a file";
    } else if (!mill_deck_value_read(deck->units, key, entry ? entry->value : key->preset, values,
                                     &why)) {
        wrong = why.text;
    }
    return wrong ? mill_deck_fault(deck, error, section->title, key->name, "%s", wrong) : MILL_OK;
}

/* Iterates over blocks of sections: all blocks of a section, then those of the next section of its
 * kind */
struct walk {
    int first, at; /* number of the first block of this kind of section; of the present block */
    struct mill_deck_section *section;
    struct mill_deck_block block; /* number `at`, of this section */
};

/* Does the block belong to this section? The section's first block has been read. */
static bool applies(const struct mill_deck_block *block, const struct mill_deck_section *section)
{
    return block->words == 0 || (block->words >> *(const int *)section->form & 1u);
}

/* Starts from {0}; false: no more blocks. */
static bool walk_on(const struct mill_deck *deck, struct walk *w)
{
    struct mill_deck_block first;
    w->at += w->section != NULL;
    while (mill_deck_table_block(w->first, &first)) {
        for (; mill_deck_table_block(w->at, &w->block) &&
               strcmp(w->block.title, first.title) == 0 && w->block.named == first.named;
             w->at++)
            if (w->section && applies(&w->block, w->section))
                return true;
        w->section = mill_deck_next(deck, &first, w->section);
        if (w->section)
            w->at = w->first;
        else
            w->first = w->at;
    }
    return false;
}

/* Checks that every key of the section belongs to the section's kind of motion or shape. */
static enum mill_status check_entries(const struct mill_deck *deck,
                                      const struct mill_deck_section *section,
                                      struct mill_error *error)
{
    for (int e = 0; e < section->entries; e++) {
        const char *name = section->entry[e].key;
        const struct mill_key *choice = NULL;
        struct mill_deck_block block;
        unsigned words = 0;
        bool belongs = false;
        for (int i = 0; !belongs && mill_deck_table_block(i, &block); i++) {
            if (!mill_deck_table_belongs(&block, section->title))
                continue;
            choice = choice ? choice : block.key;
            for (const struct mill_key *key = block.key; key->name && !belongs; key++)
                if (strcmp(key->name, name) == 0) {
                    belongs = applies(&block, section);
                    words |= block.words;
                }
        }
        char own[32], of[160] = "", word[32];
        if (belongs)
            continue;
        for (int n = 0; n < 32; n++) {
            if (words >> n & 1u) {
                mill_deck_value_word(choice, n, word, sizeof word);
                strcat(strcat(of, of[0] ? ", " : ""), word);
            }
        }
        mill_deck_value_word(choice, *(const int *)section->form, own, sizeof own);
        return mill_deck_fault(deck, error, section->title, name,
                               "does not belong to '%s = %s' (only to: %s): leave it out",
                               choice->name, own, of);
    }
    return MILL_OK;
}

static enum mill_status fill_block(struct mill_deck *deck, const struct mill_deck_block *block,
                                   struct mill_deck_section *section, struct mill_error *error)
{
    enum mill_status status = MILL_OK;
    const bool first = block->named && !section->form;
    if (first) {
        section->form = calloc(1, block->size);
        if (!section->form)
            return mill_error_set(error, MILL_FAILED, "out of memory");
        if (block->inherits)
            memcpy(section->form, (char *)deck + block->values, block->size);
    }
    for (const struct mill_key *key = block->key; key->name && status == MILL_OK; key++)
        status = fill_key(deck, block, key, section, error);
    return status == MILL_OK && first ? check_entries(deck, section, error) : status;
}

/* Shapes of the same type must be added one after the other. */
static void add_shape(struct mill_deck *deck, const struct mill_shape_type *type,
                      const char *section, const void *form)
{
    const struct mill_deck_shape *last = deck->shapes > 0 ? &deck->shape[deck->shapes - 1] : NULL;
    const int number = last && last->type == type ? last->number + 1 : 0;
    deck->shape[deck->shapes++] = (struct mill_deck_shape){type, section, form, number};
}

/* Lists the blades of [blades], then the shapes with sections of their own. Equal blades: number k
 * = 0.. has its centre at x = -L/2 + (k + 1/2) L/count and points at the angle k angle_step. */
static enum mill_status list_shapes(struct mill_deck *deck, struct mill_error *error)
{
    struct mill_deck_blades *all = &deck->blades;
    const double length = deck->drum_length, count = (double)all->count;
    const size_t most = (size_t)all->count + (size_t)deck->sections;
    /* the engine's numbers of surfaces are int16_t: drum, end walls, shaft and these */
    assert(most <= INT16_MAX - 4);
    deck->shape = calloc(most + 1, sizeof *deck->shape);
    deck->blade = calloc((size_t)all->count + 1, sizeof *deck->blade);
    if (!deck->shape || !deck->blade)
        return mill_error_set(error, MILL_FAILED, "out of memory");
    if (all->count > 0 && !mill_deck_entry(mill_deck_section(deck, "blades"), "angle_step"))
        all->angle_step = 2.0 * MILL_PI / count;
    for (int k = 0; k < all->count; k++) {
        deck->blade[k] = all->form;
        deck->blade[k].position = (k + 0.5 - 0.5 * count) * (length / count);
        deck->blade[k].angle = k * all->angle_step;
        add_shape(deck, &mill_blade_type, "blades", &deck->blade[k]);
    }
    struct mill_deck_block block;
    for (int i = 0; mill_deck_table_block(i, &block); i++) {
        struct mill_deck_section *s = NULL;
        while (block.shape && (s = mill_deck_next(deck, &block, s)))
            add_shape(deck, block.shape, s->title, s->form);
    }
    return MILL_OK;
}

/* Lists the kinds of balls. Converts a fill to a number of balls; it is a fraction of the empty
 * container's volume. */
static enum mill_status list_balls(struct mill_deck *deck, struct mill_error *error)
{
    const double volume = mill_deck_bodies_volume(deck);
    const struct mill_deck_block named = {.title = "balls", .named = true};
    const struct mill_deck_section *s = mill_deck_next(deck, &named, NULL);
    deck->balls = calloc((size_t)deck->sections, sizeof *deck->balls);
    if (!deck->balls)
        return mill_error_set(error, MILL_FAILED, "out of memory");
    do {
        struct mill_deck_balls *balls = s ? s->form : &deck->alike;
        const double d = balls->diameter, one = MILL_PI / 6.0 * d * d * d;
        const double given = balls->fill * volume / one, count = round(given);
        balls->section = s ? s->title : "balls";
        balls->name = s ? strchr(s->title, '.') + 1 : "balls";
        if (balls->fill > 0.0 && !(count >= 1.0 && count <= MILL_DECK_MOST_BALLS))
            return mill_deck_fault(deck, error, balls->section, "fill",
                                   "gives %.3g balls of %g m; expected 1 to %d", given, d,
                                   MILL_DECK_MOST_BALLS);
        if (balls->fill > 0.0)
            balls->count = (long)count;
        deck->balls[deck->kinds++] = *balls;
        deck->all += balls->count;
    } while (s && (s = mill_deck_next(deck, &named, s)));
    return MILL_OK;
}

/* Does any surface of the mill have this kind of contact? */
static bool has_kind(const struct mill_deck *deck, int kind)
{
    bool has = deck->drum || kind == MILL_BALL_BALL || kind >= MILL_KINDS;
    for (int k = 0; k < deck->bodies && !has; k++)
        has = deck->body[k].kind == kind;
    return has;
}

/* Fills each[kinds], structs of `size` bytes, with `general` and with the values of the sections
 * [TITLE.KIND]. */
static enum mill_status list_by_kind(struct mill_deck *deck, const char *title, const void *general,
                                     void *each, size_t size, struct mill_error *error)
{
    const struct mill_deck_block named = {.title = title, .named = true};
    const struct mill_kinds *kinds = &deck->contacts;
    char known[MILL_KINDS_MOST * (MILL_KINDS_LENGTH + 2)] = "";
    for (int kind = 0; kind < kinds->count; kind++) {
        memcpy((char *)each + size * (size_t)kind, general, size);
        if (has_kind(deck, kind))
            strcat(strcat(known, kind > 0 ? ", " : ""), kinds->name[kind]);
    }
    for (const struct mill_deck_section *s = NULL; (s = mill_deck_next(deck, &named, s));) {
        int kind = 0;
        while (kind < kinds->count &&
               (strcmp(strchr(s->title, '.') + 1, kinds->name[kind]) != 0 || !has_kind(deck, kind)))
            kind++;
        if (kind == kinds->count)
            return mill_deck_fault(deck, error, s->title, NULL,
                                   "unknown kind of contact; there are %s", known);
        memcpy((char *)each + size * (size_t)kind, s->form, size);
    }
    return MILL_OK;
}

static enum mill_status list_laws(struct mill_deck *deck, struct mill_error *error)
{
    const enum mill_status status =
        list_by_kind(deck, "contact", &deck->general, deck->law, sizeof *deck->law, error);
    return status == MILL_OK
               ? list_by_kind(deck, "wear", &deck->worn, deck->wear, sizeof *deck->wear, error)
               : status;
}

static enum mill_status fill(struct mill_deck *deck, struct mill_error *error)
{
    struct walk walk = {0};
    enum mill_status status = MILL_OK;
    deck->drum = mill_deck_section(deck, "drum") != NULL;
    deck->kept = calloc(2 * (size_t)deck->sections + 2, sizeof *deck->kept);
    deck->file_named = calloc((size_t)deck->sections + 1, sizeof *deck->file_named);
    if (!deck->kept || !deck->file_named)
        return mill_error_set(error, MILL_FAILED, "out of memory");
    while (status == MILL_OK && walk_on(deck, &walk))
        status = fill_block(deck, &walk.block, walk.section, error);
    if (status != MILL_OK)
        return status;
    deck->sample_found =
        deck->precision > 0.0 && !mill_deck_entry(mill_deck_section(deck, "run"), "sample_from");
    deck->rotor = mill_deck_section(deck, "rotor") != NULL;
    static enum mill_status (*const list[])(struct mill_deck *, struct mill_error *) = {
        mill_deck_motions_list, mill_deck_bodies_list, list_laws, list_balls, list_shapes,
        mill_deck_powder_list};
    for (size_t i = 0; status == MILL_OK && i < sizeof list / sizeof *list; i++)
        status = list[i](deck, error);
    return status == MILL_OK && deck->start
               ? mill_deck_files_find(deck, "balls", "start", deck->start, &deck->start, error)
               : status;
}

enum mill_status mill_deck_read(const char *path, int count, const char *const *overrides,
                                void (*warn)(const char *line), struct mill_deck **deck,
                                struct mill_error *error)
{
    struct mill_deck *made = *deck = calloc(1, sizeof *made);
    if (!made)
        return mill_error_set(error, MILL_FAILED, "out of memory");
    made->warn = warn;
    enum mill_status status = mill_deck_parse(made, path, count, overrides, error);
    if (status == MILL_OK)
        status = mill_units_create(&made->units, error);
    if (status == MILL_OK)
        status = fill(made, error);
    if (status == MILL_OK)
        status = mill_deck_check(made, error);
    mill_units_free(made->units);
    made->units = NULL;
    if (status == MILL_OK)
        return MILL_OK;
    mill_deck_free(made);
    *deck = NULL;
    return status;
}

void mill_deck_each(const struct mill_deck *deck,
                    void (*entry)(void *self, const char *section, const char *key,
                                  const char *value, const char *meaning),
                    void *self)
{
    char value[2 * PATH_MAX + 8];
    struct walk walk = {0};
    while (walk_on(deck, &walk)) {
        const void *values = values_of(deck, &walk.block, walk.section);
        const bool elsewhere = is_elsewhere(deck, &walk.block);
        for (const struct mill_key *key = walk.block.key; key->name && !elsewhere; key++) {
            const void *value_at = (const char *)values + key->offset;
            /* skip keys that are off, replaced by another key, or found in the run */
            if ((key->hidden && key->hidden(values)) ||
                (key->zero_is_off && *(const double *)value_at == 0.0) ||
                (key->type == MILL_KEY_NAME && !*(const char *const *)value_at))
                continue;
            mill_deck_value_print(key, values, value, sizeof value);
            entry(self, walk.section->title, key->name, value, key->meaning);
        }
    }
}

struct page {
    FILE *out;
    const char *section; /* the one being printed */
};

static void print_entry(void *self, const char *section, const char *key, const char *value,
                        const char *meaning)
{
    enum { COLUMN = 48 };
    struct page *page = self;
    if (strcmp(page->section, section) != 0) {
        page->section = section;
        fprintf(page->out, "\n[%s]\n", section);
    }
    const int used = fprintf(page->out, "%s = %s", key, value);
    fprintf(page->out, "%*s# %s\n", used > 0 && used < COLUMN ? COLUMN - used : 1, "", meaning);
}

void mill_deck_print(const struct mill_deck *deck, FILE *out)
{
    struct page page = {.out = out, .section = ""};
    fprintf(out, "# The full deck, defaults filled in, in SI units\n");
    mill_deck_each(deck, print_entry, &page);
}
