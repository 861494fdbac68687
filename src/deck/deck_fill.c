/* From entries to struct mill_deck: for every key of the table, in every section that has it, the
 * entry's value or the default. Whatever one key alone can tell (missing, unit, range) is checked
 * here; defaults that follow from other keys are worked out here. */
#include "deck/deck_private.h"

#include <errno.h>
#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const double turn = 6.283185307179586; /* [rad] */

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
                               const struct mill_deck_entry *entry, const struct mill_deck_key *key,
                               const char *why)
{
    char where[MILL_DECK_WHERE];
    mill_deck_text_where(f->deck->text, section, entry, where);
    return mill_error_set(f->error, MILL_BAD_DECK, "%s: [%s] %s: %s", where,
                          section ? section->title : mill_deck_table_title(key->part), key->name,
                          why);
}

void *mill_deck_fill_home(const struct mill_deck *deck, const struct mill_deck_key *key,
                          const struct mill_deck_section *section, int index)
{
    switch (key->home) {
    case DECK_IN_DECK:
        return (void *)deck;
    case DECK_IN_BALLS:
        return &deck->balls[index];
    case DECK_IN_BLADES:
        return &deck->text->blades;
    case DECK_IN_BLADE:
        return &deck->blade[deck->text->blades.count + index];
    case DECK_IN_LAW:
        if (key->part == DECK_CONTACT)
            return &deck->text->law;
        for (int kind = 0; kind < MILL_KINDS; kind++)
            if (strcmp(section->name, mill_kind_name[kind]) == 0)
                return (void *)&deck->law[kind];
        break;
    case DECK_NOWHERE:
        break;
    }
    return NULL;
}

bool mill_deck_fill_is_share(const struct mill_deck_key *key)
{
    return key->home == DECK_IN_BALLS && key->offset == offsetof(struct mill_deck_balls, fill);
}

/* Count and fill say the same. An override of one drops the other; otherwise two are one too many.
 */
static enum mill_status settle_amount(const struct filling *f,
                                      const struct mill_deck_section *section,
                                      const struct mill_deck_key *key,
                                      const struct mill_deck_entry **entry, bool *needed)
{
    const bool share = mill_deck_fill_is_share(key);
    if (!share &&
        !(key->home == DECK_IN_BALLS && key->offset == offsetof(struct mill_deck_balls, count)))
        return MILL_OK;
    const struct mill_deck_entry *other = mill_deck_text_entry(section, share ? "count" : "fill");
    *needed = *needed && !other;
    if (!*entry || !other)
        return MILL_OK;
    if (!(*entry)->order == !other->order)
        return refuse(f, section, *entry, key, "'count' and 'fill' say the same; give one of them");
    if (other->order)
        *entry = NULL;
    return MILL_OK;
}

static enum mill_status fill_key(const struct filling *f, const struct mill_deck_key *key,
                                 const struct mill_deck_section *section, int index)
{
    const struct mill_deck_entry *entry = mill_deck_text_entry(section, key->name);
    void *home = mill_deck_fill_home(f->deck, key, section, index);
    struct mill_error why;
    bool needed = !key->preset;
    const enum mill_status status = settle_amount(f, section, key, &entry, &needed);
    if (status != MILL_OK)
        return status;
    if (!entry && (key->derived || (!key->preset && !needed)))
        return MILL_OK;
    if (key->wavy && !f->deck->wavy && !entry)
        return MILL_OK;
    if (key->wavy && !f->deck->wavy)
        return refuse(f, section, entry, key,
                      "belongs to the wavy profile: say 'profile = wavy' too, or leave it out");
    if (!entry && !key->preset) {
        char wanted[120], text[300];
        mill_deck_value_wanted(key, wanted, sizeof wanted);
        snprintf(text, sizeof text, "missing (%s); expected %s", key->meaning, wanted);
        return refuse(f, section, NULL, key, text);
    }
    if (entry && entry->quoted && key->type != DECK_FILE)
        return refuse(f, section, entry, key, "only file names are put in double quotes");
    if (!mill_deck_value_read(f->units, key, entry ? entry->value : key->preset, home, &why))
        return refuse(f, section, entry, key, why.text);
    return MILL_OK;
}

