/* All places at which a ball overlaps a surface at once: one for each wall that it presses, however
 * many facets or arcs these have. */
#include "facets_fixture.h"
#include "wavy_fixture.h"

enum { MOST = 8 };

static struct form form;
static const struct mill_reach everywhere = {{-1.0, -1.0, -1.0}, {1.0, 1.0, 1.0}, INFINITY};
static const double side = 0.02, radius = 0.003, deep = 1e-4; /* [m] */

/* A cube on a random place, with every flat side cut into two facets */
static struct mill_shape *open_cube(uint64_t *seed, bool inside)
{
    form_open(&form);
    form_add_box(&form, nought, vec3_make(side, side, side));
    place_body(seed, &form.is);
    form.is.inside = inside;
    struct mill_shape *shape = lone_shape(&mill_facets_solid, &form.is, NULL, &everywhere);
    ck_assert_ptr_nonnull(shape);
    return shape;
}

/* From the cube's own frame */
static vec3 out(vec3 own)
{
    const struct mill_body *b = &form.is;
    return vec3_add(b->centre,
                    vec3_axpy(vec3_axpy(vec3_scale(b->x, own.x), own.y, b->y), own.z, b->z));
}

/* The places of a ball at this place of the cube's own frame, inside of it or outside */
static int places(bool inside, vec3 own, struct mill_contact *c)
{
    uint64_t seed = 7;
    struct mill_shape *cube = open_cube(&seed, inside);
    const int count = mill_shape_places(cube, out(own), radius, &mill_pose_still, c, MOST);
    lone_shape_free(cube);
    return count;
}

/* [m] of a ball's centre from the middle of the cube, if it is pressed into a wall from inside */
static double pressed(void)
{
    return 0.5 * side - radius + deep;
}

TEST(in_an_inner_corner_a_ball_has_three_places)
{
    struct mill_contact c[MOST];
    for (int corner = 0; corner < 8; corner++) {
        const vec3 to =
            vec3_make(corner & 1 ? 1.0 : -1.0, corner & 2 ? 1.0 : -1.0, corner & 4 ? 1.0 : -1.0);
        ck_assert_int_eq(places(true, vec3_scale(to, pressed()), c), 3);
        for (int k = 0; k < 3; k++) {
            ck_assert_double_eq_tol(c[k].gap, -deep, 1e-14);
            for (int j = 0; j < k; j++)
                ck_assert_double_eq_tol(vec3_dot(c[k].normal, c[j].normal), 0.0, 1e-12);
        }
    }
}
END_TEST

TEST(at_an_inner_edge_a_ball_has_two_places)
{
    struct mill_contact c[MOST];
    ck_assert_int_eq(places(true, vec3_make(pressed(), -pressed(), 0.002), c), 2);
    ck_assert_double_eq_tol(vec3_dot(c[0].normal, c[1].normal), 0.0, 1e-12);
    /* pressed into one of the two only: the other one is not near enough */
    ck_assert_int_eq(places(true, vec3_make(pressed(), 2.0 * deep - pressed(), 0.002), c), 1);
}
END_TEST

/* The seam is the diagonal that cuts each side into facets. */
LOOP_TEST(on_a_flat_seam_a_ball_has_one_place, 2)
{
    const bool inside = _i == 0;
    const double at = inside ? pressed() : 0.5 * side + radius - deep;
    uint64_t seed = 9;
    for (int k = 0; k < 50; k++) {
        struct mill_contact c[MOST];
        const double along = uniform(&seed, -0.006, 0.006);
        const double across = k % 2 ? 0.0 : uniform(&seed, -1e-3, 1e-3); /* or beside it */
        const double sign = k % 4 < 2 ? 1.0 : -1.0; /* of the two diagonals, one is the seam */
        ck_assert_int_eq(places(inside, vec3_make(along + across, sign * along, at), c), 1);
        ck_assert_double_eq_tol(c[0].gap, -deep, 1e-14);
    }
}
END_TEST

/* A ball that leans over an edge or a corner by so much that it is there that it is nearest */
TEST(at_an_outer_edge_and_at_an_outer_corner_a_ball_has_one_place)
{
    struct mill_contact c[MOST];
    const double edge = 0.5 * side + (radius - deep) / sqrt(2.0),
                 corner = 0.5 * side + (radius - deep) / sqrt(3.0);
    ck_assert_int_eq(places(false, vec3_make(edge, -edge, 0.001), c), 1);
    ck_assert_double_eq_tol(c[0].gap, -deep, 1e-14);
    ck_assert_int_eq(places(false, vec3_make(corner, corner, -corner), c), 1);
    ck_assert_double_eq_tol(c[0].gap, -deep, 1e-14);
    /* above the flat side just beside the edge, the edge counts for nothing */
    ck_assert_int_eq(
        places(false, vec3_make(0.5 * side - 1e-5, 0.5 * side + radius - deep, 0.0), c), 1);
    ck_assert_double_eq_tol(c[0].gap, -deep, 1e-14);
}
END_TEST

