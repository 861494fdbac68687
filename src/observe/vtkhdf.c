/* VTKHDF 2.1 (docs.vtk.org, "VTKHDF file format"): a collection of three blocks of poly data, every
 * one with time steps, for readers stumble over collections in which only some have them. A step of
 * a block begins in each of its arrays at an offset. So what does not change is there once and
 * begins at 0 in every step; what changes lies frame after frame: balls as a virtual dataset, which
 * shows the rows (frame, ball) of /particles/trajectory as one long column, the rotor's few points
 * in full. All steps are counted as the same one part, for their numbers of points and cells are
 * the same. Numbers that several blocks have in common are linked, not written again. */
#include "observe/vtkhdf.h"

#include "base/elementary.h"

#include "observe/outline.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define ROOT "/VTKHDF"
#define BALLS ROOT "/balls"
#define TRAJECTORY "/particles/trajectory"
#define ALIKE BALLS "/Steps/PartOffsets" /* as many zeros as there are frames */

enum { PATH = 160, NAME = 64, AT_ONCE = 512 };

struct scene {
    struct mill_h5 *file;
    const struct mill_observe *asked;
    const struct mill_world *world;
    const struct mill_going *going;
    bool left; /* it was not to go on */
    size_t frames;
    const char *block; /* its group */
};

static const char *const cell_groups[] = {"Vertices", "Lines", "Polygons", "Strips"};

/* ---- single things of a block ---- */

static void join(const struct scene *s, char path[PATH], const char *name)
{
    snprintf(path, PATH, "%s/%s", s->block, name);
}

static void put(struct scene *s, const char *name, enum mill_h5_type type, int rank,
                const size_t *dims, const void *values, const char *unit, const char *text)
{
    char path[PATH];
    join(s, path, name);
    mill_h5_write(s->file, path, type, rank, dims, values, unit, text);
}

static void put_number(struct scene *s, const char *name, int64_t value, const char *text)
{
    const size_t one = 1;
    put(s, name, MILL_H5_I64, 1, &one, &value, "1", text);
}

/* Another name for what stands elsewhere in the file */
static void link_to(struct scene *s, const char *existing, const char *name)
{
    char path[PATH];
    join(s, path, name);
    mill_h5_link(s->file, existing, path);
}

/* Rows first, first + step, first + 2 step, ...; each has its number `width` times. */
static void put_rows(struct scene *s, const char *name, size_t rows, size_t width, int64_t first,
                     int64_t step, const char *text)
{
    const struct mill_h5_layout layout = {
        .type = MILL_H5_I64, .rank = width > 1, .dims = {width}, .unit = "1", .description = text};
    char path[PATH];
    int64_t some[AT_ONCE];
    join(s, path, name);
    struct mill_h5_column *column = mill_h5_column_create(s->file, path, &layout, 0);
    for (size_t done = 0; done < rows;) {
        const size_t left = rows - done, most = AT_ONCE / width, now = left < most ? left : most;
        for (size_t i = 0; i < now * width; i++)
            some[i] = first + step * (int64_t)(done + i / width);
        mill_h5_column_append(column, now, some);
        done += now;
    }
    mill_h5_column_close(column);
}

static void put_attribute(struct scene *s, const char *object, const char *name, int64_t value)
{
    mill_h5_attribute(s->file, object, name, MILL_H5_I64, 0, &value);
}

/* A group as VTK knows it by its attributes; VTK wants its members in order. */
static void put_typed_group(struct scene *s, const char *path, const char *type)
{
    static const int64_t version[2] = {2, 1};
    mill_h5_group(s->file, path, true);
    mill_h5_attribute(s->file, path, "Version", MILL_H5_I64, 2, version);
    mill_h5_attribute_ascii(s->file, path, "Type", type);
}

/* ---- what all blocks have ---- */

/* The block's group, its place in the collection and in the tree of names */
static void begin_block(struct scene *s, const char *name, int64_t index)
{
    char place[PATH];
    put_typed_group(s, s->block, "PolyData");
    put_attribute(s, s->block, "Index", index);
    snprintf(place, sizeof place, ROOT "/Assembly/%s", name);
    mill_h5_group(s->file, place, true);
    snprintf(place, sizeof place, ROOT "/Assembly/%s/%s", name, name);
    mill_h5_soft_link(s->file, s->block, place);
}

/* Rows that all blocks have in common: the balls have them, the others link to them. */
static void put_common(struct scene *s, const char *name, size_t width, int64_t value,
                       const char *text)
{
    char first[PATH];
    snprintf(first, sizeof first, BALLS "/%s", name);
    if (strcmp(s->block, BALLS) == 0)
        put_rows(s, name, s->frames, width, value, 0, text);
    else
        link_to(s, first, name);
}

