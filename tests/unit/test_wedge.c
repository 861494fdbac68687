/* A new solid is one table: a wedge, which the program does not know, is met, kept apart from other
 * bodies, drawn, worn and refused as any other solid is. */
#include "deck/deck_private.h"
#include "extended.h"
#include "mesh_fixture.h"
#include "observe/kinds.h"
#include "observe/outline.h"
#include "observe/wear.h"
#include "proof/paranoid.h"
#include "shape_fixture.h"
#include "sim_fixture.h"
#include "start/clash_solid.h"

#define CLOSED 1e-12 /* [m] */

/* ---- the wedge ---- */

/* A prism along its own z over a triangle with a right angle at (-x, -y) */
static void corners(vec3 half, double corner[3][2])
{
    const double all[3][2] = {{-half.x, -half.y}, {half.x, -half.y}, {-half.x, half.y}};
    memcpy(corner, all, sizeof all);
}

static struct mill_core wedge_core(const struct mill_body *is)
{
    return (struct mill_core){.half = vec3_scale(is->size, 0.5)};
}

static vec3 wedge_support(const struct mill_core *core, vec3 way)
{
    double corner[3][2];
    int best = 0;
    corners(core->half, corner);
    for (int k = 1; k < 3; k++)
        if ((corner[k][0] - corner[best][0]) * way.x + (corner[k][1] - corner[best][1]) * way.y >
            0.0)
            best = k;
    return vec3_make(corner[best][0], corner[best][1], way.z < 0.0 ? -core->half.z : core->half.z);
}

static bool wedge_is_sound(const struct mill_body *is)
{
    return mill_solid_is_length(is->size.x, false) && mill_solid_is_length(is->size.y, false) &&
           mill_solid_is_length(is->size.z, false) && is->rounding == 0.0;
}

static double wedge_volume(const struct mill_body *is)
{
    return 0.5 * is->size.x * is->size.y * is->size.z;
}

static void wedge_outline(const struct mill_body *is, int wall, double tolerance,
                          struct mill_mesh *mesh)
{
    double corner[3][2];
    vec3 at[2][3];
    (void)wall, (void)tolerance;
    corners(vec3_scale(is->size, 0.5), corner);
    for (int k = 0; k < 6; k++)
        at[k / 3][k % 3] =
            mill_body_out(is, vec3_make(corner[k % 3][0], corner[k % 3][1],
                                        k < 3 ? -0.5 * is->size.z : 0.5 * is->size.z));
    mill_mesh_triangle(mesh, at[0][0], at[0][2], at[0][1]);
    mill_mesh_triangle(mesh, at[1][0], at[1][1], at[1][2]);
    for (int k = 0; k < 3; k++) {
        const int next = (k + 1) % 3;
        mill_mesh_triangle(mesh, at[0][k], at[0][next], at[1][next]);
        mill_mesh_triangle(mesh, at[0][k], at[1][next], at[1][k]);
    }
}

/* From the triangle: < 0 inside. The way out is along (nx, ny). */
MILL_CONVEX_INLINE double from_triangle(vec3 half, double x, double y, double *nx, double *ny)
{
    double corner[3][2], inside = -INFINITY, outside = INFINITY, n[2][2] = {{0.0}};
    corners(half, corner);
    for (int k = 0; k < 3; k++) {
        const double *a = corner[k], *b = corner[(k + 1) % 3];
        const double ex = b[0] - a[0], ey = b[1] - a[1], length = sqrt(ex * ex + ey * ey);
        const double qx = x - a[0], qy = y - a[1], over = (qx * ey - qy * ex) / length;
        const double share = fmin(fmax((qx * ex + qy * ey) / (length * length), 0.0), 1.0);
        const double ox = qx - share * ex, oy = qy - share * ey, d = sqrt(ox * ox + oy * oy);
        if (over > inside) {
            inside = over;
            n[0][0] = ey / length;
            n[0][1] = -ex / length;
        }
        if (d < outside) {
            outside = d;
            n[1][0] = d > 0.0 ? ox / d : ey / length;
            n[1][1] = d > 0.0 ? oy / d : -ex / length;
        }
    }
    const int out = inside > 0.0;
    *nx = n[out][0];
    *ny = n[out][1];
    return out ? outside : inside;
}

MILL_CONVEX_INLINE struct mill_view wedge_view(const struct mill_convex *convex, vec3 place)
{
    const struct mill_bodied *b = (const struct mill_bodied *)convex;
    const vec3 q = mill_body_in(&b->is, place);
    double nx, ny;
    const double across = from_triangle(b->core.half, q.x, q.y, &nx, &ny);
    const double along = fabs(q.z) - b->core.half.z, side = q.z < 0.0 ? -1.0 : 1.0;
    struct mill_view v = {fmax(across, along), {0.0, 0.0, side}};
    if (across > 0.0 && along > 0.0) {
        v.d = sqrt(across * across + along * along);
        v.n = vec3_make(nx * across / v.d, ny * across / v.d, side * along / v.d);
    } else if (across > along) {
        v.n = vec3_make(nx, ny, 0.0);
    }
    v.n = mill_body_turn_out(&b->is, v.n);
    return v;
}

