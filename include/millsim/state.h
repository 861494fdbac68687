/* The state of a run as named fields, which are saved or loaded one after another. A run that was
 * interrupted can load them and continue with the same bits. One function names the fields for
 * saving and for loading, so that the two cannot differ. Only the same build can load it. */
#ifndef MILLSIM_STATE_H
#define MILLSIM_STATE_H

#include "millsim/status.h"

#include <assert.h>
#include <stdbool.h>
#include <stddef.h>

enum mill_field { MILL_FIELD_F64, MILL_FIELD_I32, MILL_FIELD_WORD /* 8 bytes of a struct */ };

struct mill_state {
    /* Saves `count` > 0 elements, or fills them with those of this name. Sets status and error. */
    void (*field)(struct mill_state *state, const char *name, enum mill_field type, size_t count,
                  void *at);
    bool loads;              /* true: fields are loaded; false: they are saved */
    enum mill_status status; /* of the first failure; later fields are ignored */
    struct mill_error *error;
};

static inline void mill_state_field(struct mill_state *state, const char *name,
                                    enum mill_field type, size_t count, void *at)
{
    if (state->status == MILL_OK && count > 0)
        state->field(state, name, type, count, at);
}

/* `count` structs of `size` bytes, made of whole words */
static inline void mill_state_structs(struct mill_state *state, const char *name, size_t size,
                                      size_t count, void *at)
{
    assert(size % 8 == 0);
    mill_state_field(state, name, MILL_FIELD_WORD, size / 8 * count, at);
}

/* Reports that the loaded data cannot be right, or that there is no memory for them. */
static inline void mill_state_refuse(struct mill_state *state, const char *why)
{
    if (state->status == MILL_OK)
        state->status = mill_error_set(state->error, MILL_FAILED, "%s", why);
}

#endif
