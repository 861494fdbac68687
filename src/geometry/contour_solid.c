/* The contour as a solid: a closed curve of lines and circular arcs, extruded along its own z.
 * contour.c has the pieces that balls meet, contour_meet.c the contacts. */
#include "geometry/contour.h"
#include "geometry/mesh.h"
#include "millsim/lining.h"

#define MOST_FLAT 0.1 /* bulge of an arc that a chord stands for: 23 degrees */

/* Has each side a length that a body can have; is it counter-clockwise, without crossing itself? */
static bool is_sound(const struct mill_body *is)
{
    size_t at[2];
    const size_t n = is->corners;
    if (n < 2 || n > MILL_LINING_CORNERS || !is->corner || !mill_solid_is_length(is->length, false))
        return false;
    for (size_t k = 0; k < n; k++) {
        const struct mill_corner *a = &is->corner[k], *b = &is->corner[(k + 1) % n];
        const double dx = b->x - a->x, dy = b->y - a->y;
        if (!mill_solid_is_length(sqrt(dx * dx + dy * dy), false) ||
            !(fabs(a->bulge) < MILL_LINING_BULGE))
            return false;
    }
    return mill_lining_area(is->corner, n) > 0.0 && !mill_lining_crosses(is->corner, n, at);
}

static const struct mill_key key[] = {{MILL_SOLID_LENGTH}, {.name = NULL}};

/* Its buckles and lifters are left out: nothing that moves relative to it may enter them. */
static int walls(const struct mill_body *is, struct mill_wall wall[MILL_WALLS])
{
    double high;
    const int walls = mill_round_cylinder_solid.walls(is, wall);
    mill_contour_reach(is, &wall[0].radius, &high);
    wall[0].own = &mill_contour_surface;
    return is->open ? 1 : walls;
}

static struct mill_hull hull(const struct mill_body *is)
{
    double low, high;
    mill_contour_reach(is, &low, &high);
    return (struct mill_hull){0.5 * is->length, high, 0};
}

static double volume(const struct mill_body *is)
{
    return mill_lining_area(is->corner, is->corners) * is->length;
}

/* Adds a side without its end, as chords within the tolerance [m] */
static void flatten(struct mill_ring *ring, struct mill_corner a, struct mill_corner b,
                    double tolerance)
{
    const double dx = b.x - a.x, dy = b.y - a.y, c = sqrt(dx * dx + dy * dy);
    if (fabs(a.bulge) <= MOST_FLAT && 0.5 * fabs(a.bulge) * c <= tolerance) {
        mill_mesh_ring_add(ring, a.x, a.y);
        return;
    }
    const struct mill_corner middle = mill_lining_halve(&a, &b);
    flatten(ring, a, middle, tolerance);
    flatten(ring, middle, b, tolerance);
}

/* Two arcs within the tolerance would leave two points. Their contour has an area, so that a
 * narrower tolerance divides one of them. */
static void outline(const struct mill_body *is, int wall, double tolerance, struct mill_mesh *mesh)
{
    struct mill_ring ring = {0};
    for (; ring.points < 3 && !ring.failed; tolerance *= 0.5) {
        ring.points = 0;
        for (size_t k = 0; k < is->corners; k++)
            flatten(&ring, is->corner[k], is->corner[(k + 1) % is->corners], tolerance);
    }
    mill_mesh_prism(mesh, is, wall, &ring);
    mill_mesh_ring_free(&ring);
}

const struct mill_solid mill_contour_solid = {
    &mill_contour_surface, is_sound,     volume,     outline,
    .walls = walls,        .hull = hull, .key = key, .moving = &mill_contour_solid};
