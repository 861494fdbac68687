/* What shapes draw: triangles on their true surfaces, seen from the balls' side, without gaps. One
 * contract for all kinds, checked with the gap and the contact that the event loop uses. */
#include "mesh_fixture.h"
#include "observe/outline.h"
#include "wavy_fixture.h"

#define MANY 40

#define TOLERANCE (1e-3 * R) /* [m] */

static struct mill_mesh drawn(const struct mill_shape *shape)
{
    struct mill_mesh mesh = {0};
    mill_outline_draw(shape, TOLERANCE, &mesh);
    ck_assert(!mesh.failed && mesh.triangles > 0);
    return mesh;
}

/* ---- the mills that are looked at ---- */

/* A round drum, then wavy ones; the blade at any angle and pitch */
static void build_mill(uint64_t *seed, int which, struct mill *mill)
{
    const struct mill_blade blade = {.position = uniform(seed, -0.03, 0.03),
                                     .angle = uniform(seed, -4.0, 4.0),
                                     .tip_radius = 0.06,
                                     .width = 0.012,
                                     .thickness = 0.007,
                                     .pitch = uniform(seed, -2.0, 2.0)};
    struct wavy_mill wavy;
    if (which == 0) {
        mill_build(mill, &blade, 0.0, 0.0);
        return;
    }
    build_random_with(seed, &wavy, &blade);
    *mill = wavy.mill;
}

TEST(corners_lie_on_the_surface_and_flats_within_the_tolerance)
{
    uint64_t seed = 1;
    for (int which = 0; which < MANY; which++) {
        struct mill mill;
        build_mill(&seed, which, &mill);
        for (int k = 0; k < SHAPES; k++) {
            const struct mill_shape *shape = mill.shape[k];
            struct mill_mesh mesh = drawn(shape);
            for (size_t i = 0; i < mesh.points; i++) {
                if (k == SHAFT && mesh.point[i].y == 0.0 && mesh.point[i].z == 0.0)
                    continue; /* the middle of its ends, which no ball meets */
                ck_assert_double_le(fabs(gap_of(shape, mesh.point[i], 0.0, 0.0)), 1e-15);
            }
            for (size_t t = 0; t < mesh.triangles; t++) {
                const vec3 a = corner(&mesh, t, 0), b = corner(&mesh, t, 1);
                const vec3 c = corner(&mesh, t, 2);
                const vec3 spot[4] = {vec3_scale(vec3_add(a, vec3_add(b, c)), 1.0 / 3.0),
                                      vec3_scale(vec3_add(a, b), 0.5),
                                      vec3_scale(vec3_add(b, c), 0.5),
                                      vec3_scale(vec3_add(c, a), 0.5)};
                if (k == SHAFT && fabs(fabs(spot[0].x) - 0.5 * drum_length) < 1e-12)
                    continue; /* nor these */
                if (k == BLADE)
                    continue; /* between its corners a box is flat: its volume tells */
                for (int i = 0; i < 4; i++)
                    ck_assert_double_le(fabs(gap_of(shape, spot[i], 0.0, 0.0)),
                                        TOLERANCE * (1.0 + 1e-9));
            }
            mill_mesh_free(&mesh);
        }
        mill_demolish(&mill);
    }
}

TEST(every_triangle_faces_the_balls)
{
    uint64_t seed = 2;
    for (int which = 0; which < MANY; which++) {
        struct mill mill;
        build_mill(&seed, which, &mill);
        for (int k = 0; k < SHAPES; k++) {
            struct mill_mesh mesh = drawn(mill.shape[k]);
            for (size_t t = 0; t < mesh.triangles; t++) {
                const vec3 n = facing(&mesh, t);
                const double area = vec3_norm(n);
                vec3 at = vec3_add(corner(&mesh, t, 0),
                                   vec3_add(corner(&mesh, t, 1), corner(&mesh, t, 2)));
                if (area < 1e-13) /* a sliver faces nowhere */
                    continue;
                at = vec3_axpy(vec3_scale(at, 1.0 / 3.0), 1e-9 / area, n);
                const bool end = k == SHAFT && fabs(at.x) > 0.5 * drum_length;
                const vec3 expected = end ? vec3_make(at.x > 0.0 ? 1.0 : -1.0, 0.0, 0.0)
                                          : contact_of(mill.shape[k], at, 0.0, 0.0).normal;
                ck_assert_double_ge(vec3_dot(n, expected) / area, 0.985);
            }
            mill_mesh_free(&mesh);
        }
        mill_demolish(&mill);
    }
}

TEST(drum_and_end_walls_enclose_the_chamber)
{
    uint64_t seed = 3;
    for (int which = 0; which < MANY; which++) {
        struct mill mill;
        build_mill(&seed, which, &mill);
        struct mill_mesh mesh[3];
        double enclosed = 0.0;
        for (int k = 0; k < 3; k++) {
            mesh[k] = drawn(mill.shape[DRUM + k]);
            enclosed -= enclosed_by(&mesh[k]); /* seen from within */
        }
        assert_closed(mesh, 3);
        /* chords between points of arcs that bulge outwards and inwards: off either way */
        const double exact = mill.shape[DRUM]->solid->volume(mill_body_is(mill.shape[DRUM]));
        ck_assert_double_le(fabs(enclosed - exact), 4e-3 * exact);
        for (int k = 0; k < 3; k++)
            mill_mesh_free(&mesh[k]);
        mill_demolish(&mill);
    }
}

