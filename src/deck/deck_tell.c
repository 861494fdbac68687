/* What one value of a deck is, without a deck: its kind, its SI number, its unit, its meaning. So
 * that programs around millsim (studies, sweeps) need neither a table of keys nor a reader of units
 * of their own. */
#include "deck/deck_private.h"

#include <limits.h>
#include <stdlib.h>
#include <string.h>

static const char *const kinds[] = {
    [DECK_NUMBER] = "number", [DECK_VECTOR] = "vector", [DECK_WHOLE] = "whole",
    [DECK_SEED] = "whole",    [DECK_CHOICE] = "choice", [DECK_FILE] = "file"};

/* Wherever a value is at home, there is room for it here, at its offset. */
union anywhere {
    struct mill_deck deck;
    struct mill_deck_balls balls;
    struct mill_deck_blades blades;
    struct mill_deck_blade blade;
    struct mill_law law;
};

/* The overrides come by --set elsewhere, and their messages say so. */
static enum mill_status name_option(enum mill_status status, struct mill_error *error)
{
    static const char set[] = "--set ";
    struct mill_error said = *error;
    if (strncmp(said.text, set, sizeof set - 1) != 0)
        return status;
    return mill_error_set(error, status, "--value %s", said.text + sizeof set - 1);
}

static void print(const struct mill_deck_section *section, const struct mill_deck_key *key,
                  const union anywhere *home, FILE *out)
{
    char value[2 * PATH_MAX + 8];
    struct mill_deck_key bare = *key;
    bare.unit = NULL; /* it has a column of its own */
    const char *file = NULL;
    if (key->type == DECK_FILE)
        memcpy(&file, (const char *)home + key->offset, sizeof file);
    if (!file)
        mill_deck_value_print(&bare, home, value, sizeof value);
    fprintf(out, "%s.%s\t%s\t%s\t%s\t%s\t%s\n", section->title, key->name, kinds[key->type],
            file ? file : value, key->unit ? key->unit : "1", key->meaning,
            key->type == DECK_CHOICE ? key->words : "");
}

enum mill_status mill_deck_tell(int count, const char *const *orders, FILE *out,
                                struct mill_error *error)
{
    struct mill_units *units = NULL;
    union anywhere *home = calloc(1, sizeof *home);
    enum mill_status status = mill_units_create(&units, error);
    if (status == MILL_OK && !home)
        status = mill_error_set(error, MILL_FAILED, "out of memory");
    for (int i = 0; i < count && status == MILL_OK; i++) {
        struct mill_deck_text *text = NULL;
        struct mill_error why;
        status = mill_deck_parse(NULL, 1, &orders[i], &text, error);
        if (status != MILL_OK)
            break;
        const struct mill_deck_section *section = &text->section[0];
        const struct mill_deck_entry *entry = &section->entry[0];
        const struct mill_deck_key *key = mill_deck_table_key(section->part, entry->key);
        memset(home, 0, sizeof *home);
        if (mill_deck_value_read(units, key, entry->value, home, &why)) {
            print(section, key, home, out);
            if (key->type == DECK_FILE)
                free(*(char **)((char *)home + key->offset));
        } else {
            status = mill_error_set(error, MILL_BAD_DECK, "--set %.240s: [%s] %s: %s", orders[i],
                                    section->title, key->name, why.text);
        }
        mill_deck_text_free(text);
    }
    mill_units_free(units);
    free(home);
    return status == MILL_OK ? status : name_option(status, error);
}
