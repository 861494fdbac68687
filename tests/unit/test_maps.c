/* Claims about the two maps of the mill. */
#include "geometry/body.h"
#include "mill_fixture.h"
#include "millsim/start.h"

static struct fixture f;
static struct mill_maps maps;
static struct mill_sums hits, flow; /* of the maps */

static struct mill_map_hits *hits_of(const struct mill_map *map)
{
    return (struct mill_map_hits *)hits.record + map->first;
}

static struct mill_map_flow *flow_of(const struct mill_sums *of, const struct mill_map *map)
{
    return (struct mill_map_flow *)of->record + map->first;
}

static void setup(void)
{
    fixture_init(&f);
    ck_assert(mill_maps_init(&maps, &f.world));
    ck_assert(mill_sums_make(&hits, &mill_maps_hits, maps.cells));
    ck_assert(mill_sums_make(&flow, &mill_maps_flow, maps.cells));
}

static void teardown(void)
{
    mill_sums_free(&hits);
    mill_sums_free(&flow);
    mill_maps_free(&maps);
}

static int cells(const struct mill_map *map)
{
    return map->n[0] * map->n[1];
}

static const struct mill_map_hits *hits_at(const struct mill_map *map,
                                           const struct mill_map_hits *of, double a, double b)
{
    return &of[mill_maps_place(map, 0, a) * map->n[1] + mill_maps_place(map, 1, b)];
}

TEST(cells_are_a_thirtieth_of_the_radius)
{
    ck_assert_int_eq(maps.cross.n[0], 60);
    ck_assert_int_eq(maps.cross.n[1], 60);
    ck_assert_int_eq(maps.axial.n[0], 48);
    ck_assert_int_eq(maps.axial.n[1], 30);
    ck_assert_double_eq_tol(maps.cross.size[0], 0.0025, 1e-15);
    ck_assert_double_eq_tol(maps.axial.size[0], 0.0025, 1e-15);
}

static void impact_at(const struct mill_maps *into, vec3 position, double speed, double loss)
{
    const struct mill_impact impact = {
        .position = position, .normal_speed = speed, .dissipation = loss};
    mill_maps_impact(into, hits.record, &impact, &impact.position);
}

TEST(a_flat_mill_has_four_slices_and_a_long_one_400)
{
    struct mill_maps other;
    f.world.drum_length = 0.001;
    ck_assert(mill_maps_init(&other, &f.world));
    ck_assert_int_eq(other.axial.n[0], 4);
    mill_maps_free(&other);
    f.world.drum_length = 100;
    ck_assert(mill_maps_init(&other, &f.world));
    ck_assert_int_eq(other.axial.n[0], 400);
    mill_maps_free(&other);
}

TEST(an_impact_is_counted_where_it_happens)
{
    impact_at(&maps, vec3_make(0.021, -0.03, 0.041), 1.5, 0.25);
    impact_at(&maps, vec3_make(0.021, -0.03, 0.041), 0.5, 0.5);
    const struct mill_map_hits *cross = hits_at(&maps.cross, hits_of(&maps.cross), -0.03, 0.041);
    const struct mill_map_hits *axial =
        hits_at(&maps.axial, hits_of(&maps.axial), 0.021, hypot(0.03, 0.041));
    ck_assert_uint_eq(cross->count, 2);
    ck_assert(cross->speed == 2);
    ck_assert(cross->dissipation == 0.75);
    ck_assert_uint_eq(axial->count, 2);
    ck_assert(axial->speed == 2);
    ck_assert(axial->dissipation == 0.75);
    ck_assert_int_eq(mill_maps_place(&maps.cross, 0, -0.03), (int)floor(0.045 / 0.0025));
}

TEST(impacts_on_the_walls_belong_to_the_cells_at_the_rim)
{
    impact_at(&maps, vec3_make(0.06, 0, 0.0750000001), 1, 0);
    impact_at(&maps, vec3_make(-0.0600000001, 0, -0.0750000001), 1, 0);
    ck_assert_uint_eq(hits_of(&maps.cross)[30 * 60 + 59].count, 1);
    ck_assert_uint_eq(hits_of(&maps.cross)[30 * 60 + 0].count, 1);
    ck_assert_uint_eq(hits_of(&maps.axial)[47 * 30 + 29].count, 1);
    ck_assert_uint_eq(hits_of(&maps.axial)[0 * 30 + 29].count, 1);
}

