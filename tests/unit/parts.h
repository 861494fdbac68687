/* The classic parts of a mill as surfaces of a setup: the drum, and on motion 0 shaft and blades.
 */
#ifndef PARTS_H
#define PARTS_H

#include "geometry/shapes.h"

static inline struct mill_setup_surface drum_surface(const struct mill_body *drum, int motion)
{
    return (struct mill_setup_surface){.solid = &mill_prism_solid,
                                       .body = drum,
                                       .number = -1,
                                       .motion = motion,
                                       .kind = MILL_BALL_DRUM,
                                       .ends = MILL_BALL_WALL};
}

static inline struct mill_setup_surface shaft_surface(const struct mill_body *shaft)
{
    return (struct mill_setup_surface){
        .solid = &mill_prism_solid, .body = shaft, .number = -1, .kind = MILL_BALL_SHAFT};
}

static inline struct mill_setup_surface blade_surface(const struct mill_body *blade, int number)
{
    return (struct mill_setup_surface){
        .solid = &mill_box_solid, .body = blade, .number = number, .kind = MILL_BALL_BLADE};
}

/* All places that a drum at rest reaches */
static inline struct mill_reach drum_places(const struct mill_setup_drum *drum)
{
    const double half = 0.5 * drum->length;
    const double far = drum->radius + (drum->buckles > 0 ? drum->buckle_height : 0.0);
    return (struct mill_reach){{-half, -far, -far}, {half, far, far}, far};
}

#endif
