/* What is wrong with a deck: its messages, with the line that is at fault. While a deck is read
 * they are kept, so that the user gets all of them at once, in the order of the lines. A section
 * with a fault is marked, and checks that need its values are left out: their faults would only
 * follow from the first one. */
#include "deck/deck_private.h"

#include <limits.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

enum { KEPT = 100, SHOWN = 20 };
#define LATE                                                                                       \
    (LONG_MAX - 1) /* place of what is missing altogether: before that of the overrides            \
                    */

struct fault {
    long place; /* number of the line, or LATE, or LONG_MAX */
    int number;
    struct mill_error what;
};

struct mill_deck_faults {
    long place;                        /* of the last message */
    struct mill_deck_section *section; /* of the last message; NULL: of none that can be read */
    bool lost;                         /* a section could not be read, or is missing */
    int count;
    long more; /* faults without a message */
    struct fault fault[KEPT];
};

static enum mill_status set(const struct mill_deck_text *text, struct mill_error *error,
                            const char *section, const char *key, const char *format, va_list list)
{
    enum { LONGEST = 400 }; /* of a file's name; its end says more than its beginning */
    char where[LONGEST + 20], what[512], preset[80] = "";
    struct mill_deck_section *place = section ? mill_deck_section(text, section) : NULL;
    const struct mill_deck_entry *entry = key ? mill_deck_entry(place, key) : NULL;
    const struct mill_key *row = key && section ? mill_deck_table_key(section, key, 0) : NULL;
    const struct mill_deck_reading *reading = text->reading;
    struct mill_deck_origin origin = {0, NULL};
    if (reading)
        origin = reading->at;
    if (!origin.line && !origin.override && place)
        origin = entry ? entry->origin : place->origin;
    if (reading && reading->faults) {
        reading->faults->place = origin.line > 0 ? origin.line : origin.override ? LONG_MAX : LATE;
        reading->faults->section =
            !place && reading->open >= 0 ? &text->section[reading->open] : place;
    }
    const size_t length = strlen(text->file);
    const char *file = text->file + (length > LONGEST ? length - LONGEST : 0);
    if (origin.override)
        snprintf(where, sizeof where, "--%s %.240s", *file ? "set" : "value", origin.override);
    else
        snprintf(where, sizeof where, "%s", file);
    if (origin.line > 0)
        snprintf(where, sizeof where, "%s:%d", file, origin.line);
    if (row && !entry && row->preset)
        snprintf(preset, sizeof preset, " (default %s)", row->preset);
    vsnprintf(what, sizeof what, format, list);
    return mill_error_set(error, MILL_BAD_DECK, "%s: %s%.80s%s%s%.60s%s%s%s", where,
                          section ? "[" : "", section ? section : "", section ? "]" : "",
                          section && key ? " " : "", key ? key : "", preset,
                          section || key ? ": " : "", what);
}

enum mill_status mill_deck_fault(const struct mill_deck_text *text, struct mill_error *error,
                                 const char *section, const char *key, const char *format, ...)
{
    va_list list;
    va_start(list, format);
    set(text, error, section, key, format, list);
    va_end(list);
    return MILL_BAD_DECK;
}

enum mill_status mill_deck_wrong(const struct mill_deck_text *text, const char *section,
                                 const char *key, const char *format, ...)
{
    va_list list;
    va_start(list, format);
    if (text->reading)
        set(text, text->reading->error, section, key, format, list);
    va_end(list);
    return MILL_BAD_DECK;
}

/* Reading ends when there is no more room. */
enum mill_status mill_deck_faults_keep(const struct mill_deck_text *text, enum mill_status status)
{
    struct mill_deck_faults *f = text->reading->faults;
    if (status != MILL_BAD_DECK || !f || f->count == KEPT)
        return status;
    f->fault[f->count] = (struct fault){f->place, f->count, *text->reading->error};
    f->count++;
    if (f->section)
        f->section->broken = true;
    else
        f->lost = true;
    return f->count < KEPT ? MILL_OK : MILL_BAD_DECK;
}

void mill_deck_faults_more(const struct mill_deck_text *text, long faults)
{
    if (text->reading->faults)
        text->reading->faults->more += faults;
}