TEST(the_cells_make_up_the_drum)
{
    const double drum = PI * 0.075 * 0.075 * 0.12;
    double cross = 0, axial = 0;
    for (int i = 0; i < cells(&maps.cross); i++)
        cross += maps.room[i];
    for (int i = 0; i < cells(&maps.axial); i++)
        axial += maps.room[maps.axial.first + (size_t)i];
    ck_assert_double_eq_tol(cross / drum, 1, 1e-12);
    ck_assert_double_eq_tol(axial / drum, 1, 1e-12);
    ck_assert_double_eq_tol(maps.room[30 * 60 + 30], 0.0025 * 0.0025 * 0.12, 1e-18);
    ck_assert(maps.room[0] == 0);
}

/* A cell cut by the circle against fine sub-points */
TEST(a_cut_cell_has_the_area_inside_the_circle)
{
    const double *room = maps.room;
    enum { N = 1000 };
    for (int i = 0; i < 30; i += 3) {
        const int k =
            (int)((0.075 - sqrt(0.075 * 0.075 - pow(0.075 - (i + 0.5) * 0.0025, 2))) / 0.0025);
        int inside = 0;
        for (int p = 0; p < N; p++)
            for (int q = 0; q < N; q++)
                inside += hypot(-0.075 + (i + (p + 0.5) / N) * 0.0025,
                                -0.075 + (k + (q + 0.5) / N) * 0.0025) < 0.075;
        ck_assert_int_gt(inside, 0);
        ck_assert_int_lt(inside, N * N);
        ck_assert_double_eq_tol(room[i * 60 + k] / (0.0025 * 0.0025 * 0.12),
                                inside / (double)(N * N), 1e-4);
    }
}

/* A drum with four lobes, r = R + h cos(4 phi). Half the radial distance never passes the wall. */
static struct mill_contact lobes(const struct mill_shape *shape, vec3 p, double radius,
                                 const struct mill_pose *pose)
{
    (void)shape;
    (void)pose;
    const double wall = 0.075 + 0.004 * cos(4 * atan2(p.z, p.y));
    return (struct mill_contact){.gap = 0.5 * (wall - hypot(p.y, p.z)) - radius};
}

TEST(a_drum_that_is_no_circle_is_measured_by_its_gap)
{
    const struct mill_shape_type type = {.contact = lobes};
    struct mill_bodied wall = {.convex.base = {.type = &type, .kind = MILL_BALL_DRUM},
                               .is.inside = true};
    struct mill_shape *list[1] = {&wall.convex.base};
    struct mill_maps other;
    double cross = 0, axial = 0;
    f.world.shape = list;
    f.world.shapes = 1;
    const double volume = PI * (0.075 * 0.075 + 0.004 * 0.004 / 2) * 0.12;
    f.world.drum_radius = 0.079; /* that of its farthest places */
    ck_assert(mill_maps_init(&other, &f.world));
    ck_assert_double_eq(other.cross.from[0], -0.079);
    for (int i = 0; i < cells(&other.cross); i++)
        cross += other.room[i];
    for (int i = 0; i < cells(&other.axial); i++)
        axial += other.room[other.axial.first + (size_t)i];
    ck_assert_double_eq_tol(cross / volume, 1, 1e-4);
    ck_assert_double_eq_tol(axial / volume, 1, 1e-3);
    mill_maps_free(&other);
}

/* Volume, centre and variance along one axis of what a snapshot poured into a map */
struct heap {
    double volume, centre, variance;
};

static struct heap heap_of(const struct mill_map *map, int axis)
{
    struct heap heap = {0, 0, 0};
    double squares = 0;
    for (int i = 0; i < cells(map); i++) {
        const int place = axis == 0 ? i / map->n[1] : i % map->n[1];
        const double at = map->from[axis] + (place + 0.5) * map->size[axis];
        heap.volume += flow_of(&flow, map)[i].volume;
        heap.centre += flow_of(&flow, map)[i].volume * at;
        squares += flow_of(&flow, map)[i].volume * at * at;
    }
    heap.centre /= heap.volume;
    heap.variance = squares / heap.volume - heap.centre * heap.centre;
    return heap;
}

