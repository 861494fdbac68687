/* Meshes as files have them: their shells and faults, and the union of their solids. */
#ifndef MILL_FACETS_UNITE_H
#define MILL_FACETS_UNITE_H

#include "base/memory.h"
#include "geometry/facets.h"

/* A set is a tree of elements: each has the number of another one, the root its own. */
static inline int32_t mill_facets_root(int32_t *root, int32_t of)
{
    while (root[of] != of)
        of = root[of] = root[root[of]];
    return of;
}

static inline void mill_facets_merge(int32_t *root, int32_t one, int32_t other)
{
    const int32_t a = mill_facets_root(root, one), b = mill_facets_root(root, other);
    root[a < b ? b : a] = a < b ? a : b;
}

/* A walk through all facets that the line from `from` to from + way may meet, in a tree with
 * sheaths, without nodes of the hubs `skip` (-1: none). The other members begin as zeros. */
struct mill_facets_line {
    const struct mill_facets_tree *tree;
    vec3 from, way;
    int32_t skip[2];
    int32_t at, next, last;
};

/* The next facet; -1: the walk is at its end. */
int32_t mill_facets_line_on(struct mill_facets_line *line);

/* ---- faults (facets_check.c) ---- */

/* Unit; of a facet without area NaN */
static inline vec3 mill_facets_normal(const vec3 p[3])
{
    const vec3 n = vec3_cross(vec3_sub(p[1], p[0]), vec3_sub(p[2], p[0]));
    return vec3_scale(n, 1.0 / vec3_norm(n));
}

enum { MILL_FACETS_TOLD = 20 /* faults that are told */ };

/* What is found out about a mesh, and who hears of it */
struct mill_facets_report {
    double unit;                                 /* [m] of the coordinates in the sentences */
    void (*fault)(void *self, const char *text); /* a sentence for each of the first faults */
    /* progress: `done` of `all` facets; NULL: not told */
    void (*tell)(void *self, const char *what, int32_t done, int32_t all);
    void *self;
    long faults;
    double closed; /* [m^3] rooms of the mesh that no ball can reach */
    bool hollow;   /* the container is given as a solid; the balls are in a cavity of it */
};

/* A fault at a place (NaN: of the whole mesh); the format is that of printf. */
__attribute__((format(printf, 3, 4))) void
mill_facets_report_fault(struct mill_facets_report *report, vec3 place, const char *format, ...);

static inline void mill_facets_report_progress(const struct mill_facets_report *r, const char *what,
                                               size_t done, size_t all)
{
    if (r->tell && done % 4096 == 0)
        r->tell(r->self, what, (int32_t)done, (int32_t)all);
}

/* A mesh while it is checked */
struct mill_facets_check {
    struct mill_memory_pool memory;
    const vec3 (*facet)[3];
    size_t n;
    struct mill_facets_report *report;
    struct mill_facets_joints joints;
    struct mill_facets_tree tree;
    double least;         /* [m] shorter distances are due to the rounding to single precision */
    int32_t *shell;       /* [n] of each facet, apart */
    int32_t *solid;       /* [n] the shell of each facet, not apart */
    int32_t *hub;         /* [n] the corner of each facet that most facets have */
    int32_t (*across)[3]; /* [n] the facet across each side; without a pair, itself */
    bool *gone;           /* [n] facets that are not there any more */
    bool *hidden;         /* [n] facets that are not on the surface of the union */
    bool whole;           /* there is no fault in single facets and edges */
};

/* Tell what is wrong: facets without area; edges where the surface is not closed (united: after
 * solids that touch were united); places where the surface crosses itself, or where solids touch
 * and the face of one ends within a face of the other. false: out of memory. */
void mill_facets_check_areas(struct mill_facets_check *check);
bool mill_facets_check_edges(struct mill_facets_check *check, bool united);
bool mill_facets_check_crossings(struct mill_facets_check *check);

/* Checks a mesh of any number of shells, whose facets face out of their solids, and leaves only
 * those that the balls can meet: the surface of the union of the solids. Their order is kept. A
 * container may also be given as a solid: then the balls are in the room within it, and the facets
 * are turned over. Facets count from 1. With faults, *is stays as it was. false: out of memory. */
bool mill_facets_unite(struct mill_body *is, vec3 (*facet)[3], struct mill_facets_report *report);

#endif
