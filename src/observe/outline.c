/* Asks every surface of the mill what balls can see of it. */
#include "observe/outline.h"

#include "geometry/shape.h"

#include <stdlib.h>

/* Of the drum's radius: no triangle is farther from the surface that it stands for. */
#define FLAT 1e-3

enum mill_status mill_outline_make(const struct mill_profile *drum, const struct mill_world *world,
                                   bool turning, struct mill_outline *outline,
                                   struct mill_error *error)
{
    const struct mill_outline nothing = {{0}, NULL, NULL};
    const struct mill_chamber chamber = {.drum = *drum, .half_length = 0.5 * world->drum_length};
    struct mill_mesh *mesh = &outline->mesh;
    *outline = nothing;
    for (int k = 0; k < world->shapes && !mesh->failed; k++) {
        const struct mill_shape *shape = world->shape[k];
        const size_t before = mesh->triangles;
        if ((shape->motion != NULL) != turning)
            continue;
        shape->type->draw(shape, &chamber, FLAT * drum->radius, mesh);
        uint8_t *kind = realloc(outline->kind, mesh->triangles + 1);
        outline->kind = kind ? kind : outline->kind;
        int32_t *number = realloc(outline->number, (mesh->triangles + 1) * sizeof *number);
        outline->number = number ? number : outline->number;
        mesh->failed = mesh->failed || !kind || !number;
        for (size_t i = before; i < mesh->triangles && !mesh->failed; i++) {
            kind[i] = (uint8_t)shape->type->kind;
            number[i] = shape->number;
        }
    }
    return mesh->failed ? mill_error_set(error, MILL_FAILED, "out of memory for the mill's outline")
                        : MILL_OK;
}

void mill_outline_free(struct mill_outline *outline)
{
    mill_mesh_free(&outline->mesh);
    free(outline->kind);
    free(outline->number);
}
