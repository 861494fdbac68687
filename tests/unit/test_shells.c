/* Meshes of several shells: what is left of them, and what is said of those that cannot be. */
#include "facets_fixture.h"

#include <stdarg.h>

static struct form form, other;
static struct heard heard;

static vec3 at(double x, double y, double z)
{
    return vec3_make(1e-3 * x, 1e-3 * y, 1e-3 * z);
}

static void turn(size_t facet)
{
    const vec3 kept = form.facet[facet][1];
    form.facet[facet][1] = form.facet[facet][2];
    form.facet[facet][2] = kept;
}

/* Adds a box [mm]. turned: it faces inwards. */
static void add_box(vec3 centre, vec3 size, bool turned)
{
    const size_t from = form.is.facets;
    form_add_box(&form, vec3_scale(centre, 1e-3), vec3_scale(size, 1e-3));
    for (size_t k = from; turned && k < form.is.facets; k++)
        turn(k);
}

static vec3 cube(double side)
{
    return vec3_make(side, side, side);
}

static void open_cube(double side)
{
    form_open(&form);
    add_box(nought, cube(side), false);
}

/* The other diagonal of each quad */
static void swap_diagonals(size_t from)
{
    for (size_t k = from; k < form.is.facets; k += 2) {
        const vec3 a = form.facet[k][0], b = form.facet[k][1], c = form.facet[k][2],
                   d = form.facet[k + 1][2];
        const vec3 one[3] = {a, b, d}, two[3] = {b, c, d};
        memcpy(form.facet[k], one, sizeof one);
        memcpy(form.facet[k + 1], two, sizeof two);
    }
}

static void restore(void)
{
    memcpy(form.facet, other.facet, sizeof form.facet);
    form.is.facets = other.is.facets;
}

static double volume_left(void)
{
    return 1e9 * mill_facets_solid.volume(&form.is); /* mm^3 */
}

/* Of the form: so many facets are left, around this volume [mm^3] */
static void expect_left(size_t facets, double volume)
{
    form_unite(&form, &heard);
    ck_assert_msg(heard.count == 0, "%s", heard.said[0]);
    ck_assert_uint_eq(form.is.facets, facets);
    ck_assert_double_eq_tol(volume_left(), volume, 1e-6);
}

/* The form has so many faults; the first one has these words. */
static void expect_faults(long faults, const char *words)
{
    const size_t facets = form.is.facets;
    form_unite(&form, &heard);
    ck_assert_msg(heard.found.faults == faults, "%ld: '%s'", heard.found.faults, heard.said[0]);
    ck_assert_msg(strstr(heard.said[0], words), "'%s', not '%s'", heard.said[0], words);
    ck_assert_uint_eq(form.is.facets, facets);
}

/* ---- unions ---- */

TEST(a_solid_within_another_is_left_out)
{
    open_cube(30.0);
    add_box(vec3_make(1.0, 2.0, 3.0), cube(20.0), false);
    add_box(vec3_make(1.0, 2.0, 3.0), cube(10.0), false);
    expect_left(12, 27000.0);
}

/* Equal faces back to back, whatever their diagonals; and faces that one of them has twice; and a
 * solid across such faces */
LOOP_TEST(flush_faces_are_left_out, 5)
{
    open_cube(20.0);
    if (_i == 4)
        add_box(vec3_make(10.0, 1.0, 2.0), cube(5.0), false);
    if (_i == 3) {
        add_box(vec3_make(3.0, 0.0, 0.0), vec3_make(14.0, 10.0, 20.0), false);
        expect_left(12, 8000.0);
        return;
    }
    add_box(vec3_make(20.0, 0.0, 0.0), cube(20.0), false);
    if (_i == 1)
        swap_diagonals(12);
    if (_i == 2)
        add_box(vec3_make(-20.0, 0.0, 0.0), cube(20.0), false);
    expect_left(_i == 2 ? 28 : 20, _i == 2 ? 24000.0 : 16000.0);
}

/* A cavity that fills its solid leaves nothing of it. */
TEST(a_solid_without_volume_is_left_out)
{
    open_cube(20.0);
    add_box(nought, cube(20.0), false);
    swap_diagonals(12);
    for (size_t k = 12; k < 24; k++)
        turn(k);
    add_box(vec3_make(50.0, 0.0, 0.0), cube(10.0), false);
    expect_left(12, 1000.0);
}

/* Whatever the order of the facets in the file: the program that unites tells solids apart by it
 * only where their edges are the same. */
