/* Sums over impacts, for each facet.
 *
 * Archard's law of sliding wear (J. Appl. Phys. 24 (1953) 981): the volume K F s / H is removed on
 * a path s under the force F, from a surface of hardness H. With Coulomb's friction mu, the work W
 * = mu F s is dissipated, so the volume is K W / (mu H). Impacts that stick slide only on a part of
 * the path, so only the work of those that slide to the end counts. Finnie's law of erosion (Wear 3
 * (1960) 87): an impact at the angle a from the surface removes the mass k m g^2 f(a), with f = sin
 * 2a - 3 sin^2 a for tan a < 1/3, else cos^2 a / 3. Here g is the speed relative to the surface,
 * with the ball's spin. With normal and tangential speed this is k m (2 v_n v_t - 3 v_n^2) or k m
 * v_t^2 / 3. */
#include "observe/wear.h"

#include "observe/kinds.h"
#include "observe/outline.h"
#include "observe/sink.h"

#include <string.h>

#define FACET(member) offsetof(struct mill_wear_sum, member), 0, 0

static const struct mill_sum each[] = {
    {"count", "1", "impacts", MILL_H5_U64, FACET(count)},
    {"normal", "J", "lost along the normal", MILL_H5_F64, FACET(normal)},
    {"sliding", "J", "lost in the surface", MILL_H5_F64, FACET(sliding)},
    {"slid", "J", "part of it of impacts that did not stick", MILL_H5_F64, FACET(slid)},
    {"carved", "J", "m g^2 f(angle) of Finnie's law", MILL_H5_F64, FACET(carved)}};

const struct mill_sums_list mill_wear_sums = {"wear", sizeof(struct mill_wear_sum), 5, each};
const struct mill_sums_list mill_wear_along_sums = {"along", sizeof(struct mill_wear_sum), 5, each};

struct mill_wear_sum *mill_wear_facet(const struct mill_wear_plan *plan, struct mill_wear_sum *sum,
                                      const struct mill_impact *impact)
{
    const int32_t facet = impact->surface < 0
                              ? -1
                              : mill_wear_facets_find(plan, plan->part_of[impact->surface],
                                                      impact->place, impact->facing);
    if (facet < 0)
        return NULL;
    __builtin_prefetch(sum + facet, 1);
    return sum + facet;
}

void mill_wear_impact(const struct mill_wear_plan *plan, struct mill_wear_sum *sum,
                      const struct mill_impact *impact)
{
    const double n = impact->normal_speed, t = impact->tangential_speed;
    const double normal = impact->dissipation_normal, sliding = impact->dissipation - normal;
    const double slid = impact->slid ? sliding : 0;
    sum->count += !impact->lasting;
    sum->normal += normal;
    sum->sliding += sliding;
    sum->slid += slid;
    sum->carved += plan->world->species[impact->species].mass *
                   (3 * n < t ? 2 * n * t - 3 * n * n : t * t / 3);
}

/* ---- telling ---- */

/* What the file tells of a part */
struct part_row {
    int32_t kind, number, motion, round;
};

#define PART(member) MILL_H5_I32, offsetof(struct part_row, member), 0, 0
static const struct mill_sum part_of[] = {
    {"kind", "1", "kind of contact with the part: index into the attribute kinds", PART(kind)},
    {"number", "1", "number of the blade, end wall or copy of a body; -1: the only one",
     PART(number)},
    {"motion", "1", "motion that carries the part: index into the attribute motions; -1: none",
     PART(motion)},
    {"round", "1", "1: the part can turn about x of its axes without a change", PART(round)}};
static const struct mill_sums_list part_list = {"parts", sizeof(struct part_row), 4, part_of};

#define PLACE(type, member) type, offsetof(struct mill_wear_facet, member)
static const struct mill_sum place_of[] = {
    {"part", "1", "part of the facet: row of `parts`", PLACE(MILL_H5_I32, part), 0, 0},
    {"face", "1",
     "direction in which the facet faces: 0 to 5: -x, +x, -y, +y, -z, +z of the part's own axes; "
     "of "
     "a round part: along its axis, away from it (3), around it",
     PLACE(MILL_H5_I32, face), 0, 0},
    {"centre", "m", "middle of the facet, in the frame of the part's motion",
     PLACE(MILL_H5_F64, centre), 3, sizeof(double)},
    {"area", "m2", "area of the facet", PLACE(MILL_H5_F64, area), 0, 0}};
static const struct mill_sums_list places = {"facets", sizeof(struct mill_wear_facet), 4, place_of};

/* The results of a facet */
struct worn {
    double rate, normal, sliding, slid, carved, depth, erosion;
    int32_t count;
};

