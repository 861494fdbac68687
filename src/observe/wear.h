/* Where do impacts hit the parts of the mill, and how much energy do they leave there? Sums for
 * each facet of the surfaces. */
#ifndef MILL_WEAR_H
#define MILL_WEAR_H

#include "millsim/observer.h"
#include "observe/observe.h"
#include "observe/wear_facets.h"

#include <stdint.h>

/* Sums of the impacts on a facet */
struct mill_wear_sum {
    uint64_t count;
    double normal, sliding; /* [J] lost along the normal, and in the surface */
    double slid;            /* [J] part of `sliding` of impacts that did not stick */
    double carved;          /* [J] Finnie's m g^2 f(angle); see wear.c */
    double normal_squares, sliding_squares, slid_squares; /* [J^2] of single impacts */
};

struct mill_wear {
    struct mill_wear_plan *plan; /* shared by all that were made with mill_wear_like */
    bool owns;                   /* it frees the plan */
    struct mill_wear_sum *sum;   /* [facets] */
};

/* false: out of memory. The caller frees it in both cases. */
bool mill_wear_init(struct mill_wear *wear, const struct mill_world *world);
/* Makes empty sums for the same facets */
bool mill_wear_like(struct mill_wear *wear, const struct mill_wear *as);
void mill_wear_free(struct mill_wear *wear);

/* into += from */
void mill_wear_add(struct mill_wear *into, const struct mill_wear *from);
void mill_wear_clear(struct mill_wear *wear);

/* The sums of the facet that an impact is on; NULL: it is not on a surface of this world. They are
 * requested from memory, so that a later call of mill_wear_impact need not wait for them. */
struct mill_wear_sum *mill_wear_facet(const struct mill_wear *wear,
                                      const struct mill_impact *impact);
void mill_wear_impact(const struct mill_wear *wear, struct mill_wear_sum *sum,
                      const struct mill_impact *impact);

/* Path of the triangles in the file, and the names of the numbers of each triangle */
#define MILL_WEAR_MESH "/statistics/wear/mesh"
enum { MILL_WEAR_SHOWN = 5 };
extern const char *const mill_wear_shown[MILL_WEAR_SHOWN];

/* Writes the group "wear" of a window of `duration` [s]. law: [kinds] */
void mill_wear_tell(const struct mill_wear *wear, double duration, const struct mill_wear_law *law,
                    struct mill_sink *sink);

#endif
