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

#include "base/memory.h"
#include "observe/sink.h"

#include <stdlib.h>
#include <string.h>

bool mill_wear_like(struct mill_wear *wear, const struct mill_wear *as)
{
    *wear = (struct mill_wear){.plan = as->plan};
    wear->sum = mill_memory_get((size_t)as->plan->facets + 1, sizeof *wear->sum);
    return wear->sum;
}

bool mill_wear_init(struct mill_wear *wear, const struct mill_world *world)
{
    struct mill_wear_plan *plan = calloc(1, sizeof *plan);
    *wear = (struct mill_wear){.plan = plan, .owns = true};
    if (!plan)
        return false;
    plan->world = world;
    for (int k = -1; k < world->motions; k++)
        plan->start[k + 1] = mill_motion_pose(k < 0 ? NULL : world->motion[k], 0.0);
    if (!mill_wear_facets_make(plan))
        return false;
    const struct mill_wear as = *wear;
    const bool good = mill_wear_like(wear, &as);
    wear->owns = true;
    return good;
}

void mill_wear_free(struct mill_wear *wear)
{
    if (wear->owns && wear->plan)
        mill_wear_facets_free(wear->plan);
    if (wear->owns)
        free(wear->plan);
    free(wear->sum);
}

/* ---- sums ---- */

struct mill_wear_sum *mill_wear_facet(const struct mill_wear *wear,
                                      const struct mill_impact *impact)
{
    const struct mill_wear_plan *plan = wear->plan;
    const int32_t facet = impact->surface < 0
                              ? -1
                              : mill_wear_facets_find(plan, plan->part_of[impact->surface],
                                                      impact->place, impact->facing);
    if (facet < 0)
        return NULL;
    struct mill_wear_sum *sum = &wear->sum[facet];
    __builtin_prefetch(sum, 1);
    return sum;
}

void mill_wear_impact(const struct mill_wear *wear, struct mill_wear_sum *sum,
                      const struct mill_impact *impact)
{
    const double n = impact->normal_speed, t = impact->tangential_speed;
    const double normal = impact->dissipation_normal, sliding = impact->dissipation - normal;
    const double slid = impact->slid ? sliding : 0;
    sum->count += !impact->lasting;
    sum->normal += normal;
    sum->sliding += sliding;
    sum->slid += slid;
    sum->carved += wear->plan->world->species[impact->species].mass *
                   (3 * n < t ? 2 * n * t - 3 * n * n : t * t / 3);
    sum->normal_squares += normal * normal;
    sum->sliding_squares += sliding * sliding;
    sum->slid_squares += slid * slid;
}

void mill_wear_add(struct mill_wear *into, const struct mill_wear *from)
{
    for (int32_t i = 0; i < into->plan->facets; i++) {
        struct mill_wear_sum *to = &into->sum[i];
        const struct mill_wear_sum *more = &from->sum[i];
        to->count += more->count;
        to->normal += more->normal;
        to->sliding += more->sliding;
        to->slid += more->slid;
        to->carved += more->carved;
        to->normal_squares += more->normal_squares;
        to->sliding_squares += more->sliding_squares;
        to->slid_squares += more->slid_squares;
    }
}

void mill_wear_clear(struct mill_wear *wear)
{
    memset(wear->sum, 0, (size_t)wear->plan->facets * sizeof *wear->sum);
}

/* ---- telling ---- */

enum column {
    RATE,
    NORMAL,
    NORMAL_ERROR,
    SLIDING,
    SLIDING_ERROR,
    SLID,
    CARVED,
    DEPTH,
    DEPTH_ERROR,
    EROSION,
    AREA,
    COLUMNS
};

const char *const mill_wear_shown[MILL_WEAR_SHOWN] = {"rate", "normal_power", "sliding_power",
                                                      "archard_rate", "finnie_rate"};

