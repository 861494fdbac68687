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

double mill_shape_circle(const struct mill_flight *f, double y0, double z0, double rho, double s,
                         double horizon, bool touching, struct mill_poly_counts *counts)
{
    const double y = f->r.y - y0, z = f->r.z - z0;
    const double p[5] = {
        s * (y * y + z * z - rho * rho),
        s * 2.0 * (y * f->v.y + z * f->v.z),
        s * (f->v.y * f->v.y + f->v.z * f->v.z + y * f->g.y + z * f->g.z),
        s * (f->v.y * f->g.y + f->v.z * f->g.z),
        s * 0.25 * (f->g.y * f->g.y + f->g.z * f->g.z),
    };
    return mill_poly_first_rise(p, horizon, touching, counts);
}
