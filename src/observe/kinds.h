/* The kinds of contact that files and tables list: those of which the mill has a surface */
#ifndef MILL_OBSERVE_KINDS_H
#define MILL_OBSERVE_KINDS_H

#include "geometry/shape.h"
#include "millsim/world.h"

struct mill_listed {
    int count;
    int kind[MILL_KINDS_MOST + 1];         /* of the world; after the last one: their number */
    int number[MILL_KINDS_MOST];           /* of a kind of the world in this list; -1: not listed */
    const char *name[MILL_KINDS_MOST + 1]; /* after the last one: "all" */
};

/* Contacts of two balls are always listed. The names are those of the world. */
static inline struct mill_listed mill_kinds_listed(const struct mill_world *world)
{
    struct mill_listed l = {.count = 0};
    for (int kind = 0; kind < world->kinds.count; kind++) {
        const bool has = mill_world_has(world, kind);
        l.number[kind] = has ? l.count : -1;
        l.kind[l.count] = kind;
        l.name[l.count] = world->kinds.name[kind];
        l.count += has;
    }
    l.kind[l.count] = world->kinds.count;
    l.name[l.count] = "all";
    return l;
}

#endif
