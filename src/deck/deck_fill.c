/* From entries to struct mill_deck, and out again: for every key of the table, in every section
 * that has it, the entry's value or the default. Whatever one key alone can tell (missing, unit,
 * range) is checked here; values that follow from other keys are worked out here. */
#include "deck/deck_private.h"

#include <assert.h>
#include <errno.h>
#include <limits.h>
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

struct filling {
    struct mill_deck *deck;
    const struct mill_units *units;
    struct mill_error *error;
};

static enum mill_status no_memory(struct mill_error *error)
{
    return mill_error_set(error, MILL_FAILED, "out of memory");
}

static enum mill_status refuse(const struct filling *f, const struct mill_deck_section *section,
                               const struct mill_key *key, const char *why)
{
    return mill_deck_fault(f->deck, f->error, section->title, key->name, "%s", why);
}

/* The struct that the block's keys count from, in this section of its own */
static void *home_of(const struct mill_deck *deck, const struct mill_deck_block *block,
                     const struct mill_deck_section *section)
{
    return block->named ? section->form : (char *)deck + block->home;
}

/* Do the keys of the block stand in other sections of this deck, those with a NAME? */
static bool is_elsewhere(const struct mill_deck *deck, const struct mill_deck_block *block)
{
    const struct mill_deck_block named = {.title = block->title, .named = true};
    return block->unless_named && mill_deck_text_next(deck->text, &named, NULL);
}

static enum mill_status fill_key(const struct filling *f, const struct mill_deck_block *block,
                                 const struct mill_key *key,
                                 const struct mill_deck_section *section)
{
    const struct mill_deck_entry *entry = mill_deck_text_entry(section, key->name);
    const struct mill_deck_entry *other =
        key->instead ? mill_deck_text_entry(section, key->instead) : NULL;
    void *home = home_of(f->deck, block, section);
    struct mill_error why;
    char wanted[120];
    if (is_elsewhere(f->deck, block))
        return !entry ? MILL_OK
                      : refuse(f, section, key,
                               "belongs in the sections [balls.NAME] of this mixture");
    if (key->needs && key->hidden(home))
        return entry ? refuse(f, section, key, key->needs) : MILL_OK;
    if (entry && other && !entry->origin.override == !other->origin.override)
        return refuse(f, section, key,
                      "'count' and 'fill' both set the number of balls; give only one of them");
    if (other && !(entry && entry->origin.override)) /* an override of one replaces the other */
        return MILL_OK;
    if (!entry && (key->derived || block->inherits))
        return MILL_OK;
    if (!entry && !key->preset) {
        mill_deck_value_wanted(key, false, wanted, sizeof wanted);
        return mill_deck_fault(f->deck, f->error, section->title, key->name,
                               "missing (%s); expected %s", key->meaning, wanted);
    }
    if (entry && entry->quoted && key->type != MILL_KEY_FILE)
        return refuse(f, section, key, "only file names are put in double quotes");
    const char *text = entry ? entry->value : key->preset;
    return mill_deck_value_read(f->units, key, text, home, &why)
               ? MILL_OK
               : refuse(f, section, key, why.text);
}

static enum mill_status fill_section(const struct filling *f, const struct mill_deck_block *block,
                                     struct mill_deck_section *section)
{
    enum mill_status status = MILL_OK;
    if (block->named) {
        assert(!section->form); /* one block for each named section */
        section->form = calloc(1, block->size);
        if (!section->form)
            return no_memory(f->error);
        if (block->inherits)
            memcpy(section->form, (char *)f->deck + block->home, block->size);
    }
    for (const struct mill_key *key = block->key; key->name && status == MILL_OK; key++)
        status = fill_key(f, block, key, section);
    return status;
}

/* What the number of equal blades leaves open: blade k = 0.. is centred at x = -L/2 + (k + 1/2)
 * L/count and points at k angle_step. */