#define WORN(member) MILL_H5_F64, offsetof(struct worn, member), 0, 0
static const struct mill_sum worn_of[] = {
    /* ---- first those of the pictures ---- */
    {"rate", "m-2 s-1", "impacts per area and time", WORN(rate)},
    {"normal_power", "W m-2", "power lost along the normal, per area", WORN(normal)},
    {"sliding_power", "W m-2", "power lost by sliding, per area", WORN(sliding)},
    {"archard_rate", "m s-1",
     "depth removed per time by sliding wear (Archard): K W / (mu H) per area, with the work W of "
     "impacts that slide to the end; NaN without K, H or friction",
     WORN(depth)},
    {"finnie_rate", "kg m-2 s-1",
     "mass removed per area and time by erosion (Finnie): k m g^2 f(angle); NaN without k",
     WORN(erosion)},
    /* ---- then the others ---- */
    {"slid_power", "W m-2",
     "part of sliding_power of the impacts that slide to the end: the work W of Archard's law, per "
     "area and time",
     WORN(slid)},
    {"carved_power", "W m-2", "m g^2 f(angle) of Finnie's law, per area and time", WORN(carved)},
    {"count", "1", "impacts on the facet", MILL_H5_I32, offsetof(struct worn, count), 0, 0}};
static const struct mill_sums_list worn_list = {"worn", sizeof(struct worn), 8, worn_of};

const char *mill_wear_shown(int k)
{
    return worn_of[k].name;
}

static struct worn results_of(const struct mill_wear_plan *plan, int32_t i,
                              const struct mill_wear_sum *sum, double duration,
                              const struct mill_wear_law *laws)
{
    const struct mill_wear_facet *facet = &plan->facet[i];
    const int kind = plan->world->shape[plan->part[facet->part].shape]->kind;
    const struct mill_wear_law *law = &laws[kind];
    const double per = 1 / (facet->area * duration), mu = plan->world->law[kind].friction;
    /* 0 / 0: a coefficient that is not given */
    const double archard =
        law->archard * law->hardness * mu > 0 ? law->archard / (mu * law->hardness) : (double)NAN;
    return (struct worn){
        .rate = (double)sum->count * per,
        .normal = sum->normal * per,
        .sliding = sum->sliding * per,
        .slid = sum->slid * per,
        .carved = sum->carved * per,
        .depth = archard * sum->slid * per,
        .erosion = law->erosion > 0 ? law->erosion * sum->carved * per : (double)NAN,
        .count = (int32_t)fmin((double)sum->count, INT32_MAX),
    };
}

/* Number of the motion that carries the part; -1: none */
static int motion_of(const struct mill_wear_plan *plan, int part)
{
    const struct mill_motion *motion = plan->world->shape[plan->part[part].shape]->motion;
    return motion ? motion->number : -1;
}

static void tell_parts(const struct mill_wear_plan *plan, struct mill_sink *sink)
{
    const struct mill_world *w = plan->world;
    const struct mill_listed kinds = mill_kinds_listed(w);
    const size_t parts = (size_t)plan->parts, dims[3] = {parts, 3, 4};
    struct part_row *row = mill_sink_room(sink, parts, sizeof *row);
    double(*pose)[12] = mill_sink_room(sink, 2 * parts, sizeof *pose);
    const struct mill_sums sums = {&part_list, parts, row};
    const struct mill_sums_view all = {.rank = 1, .dims = {parts}};
    const char *motion[MILL_MOTIONS_MOST];
    for (int k = 0; k < w->motions; k++)
        motion[k] = w->motion_name[k];
    for (size_t i = 0; row && pose && i < parts; i++) {
        const struct mill_shape *is = w->shape[plan->part[i].shape];
        const int of = motion_of(plan, (int)i);
        row[i] = (struct part_row){kinds.number[is->kind], is->number, of, plan->part[i].round};
        mill_outline_rows(&plan->start[of + 1], pose[i]);
        mill_outline_rows(&plan->part[i].chart, pose[parts + i]);
    }
    sink->open(sink, "parts");
    for (int k = 0; row && pose && k < part_list.count; k++) {
        mill_sums_tell(&sums, k, &all, sink);
        if (k == 0)
            sink->attribute(sink, "kinds", MILL_H5_TEXT, (size_t)kinds.count, kinds.name);
        if (k == 2 && w->motions > 0)
            sink->attribute(sink, "motions", MILL_H5_TEXT, (size_t)w->motions, motion);
    }
    if (row && pose) {
        sink->values(sink, "start", MILL_H5_F64, 3, dims, pose, "1",
                     "pose of the part's motion at t = 0: a point p of its frame is at "
                     "start[:, :3] p + start[:, 3] m");
        sink->values(sink, "axes", MILL_H5_F64, 3, dims, pose + parts, "1",
                     "the part's own axes, as a pose in the frame of its motion");
    }
    sink->close(sink);
    free(row);
    free(pose);
}

