/* Bodies as unions of convex parts: a convex body is one part, any other has one for each facet. */
#include "start/clash_solid.h"

#include <stdlib.h>

/* ---- the tree ---- */

static struct mill_clash_ball ball_of(const struct mill_clash_solid *s, int32_t part)
{
    return (struct mill_clash_ball){s->part[part].centre, s->part[part].around, part, -1};
}

/* The sphere around a box, with what the parts in it are grown by */
static struct mill_clash_ball around(const struct mill_clash_solid *s, int32_t box)
{
    const struct mill_facets_node *n = &s->tree.node[box];
    const vec3 lo = {(double)n->lo[0], (double)n->lo[1], (double)n->lo[2]};
    const vec3 hi = {(double)n->hi[0], (double)n->hi[1], (double)n->hi[2]};
    if (n->leaf != MILL_FACETS_INNER && (n->leaf & 7) == 1)
        return ball_of(s, s->tree.order[n->leaf >> 3]);
    const double radius = 0.5 * vec3_norm(vec3_sub(hi, lo)) + s->part->core.grown;
    return (struct mill_clash_ball){vec3_scale(vec3_add(lo, hi), 0.5), radius, -1, box};
}

void mill_clash_solid_halves(const struct mill_clash_solid *s, const struct mill_clash_ball *ball,
                             struct mill_clash_ball half[2])
{
    const struct mill_facets_node *n = &s->tree.node[ball->box];
    const int32_t first = ball->box + 1;
    for (int k = 0; k < 2; k++)
        half[k] = n->leaf == MILL_FACETS_INNER ? around(s, k == 0 ? first : n[1].skip)
                                               : ball_of(s, s->tree.order[(n->leaf >> 3) + k]);
}

static bool plant(struct mill_clash_solid *s)
{
    vec3(*facet)[3] = malloc(sizeof *facet * (size_t)s->parts);
    for (int32_t k = 0; facet && k < 3 * s->parts; k++)
        facet[k / 3][k % 3] = vec3_add(s->part[k / 3].centre, s->part[k / 3].core.corner[k % 3]);
    const bool good =
        facet && mill_facets_plant((const vec3(*)[3])facet, (size_t)s->parts, &s->tree);
    if (good)
        s->all = around(s, 0);
    free(facet);
    return good;
}

/* ---- solids ---- */

bool mill_clash_solid_init(struct mill_clash_solid *s, const struct mill_setup *setup, int k,
                           struct mill_motion *const *motion)
{
    const struct mill_setup_surface *surface = &setup->surface[k];
    const struct mill_solid *solid = surface->solid;
    *s = (struct mill_clash_solid){
        .surface = k,
        .kind = surface->kind,
        .motion = surface->motion == MILL_STILL ? NULL : motion[surface->motion],
        .solid = solid,
        .body = surface->body,
        .axis = surface->body->z};
    if (!mill_part_list(solid, surface->body, &s->part, &s->parts))
        return false;
    s->all = ball_of(s, 0);
    return solid->support || plant(s);
}

void mill_clash_solid_free(struct mill_clash_solid *s)
{
    free(s->part);
    mill_facets_fell(&s->tree);
}

/* The solid angles of all facets add up to 4 pi for a point inside the solid, outside to 0. */
bool mill_clash_solid_holds(const struct mill_clash_solid *solid, vec3 place)
{
    double angle = 0.0;
    if (vec3_norm(vec3_sub(place, solid->all.centre)) > solid->all.radius)
        return false;
    for (int32_t k = 0; k < solid->parts; k++) {
        const struct mill_part *p = &solid->part[k];
        const vec3 at = vec3_sub(p->centre, place), *c = p->core.corner;
        angle += mill_facets_angle(vec3_add(at, c[0]), vec3_add(at, c[1]), vec3_add(at, c[2]));
    }
    return fabs(angle) > MILL_PI;
}
