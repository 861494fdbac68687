/* The deck's public functions, and the values: for every key of the table, in every section that
 * has it, the value of the entry or the default. This file checks what concerns one key alone
 * (missing, unit, range), and lists the steps that follow. The rest: deck_parse.c reads the file,
 * deck_table.c lists what it may contain, deck_value.c converts between text and numbers. */
#include "deck/deck_private.h"

#include <assert.h>
#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { UNKNOWN = -1 }; /* word of a choice */

/* The struct that the block's keys of this section are in */
static void *values_of(const struct mill_deck *deck, const struct mill_deck_block *block,
                       const struct mill_deck_section *section)
{
    return block->size ? (char *)section->form + block->at : (char *)deck + block->values;
}

/* True if [TITLE.NAME] sections of this deck have the block's keys instead */
static bool is_elsewhere(const struct mill_deck *deck, const struct mill_deck_block *block)
{
    return block->unless_named && mill_deck_named(&deck->text, block->title, NULL);
}

/* Which key of a section is given, of those that stand for the same one */
struct choice {
    const struct mill_key *first;        /* the one that they stand for */
    const struct mill_deck_entry *given; /* an override replaces what the file gives; NULL: none */
    const struct mill_deck_entry *other; /* a second one, given in the same place; NULL: none */
    char words[120];                     /* the keys besides the first: ", or 'fill', 'mass'" */
};

static struct choice find_choice(const struct mill_deck_block *block, const struct mill_key *key,
                                 const struct mill_deck_section *section)
{
    const char *name = key->instead ? key->instead : key->name;
    struct choice c = {.first = key};
    size_t used = 0;
    for (const struct mill_key *k = block->key; k->name; k++) {
        const bool first = strcmp(k->name, name) == 0;
        if (!first && !(k->instead && strcmp(k->instead, name) == 0))
            continue;
        if (first)
            c.first = k;
        else
            used += (size_t)snprintf(c.words + used, sizeof c.words - used, "%s '%s'",
                                     used ? "," : ", or", k->name);
        const struct mill_deck_entry *entry = mill_deck_entry(section, k->name);
        if (entry && (!c.given || (entry->origin.override && !c.given->origin.override))) {
            c.given = entry;
            c.other = NULL;
        } else if (entry && entry->value && c.given->value &&
                   !entry->origin.override == !c.given->origin.override) {
            c.other = entry;
        }
    }
    return c;
}

static enum mill_status fill_key(struct mill_deck *deck, const struct mill_deck_block *block,
                                 const struct mill_key *key,
                                 const struct mill_deck_section *section)
{
    const struct mill_deck_entry *entry = mill_deck_entry(section, key->name);
    const struct choice choice = find_choice(block, key, section);
    void *values = values_of(deck, block, section);
    const bool elsewhere = is_elsewhere(deck, block), hidden = key->needs && key->hidden(values);
    const char *wrong = NULL;
    struct mill_error why;
    char wanted[120];
    if ((!entry && key->hidden && key->hidden(values)) || (entry && !entry->value)) {
        return MILL_OK;
    } else if (elsewhere || hidden) {
        if (entry && !(hidden && section->broken)) /* it may be hidden because of a fault */
            wrong = hidden ? key->needs : "belongs in the sections [balls.NAME] of this mixture";
    } else if (choice.given != entry || (!entry && (key->derived || block->inherits))) {
        return MILL_OK;
    } else if (choice.other) {
        return mill_deck_wrong(&deck->text, section->title, key->name,
                               "'%s' and '%s' both set the %.*s; give only one of them", key->name,
                               choice.other->key, (int)strcspn(choice.first->meaning, ";,"),
                               choice.first->meaning);
    } else if (!entry && (key->instead || (key->unless && mill_deck_entry(section, key->unless)))) {
        return MILL_OK;
    } else if (!entry && !key->preset) {
        mill_deck_value_wanted(key, false, wanted, sizeof wanted);
        return mill_deck_wrong(&deck->text, section->title, key->name,
                               "missing (%s); expected %s%s%s%s%s", key->meaning, wanted,
                               choice.words, key->unless ? ", or '" : "",
                               key->unless ? key->unless : "", key->unless ? "'" : "");
    } else if (entry && entry->look == MILL_DECK_QUOTED && key->type != MILL_KEY_FILE) {
        wrong = "double quotes are only allowed around the name of a file";
    } else if (entry && !*entry->value && entry->look == MILL_DECK_CUT &&
               key->type == MILL_KEY_FILE) {
        wrong = "expected the name of a file, got a comment: " MILL_DECK_QUOTE;
    } else if (!mill_deck_value_read(&deck->text.reading->units, key,
                                     entry ? entry->value : key->preset, values, &why)) {
        wrong = why.text;
    }
    return wrong ? mill_deck_wrong(&deck->text, section->title, key->name, "%s", wrong) : MILL_OK;
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
    const int *word = section->form;
    return block->words == 0 || (*word >= 0 && block->words >> *word & 1u);
}

