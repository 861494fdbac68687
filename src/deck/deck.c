/* The deck's public functions, and the values: for every key of the table, in every section that
 * has it, the value of the entry or the default. This file checks what concerns one key alone
 * (missing, unit, range), and lists the steps that follow. The rest: deck_parse.c reads the file,
 * deck_table.c lists what it may contain, deck_value.c converts between text and numbers. */
#include "deck/deck_private.h"

#include <limits.h>

/* The struct that the block's keys of this section are in */
static void *values_of(const struct mill_deck *deck, const struct mill_deck_block *block,
                       const struct mill_deck_section *section)
{
    return block->size ? section->form : (char *)deck + block->values;
}

/* True if [TITLE.NAME] sections of this deck have the block's keys instead */
static bool is_elsewhere(const struct mill_deck *deck, const struct mill_deck_block *block)
{
    return block->unless_named && mill_deck_named(&deck->text, block->title, NULL);
}

/* Does the block belong to this section? */
static bool applies(const struct mill_deck_block *block, const struct mill_deck_section *section)
{
    return mill_deck_table_belongs(block, section->title) &&
           (block->words == 0 || (section->word >= 0 && block->words >> section->word & 1u));
}

/* Which key of a section is given, of those that stand for the same one */
struct choice {
    const struct mill_key *first;        /* the one that they stand for */
    const struct mill_deck_entry *given; /* an override replaces what the file gives; NULL: none */
    const struct mill_deck_entry *other; /* a second one, given in the same place; NULL: none */
    char words[120];                     /* the keys besides the first: ", or 'fill', 'mass'" */
};

