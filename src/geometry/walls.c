/* Builds the surfaces of a deck. A new shape is one file, and its place in this list. */
#include "geometry/walls.h"

#include "geometry/blade.h"
#include "geometry/cylinder.h"
#include "geometry/plate.h"
#include "geometry/wavy.h"

#include <stdlib.h>

void mill_walls_free(struct mill_shape **shapes, int count)
{
    for (int k = 0; k < count; k++) {
        if (shapes[k])
            shapes[k]->ops->free(shapes[k]);
    }
    free(shapes);
}

/* Buckles of no height are the circle. */
static struct mill_shape *make_drum(const struct mill_deck *deck)
{
    if (!deck->wavy || deck->buckle_height == 0.0)
        return mill_cylinder_drum(deck->drum_radius);
    const struct mill_profile profile = mill_profile_make((int)deck->buckles, deck->drum_radius,
                                                          deck->buckle_height, deck->buckle_angle);
    return mill_wavy_create(&profile);
}

enum mill_status mill_walls_create(const struct mill_deck *deck, struct mill_poly_counts *counts,
                                   struct mill_shape ***shapes, int *count,
                                   struct mill_error *error)
{
    int n = 0;
    *count = 0;
    *shapes = calloc((size_t)deck->blades + 4, sizeof **shapes);
    if (!*shapes)
        return mill_error_set(error, MILL_FAILED, "out of memory for the mill's surfaces");
    (*shapes)[n++] = make_drum(deck);
    (*shapes)[n++] = mill_plate_create(0, deck->drum_length);
    (*shapes)[n++] = mill_plate_create(1, deck->drum_length);
    if (deck->rotor && deck->shaft_radius > 0.0)
        (*shapes)[n++] = mill_cylinder_shaft(deck->shaft_radius, deck->rotor_speed);
    for (int k = 0; k < deck->blades; k++)
        (*shapes)[n++] =
            mill_blade_create(&deck->blade[k], k, deck->rotor_speed, mill_deck_drum_reach(deck));
    for (int k = 0; k < n; k++) {
        if (!(*shapes)[k]) {
            mill_walls_free(*shapes, n);
            *shapes = NULL;
            return mill_error_set(error, MILL_FAILED, "out of memory for the mill's surfaces");
        }
        (*shapes)[k]->counts = counts;
    }
    *count = n;
    return MILL_OK;
}
