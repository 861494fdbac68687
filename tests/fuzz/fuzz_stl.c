/* An STL file from any bytes: refused with one line, or as many facets as are told, of finite
 * corners, and then a mesh that is sound, and gives a ball a finite gap anywhere, or one with a
 * fault in words. */
#include "../unit/lone_shape.h"
#include "fuzz.h"

#include "deck/stl.h"
#include "geometry/facets.h"

static void ask_mesh(const struct mill_body *body, const vec3 place)
{
    const struct mill_reach places = {{-1.0, -1.0, -1.0}, {1.0, 1.0, 1.0}, INFINITY};
    struct mill_shape *shape = lone_shape(&mill_facets_solid, body, NULL, &places);
    fuzz_require(shape != NULL, "out of memory");
    const struct mill_flight f = {
        .r = place, .v = vec3_scale(place, -1.0), .slack = INFINITY, .travel = INFINITY};
    const double gap = mill_shape_gap(shape, place, 0.1, &mill_pose_still);
    const struct mill_hit hit = shape->type->next_contact(shape, &f, 0.1, 0.0, 0.06, false);
    fuzz_require(isfinite(gap), "a gap of %g m", gap);
    fuzz_require(hit.state == MILL_HIT_NONE || (hit.t >= 0.0 && hit.t <= 0.06),
                 "a contact after %g s", hit.t);
    lone_shape_free(shape);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static struct fuzz_file file;
    struct mill_error error = {""};
    char text[MILL_SHAPE_FAULT] = "";
    vec3(*facet)[3] = NULL;
    size_t facets = 0;
    const char *path = fuzz_file_write(&file, data, size);
    const enum mill_status status = mill_stl_read(path, 1e-3, &facet, &facets, &error);
    if (fuzz_shown())
        fprintf(stderr, "%zu facets %s\n", facets, error.text);
    if (status != MILL_OK) {
        fuzz_require(!facet && facets == 0, "facets in spite of an error");
        fuzz_require_message(error.text);
        return 0;
    }
    fuzz_require(facets > 0 && facets * 5 <= size, "%zu facets of %zu bytes", facets, size);
    for (size_t k = 0; k < 3 * facets; k++) {
        const vec3 p = facet[k / 3][k % 3];
        fuzz_require(isfinite(p.x) && isfinite(p.y) && isfinite(p.z), "a corner at no place");
    }
    const struct mill_body body = {.x = {1.0, 0.0, 0.0},
                                   .y = {0.0, 1.0, 0.0},
                                   .z = {0.0, 0.0, 1.0},
                                   .facets = facets,
                                   .facet = (const vec3(*)[3])facet};
    const char *fault = mill_facets_fault(&body, text);
    if (fault)
        fuzz_require_message(fault);
    if (mill_facets_solid.is_sound(&body)) /* with a fault or without */
        ask_mesh(&body, vec3_axpy(facet[0][0], 1e-3, vec3_make(1.0, 2.0, 3.0)));
    free(facet);
    return 0;
}