/* A ball so large, and so placed, that the points it is spread over are centres of cells */
TEST(a_ball_keeps_its_volume_centre_and_second_moment)
{
    const double a = 0.005 * sqrt(15), volume = 4 * PI / 3 * a * a * a;
    f.world.balls = 1;
    f.species.radius = a;
    f.ball[0].r = vec3_make(0.01125, 0.02125, -0.02875);
    mill_maps_sample(&maps, flow.record, &f.world, 0, 1);
    const struct heap heap[3] = {heap_of(&maps.axial, 0), heap_of(&maps.cross, 0),
                                 heap_of(&maps.cross, 1)};
    const double centre[3] = {0.01125, 0.02125, -0.02875};
    for (int axis = 0; axis < 3; axis++) {
        ck_assert_double_eq_tol(heap[axis].volume / volume, 1, 1e-12);
        ck_assert_double_eq_tol(heap[axis].centre, centre[axis], 1e-12);
        ck_assert_double_eq_tol(heap[axis].variance / (a * a / 5), 1, 1e-9);
    }
}

/* <r^2> about the drum's axis of a ball at distance c is c^2 + 2 a^2/5 */
TEST(a_ball_in_a_relief_is_in_no_map)
{
    f.world.balls = 1;
    f.ball[0].relief = MILL_RELIEF_LASTS;
    mill_maps_sample(&maps, flow.record, &f.world, 0, 1);
    for (size_t k = 0; k < maps.cells; k++)
        ck_assert_double_eq(((const struct mill_map_flow *)flow.record)[k].volume, 0.0);
}

TEST(a_ball_is_spread_over_the_rings_that_it_covers)
{
    const double a = 0.02, c = hypot(0.02, 0.03);
    double squares = 0, volume = 0;
    f.world.balls = 1;
    f.species.radius = a;
    f.ball[0].r = vec3_make(0, 0.02, -0.03);
    mill_maps_sample(&maps, flow.record, &f.world, 0, 1);
    for (int i = 0; i < cells(&maps.axial); i++) {
        const double r = (i % 30 + 0.5) * 0.0025;
        volume += flow_of(&flow, &maps.axial)[i].volume;
        squares += flow_of(&flow, &maps.axial)[i].volume * r * r;
    }
    ck_assert_double_eq_tol(squares / volume / (c * c + 2 * a * a / 5), 1, 0.03);
}

TEST(a_ball_on_the_axis_stays_in_the_inner_rings)
{
    f.world.balls = 1;
    f.ball[0].r = vec3_make(0, 0, 0);
    f.ball[0].v = vec3_make(1, 2, 3);
    mill_maps_sample(&maps, flow.record, &f.world, 0, 1);
    for (int i = 0; i < cells(&maps.axial); i++)
        if (i % 30 > 0)
            ck_assert(flow_of(&flow, &maps.axial)[i].volume == 0);
}

/* Balls thrown at random into the whole drum: each ring then holds its share */
TEST(a_uniform_charge_has_the_same_solid_fraction_in_every_inner_ring)
{
    enum { SNAPSHOTS = 2000, BALLS = FIXTURE_BALLS };
    uint64_t seed = 5;
    const double volume = BALLS * 4 * PI / 3 * pow(0.0025, 3);
    const double expected = volume / (PI * 0.075 * 0.075 * 0.12);
    double held[30] = {0};
    for (int n = 0; n < SNAPSHOTS; n++) {
        for (int i = 0; i < BALLS; i++) {
            const double r = 0.075 * sqrt(random_share(&seed));
            const double angle = 2 * PI * random_share(&seed);
            f.ball[i].r =
                vec3_make(0.12 * random_share(&seed) - 0.06, r * cos(angle), r * sin(angle));
        }
        mill_maps_sample(&maps, flow.record, &f.world, 0, 1);
    }
    for (int i = 0; i < cells(&maps.axial); i++)
        held[i % 30] += flow_of(&flow, &maps.axial)[i].volume / SNAPSHOTS;
    for (int k = 4; k < 28; k++) { /* five standard deviations of the number of balls in a ring */
        const double share = (2 * k + 1) / 900.0;
        const double room = PI * 0.0025 * 0.0025 * (2 * k + 1) * 0.12;
        ck_assert_double_eq_tol(held[k] / room / expected, 1, 5 / sqrt(share * BALLS * SNAPSHOTS));
    }
}

