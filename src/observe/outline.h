/* What a mill looks like: its surfaces as triangles, those that stand still or those that turn. */
#ifndef MILL_OUTLINE_H
#define MILL_OUTLINE_H

#include "geometry/mesh.h"
#include "millsim/status.h"
#include "millsim/world.h"

struct mill_outline {
    struct mill_mesh mesh; /* the rotor at angle 0 */
    uint8_t *kind;         /* of each triangle: enum mill_kind of balls that meet it */
    int32_t *number;       /* of each triangle: of the end wall or blade, -1 where there is one */
};

/* drum: its cross-section. No triangles where nothing turns. MILL_FAILED: out of memory; free it in
 * any case. */
enum mill_status mill_outline_make(const struct mill_profile *drum, const struct mill_world *world,
                                   bool turning, struct mill_outline *outline,
                                   struct mill_error *error);
void mill_outline_free(struct mill_outline *outline);

#endif
