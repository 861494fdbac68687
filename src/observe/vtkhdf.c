/* VTKHDF 2.1 (docs.vtk.org, "VTKHDF file format"): a collection of blocks of poly data. Every block
 * has time steps, because readers fail if only some have them. In each array of a block, a step
 * begins at an offset: 0 for data that do not change, which are stored once. Others are stored
 * frame after frame: the few points of moving bodies in full, the balls as a virtual dataset, which
 * shows the rows (frame, ball) of /particles/trajectory as one long column. All steps use the same
 * single part, as they have the same points and cells. What several blocks share is linked. */
#include "observe/vtkhdf.h"

#include "base/elementary.h"
#include "observe/kinds.h"
#include "observe/outline.h"
#include "observe/wear.h"

#include <stdio.h>
#include <string.h>

#define ROOT "/VTKHDF"
#define BALLS ROOT "/balls"
#define TRAJECTORY "/particles/trajectory"
#define ALIKE BALLS "/Steps/PartOffsets" /* as many zeros as frames */

enum { PATH = 192, BLOCK = 96, MOST_WIDTH = 4, MOST_ROWS = 8192 /* in a chunk */ };

struct scene {
    struct mill_h5 *file;
    const struct mill_observe *asked;
    const struct mill_world *world;
    const struct mill_going *going;
    bool left; /* true: stopped before the end */
    size_t frames;
    int64_t blocks;    /* number of blocks so far */
    char block[BLOCK]; /* the group of the present block */
    char path[PATH];   /* result of the last call of `at` */
};

/* ---- parts of a block ---- */

/* "BLOCK/GROUP/NAME", valid until the next call; GROUP may be "" */
static const char *at(struct scene *s, const char *group, const char *name)
{
    snprintf(s->path, PATH, "%s/%s%s%s", s->block, group, *group ? "/" : "", name);
    return s->path;
}

static void put_number(struct scene *s, const char *group, const char *name, size_t value,
                       const char *text)
{
    const size_t one = 1;
    const int64_t number = (int64_t)value;
    mill_h5_write(s->file, at(s, group, name), MILL_H5_I64, 1, &one, &number, "1", text);
}

static void link_to(struct scene *s, const char *existing, const char *group, const char *name)
{
    mill_h5_link(s->file, existing, at(s, group, name));
}

/* Writes the rows first, first + step, first + 2 step, ...; a row has its number `width` times. */
static void put_rows(struct scene *s, const char *group, const char *name, size_t rows,
                     size_t width, int64_t first, size_t step, const char *text)
{
    const size_t chunk = rows < MOST_ROWS ? rows + (rows == 0) : MOST_ROWS;
    const struct mill_h5_layout layout = {MILL_H5_I64, width > 1, {width}, chunk, "1", text, false};
    struct mill_h5_column *column = mill_h5_column_create(s->file, at(s, group, name), &layout, 0);
    for (size_t row = 0; row < rows; row++) {
        const int64_t one = first + (int64_t)(step * row), same[MOST_WIDTH] = {one, one, one, one};
        mill_h5_column_append(column, 1, same);
    }
    mill_h5_column_close(column);
}

/* Makes a group with the attributes by which VTK knows it; VTK wants its members in order. */
static void put_typed_group(struct scene *s, const char *path, const char *type)
{
    static const int64_t version[2] = {2, 1};
    mill_h5_group(s->file, path, true);
    mill_h5_attribute(s->file, path, "Version", MILL_H5_I64, 2, version);
    mill_h5_attribute_ascii(s->file, path, "Type", type);
}

/* ---- what all blocks contain ---- */

/* Begins a block: its group, its place in the collection and in the tree of names */
static void begin_block(struct scene *s, const char *name, size_t points)
{
    char place[PATH];
    const int64_t index = s->blocks++;
    snprintf(s->block, BLOCK, ROOT "/%s", name);
    put_typed_group(s, s->block, "PolyData");
    mill_h5_attribute(s->file, s->block, "Index", MILL_H5_I64, 0, &index);
    snprintf(place, sizeof place, ROOT "/Assembly/%s", name);
    mill_h5_group(s->file, place, true);
    snprintf(place, sizeof place, ROOT "/Assembly/%s/%s", name, name);
    mill_h5_soft_link(s->file, s->block, place);
    put_number(s, "", "NumberOfPoints", points, "number of points of a frame");
}

