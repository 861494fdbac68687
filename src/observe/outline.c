/* Collects the triangles of all surfaces that a motion carries. */
#include "observe/outline.h"

#include "observe/kinds.h"

#include <stdlib.h>
#include <string.h>

/* Relative to the container's radius: maximum distance of a triangle from its surface */
#define FLAT 1e-3

bool mill_outline_make(const struct mill_world *world, const struct mill_motion *motion,
                       struct mill_outline *outline)
{
    const struct mill_listed kinds = mill_kinds_listed(world);
    struct mill_mesh *mesh = &outline->mesh;
    *outline = (struct mill_outline){{0}, NULL, NULL};
    for (int k = 0; k < world->shapes && !mesh->failed; k++) {
        const struct mill_shape *shape = world->shape[k];
        const size_t before = mesh->triangles;
        if (shape->motion != motion)
            continue;
        mill_outline_draw(shape, FLAT * world->container.radius, mesh);
        uint8_t *kind = realloc(outline->kind, mesh->triangles + 1);
        outline->kind = kind ? kind : outline->kind;
        int32_t *number = realloc(outline->number, (mesh->triangles + 1) * sizeof *number);
        outline->number = number ? number : outline->number;
        mesh->failed = mesh->failed || !kind || !number;
        for (size_t i = before; i < mesh->triangles && !mesh->failed; i++) {
            kind[i] = (uint8_t)kinds.number[shape->kind];
            number[i] = shape->number;
        }
    }
    return !mesh->failed;
}

void mill_outline_rows(const struct mill_pose *pose, double row[12])
{
    const vec3 x = pose->x, y = pose->y, z = pose->z, o = pose->place;
    const double rows[12] = {x.x, y.x, z.x, o.x, x.y, y.y, z.y, o.y, x.z, y.z, z.z, o.z};
    memcpy(row, rows, sizeof rows);
}

void mill_outline_free(struct mill_outline *outline)
{
    mill_mesh_free(&outline->mesh);
    free(outline->kind);
    free(outline->number);
}
