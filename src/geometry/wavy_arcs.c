/* The arcs of a wavy drum near a place, and the contact with one arc */
#include "geometry/wavy.h"

/* Is the place in the half turn after the arc's direction? */
static bool is_after(const struct mill_wavy_arc *a, double y, double z)
{
    return z * a->uy - y * a->uz >= 0.0;
}

/* Sectors are equal parts of the square |y| + |z| = 1, counted from -y. No sector is wider than
 * half a pitch. */
static int sector(const struct mill_wavy *w, double y, double z)
{
    const double sum = fabs(y) + fabs(z);
    if (!(sum > 0.0))
        return 0;
    const double along = z < 0.0 ? 1.0 + y / sum : 3.0 - y / sum; /* 0 .. 4 */
    const int k = (int)(0.25 * along * w->sectors);
    return k < w->sectors ? k : w->sectors - 1;
}

struct mill_wavy_near mill_wavy_arcs_nearest(const struct mill_wavy *w, double y, double z)
{
    int k = w->outer_at[sector(w, y, z)];
    if (is_after(&w->arc[k + 1], y, z))
        k = mill_wavy_wrap(w, k + 2);
    const struct mill_wavy_arc *outer = &w->arc[k];
    const bool after = is_after(outer, y, z);
    const int next = k + 1, last = k > 0 ? k - 1 : w->arcs - 1;
    const bool in = mill_wavy_beyond(outer, after, y, z) > 0.0;
    return (struct mill_wavy_near){in ? k : after ? next : last, k, after ? last : next};
}

struct mill_contact mill_wavy_arcs_contact(const struct mill_wavy *w, int arc, vec3 centre,
                                           double radius)
{
    const struct mill_wavy_arc *a = &w->arc[arc];
    const double s = mill_wavy_inward(arc), d = mill_wavy_distance(a, centre.y, centre.z);
    /* at the centre of an outer arc any direction will do: take the direction from the axis */
    const double uy = d > 0.0 ? (centre.y - a->y) / d : a->uy;
    const double uz = d > 0.0 ? (centre.z - a->z) / d : a->uz;
    return (struct mill_contact){.normal = {0.0, -s * uy, -s * uz},
                                 .point = {centre.x, a->y + w->radius * uy, a->z + w->radius * uz},
                                 .gap = s * (w->radius - s * radius - d)};
}