TEST(a_ring_that_turns_has_azimuthal_velocity_only)
{
    for (int i = 0; i < FIXTURE_BALLS; i++) {
        const vec3 r = f.ball[i].r;
        f.ball[i].v = vec3_make(0.5, -100 * r.z, 100 * r.y);
    }
    mill_maps_sample(&maps, flow.record, &f.world, 0, 1);
    double volume = 0, out = 0, around = 0, along = 0;
    for (int i = 0; i < cells(&maps.axial); i++) {
        volume += flow_of(&flow, &maps.axial)[i].volume;
        along += flow_of(&flow, &maps.axial)[i].flow[0];
        out += flow_of(&flow, &maps.axial)[i].flow[1];
        around += flow_of(&flow, &maps.axial)[i].flow[2];
    }
    ck_assert_double_eq_tol(along / volume, 0.5, 1e-12);
    ck_assert_double_eq_tol(out / volume, 0, 1e-12);
    ck_assert_double_eq_tol(around / volume, 6, 0.01); /* points beside the radius see less */
}

TEST(the_cross_section_holds_the_mean_velocity_of_the_balls_in_a_cell)
{
    f.world.balls = 2;
    for (int i = 0; i < 2; i++) {
        f.ball[i].r = vec3_make(0.03 * i, 0.03125, 0.03125); /* the middle of a cell */
        f.ball[i].v = vec3_make(1 + 2 * i, 2 + 2 * i, -4 * i);
    }
    mill_maps_sample(&maps, flow.record, &f.world, 0, 1);
    for (int i = 0; i < cells(&maps.cross); i++) {
        const struct mill_map_flow *cell = &flow_of(&flow, &maps.cross)[i];
        if (cell->volume > 0) {
            ck_assert_double_eq_tol(cell->flow[0] / cell->volume, 2, 1e-12);
            ck_assert_double_eq_tol(cell->flow[1] / cell->volume, 3, 1e-12);
            ck_assert_double_eq_tol(cell->flow[2] / cell->volume, -2, 1e-12);
        }
    }
}

TEST(balls_are_taken_where_they_are_at_the_time_asked_for)
{
    f.world.balls = 1;
    f.world.g = vec3_make(0, 0, -10);
    f.ball[0].r = vec3_make(0, 0.03, 0.03);
    f.ball[0].v = vec3_make(0, 0.1, 0);
    mill_maps_sample(&maps, flow.record, &f.world, 0.1,
                     1); /* now at (0, 0.04, -0.02) with (0, 0.1, -1) */
    const struct heap y = heap_of(&maps.cross, 0), z = heap_of(&maps.cross, 1);
    ck_assert_double_eq_tol(y.centre, 0.04, 0.00125);
    ck_assert_double_eq_tol(z.centre, -0.02, 0.00125);
    const struct mill_map_flow *cell =
        &flow_of(&flow, &maps.cross)[mill_maps_place(&maps.cross, 0, 0.04 + 0.0006) * 60 +
                                     mill_maps_place(&maps.cross, 1, -0.02 + 0.0006)];
    ck_assert_double_eq_tol(cell->flow[2] / cell->volume, -1, 1e-12);
}

static void throw_balls(uint64_t seed)
{
    for (int i = 0; i < FIXTURE_BALLS; i++) {
        const double r = 0.0725 * sqrt(random_share(&seed)), angle = 2 * PI * random_share(&seed);
        f.ball[i].r = vec3_make(0.11 * random_share(&seed) - 0.055, r * cos(angle), r * sin(angle));
        f.ball[i].v =
            vec3_make(random_share(&seed) - 0.5, random_share(&seed), 2 * random_share(&seed));
    }
}

/* Balls are taken by the block; a lone ball is a block of its own */
TEST(many_balls_at_once_pour_what_each_alone_would)
{
    struct mill_maps alone;
    struct mill_sums alone_flow;
    ck_assert(mill_maps_init(&alone, &f.world));
    ck_assert(mill_sums_make(&alone_flow, &mill_maps_flow, alone.cells));
    throw_balls(7);
    mill_maps_sample(&maps, flow.record, &f.world, 0.001, 1);
    for (int i = 0; i < FIXTURE_BALLS; i++) {
        struct mill_world one = f.world;
        one.balls = 1;
        one.ball = f.ball + i;
        mill_maps_sample(&alone, alone_flow.record, &one, 0.001, 1);
    }
    ck_assert_mem_eq(flow_of(&flow, &maps.cross), flow_of(&alone_flow, &alone.cross),
                     (size_t)cells(&maps.cross) * sizeof(struct mill_map_flow));
    ck_assert_mem_eq(flow_of(&flow, &maps.axial), flow_of(&alone_flow, &alone.axial),
                     (size_t)cells(&maps.axial) * sizeof(struct mill_map_flow));
    mill_sums_free(&alone_flow);
    mill_maps_free(&alone);
}

