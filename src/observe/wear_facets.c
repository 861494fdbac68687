/* The facets are made from the outline of the mill. Each triangle is cut into pieces smaller than a
 * cell, which add their areas to the facet of their middle; slivers, where the surface just enters
 * a cell, become parts of a neighbour. So impacts are assigned by the same rule. */
#include "observe/wear.h"

#include "base/elementary.h"
#include "geometry/contour.h"
#include "observe/outline.h"

enum {
    USUAL = 2000,   /* facets of a mill, about */
    FEWEST = 300,   /* facets of a part, about, */
    MOST = 40000,   /* unless there are so many parts that all would have more than this */
    LONGEST = 1000, /* cells of a part along one coordinate */
    WIRE = 100,     /* cells of a part along its length, if it is a wire */
    FACES = MILL_WEAR_FACES
};
#define MOST_CELLS 2e6 /* of a part, for each face */
#define FLAT 1e-3      /* relative to the drum's radius: distance of the outline from the surface */
#define SLIVER 0.2     /* of the area of a cell's face */

/* ---- where is a point? ---- */

/* An angle [rad] that grows with that of the direction (y, z), and differs from it by less than
 * 0.01. A lattice needs no more, and this is much faster. */
static inline double about(double y, double z)
{
    const double sum = fabs(y) + fabs(z), t = sum > 0 ? fabs(z) / sum : 0;
    const double quarters = t + 0.363 * t * (1 - t) * (2 * t - 1);
    return 0.5 * MILL_PI * copysign(y < 0 ? 2 - quarters : quarters, z);
}

/* Coordinates in the chart. Returns where the surface faces: the largest component of its normal */
static inline int chart(const struct mill_wear_part *p, vec3 place, vec3 facing, double u[3])
{
    const vec3 q = mill_pose_in(&p->chart, place);
    vec3 n = mill_pose_turn_in(&p->chart, facing);
    u[0] = q.x;
    u[1] = q.y;
    u[2] = q.z;
    if (p->round) {
        const double r = sqrt(q.y * q.y + q.z * q.z), per = r > 0 ? 1 / r : 0;
        u[1] = r;
        u[2] = p->radius * about(q.y, q.z);
        n = vec3_make(n.x, per * (n.y * q.y + n.z * q.z), per * (n.z * q.y - n.y * q.z));
    }
    const double x = fabs(n.x), y = fabs(n.y), z = fabs(n.z);
    if (x >= y && x >= z)
        return n.x > 0;
    return y >= z ? 2 + (n.y > 0) : 4 + (n.z > 0);
}

/* The cell of a place; returns the place's face */
static inline int cell_of(const struct mill_wear_part *p, vec3 place, vec3 facing, int at[3])
{
    double u[3];
    const int face = chart(p, place, facing, u);
    for (int k = 0; k < 3; k++) {
        const int i = (int)((u[k] - p->from[k]) * p->per[k]);
        at[k] = i < 0 ? 0 : i >= p->n[k] ? p->n[k] - 1 : i;
    }
    if (p->joined)
        at[2] &= -p->joined[at[1]]; /* a power of two */
    return face;
}

static inline size_t index_of(const struct mill_wear_part *p, const int at[3], int face)
{
    const size_t row = (size_t)at[0] * (size_t)p->n[1] + (size_t)at[1];
    return (row * (size_t)p->n[2] + (size_t)at[2]) * FACES + (size_t)face;
}

/* The facet nearest to a cell that has none in this direction: another direction of the same cell,
 * or a cell as near as possible. Of several, the one with the largest area. */
static int32_t nearest(const struct mill_wear_plan *plan, const struct mill_wear_part *p,
                       const int at[3], int face)
{
    int32_t best = -1;
    for (int far = 0; best < 0 && far <= LONGEST; far++) {
        int lo[3], hi[3], c[3];
        for (int k = 0; k < 3; k++) {
            lo[k] = at[k] - far < 0 ? 0 : at[k] - far;
            hi[k] = at[k] + far >= p->n[k] ? p->n[k] - 1 : at[k] + far;
        }
        for (int same = 1; best < 0 && same >= 0; same--)
            for (c[0] = lo[0]; c[0] <= hi[0]; c[0]++)
                for (c[1] = lo[1]; c[1] <= hi[1]; c[1]++)
                    for (c[2] = lo[2]; c[2] <= hi[2]; c[2]++)
                        for (int f = same ? face : 0; f < (same ? face + 1 : FACES); f++) {
                            const int32_t id = p->cell[index_of(p, c, f)];
                            if (id >= 0 &&
                                (best < 0 || plan->facet[id].area > plan->facet[best].area))
                                best = id;
                        }
    }
    return best;
}