/* As many as there is room for, and where it overlaps nothing, the nearest one */
TEST(a_free_ball_has_the_nearest_place_and_no_more_are_told_than_asked_for)
{
    uint64_t seed = 7;
    struct mill_shape *cube = open_cube(&seed, true);
    struct mill_contact c[MOST];
    const double p = pressed();
    ck_assert_int_eq(
        mill_shape_places(cube, out(vec3_make(p, p, p)), radius, &mill_pose_still, c, 2), 2);
    ck_assert_int_eq(
        mill_shape_places(cube, out(vec3_make(0.001, 0.0, 0.0)), radius, &mill_pose_still, c, MOST),
        1);
    ck_assert_double_eq_tol(c[0].gap, 0.5 * side - 0.001 - radius, 1e-14);
    lone_shape_free(cube);
}
END_TEST

/* The first of them is the nearest one, which `contact` gives. */
TEST(the_places_of_a_lump_are_apart_overlap_and_include_the_nearest_one)
{
    uint64_t seed = 21;
    int several = 0;
    for (int round = 0; round < unit_draws(60); round++) {
        form_lump(&seed, &form, 5, 3, 0.02, 0.5);
        place_body(&seed, &form.is);
        form.is.inside = round % 2;
        struct mill_shape *lump = lone_shape(&mill_facets_solid, &form.is, NULL, &everywhere);
        for (int k = 0; k < 100; k++) {
            struct mill_contact c[MOST];
            vec3 place = vec3_axpy(form.is.centre, uniform(&seed, 0.0, 0.03), direction(&seed));
            const struct mill_contact near =
                lump->type->contact(lump, place, radius, &mill_pose_still);
            place = vec3_axpy(place, -near.gap - uniform(&seed, 0.0, deep), near.normal);
            const struct mill_contact own =
                lump->type->contact(lump, place, radius, &mill_pose_still);
            if (own.gap >= 0.0 || own.gap < -0.9 * radius)
                continue; /* it is another facet's now */
            const int count = mill_shape_places(lump, place, radius, &mill_pose_still, c, MOST);
            double least = INFINITY;
            several += count > 1;
            for (int a = 0; a < count; a++) {
                least = fmin(least, c[a].gap);
                ck_assert_double_lt(c[a].gap, 0.0);
                for (int b = 0; b < a; b++)
                    ck_assert_double_gt(vec3_norm(vec3_sub(c[a].point, c[b].point)), 1e-9);
            }
            ck_assert_double_eq_tol(least, own.gap, 1e-13);
        }
        lone_shape_free(lump);
    }
    ck_assert_int_gt(several, 20);
}
END_TEST

/* ---- the wavy drum ---- */

/* Five buckles: a valley where the wall is far out, a crest where it is near the axis. A ball with
 * a larger radius than the valley's arc touches both of its flanks. */
TEST(a_ball_that_does_not_fit_into_a_valley_has_two_places_and_one_that_fits_has_one)
{
    struct wavy_mill m;
    struct mill_contact c[MOST];
    build(&m, 24, 0.004, 0.0);
    const double arc = m.profile.arc;
    for (int k = 0; k < 2; k++) {
        const double r = k ? 1.3 * arc : 0.7 * arc;
        double low = 0.0, high = R + m.profile.height; /* of a ball that goes along +y: arc 0 */
        while (high - low > 1e-13) {
            const double y = 0.5 * (low + high);
            if (wall_gap(&m, vec3_make(0.0, y, 0.0), r) > -deep)
                low = y;
            else
                high = y;
        }
        const int count =
            mill_shape_places(m.drum, vec3_make(0.0, high, 0.0), r, &mill_pose_still, c, MOST);
        ck_assert_int_eq(count, k ? 2 : 1);
        for (int at = 0; at < count; at++)
            ck_assert_double_eq_tol(c[at].gap, -deep, 1e-9);
        if (k)
            ck_assert_double_eq_tol(c[0].normal.z, -c[1].normal.z, 1e-6);
    }
    mill_demolish(&m.mill);
}
END_TEST

int main(void)
{
    return unit_run("places");
}
