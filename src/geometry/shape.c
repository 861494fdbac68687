/* What several kinds of shape share. */
#include "geometry/shape.h"

#include "geometry/mesh.h"

#include <assert.h>
#include <stdlib.h>

void mill_shape_draw_drum(const struct mill_shape *shape, const struct mill_chamber *chamber,
                          double tolerance, struct mill_mesh *mesh)
{
    (void)shape;
    mill_mesh_mantle(mesh, &chamber->drum, chamber->half_length, tolerance, true);
}

void *mill_shape_allocate(const struct mill_shape *base, size_t size)
{
    assert(size >= sizeof *base);
    struct mill_shape *shape = calloc(1, size);
    if (shape)
        *shape = *base;
    return shape;
}

void mill_shape_free(struct mill_shape *shape)
{
    free(shape);
}
