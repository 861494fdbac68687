/* What several kinds of shape share. */
#include "geometry/shape.h"

#include "geometry/mesh.h"

void mill_shape_draw_drum(const struct mill_shape *shape, const struct mill_chamber *chamber,
                          struct mill_mesh *mesh)
{
    (void)shape;
    mill_mesh_mantle(mesh, &chamber->drum, chamber->half_length, chamber->tolerance, true);
}