MILL_BODY_SURFACE(struct mill_bodied, NULL, wedge_view, mill_body_is_far)

static const struct mill_key wedge_key[] = {
    {"size", "lengths along its own x, y and z", .type = MILL_KEY_VECTOR, MILL_SOLID_SIZE,
     MILL_SOLID_AT(size)},
    {.name = NULL},
};

static const struct mill_solid wedge = {.key = wedge_key,
                                        .surface = &surface,
                                        .is_sound = wedge_is_sound,
                                        .core = wedge_core,
                                        .support = wedge_support,
                                        .volume = wedge_volume,
                                        .outline = wedge_outline};

/* ---- alone ---- */

/* A wedge on its motions */
struct one {
    struct chain chain;
    struct mill_body body;
    struct mill_shape **shape;
};

static void open_one(uint64_t *seed, struct one *o, int way)
{
    const struct mill_reach places = {{-1.0, -1.0, -1.0}, {1.0, 1.0, 1.0}, INFINITY};
    int count;
    *o = (struct one){.chain = random_chain(seed, way)};
    place_body(seed, &o->body);
    o->body.size = vec3_make(log_uniform(seed, 1e-3, 0.04), log_uniform(seed, 1e-3, 0.04),
                             log_uniform(seed, 1e-3, 0.04));
    o->chain.count = way == 0 && below(seed, 2) ? 0 : o->chain.count;
    chain_open(&o->chain);
    const struct mill_setup_surface s = {
        .solid = &wedge, .body = &o->body, .motion = o->chain.count - 1, .kind = MILL_KINDS};
    const struct mill_setup setup = {.motions = o->chain.count, .surfaces = 1, .surface = &s};
    ck_assert(mill_solid_is_sound(&wedge, &o->body));
    ck_assert(mill_shapes_create(&setup, &places, o->chain.link, &o->shape, &count));
    ck_assert_int_eq(count, 1);
}

static void close_one(struct one *o)
{
    mill_shapes_free(o->shape, 1);
    chain_close(&o->chain);
}

/* A ball outside, often beside the wedge, half of them flying at it */
static bool random_flight(uint64_t *seed, const struct one *o, struct flight *f)
{
    f->radius = log_uniform(seed, 2e-4, 5e-3);
    f->now = uniform(seed, 0.0, 0.06);
    const struct mill_pose pose = mill_motion_pose(o->chain.top, f->now);
    const vec3 near = vec3_axpy(o->body.centre, uniform(seed, 0.0, 0.05), direction(seed));
    f->path.r = mill_pose_out(&pose, near);
    struct mill_contact c = contact_of(o->shape[0], f->path.r, f->radius, f->now);
    if (below(seed, 2)) {
        f->path.r = vec3_axpy(f->path.r, log_uniform(seed, 1e-9, 1e-2) - c.gap, c.normal);
        c = contact_of(o->shape[0], f->path.r, f->radius, f->now);
    }
    f->path.v = vec3_scale(below(seed, 2) ? direction(seed) : vec3_scale(c.normal, -1.0),
                           log_uniform(seed, 1e-3, 10.0));
    f->path.g = below(seed, 3) ? vec3_scale(direction(seed), uniform(seed, 0.0, 20.0)) : nought;
    return c.gap > CLOSED;
}

/* What the table says: the gap is the distance from all that the support describes, found without
 * the gap. */
TEST(the_gap_is_the_distance_from_what_the_support_describes)
{
    uint64_t seed = 1;
    for (int n = 0; n < 2000; n++) {
        struct one o;
        struct mill_part *part;
        int32_t parts;
        open_one(&seed, &o, 0);
        ck_assert(mill_part_list(&wedge, &o.body, &part, &parts));
        ck_assert_int_eq(parts, 1);
        const struct mill_pose pose = mill_shape_pose(o.shape[0], 0.3);
        const vec3 near = vec3_axpy(o.body.centre, uniform(&seed, 0.0, 0.05), direction(&seed));
        const double gap = gap_of(o.shape[0], mill_pose_out(&pose, near), 0.0, 0.3);
        const struct mill_part point = mill_part_facet(near, near, near, 0.0);
        const struct mill_part_gap found = mill_clash_gap_parts(&point, part, 1e-9);
        ck_assert_double_le(found.least, fmax(gap, 0.0) + 1e-15);
        ck_assert_double_ge(found.most, fmax(gap, 0.0) - 1e-15);
        free(part);
        close_one(&o);
    }
}

