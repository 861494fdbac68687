/* What is wrong with a deck: its messages, with the line that is at fault. While a deck is read
 * they are kept, so that the user gets all of them at once, in the order of the lines. Checks that
 * need the values of a section with a fault are left out: theirs would only follow from it. */
#include "deck/deck_private.h"

#include <limits.h>
#include <stdarg.h>

enum { KEPT = 100, SHOWN = 20 };
/* place of what is missing altogether: before that of the overrides */
#define LATE (LONG_MAX - 1)

struct mill_deck_fault {
    struct mill_deck_fault *next;
    long place; /* number of the line, or LATE, or LONG_MAX */
    struct mill_error what;
};

/* Returns the place of the fault. */
static long set(const struct mill_deck_text *text, struct mill_error *error, const char *section,
                const char *key, const char *format, va_list list)
{
    enum { LONGEST = 400 }; /* of a file's name; its end says more than its beginning */
    char where[LONGEST + 20], what[512], preset[80] = "";
    const struct mill_deck_section *place = section ? mill_deck_section(text, section) : NULL;
    const struct mill_deck_entry *entry = key ? mill_deck_entry(place, key) : NULL;
    const struct mill_key *row = key && section ? mill_deck_table_key(section, key, 0) : NULL;
    struct mill_deck_origin origin = {0, NULL};
    if (text->reading)
        origin = text->reading->at;
    if (!origin.line && !origin.override && place)
        origin = entry ? entry->origin : place->origin;
    const size_t length = strlen(text->file);
    const char *file = text->file + (length > LONGEST ? length - LONGEST : 0);
    if (origin.line > 0)
        snprintf(where, sizeof where, "%s:%d", file, origin.line);
    else if (origin.override)
        snprintf(where, sizeof where, "--%s %.240s", *file ? "set" : "value", origin.override);
    else
        snprintf(where, sizeof where, "%s", file);
    if (row && !entry && row->preset)
        snprintf(preset, sizeof preset, " (default %s)", row->preset);
    vsnprintf(what, sizeof what, format, list);
    mill_error_set(error, MILL_BAD_DECK, "%s: %s%.80s%s%s%.60s%s%s%s", where, section ? "[" : "",
                   section ? section : "", section ? "]" : "", section && key ? " " : "",
                   key ? key : "", preset, section || key ? ": " : "", what);
    return origin.line > 0 ? origin.line : origin.override ? LONG_MAX : LATE;
}

bool mill_deck_wrong(const struct mill_deck_text *text, const char *section, const char *key,
                     const char *format, ...)
{
    struct mill_deck_reading *r = text->reading;
    struct mill_deck_fault *f = r->over ? NULL : mill_deck_keep(text, calloc(1, sizeof *f));
    struct mill_deck_section *place = section ? mill_deck_section(text, section) : NULL;
    if (!f)
        return false;
    va_list list;
    va_start(list, format);
    f->place = set(text, &f->what, section, key, format, list);
    va_end(list);
    struct mill_deck_fault **at = &r->fault;
    while (*at && (*at)->place <= f->place)
        at = &(*at)->next;
    f->next = *at;
    *at = f;
    r->over = ++r->faults == KEPT;
    place = place ? place : r->open;
    if (place)
        place->broken = true;
    else
        r->lost = true;
    return false;
}

bool mill_deck_failed(const struct mill_deck_text *text, const char *format, ...)
{
    struct mill_error what;
    va_list list;
    va_start(list, format);
    vsnprintf(what.text, sizeof what.text, format, list);
    va_end(list);
    if (!text->reading->failed)
        mill_error_set(text->reading->error, MILL_FAILED, "%s", what.text);
    return !(text->reading->failed = text->reading->over = true);
}

void *mill_deck_keep(const struct mill_deck_text *text, void *memory)
{
    void **kept = memory ? mill_memory_add(text->reading->memory) : NULL;
    if (kept)
        return *kept = memory;
    free(memory);
    mill_deck_failed(text, "out of memory");
    return NULL;
}

void mill_deck_release(struct mill_memory_list *memory)
{
    for (size_t k = 0; k < memory->count; k++)
        free(((void **)memory->item)[k]);
    free(memory->item);
}

bool mill_deck_faults_concern(const struct mill_deck_text *text, const char *sections)
{
    for (const char *word = sections; *word; word += strspn(word, " ")) {
        const size_t length = strcspn(word, " ");
        bool there = false;
        for (const struct mill_deck_section *s = text->section; s; s = s->next) {
            if (strcspn(s->title, ".") != length || strncmp(s->title, word, length) != 0)
                continue;
            if (s->broken)
                return true;
            there = true;
        }
        if (!there && text->reading->lost)
            return true;
        word += length;
    }
    return false;
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

enum mill_status mill_deck_faults_tell(const struct mill_deck_text *text,
                                       void (*fault)(const char *line))
{
    const struct mill_deck_reading *r = text->reading;
    const struct mill_deck_fault *f = r->fault;
    const bool many = r->faults + r->more > SHOWN;
    const int shown = !many ? r->faults - 1 : r->faults < SHOWN ? r->faults : SHOWN;
    if (r->failed || !f)
        return r->failed ? MILL_FAILED : MILL_OK;
    for (int i = 0; fault && i < shown; i++, f = f->next)
        fault(f->what.text);
    const long others = r->faults + r->more - shown;
    if (!fault || !many)
        *r->error = f->what;
    else
        mill_error_set(r->error, MILL_BAD_DECK, "%.400s: %ld%s more fault%s", text->file, others,
                       r->faults == KEPT ? " or" : "", others == 1 ? "" : "s");
    return MILL_BAD_DECK;
}