static bool spread_blades(struct mill_deck *deck)
{
    struct mill_deck_blades *all = &deck->blades;
    const double length = deck->drum_length, count = (double)all->count;
    if (all->count > 0 &&
        !mill_deck_text_entry(mill_deck_text_section(deck->text, "blades"), "angle_step"))
        all->angle_step = 2.0 * MILL_PI / count;
    deck->blade = calloc((size_t)all->count + 1, sizeof *deck->blade);
    for (int k = 0; deck->blade && k < all->count; k++) {
        deck->blade[k] = all->form;
        deck->blade[k].position = (k + 0.5 - 0.5 * count) * (length / count);
        deck->blade[k].angle = k * all->angle_step;
    }
    return deck->blade;
}

/* Shapes of one type come one after the other. */
static void add_shape(struct mill_deck *deck, const struct mill_shape_type *type,
                      const char *section, const void *form)
{
    const struct mill_deck_shape *last = deck->shapes > 0 ? &deck->shape[deck->shapes - 1] : NULL;
    deck->shape[deck->shapes++] = (struct mill_deck_shape){
        .type = type,
        .section = section,
        .form = form,
        .number = last && last->type == type ? last->number + 1 : 0,
    };
}

/* The blades of [blades], then those shapes that have sections of their own */
static enum mill_status list_shapes(struct mill_deck *deck, struct mill_error *error)
{
    const struct mill_deck_text *text = deck->text;
    const size_t most = (size_t)deck->blades.count + (size_t)text->sections;
    /* the engine numbers surfaces so far: drum, end walls, shaft and these */
    assert(most <= INT16_MAX - 4);
    deck->shape = calloc(most + 1, sizeof *deck->shape);
    if (!deck->shape || !spread_blades(deck))
        return no_memory(error);
    for (int k = 0; k < deck->blades.count; k++)
        add_shape(deck, &mill_blade_type, "blades", &deck->blade[k]);
    struct mill_deck_block block;
    for (int i = 0; mill_deck_table_block(i, &block); i++) {
        struct mill_deck_section *s = NULL;
        while (block.shape && (s = mill_deck_text_next(text, &block, s)))
            add_shape(deck, block.shape, s->title, s->form);
    }
    return MILL_OK;
}

/* Lists balls of one kind, and turns their share of the drum's volume, pi R^2 L whatever stands in
 * it, into their number. */
static enum mill_status add_balls(struct mill_deck *deck, const char *section,
                                  struct mill_deck_balls *balls, struct mill_error *error)
{
    const double volume = MILL_PI * deck->drum_radius * deck->drum_radius * deck->drum_length;
    const double d = balls->diameter, one = MILL_PI / 6.0 * d * d * d;
    const double given = balls->fill * volume / one, count = round(given);
    const char *dot = strchr(section, '.');
    if (balls->fill > 0.0 && !(count >= 1.0 && count <= MILL_DECK_MOST_BALLS))
        return mill_deck_fault(deck, error, section, "fill",
                               "gives %.3g balls of %g m; expected 1 to %d", given, d,
                               MILL_DECK_MOST_BALLS);
    if (balls->fill > 0.0)
        balls->count = (long)count;
    balls->section = section;
    balls->name = dot ? dot + 1 : section;
    deck->balls[deck->kinds++] = *balls;
    deck->all += balls->count;
    return MILL_OK;
}

static enum mill_status list_balls(struct mill_deck *deck, struct mill_error *error)
{
    const struct mill_deck_block named = {.title = "balls", .named = true};
    struct mill_deck_section *s = NULL;
    enum mill_status status = MILL_OK;
    deck->balls = calloc((size_t)deck->text->sections, sizeof *deck->balls);
    if (!deck->balls)
        return no_memory(error);
    while (status == MILL_OK && (s = mill_deck_text_next(deck->text, &named, s)))
        status = add_balls(deck, s->title, s->form, error);
    if (status == MILL_OK && deck->kinds == 0)
        status = add_balls(deck, "balls", &deck->alike, error);
    return status;
}