LOOP_TEST(a_solid_given_several_times_counts_once, 4)
{
    form_open(&form);
    for (int k = 0; k < 5; k++)
        add_box(nought, cube(20.0), false);
    if (_i == 1)
        swap_diagonals(48);
    if (_i >= 2) { /* every facet five times, one after the other; and a solid beside them */
        other = form;
        for (size_t k = 0; k < 60; k++)
            memcpy(form.facet[k], other.facet[12 * (k % 5) + k / 5], sizeof form.facet[k]);
        add_box(vec3_make(20.0, 0.0, 0.0), cube(20.0), false);
        if (_i == 3)
            swap_diagonals(60);
    }
    expect_left(_i >= 2 ? 20 : 12, _i >= 2 ? 16000.0 : 8000.0);
}

/* A place is within the union, and no facet in it is near. */
TEST(a_place_in_a_union_is_behind_its_surface)
{
    open_cube(20.0);
    add_box(vec3_make(20.0, 0.0, 0.0), cube(20.0), false);
    add_box(nought, cube(8.0), false);
    form_unite(&form, &heard);
    const struct mill_reach places = {{-1.0, -1.0, -1.0}, {1.0, 1.0, 1.0}, INFINITY};
    struct mill_shape *s = lone_shape(&mill_facets_solid, &form.is, NULL, &places);
    for (int x = -9; x < 30; x++)
        for (int y = -9; y < 10; y++) {
            const double deep = fmin(fmin(x + 10.0, 30.0 - x), 10.0 - abs(y));
            ck_assert_double_eq_tol(gap_of(s, at(x, y, 0.0), 0.0, 0.0), -1e-3 * deep, 1e-15);
        }
    lone_shape_free(s);
}

/* Nothing lies between the facets at such an edge, wherever a place is: two wedges of 45 degrees in
 * the upper half plane, and the space below nearest to their common edge. */
TEST(solids_that_share_only_an_edge_are_met_from_every_side)
{
    const double s = 0.02;
    const vec3 a[2] = {{0, -s, 0}, {0, s, 0}}, b[2] = {{s, -s, 0}, {s, s, 0}},
               c[2] = {{s, -s, s}, {s, s, s}}, d[2] = {{0, -s, s}, {0, s, s}},
               e[2] = {{-s, -s, s}, {-s, s, s}};
    const vec3 *wedge[2][3] = {{a, b, c}, {a, d, e}};
    form_open(&form);
    for (int k = 0; k < 2; k++) {
        const vec3 **w = wedge[k];
        form_add(&form, w[0][0], w[1][0], w[2][0]);
        form_add(&form, w[0][1], w[2][1], w[1][1]);
        for (int i = 0; i < 3; i++)
            form_add_quad(&form, w[i][0], w[i][1], w[(i + 1) % 3][1], w[(i + 1) % 3][0]);
    }
    form_unite(&form, &heard);
    ck_assert_msg(heard.count == 0, "%s", heard.said[0]);
    const struct mill_reach places = {{-1.0, -1.0, -1.0}, {1.0, 1.0, 1.0}, INFINITY};
    struct mill_shape *shape = lone_shape(&mill_facets_solid, &form.is, NULL, &places);
    for (int k = 1; k < 72; k++) {
        const double to = 2.0 * PI * k / 72.0;
        const bool within = (k > 0 && k < 9) || (k > 18 && k < 27);
        const double gap =
            gap_of(shape, vec3_make(0.01 * cos(to), 0.001, 0.01 * sin(to)), 0.0, 0.0);
        if (k % 9 != 0)
            ck_assert_msg((gap < 0.0) == within, "%d degrees: %g", 5 * k, gap);
    }
    lone_shape_free(shape);
}

/* ---- rooms ---- */

TEST(a_cavity_of_a_body_is_left_out_and_its_volume_is_told)
{
    open_cube(30.0);
    add_box(vec3_make(1.0, 0.0, 0.0), cube(20.0), true);
    add_box(vec3_make(1.0, 0.0, 0.0), cube(10.0), false); /* a solid in it */
    expect_left(12, 27000.0);
    ck_assert_double_eq_tol(1e9 * heard.found.closed, 7000.0, 1e-6);
    open_cube(30.0);
    add_box(nought, cube(20.0), false);
    add_box(nought, cube(10.0), true); /* filled by the outer cube */
    expect_left(12, 27000.0);
    ck_assert_double_eq(heard.found.closed, 0.0);
}