int32_t mill_wear_facets_find(const struct mill_wear_plan *plan, int part, vec3 place, vec3 faces)
{
    const struct mill_wear_part *p = &plan->part[part];
    int at[3];
    if (!p->cell) /* nothing of it can be reached */
        return -1;
    const int face = cell_of(p, place, faces, at);
    const int32_t id = p->cell[index_of(p, at, face)];
    return id >= 0 ? id : nearest(plan, p, at, face);
}

size_t mill_wear_facets_cells(const struct mill_wear_part *p)
{
    return p->cell ? (size_t)p->n[0] * (size_t)p->n[1] * (size_t)p->n[2] * FACES : 0;
}

/* ---- making the facets ---- */

/* What the pieces of a part are added to */
struct collector {
    struct mill_wear_plan *plan;
    int part;
    double area, lo[3], hi[3];
    bool failed; /* out of memory */
};

/* Adds up the area of the part and the reach of its coordinates. */
static void measure(void *adds, const vec3 corner[3])
{
    struct collector *to = adds;
    to->area += vec3_norm(mill_wear_pieces_area(corner));
    for (int i = 0; i < 3; i++) {
        double u[3];
        chart(&to->plan->part[to->part], corner[i], corner[i], u);
        for (int k = 0; k < 3; k++)
            to->lo[k] = fmin(to->lo[k], u[k]), to->hi[k] = fmax(to->hi[k], u[k]);
    }
}

/* Adds a piece to its facet; a cell without a facet gets a new one. */
static void collect(void *adds, const vec3 corner[3])
{
    struct collector *to = adds;
    struct mill_wear_plan *plan = to->plan;
    struct mill_wear_part *p = &plan->part[to->part];
    const vec3 normal = mill_wear_pieces_area(corner), at = mill_wear_pieces_middle(corner);
    const double area = vec3_norm(normal);
    int place[3];
    const int face = cell_of(p, at, normal, place);
    int32_t *id = &p->cell[index_of(p, place, face)];
    if (*id < 0 && (plan->facets & (plan->facets - 1)) == 0) { /* the room doubles */
        const size_t room = plan->facets > 0 ? 2 * (size_t)plan->facets : 1;
        struct mill_wear_facet *more = realloc(plan->facet, room * sizeof *more);
        if (!more) {
            to->failed = true;
            return;
        }
        plan->facet = more;
    }
    if (*id < 0) {
        *id = plan->facets++;
        plan->facet[*id] = (struct mill_wear_facet){.part = to->part, .face = face};
    }
    struct mill_wear_facet *f = &plan->facet[*id];
    f->area += area;
    f->centre = vec3_axpy(f->centre, area, at); /* divided by the area at the end */
}

void mill_wear_facets_draw(const struct mill_wear_plan *plan, int part, struct mill_mesh *mesh)
{
    const struct mill_world *w = plan->world;
    *mesh = (struct mill_mesh){0};
    mill_outline_draw(w->shape[plan->part[part].shape], FLAT * w->container.radius, mesh);
}

/* Sets the lattice of a part that `reach` has measured, for cells of this size. false: failed */
static bool lay_out(struct mill_wear_part *p, const struct collector *reach, double size)
{
    size_t cells = FACES;
    double volume = 1;
    for (int k = 0; k < 3; k++)
        volume *= fmax(reach->hi[k] - reach->lo[k], size) / size;
    size *= fmax(1, mill_elementary_cbrt(volume / MOST_CELLS));
    for (int k = 0; k < 3; k++) {
        const double length = reach->hi[k] - reach->lo[k];
        const double least = p->round && k == 1 ? 2 * FLAT * p->radius : 1e-9 * p->radius;
        p->n[k] = length > least ? (int)fmin(fmax(round(length / size), 1), LONGEST) : 1;
        p->from[k] = reach->lo[k];
        p->size[k] = length / p->n[k];
        p->per[k] = length > 0 ? p->n[k] / length : 0;
        cells *= (size_t)p->n[k];
    }
    p->joined = p->round ? malloc((size_t)p->n[1] * sizeof *p->joined) : NULL;
    for (int ring = 0; p->joined && ring < p->n[1]; ring++) {
        const double r = p->from[1] + (ring + 0.5) * p->size[1];
        for (p->joined[ring] = 1;
             2 * p->joined[ring] * r <= p->radius && p->joined[ring] < p->n[2];)
            p->joined[ring] *= 2;
    }
    p->cell = p->round && !p->joined ? NULL : malloc(cells * sizeof *p->cell);
    for (size_t i = 0; p->cell && i < cells; i++)
        p->cell[i] = -1;
    return p->cell;
}

