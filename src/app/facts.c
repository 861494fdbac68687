/* A list of facts by name. Each keeps its record in one block of memory. */
#include "app/record.h"

#include <string.h>

enum { MOST = 1000, LONGEST = 120, PARTS = 4 };

struct mill_fact {
    char *name; /* the memory that holds all texts of the fact */
    const char *unit, *meaning, *text;
    enum mill_h5_type type; /* MILL_H5_F64, MILL_H5_U64 or MILL_H5_TEXT */
    uint64_t bits;          /* of a number */
};

/* Is the name allowed? Not if millsim itself writes it to /run, or if it is a path to elsewhere. */
static bool is_name(const char *name)
{
    static const char *const own[] = {"status", "time", "hdf5", "events", "reach"};
    const size_t first = strcspn(name, "/");
    for (size_t i = 0; i < sizeof own / sizeof *own; i++)
        if (first == strlen(own[i]) && strncmp(name, own[i], first) == 0)
            return false;
    return strlen(name) < LONGEST && first > 0 && name[strlen(name) - 1] != '/' &&
           !strstr(name, "//") &&
           name[strspn(name, "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_/")] ==
               '\0';
}

/* Number of the fact of this name; facts->count: there is none */
static size_t find(const struct mill_facts_list *facts, const char *name)
{
    size_t i = 0;
    while (i < facts->count && strcmp(facts->fact[i].name, name) != 0)
        i++;
    return i;
}

const char *mill_facts_text(const struct mill_facts_list *facts, const char *name)
{
    const size_t i = find(facts, name);
    return i < facts->count && facts->fact[i].type == MILL_H5_TEXT ? facts->fact[i].text : "";
}

/* Makes a fact from these bytes, which it then owns. false: they are no fact. */
static bool parse(struct mill_fact *fact, char *bytes, size_t length)
{
    const char *part[PARTS], *at = bytes;
    *fact = (struct mill_fact){.name = bytes};
    for (int i = 0; i < PARTS; i++) {
        part[i] = at;
        at += strlen(at) + 1;
        if (at > bytes + length)
            return false;
    }
    const size_t left = length - (size_t)(at - bytes);
    const bool text = strcmp(part[3], "text") == 0, whole = strcmp(part[3], "u8") == 0;
    fact->unit = part[1];
    fact->meaning = part[2];
    fact->type = text ? MILL_H5_TEXT : whole ? MILL_H5_U64 : MILL_H5_F64;
    fact->text = at;
    if (!text && left == sizeof fact->bits)
        memcpy(&fact->bits, at, left);
    return is_name(part[0]) && part[2][0] && (text || whole || strcmp(part[3], "f8") == 0) &&
           left == (text ? strlen(at) : sizeof fact->bits);
}

/* Puts the fact into the list, in place of an earlier one of its name. false: out of memory */
static bool keep(struct mill_facts_list *facts, const struct mill_fact *fact)
{
    const size_t i = find(facts, fact->name);
    if (i == facts->count) {
        struct mill_fact *more = realloc(facts->fact, (i + 1) * sizeof *more);
        if (!more)
            return false;
        facts->fact = more;
        facts->fact[facts->count++].name = NULL;
    }
    free(facts->fact[i].name);
    facts->fact[i] = *fact;
    return true;
}

enum mill_status mill_facts_take(struct mill_facts_list *facts, const char *bytes, size_t length,
                                 struct mill_error *error)
{
    struct mill_fact fact;
    enum mill_status status = MILL_OK;
    char *own = malloc(length + 1);
    if (!own)
        return mill_error_set(error, MILL_FAILED, "out of memory");
    memcpy(own, bytes, length);
    own[length] = '\0';
    if (!parse(&fact, own, length) || facts->count >= MOST)
        status = mill_error_set(error, MILL_FAILED,
                                "'%.40s': expected the name of a value of /run "
                                "that millsim does not write itself, unit, meaning, type (f8, u8 "
                                "or text) and value",
                                own);
    else if (!keep(facts, &fact))
        status = mill_error_set(error, MILL_FAILED, "out of memory");
    if (status != MILL_OK)
        free(own);
    return status;
}

enum mill_status mill_facts_check(const struct mill_facts_list *facts, struct mill_error *error)
{
    static const struct {
        const char *name;
        enum mill_h5_type type;
    } needed[] = {{"program", MILL_H5_TEXT}, {"version", MILL_H5_TEXT},  {"command", MILL_H5_TEXT},
                  {"started", MILL_H5_TEXT}, {"wall_time", MILL_H5_F64}, {"cpu_time", MILL_H5_F64}};
    for (size_t i = 0; i < sizeof needed / sizeof *needed; i++) {
        const size_t k = find(facts, needed[i].name);
        if (k == facts->count || facts->fact[k].type != needed[i].type)
            return mill_error_set(error, MILL_FAILED, "the fact '%s' (%s) must come before it",
                                  needed[i].name,
                                  needed[i].type == MILL_H5_TEXT ? "text" : "f8, in s");
    }
    return MILL_OK;
}

void mill_facts_write(const struct mill_facts_list *facts, struct mill_h5 *file, const char *but)
{
    for (const struct mill_fact *f = facts->fact; f < facts->fact + facts->count; f++) {
        const bool text = f->type == MILL_H5_TEXT;
        const void *value = text ? (const void *)&f->text : &f->bits;
        char path[LONGEST + 8];
        snprintf(path, sizeof path, "/run/%s", f->name);
        if (strcmp(f->name, but) != 0)
            mill_h5_write(file, path, f->type, 0, NULL, value, text ? "" : f->unit, f->meaning);
    }
}

void mill_facts_free(struct mill_facts_list *facts)
{
    for (size_t i = 0; i < facts->count; i++)
        free(facts->fact[i].name);
    free(facts->fact);
}