static const struct {
    const char *name, *unit, *meaning;
} columns[COLUMNS] = {
    [RATE] = {"rate", "m-2 s-1", "impacts per area and time"},
    [NORMAL] = {"normal_power", "W m-2", "power lost along the normal, per area"},
    [NORMAL_ERROR] = {"normal_power_error", "W m-2",
                      "its standard error, as if single impacts were independent"},
    [SLIDING] = {"sliding_power", "W m-2", "power lost by sliding, per area"},
    [SLIDING_ERROR] = {"sliding_power_error", "W m-2",
                       "its standard error, as if single impacts were independent"},
    [SLID] = {"slid_power", "W m-2",
              "part of sliding_power of the impacts that slide to the end: the work W of Archard's "
              "law, per area and time"},
    [CARVED] = {"carved_power", "W m-2", "m g^2 f(angle) of Finnie's law, per area and time"},
    [DEPTH] = {"archard_rate", "m s-1",
               "depth removed per time by sliding wear (Archard): K W / (mu H) per area, with the "
               "work W of impacts that slide to the end; NaN without K, H or friction"},
    [DEPTH_ERROR] = {"archard_rate_error", "m s-1",
                     "its standard error, as if single impacts were independent"},
    [EROSION] = {"finnie_rate", "kg m-2 s-1",
                 "mass removed per area and time by erosion (Finnie): k m g^2 f(angle); NaN "
                 "without k"},
    [AREA] = {"area", "m2", "area of the facet"},
};

/* The values of facet i, in all columns */
static void set_values(const struct mill_wear *wear, int32_t i, double duration,
                       const struct mill_wear_law *laws, double value[COLUMNS])
{
    const struct mill_wear_plan *plan = wear->plan;
    const struct mill_wear_facet *facet = &plan->facet[i];
    const struct mill_wear_sum *sum = &wear->sum[i];
    const int kind = plan->world->shape[plan->part[facet->part].shape]->kind;
    const struct mill_wear_law *law = &laws[kind];
    const double per = 1 / (facet->area * duration), mu = plan->world->law[kind].friction;
    /* 0 / 0: a coefficient that is not given */
    const double archard =
        law->archard * law->hardness * mu > 0 ? law->archard / (mu * law->hardness) : (double)NAN;
    value[RATE] = (double)sum->count * per;
    value[NORMAL] = sum->normal * per;
    value[NORMAL_ERROR] = sqrt(sum->normal_squares) * per;
    value[SLIDING] = sum->sliding * per;
    value[SLIDING_ERROR] = sqrt(sum->sliding_squares) * per;
    value[SLID] = sum->slid * per;
    value[CARVED] = sum->carved * per;
    value[DEPTH] = archard * sum->slid * per;
    value[DEPTH_ERROR] = archard * sqrt(sum->slid_squares) * per;
    value[EROSION] = law->erosion > 0 ? law->erosion * sum->carved * per : (double)NAN;
    value[AREA] = facet->area;
}

/* A pose as three rows of four: a point p of its frame is at pose[:, :3] p + pose[:, 3] */
static void set_rows(const struct mill_pose *pose, double row[12])
{
    const vec3 *axis[4] = {&pose->x, &pose->y, &pose->z, &pose->place};
    for (int k = 0; k < 4; k++) {
        row[k] = axis[k]->x;
        row[4 + k] = axis[k]->y;
        row[8 + k] = axis[k]->z;
    }
}

static void tell_poses(const struct mill_wear_plan *plan, struct mill_sink *sink)
{
    const size_t dims[3] = {(size_t)plan->parts, 3, 4};
    double(*row)[12] = malloc((dims[0] + 1) * sizeof *row);
    for (size_t i = 0; row && i < dims[0]; i++) {
        const struct mill_motion *m = plan->world->shape[plan->part[i].shape]->motion;
        set_rows(&plan->start[m ? m->number + 1 : 0], row[i]);
    }
    if (row)
        sink->values(sink, "start", MILL_H5_F64, 3, dims, row, "1",
                     "pose of the part's motion at t = 0: a point p of its frame is at "
                     "start[:, :3] p + start[:, 3] m");
    for (size_t i = 0; row && i < dims[0]; i++)
        set_rows(&plan->part[i].chart, row[i]);
    if (row)
        sink->values(sink, "axes", MILL_H5_F64, 3, dims, row, "1",
                     "the part's own axes, as a pose in the frame of its motion");
    free(row);
}

