#include "millsim/kinds.h"

#include <assert.h>
#include <stdio.h>
#include <string.h>

const char *const mill_kind_name[MILL_KINDS] = {"ball_ball", "ball_drum", "ball_wall", "ball_shaft",
                                                "ball_blade"};

void mill_kinds_init(struct mill_kinds *kinds)
{
    memset(kinds, 0, sizeof *kinds);
    for (kinds->count = 0; kinds->count < MILL_KINDS; kinds->count++)
        strcpy(kinds->name[kinds->count], mill_kind_name[kinds->count]);
}

int mill_kinds_add(struct mill_kinds *kinds, const char *body)
{
    assert(kinds->count < MILL_KINDS_MOST);
    snprintf(kinds->name[kinds->count], MILL_KINDS_LENGTH, "ball_%s", body);
    return kinds->count++;
}
