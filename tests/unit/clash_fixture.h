/* Bodies and triangles of any size and place, as the check for clashes sees them, and places in
 * them. */
#ifndef CLASH_FIXTURE_H
#define CLASH_FIXTURE_H

#include "extended.h"
#include "start/clash_solid.h"

enum { KINDS = 5 };
static const struct mill_solid *const kinds[KINDS] = {
    &mill_box_solid, &mill_round_cylinder_solid, &mill_round_cone_solid, &mill_round_capsule_solid,
    &mill_round_sphere_solid};

/* One body, or a triangle, as a solid */
struct lone {
    struct mill_clash_solid solid;
    const struct mill_solid *kind;
    struct mill_body body;
    vec3 facet[1][3];
    vec3 corner[3]; /* [m] in the frame */
};

static inline void lone_open(uint64_t *seed, struct lone *o, int kind, vec3 centre)
{
    struct mill_body *b = &o->body;
    const vec3 z = direction(seed), any = direction(seed);
    const vec3 x = vec3_axpy(any, -vec3_dot(any, z), z);
    *o = (struct lone){.kind = kind < KINDS ? kinds[kind] : &mill_facets_solid};
    b->centre = centre;
    b->z = z;
    b->x = vec3_scale(x, 1.0 / vec3_norm(x));
    b->y = vec3_cross(b->z, b->x);
    b->size = vec3_make(log_uniform(seed, 1e-3, 0.1), log_uniform(seed, 1e-3, 0.1), 0.02);
    b->radius = log_uniform(seed, 1e-3, 0.05);
    b->end_radius = below(seed, 4) ? log_uniform(seed, 1e-3, 0.05) : 0.0;
    b->length = log_uniform(seed, 1e-3, 0.2);
    if (below(seed, 2) && kind < KINDS)
        for (b->rounding = 1e-2; b->rounding > 0.0 && !o->kind->is_sound(b);)
            b->rounding = b->rounding > 1e-6 ? 0.7 * b->rounding : 0.0;
    for (int k = 0; k < 3; k++) {
        const vec3 c = o->facet[0][k] = vec3_scale(direction(seed), log_uniform(seed, 1e-3, 0.1));
        o->corner[k] =
            vec3_add(centre, vec3_axpy(vec3_axpy(vec3_scale(b->x, c.x), c.y, b->y), c.z, b->z));
    }
    if (kind == KINDS) {
        b->facets = 1;
        b->facet = (const vec3(*)[3])o->facet;
    }
    const struct mill_setup_surface s = {.solid = o->kind, .body = b, .motion = MILL_STILL};
    const struct mill_setup setup = {.surfaces = 1, .surface = &s};
    ck_assert(mill_clash_solid_init(&o->solid, &setup, 0, NULL));
}

/* Any place of the body or triangle; at its edges often */
static inline vec3 place_of(uint64_t *seed, const struct lone *o)
{
    const struct mill_body *b = &o->body;
    const double grown = o->kind == &mill_round_sphere_solid || o->kind == &mill_round_capsule_solid
                             ? b->radius
                             : b->rounding;
    const double s = below(seed, 2) ? uniform(seed, -1.0, 1.0) : (below(seed, 2) ? 1.0 : -1.0);
    const double u = below(seed, 2) ? uniform(seed, -1.0, 1.0) : (below(seed, 2) ? 1.0 : -1.0);
    const double w = below(seed, 2) ? uniform(seed, -1.0, 1.0) : (below(seed, 2) ? 1.0 : -1.0);
    double x = 0.0, y = 0.0, z = 0.0;
    if (o->kind == &mill_facets_solid) {
        const double a = uniform(seed, 0.0, 1.0),
                     c = below(seed, 2) ? uniform(seed, 0.0, 1.0) : 1.0;
        const vec3 side = vec3_axpy(vec3_scale(o->corner[1], a), 1.0 - a, o->corner[2]);
        return vec3_axpy(vec3_scale(o->corner[below(seed, 2) ? 0 : 1], 1.0 - c), c, side);
    }
    if (o->kind == &mill_box_solid) {
        x = s * (0.5 * b->size.x - grown);
        y = u * (0.5 * b->size.y - grown);
        z = w * (0.5 * b->size.z - grown);
    } else if (o->kind != &mill_round_sphere_solid) {
        const double half = 0.5 * b->length, angle = uniform(seed, -PI, PI);
        const double end = o->kind == &mill_round_cone_solid ? b->end_radius : b->radius;
        const double slope = (end - b->radius) / b->length;
        z = s * (o->kind == &mill_round_capsule_solid ? half : half - grown);
        const double middle = 0.5 * (b->radius + end) - grown * sqrt(1.0 + slope * slope);
        const bool turned = o->kind != &mill_round_capsule_solid;
        if (turned && middle + slope * z < 0.0) /* shrunk, it ends in a tip */
            z = -middle / slope;
        const double most = middle + slope * z;
        const double r = o->kind == &mill_round_capsule_solid ? 0.0 : fmax(most, 0.0) * u;
        x = r * cos(angle);
        y = r * sin(angle);
    }
    const vec3 core = vec3_axpy(vec3_axpy(vec3_axpy(b->centre, x, b->x), y, b->y), z, b->z);
    return vec3_axpy(core, grown * uniform(seed, 0.9, 1.0), direction(seed));
}

#endif