static void tell_parts(const struct mill_wear_plan *plan, struct mill_sink *sink, int32_t *room)
{
    const struct mill_world *w = plan->world;
    const size_t parts = (size_t)plan->parts;
    const char *kind[MILL_KINDS_MOST], *motion[MILL_MOTIONS_MOST];
    for (int k = 0; k < w->kinds.count; k++)
        kind[k] = w->kinds.name[k];
    for (int k = 0; k < w->motions; k++)
        motion[k] = w->motion_name[k];
    sink->open(sink, "parts");
    for (size_t i = 0; i < parts; i++)
        room[i] = w->shape[plan->part[i].shape]->kind;
    sink->values(sink, "kind", MILL_H5_I32, 1, &parts, room, "1",
                 "kind of contact with the part: index into the attribute kinds");
    sink->attribute(sink, "kinds", MILL_H5_TEXT, (size_t)w->kinds.count, kind);
    for (size_t i = 0; i < parts; i++)
        room[i] = w->shape[plan->part[i].shape]->number;
    sink->values(sink, "number", MILL_H5_I32, 1, &parts, room, "1",
                 "number of the blade, end wall or copy of a body; -1: the only one");
    for (size_t i = 0; i < parts; i++) {
        const struct mill_motion *m = w->shape[plan->part[i].shape]->motion;
        room[i] = m ? m->number : -1;
    }
    sink->values(sink, "motion", MILL_H5_I32, 1, &parts, room, "1",
                 "motion that carries the part: index into the attribute motions; -1: none");
    if (w->motions > 0)
        sink->attribute(sink, "motions", MILL_H5_TEXT, (size_t)w->motions, motion);
    for (size_t i = 0; i < parts; i++)
        room[i] = plan->part[i].round;
    sink->values(sink, "round", MILL_H5_I32, 1, &parts, room, "1",
                 "1: the part can turn about x of its axes without a change");
    tell_poses(plan, sink);
    sink->close(sink);
}

static void tell_facets(const struct mill_wear *wear, struct mill_sink *sink, int32_t *room,
                        double *three)
{
    const struct mill_wear_plan *plan = wear->plan;
    const size_t n = (size_t)plan->facets, dims[2] = {n, 3};
    for (size_t i = 0; i < n; i++)
        room[i] = plan->facet[i].part;
    sink->values(sink, "part", MILL_H5_I32, 1, &n, room, "1", "part of the facet: row of `parts`");
    for (size_t i = 0; i < n; i++)
        room[i] = plan->facet[i].face;
    sink->values(sink, "face", MILL_H5_I32, 1, &n, room, "1",
                 "direction in which the facet faces: 0 to 5: -x, +x, -y, +y, -z, +z of the part's "
                 "own axes; of a round part: along its axis, away from it (3), around it");
    for (size_t i = 0; i < n; i++)
        memcpy(three + 3 * i, &plan->facet[i].centre, 3 * sizeof *three);
    sink->values(sink, "centre", MILL_H5_F64, 2, dims, three, "m",
                 "middle of the facet, in the frame of the part's motion");
    for (size_t i = 0; i < n; i++)
        room[i] = (int32_t)fmin((double)wear->sum[i].count, INT32_MAX);
    sink->values(sink, "count", MILL_H5_I32, 1, &n, room, "1", "impacts on the facet");
}

