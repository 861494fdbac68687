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
    for (int k = 0; shapes && k < count && shapes[k]; k++) {
        if (shapes[k]->type->free)
            shapes[k]->type->free(shapes[k]);
        free(shapes[k]);
    }
    free(shapes);
}

bool mill_shapes_create(const struct mill_setup *setup, struct mill_motion *const *motion,
                        struct mill_poly_counts *counts, struct mill_shape ***shapes, int *count)
{
    const struct mill_chamber chamber = mill_shapes_chamber(&setup->drum);
    const bool wavy = chamber.drum.height > 0.0;
    const struct mill_setup_surface drum[] = {
        {wavy ? &mill_wavy_type : &mill_cylinder_drum_type, NULL, -1, MILL_STILL},
        {&mill_plate_type, NULL, 0, MILL_STILL},
        {&mill_plate_type, NULL, 1, MILL_STILL},
    };
    const int own = sizeof drum / sizeof *drum;
    *count = own + setup->surfaces;
    *shapes = calloc((size_t)*count, sizeof **shapes);
    bool good = *shapes != NULL;
    for (int k = 0; good && k < *count; k++) {
        const struct mill_setup_surface *s = k < own ? &drum[k] : &setup->surface[k - own];
        struct mill_shape *shape = (*shapes)[k] = calloc(1, s->type->size);
        if (!shape)
            return false;
        assert(s->motion == MILL_STILL || (s->motion >= 0 && s->motion < setup->motions));
        shape->type = s->type;
        shape->motion = s->motion == MILL_STILL ? NULL : motion[s->motion];
        shape->number = s->number;
        shape->counts = counts;
        good = s->type->create(shape, s->form, &chamber);
    }
    return good;
}