static enum mill_status fill_section(const struct filling *f, enum mill_deck_part part,
                                     const struct mill_deck_section *section, int index)
{
    const bool mixture = mill_deck_text_section(f->deck->text, DECK_BALLS_NAME, NULL) != NULL;
    for (int i = 0; i < mill_deck_table_length; i++) {
        const struct mill_deck_key *key = &mill_deck_table[i];
        if (key->part != part)
            continue;
        if (mixture && part == DECK_BALLS && key->home == DECK_IN_BALLS) {
            const struct mill_deck_entry *entry = mill_deck_text_entry(section, key->name);
            if (entry)
                return refuse(f, section, entry, key,
                              "belongs into the sections [balls.NAME] of this mixture");
            continue;
        }
        const enum mill_status status = fill_key(f, key, section, index);
        if (status != MILL_OK)
            return status;
    }
    return MILL_OK;
}

/* The sections of one part in their order; an unnamed one that is absent is filled with defaults.
 */
static enum mill_status fill_part(const struct filling *f, enum mill_deck_part part)
{
    const struct mill_deck_text *text = f->deck->text;
    const char *title = mill_deck_table_title(part);
    if (title[strlen(title) - 1] != '.')
        return fill_section(f, part, mill_deck_text_section(text, part, NULL), 0);
    int index = 0;
    for (int i = 0; i < text->sections; i++) {
        if (text->section[i].part != part)
            continue;
        const enum mill_status status = fill_section(f, part, &text->section[i], index++);
        if (status != MILL_OK)
            return status;
    }
    return MILL_OK;
}

/* Numbers of balls from shares of the drum's volume, pi R^2 L, whatever stands in it. */
static enum mill_status count_balls(const struct filling *f)
{
    struct mill_deck *deck = f->deck;
    const double volume = 0.5 * turn * deck->drum_radius * deck->drum_radius * deck->drum_length;
    for (int k = 0; k < deck->kinds; k++) {
        struct mill_deck_balls *balls = &deck->balls[k];
        const double d = balls->diameter;
        if (balls->fill == 0.0)
            continue;
        const double given = balls->fill * volume / (turn / 12.0 * d * d * d);
        const double count = round(given);
        char title[MILL_NAME_LENGTH + 8] = "balls";
        if (mill_deck_text_section(deck->text, DECK_BALLS_NAME, NULL))
            snprintf(title, sizeof title, "balls.%s", balls->name);
        if (!(count >= 1.0 && count <= MILL_DECK_MOST_BALLS))
            return mill_deck_fault(deck, f->error, title, "fill",
                                   "gives %.3g balls of %g m; expected 1 to %d", given, d,
                                   MILL_DECK_MOST_BALLS);
        balls->count = (long)count;
    }
    return MILL_OK;
}

static int count_sections(const struct mill_deck_text *text, enum mill_deck_part part)
{
    int count = 0;
    for (int i = 0; i < text->sections; i++)
        count += text->section[i].part == part;
    return count;
}

static enum mill_status fill_balls(const struct filling *f)
{
    struct mill_deck *deck = f->deck;
    const int named = count_sections(deck->text, DECK_BALLS_NAME);
    deck->kinds = named ? named : 1;
    deck->balls = calloc((size_t)deck->kinds, sizeof *deck->balls);
    if (!deck->balls)
        return no_memory(f->error);
    if (!named)
        snprintf(deck->balls[0].name, MILL_NAME_LENGTH, "balls");
    for (int i = 0, kind = 0; i < deck->text->sections; i++)
        if (deck->text->section[i].part == DECK_BALLS_NAME)
            snprintf(deck->balls[kind++].name, MILL_NAME_LENGTH, "%s", deck->text->section[i].name);
    enum mill_status status = fill_part(f, DECK_BALLS);
    if (status == MILL_OK)
        status = fill_part(f, DECK_BALLS_NAME);
    return status == MILL_OK ? count_balls(f) : status;
}

/* Blade k = 0.. of [blades] is centred at x = -L/2 + (k + 1/2) L/count and points at k angle_step.
 */