/* The cells of the lattices that have a facet, for pictures */
static void tell_cells(const struct mill_wear_plan *plan, struct mill_sink *sink)
{
    size_t all = 0, n = 0;
    for (int i = 0; i < plan->parts; i++)
        for (size_t k = 0; k < mill_wear_facets_cells(&plan->part[i]); k++)
            all += plan->part[i].cell[k] >= 0;
    int32_t(*row)[6] = mill_sink_room(sink, all, sizeof *row);
    double(*lattice)[7] = mill_sink_room(sink, (size_t)plan->parts, sizeof *lattice);
    for (int i = 0; row && lattice && i < plan->parts; i++) {
        const struct mill_wear_part *p = &plan->part[i];
        for (int k = 0; k < 3; k++) {
            lattice[i][k] = p->from[k];
            lattice[i][3 + k] = p->size[k];
        }
        lattice[i][6] = p->radius;
        for (size_t k = 0; k < mill_wear_facets_cells(p); k++) {
            const size_t at = k / MILL_WEAR_FACES, depth = (size_t)p->n[2], rings = (size_t)p->n[1];
            const int32_t ring = (int32_t)(at / depth % rings);
            if (p->cell[k] < 0)
                continue;
            row[n][0] = p->cell[k];
            row[n][1] = (int32_t)(at / depth / rings);
            row[n][2] = ring;
            row[n][3] = (int32_t)(at % depth);
            row[n][4] = p->joined ? p->joined[ring] : 1;
            row[n++][5] = (int32_t)(k % MILL_WEAR_FACES);
        }
    }
    const size_t cells[2] = {n, 6}, lattices[2] = {(size_t)plan->parts, 7};
    if (row && lattice) {
        sink->values(sink, "cells", MILL_H5_I32, 2, cells, row, "1",
                     "cells of the facets: facet, cell along each of the three coordinates, cells "
                     "that are one along the third, face");
        sink->values(sink, "lattices", MILL_H5_F64, 2, lattices, lattice, "m",
                     "of each part: beginning and size of the cells along the three coordinates, "
                     "and the radius by which angles are multiplied");
    }
    free(row);
    free(lattice);
}

/* ---- pictures ----
 *
 * The triangles of pictures of the facets, which are as large as the facets on average. A facet in
 * which no such triangle has its middle is shown by the pieces that it was made of. */
#define SHOWN 1.5 /* times the size of a cell: longest edges of the triangles */
struct outline {
    const struct mill_wear_plan *plan;
    int part;
    struct mill_mesh mesh;
    int32_t *facet;      /* of each triangle of the mesh */
    bool *sought, *seen; /* [facets] */
    bool found;
};

static int32_t facet_of(const struct outline *to, const vec3 corner[3])
{
    return mill_wear_facets_find(to->plan, to->part, mill_wear_pieces_middle(corner),
                                 mill_wear_pieces_area(corner));
}

static void show(void *adds, const vec3 corner[3])
{
    mill_mesh_triangle(&((struct outline *)adds)->mesh, corner[0], corner[1], corner[2]);
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
    mill_wear_pieces_of_triangle(corner, piece, ask, to);
    mill_wear_pieces_of_triangle(corner, to->found ? piece : HUGE_VAL, show, to);
}

/* Finds the facets of the triangles from `first` on; seeks the part's others: were there more? */
static bool seek_missing(struct outline *to, size_t first)
{
    const struct mill_wear_part *p = &to->plan->part[to->part];
    bool more = false;
    int32_t *facet = realloc(to->facet, (to->mesh.triangles + 1) * sizeof *facet);
    if (facet)
        to->facet = facet;
    else
        to->mesh.failed = true;
    if (to->mesh.failed)
        return false;
    memset(to->seen + p->first, 0, (size_t)p->count * sizeof *to->seen);
    for (size_t i = first; i < to->mesh.triangles; i++) {
        const vec3 *corner = to->mesh.point + to->mesh.corner[i][0];
        facet[i] = facet_of(to, corner);
        if (facet[i] >= 0)
            to->seen[facet[i]] = true;
    }
    for (int32_t id = p->first; id < p->first + p->count; id++)
        if (!to->seen[id]) {
            more = more || !to->sought[id];
            to->sought[id] = true;
        }
    return more;
}

/* Adds the surfaces of a part. Pieces can replace the only triangle of a facet, which is then
 * sought. */
