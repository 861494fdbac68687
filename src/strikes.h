/* Re-contacts: a soft contact swallows what hard spheres count as several. A contact that follows
 * the previous one of the same pair within the window belongs to the same strike. */
#ifndef MILL_STRIKES_H
#define MILL_STRIKES_H

#include "millsim/kinds.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct mill_strike {
    uint64_t pair;      /* kind, ball and partner in one number; or: taken over by a later one */
    double time;        /* [s] of the contact */
    int16_t normal;     /* the owner's: slot of the first contact's normal speed, < 0: none */
    int16_t tangential; /* the owner's: slot of its tangential speed */
    uint32_t before;    /* number of the contact before this one in its list */
};

/* The latest contacts in the order of time, a ring of 2^bits entries. They have numbers that count
 * on and on, modulo 2^32; number k is entry[k mod 2^bits]. Any numbers are safe: damaged ones
 * give wrong answers, nothing worse. */
struct mill_strikes {
    double window;        /* [s] */
    int bits;             /* log2 of the number of entries */
    uint32_t first, next; /* numbers of the oldest contact kept, and of the next to come */
    struct mill_strike *entry;
    uint32_t *newest; /* of each list; a number that is not kept any more: the list is empty */
};

/* false: out of memory */
bool mill_strikes_init(struct mill_strikes *strikes, double window);
void mill_strikes_free(struct mill_strikes *strikes);

/* The entry of this contact; *fresh tells whether it starts a strike, and then the caller fills in
 * the slots; else they are those of the strike. Times must not decrease from call to call. The
 * entry is good until the next call. Balls and partners number less than 2^30 (partner -1: none).
 * NULL: out of memory. */
struct mill_strike *mill_strikes_meet(struct mill_strikes *strikes, enum mill_kind kind,
                                      int32_t ball, int32_t partner, double time, bool *fresh);

/* Entries there are, used or not; lists likewise. */
size_t mill_strikes_room(const struct mill_strikes *strikes);
size_t mill_strikes_lists(const struct mill_strikes *strikes);

/* Empties the table and gives it 2^bits entries. false: out of memory, the table is as before. */
bool mill_strikes_resize(struct mill_strikes *strikes, int bits);

#endif
