/* The triangles of pictures of the facets, which are as large as the facets on average. A facet in
 * which no such triangle has its middle is shown by the pieces that it was made of. */
#include "observe/wear_facets.h"

#include <stdlib.h>
#include <string.h>

#define SHOWN 1.5 /* times the size of a cell: longest edges of the triangles */
struct outline {
    const struct mill_wear_plan *plan;
    int part;
    struct mill_mesh *mesh;
    int32_t *facet; /* of each triangle; -1: none */
    bool *sought;   /* [facets] */
    bool *seen;     /* [facets] */
    bool found;
};

static int32_t facet_of(const struct outline *to, const vec3 corner[3])
{
    return mill_wear_facets_find(to->plan, to->part, mill_mesh_middle(corner),
                                 mill_mesh_area(corner));
}

/* Adds a triangle with the number of its facet. */
static void show(void *adds, const vec3 corner[3])
{
    struct outline *to = adds;
    const size_t n = to->mesh->triangles;
    if ((n & (n - 1)) == 0) { /* the room doubles */
        int32_t *more = realloc(to->facet, (n > 0 ? 2 * n : 1) * sizeof *more);
        to->mesh->failed = to->mesh->failed || !more;
        if (more)
            to->facet = more;
    }
    if (to->mesh->failed)
        return;
    to->facet[n] = facet_of(to, corner);
    mill_mesh_triangle(to->mesh, corner[0], corner[1], corner[2]);
}

/* Does a piece belong to a facet that is sought? */
static void ask(void *adds, const vec3 corner[3])
{
    struct outline *to = adds;
    const int32_t id = facet_of(to, corner);
    to->found = to->found || (id >= 0 && to->sought[id]);
}

/* Adds a triangle, or its pieces if one of them belongs to a facet that is sought. */
static void show_pieces(void *adds, const vec3 corner[3])
{
    struct outline *to = adds;
    const double piece = mill_wear_facets_piece(&to->plan->part[to->part]);
    to->found = false;
    mill_mesh_cut_triangle(corner, piece, ask, to);
    mill_mesh_cut_triangle(corner, to->found ? piece : HUGE_VAL, show, to);
}

/* Seeks the facets of a part that none of the triangles from `first` on shows; were there more? */
static bool seek_missing(struct outline *to, size_t first)
{
    const struct mill_wear_part *p = &to->plan->part[to->part];
    bool more = false;
    memset(to->seen + p->first, 0, (size_t)p->count * sizeof *to->seen);
    for (size_t i = first; i < to->mesh->triangles; i++)
        if (to->facet[i] >= 0)
            to->seen[to->facet[i]] = true;
    for (int32_t id = p->first; id < p->first + p->count; id++)
        if (!to->seen[id]) {
            more = more || !to->sought[id];
            to->sought[id] = true;
        }
    return more;
}

/* Adds the surfaces of a part. Pieces can replace the only triangle of another facet: then this one
 * is sought as well, until none is missing. */
static void show_part(struct outline *to)
{
    const size_t points = to->mesh->points, triangles = to->mesh->triangles;
    const struct mill_wear_part *p = &to->plan->part[to->part];
    const double size = fmax(SHOWN * p->cut, 1e-9);
    mill_mesh_on_piece *on = show;
    struct mill_mesh whole;
    mill_wear_facets_draw(to->plan, to->part, &whole);
    memset(to->sought + p->first, 0, (size_t)p->count * sizeof *to->sought);
    do {
        to->mesh->points = points;
        to->mesh->triangles = triangles;
        mill_mesh_cut(&whole, size, on, to);
        on = show_pieces;
    } while (!to->mesh->failed && seek_missing(to, triangles));
    to->mesh->failed = to->mesh->failed || whole.failed;
    mill_mesh_free(&whole);
}

bool mill_wear_outline(const struct mill_wear_plan *plan, const struct mill_motion *motion,
                       struct mill_mesh *mesh, int32_t **facet)
{
    const size_t room = (size_t)plan->facets + 1;
    struct outline to = {.plan = plan,
                         .mesh = mesh,
                         .sought = malloc(room * sizeof *to.sought),
                         .seen = malloc(room * sizeof *to.seen)};
    *mesh = (struct mill_mesh){.failed = !to.sought || !to.seen};
    for (to.part = 0; !mesh->failed && to.part < plan->parts; to.part++)
        if (plan->world->shape[plan->part[to.part].shape]->motion == motion)
            show_part(&to);
    free(to.sought);
    free(to.seen);
    *facet = to.facet;
    return !mesh->failed;
}
