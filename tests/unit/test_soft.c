/* Soft spheres: single impacts on every shape and motion have the restitution, the friction and the
 * direction of the contact law; steps, lists, threads and pauses have no part in a run. */
#include "engine/soft.h"
#include "motion_fixture.h"
#include "sim_fixture.h"

enum { PHASES = 24, SOLIDS = 6, WAYS = MOTION_KINDS + 2 };

static const vec3 cube[12][3] = {
#define A {-0.01, -0.01, -0.01}
#define B {0.01, -0.01, -0.01}
#define C {0.01, 0.01, -0.01}
#define D {-0.01, 0.01, -0.01}
#define E {-0.01, -0.01, 0.01}
#define F {0.01, -0.01, 0.01}
#define G {0.01, 0.01, 0.01}
#define H {-0.01, 0.01, 0.01}
    {A, C, B}, {A, D, C}, {E, F, G}, {E, G, H}, {A, B, F}, {A, F, E},
    {B, C, G}, {B, G, F}, {C, D, H}, {C, H, G}, {D, A, E}, {D, E, H}};

static const struct {
    const struct mill_solid *solid;
    struct mill_body is;
} bodies[SOLIDS] = {
    {&mill_box_solid, {.size = {0.02, 0.03, 0.01}, .rounding = 0.001}},
    {&mill_round_cylinder_solid, {.radius = 0.01, .length = 0.02}},
    {&mill_round_cone_solid, {.radius = 0.01, .end_radius = 0.004, .length = 0.02}},
    {&mill_round_capsule_solid, {.radius = 0.006, .length = 0.02}},
    {&mill_round_sphere_solid, {.radius = 0.01}},
    {&mill_facets_solid, {.facets = 12, .facet = cube}},
};

/* A ball that is about to meet something */
struct throw {
    struct mill_setup setup;
    struct mill_setup_surface surface[2];
    struct mill_body container, body;
    struct mill_setup_motion motion[CHAIN];
    struct mill_setup_balls balls;
    struct mill_setup_ball start[2];
    struct chain chain;
};

static const double radius = 0.0025, closing = 1.0; /* [m], [m/s] */

static void stand(struct mill_body *b)
{
    b->x = vec3_make(1.0, 0.0, 0.0);
    b->y = vec3_make(0.0, 1.0, 0.0);
    b->z = vec3_make(0.0, 0.0, 1.0);
}

/* A great sphere around `body`, if any, that moves in this way; 0: it stands still */
static void prepare(struct throw *t, uint64_t *seed, const struct mill_solid *solid,
                    const struct mill_body *body, int way, struct mill_law law)
{
    memset(t, 0, sizeof *t);
    t->container = (struct mill_body){.inside = 1, .radius = 3.0};
    stand(&t->container);
    t->surface[0] = (struct mill_setup_surface){&mill_round_sphere_solid, &t->container, -1,
                                                MILL_STILL, MILL_BALL_DRUM, 0};
    t->chain = random_chain(seed, way);
    t->chain.count = way > 0 && body ? t->chain.count : 0;
    if (body) {
        t->body = *body;
        stand(&t->body);
        t->surface[1] = (struct mill_setup_surface){
            solid, &t->body, -1, t->chain.count ? t->chain.count - 1 : MILL_STILL, MILL_BALL_BLADE,
            0};
    }
    for (int k = 0; k < t->chain.count; k++) {
        struct link *is = &t->chain.is[k];
        /* so slow that the surface hardly turns or accelerates during the impact */
        is->turn.speed *= 0.1;
        is->swing.frequency *= 0.1;
        is->shift.frequency *= 0.1;
        for (int row = 0; row < ROWS; row++)
            is->row[row][0] *= 10.0;
        is->table = (struct mill_table){ROWS, (const double(*)[7])is->row};
        static const struct mill_motion_type *const type[] = {&mill_turn_type, &mill_swing_type,
                                                              &mill_shift_type, &mill_table_type};
        const void *form[] = {&is->turn, &is->swing, &is->shift, &is->table};
        t->motion[k] = (struct mill_setup_motion){type[is->kind], form[is->kind],
                                                  k > 0 ? k - 1 : MILL_STILL, "m"};
    }
    t->balls = (struct mill_setup_balls){"ball", 2.0 * radius, 7800.0, body ? 1 : 2};
    t->setup = (struct mill_setup){.motions = t->chain.count,
                                   .motion = t->motion,
                                   .rotor = MILL_STILL,
                                   .surfaces = body ? 2 : 1,
                                   .surface = t->surface,
                                   .species = 1,
                                   .balls = &t->balls,
                                   .start = t->start,
                                   .soft = {.modulus = 1e19, .steps = 40}};
    for (int k = 0; k < MILL_KINDS; k++)
        t->setup.law[k] = law;
}