/* The lattice spelled out: 32 points, each into the cell that holds it */
TEST(the_cross_section_is_that_of_the_points_one_by_one)
{
    double volume[60 * 60] = {0};
    const double h = 0.0025 * sqrt(1.0 / 15), point = 4 * PI / 3 * pow(0.0025, 3) / 32;
    throw_balls(11);
    mill_maps_sample(&maps, flow.record, &f.world, 0, 1);
    for (int i = 0; i < FIXTURE_BALLS; i++)
        for (int n = 0; n < 64; n++) {
            const int p[3] = {2 * (n % 4) - 3, 2 * (n / 4 % 4) - 3, 2 * (n / 16) - 3};
            if (p[0] * p[0] + p[1] * p[1] + p[2] * p[2] > 11)
                continue;
            const int row = mill_maps_place(&maps.cross, 0, f.ball[i].r.y + p[1] * h);
            const int column = mill_maps_place(&maps.cross, 1, f.ball[i].r.z + p[2] * h);
            volume[row * 60 + column] += point;
        }
    for (int i = 0; i < cells(&maps.cross); i++)
        ck_assert_double_eq_tol(flow_of(&flow, &maps.cross)[i].volume / point, volume[i] / point,
                                1e-9);
}

TEST(a_ball_outside_the_drum_is_counted_at_the_rim)
{
    f.world.balls = 1;
    f.ball[0].r = vec3_make(5, -3, 7);
    mill_maps_sample(&maps, flow.record, &f.world, 0, 1);
    const struct heap cross = heap_of(&maps.cross, 1), axial = heap_of(&maps.axial, 0);
    ck_assert_double_eq_tol(cross.volume / (4 * PI / 3 * pow(0.0025, 3)), 1, 1e-12);
    ck_assert_double_eq_tol(cross.centre, 0.075, 0.005);
    ck_assert_double_eq_tol(axial.centre, 0.06, 0.005);
}

TEST(a_ball_larger_than_the_mill_stays_within_the_maps)
{
    f.world.balls = 1;
    f.species.radius = 1;
    f.ball[0].r = vec3_make(0, 0, 0);
    mill_maps_sample(&maps, flow.record, &f.world, 0, 1);
    ck_assert_double_eq_tol(heap_of(&maps.cross, 0).volume / (4 * PI / 3), 1, 1e-12);
    ck_assert_double_eq_tol(heap_of(&maps.axial, 0).volume / (4 * PI / 3), 1, 1e-12);
}

/* ---- containers that are bodies, or move ---- */

/* The still mill's balls as a container carries them that turns about any axis through any point */
TEST(maps_of_a_turning_container_are_those_of_the_still_one)
{
    struct mill_maps other;
    struct mill_sums other_flow;
    struct mill_turn form = {
        .centre = {0.3, -0.2, 0.1}, .axis = {1, -2, 0.5}, .speed = 40, .angle = 0.7};
    struct mill_motion *motion = mill_turn_type.create(&form);
    ck_assert(mill_maps_init(&other, &f.world));
    ck_assert(mill_sums_make(&other_flow, &mill_maps_flow, other.cells));
    throw_balls(13);
    mill_maps_sample(&maps, flow.record, &f.world, 0.01, 1);
    f.world.container.motion = f.world.container.mapped = motion;
    f.world.container.still = false;
    const struct mill_pose pose = mill_world_frame(&f.world, 0.01);
    for (int i = 0; i < FIXTURE_BALLS; i++) {
        const vec3 r = mill_world_position(&f.world, i, 0.01);
        const vec3 v = mill_world_velocity(&f.world, i, 0.01), at = mill_pose_out(&pose, r);
        f.ball[i].t = 0.01;
        f.ball[i].r = at;
        f.ball[i].v = vec3_add(mill_pose_velocity(&pose, at), mill_pose_turn_out(&pose, v));
    }
    mill_maps_sample(&other, other_flow.record, &f.world, 0.01, 1);
    for (size_t i = 0; i < maps.cells; i++) {
        const struct mill_map_flow *a = flow_of(&flow, &maps.cross) + i;
        const struct mill_map_flow *b = flow_of(&other_flow, &other.cross) + i;
        ck_assert_double_eq_tol(a->volume, b->volume, 1e-15);
        for (int k = 0; k < 3; k++)
            ck_assert_double_eq_tol(a->flow[k], b->flow[k], 1e-18);
    }
    mill_sums_free(&other_flow);
    mill_maps_free(&other);
    free(motion);
}

