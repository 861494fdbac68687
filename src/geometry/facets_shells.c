/* A mesh may consist of several shells that share no corner: separate solids, and cavities. Each
 * shell is closed. A shell that faces inwards, with a negative volume, must be a cavity inside the
 * others. */
#include "geometry/facets.h"

#include <stdlib.h>

/* of facets, computed for cavities; takes about 10 s */
#define MOST_ANGLES 2e8

struct shells {
    const struct mill_body *is;
    const struct mill_facets_joints *joints;
    int32_t *root;  /* [3 n] for each number of a corner: another corner of its shell, or itself */
    double *volume; /* [3 n] for each root: six times the volume of its shell [m^3] */
};

static int32_t root_of(struct shells *s, int32_t corner)
{
    while (s->root[corner] != corner)
        corner = s->root[corner] = s->root[s->root[corner]];
    return corner;
}

static void sum_up(struct shells *s)
{
    const size_t n = s->is->facets;
    for (size_t k = 0; k < 3 * n; k++)
        s->root[k] = (int32_t)k;
    for (size_t k = 0; k < n; k++)
        for (int i = 1; i < 3; i++)
            s->root[root_of(s, s->joints->corner[k][i])] = root_of(s, s->joints->corner[k][0]);
    for (size_t k = 0; k < n; k++) {
        const vec3 *p = s->is->facet[k];
        s->volume[root_of(s, s->joints->corner[k][0])] += vec3_dot(p[0], vec3_cross(p[1], p[2]));
    }
}

/* Is a place inside the solid of all shells except `but`? Then their facets fill the full solid
 * angle. */
static bool is_within(struct shells *s, vec3 place, int32_t but)
{
    double filled = 0.0; /* [rad] half of the solid angle */
    for (size_t k = 0; k < s->is->facets; k++) {
        if (root_of(s, s->joints->corner[k][0]) == but)
            continue;
        const vec3 *p = s->is->facet[k];
        filled +=
            mill_facets_angle(vec3_sub(p[0], place), vec3_sub(p[1], place), vec3_sub(p[2], place));
    }
    return filled > MILL_PI;
}

bool mill_facets_shells(const struct mill_body *is, const struct mill_facets_joints *joints,
                        int32_t *turned)
{
    struct shells s = {is, joints, malloc(3 * is->facets * sizeof *s.root),
                       calloc(3 * is->facets, sizeof *s.volume)};
    const bool good = s.root && s.volume;
    *turned = -1;
    if (good)
        sum_up(&s);
    double left = MOST_ANGLES;
    for (size_t k = 0; good && k < is->facets && *turned == -1; k++) {
        const int32_t root = root_of(&s, joints->corner[k][0]);
        if (!(s.volume[root] < 0.0))
            continue;
        s.volume[root] = 0.0; /* each shell is checked once */
        left -= (double)is->facets;
        if (left < 0.0)
            *turned = MILL_FACETS_HOLLOW;
        else if (!is_within(&s, is->facet[k][0], root))
            *turned = (int32_t)k;
    }
    free(s.root);
    free(s.volume);
    return good;
}