static void list_laws(struct mill_deck *deck)
{
    for (int kind = 0; kind < MILL_KINDS; kind++) {
        char title[40];
        snprintf(title, sizeof title, "contact.%s", mill_kind_name[kind]);
        const struct mill_deck_section *own = mill_deck_text_section(deck->text, title);
        deck->law[kind] = own ? *(const struct mill_law *)own->form : deck->general;
    }
}

/* Makes the start file's name absolute, relative names counted from the deck's folder. */
static enum mill_status resolve_start(struct mill_deck *deck, struct mill_error *error)
{
    const char *file = deck->text->file, *slash = strrchr(file, '/');
    char here[PATH_MAX] = "", path[PATH_MAX];
    if (!deck->start)
        return MILL_OK;
    const bool whole = deck->start[0] == '/';
    if (!whole && file[0] != '/' && !getcwd(here, sizeof here - 1))
        return mill_error_set(error, MILL_FAILED, "the current folder has no name: %s",
                              strerror(errno));
    if (here[0] && here[strlen(here) - 1] != '/')
        strcat(here, "/");
    const int folder = whole || !slash ? 0 : (int)(slash - file + 1);
    if (snprintf(path, sizeof path, "%s%.*s%s", here, folder, file, deck->start) >= PATH_MAX)
        return mill_deck_fault(deck, error, "balls", "start", "the name of the file is too long");
    free(deck->start);
    deck->start = strdup(path);
    return deck->start ? MILL_OK : no_memory(error);
}

enum mill_status mill_deck_fill(struct mill_deck *deck, const struct mill_units *units,
                                struct mill_error *error)
{
    const struct filling f = {.deck = deck, .units = units, .error = error};
    struct mill_deck_block block;
    enum mill_status status = MILL_OK;
    for (int i = 0; status == MILL_OK && mill_deck_table_block(i, &block); i++) {
        struct mill_deck_section *s = NULL;
        while (status == MILL_OK && (s = mill_deck_text_next(deck->text, &block, s)))
            status = fill_section(&f, &block, s);
    }
    if (status != MILL_OK)
        return status;
    deck->sample_found =
        deck->precision > 0.0 &&
        !mill_deck_text_entry(mill_deck_text_section(deck->text, "run"), "sample_from");
    deck->rotor = mill_deck_text_section(deck->text, "rotor") != NULL;
    list_laws(deck);
    status = list_balls(deck, error);
    if (status == MILL_OK)
        status = list_shapes(deck, error);
    return status == MILL_OK ? resolve_start(deck, error) : status;
}

/* Is it off, said by another key, or yet to be found? */
static bool says_nothing(const struct mill_key *key, const void *home)
{
    const void *value = (const char *)home + key->offset;
    return (key->hidden && key->hidden(home)) ||
           (key->zero_is_off && *(const double *)value == 0.0);
}

void mill_deck_each(const struct mill_deck *deck,
                    void (*entry)(void *self, const char *section, const char *key,
                                  const char *value, const char *meaning),
                    void *self)
{
    char value[2 * PATH_MAX + 8];
    struct mill_deck_block block;
    for (int i = 0; mill_deck_table_block(i, &block); i++) {
        const struct mill_deck_section *s = NULL;
        while (!is_elsewhere(deck, &block) && (s = mill_deck_text_next(deck->text, &block, s))) {
            const void *home = home_of(deck, &block, s);
            for (const struct mill_key *key = block.key; key->name; key++) {
                if (says_nothing(key, home))
                    continue;
                mill_deck_value_print(key, home, value, sizeof value);
                entry(self, s->title, key->name, value, key->meaning);
            }
        }
    }
}

struct mill_setup_drum mill_deck_drum(const struct mill_deck *deck)
{
    return (struct mill_setup_drum){
        .radius = deck->drum_radius,
        .length = deck->drum_length,
        .buckles = deck->wavy ? (int)deck->buckles : 0,
        .buckle_height = deck->wavy ? deck->buckle_height : 0.0,
        .buckle_angle = deck->wavy ? deck->buckle_angle : 0.0,
    };
}