/* The velocity of ball 0 after the impact of a hard or a soft sphere, and how long the impact of a
 * soft one takes [s] */
static vec3 run(struct throw *t, bool soft, double until)
{
    struct mill_world *world;
    struct mill_sim *sim;
    struct mill_error error = {""};
    t->setup.soft.on = soft;
    const enum mill_fault_code code = mill_start_world(&t->setup, NULL, &world, NULL);
    ck_assert_msg(code == MILL_FAULT_NONE, "%s", mill_setup_fault_text(code));
    ck_assert_int_eq(mill_sim_create(world, &sim, &error), MILL_OK);
    ck_assert_int_eq(mill_sim_run(sim, until, UINT64_MAX, NULL, &error), MILL_OK);
    uint64_t impacts = 0;
    for (int k = 0; k < MILL_KINDS; k++)
        impacts += world->account.collisions[k];
    ck_assert_uint_eq(impacts, 1);
    const vec3 v = mill_world_velocity(world, 0, mill_sim_local_time(sim));
    mill_sim_free(sim);
    mill_world_free(world);
    return v;
}

/* [s] for which the impact of a soft sphere lasts */
static double duration(const struct throw *t)
{
    struct mill_setup setup = t->setup;
    struct mill_world *world;
    setup.soft.on = 1;
    ck_assert_int_eq(mill_start_world(&setup, NULL, &world, NULL), MILL_FAULT_NONE);
    struct mill_soft_spring *springs = mill_soft_springs(world);
    const double lasts = world->soft_facts.duration;
    mill_soft_springs_free(springs, world);
    mill_world_free(world);
    return lasts;
}

/* Aims ball 0 at a random place of the body, or at ball 1, with this slip [m/s], so far away that
 * the impact begins in this phase of a time step. Returns the normal into the ball; *until: [s]
 * when the impact is over. */
static vec3 aim(struct throw *t, uint64_t *seed, double slip, double phase, double *until)
{
    struct mill_world *world;
    vec3 n = direction(seed), surface = nought, at = nought;
    if (t->setup.surfaces > 1) {
        struct mill_setup setup = t->setup;
        t->start[0] = (struct mill_setup_ball){.position = {1.5, 1.5, 1.5}};
        ck_assert_int_eq(mill_start_world(&setup, NULL, &world, NULL), MILL_FAULT_NONE);
        const struct mill_shape *shape = world->shape[world->shapes - 1];
        const struct mill_pose pose = mill_shape_pose(shape, 0.0);
        struct mill_contact c;
        do {
            c = shape->type->contact(
                shape, mill_pose_out(&pose, vec3_scale(direction(seed), uniform(seed, 0.01, 0.04))),
                radius, &pose);
        } while (c.gap < 0.001);
        n = c.normal;
        at = c.point;
        surface = c.velocity;
        mill_world_free(world);
    }
    const double away = t->setup.surfaces > 1 ? radius : 2.0 * radius;
    const vec3 any = direction(seed), across = vec3_axpy(any, -vec3_dot(any, n), n);
    const vec3 along = vec3_scale(across, slip / vec3_norm(across));
    const vec3 spin = vec3_scale(direction(seed), 20.0);
    /* the slip of the surfaces contains the spin */
    const vec3 turning = vec3_scale(vec3_cross(spin, n), -radius);
    t->start[0] = (struct mill_setup_ball){
        vec3_axpy(at, away + 1e-6, n),
        vec3_add(surface, vec3_sub(vec3_axpy(along, -closing, n), turning)), spin};
    t->start[1] = (struct mill_setup_ball){.position = nought};
    const double lasts = duration(t), before = lasts * (0.1 + phase / 40.0);
    t->start[0].position = vec3_axpy(at, away + closing * before, n);
    *until = before + 3.0 * lasts; if (getenv("DBG")) fprintf(stderr,"lasts %g before %g speed surf %g v %g\n", lasts, before, vec3_norm(surface), vec3_norm(t->start[0].velocity));
    return n;
}

