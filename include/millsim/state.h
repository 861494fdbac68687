/* The state of a run as named fields, told one after another to whoever saves them or loads them
 * again: for a run that is interrupted and goes on to the same bits. One function tells them in
 * both cases, so these cannot disagree. Good for the same build of the program only. */
#ifndef MILLSIM_STATE_H
#define MILLSIM_STATE_H

#include "millsim/status.h"

#include <assert.h>
#include <stdbool.h>
#include <stddef.h>

enum mill_field { MILL_FIELD_F64, MILL_FIELD_I32, MILL_FIELD_WORD /* 8 bytes of a struct */ };

struct mill_state {
    /* Saves `count` > 0 elements, or fills them with those that were saved under this name. A
     * failure goes to status and error. */
    void (*field)(struct mill_state *state, const char *name, enum mill_field type, size_t count,
                  void *at);
    bool loads;              /* the fields are filled; else they are read */
    enum mill_status status; /* of the first failure; nothing is done after it */
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

/* What was loaded cannot be right, or there is no memory for it. */
static inline void mill_state_refuse(struct mill_state *state, const char *why)
{
    if (state->status == MILL_OK)
        state->status = mill_error_set(state->error, MILL_FAILED, "%s", why);
}

#endif
