/* Claims about the facets of the surfaces: areas, places, and sums that lose nothing. */
#include "base/elementary.h"
#include "millsim/start.h"
#include "observe/wear.h"

#include "mills.h"
#include "unit.h"

static struct mill_world *world;
static struct mill_wear_plan plan;
static struct mill_sums sums;

static void setup(void)
{
    const struct mill_body shaft = mill_setup_shaft(0.015, 0.12);
    const struct mill_body blade =
        mill_setup_blade(&(struct mill_blade){0.01, 0.4, 0.067, 0.012, 0.007, 0.3});
    const struct mill_turn turn = {.axis = {1, 0, 0}, .speed = 100};
    const struct mill_setup_motion motion = {&mill_turn_type, &turn, MILL_STILL, "rotor"};
    const struct mill_setup_surface surface[] = {shaft_surface(&shaft), blade_surface(&blade, 0)};
    const struct mill_setup_balls balls = {"balls", 0.005, 7800, 1};
    const struct mill_setup_ball start = {.position = {-0.03, 0, 0.05}};
    const struct mill_setup mill = {.drum = {.radius = 0.075, .length = 0.12},
                                    .motions = 1,
                                    .motion = &motion,
                                    .surfaces = 2,
                                    .surface = surface,
                                    .species = 1,
                                    .balls = &balls,
                                    .start = &start};
    struct mill_fault fault;
    mill_start_world(&mill, NULL, &world, &fault);
    ck_assert_int_eq(fault.code, MILL_FAULT_NONE);
    ck_assert(mill_wear_facets_make(&plan, world));
    ck_assert(mill_sums_make(&sums, &mill_wear_sums, (size_t)plan.facets));
}

static void teardown(void)
{
    mill_sums_free(&sums);
    mill_wear_facets_free(&plan);
    mill_world_free(world);
}

/* The area of the facets of all parts of a kind of contact */
static double area_of(int kind)
{
    double area = 0;
    for (int32_t i = 0; i < plan.facets; i++)
        if (world->shape[plan.part[plan.facet[i].part].shape]->kind == kind)
            area += plan.facet[i].area;
    return area;
}

static int shape_of(int kind)
{
    int k = 0;
    while (world->shape[k]->kind != kind)
        k++;
    return k;
}

static struct mill_impact impact_at(int kind, vec3 place, vec3 facing)
{
    return (struct mill_impact){.kind = kind,
                                .surface = shape_of(kind),
                                .place = place,
                                .facing = facing,
                                .normal_speed = 2,
                                .tangential_speed = 3,
                                .dissipation = 0.5,
                                .dissipation_normal = 0.2,
                                .slid = true};
}

TEST(facets_have_the_area_of_their_surfaces)
{
    const double side = 2 * MILL_PI * 0.075 * 0.12, end = MILL_PI * 0.075 * 0.075;
    const double box = 2 * (0.067 * 0.012 + 0.067 * 0.007 + 0.012 * 0.007);
    ck_assert(fabs(area_of(MILL_BALL_DRUM) / side - 1) < 2e-3);
    ck_assert(fabs(area_of(MILL_BALL_WALL) / (2 * end) - 1) < 2e-3);
    ck_assert(fabs(area_of(MILL_BALL_BLADE) / box - 1) < 1e-9);
}

TEST(there_are_a_few_thousand_facets_and_no_slivers)
{
    ck_assert_int_gt(plan.facets, 1000);
    ck_assert_int_lt(plan.facets, 5000);
    for (int32_t i = 0; i < plan.facets; i++) {
        const double size = plan.part[plan.facet[i].part].cut;
        ck_assert(plan.facet[i].area > 0.1 * size * size);
        ck_assert(plan.facet[i].area < 4 * size * size);
    }
}

TEST(an_impact_is_counted_near_its_place_and_on_its_side)
{
    for (int k = 0; k < 1000; k++) {
        const struct mill_heading at = mill_elementary_heading(0.00628 * k);
        const vec3 place = {0.00011 * k - 0.055, 0.075 * at.cos, 0.075 * at.sin};
        const vec3 facing = {0, -at.cos, -at.sin};
        const struct mill_impact impact = impact_at(MILL_BALL_DRUM, place, facing);
        const struct mill_wear_sum *sum = mill_wear_facet(&plan, sums.record, &impact);
        ck_assert_ptr_nonnull(sum);
        const struct mill_wear_facet *facet =
            &plan.facet[sum - (struct mill_wear_sum *)sums.record];
        const double size = plan.part[facet->part].cut;
        ck_assert(vec3_norm(vec3_sub(facet->centre, place)) < 2 * size);
        ck_assert_int_eq(facet->face, 2); /* towards the axis */
    }
}