/* Starts from {0}; false: no more blocks. */
static bool walk_on(const struct mill_deck_text *text, struct walk *w)
{
    struct mill_deck_block first;
    w->at += w->section != NULL;
    while (mill_deck_table_block(w->first, &first)) {
        for (; mill_deck_table_block(w->at, &w->block) &&
               strcmp(w->block.title, first.title) == 0 && w->block.named == first.named;
             w->at++)
            if (w->section && applies(&w->block, w->section))
                return true;
        w->section = mill_deck_next(text, &first, w->section);
        if (w->section)
            w->at = w->first;
        else
            w->first = w->at;
    }
    return false;
}

/* Checks that every key of the section belongs to the section's kind of motion or shape, if that is
 * known. */
static enum mill_status check_entries(const struct mill_deck *deck,
                                      const struct mill_deck_section *section)
{
    enum mill_status status = MILL_OK;
    for (int e = 0; e < section->entries && status == MILL_OK; e++) {
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
        if (belongs || !choice || *(const int *)section->form == UNKNOWN)
            continue;
        for (int n = 0; n < 32; n++) {
            if (words >> n & 1u) {
                mill_deck_value_word(choice, n, word, sizeof word);
                strcat(strcat(of, of[0] ? ", " : ""), word);
            }
        }
        mill_deck_value_word(choice, *(const int *)section->form, own, sizeof own);
        mill_deck_wrong(&deck->text, section->title, name,
                        "does not belong to '%s = %s' (only to: %s): leave it out", choice->name,
                        own, of);
        status = mill_deck_faults_keep(&deck->text, MILL_BAD_DECK);
    }
    return status;
}

static enum mill_status fill_block(struct mill_deck *deck, const struct mill_deck_block *block,
                                   struct mill_deck_section *section)
{
    enum mill_status status = MILL_OK;
    if (section->guessed)
        return MILL_OK;
    const bool first = block->size && !section->form;
    if (first) {
        section->form = calloc(1, block->size);
        if (!section->form)
            return mill_deck_memory(&deck->text);
        if (block->inherits)
            memcpy(section->form, (char *)deck + block->values, block->size);
        if (block->key->type == MILL_KEY_CHOICE)
            *(int *)section->form = UNKNOWN; /* until it is read */
    }
    for (const struct mill_key *key = block->key; key->name && status == MILL_OK; key++)
        status = mill_deck_faults_keep(&deck->text, fill_key(deck, block, key, section));
    return status == MILL_OK && first ? check_entries(deck, section) : status;
}

/* What follows from several keys, and its checks */
#define MOVED "rotor motion drum"
#define MILL MOVED " body blades blade"
static const struct mill_deck_step steps[] = {
    {.run = mill_deck_motions_list, MOVED},
    {.run = mill_deck_bodies_list, MOVED " body"},
    {.run = mill_deck_laws_require, "contact"},
    {.run = mill_deck_laws_list, MOVED " body balls material contact wear"},
    {.run = mill_deck_bodies_parts, "drum rotor blades blade"},
    {.run = mill_deck_bodies_turn, MILL},
    {.checks = mill_deck_run_checks, .sections = "run output"},
    {.checks = mill_deck_mill_buckles, .sections = "drum"},
    {.checks = mill_deck_mill_parts, .sections = MOVED " blades blade"},
    {.run = mill_deck_setup_inside, MOVED " blades blade"},
    {.run = mill_deck_balls_list, MILL " balls material"},
    {.each = mill_deck_mill_sizes, .sections = MILL " balls"},
    {.each = mill_deck_mill_amount, .sections = MILL " balls"},
    {.checks = mill_deck_mill_starts, .sections = MILL " balls"},
    {.checks = mill_deck_run_frames, .sections = MILL " balls run output"},
    {.run = mill_deck_balls_powder, MILL " balls powder"},
    {.checks = mill_deck_uses_checks, .sections = "powder"},
};