static struct choice find_choice(const struct mill_key *keys, const struct mill_key *key,
                                 const struct mill_deck_section *section)
{
    const char *name = key->instead ? key->instead : key->name;
    struct choice c = {.first = key};
    size_t used = 0;
    for (const struct mill_key *k = keys; k->name; k++) {
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

static bool fill_key(struct mill_deck *deck, const struct mill_deck_block *block,
                     const struct mill_key *key, const struct mill_deck_section *section)
{
    const struct mill_deck_entry *entry = mill_deck_entry(section, key->name);
    const struct choice choice = find_choice(mill_deck_table_keys(block), key, section);
    void *values = values_of(deck, block, section);
    const bool elsewhere = is_elsewhere(deck, block), hidden = key->needs && key->hidden(values);
    const char *wrong = NULL;
    struct mill_error why;
    char wanted[120];
    if ((!entry && key->hidden && key->hidden(values)) || (entry && !entry->value)) {
        return true;
    } else if (elsewhere || hidden) {
        if (entry && !(hidden && section->broken)) /* it may be hidden because of a fault */
            wrong = hidden ? key->needs : "belongs in the sections [balls.NAME] of this mixture";
    } else if (choice.given != entry || (!entry && (key->derived || block->inherits))) {
        return true;
    } else if (choice.other) {
        return mill_deck_wrong(&deck->text, section->title, key->name,
                               "'%s' and '%s' both set the %.*s; give only one of them", key->name,
                               choice.other->key, (int)strcspn(choice.first->meaning, ";,"),
                               choice.first->meaning);
    } else if (!entry && (key->instead || (key->unless && mill_deck_entry(section, key->unless)))) {
        return true;
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
    return !wrong || mill_deck_wrong(&deck->text, section->title, key->name, "%s", wrong);
}

/* Checks that all keys of the section belong to its kind of motion or shape, a word of `choice`. */
static void check_entries(const struct mill_deck *deck, const struct mill_deck_section *section,
                          const struct mill_key *choice)
{
    int length;
    const char *own = mill_deck_value_word(choice, section->word, &length);
    for (const struct mill_deck_entry *entry = section->entry; entry; entry = entry->next) {
        unsigned words = 0;
        bool belongs = false;
        for (const struct mill_deck_block *b = mill_deck_table; b->title; b++)
            for (const struct mill_key *key = mill_deck_table_keys(b); key->name; key++)
                if (mill_deck_table_belongs(b, section->title) &&
                    strcmp(key->name, entry->key) == 0) {
                    belongs = belongs || applies(b, section);
                    words |= b->words;
                }
        char of[160] = "";
        const char *word;
        for (int n = 0, size, used = 0; (word = mill_deck_value_word(choice, n, &size)); n++)
            if (words >> n & 1u)
                used += sprintf(of + used, "%s%.*s", used ? ", " : "", size, word);
        if (!belongs)
            mill_deck_wrong(&deck->text, section->title, entry->key,
                            "does not belong to '%s = %.*s' (only to: %s): leave it out",
                            choice->name, length, own, of);
    }
}

static void fill_block(struct mill_deck *deck, const struct mill_deck_block *block,
                       struct mill_deck_section *section)
{
    const struct mill_key *keys = mill_deck_table_keys(block);
    const bool first = block->size && !section->form;
    const bool chooses = first && keys->type == MILL_KEY_CHOICE;
    if (first) {
        section->form = mill_deck_keep(&deck->text, calloc(1, block->size));
        if (!section->form)
            return;
        if (block->inherits)
            memcpy(section->form, (char *)deck + block->values, block->size);
    }
    for (const struct mill_key *key = keys; key->name && !deck->text.reading->over; key++)
        if (fill_key(deck, block, key, section) && key == keys && chooses)
            section->word = *(int *)((char *)section->form + key->offset);
    if (chooses && section->word >= 0)
        check_entries(deck, section, keys);
}

/* What follows from several keys, and its checks; each with the sections whose values it uses */
#define MOVED "rotor motion drum"
#define MILL MOVED " body blades blade"
static const struct {
    void (*run)(struct mill_deck *deck);
    const char *sections;
} steps[] = {
    {mill_deck_lining_make, "drum"},
    {mill_deck_motions_list, MOVED},
    {mill_deck_bodies_parts, "drum rotor blades blade"},
    {mill_deck_bodies_list, MOVED " body"},
    {mill_deck_laws_require, "contact"},
    {mill_deck_laws_list, MOVED " body balls material contact wear"},
    {mill_deck_bodies_turn, MILL},
    {mill_deck_checks_run, "run output"},
    {mill_deck_checks_parts, MOVED " blades blade"},
    {mill_deck_bodies_inside, MOVED " blades blade"},
    {mill_deck_balls_list, MILL " balls material"},
    {mill_deck_checks_balls, MILL " balls"},
    {mill_deck_motions_turn, MILL " balls gravity"},
    {mill_deck_checks_frames, MILL " balls run output"},
    {mill_deck_checks_starts, MILL " balls run"},
    {mill_deck_balls_powder, MILL " balls powder"},
    {mill_deck_checks_powder, "powder"},
};

static void fill(struct mill_deck *deck)
{
    const struct mill_deck_law unknown = {(double)NAN, (double)NAN, (double)NAN, 0.0, NULL, NULL};
    const struct mill_deck_section *run = mill_deck_section(&deck->text, "run");
    deck->given.general = deck->given.unknown.law = unknown;
    deck->mill.drum = mill_deck_section(&deck->text, "drum") != NULL;
    for (const struct mill_deck_block *b = mill_deck_table; b->title; b++)
        for (struct mill_deck_section *s = deck->text.section; s; s = s->next)
            if (!s->guessed && !deck->text.reading->over && applies(b, s))
                fill_block(deck, b, s);
    deck->observe.sample_found = !mill_deck_entry(run, "sample_from");
    deck->observe.rotor_angle = deck->given.rotor.angle;
    deck->setup.horizon = deck->observe.end;
    deck->observe.springs = deck->setup.soft.on;
    deck->mill.rotor = mill_deck_section(&deck->text, "rotor") != NULL;
    for (size_t i = 0; i < sizeof steps / sizeof *steps; i++)
        if (!deck->text.reading->over && !mill_deck_faults_concern(&deck->text, steps[i].sections))
            steps[i].run(deck);
}

void mill_deck_free(struct mill_deck *deck)
{
    if (!deck)
        return;
    mill_deck_release(&deck->memory);
    free(deck->text.files.item);
    free(deck->mill.surface.item);
    free(deck->mill.section.item);
    free(deck);
}

enum mill_status mill_deck_read(const char *path, int count, const char *const *overrides,
                                void (*warn)(const char *line), void (*fault)(const char *line),
                                const struct mill_start_watch *watch, struct mill_deck **deck,
                                struct mill_error *error)
{
    struct mill_deck *made = *deck = calloc(1, sizeof *made);
    if (!made)
        return mill_error_set(error, MILL_FAILED, "out of memory");
    struct mill_deck_reading reading = {.error = error, .memory = &made->memory, .watch = watch};
    made->warn = warn;
    made->memory.size = made->text.files.size = made->mill.section.size = sizeof(void *);
    made->mill.surface.size = sizeof(struct mill_setup_surface);
    made->text.reading = &reading;
    mill_deck_parse(&made->text, path, count, overrides);
    fill(made);
    const enum mill_status status = mill_deck_faults_tell(&made->text, fault);
    if (status == MILL_OK && warn)
        mill_deck_warn(made);
    mill_units_free(reading.units);
    made->text.reading = NULL;
    if (status == MILL_OK)
        return MILL_OK;
    mill_deck_free(made);
    *deck = NULL;
    return status;
}

/* Is there nothing to print: is the key off, replaced by another one, or found in the run? */
static bool is_silent(const struct mill_key *key, const void *values)
{
    const void *at = (const char *)values + key->offset;
    const bool text = key->type == MILL_KEY_NAME || (key->type == MILL_KEY_FILE && key->derived);
    return key->instead || (key->hidden && key->hidden(values)) ||
           (key->zero_is_off &&
            (key->type == MILL_KEY_WHOLE ? *(const long *)at == 0 : *(const double *)at == 0.0)) ||
           (key->type == MILL_KEY_NUMBER && !key->words && isnan(*(const double *)at)) ||
           (text && !*(const char *const *)at);
}

void mill_deck_each(const struct mill_deck *deck, mill_deck_entry_fn *entry, void *self)
{
    char value[2 * PATH_MAX + 8];
    const struct mill_deck_block *end = mill_deck_table;
    for (const struct mill_deck_block *first = end; first->title; first = end) {
        while (end->title && strcmp(end->title, first->title) == 0 && end->named == first->named)
            end++;
        for (const struct mill_deck_section *s = deck->text.section; s; s = s->next)
            for (const struct mill_deck_block *b = first; b < end; b++) {
                const void *values = values_of(deck, b, s);
                const struct mill_key *key = mill_deck_table_keys(b);
                for (; applies(b, s) && !is_elsewhere(deck, b) && key->name; key++)
                    if (!is_silent(key, values)) {
                        mill_deck_value_print(key, values, value, sizeof value);
                        entry(self, s->title, key, value);
                    }
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

char *mill_deck_printed(const struct mill_deck *deck,
                        void (*print)(const struct mill_deck *deck, FILE *out))
{
    char *text = NULL;
    size_t size = 0;
    FILE *stream = open_memstream(&text, &size);
    if (stream)
        print(deck, stream);
    if (stream && fclose(stream) == 0)
        return text;
    free(text);
    return NULL;
}