/* Writes the times and offsets of the steps. moving: each step has its own points; otherwise all
 * use the same. What all blocks share is stored with the balls; the others link to it. */
static void put_steps(struct scene *s, bool moving, size_t points)
{
    static const struct {
        const char *name, *balls, *text;
        size_t width;
        int64_t value;
    } common[] = {
        {"PartOffsets", ALIKE, "where a frame begins in what all frames share: 0", 1, 0},
        {"NumberOfParts", BALLS "/Steps/NumberOfParts", "parts of a frame: 1", 1, 1},
        {"CellOffsets", BALLS "/Steps/CellOffsets",
         "where a frame's vertices, lines, polygons and strips begin: 0, all frames share them", 4,
         0},
    };
    const bool first = strcmp(s->block, BALLS) == 0;
    const int64_t steps = (int64_t)s->frames;
    link_to(s, TRAJECTORY "/position/time", "Steps", "Values");
    mill_h5_attribute(s->file, at(s, "", "Steps"), "NSteps", MILL_H5_I64, 0, &steps);
    for (size_t k = 0; k < sizeof common / sizeof *common; k++)
        if (first)
            put_rows(s, "Steps", common[k].name, s->frames, common[k].width, common[k].value, 0,
                     common[k].text);
        else
            link_to(s, common[k].balls, "Steps", common[k].name);
    link_to(s, BALLS "/Steps/CellOffsets", "Steps", "ConnectivityIdOffsets");
    if (moving)
        put_rows(s, "Steps", "PointOffsets", s->frames, 1, 0, points,
                 "where a frame's points, and what changes with them, begin");
    else
        link_to(s, ALIKE, "Steps", "PointOffsets");
}

/* Writes cells of one kind with `each` corners; the others are empty. corner NULL: 0, 1, 2, ... */
static void put_cells(struct scene *s, const char *group, size_t cells, size_t each,
                      const int64_t *corner)
{
    static const char *const groups[] = {"Vertices", "Lines", "Polygons", "Strips"};
    const bool first = strcmp(s->block, BALLS) == 0;
    const size_t corners = cells * each;
    for (size_t k = 0; k < sizeof groups / sizeof *groups; k++) {
        if (strcmp(groups[k], group) == 0)
            continue;
        if (!first || k > 1) { /* lines are the first kind that is empty in all blocks */
            link_to(s, BALLS "/Lines", "", groups[k]);
            continue;
        }
        put_number(s, "Lines", "NumberOfCells", 0, "no cells of this kind");
        link_to(s, BALLS "/Lines/NumberOfCells", "Lines", "NumberOfConnectivityIds");
        link_to(s, BALLS "/Lines/NumberOfCells", "Lines", "Offsets");
        /* a growing dataset, because h5repack cannot compress a fixed array of size 0 */
        put_rows(s, "Lines", "Connectivity", 0, 1, 0, 0, "no cells of this kind");
    }
    put_number(s, group, "NumberOfCells", cells, "number of cells");
    put_number(s, group, "NumberOfConnectivityIds", corners, "number of the corners of all cells");
    put_rows(s, group, "Offsets", cells + 1, 1, 0, each,
             "where a cell's corners begin, and the end");
    if (corner)
        mill_h5_write(s->file, at(s, group, "Connectivity"), MILL_H5_I64, 1, &corners, corner, "1",
                      "corners of the cells: points");
    else
        put_rows(s, group, "Connectivity", corners, 1, 0, 1, "corners of the cells: points");
}

/* ---- the balls ---- */

/* Shows the frames of a state, (frame, ball, 3), as (frame x ball, 3) */
static void put_view(struct scene *s, const char *group, const char *name, const char *state,
                     const char *unit, const char *text)
{
    const size_t balls = (size_t)s->world->balls;
    const size_t dims[2] = {s->frames * balls, 3}, held[3] = {s->frames, balls, 3};
    char source[PATH];
    snprintf(source, sizeof source, TRAJECTORY "/%s/value", state);
    mill_h5_view(s->file, at(s, group, name), MILL_H5_F32, 2, dims, source, 3, held, unit, text);
}