static void show_part(struct outline *to)
{
    const size_t points = to->mesh.points, triangles = to->mesh.triangles;
    const struct mill_wear_part *p = &to->plan->part[to->part];
    const double size = fmax(SHOWN * p->cut, 1e-9);
    mill_wear_pieces_on *on = show;
    struct mill_mesh whole;
    mill_wear_facets_draw(to->plan, to->part, &whole);
    memset(to->sought + p->first, 0, (size_t)p->count * sizeof *to->sought);
    do {
        to->mesh.points = points;
        to->mesh.triangles = triangles;
        mill_wear_pieces_of(&whole, size, on, to);
        on = show_pieces;
    } while (seek_missing(to, triangles));
    to->mesh.failed = to->mesh.failed || whole.failed;
    mill_mesh_free(&whole);
}

bool mill_wear_outline(const struct mill_wear_plan *plan, struct mill_mesh *mesh, int32_t **facet)
{
    const size_t room = (size_t)plan->facets + 1;
    struct outline to = {.plan = plan,
                         .sought = malloc(room * sizeof *to.sought),
                         .seen = malloc(room * sizeof *to.seen)};
    to.mesh.failed = !to.sought || !to.seen;
    for (int k = -1; k < plan->world->motions; k++)
        for (to.part = 0; !to.mesh.failed && to.part < plan->parts; to.part++) {
            const size_t before = to.mesh.points;
            if (motion_of(plan, to.part) == k)
                show_part(&to);
            for (size_t i = before; i < to.mesh.points; i++)
                to.mesh.point[i] = mill_pose_out(&plan->start[k + 1], to.mesh.point[i]);
        }
    free(to.sought);
    free(to.seen);
    *mesh = to.mesh;
    *facet = to.facet;
    return !mesh->failed;
}

static void tell_mesh(const struct mill_wear_plan *plan, const struct worn *worn,
                      struct mill_sink *sink)
{
    struct mill_mesh mesh;
    int32_t *facet;
    const bool drawn = mill_wear_outline(plan, &mesh, &facet);
    const size_t n = mesh.triangles, dims[2] = {3 * n, 3};
    float *value = drawn ? malloc((9 * n + 1) * sizeof *value) : NULL, *to = value;
    for (size_t i = 0; value && i < 3 * n; i++) {
        const vec3 r = mesh.point[i]; /* each triangle has its own points */
        *to++ = (float)r.x;
        *to++ = (float)r.y;
        *to++ = (float)r.z;
    }
    if (value) {
        sink->open(sink, "mesh");
        mill_tell_count(sink, "triangles", n, "number of triangles");
        sink->values(sink, "points", MILL_H5_F32, 2, dims, value, "m",
                     "corners of the triangles, three each, counter-clockwise as seen from the "
                     "balls, in the laboratory at t = 0");
        sink->values(sink, "facet", MILL_H5_I32, 1, &n, facet, "1", "facet of each triangle");
        for (int c = 0; c < MILL_WEAR_SHOWN; c++) {
            const struct mill_sum *sum = &worn_of[c];
            for (size_t i = 0; i < n; i++)
                value[i] =
                    (float)*(const double *)(const void *)((const char *)&worn[facet[i]] + sum->at);
            sink->values(sink, sum->name, MILL_H5_F32, 1, &n, value, sum->unit, sum->meaning);
        }
        sink->close(sink);
    } else {
        mill_sink_fail(sink, "out of memory for the pictures of wear");
    }
    free(value);
    free(facet);
    mill_mesh_free(&mesh);
}

void mill_wear_tell(const struct mill_wear_plan *plan, struct mill_wear_sum *sum,
                    struct mill_wear_sum *along, double duration, const struct mill_wear_law *law,
                    struct mill_sink *sink)
{
    const size_t n = (size_t)plan->facets;
    struct worn *worn = mill_sink_room(sink, n, sizeof *worn);
    if (!worn)
        return;
    for (size_t i = 0; i < n; i++)
        worn[i] = results_of(plan, (int32_t)i, &sum[i], duration, law);
    sink->open(sink, "wear");
    tell_parts(plan, sink);
    mill_sums_tell_all(&(struct mill_sums){&places, n, plan->facet}, sink);
    mill_sums_tell_all(&(struct mill_sums){&worn_list, n, worn}, sink);
    tell_cells(plan, sink);
    tell_mesh(plan, worn, sink);
    if (plan->contour) {
        sink->open(sink, "along");
        mill_sums_tell_all(&(struct mill_sums){&mill_wear_along_sums, MILL_WEAR_BINS, along}, sink);
        sink->close(sink);
    }
    sink->close(sink);
    free(worn);
}
