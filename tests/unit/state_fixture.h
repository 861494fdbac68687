/* A state kept in memory: what the tests save it to and load it from. */
#ifndef STATE_FIXTURE_H
#define STATE_FIXTURE_H

#include "millsim/state.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { KEPT_FIELDS = 300 };

struct kept_field {
    char name[32];
    enum mill_field type;
    size_t bytes;
    unsigned char *value;
};

struct kept {
    struct mill_state state; /* first */
    struct kept_field field[KEPT_FIELDS];
    size_t fields;
    struct mill_error error;
};

static inline struct kept_field *kept_find(struct kept *kept, const char *name)
{
    for (size_t k = 0; k < kept->fields; k++)
        if (strcmp(kept->field[k].name, name) == 0)
            return &kept->field[k];
    return NULL;
}

static inline void kept_carry(struct mill_state *state, const char *name, enum mill_field type,
                              size_t count, void *at)
{
    struct kept *kept = (struct kept *)state;
    struct kept_field *field = kept_find(kept, name);
    const size_t bytes = count * (type == MILL_FIELD_I32 ? 4 : 8);
    if (state->loads) {
        if (!field || field->type != type || field->bytes != bytes)
            mill_state_refuse(state, "a field is missing or of another length");
        else
            memcpy(at, field->value, bytes);
        return;
    }
    if (field || kept->fields == KEPT_FIELDS)
        abort(); /* two fields of one name, or too many */
    field = &kept->field[kept->fields++];
    snprintf(field->name, sizeof field->name, "%s", name);
    field->type = type;
    field->bytes = bytes;
    field->value = malloc(bytes);
    memcpy(field->value, at, bytes);
}

/* To be saved to */
static inline void kept_init(struct kept *kept)
{
    memset(kept, 0, sizeof *kept);
    kept->state = (struct mill_state){kept_carry, false, MILL_OK, NULL};
}

/* To be loaded from */
static inline struct mill_state *kept_load(struct kept *kept)
{
    kept->state = (struct mill_state){kept_carry, true, MILL_OK, &kept->error};
    return &kept->state;
}

static inline bool kept_alike(const struct kept *a, const struct kept *b)
{
    bool alike = a->fields == b->fields;
    for (size_t k = 0; k < a->fields && alike; k++)
        alike = strcmp(a->field[k].name, b->field[k].name) == 0 &&
                a->field[k].bytes == b->field[k].bytes &&
                memcmp(a->field[k].value, b->field[k].value, a->field[k].bytes) == 0;
    return alike;
}

static inline size_t kept_size(const struct kept *kept)
{
    size_t size = 0;
    for (size_t k = 0; k < kept->fields; k++)
        size += kept->field[k].bytes;
    return size;
}

static inline void kept_free(struct kept *kept)
{
    for (size_t k = 0; k < kept->fields; k++)
        free(kept->field[k].value);
    kept->fields = 0;
}

#endif