/* Given by its inner surface, or as a solid with an outer one too; its pockets and islands */
LOOP_TEST(a_container_is_the_largest_room_of_its_mesh, 4)
{
    open_cube(_i == 0 ? 40.0 : 50.0);
    if (_i > 0)
        add_box(nought, cube(40.0), true);
    if (_i == 2)
        add_box(vec3_make(0.0, 0.0, 22.0), cube(2.0), true); /* in the wall */
    if (_i == 3)
        add_box(nought, cube(10.0), false); /* in the room */
    form.is.inside = true;
    expect_left(_i == 3 ? 24 : 12, _i == 3 ? 63000.0 : 64000.0);
    ck_assert_int_eq(heard.found.hollow, _i > 0);
    ck_assert_double_eq_tol(1e9 * heard.found.closed, _i == 2 ? 8.0 : 0.0, 1e-6);
}

TEST(a_container_around_a_small_island_keeps_both)
{
    open_cube(50.0);
    add_box(nought, cube(20.0), true);
    add_box(vec3_make(100.0, 0.0, 0.0), cube(10.0), false);
    form.is.inside = true;
    expect_left(24, 117000.0);
    ck_assert(!heard.found.hollow);
    ck_assert_double_eq_tol(1e9 * heard.found.closed, 1000.0, 1e-6);
}

/* ---- faults ---- */

TEST(every_fault_is_told_by_the_numbers_of_its_facets_and_its_place)
{
    uint64_t seed = 71;
    form_lump(&seed, &form, 12, 6, 0.05, 0.3);
    other = form;
    expect_left(form.is.facets, volume_left());
    turn(20);
    expect_faults(1, "facets turned over along 3 edges, beside facet 21 at (");
    restore();
    form.facet[30][0].x += 1e-9; /* a crack */
    expect_faults(1, "not closed");
    restore();
    form.is.facets -= 2;
    expect_faults(1, "not closed: a hole along 4 edges, beside facet");
    restore();
    form.facet[7][2] = form.facet[7][1];
    form_unite(&form, &heard);
    ck_assert_ptr_nonnull(strstr(heard.said[0], "facet 8 has no area at ("));
    restore();
    for (size_t k = 0; k < form.is.facets; k++)
        turn(k);
    expect_faults(1, "facet 1, and all that");
    ck_assert_ptr_nonnull(strstr(heard.said[0], "face into their solid at ("));
    restore();
    form.facet[3][1].y = (double)NAN;
    expect_faults(1, "finite");
    restore();
    form.is.facets = 3;
    expect_faults(1, "at least 4");
    restore();
    form_add(&form, form.facet[0][0], form.facet[0][1], form.facet[0][2]);
    expect_faults(1, "an odd number of facets");
}

TEST(all_faults_of_a_mesh_are_told_at_once_in_the_unit_of_its_file)
{
    open_cube(20.0);
    add_box(vec3_make(19.0, 3.0, 1.0), cube(20.0), false); /* crosses */
    add_box(vec3_make(60.0, 0.0, 0.0), cube(20.0), false);
    turn(24);
    form.is.facets--;
    expect_faults(4, "not closed: a hole along 3 edges, beside facet 25 at (50, ");
    ck_assert_ptr_nonnull(strstr(heard.said[1], "facets turned over"));
    ck_assert_ptr_nonnull(strstr(heard.said[2], "cross at (9, "));
}

TEST(twenty_faults_are_told_and_all_are_counted)
{
    form_open(&form);
    for (int k = 0; k < 50; k++) {
        add_box(vec3_make(30.0 * k, 0.0, 0.0), cube(20.0), false);
        form.is.facets--;
    }
    expect_faults(50, "a hole along 3 edges");
    ck_assert_int_eq(heard.count, MILL_FACETS_TOLD);
}