static void put_balls(struct scene *s)
{
    static const char *const constant[] = {"diameter", "id", "mass", "species"};
    const size_t balls = (size_t)s->world->balls;
    begin_block(s, "balls", balls);
    put_view(s, "", "Points", "position", "m", "centres of the balls, frame after frame");
    put_cells(s, "Vertices", balls, 1, NULL);
    put_steps(s, true, balls);
    put_view(s, "PointData", "velocity", "velocity", "m s-1",
             "velocities of the balls, frame after frame");
    put_view(s, "PointData", "angular_velocity", "angular_velocity", "rad s-1",
             "angular velocities of the balls, frame after frame");
    link_to(s, BALLS "/Steps/PointOffsets", "Steps/PointDataOffsets", "velocity");
    link_to(s, BALLS "/Steps/PointOffsets", "Steps/PointDataOffsets", "angular_velocity");
    for (size_t k = 0; k < sizeof constant / sizeof *constant; k++) {
        char source[PATH];
        snprintf(source, sizeof source, TRAJECTORY "/%s", constant[k]);
        link_to(s, source, "PointData", constant[k]);
        link_to(s, ALIKE, "Steps/PointDataOffsets", constant[k]);
    }
}

/* ---- what stands still, and what motions carry ---- */

/* Writes all points turned about x by this angle */
static void turn(const struct mill_mesh *mesh, double angle, float *to)
{
    const struct mill_heading by = mill_elementary_heading(angle);
    for (size_t i = 0; i < mesh->points; i++) {
        const vec3 r = mesh->point[i];
        to[3 * i] = (float)r.x;
        to[3 * i + 1] = (float)(by.cos * r.y - by.sin * r.z);
        to[3 * i + 2] = (float)(by.sin * r.y + by.cos * r.z);
    }
}

/* Reads the poses of motion k in all frames: [frames][3] places, [frames][9] rotations; -1: of what
 * stands still, for one frame. NULL: failed; the file reports why. Owner: the caller; free(). */
static double *read_poses(const struct scene *s, int k)
{
    double *pose = calloc(12 * (s->frames + 1), sizeof *pose);
    char path[PATH];
    if (!pose)
        mill_h5_spend(s->file, "out of memory for the poses");
    for (size_t i = 0; i < 3 && pose && k < 0; i++)
        pose[3 * s->frames + 4 * i] = 1.0;
    for (int which = 0; which < 2 && pose && k >= 0; which++) {
        snprintf(path, sizeof path, MILL_VTKHDF_POSE "%s/%s/value", s->world->motion_name[k],
                 which ? "rotation" : "centre");
        mill_h5_read(s->file, path, MILL_H5_F64, (which ? 9 : 3) * s->frames,
                     pose + 3 * s->frames * which, NULL);
    }
    return pose;
}

/* Writes all points as moved by the pose of a frame */
static void move(const struct mill_mesh *mesh, const double *pose, size_t n, size_t all, float *to)
{
    const double *centre = pose + 3 * n, *rotation = pose + 3 * all + 9 * n;
    for (size_t i = 0; i < mesh->points; i++) {
        const vec3 r = mesh->point[i];
        for (int k = 0; k < 3; k++) {
            const double *row = rotation + 3 * k;
            to[3 * i + (size_t)k] = (float)(row[0] * r.x + row[1] * r.y + row[2] * r.z + centre[k]);
        }
    }
}

/* Writes the points of motion k (-1: what stands still) for so many frames. A rotor is turned by
 * its angle at the frame's time, which gives the same bits as in files of earlier versions. */
static void put_points(struct scene *s, const struct mill_mesh *m, int k, size_t all, float *points)
{
    static const struct mill_h5_layout corners = {
        MILL_H5_F32, 1, {3}, 0, "m", "corners of the triangles, frame after frame", false};
    const struct mill_world *world = s->world;
    const bool rotor = k >= 0 && k == world->rotor && !world->motion[k]->on;
    double *pose = read_poses(s, k);
    struct mill_h5_column *rows = mill_h5_column_create(s->file, at(s, "", "Points"), &corners, 0);
    for (size_t i = 0; i < all && !s->left && mill_h5_status(s->file, NULL) == MILL_OK; i++) {
        const double time = mill_observe_due(s->asked->frames, s->asked->end, i);
        if (rotor)
            turn(m, s->asked->rotor_angle + world->rotor_speed * time, points);
        else
            move(m, pose, i, s->frames, points);
        mill_h5_column_append(rows, m->points, points);
        s->left = s->going && !s->going->on(s->going->self, (double)i, (double)s->frames);
    }
    mill_h5_column_close(rows);
    free(pose);
}

