#include "millsim/kinds.h"

#include <assert.h>
#include <stdio.h>
#include <string.h>

#define NAME(number, name, partner) [number] = name,
#define PARTNER(number, name, partner) [number] = partner,
#define PREFIX "ball_"

const char *const mill_kind_name[MILL_KINDS] = {MILL_KIND_LIST(NAME)};
static const char *const met[MILL_KINDS] = {MILL_KIND_LIST(PARTNER)};

void mill_kinds_init(struct mill_kinds *kinds)
{
    memset(kinds, 0, sizeof *kinds);
    for (kinds->count = 0; kinds->count < MILL_KINDS; kinds->count++)
        strcpy(kinds->name[kinds->count], mill_kind_name[kinds->count]);
}

int mill_kinds_add(struct mill_kinds *kinds, const char *body)
{
    assert(kinds->count < MILL_KINDS_MOST);
    snprintf(kinds->name[kinds->count], MILL_KINDS_LENGTH, PREFIX "%s", body);
    return kinds->count++;
}

const char *mill_kinds_partner(const struct mill_kinds *kinds, int kind)
{
    assert(kind >= 0 && kind < kinds->count);
    const char *name = kinds->name[kind];
    return kind < MILL_KINDS ? met[kind] : name + strlen(PREFIX);
}
