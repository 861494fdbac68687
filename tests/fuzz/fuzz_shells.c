/* A mesh of boxes and tetrahedra that the bytes choose: nested, flush, crossing, with cavities. It
 * is refused in words, or what is left of it is the surface of a solid: a place is within it as
 * often as the solid angles of all facets given say, but for the rooms that no ball can reach. */
#include "../unit/lone_shape.h"
#include "fuzz.h"

#include "mesh/facets_unite.h"

enum { SOLIDS = 6, MOST = 12 * SOLIDS, PLACES = 64 };

struct mesh {
    size_t facets;
    vec3 facet[MOST][3];
};

static void add(struct mesh *m, bool turned, vec3 a, vec3 b, vec3 c)
{
    vec3 *p = m->facet[m->facets++];
    p[0] = a;
    p[1] = turned ? c : b;
    p[2] = turned ? b : c;
}

/* Corners on a small grid, so that solids often touch; diagonals either way */
static void add_solid(struct fuzz_bytes *b, struct mesh *m)
{
    static const int face[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4},
                                   {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
    const int what = fuzz_choice(b, 8);
    const bool turned = what == 7, other = what & 1;
    const vec3 lo = {fuzz_choice(b, 6), fuzz_choice(b, 6), fuzz_choice(b, 6)};
    const vec3 hi = {lo.x + 1 + fuzz_choice(b, 5), lo.y + 1 + fuzz_choice(b, 5),
                     lo.z + 1 + fuzz_choice(b, 5)};
    vec3 c[8];
    for (int i = 0; i < 8; i++)
        c[i] = vec3_make(i & 1 ? hi.x : lo.x, i & 2 ? hi.y : lo.y, i & 4 ? hi.z : lo.z);
    if (what == 6) {
        add(m, false, c[0], c[2], c[1]);
        add(m, false, c[0], c[1], c[4]);
        add(m, false, c[0], c[4], c[2]);
        add(m, false, c[1], c[2], c[4]);
        return;
    }
    for (int i = 0; i < 6; i++) {
        const int *q = face[i];
        add(m, turned, c[q[0]], c[q[1]], c[q[other ? 3 : 2]]);
        add(m, turned, c[q[other ? 1 : 0]], c[q[2]], c[q[3]]);
    }
}

/* How many solids are at a place */
static double solids_at(const vec3 (*facet)[3], size_t facets, vec3 p)
{
    double filled = 0.0;
    for (size_t k = 0; k < facets; k++)
        filled += mill_facets_angle(vec3_sub(facet[k][0], p), vec3_sub(facet[k][1], p),
                                    vec3_sub(facet[k][2], p));
    return filled / (2.0 * MILL_PI);
}

static void hear(void *self, const char *text)
{
    fuzz_require_message(text);
    if (fuzz_shown())
        fprintf(stderr, "%s\n", text);
    ++*(long *)self;
}

static void check_places(struct fuzz_bytes *b, const struct mesh *given,
                         const struct mill_body *left, const struct mill_facets_report *found)
{
    const struct mill_reach places = {{-99.0, -99.0, -99.0}, {99.0, 99.0, 99.0}, INFINITY};
    struct mill_shape *shape = lone_shape(&mill_facets_solid, left, NULL, &places);
    fuzz_require(shape != NULL, "out of memory");
    for (int i = 0; i < PLACES; i++) {
        const vec3 p = {fuzz_uniform(b, -0.5, 10.5) + 0.01 * (i % 13) + 0.00137,
                        fuzz_uniform(b, -0.5, 10.5) + 0.31 * (i % 31) + 0.00241,
                        fuzz_uniform(b, -0.5, 10.5) + 0.17 * (i % 61) + 0.00179};
        const double all = solids_at(given->facet, given->facets, p);
        const double one = solids_at(left->facet, left->facets, p);
        const double gap = mill_shape_gap(shape, p, 0.0, &mill_pose_still);
        if (fabs(gap) < 1e-6)
            continue;
        const int solids = (int)lround(all), is = (int)lround(one);
        fuzz_require(is == 0 || is == 1, "%g times within what is left", one);
        fuzz_require((gap < 0.0) == (is != left->inside), "a gap of %g m, %g times within", gap,
                     one);
        if (found->closed == 0.0 && !found->hollow)
            fuzz_require(is == (solids >= 1),
                         "(%g %g %g) is in %d solids, and %d times in the rest", p.x, p.y, p.z,
                         solids, is);
        else if (!left->inside)
            fuzz_require(is || solids < 1, "a solid has got lost");
    }
    lone_shape_free(shape);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct fuzz_bytes b = {data, size};
    struct mesh given = {0}, left;
    long told = 0;
    const bool inside = fuzz_choice(&b, 4) == 3;
    const int solids = 1 + fuzz_choice(&b, SOLIDS);
    for (int k = 0; k < solids; k++)
        add_solid(&b, &given);
    left = given;
    struct mill_body body = {.inside = inside,
                             .x = {1.0, 0.0, 0.0},
                             .y = {0.0, 1.0, 0.0},
                             .z = {0.0, 0.0, 1.0},
                             .facets = given.facets,
                             .facet = (const vec3(*)[3])left.facet};
    struct mill_facets_report found = {.unit = 1.0, .fault = hear, .self = &told};
    fuzz_require(mill_facets_unite(&body, left.facet, &found), "out of memory");
    fuzz_require(told == (found.faults < MILL_FACETS_TOLD ? found.faults : MILL_FACETS_TOLD),
                 "%ld of %ld faults are told", told, found.faults);
    if (fuzz_shown())
        fprintf(stderr, "%zu facets of %d solids, %zu left, %ld faults\n", given.facets, solids,
                body.facets, found.faults);
    if (found.faults == 0)
        check_places(&b, &given, &body, &found);
    return 0;
}