TEST(solids_that_cross_are_told)
{
    open_cube(20.0);
    add_box(vec3_make(19.0, 3.0, 1.0), cube(20.0), false);
    expect_faults(2, "cross at ("); /* sides of either go through the other */
    open_cube(20.0);
    add_box(vec3_make(0.0, 0.0, 10.0), vec3_make(2.0, 2.0, 100.0), false);
    form_unite(&form, &heard); /* a rod right through it */
    ck_assert_ptr_nonnull(strstr(heard.said[0], "cross at ("));
    /* two tetrahedra of which no facet has its middle outside of the other one */
    form_open(&form);
    const vec3 c[8] = {at(-9, -9, -9), at(9, -9, -9), at(-9, 9, -9), at(9, 9, -9),
                       at(-9, -9, 9),  at(9, -9, 9),  at(-9, 9, 9),  at(9, 9, 9)};
    static const int facet[8][3] = {{0, 3, 5}, {0, 6, 3}, {0, 5, 6}, {3, 6, 5},
                                    {1, 4, 2}, {1, 2, 7}, {1, 7, 4}, {2, 4, 7}};
    for (int k = 0; k < 8; k++)
        form_add(&form, vec3_scale(c[facet[k][0]], k < 4 ? 1.2 : 1.0),
                 vec3_scale(c[facet[k][1]], k < 4 ? 1.2 : 1.0),
                 vec3_scale(c[facet[k][2]], k < 4 ? 1.2 : 1.0));
    form_unite(&form, &heard);
    ck_assert_msg(strstr(heard.said[0], "cross at ("), "%s", heard.said[0]);
}

/* Divides an edge between two places [mm] in the middle. */
static void divide(vec3 a, vec3 b)
{
    const vec3 one = vec3_scale(a, 1e-3), two = vec3_scale(b, 1e-3);
    const vec3 middle = vec3_scale(vec3_add(one, two), 0.5);
    const size_t facets = form.is.facets;
    for (size_t k = 12; k < facets; k++)
        for (int i = 0; i < 3; i++) {
            vec3 *p = form.facet[k], from = p[i], to = p[(i + 1) % 3], top = p[(i + 2) % 3];
            const bool is = vec3_norm(vec3_sub(from, one)) + vec3_norm(vec3_sub(to, two)) < 1e-12;
            const bool back = vec3_norm(vec3_sub(to, one)) + vec3_norm(vec3_sub(from, two)) < 1e-12;
            if (!is && !back)
                continue;
            p[(i + 1) % 3] = middle;
            form_add(&form, middle, to, top);
            break;
        }
}

TEST(equal_faces_with_other_edges_are_told)
{
    open_cube(20.0);
    add_box(vec3_make(20.0, 0.0, 0.0), cube(20.0), false);
    divide(vec3_make(10.0, -10.0, 10.0), vec3_make(10.0, 10.0, 10.0));
    expect_faults(1, "solids touch without common edges along 3 edges");
}

/* A wedge that stands on a face with its edge */
TEST(a_face_that_is_touched_by_an_edge_stays)
{
    open_cube(20.0);
    const vec3 a[2] = {at(-3, 1, 10), at(4, 2, 10)}, b[2] = {at(-3, 4, 15), at(4, 5, 15)},
               c[2] = {at(-3, -4, 15), at(4, -5, 15)};
    form_add(&form, a[0], c[0], b[0]);
    form_add(&form, a[1], b[1], c[1]);
    form_add_quad(&form, a[0], b[0], b[1], a[1]);
    form_add_quad(&form, b[0], c[0], c[1], b[1]);
    form_add_quad(&form, c[0], a[0], a[1], c[1]);
    expect_left(20, volume_left());
}

/* All sides go through edges of the other solid, or through none. */
LOOP_TEST(solids_that_cross_at_edges_are_told, 2)
{
    open_cube(20.0);
    if (_i == 0) /* along a diagonal of space: all sides meet diagonals of faces */
        add_box(cube(8.0), cube(20.0), false);
    if (_i == 1) { /* a rod with edges around it in the plane of the face */
        add_box(vec3_make(5.0, 1.0, 2.0), vec3_make(10.0, 5.0, 5.0), false);
        add_box(vec3_make(20.0, 1.0, 2.0), vec3_make(20.0, 5.0, 5.0), false);
    }
    form_unite(&form, &heard);
    ck_assert_int_gt(heard.count, 0);
    ck_assert_msg(strstr(heard.said[0], "cross at ("), "%s", heard.said[0]);
}

/* No edge of the union is one of the facets there: that is refused, not guessed. */
LOOP_TEST(solids_that_touch_over_part_of_a_face_are_told, 3)
{
    open_cube(20.0);
    if (_i == 0) /* a pin on a disc */
        add_box(vec3_make(0.0, 0.0, 20.0), vec3_make(5.0, 5.0, 20.0), false);
    if (_i == 1) /* two that are shifted, no facet's middle is covered */
        add_box(vec3_make(19.0, 19.0, 20.0), cube(20.0), false);
    if (_i == 2) /* they face the same way */
        add_box(vec3_make(18.0, 0.0, 0.0), cube(20.0), false);
    form_unite(&form, &heard);
    ck_assert_int_gt(heard.count, 0);
    ck_assert_msg(strstr(heard.said[0], "lie on each other in part at ("), "%s", heard.said[0]);
}

