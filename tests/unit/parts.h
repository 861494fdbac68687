/* The classic parts of a mill as surfaces of a setup: the drum, and on motion 0 shaft and blades.
 */
#ifndef PARTS_H
#define PARTS_H

#include "geometry/shapes.h"
#include "millsim/lining.h"

/* A drum with buckles. Its corners stay until some hundreds of other drums are made. */
static inline struct mill_setup_drum wavy_drum(int buckles, double radius, double length,
                                               double height, double angle)
{
    enum { DRUMS = 128 };
    static struct mill_corner corners[DRUMS][2 * (MILL_LINING_MOST + 1)];
    static int drums;
    struct mill_corner *corner = corners[drums++ % DRUMS];
    const struct mill_lining is = {.form = MILL_LINING_WAVY,
                                   .radius = radius,
                                   .count = buckles,
                                   .height = height,
                                   .angle = angle};
    return (struct mill_setup_drum){.radius = radius,
                                    .length = length,
                                    .corners = mill_lining_corners(&is, corner),
                                    .corner = corner};
}

static inline struct mill_setup_surface drum_surface(const struct mill_body *drum, int motion)
{
    return (struct mill_setup_surface){.solid = drum->corners > 0 ? &mill_contour_solid
                                                                  : &mill_prism_solid,
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
    const struct mill_body body = mill_setup_drum_body(drum);
    const double far = mill_solid_hull(mill_setup_drum_solid(drum), &body).radius;
    return (struct mill_reach){{-half, -far, -far}, {half, far, far}, far};
}

#endif