/* The steps' times and offsets; moving: each step has its own points, else all have the same. */
static void put_steps(struct scene *s, bool moving, size_t points)
{
    char path[PATH];
    link_to(s, TRAJECTORY "/position/time", "Steps/Values");
    join(s, path, "Steps");
    put_attribute(s, path, "NSteps", (int64_t)s->frames);
    put_common(s, "Steps/PartOffsets", 1, 0, "where a frame begins in what all frames share: 0");
    put_common(s, "Steps/NumberOfParts", 1, 1, "parts of a frame: 1");
    put_common(s, "Steps/CellOffsets", 4, 0,
               "where a frame's vertices, lines, polygons and strips begin: 0, all frames share "
               "them");
    link_to(s, BALLS "/Steps/CellOffsets", "Steps/ConnectivityIdOffsets");
    if (moving)
        put_rows(s, "Steps/PointOffsets", s->frames, 1, 0, (int64_t)points,
                 "where a frame's points, and what changes with them, begin");
    else
        link_to(s, ALIKE, "Steps/PointOffsets");
}

/* The cells of one kind, `each` corners to a cell; corner NULL: point k is the corner of cell k.
 * The other kinds are empty. */
static void put_cells(struct scene *s, const char *group, size_t cells, size_t each,
                      const int64_t *corner)
{
    const bool first = strcmp(s->block, BALLS) == 0;
    const size_t corners = cells * each;
    char name[NAME];
    for (size_t k = 0; k < sizeof cell_groups / sizeof *cell_groups; k++) {
        if (strcmp(cell_groups[k], group) == 0)
            continue;
        if (!first || k > 1) { /* lines come first of those that are empty everywhere */
            link_to(s, BALLS "/Lines", cell_groups[k]);
            continue;
        }
        put_number(s, "Lines/NumberOfCells", 0, "no cells of this kind");
        link_to(s, BALLS "/Lines/NumberOfCells", "Lines/NumberOfConnectivityIds");
        link_to(s, BALLS "/Lines/NumberOfCells", "Lines/Offsets");
        /* growing, not fixed: h5repack cannot pack a fixed array of nothing */
        put_rows(s, "Lines/Connectivity", 0, 1, 0, 0, "no cells of this kind");
    }
    snprintf(name, sizeof name, "%s/NumberOfCells", group);
    put_number(s, name, (int64_t)cells, "number of cells");
    snprintf(name, sizeof name, "%s/NumberOfConnectivityIds", group);
    put_number(s, name, (int64_t)corners, "number of the corners of all cells");
    snprintf(name, sizeof name, "%s/Offsets", group);
    put_rows(s, name, cells + 1, 1, 0, (int64_t)each, "where a cell's corners begin, and the end");
    snprintf(name, sizeof name, "%s/Connectivity", group);
    if (corner)
        put(s, name, MILL_H5_I64, 1, &corners, corner, "1", "corners of the cells: points");
    else
        put_rows(s, name, corners, 1, 0, 1, "corners of the cells: points");
}

/* ---- the blocks ---- */

/* The frames of a state, (frame, ball, 3), as (frame x ball, 3) */
static void put_view(struct scene *s, const char *name, const char *state, size_t balls,
                     const char *unit, const char *text)
{
    const size_t dims[2] = {s->frames * balls, 3}, source_dims[3] = {s->frames, balls, 3};
    char path[PATH], source[PATH];
    join(s, path, name);
    snprintf(source, sizeof source, TRAJECTORY "/%s/value", state);
    mill_h5_view(s->file, path, MILL_H5_F32, 2, dims, source, 3, source_dims, unit, text);
}

static void put_balls(struct scene *s, size_t balls)
{
    static const char *const constant[] = {"diameter", "id", "mass", "species"};
    s->block = BALLS;
    begin_block(s, "balls", 0);
    put_number(s, "NumberOfPoints", (int64_t)balls, "number of points of a frame");
    put_view(s, "Points", "position", balls, "m", "centres of the balls, frame after frame");
    put_cells(s, "Vertices", balls, 1, NULL);
    put_steps(s, true, balls);
    put_view(s, "PointData/velocity", "velocity", balls, "m s-1",
             "velocities of the balls, frame after frame");
    put_view(s, "PointData/angular_velocity", "angular_velocity", balls, "rad s-1",
             "angular velocities of the balls, frame after frame");
    link_to(s, BALLS "/Steps/PointOffsets", "Steps/PointDataOffsets/velocity");
    link_to(s, BALLS "/Steps/PointOffsets", "Steps/PointDataOffsets/angular_velocity");
    for (size_t k = 0; k < sizeof constant / sizeof *constant; k++) {
        char source[PATH], name[NAME];
        snprintf(source, sizeof source, TRAJECTORY "/%s", constant[k]);
        snprintf(name, sizeof name, "PointData/%s", constant[k]);
        link_to(s, source, name);
        snprintf(name, sizeof name, "Steps/PointDataOffsets/%s", constant[k]);
        link_to(s, ALIKE, name);
    }
}

