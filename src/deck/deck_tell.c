/* What one value of a deck is, without a deck: its kind, its SI number, its unit, its meaning. So
 * that programs around millsim (studies, sweeps) need neither a table of keys nor a reader of units
 * of their own. */
#include "deck/deck_private.h"

#include <stdlib.h>
#include <string.h>

/* Room for any value */
union value {
    double number;
    vec3 vector;
    long whole;
    bool choice;
    char *file;
};

static void print(const struct mill_deck_section *section, const struct mill_key *key,
                  const union value *value, FILE *out)
{
    static const char *const type[] = {[MILL_KEY_NUMBER] = "number",
                                       [MILL_KEY_VECTOR] = "vector",
                                       [MILL_KEY_WHOLE] = "whole",
                                       [MILL_KEY_CHOICE] = "choice",
                                       [MILL_KEY_FILE] = "file"};
    char text[128] = "";
    struct mill_key bare = *key;
    bare.unit = NULL; /* it has a column of its own */
    const char *file = key->type == MILL_KEY_FILE ? value->file : NULL;
    if (!file)
        mill_deck_value_print(&bare, value, text, sizeof text);
    fprintf(out, "%s.%s\t%s\t%s\t%s\t%s\t%s\n", section->title, key->name, type[key->type],
            file ? file : text, key->unit ? key->unit : "1", key->meaning,
            key->type == MILL_KEY_CHOICE ? key->words : "");
}

static enum mill_status tell(const struct mill_units *units, const char *override, FILE *out,
                             struct mill_error *error)
{
    struct mill_deck_text *text = NULL;
    struct mill_error why;
    enum mill_status status = mill_deck_parse(NULL, 1, &override, &text, error);
    if (status != MILL_OK)
        return status;
    const struct mill_deck_section *section = &text->section[0];
    const struct mill_deck_entry *entry = &section->entry[0];
    struct mill_key key = *mill_deck_table_key(section->title, entry->key);
    union value value = {.file = NULL};
    key.offset = 0;
    if (mill_deck_value_read(units, &key, entry->value, &value, &why))
        print(section, &key, &value, out);
    else
        status =
            mill_deck_text_refuse(text, entry->origin, section->title, key.name, why.text, error);
    if (key.type == MILL_KEY_FILE)
        free(value.file);
    mill_deck_text_free(text);
    return status;
}

enum mill_status mill_deck_tell(int count, const char *const *values, FILE *out,
                                struct mill_error *error)
{
    struct mill_units *units = NULL;
    enum mill_status status = mill_units_create(&units, error);
    for (int i = 0; i < count && status == MILL_OK; i++)
        status = tell(units, values[i], out, error);
    mill_units_free(units);
    return status;
}
