/* Re-contacts: several contacts of hard spheres that one of soft balls would include. A contact
 * that follows the last one of its pair within the window belongs to the same strike. */
#ifndef MILL_STRIKES_H
#define MILL_STRIKES_H

#include "millsim/kinds.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct mill_strike {
    uint64_t pair;  /* kind, ball and partner in one number */
    double time;    /* [s] of the pair's last contact; -INFINITY: unused entry */
    int16_t normal; /* for the caller: slot of the first contact's normal speed; < 0: not counted */
    int16_t tangential; /* for the caller: slot of its tangential speed */
    int32_t portion;    /* for the caller: portion in which the strike began */
};

/* Hash table of the pairs that were in contact recently */
struct mill_strikes {
    double window; /* [s] */
    int bits;      /* log2 of the number of buckets */
    struct mill_strike *entry;
};

/* false: out of memory */
bool mill_strikes_init(struct mill_strikes *strikes, double window);
void mill_strikes_free(struct mill_strikes *strikes);

/* Finds the entry of this pair and sets its time to that of this contact. *since [s]: time since
 * the last; INFINITY: a new strike, and the caller sets the slots. Times must not decrease. It is
 * valid until the next call. Balls and partners are < 2^29 (partner -1: none). NULL: no memory */
struct mill_strike *mill_strikes_meet(struct mill_strikes *strikes, int kind, int32_t ball,
                                      int32_t partner, double time, double *since);

/* Number of entries, used or not. */
size_t mill_strikes_room(const struct mill_strikes *strikes);

/* Gives the table 2^bits buckets, or more if the valid entries need them: those within the window
 * before `now` (INFINITY: none). false: out of memory; the table is unchanged. */
bool mill_strikes_resize(struct mill_strikes *strikes, int bits, double now);

#endif