TEST(the_two_sides_of_a_blade_are_different_facets)
{
    const struct mill_wear_part *part = &plan.part[plan.part_of[shape_of(MILL_BALL_BLADE)]];
    const vec3 above = mill_pose_out(&part->chart, vec3_make(0, 0.02, 0.0035));
    const vec3 below = mill_pose_out(&part->chart, vec3_make(0, 0.02, -0.0035));
    const struct mill_impact leading = impact_at(MILL_BALL_BLADE, above, part->chart.z);
    const struct mill_impact trailing =
        impact_at(MILL_BALL_BLADE, below, vec3_scale(part->chart.z, -1));
    const struct mill_wear_sum *one = mill_wear_facet(&plan, sums.record, &leading);
    const struct mill_wear_sum *other = mill_wear_facet(&plan, sums.record, &trailing);
    ck_assert_int_eq(plan.facet[one - (struct mill_wear_sum *)sums.record].face, 5);
    ck_assert_int_eq(plan.facet[other - (struct mill_wear_sum *)sums.record].face, 4);
}

TEST(a_place_beside_the_surface_is_counted_on_the_nearest_facet)
{
    /* rounding can put a place on the wrong side of a corner, with any normal */
    const struct mill_impact impact =
        impact_at(MILL_BALL_DRUM, vec3_make(0.0600001, 0, 0.0750001), vec3_make(1, 0, 0));
    const struct mill_wear_sum *sum = mill_wear_facet(&plan, sums.record, &impact);
    ck_assert_ptr_nonnull(sum);
    ck_assert(fabs(plan.facet[sum - (struct mill_wear_sum *)sums.record].centre.x - 0.06) < 0.01);
}

TEST(sums_are_those_of_the_laws)
{
    const vec3 place = {0, 0, -0.075}, up = {0, 0, 1};
    struct mill_impact impact = impact_at(MILL_BALL_DRUM, place, up);
    struct mill_wear_sum *sum = mill_wear_facet(&plan, sums.record, &impact);
    const double mass = world->species[0].mass;
    mill_wear_impact(&plan, sum, &impact);
    ck_assert_uint_eq(sum->count, 1);
    ck_assert(sum->normal == 0.2 && sum->sliding == 0.5 - 0.2 && sum->slid == sum->sliding);
    /* Finnie: tan a = 2/3 > 1/3, so m v_t^2 / 3 */
    ck_assert(fabs(sum->carved / (mass * 3) - 1) < 1e-15);
    impact.normal_speed = 0.5; /* tan a = 1/6: m (2 v_n v_t - 3 v_n^2) */
    impact.slid = false;
    impact.lasting = true; /* not a new impact, but its losses count */
    mill_wear_impact(&plan, sum, &impact);
    ck_assert_uint_eq(sum->count, 1);
    ck_assert(fabs(sum->carved / (mass * (3 + 2.25)) - 1) < 1e-15);
    ck_assert(sum->slid == 0.5 - 0.2 && fabs(sum->sliding - 0.6) < 1e-15);
}

TEST(an_impact_of_two_balls_wears_nothing)
{
    const struct mill_impact impact = {.kind = MILL_BALL_BALL, .surface = -1};
    ck_assert_ptr_null(mill_wear_facet(&plan, sums.record, &impact));
}

TEST(triangles_of_pictures_show_all_facets_and_have_their_area)
{
    bool *seen = calloc((size_t)plan.facets, sizeof *seen);
    double area = 0;
    struct mill_mesh mesh;
    int32_t *facet;
    ck_assert(mill_wear_outline(&plan, &mesh, &facet));
    for (size_t i = 0; i < mesh.triangles; i++) {
        const int64_t *c = mesh.corner[i];
        const vec3 at[3] = {mesh.point[c[0]], mesh.point[c[1]], mesh.point[c[2]]};
        seen[facet[i]] = true;
        area += vec3_norm(mill_wear_pieces_area(at));
    }
    free(facet);
    mill_mesh_free(&mesh);
    for (int32_t i = 0; i < plan.facets; i++)
        ck_assert(seen[i]);
    ck_assert(fabs(area / plan.area - 1) < 1e-12);
    free(seen);
}

int main(void)
{
    return unit_run_in("wear", setup, teardown);
}