/* Makes slivers parts of a neighbour of the same direction in a cell beside theirs. */
static void join_slivers(struct mill_wear_plan *plan, struct mill_wear_part *p, int32_t first,
                         double least, int32_t *into)
{
    int c[3], near[3];
    for (c[0] = 0; c[0] < p->n[0]; c[0]++)
        for (c[1] = 0; c[1] < p->n[1]; c[1]++)
            for (c[2] = 0; c[2] < p->n[2]; c[2]++)
                for (int f = 0; f < FACES; f++) {
                    const int32_t id = p->cell[index_of(p, c, f)];
                    if (id < first || plan->facet[id].area >= least)
                        continue;
                    for (int k = 0; k < 27 * FACES; k++) {
                        for (int axis = 0, rest = k / FACES; axis < 3; axis++, rest /= 3)
                            near[axis] = c[axis] + rest % 3 - 1;
                        if (near[0] < 0 || near[1] < 0 || near[2] < 0 || near[0] >= p->n[0] ||
                            near[1] >= p->n[1] || near[2] >= p->n[2])
                            continue;
                        const int32_t other = p->cell[index_of(p, near, k % FACES)];
                        const bool same = k % FACES == f;
                        if (other < 0 || other == id || plan->facet[other].area < least)
                            continue;
                        const bool had = into[id] != id;
                        const bool was = had && plan->facet[into[id]].face == f;
                        if (!had || (same && !was) ||
                            (same == was && plan->facet[other].area > plan->facet[into[id]].area))
                            into[id] = other;
                    }
                }
}

/* Removes the facets that were joined to others, and divides centres by areas. */
static void tidy(struct mill_wear_plan *plan, struct mill_wear_part *p, int32_t first, int32_t *to)
{
    int32_t kept = first;
    for (int32_t id = first; id < plan->facets; id++) {
        struct mill_wear_facet *f = &plan->facet[to[id]];
        if (to[id] == id)
            continue;
        f->area += plan->facet[id].area;
        f->centre = vec3_add(f->centre, plan->facet[id].centre);
    }
    for (int32_t id = first; id < plan->facets; id++)
        if (to[id] == id) {
            plan->facet[kept] = plan->facet[id];
            plan->facet[kept].centre = vec3_scale(plan->facet[id].centre, 1 / plan->facet[id].area);
            to[id] = -1 - kept++; /* its new number, marked */
        }
    for (size_t i = 0; i < mill_wear_facets_cells(p); i++) {
        int32_t id = p->cell[i];
        if (id >= 0)
            p->cell[i] = -1 - (to[id] >= 0 ? to[to[id]] : to[id]);
    }
    plan->facets = kept;
}

/* Makes the facets of a part. false: out of memory. */
static bool make_part(struct mill_wear_plan *plan, int part, double size, int fewest)
{
    struct mill_wear_part *p = &plan->part[part];
    struct collector reach = {.plan = plan, .part = part};
    struct mill_mesh mesh;
    const int32_t first = plan->facets;
    for (int k = 0; k < 3; k++) {
        reach.lo[k] = INFINITY;
        reach.hi[k] = -INFINITY;
    }
    mill_wear_facets_draw(plan, part, &mesh);
    p->radius = 1;
    /* corners alone do not show the reach of a triangle in radius and angle */
    mill_wear_pieces_of(&mesh, 4 * size, measure, &reach);
    if (!(reach.area > 0)) { /* a part that draws nothing has no facets */
        mill_mesh_free(&mesh);
        return !mesh.failed;
    }
    p->radius = p->round ? reach.hi[1] : reach.hi[0] - reach.lo[0] + reach.hi[1] - reach.lo[1];
    if (p->round) { /* all around, or nearly */
        const bool whole = reach.hi[2] - reach.lo[2] > 1.5 * MILL_PI;
        reach.lo[2] = p->radius * (whole ? -MILL_PI : reach.lo[2]);
        reach.hi[2] = p->radius * (whole ? MILL_PI : reach.hi[2]);
    }
    double cell = fewest > 0 ? fmin(size, sqrt(reach.area / fewest)) : size;
    for (int k = 0; k < 3; k++) /* a wire is cut into pieces that grow with (length / cell)^1.6 */
        cell = fmax(cell, (reach.hi[k] - reach.lo[k]) / WIRE);
    p->cut = cell;
    reach.failed = mesh.failed || !lay_out(p, &reach, cell);
    if (!reach.failed)
        mill_wear_pieces_of(&mesh, mill_wear_facets_piece(p), collect, &reach);
    int32_t *into = reach.failed ? NULL : malloc(((size_t)plan->facets + 1) * sizeof *into);
    for (int32_t id = 0; into && id < plan->facets; id++)
        into[id] = id;
    if (into) {
        join_slivers(plan, p, first, SLIVER * cell * cell, into);
        tidy(plan, p, first, into);
    }
    p->first = first;
    p->count = plan->facets - first;
    free(into);
    mill_mesh_free(&mesh);
    return into != NULL;
}