/* Writes the block of motion k; -1: of what stands still */
static void put_body(struct scene *s, const char *name, int k, const struct mill_outline *outline,
                     float *points)
{
    const struct mill_mesh *mesh = &outline->mesh;
    const struct mill_listed kinds = mill_kinds_listed(s->world);
    const bool moving = k >= 0 && mill_motion_cycle(&s->world->motion[k], 1).single > 0.0;
    begin_block(s, name, mesh->points);
    put_points(s, mesh, k, moving ? s->frames : 1, points);
    put_cells(s, "Polygons", mesh->triangles, 3, &mesh->corner[0][0]);
    put_steps(s, moving, mesh->points);
    mill_h5_write(
        s->file, at(s, "CellData", "kind"), MILL_H5_U8, 1, &mesh->triangles, outline->kind, "1",
        "what the triangle is part of, as the kind of contact with it: index into the attribute "
        "kinds");
    mill_h5_attribute(s->file, s->path, "kinds", MILL_H5_TEXT, (size_t)kinds.count, kinds.name);
    mill_h5_write(s->file, at(s, "CellData", "number"), MILL_H5_I32, 1, &mesh->triangles,
                  outline->number, "1",
                  "number of the blade, end wall or copy of a body, -1 for drum and shaft");
    link_to(s, ALIKE, "Steps/CellDataOffsets", "kind");
    link_to(s, ALIKE, "Steps/CellDataOffsets", "number");
}

/* ---- wear ---- */

/* Writes the block "wear": all surfaces at the first frame in small triangles, with results */
static void put_wear(struct scene *s)
{
    uint64_t triangles = 0;
    mill_h5_read(s->file, MILL_WEAR_MESH "/triangles", MILL_H5_U64, 1, &triangles, NULL);
    begin_block(s, "wear", 3 * (size_t)triangles);
    link_to(s, MILL_WEAR_MESH "/points", "", "Points");
    put_cells(s, "Polygons", (size_t)triangles, 3, NULL);
    put_steps(s, false, 0);
    for (int c = 0; c < MILL_WEAR_SHOWN; c++) {
        char path[PATH];
        snprintf(path, sizeof path, MILL_WEAR_MESH "/%s", mill_wear_shown(c));
        link_to(s, path, "CellData", mill_wear_shown(c));
        link_to(s, ALIKE, "Steps/CellDataOffsets", mill_wear_shown(c));
    }
}

/* Name of the motion's block: that of the motion, unless another block has this name */
static void name_of_motion(const struct mill_world *world, int k, char name[BLOCK])
{
    static const char *const taken[] = {"balls", "drum", "still", "wear", "Assembly"};
    const char *own = world->motion_name[k];
    /* so that no two names become equal */
    const char *before = strncmp(own, "motion_", 7) == 0 ? "motion_" : "";
    for (size_t i = 0; i < sizeof taken / sizeof *taken; i++)
        before = strcmp(own, taken[i]) == 0 ? "motion_" : before;
    snprintf(name, BLOCK, "%s%s", before, own);
}

bool mill_vtkhdf_write(struct mill_h5 *file, const struct mill_observe *asked,
                       const struct mill_world *world, uint64_t frames,
                       const struct mill_going *going)
{
    struct scene s = {
        .file = file, .asked = asked, .world = world, .going = going, .frames = (size_t)frames};
    if (frames == 0)
        return true;
    put_typed_group(&s, ROOT, "PartitionedDataSetCollection");
    mill_h5_group(file, ROOT "/Assembly", true);
    put_balls(&s);
    for (int k = -1; k < world->motions; k++) {
        struct mill_outline outline;
        char name[BLOCK];
        const struct mill_motion *motion = k < 0 ? NULL : world->motion[k];
        const bool drawn = mill_outline_make(world, motion, &outline);
        float *points = malloc((3 * outline.mesh.points + 1) * sizeof *points);
        snprintf(name, sizeof name, "%s",
                 world->container.drum && !world->container.motion ? "drum" : "still");
        if (k >= 0)
            name_of_motion(world, k, name);
        if (!drawn || !points)
            mill_h5_spend(file, "out of memory for the mill's outline");
        else if (outline.mesh.triangles > 0)
            put_body(&s, name, k, &outline, points);
        free(points);
        mill_outline_free(&outline);
    }
    if (mill_h5_exists(file, MILL_WEAR_MESH))
        put_wear(&s);
    return !s.left;
}