/* The cells of the lattices that have a facet, for pictures */
static void tell_cells(const struct mill_wear_plan *plan, struct mill_sink *sink)
{
    size_t all = 0, n = 0;
    for (int i = 0; i < plan->parts; i++)
        for (size_t k = 0; k < mill_wear_facets_cells(&plan->part[i]); k++)
            all += plan->part[i].cell[k] >= 0;
    int32_t(*row)[6] = malloc((all + 1) * sizeof *row);
    double(*lattice)[7] = malloc(((size_t)plan->parts + 1) * sizeof *lattice);
    for (int i = 0; row && lattice && i < plan->parts; i++) {
        const struct mill_wear_part *p = &plan->part[i];
        for (int k = 0; k < 3; k++) {
            lattice[i][k] = p->from[k];
            lattice[i][3 + k] = p->size[k];
        }
        lattice[i][6] = p->radius;
        for (size_t k = 0; k < mill_wear_facets_cells(p); k++) {
            const size_t cell = k / MILL_WEAR_FACES, depth = (size_t)p->n[2],
                         rings = (size_t)p->n[1];
            const int32_t ring = (int32_t)(cell / depth % rings);
            if (p->cell[k] < 0)
                continue;
            row[n][0] = p->cell[k];
            row[n][1] = (int32_t)(cell / depth / rings);
            row[n][2] = ring;
            row[n][3] = (int32_t)(cell % depth);
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

/* The triangles of a picture, with the facet of each */
struct picture {
    size_t triangles;
    float *value; /* [triangles][9] corners, then room for other numbers */
    int32_t *facet;
};

/* Adds the surfaces of motion k (-1: of what stands still), as they are at t = 0. false: out of
 * memory */
static bool add_outline(const struct mill_wear_plan *plan, int k, struct picture *to)
{
    struct mill_mesh mesh;
    int32_t *own = NULL;
    bool good = mill_wear_outline(plan, k < 0 ? NULL : plan->world->motion[k], &mesh, &own);
    const size_t all = to->triangles + mesh.triangles + 1;
    float *value = realloc(to->value, 9 * all * sizeof *value);
    to->value = value ? value : to->value;
    int32_t *facet = realloc(to->facet, all * sizeof *facet);
    to->facet = facet ? facet : to->facet;
    good = good && value && facet;
    for (size_t i = 0; good && i < 3 * mesh.triangles; i++) {
        const vec3 r = mill_pose_out(&plan->start[k + 1], mesh.point[mesh.corner[i / 3][i % 3]]);
        float *at = value + 9 * to->triangles + 3 * i;
        at[0] = (float)r.x;
        at[1] = (float)r.y;
        at[2] = (float)r.z;
    }
    if (good && mesh.triangles > 0)
        memcpy(facet + to->triangles, own, mesh.triangles * sizeof *own);
    to->triangles += mesh.triangles;
    free(own);
    mill_mesh_free(&mesh);
    return good;
}

static void tell_mesh(const struct mill_wear_plan *plan, const double (*value)[COLUMNS],
                      struct mill_sink *sink)
{
    static const enum column shown[MILL_WEAR_SHOWN] = {RATE, NORMAL, SLIDING, DEPTH, EROSION};
    struct picture to = {0, NULL, NULL};
    bool good = true;
    for (int k = -1; good && k < plan->world->motions; k++)
        good = add_outline(plan, k, &to);
    const size_t n = to.triangles, dims[2] = {3 * n, 3};
    if (good) {
        sink->open(sink, "mesh");
        mill_tell_count(sink, "triangles", n, "number of triangles");
        sink->values(sink, "points", MILL_H5_F32, 2, dims, to.value, "m",
                     "corners of the triangles, three each, counter-clockwise as seen from the "
                     "balls, in the laboratory at t = 0");
        sink->values(sink, "facet", MILL_H5_I32, 1, &n, to.facet, "1", "facet of each triangle");
        for (int c = 0; c < MILL_WEAR_SHOWN; c++) {
            for (size_t i = 0; i < n; i++)
                to.value[i] = (float)value[to.facet[i]][shown[c]];
            sink->values(sink, columns[shown[c]].name, MILL_H5_F32, 1, &n, to.value,
                         columns[shown[c]].unit, columns[shown[c]].meaning);
        }
        sink->close(sink);
    }
    free(to.value);
    free(to.facet);
}

void mill_wear_tell(const struct mill_wear *wear, double duration, const struct mill_wear_law *law,
                    struct mill_sink *sink)
{
    const size_t n = (size_t)wear->plan->facets, parts = (size_t)wear->plan->parts;
    double *three = malloc((3 * n + 1) * sizeof *three);
    double(*value)[COLUMNS] = malloc((n + 1) * sizeof *value);
    int32_t *room = malloc((n + parts + 1) * sizeof *room);
    if (three && value && room) {
        for (size_t i = 0; i < n; i++)
            set_values(wear, (int32_t)i, duration, law, value[i]);
        sink->open(sink, "wear");
        tell_parts(wear->plan, sink, room);
        tell_facets(wear, sink, room, three);
        for (enum column c = 0; c < COLUMNS; c++) {
            for (size_t i = 0; i < n; i++)
                three[i] = value[i][c];
            mill_tell_array(sink, columns[c].name, n, three, columns[c].unit, columns[c].meaning);
        }
        tell_cells(wear->plan, sink);
        tell_mesh(wear->plan, (const double(*)[COLUMNS])value, sink);
        sink->close(sink);
    }
    free(three);
    free(value);
    free(room);
}