TEST(an_end_wall_has_no_folds)
{
    uint64_t seed = 4;
    for (int which = 0; which < 3 * MANY; which++) {
        struct mill mill;
        build_mill(&seed, which, &mill);
        for (int k = WALL_0; k <= WALL_1; k++) {
            struct mill_mesh mesh = drawn(mill.shape[k]);
            const double side = k == WALL_0 ? 1.0 : -1.0;
            for (size_t t = 0; t < mesh.triangles; t++)
                ck_assert_double_ge(side * facing(&mesh, t).x, -1e-17);
            mill_mesh_free(&mesh);
        }
        mill_demolish(&mill);
    }
}

TEST(shaft_and_blade_are_closed_bodies_of_their_volume)
{
    uint64_t seed = 5;
    for (int which = 0; which < MANY; which++) {
        struct mill mill;
        build_mill(&seed, which, &mill);
        const double rod = PI * shaft_radius * shaft_radius * drum_length;
        struct mill_mesh shaft = drawn(mill.shape[SHAFT]);
        struct mill_mesh blade = drawn(mill.shape[BLADE]);
        assert_closed(&shaft, 1);
        assert_closed(&blade, 1);
        ck_assert_double_le(fabs(enclosed_by(&blade) - 0.06 * 0.012 * 0.007), 1e-18);
        ck_assert(enclosed_by(&shaft) < rod && enclosed_by(&shaft) > 0.98 * rod);
        mill_mesh_free(&shaft);
        mill_mesh_free(&blade);
        mill_demolish(&mill);
    }
}

TEST(a_finer_tolerance_means_more_and_smaller_flats)
{
    const struct mill_body circle =
        mill_setup_drum_body(&(struct mill_setup_drum){.radius = R, .length = 0.12});
    double before = INFINITY;
    for (double tolerance = 1e-3; tolerance > 1e-9; tolerance *= 0.1) {
        struct mill_mesh mesh = {0};
        double off = 0.0;
        mill_prism_solid.outline(&circle, 0, tolerance, &mesh);
        for (size_t t = 0; t < mesh.triangles; t++) {
            for (int k = 0; k < 3; k++) {
                const vec3 at =
                    vec3_scale(vec3_add(corner(&mesh, t, k), corner(&mesh, t, (k + 1) % 3)), 0.5);
                off = fmax(off, R - sqrt(at.y * at.y + at.z * at.z));
            }
        }
        ck_assert_double_le(off, fmin(tolerance, 0.01 * R) * (1.0 + 1e-9));
        ck_assert_double_lt(off, before);
        before = off;
        mill_mesh_free(&mesh);
    }
}

/* Both arcs are nearer to their chord, which is the same line, than the tolerance. */
TEST(a_contour_of_two_flat_arcs_is_a_closed_body_too)
{
    static const double bulge[][2] = {{0.0, 2e-4}, {2e-4, -1e-4}, {1e-4, -9e-5}, {1e-12, 0.0}};
    for (int k = 0; k < 4; k++) {
        const struct mill_corner line[2] = {{0.05, 0.0, bulge[k][0]}, {-0.05, 0.0, bulge[k][1]}};
        const struct mill_body is = {.x = {1.0, 0.0, 0.0},
                                     .y = {0.0, 1.0, 0.0},
                                     .z = {0.0, 0.0, 1.0},
                                     .length = 0.06,
                                     .corner = line,
                                     .corners = 2};
        struct mill_mesh mesh = {0};
        mill_contour_solid.outline(&is, MILL_SOLID_WHOLE, TOLERANCE, &mesh);
        ck_assert(!mesh.failed);
        assert_closed(&mesh, 1);
        ck_assert_double_gt(enclosed_by(&mesh), 0.0);
        mill_mesh_free(&mesh);
    }
}

TEST(the_outline_tells_what_turns_and_names_every_triangle)
{
    uint64_t seed = 6;
    struct mill mill;
    build_mill(&seed, 0, &mill);
    struct mill_world world = {.container.radius = R, .shapes = SHAPES, .shape = mill.shape};
    mill_kinds_init(&world.kinds);
    struct mill_outline still, turning;
    ck_assert(mill_outline_make(&world, NULL, &still));
    ck_assert(mill_outline_make(&world, mill.rotor, &turning));
    size_t of_kind[MILL_KINDS] = {0};
    for (size_t t = 0; t < still.mesh.triangles; t++) {
        const double x = corner(&still.mesh, t, 0).x;
        const bool flat = corner(&still.mesh, t, 1).x == x && corner(&still.mesh, t, 2).x == x;
        ck_assert_int_eq(still.kind[t], flat ? MILL_BALL_WALL : MILL_BALL_DRUM);
        ck_assert_int_eq(still.number[t], flat ? x > 0.0 : -1);
        of_kind[still.kind[t]]++;
    }
    for (size_t t = 0; t < turning.mesh.triangles; t++) {
        ck_assert_int_eq(turning.number[t], turning.kind[t] == MILL_BALL_BLADE ? 0 : -1);
        of_kind[turning.kind[t]]++;
    }
    ck_assert_uint_eq(of_kind[MILL_BALL_BLADE], 12);
    ck_assert(of_kind[MILL_BALL_SHAFT] > 60 && of_kind[MILL_BALL_DRUM] > 100);
    ck_assert_uint_eq(of_kind[MILL_BALL_DRUM], of_kind[MILL_BALL_WALL]);
    mill_outline_free(&still);
    mill_outline_free(&turning);
    mill_demolish(&mill);
}

TEST(without_a_rotor_nothing_turns)
{
    uint64_t seed = 7;
    struct mill mill;
    struct mill_outline turning;
    build_mill(&seed, 0, &mill);
    struct mill_world world = {.container.radius = R, .shapes = SHAFT, .shape = mill.shape};
    ck_assert(mill_outline_make(&world, mill.rotor, &turning));
    ck_assert_uint_eq(turning.mesh.triangles, 0);
    mill_outline_free(&turning);
    mill_demolish(&mill);
}

int main(void)
{
    return unit_run("outline");
}
