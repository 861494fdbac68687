/* Where do impacts hit the parts of the mill, and how much energy do they leave there? Sums for
 * each facet of the surfaces. */
#ifndef MILL_WEAR_H
#define MILL_WEAR_H

#include "millsim/observer.h"
#include "observe/observe.h"
#include "observe/sums.h"
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

extern const struct mill_sums_list mill_wear_sums;

/* Makes the facets of a world. false: out of memory. The caller frees them in both cases. */
bool mill_wear_init(struct mill_wear_plan *plan, const struct mill_world *world);

/* Of sum[facets], those of the facet that an impact is on; NULL: it is not on a surface of this
 * world. They are requested from memory, so that a later call of mill_wear_impact need not wait for
 * them. */
struct mill_wear_sum *mill_wear_facet(const struct mill_wear_plan *plan, struct mill_wear_sum *sum,
                                      const struct mill_impact *impact);
void mill_wear_impact(const struct mill_wear_plan *plan, struct mill_wear_sum *sum,
                      const struct mill_impact *impact);

/* Path of the triangles in the file, and the names of the numbers of each triangle */
#define MILL_WEAR_MESH "/statistics/wear/mesh"
enum { MILL_WEAR_SHOWN = 5 };
const char *mill_wear_shown(int k);

/* Writes the group "wear" of a window of `duration` [s]. sum: [facets]; law: [kinds] */
void mill_wear_tell(const struct mill_wear_plan *plan, const struct mill_wear_sum *sum,
                    double duration, const struct mill_wear_law *law, struct mill_sink *sink);

#endif