/* All points, the rotor at this angle */
static void turn(const struct mill_mesh *mesh, double angle, float *to)
{
    const struct mill_heading at = mill_elementary_heading(angle);
    const double c = at.cos, s = at.sin;
    for (size_t i = 0; i < mesh->points; i++) {
        const vec3 r = mesh->point[i];
        to[3 * i] = (float)r.x;
        to[3 * i + 1] = (float)(c * r.y - s * r.z);
        to[3 * i + 2] = (float)(s * r.y + c * r.z);
    }
}

static void put_turning_points(struct scene *s, const struct mill_mesh *mesh, float *points)
{
    static const struct mill_h5_layout layout = {
        .type = MILL_H5_F32,
        .rank = 1,
        .dims = {3},
        .unit = "m",
        .description = "corners of the triangles, frame after frame",
    };
    const struct mill_observe *asked = s->asked;
    char path[PATH];
    join(s, path, "Points");
    struct mill_h5_column *column = mill_h5_column_create(s->file, path, &layout, 0);
    for (size_t k = 0; k < s->frames && mill_h5_status(s->file, NULL) == MILL_OK; k++) {
        const double time = mill_observe_due(asked->frames, asked->end, k);
        turn(mesh, asked->rotor_angle + s->world->rotor_speed * time, points);
        mill_h5_column_append(column, mesh->points, points);
        if (s->going && !s->going->on(s->going->self, (double)k, (double)s->frames)) {
            s->left = true;
            break;
        }
    }
    mill_h5_column_close(column);
}

/* Drum or rotor; a rotor that stands is as still as a drum. */
static void put_body(struct scene *s, const char *name, int64_t index,
                     const struct mill_outline *outline, bool turning)
{
    const struct mill_mesh *mesh = &outline->mesh;
    const bool moving = turning && s->world->rotor_speed != 0.0;
    const size_t dims[2] = {mesh->points, 3};
    float *points = malloc(3 * mesh->points * sizeof *points);
    char path[PATH];
    if (!points) {
        mill_h5_spend(s->file, "out of memory for the mill's outline");
        return;
    }
    begin_block(s, name, index);
    put_number(s, "NumberOfPoints", (int64_t)mesh->points, "number of points of a frame");
    if (moving) {
        put_turning_points(s, mesh, points);
    } else {
        turn(mesh, turning ? s->asked->rotor_angle : 0.0, points);
        put(s, "Points", MILL_H5_F32, 2, dims, points, "m", "corners of the triangles");
    }
    put_cells(s, "Polygons", mesh->triangles, 3, &mesh->corner[0][0]);
    put_steps(s, moving, mesh->points);
    put(s, "CellData/kind", MILL_H5_U8, 1, &mesh->triangles, outline->kind, "1",
        "what the triangle is part of, as the kind of contact with it: index into the attribute "
        "kinds");
    join(s, path, "CellData/kind");
    mill_h5_attribute(s->file, path, "kinds", MILL_H5_TEXT, MILL_KINDS, mill_kind_name);
    put(s, "CellData/number", MILL_H5_I32, 1, &mesh->triangles, outline->number, "1",
        "number of the blade or end wall, -1 for drum and shaft");
    link_to(s, ALIKE, "Steps/CellDataOffsets/kind");
    link_to(s, ALIKE, "Steps/CellDataOffsets/number");
    free(points);
}

static void put_bodies(struct scene *s)
{
    for (int turning = 0; turning < 2; turning++) {
        struct mill_outline outline;
        struct mill_error error;
        s->block = turning ? ROOT "/rotor" : ROOT "/drum";
        if (mill_outline_make(&s->asked->drum, s->world, turning, &outline, &error) != MILL_OK)
            mill_h5_spend(s->file, error.text);
        else if (outline.mesh.triangles > 0)
            put_body(s, turning ? "rotor" : "drum", 1 + turning, &outline, turning);
        mill_outline_free(&outline);
    }
}

bool mill_vtkhdf_write(struct mill_h5 *file, const struct mill_observe *asked,
                       const struct mill_world *world, uint64_t frames,
                       const struct mill_going *going)
{
    struct scene s = {.file = file,
                      .asked = asked,
                      .world = world,
                      .going = going,
                      .frames = (size_t)frames,
                      .block = ROOT};
    if (frames == 0)
        return true;
    put_typed_group(&s, ROOT, "PartitionedDataSetCollection");
    mill_h5_group(file, ROOT "/Assembly", true);
    put_balls(&s, (size_t)world->balls);
    put_bodies(&s);
    return !s.left;
}

void mill_vtkhdf_remove(struct mill_h5 *file)
{
    mill_h5_remove(file, ROOT);
}