static enum mill_status fill(struct mill_deck *deck)
{
    const struct mill_deck_law unknown = {(double)NAN, (double)NAN, (double)NAN, 0.0, NULL, NULL};
    struct walk walk = {0};
    enum mill_status status = MILL_OK;
    deck->given.general = deck->given.unknown.law = unknown;
    deck->mill.drum = mill_deck_section(&deck->text, "drum") != NULL;
    deck->text.kept = calloc(2 * (size_t)deck->text.sections + 2, sizeof *deck->text.kept);
    deck->text.file_named = calloc((size_t)deck->text.sections + 1, sizeof *deck->text.file_named);
    if (!deck->text.kept || !deck->text.file_named)
        return mill_deck_memory(&deck->text);
    while (status == MILL_OK && walk_on(&deck->text, &walk))
        status = fill_block(deck, &walk.block, walk.section);
    if (status != MILL_OK)
        return status;
    deck->mill.sample_found =
        deck->given.precision > 0.0 &&
        !mill_deck_entry(mill_deck_section(&deck->text, "run"), "sample_from");
    deck->mill.rotor = mill_deck_section(&deck->text, "rotor") != NULL;
    for (size_t i = 0; status == MILL_OK && i < sizeof steps / sizeof *steps; i++)
        status = mill_deck_faults_step(deck, &steps[i]);
    return status;
}

void mill_deck_free(struct mill_deck *deck)
{
    if (!deck)
        return;
    mill_deck_parse_free(&deck->text);
    mill_deck_bodies_free(&deck->mill.bodies);
    mill_deck_bodies_free(&deck->mill.parts);
    free(deck->mill.printed.section);
    free(deck->mill.balls);
    free(deck);
}

enum mill_status mill_deck_read(const char *path, int count, const char *const *overrides,
                                void (*warn)(const char *line), void (*fault)(const char *line),
                                const struct mill_start_watch *watch, struct mill_deck **deck,
                                struct mill_error *error)
{
    struct mill_deck_reading reading = {.open = -1, .error = error, .watch = watch};
    struct mill_deck *made = *deck = calloc(1, sizeof *made);
    if (!made)
        return mill_error_set(error, MILL_FAILED, "out of memory");
    made->warn = warn;
    made->text.reading = &reading;
    enum mill_status status = fault ? mill_deck_faults_create(&made->text) : MILL_OK;
    if (status == MILL_OK)
        status = mill_deck_parse(&made->text, path, count, overrides);
    if (status == MILL_OK)
        status = fill(made);
    status = mill_deck_faults_tell(&made->text, status, fault);
    mill_units_free(reading.units);
    made->text.reading = NULL;
    if (status == MILL_OK) {
        mill_deck_warn(made);
        return MILL_OK;
    }
    mill_deck_free(made);
    *deck = NULL;
    return status;
}

void mill_deck_each(const struct mill_deck *deck,
                    void (*entry)(void *self, const char *section, const struct mill_key *key,
                                  const char *value),
                    void *self)
{
    char value[2 * PATH_MAX + 8];
    struct walk walk = {0};
    while (walk_on(&deck->mill.printed, &walk)) {
        const void *values = values_of(deck, &walk.block, walk.section);
        const bool elsewhere = is_elsewhere(deck, &walk.block);
        for (const struct mill_key *key = walk.block.key; key->name && !elsewhere; key++) {
            const void *value_at = (const char *)values + key->offset;
            /* skip keys that are off, replaced by another key, or found in the run */
            if (key->instead || (key->hidden && key->hidden(values)) ||
                (key->zero_is_off && *(const double *)value_at == 0.0) ||
                (key->type == MILL_KEY_NUMBER && isnan(*(const double *)value_at)) ||
                ((key->type == MILL_KEY_NAME || (key->type == MILL_KEY_FILE && key->derived)) &&
                 !*(const char *const *)value_at))
                continue;
            mill_deck_value_print(key, values, value, sizeof value);
            entry(self, walk.section->title, key, value);
        }
    }
}

struct page {
    FILE *out;
    const char *section; /* the one being printed */
};

static void print_entry(void *self, const char *section, const struct mill_key *key,
                        const char *value)
{
    enum { COLUMN = 48 };
    struct page *page = self;
    if (strcmp(page->section, section) != 0) {
        page->section = section;
        fprintf(page->out, "\n[%s]\n", section);
    }
    const int used = fprintf(page->out, "%s = %s", key->name, value);
    fprintf(page->out, "%*s# %s\n", used > 0 && used < COLUMN ? COLUMN - used : 1, "",
            key->meaning);
}

void mill_deck_print(const struct mill_deck *deck, FILE *out)
{
    struct page page = {.out = out, .section = ""};
    fprintf(out, "# The full deck, defaults filled in, in SI units\n");
    mill_deck_each(deck, print_entry, &page);
}