TEST(a_part_that_faces_inwards_has_to_be_a_cavity)
{
    open_cube(20.0);
    add_box(vec3_make(30.0, 0.0, 0.0), cube(10.0), true);
    expect_faults(
        1, "facet 13, and all that hang together with it, face into their solid at (25, -5, -5)");
}

/* ---- n log n ---- */

/* A cylinder whose ends are fans of needles, around the middle or a corner of the rim */
static void open_fan(int n, bool rim, double tilt)
{
    form_open(&form);
    const struct mill_heading way = mill_elementary_heading(tilt);
    for (int k = 0; k < n; k++) {
        vec3 p[6];
        for (int i = 0; i < 6; i++) {
            const double to = 2.0 * PI * ((k + i % 2) % n) / n, z = i / 2 % 2 ? 0.01 : -0.01;
            const double x = i < 4 ? 0.02 * cos(to)
                             : rim ? 0.02
                                   : 0.0,
                         y = i < 4 ? 0.02 * sin(to) : 0;
            const double up = i == 4 ? -0.01 : i == 5 ? 0.01 : z;
            p[i] = vec3_make((double)(float)(x * way.cos - up * way.sin), (double)(float)y,
                             (double)(float)(x * way.sin + up * way.cos));
        }
        form_add_quad(&form, p[0], p[1], p[3], p[2]);
        if (!rim || (k > 0 && k < n - 1)) {
            form_add(&form, p[4], p[1], p[0]);
            form_add(&form, p[5], p[2], p[3]);
        }
    }
}

/* Visits of facets by the lines along all sides */
static size_t visits_of_sides(void)
{
    struct mill_facets_joints joints = {0};
    struct mill_facets_tree tree = {0};
    size_t visits = 0;
    const size_t n = form.is.facets;
    int32_t *hub = malloc(n * sizeof *hub);
    ck_assert(mill_facets_join(form.is.facet, n, &joints));
    for (size_t k = 0; k < n; k++) /* of the ends' facets it is the middle or the corner */
        hub[k] = joints.corner[k][0];
    ck_assert(mill_facets_plant(form.is.facet, n, &tree));
    ck_assert(mill_facets_dress(&tree, form.is.facet, hub));
    for (size_t k = 0; k < joints.edges; k++) {
        const struct mill_facets_edge *e = &joints.edge[k];
        const vec3 *p = form.is.facet[e->facet];
        struct mill_facets_line line = {.tree = &tree,
                                        .from = p[e->side],
                                        .way = vec3_sub(p[(e->side + 1) % 3], p[e->side]),
                                        .skip = {e->low, e->high}};
        while (mill_facets_line_on(&line) >= 0)
            visits++;
    }
    mill_facets_fell(&tree);
    mill_facets_part(&joints);
    free(hub);
    return visits;
}

LOOP_TEST(the_sides_of_a_fan_meet_few_of_its_needles, 4)
{
    const bool rim = _i % 2;
    const double tilt = _i / 2 * 0.3;
    open_fan(300, rim, tilt);
    const double few = (double)visits_of_sides() / (double)form.is.facets;
    open_fan(4000, rim, tilt);
    const double many = (double)visits_of_sides() / (double)form.is.facets;
    ck_assert_double_lt(many, 60.0);
    ck_assert_double_lt(many, 3.0 * few);
}

/* The boxes along long facets leave out none that is nearest. */
TEST(the_nearest_of_thousands_of_needles_is_found)
{
    uint64_t seed = 81;
    const struct mill_reach places = {{-1.0, -1.0, -1.0}, {1.0, 1.0, 1.0}, INFINITY};
    open_fan(4000, false, 0.3);
    struct mill_shape *s = lone_shape(&mill_facets_solid, &form.is, NULL, &places);
    for (int i = 0; i < 20; i++) {
        const vec3 p = vec3_scale(direction(&seed), uniform(&seed, 0.0, 0.03));
        ck_assert_double_eq_tol(gap_of(s, p, 0.0, 0.0),
                                (double)wide_from_mesh(&form.is, wide_of(p)), 1e-12);
    }
    lone_shape_free(s);
}

int main(void)
{
    return unit_run("shells");
}