/* Impacts come with places of the laboratory, at times of the run. */
TEST(impacts_in_a_turning_container_are_counted_where_it_has_them)
{
    struct mill_turn form = {.axis = {1, 0, 0}, .speed = 2 * PI};
    struct mill_motion *motion = mill_turn_type.create(&form);
    f.world.container.motion = f.world.container.mapped = motion;
    f.world.container.still = false;
    fixture_create(&f);
    struct mill_impact impact = impact_of(0.75, MILL_BALL_DRUM, 1, -1, 1, 0.1);
    impact.position = vec3_make(0, 0, -0.05); /* after three quarters of a turn: on its y axis */
    fixture_play(&f, impact);
    fixture_finish(&f, 1.5);
    const struct mill_map *cross = &f.tally->plan.maps.cross;
    const struct mill_map_hits *of = f.results->sums.hits;
    ck_assert_uint_eq(
        hits_at(cross, of, 0.0501, 0.0001)->count + hits_at(cross, of, 0.0501, -0.0001)->count, 1);
    fixture_free(&f);
    free(motion);
}

static double sum_of_room(const struct mill_maps *of, const struct mill_map *map)
{
    double sum = 0;
    for (int i = 0; i < cells(map); i++)
        sum += of->room[map->first + (size_t)i];
    return sum;
}

LOOP_TEST(the_cells_make_up_a_body, 5)
{
    const vec3 x = {0, 0.6, 0.8}, y = {0, -0.8, 0.6}, z = {1, 0, 0};
    const struct mill_solid *const type[] = {&mill_box_solid, &mill_round_cylinder_solid,
                                             &mill_round_cone_solid, &mill_round_capsule_solid,
                                             &mill_round_sphere_solid};
    const struct mill_body body = {.inside = true,
                                   .centre = {0.2, -0.1, 0.3},
                                   .x = x,
                                   .y = y,
                                   .z = z,
                                   .size = {0.1, 0.06, 0.15},
                                   .radius = 0.04,
                                   .end_radius = 0.02,
                                   .length = 0.1};
    const struct mill_setup_surface surface = {
        .solid = type[_i], .body = &body, .motion = MILL_STILL, .kind = MILL_KINDS};
    const struct mill_setup_balls ball = {"steel", 0.002, 7800, 1};
    const char *const kind = "vessel";
    const struct mill_setup setup = {.surfaces = 1,
                                     .surface = &surface,
                                     .species = 1,
                                     .balls = &ball,
                                     .seed = 1,
                                     .kinds = 1,
                                     .kind = &kind};
    struct mill_world *world;
    struct mill_maps rooms;
    ck_assert_int_eq(mill_start_world(&setup, NULL, &world, NULL), MILL_FAULT_NONE);
    ck_assert(mill_maps_init(&rooms, world));
    const double volume = world->container.volume;
    ck_assert_double_eq_tol(sum_of_room(&rooms, &rooms.cross), volume, 1e-3 * volume);
    ck_assert_double_eq_tol(sum_of_room(&rooms, &rooms.axial), volume, 1e-3 * volume);
    /* in the middle a column goes from end to end */
    const struct mill_map *cross = &rooms.cross;
    const double column = rooms.room[30 * 60 + 30] / (cross->size[0] * cross->size[1]);
    const double length[] = {0.15, 0.1, 0.1, 0.18, 0.08};
    ck_assert_double_eq_tol(column, length[_i], 2e-3 * length[_i]);
    mill_maps_free(&rooms);
    mill_world_free(world);
}

int main(void)
{
    return unit_run_in("maps", setup, teardown);
}