/* Lists the parts with their charts: faces along the axes, or round about x, or nearly. A wall that
 * shows nothing belongs to the part of the wall that shows all of its body. */
static bool list_parts(struct mill_wear_plan *plan)
{
    const struct mill_world *w = plan->world;
    plan->part_of = calloc((size_t)w->shapes + 1, sizeof *plan->part_of);
    plan->part = calloc((size_t)w->shapes + 1, sizeof *plan->part);
    int all = 0; /* part that shows all of the container */
    bool good = plan->part_of && plan->part;
    for (int k = 0; good && k < w->shapes; k++) {
        struct mill_wear_part *p = &plan->part[plan->parts];
        const struct mill_body *is = mill_body_is(w->shape[k]);
        struct mill_mesh mesh;
        p->shape = k;
        p->round = w->shape[k]->solid->round;
        p->chart = (struct mill_pose){.place = is->centre,
                                      .x = p->round ? is->z : is->x,
                                      .y = p->round ? is->x : is->y,
                                      .z = p->round ? is->y : is->z};
        mill_wear_facets_draw(plan, plan->parts, &mesh);
        for (size_t i = 0; i < mesh.triangles; i++) {
            const int64_t *c = mesh.corner[i];
            const vec3 at[3] = {mesh.point[c[0]], mesh.point[c[1]], mesh.point[c[2]]};
            plan->area += vec3_norm(mill_wear_pieces_area(at));
        }
        plan->part_of[k] = mesh.triangles > 0 ? plan->parts++ : all;
        all = w->shape[k]->wall == 0 ? plan->part_of[k] : all;
        good = !mesh.failed;
        mill_mesh_free(&mesh);
    }
    return good;
}

/* ---- along the contour ---- */

/* [m] of an arc of this bend, from its middle to a place so far along its tangent there */
static double developed(double bend, double x)
{
    const double sine = fmax(-1, fmin(2 * bend * x, 1));
    return fabs(sine) > 1e-6 ? mill_elementary_asin(sine) / (2 * bend) : x;
}

static bool develop(struct mill_wear_plan *plan)
{
    for (int k = 0; k < plan->world->shapes; k++)
        if (plan->world->shape[k]->type == &mill_contour_surface &&
            plan->world->shape[k]->wall >= 0)
            plan->contour = (const struct mill_contour *)plan->world->shape[k];
    const int n = plan->contour ? plan->contour->pieces : 0;
    plan->along = calloc((size_t)n + 1, sizeof *plan->along);
    for (int k = 0; plan->along && k < n; k++) {
        const struct mill_contour_piece *p = &plan->contour->piece[k];
        const double x = p->end[1][0] - p->end[0][0], y = p->end[1][1] - p->end[0][1];
        plan->along[k + 1] = plan->along[k] + 2 * developed(p->bend, 0.5 * sqrt(x * x + y * y));
    }
    return plan->along;
}

int mill_wear_facets_bin(const struct mill_wear_plan *plan, const struct mill_impact *impact)
{
    const struct mill_contour *c = plan->contour;
    if (!c || impact->surface < 0 || plan->world->shape[impact->surface] != &c->body.convex.base)
        return -1;
    const vec3 r = vec3_sub(impact->place, c->body.is.centre);
    const double x = vec3_dot(r, c->body.is.x), y = vec3_dot(r, c->body.is.y);
    const int at = mill_contour_nearest(c, x, y);
    const struct mill_contour_piece *p = &c->piece[at];
    const double half = 0.5 * (plan->along[at + 1] - plan->along[at]);
    const double t = developed(p->bend, p->ny * (x - p->x) - p->nx * (y - p->y));
    const double s = plan->along[at] + half + fmax(-half, fmin(t, half));
    return (int)(s / plan->along[c->pieces] * MILL_WEAR_BINS) % MILL_WEAR_BINS;
}

bool mill_wear_facets_make(struct mill_wear_plan *plan, const struct mill_world *world)
{
    *plan = (struct mill_wear_plan){.world = world};
    for (int k = -1; k < world->motions; k++)
        plan->start[k + 1] = mill_motion_pose(k < 0 ? NULL : world->motion[k], 0.0);
    if (!list_parts(plan) || !develop(plan))
        return false;
    const double few = (double)plan->parts * FEWEST, all = few > MOST ? MOST : USUAL;
    const double size = sqrt(plan->area / all);
    bool good = true;
    for (int part = 0; good && part < plan->parts; part++)
        good = make_part(plan, part, size, few > MOST ? 0 : FEWEST);
    return good;
}

void mill_wear_facets_free(struct mill_wear_plan *plan)
{
    for (int part = 0; plan->part && part < plan->parts; part++) {
        free(plan->part[part].joined);
        free(plan->part[part].cell);
    }
    free(plan->part);
    free(plan->part_of);
    free(plan->along);
    free(plan->facet);
}
