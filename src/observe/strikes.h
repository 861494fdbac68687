/* Re-contacts: a soft contact swallows what hard spheres count as several. A contact that follows
 * the previous one of the same pair within the window belongs to the same strike. */
#ifndef MILL_STRIKES_H
#define MILL_STRIKES_H

#include "millsim/kinds.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct mill_strike {
    uint64_t pair;  /* kind, ball and partner in one number */
    double time;    /* [s] of the pair's last contact; -INFINITY: the entry was never used */
    int16_t normal; /* the owner's: slot of the first contact's normal speed, < 0: do not count */
    int16_t tangential; /* the owner's: slot of its tangential speed */
    int32_t portion;    /* the owner's: when it began */
};

/* Hash table of the pairs in contact of late */
struct mill_strikes {
    double window; /* [s] */
    int bits;      /* log2 of the number of buckets */
    struct mill_strike *entry;
};

/* false: out of memory */
bool mill_strikes_init(struct mill_strikes *strikes, double window);
void mill_strikes_free(struct mill_strikes *strikes);

/* The entry of this pair, brought up to this contact; *since [s]: from its last one, INFINITY where
 * the contact starts a strike, and then the caller fills in the slots. Times must not decrease from
 * call to call. The entry is good until the next call. Balls and partners number less than 2^29
 * (partner -1: none). NULL: out of memory. */
struct mill_strike *mill_strikes_meet(struct mill_strikes *strikes, int kind, int32_t ball,
                                      int32_t partner, double time, double *since);

/* Entries there are, used or not. */
size_t mill_strikes_room(const struct mill_strikes *strikes);

/* Gives the table 2^bits buckets, or more where the entries that are alive at `now` (INFINITY: none
 * is) need them. false: out of memory, the table is as before. */
bool mill_strikes_resize(struct mill_strikes *strikes, int bits, double now);

#endif