bool mill_deck_faults_lost(const struct mill_deck_text *text)
{
    return text->reading->faults && text->reading->faults->lost;
}

/* Is there a fault in one of these sections, or is it perhaps one that could not be read? */
static bool concerns(const struct mill_deck_text *text, const char *sections)
{
    for (const char *word = sections; *word; word += strspn(word, " ")) {
        const size_t length = strcspn(word, " ");
        bool there = false;
        for (int i = 0; i < text->sections; i++) {
            const struct mill_deck_section *s = &text->section[i];
            if (strcspn(s->title, ".") != length || strncmp(s->title, word, length) != 0)
                continue;
            if (s->broken)
                return true;
            there = true;
        }
        if (!there && mill_deck_faults_lost(text))
            return true;
        word += length;
    }
    return false;
}

static bool is_same(const char *a, const char *b)
{
    return a && b ? strcmp(a, b) == 0 : a == b;
}

/* Tells what is wrong: of several checks of one key only the first. */
static enum mill_status check(const struct mill_deck *deck, const struct mill_deck_step *step,
                              int kind)
{
    struct mill_deck_check list[MILL_DECK_CHECKS] = {{.sentence = NULL}};
    const struct mill_deck_check *last = NULL;
    enum mill_status status = MILL_OK;
    if (step->each)
        step->each(deck, kind, list);
    else
        step->checks(deck, list);
    for (const struct mill_deck_check *c = list; c->sentence && status == MILL_OK; c++) {
        char what[400];
        const double *x = c->number;
        if (!c->wrong || (last && is_same(last->section, c->section) && is_same(last->key, c->key)))
            continue;
        last = c;
        if (c->word)
            snprintf(what, sizeof what, c->sentence, x[0], c->word, x[1]);
        else
            snprintf(what, sizeof what, c->sentence, x[0], x[1], x[2], x[3]);
        mill_deck_wrong(&deck->text, c->section, c->key, "%s", what);
        status = mill_deck_faults_keep(&deck->text, MILL_BAD_DECK);
    }
    return status;
}

enum mill_status mill_deck_faults_step(struct mill_deck *deck, const struct mill_deck_step *step)
{
    enum mill_status status = MILL_OK;
    if (concerns(&deck->text, step->sections))
        return MILL_OK;
    if (step->run)
        return mill_deck_faults_keep(&deck->text, step->run(deck));
    for (int kind = 0; kind < (step->each ? deck->mill.kinds : 1) && status == MILL_OK; kind++)
        status = check(deck, step, kind);
    return status;
}

void mill_deck_faults_warn(const struct mill_deck *deck, const char *section, const char *key,
                           const char *format, ...)
{
    struct mill_error line;
    va_list list;
    va_start(list, format);
    set(&deck->text, &line, section, key, format, list);
    va_end(list);
    if (deck->warn)
        deck->warn(line.text);
}

enum mill_status mill_deck_faults_create(const struct mill_deck_text *text)
{
    text->reading->faults = calloc(1, sizeof *text->reading->faults);
    return text->reading->faults ? MILL_OK : mill_deck_memory(text);
}

static int by_place(const void *a, const void *b)
{
    const struct fault *x = a, *y = b;
    return x->place != y->place ? (x->place > y->place) - (x->place < y->place)
                                : x->number - y->number;
}

enum mill_status mill_deck_faults_tell(struct mill_deck_text *text, enum mill_status status,
                                       void (*fault)(const char *line))
{
    struct mill_deck_faults *f = text->reading->faults;
    const int all = f ? f->count : 0;
    const bool many = f && all + f->more > SHOWN;
    const int shown = !many ? all - 1 : all < SHOWN ? all : SHOWN;
    if (all > 0 && status != MILL_FAILED) {
        status = MILL_BAD_DECK;
        qsort(f->fault, (size_t)all, sizeof *f->fault, by_place);
        for (int i = 0; i < shown; i++)
            fault(f->fault[i].what.text);
        *text->reading->error = f->fault[all - 1].what;
        if (many)
            mill_error_set(text->reading->error, status, "%.400s: %ld%s more faults", text->file,
                           all + f->more - shown, all == KEPT ? " or" : "");
    }
    free(f);
    text->reading->faults = NULL;
    return status;
}
