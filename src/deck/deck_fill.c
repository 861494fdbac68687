/* From entries to struct mill_deck: for every key of the table, in every section that has it, the
 * entry's value or the default. Whatever one key alone can tell (missing, unit, range) is checked
 * here; values that follow from other keys are worked out here. */
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

/* "FILE:LINE: [section] key: why" */
static enum mill_status refuse(const struct filling *f, const struct mill_deck_section *section,
                               const struct mill_deck_entry *entry, const struct mill_key *key,
                               const char *why)
{
    char where[MILL_DECK_WHERE];
    mill_deck_text_where(f->deck->text, section, entry, where);
    return mill_error_set(f->error, MILL_BAD_DECK, "%s: [%s] %s: %s", where, section->title,
                          key->name, why);
}

void *mill_deck_fill_home(const struct mill_deck *deck, const struct mill_deck_block *block,
                          const struct mill_deck_section *section)
{
    return block->named ? section->form : (char *)deck + block->home;
}

bool mill_deck_fill_elsewhere(const struct mill_deck *deck, const struct mill_deck_block *block)
{
    return block->unless_named && mill_deck_text_named(deck->text, block->title) > 0;
}

static enum mill_status tell_missing(const struct filling *f, const struct mill_key *key,
                                     const struct mill_deck_section *section)
{
    char wanted[120], text[300];
    mill_deck_value_wanted(key, wanted, sizeof wanted);
    snprintf(text, sizeof text, "missing (%s); expected %s", key->meaning, wanted);
    return refuse(f, section, NULL, key, text);
}

static enum mill_status fill_key(const struct filling *f, const struct mill_deck_block *block,
                                 const struct mill_key *key,
                                 const struct mill_deck_section *section)
{
    const struct mill_deck_entry *entry = mill_deck_text_entry(section, key->name);
    const struct mill_deck_entry *other =
        key->instead ? mill_deck_text_entry(section, key->instead) : NULL;
    void *home = mill_deck_fill_home(f->deck, block, section);
    struct mill_error why;
    if (entry && mill_deck_fill_elsewhere(f->deck, block))
        return refuse(f, section, entry, key,
                      "belongs in the sections [balls.NAME] of this mixture");
    if (mill_deck_fill_elsewhere(f->deck, block))
        return MILL_OK;
    if (key->needs && key->hidden(home))
        return entry ? refuse(f, section, entry, key, key->needs) : MILL_OK;
    if (entry && other && !entry->override == !other->override)
        return refuse(f, section, entry, key,
                      "'count' and 'fill' both set the number of balls; give only one of them");
    if (other && !(entry && entry->override)) /* an override of one replaces the other */
        return MILL_OK;
    if (!entry && (key->derived || block->inherits))
        return MILL_OK;
    if (!entry && !key->preset)
        return tell_missing(f, key, section);
    if (entry && entry->quoted && key->type != MILL_KEY_FILE)
        return refuse(f, section, entry, key, "only file names are put in double quotes");
    if (!mill_deck_value_read(f->units, key, entry ? entry->value : key->preset, home, &why))
        return refuse(f, section, entry, key, why.text);
    return MILL_OK;
}

static enum mill_status fill_section(const struct filling *f, const struct mill_deck_block *block,
                                     struct mill_deck_section *section)
{
    enum mill_status status = MILL_OK;
    if (block->named) {
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

/* The blades of [blades], then those shapes that have sections of their own */
static enum mill_status list_shapes(struct mill_deck *deck, struct mill_error *error)
{
    const struct mill_deck_text *text = deck->text;
    const size_t most = (size_t)deck->blades.count + (size_t)text->sections;
    assert(most <=
           INT16_MAX - 4); /* the engine counts surfaces so far: drum, walls, shaft, these */
    deck->shape = calloc(most + 1, sizeof *deck->shape);
    if (!deck->shape || !spread_blades(deck))
        return no_memory(error);
    for (int k = 0; k < deck->blades.count; k++)
        deck->shape[deck->shapes++] = (struct mill_deck_shape){
            .type = &mill_blade_type, .section = "blades", .form = &deck->blade[k], .number = k};
    struct mill_deck_block block;
    for (int i = 0; mill_deck_table_block(i, &block); i++) {
        int number = block.shape == &mill_blade_type ? (int)deck->blades.count : 0;
        struct mill_deck_section *s = NULL;
        while (block.shape && (s = mill_deck_text_next(text, &block, s)))
            deck->shape[deck->shapes++] = (struct mill_deck_shape){
                .type = block.shape, .section = s->title, .form = s->form, .number = number++};
    }
    return MILL_OK;
}

/* The number of balls from their share of the drum's volume, pi R^2 L, whatever stands in it */
static enum mill_status count_balls(const struct mill_deck *deck, const char *title,
                                    struct mill_deck_balls *balls, struct mill_error *error)
{
    const double volume = MILL_PI * deck->drum_radius * deck->drum_radius * deck->drum_length;
    const double d = balls->diameter;
    if (balls->fill == 0.0)
        return MILL_OK;
    const double given = balls->fill * volume / (MILL_PI / 6.0 * d * d * d);
    const double count = round(given);
    if (!(count >= 1.0 && count <= MILL_DECK_MOST_BALLS))
        return mill_deck_fault(deck, error, title, "fill",
                               "gives %.3g balls of %g m; expected 1 to %d", given, d,
                               MILL_DECK_MOST_BALLS);
    balls->count = (long)count;
    return MILL_OK;
}

static enum mill_status list_balls(struct mill_deck *deck, struct mill_error *error)
{
    const struct mill_deck_block named = {.title = "balls", .named = true};
    const int kinds = mill_deck_text_named(deck->text, "balls");
    struct mill_deck_section *s = NULL;
    deck->balls = calloc((size_t)kinds + 1, sizeof *deck->balls);
    if (!deck->balls)
        return no_memory(error);
    if (kinds == 0) {
        const enum mill_status status = count_balls(deck, "balls", &deck->alike, error);
        snprintf(deck->alike.name, MILL_NAME_LENGTH, "balls");
        deck->balls[deck->kinds++] = deck->alike;
        return status;
    }
    while ((s = mill_deck_text_next(deck->text, &named, s))) {
        struct mill_deck_balls *balls = s->form;
        const enum mill_status status = count_balls(deck, s->title, balls, error);
        if (status != MILL_OK)
            return status;
        snprintf(balls->name, MILL_NAME_LENGTH, "%s", s->title + strlen("balls."));
        deck->balls[deck->kinds++] = *balls;
    }
    return MILL_OK;
}

static void list_laws(struct mill_deck *deck)
{
    for (int kind = 0; kind < MILL_KINDS; kind++) {
        char title[MILL_NAME_LENGTH];
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