SLOW_TEST(it_is_met_when_it_is, MOTION_KINDS + 2)
{
    uint64_t seed = 11 + (uint64_t)_i;
    int found = 0, none = 0, give_ups = 0;
    for (int n = 0; n < unit_draws(600); n++) {
        struct one o;
        struct flight f;
        open_one(&seed, &o, _i);
        if (random_flight(&seed, &o, &f)) {
            const double horizon = log_uniform(&seed, 1e-5, 0.03);
            const double t = first_contact(o.shape[0], &f, horizon, false, &give_ups);
            const double missed = first_below(o.shape[0], &f, fmin(t, horizon), 1e-9);
            ck_assert_msg(isinf(missed), "flight %d: inside at %g s, before %g s", n, missed, t);
            if (!isinf(t))
                ck_assert_double_eq_tol(gap_at(o.shape[0], &f, t), 0.0, CLOSED);
            found += !isinf(t);
            none += isinf(t) != 0;
        }
        close_one(&o);
    }
    ck_assert_int_gt(found, unit_draws(60));
    ck_assert_int_gt(none, unit_draws(60));
    ck_assert_int_lt(give_ups, 2 + unit_draws(600) / 100);
}

TEST(its_outline_is_closed_and_encloses_its_volume)
{
    uint64_t seed = 3;
    struct one o;
    struct mill_mesh mesh = {0};
    open_one(&seed, &o, 0);
    mill_outline_draw(o.shape[0], 1e-3, &mesh);
    assert_closed(&mesh, 1);
    ck_assert_double_eq_tol(enclosed_by(&mesh) / wedge.volume(&o.body), 1.0, 1e-12);
    mill_mesh_free(&mesh);
    close_one(&o);
}

TEST(no_balls_are_inside_a_solid_without_walls)
{
    uint64_t seed = 4;
    struct one o;
    open_one(&seed, &o, 0);
    o.body.inside = 1;
    ck_assert(!mill_solid_is_sound(&wedge, &o.body));
    close_one(&o);
}

/* ---- in a mill ---- */

enum { STIRS = MILL_KINDS, STANDS };
static const char *const kind[] = {"stirs", "stands"};
static const struct mill_setup_drum around = {.radius = 0.04, .length = 0.04};

/* A wedge on the rotor, and a box that stands */
struct stirred {
    struct mill_body body[2];
    struct mill_setup_surface surface[2];
    struct mill_turn turn;
    struct mill_setup_motion rotor;
    struct mill_setup_balls balls;
    struct mill_setup setup;
    struct mill_fault fault;
    struct mill_world *world;
};

static void prepare(struct stirred *m)
{
#define ALONG .x = {0.0, 1.0, 0.0}, .y = {0.0, 0.0, 1.0}, .z = {1.0, 0.0, 0.0}
    *m = (struct stirred){
        .body = {{.centre = {0.0, 0.015, 0.0}, ALONG, .size = {0.03, 0.008, 0.02}},
                 {.centre = {0.0, 0.0, 0.037}, ALONG, .size = {0.004, 0.006, 0.02}}},
        .turn = {.axis = {1.0, 0.0, 0.0}, .speed = 600.0 * RPM},
        .rotor = {.type = &mill_turn_type, .form = &m->turn, .on = MILL_STILL},
        .balls = {.diameter = 0.005, .density = STEEL, .count = 60},
        .setup = {.gravity = {0.0, 0.0, -9.81},
                  .drum = around,
                  .motions = 1,
                  .motion = &m->rotor,
                  .surfaces = 2,
                  .surface = m->surface,
                  .species = 1,
                  .balls = &m->balls,
                  .seed = 1,
                  .kinds = 2,
                  .kind = kind,
                  .rebound_floor = 5e-3}};
    m->surface[0] =
        (struct mill_setup_surface){.solid = &wedge, .body = &m->body[0], .kind = STIRS};
    m->surface[1] = (struct mill_setup_surface){
        .solid = &mill_box_solid, .body = &m->body[1], .motion = MILL_STILL, .kind = STANDS};
    for (int k = 0; k < MILL_KINDS + 2; k++)
        m->setup.law[k] = (struct mill_law){0.8, 0.3, 0.4};
}

static enum mill_fault_code begin(struct stirred *m)
{
    const enum mill_fault_code code = mill_start_world(&m->setup, NULL, &m->world, &m->fault);
    ck_assert_int_eq(m->world == NULL, code != MILL_FAULT_NONE);
    return code;
}