/* The impact of the same ball as a soft and as a hard sphere: differences of restitution, of
 * friction (as a share) and of beta0, and the angle [deg] between the normals */
struct off {
    double restitution, friction, tangential, angle;
};

static struct off compare(struct throw *t, uint64_t *seed, double slip, double phase, double mass,
                          struct mill_law law, bool slides)
{
    double until;
    const vec3 n = aim(t, seed, slip, phase, &until);
    vec3 given[2];
    for (int soft = 0; soft < 2; soft++)
        given[soft] = vec3_scale(vec3_sub(run(t, soft, until), t->start[0].velocity), mass);
    /* in units of the closing speed */
    const vec3 hard = vec3_axpy(given[0], -vec3_dot(given[0], n), n);
    const vec3 own = vec3_axpy(given[1], -vec3_dot(given[1], n), n);
    struct off off = {.restitution = vec3_dot(vec3_sub(given[1], given[0]), n) / closing};
    const double along = vec3_norm(hard), share = vec3_norm(vec3_sub(own, hard));
    if (slides && along > 0.0)
        off.friction = share / along;
    else if (law.friction > 0.0)
        off.tangential = 3.5 * share / slip;
    else
        off.angle = 180.0 / PI * vec3_norm(vec3_cross(given[1], n)) / vec3_norm(given[1]);
    return off;
}

static void check(const struct mill_solid *solid, const struct mill_body *body, int way, int rounds)
{
    const struct mill_law laws[3] = {{0.8, 0.0, 0.0}, {0.8, 0.3, 0.4}, {0.8, 0.3, 0.4}};
    const double slip[3] = {0.5, 4.0, 0.1};
    const double mass = body ? 1.0 : 2.0;
    uint64_t seed = 47 + (uint64_t)way;
    for (int phase = 0; phase < rounds; phase++)
        for (int k = 0; k < 3; k++) {
            struct throw t;
            prepare(&t, &seed, solid, body, way, laws[k]);
            const struct off off =
                compare(&t, &seed, slip[k], (double)phase / rounds, mass, laws[k], k == 1);
            if (getenv("DBG")) fprintf(stderr,"OFF %g %g %g %g\n", fabs(off.restitution), off.friction, off.tangential, off.angle);
            ck_assert_msg(fabs(off.restitution) < 0.002, "e %g", off.restitution);
            ck_assert_msg(off.friction < 0.01, "friction %g", off.friction);
            ck_assert_msg(off.tangential < 0.02, "beta0 %g", off.tangential);
            ck_assert_msg(off.angle < 0.1, "angle %g deg", off.angle);
        }
}

LOOP_TEST(two_soft_balls_part_as_the_law_says, 1)
{
    check(NULL, NULL, 0, PHASES);
}
END_TEST

SLOW_TEST(soft_balls_leave_every_body_on_every_motion_as_the_law_says, SOLIDS * WAYS)
{
    check(bodies[_i % SOLIDS].solid, &bodies[_i % SOLIDS].is, _i / SOLIDS, PHASES);
}
END_TEST

int main(void)
{
    return unit_run("soft");
}