static void spread_blades(struct mill_deck *deck)
{
    const struct mill_deck_blades *all = &deck->text->blades;
    const double length = deck->drum_length, count = (double)all->count;
    for (int k = 0; k < all->count; k++) {
        struct mill_deck_blade *blade = &deck->blade[k];
        snprintf(blade->name, sizeof blade->name, "%d", k + 1);
        blade->position = (k + 0.5 - 0.5 * count) * (length / count);
        blade->angle = k * all->angle_step;
        blade->tip_radius = all->tip_radius;
        blade->width = all->width;
        blade->thickness = all->thickness;
        blade->pitch = all->pitch;
    }
}

static enum mill_status fill_blades(const struct filling *f)
{
    struct mill_deck *deck = f->deck;
    struct mill_deck_text *text = deck->text;
    const struct mill_deck_section *all = mill_deck_text_section(text, DECK_BLADES, NULL);
    if (all) {
        const enum mill_status status = fill_part(f, DECK_BLADES);
        if (status != MILL_OK)
            return status;
        if (!mill_deck_text_entry(all, "angle_step"))
            text->blades.angle_step = turn / (double)text->blades.count;
    }
    const int named = count_sections(text, DECK_BLADE_NAME);
    deck->blades = (int)text->blades.count + named;
    deck->blade = calloc((size_t)deck->blades + 1, sizeof *deck->blade);
    if (!deck->blade)
        return no_memory(f->error);
    spread_blades(deck);
    for (int i = 0, k = (int)text->blades.count; i < text->sections; i++)
        if (text->section[i].part == DECK_BLADE_NAME)
            snprintf(deck->blade[k++].name, MILL_NAME_LENGTH, "%s", text->section[i].name);
    return fill_part(f, DECK_BLADE_NAME);
}

static enum mill_status fill_contacts(const struct filling *f)
{
    const enum mill_status status = fill_part(f, DECK_CONTACT);
    if (status != MILL_OK)
        return status;
    for (int kind = 0; kind < MILL_KINDS; kind++)
        f->deck->law[kind] = f->deck->text->law;
    return fill_part(f, DECK_CONTACT_KIND);
}

/* Makes the start file's name absolute, relative names counted from the deck's folder. */
static enum mill_status resolve_start(const struct filling *f)
{
    struct mill_deck *deck = f->deck;
    const char *file = deck->text->file, *slash = strrchr(file, '/');
    char here[PATH_MAX] = "";
    if (!deck->start || deck->start[0] == '/')
        return MILL_OK;
    if (file[0] != '/' && !getcwd(here, sizeof here - 1))
        return mill_error_set(f->error, MILL_FAILED, "the current folder has no name: %s",
                              strerror(errno));
    if (file[0] != '/' && here[strlen(here) - 1] != '/')
        strcat(here, "/");
    const int folder = slash ? (int)(slash - file + 1) : 0;
    const size_t size = strlen(here) + (size_t)folder + strlen(deck->start) + 1;
    char *path = malloc(size);
    if (!path)
        return no_memory(f->error);
    snprintf(path, size, "%s%.*s%s", here, folder, file, deck->start);
    free(deck->start);
    deck->start = path;
    return MILL_OK;
}

enum mill_status mill_deck_fill(struct mill_deck *deck, const struct mill_units *units,
                                struct mill_error *error)
{
    const struct filling f = {deck, units, error};
    const struct mill_deck_text *text = deck->text;
    static const enum mill_deck_part plain[] = {DECK_RUN, DECK_GRAVITY, DECK_DRUM, DECK_OUTPUT};
    enum mill_status status = MILL_OK;
    for (size_t i = 0; i < sizeof plain / sizeof *plain && status == MILL_OK; i++)
        status = fill_part(&f, plain[i]);
    deck->sample_found =
        deck->precision > 0 &&
        !mill_deck_text_entry(mill_deck_text_section(text, DECK_RUN, NULL), "sample_from");
    deck->rotor = mill_deck_text_section(text, DECK_ROTOR, NULL) != NULL;
    if (status == MILL_OK && deck->rotor)
        status = fill_part(&f, DECK_ROTOR);
    if (status == MILL_OK)
        status = fill_balls(&f);
    if (status == MILL_OK)
        status = fill_blades(&f);
    if (status == MILL_OK)
        status = fill_contacts(&f);
    if (status == MILL_OK)
        status = resolve_start(&f);
    return status;
}
