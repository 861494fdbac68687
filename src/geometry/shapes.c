/* Builds the surfaces of a mill. */
#include "geometry/shapes.h"

#include <assert.h>
#include <stdlib.h>

const struct mill_shape_type *const mill_shapes_named[] = {&mill_blade_type, NULL};

struct mill_chamber mill_shapes_chamber(const struct mill_setup_drum *drum)
{
    assert(drum->radius > 0.0 && drum->length > 0.0);
    /* a circle is the profile whose buckles have no height */
    const bool wavy = drum->buckles > 0;
    return (struct mill_chamber){
        .drum =
            mill_profile_make(wavy ? drum->buckles : 2, drum->radius,
                              wavy ? drum->buckle_height : 0.0, wavy ? drum->buckle_angle : 0.0),
        .half_length = 0.5 * drum->length,
    };
}

void mill_shapes_free(struct mill_shape **shapes, int count)
{
    for (int k = 0; k < count; k++) {
        if (shapes[k])
            shapes[k]->type->free(shapes[k]);
    }
    free(shapes);
}

bool mill_shapes_create(const struct mill_setup *setup, struct mill_motion *const *motion,
                        struct mill_poly_counts *counts, struct mill_shape ***shapes, int *count)
{
    const struct mill_chamber chamber = mill_shapes_chamber(&setup->drum);
    const struct mill_setup_surface drum[] = {
        {.type = chamber.drum.height > 0.0 ? &mill_wavy_type : &mill_cylinder_drum_type,
         .number = -1,
         .motion = MILL_STILL},
        {.type = &mill_plate_type, .number = 0, .motion = MILL_STILL},
        {.type = &mill_plate_type, .number = 1, .motion = MILL_STILL},
    };
    const int own = sizeof drum / sizeof *drum;
    bool good = true;
    *count = own + setup->surfaces;
    *shapes = calloc((size_t)*count, sizeof **shapes);
    for (int k = 0; *shapes && k < *count; k++) {
        const struct mill_setup_surface *s = k < own ? &drum[k] : &setup->surface[k - own];
        assert(s->motion == MILL_STILL || (s->motion >= 0 && s->motion < setup->motions));
        const struct mill_shape base = {
            .type = s->type,
            .motion = s->motion == MILL_STILL ? NULL : motion[s->motion],
            .number = s->number,
            .counts = counts,
        };
        (*shapes)[k] = s->type->create(&base, s->form, &chamber);
        good = good && (*shapes)[k];
    }
    if (*shapes && good)
        return true;
    mill_shapes_free(*shapes, *shapes ? *count : 0);
    *shapes = NULL;
    *count = 0;
    return false;
}