TEST(a_mill_with_a_wedge_runs_and_every_search_holds_against_brute_force)
{
    struct stirred m;
    struct bench b = {NULL};
    prepare(&m);
    ck_assert_int_eq(begin(&m), MILL_FAULT_NONE);
    b.world = m.world;
    ck_assert_int_eq(mill_sim_create(b.world, &b.sim, &b.error), MILL_OK);
    ck_assert_int_eq(mill_paranoid_start(b.sim, NULL, &b.error), MILL_OK);
    bench_run(&b, 0.06);
    ck_assert_uint_gt(b.world->account.collisions[STIRS], 20);
    ck_assert_double_lt(bench_overlap(&b), 1e-9);
    bench_close(&b);
}

TEST(a_turning_box_buried_in_a_wedge_is_refused)
{
    struct stirred m;
    prepare(&m);
    m.surface[0].motion = MILL_STILL;
    m.surface[1].motion = 0;
    m.body[1].centre = vec3_make(0.002, 0.01, -0.001); /* all of it is in the wedge */
    m.body[1].size = vec3_make(0.003, 0.002, 0.004);
    ck_assert_int_eq(begin(&m), MILL_FAULT_CLASH);
    ck_assert(m.fault.when == 0.0 && m.fault.ball == 0 && m.fault.other == 1);
}

TEST(a_wedge_that_turns_into_a_box_is_refused_with_the_time)
{
    struct stirred m;
    prepare(&m);
    m.body[1].centre.z = 0.025;
    /* its slope, some 4 mm from the axis, comes to the lower edge of the box */
    const double far = 0.03 * 0.004 / hypot(0.03, 0.008), edge = hypot(0.002, 0.022);
    const double at = atan2(0.022, 0.002) - atan2(0.03, 0.008) + acos(far / edge);
    ck_assert_int_eq(begin(&m), MILL_FAULT_CLASH);
    ck_assert_double_eq_tol(m.fault.when, at / m.turn.speed, 1e-5);
}

TEST(a_wedge_that_leaves_the_drum_is_refused)
{
    struct stirred m;
    prepare(&m);
    m.setup.surfaces = 1;
    m.body[0].centre.y = 0.0249; /* its tip is 0.1 mm inside but for 4 mm beside the ray */
    m.body[0].size.y = 0.0001;
    ck_assert_int_eq(begin(&m), MILL_FAULT_NONE);
    mill_world_free(m.world);
    m.body[0].size.y = 0.008;
    ck_assert_int_eq(begin(&m), MILL_FAULT_OUTSIDE);
    ck_assert_double_eq_tol(m.fault.amount, hypot(0.0399, 0.004) - 0.04, 1e-8);
}

TEST(a_wedge_at_a_periodic_end_is_refused_and_one_from_end_to_end_is_not)
{
    struct stirred m;
    prepare(&m);
    m.setup.surfaces = 1;
    m.setup.drum.periodic = true;
    const struct {
        double length;
        enum mill_fault_code code;
    } along[] = {{0.034, MILL_FAULT_NONE}, {0.037, MILL_FAULT_END}, {0.04, MILL_FAULT_NONE}};
    for (int k = 0; k < 3; k++) {
        m.body[0].size.z = along[k].length;
        ck_assert_int_eq(begin(&m), along[k].code);
        mill_world_free(m.world);
    }
}

TEST(a_wedge_is_drawn_worn_and_takes_its_room)
{
    struct stirred m;
    struct mill_outline outline;
    struct mill_wear_plan wear;
    double area = 0.0, with, without;
    prepare(&m);
    ck_assert_int_eq(begin(&m), MILL_FAULT_NONE);
    ck_assert(mill_outline_make(m.world, m.world->motion[0], &outline));
    ck_assert_uint_eq(outline.mesh.triangles, 8);
    ck_assert_int_eq(outline.kind[0], mill_kinds_listed(m.world).number[STIRS]);
    ck_assert(mill_wear_facets_make(&wear, m.world));
    for (int32_t k = 0; k < wear.facets; k++)
        if (m.world->shape[wear.part[wear.facet[k].part].shape]->kind == STIRS)
            area += wear.facet[k].area;
    ck_assert_double_eq_tol(area, 0.03 * 0.008 + 0.02 * (0.03 + 0.008 + hypot(0.03, 0.008)), 1e-12);
    ck_assert_double_eq_tol(mill_deck_bodies_reach(&wedge, &m.body[0]), hypot(0.03, 0.004), 1e-15);
    mill_wear_facets_free(&wear);
    mill_outline_free(&outline);
    mill_world_free(m.world);
    ck_assert_int_eq(mill_start_free_volume_of(&m.setup, &with), MILL_FAULT_NONE);
    m.setup.surfaces = 0;
    ck_assert_int_eq(mill_start_free_volume_of(&m.setup, &without), MILL_FAULT_NONE);
    const double bar = 0.004 * 0.02 * 0.006; /* the part of the box in the drum, nearly */
    ck_assert_double_eq_tol(without - with, wedge.volume(&m.body[0]) + bar, 0.1 * bar);
}

int main(void)
{
    return unit_run("wedge");
}
