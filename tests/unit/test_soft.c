/* Soft spheres: single impacts on every shape and motion have the restitution, the friction and the
 * direction of the contact law, whatever law that is. Mills of soft spheres: test_soft_run.c. */
#include "engine/soft.h"
#include "motion_fixture.h"
#include "sim_fixture.h"

enum { PHASES = 24, SOLIDS = 6, ROOMS = 7, WAYS = MOTION_KINDS + 2 };

static const vec3 cube[12][3] = {
#define A                                                                                          \
    {                                                                                              \
        -0.01, -0.01, -0.01                                                                        \
    }
#define B                                                                                          \
    {                                                                                              \
        0.01, -0.01, -0.01                                                                         \
    }
#define C                                                                                          \
    {                                                                                              \
        0.01, 0.01, -0.01                                                                          \
    }
#define D                                                                                          \
    {                                                                                              \
        -0.01, 0.01, -0.01                                                                         \
    }
#define E                                                                                          \
    {                                                                                              \
        -0.01, -0.01, 0.01                                                                         \
    }
#define F                                                                                          \
    {                                                                                              \
        0.01, -0.01, 0.01                                                                          \
    }
#define G                                                                                          \
    {                                                                                              \
        0.01, 0.01, 0.01                                                                           \
    }
#define H                                                                                          \
    {                                                                                              \
        -0.01, 0.01, 0.01                                                                          \
    }
    {A, C, B}, {A, D, C}, {E, F, G}, {E, G, H}, {A, B, F}, {A, F, E},
    {B, C, G}, {B, G, F}, {C, D, H}, {C, H, G}, {D, A, E}, {D, E, H}};

/* The balls are outside of these */
static const struct target {
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

/* and inside of these */
static const struct target rooms[ROOMS] = {
    {&mill_round_cylinder_solid, {.inside = 1, .radius = 0.02, .length = 0.03}},
    {&mill_round_sphere_solid, {.inside = 1, .radius = 0.02}},
    {&mill_round_cone_solid, {.inside = 1, .radius = 0.03, .end_radius = 0.01, .length = 0.03}},
    {&mill_box_solid, {.inside = 1, .size = {0.02, 0.03, 0.04}}},
    {&mill_facets_solid, {.inside = 1, .facets = 12, .facet = cube}},
    {&mill_prism_solid, {.inside = 1, .radius = 0.02, .length = 0.03}},
    {&mill_contour_solid, {.inside = 1, .radius = 0.02, .length = 0.03}},
};

/* A ball that is about to meet something */
struct throw
{
    struct mill_setup setup;
    struct mill_setup_surface surface[2];
    struct mill_body container, body;
    struct mill_setup_motion motion[CHAIN];
    struct mill_setup_balls balls;
    struct mill_setup_ball start[2];
    struct chain chain;
    double closing; /* [m/s] */
};

static const double radius = 0.0025, density = 7800.0; /* [m], [kg/m^3] */

static void stand(struct mill_body *b)
{
    b->x = vec3_make(1.0, 0.0, 0.0);
    b->y = vec3_make(0.0, 1.0, 0.0);
    b->z = vec3_make(0.0, 0.0, 1.0);
}

/* A random motion, so slow that a surface hardly turns or accelerates during the impact */
static void prepare_motion(struct throw *t, uint64_t *seed, int way)
{
    static const struct mill_motion_type *const type[] = {&mill_turn_type, &mill_swing_type,
                                                          &mill_shift_type, &mill_table_type};
    t->chain = random_chain(seed, way);
    t->chain.count = way > 0 ? t->chain.count : 0;
    for (int k = 0; k < t->chain.count; k++) {
        struct link *is = &t->chain.is[k];
        is->turn.speed *= 0.1;
        is->swing.frequency *= 0.1;
        is->shift.frequency *= 0.1;
        for (int row = 0; row < ROWS; row++)
            is->row[row][0] *= 10.0;
        is->table = (struct mill_table){ROWS, (const double(*)[7])is->row};
        const void *form[] = {&is->turn, &is->swing, &is->shift, &is->table};
        t->motion[k] = (struct mill_setup_motion){type[is->kind], form[is->kind],
                                                  k > 0 ? k - 1 : MILL_STILL, "m"};
    }
}

/* `target` that moves in this way, 0: it stands still; or two balls, if it is NULL. A body is in
 * the middle of a great sphere. */
static void prepare(struct throw *t, uint64_t *seed, const struct target *target, int way,
                    struct mill_law law)
{
    memset(t, 0, sizeof *t);
    t->closing = 1.0;
    prepare_motion(t, seed, target ? way : 0);
    const int motion = t->chain.count - 1; /* or MILL_STILL */
    t->container = (struct mill_body){.inside = 1, .radius = 3.0};
    stand(&t->container);
    t->surface[0] = (struct mill_setup_surface){
        &mill_round_sphere_solid, &t->container, -1, MILL_STILL, MILL_BALL_DRUM, 0};
    if (target) {
        const bool room = target->is.inside;
        t->body = target->is;
        stand(&t->body);
        const struct mill_setup_drum round = {.radius = t->body.radius, .length = t->body.length};
        const struct mill_setup_drum wavy = wavy_drum(5, 0.02, 0.03, 0.003, 0.0);
        if (target->solid == &mill_prism_solid || target->solid == &mill_contour_solid)
            t->body = mill_setup_drum_body(target->solid == &mill_contour_solid ? &wavy : &round);
        t->surface[!room] = (struct mill_setup_surface){
            target->solid, &t->body, -1, motion, room ? MILL_BALL_DRUM : MILL_BALL_BLADE, 0};
    }
    t->balls = (struct mill_setup_balls){"ball", 2.0 * radius, density, target ? 1 : 2};
    t->setup = (struct mill_setup){.motions = t->chain.count,
                                   .motion = t->motion,
                                   .rotor = MILL_STILL,
                                   .surfaces = 1 + (target && !target->is.inside),
                                   .surface = t->surface,
                                   .species = 1,
                                   .balls = &t->balls,
                                   .start = t->start,
                                   .soft = {.modulus = 1e22, .steps = 40}};
    for (int k = 0; k < MILL_KINDS; k++)
        t->setup.law[k] = law;
}

static bool meets_ball(const struct throw *t)
{
    return t->balls.count > 1;
}

static struct mill_world *open_world(const struct throw *t, bool soft)
{
    struct mill_world *world;
    struct mill_setup setup = t->setup;
    setup.soft.on = soft;
    const enum mill_fault_code code = mill_start_world(&setup, NULL, &world, NULL);
    ck_assert_msg(code == MILL_FAULT_NONE, "%s", mill_setup_fault_text(code));
    return world;
}

/* What remains of an impact of a hard or a soft sphere */
struct after {
    vec3 v[2], w[2], r[2]; /* of the balls */
    struct mill_impact impact;
    struct mill_soft_facts facts;
};

static struct after run(const struct throw *t, bool soft, double until)
{
    struct bench b = {.world = open_world(t, soft)};
    struct witness witness;
    struct after after;
    ck_assert_int_eq(mill_sim_create(b.world, &b.sim, &b.error), MILL_OK);
    witness_join(&witness, &b, INFINITY);
    bench_run(&b, until);
    witness_is_content(&witness);
    ck_assert_uint_eq(bench_collisions(&b), 1);
    for (int i = 0; i < b.world->balls; i++) {
        after.r[i] = bench_position(&b, i);
        after.v[i] = bench_velocity(&b, i);
        after.w[i] = b.world->spin[i];
    }
    after.impact = witness.impact;
    after.facts = b.world->soft_facts;
    bench_close(&b);
    return after;
}

/* [s] for which the impact of a soft sphere lasts */
static double duration(const struct throw *t)
{
    struct mill_world *world = open_world(t, true);
    struct mill_memory_pool memory = {.failed = false};
    mill_soft_springs(world, &memory);
    const double lasts = world->soft_facts.duration;
    mill_memory_drop(&memory);
    mill_world_free(world);
    return lasts;
}

/* The nearest surface, which the ball is to meet, for a ball at this place; or nothing, if the ball
 * is not free there or if it is near two surfaces */
static const struct mill_shape *facing(const struct mill_world *w, int from, vec3 place,
                                       struct mill_contact *c)
{
    const struct mill_shape *nearest = NULL;
    double gap = INFINITY, next = INFINITY;
    for (int k = from; k < w->shapes; k++) {
        const struct mill_pose pose = mill_shape_pose(w->shape[k], 0.0);
        const struct mill_contact one =
            w->shape[k]->type->contact(w->shape[k], place, radius, &pose);
        next = fmin(next, fmax(gap, one.gap));
        if (one.gap < gap) {
            gap = one.gap;
            *c = one;
            nearest = w->shape[k];
        }
    }
    return gap > 0.0 && next > gap + 1e-4 ? nearest : NULL;
}

/* A random contact with the target */
static struct mill_contact draw(struct throw *t, uint64_t *seed)
{
    struct mill_pose pose = mill_pose_still;
    if (t->chain.count) {
        chain_open(&t->chain);
        pose = mill_motion_pose(t->chain.top, 0.0);
        chain_close(&t->chain);
    }
    const bool room = t->body.inside;
    t->start[0].position = mill_pose_out(&pose, room ? nought : vec3_make(0.1, 0.1, 0.1));
    struct mill_world *world = open_world(t, false);
    const int from = room ? 0 : world->shapes - 1;
    struct mill_contact c;
    const struct mill_shape *shape;
    vec3 place;
    do {
        place = mill_pose_out(&pose, vec3_scale(direction(seed), uniform(seed, 0.0, 0.04)));
        shape = facing(world, from, place, &c);
        place = vec3_axpy(c.point, radius + 1e-6, c.normal);
    } while (!shape || c.gap < 0.001 || facing(world, from, place, &c) != shape);
    mill_world_free(world);
    return c;
}

/* Aims ball 0 at a random place of the target, or at ball 1, with this slip [m/s], so far away that
 * the impact begins in this phase of a time step. Returns the normal into the ball; *until: [s]
 * when the impact is over; *before: [s] when it begins. */
static vec3 aim(struct throw *t, uint64_t *seed, double slip, double phase, double *before,
                double *until)
{
    struct mill_contact c = {.normal = direction(seed)};
    if (!meets_ball(t))
        c = draw(t, seed);
    const vec3 n = c.normal;
    const double away = meets_ball(t) ? 2.0 * radius : radius;
    const vec3 any = direction(seed), across = vec3_axpy(any, -vec3_dot(any, n), n);
    const vec3 along = vec3_scale(across, slip / vec3_norm(across));
    const vec3 spin = vec3_scale(direction(seed), 20.0);
    /* the slip of the surfaces contains the spin */
    const vec3 turning = vec3_scale(vec3_cross(spin, n), -radius);
    t->start[0] = (struct mill_setup_ball){
        vec3_axpy(c.point, away + 1e-6, n),
        vec3_add(c.velocity, vec3_sub(vec3_axpy(along, -t->closing, n), turning)), spin};
    t->start[1] = (struct mill_setup_ball){.position = nought};
    const double lasts = duration(t);
    *before = lasts * (0.1 + phase / (double)t->setup.soft.steps);
    t->start[0].position = vec3_axpy(c.point, away + t->closing * *before, n);
    /* a contact lasts until the ball has left the place where it was pressed most */
    *until = *before + lasts * (3.0 + 2.0 / t->setup.law[0].restitution);
    return n;
}

/* The impact of the same ball as a soft and as a hard sphere: differences of restitution, of
 * friction (as a share) and of beta0, and the angle [deg] between the normals */
struct off {
    double restitution, friction, tangential, angle;
};

static struct off compare(struct throw *t, uint64_t *seed, double slip, double phase, bool slides)
{
    double before, until;
    const vec3 n = aim(t, seed, slip, phase, &before, &until);
    const double mass = meets_ball(t) ? 2.0 : 1.0; /* over the reduced one */
    vec3 given[2];
    for (int soft = 0; soft < 2; soft++)
        given[soft] = vec3_scale(vec3_sub(run(t, soft, until).v[0], t->start[0].velocity), mass);
    const vec3 hard = vec3_axpy(given[0], -vec3_dot(given[0], n), n);
    const vec3 own = vec3_axpy(given[1], -vec3_dot(given[1], n), n);
    struct off off = {.restitution = vec3_dot(vec3_sub(given[1], given[0]), n) / t->closing};
    const double along = vec3_norm(hard), share = vec3_norm(vec3_sub(own, hard));
    if (slides && along > 0.0)
        off.friction = share / along;
    else if (t->setup.law[0].friction > 0.0)
        off.tangential = 3.5 * share / slip;
    else
        off.angle = 180.0 / PI * vec3_norm(vec3_cross(given[1], n)) / vec3_norm(given[1]);
    return off;
}

static void is_small(const struct off *off)
{
    ck_assert_msg(fabs(off->restitution) < 0.002, "e %g", off->restitution);
    ck_assert_msg(off->friction < 0.01, "friction %g", off->friction);
    ck_assert_msg(off->tangential < 0.02, "beta0 %g", off->tangential);
    ck_assert_msg(off->angle < 0.1, "angle %g deg", off->angle);
}

/* [m/s] A contact with this slip sticks just so at a closing speed of 1 m/s. */
static double limit(const struct mill_law *law)
{
    return 3.5 * law->friction * (1.0 + law->restitution) / (1.0 + law->tangential);
}

/* Without friction, sliding, and sticking. Near the limit soft spheres differ: a contact can slide
 * for a part of the time. */
static void check(const struct target *target, int way, struct mill_law law, bool hertz, int rounds)
{
    const double slip[3] = {0.5, 6.0 * limit(&law), 0.02 * limit(&law)};
    uint64_t seed = 47 + (uint64_t)way;
    for (int phase = 0; phase < rounds; phase++)
        for (int k = 0; k < 3; k++) {
            struct throw t;
            struct mill_law own = law;
            own.friction = k > 0 ? law.friction : 0.0;
            prepare(&t, &seed, target, way, own);
            t.setup.soft.hertz = hertz;
            /* its dashpot grows from nothing, which coarse steps follow less well */
            t.setup.soft.steps = hertz ? 160 : 40;
            const struct off off = compare(&t, &seed, slip[k], (double)phase / rounds, k == 1);
            is_small(&off);
        }
}

static const struct mill_law usual = {0.8, 0.3, 0.4};

LOOP_TEST(two_soft_balls_part_as_the_law_says, 2)
{
    check(NULL, 0, usual, _i == 1, PHASES / 2);
}
END_TEST

LOOP_TEST(soft_balls_leave_every_body_and_every_room_as_the_law_says, SOLIDS + ROOMS)
{
    check(_i < SOLIDS ? &bodies[_i] : &rooms[_i - SOLIDS], 0, usual, false, 3);
}
END_TEST

SLOW_TEST(soft_balls_leave_every_body_on_every_motion_as_the_law_says, SOLIDS *WAYS)
{
    check(&bodies[_i % SOLIDS], _i / SOLIDS, usual, false, PHASES);
}
END_TEST

SLOW_TEST(soft_balls_leave_every_room_on_every_motion_as_the_law_says, ROOMS *WAYS)
{
    check(&rooms[_i % ROOMS], _i / ROOMS, usual, false, PHASES);
}
END_TEST

/* ---- other laws ---- */

static const struct mill_law laws[] = {{1.0, 0.3, 0.4},  {0.3, 0.3, 0.4},  {0.05, 0.3, 0.4},
                                       {0.8, 0.3, 1.0},  {0.8, 0.3, 0.9},  {0.8, 0.3, 0.01},
                                       {0.8, 0.3, -0.5}, {0.5, 0.1, -0.9}, {0.3, 0.1, 0.0}};

LOOP_TEST(any_law_is_that_of_single_impacts, 2 * COUNT(laws))
{
    check(NULL, 0, laws[_i / 2], _i % 2, 2);
    check(&rooms[0], 0, laws[_i / 2], _i % 2, 2);
}
END_TEST

/* ---- the law alone ---- */

LOOP_TEST(a_restitution_that_falls_is_that_at_the_speed_at_which_a_contact_begins, 2 * 3)
{
    const struct mill_fall falls[2] = {
        {.points = 1, .speed = {1.0}, .restitution = {0.7}},
        {.points = 3, .speed = {0.2, 2.0, 4.0}, .restitution = {0.95, 0.6, 0.3}}};
    uint64_t seed = 5;
    for (int phase = 0; phase < 1; phase++) {
        struct throw t;
        prepare(&t, &seed, NULL, 0, (struct mill_law){0.0, 0.3, 0.4});
        t.closing = (double[]){0.1, 1.0, 5.0}[_i / 2];
        t.setup.fall[MILL_BALL_BALL] = falls[_i % 2];
        t.setup.law[MILL_BALL_BALL].restitution = 0.3; /* the least, for the time to wait */
        const struct off off = compare(&t, &seed, 10.0 * t.closing, 0.5 * phase, true);
        is_small(&off);
    }
}
END_TEST

/* [s] from first to last touch */
static double lasting(double closing, double restitution, bool hertz, double *e)
{
    uint64_t seed = 3;
    struct throw t;
    double before, until;
    prepare(&t, &seed, NULL, 0, (struct mill_law){restitution, 0.0, 0.0});
    t.closing = closing;
    t.setup.soft.hertz = hertz;
    t.setup.soft.steps = 400;
    const vec3 n = aim(&t, &seed, 0.0, 0.5, &before, &until);
    t.start[0].velocity = vec3_scale(n, -closing); /* on which the spring depends */
    const struct after a = run(&t, true, until);
    *e = vec3_dot(vec3_sub(a.v[0], a.v[1]), n) / closing;
    return a.impact.time - before;
}

TEST(a_contact_of_hertz_lasts_as_long_as_his_theory_says)
{
    const double mass = density * PI / 12.0 * 8.0 * radius * radius * radius; /* half of a ball's */
    const double reduced = 1e22 / (2.0 * (1.0 - 0.3 * 0.3));
    for (double v = 0.1; v < 6.0; v *= 7.0) {
        double e;
        /* Landau & Lifshitz, Theory of Elasticity, section 9; the radius is half of a ball's */
        const double time =
            2.868 * pow(4.0 * mass * mass / (4.0 * 0.5 * radius * reduced * reduced * v), 0.2);
        ck_assert_double_eq_tol(lasting(v, 1.0, true, &e), time, 0.005 * time);
        ck_assert_double_eq_tol(e, 1.0, 1e-4);
    }
}
END_TEST

/* A linear spring is made for the fastest speed of the mill, so it lasts as Hertz' does at that. */
LOOP_TEST(no_restitution_depends_on_the_speed_but_durations_do_as_those_of_hertz, 2)
{
    double e[3], time[3];
    for (int k = 0; k < 3; k++)
        time[k] = lasting((double[]){0.1, 1.0, 5.0}[k], 0.7, _i, &e[k]);
    for (int k = 0; k < 3; k++) {
        ck_assert_double_eq_tol(e[k], 0.7, 3e-4);
        const double slower = pow((double[]){0.1, 1.0, 5.0}[k], -0.2);
        ck_assert_double_eq_tol(time[k], time[1] * slower, 0.01 * time[k]);
    }
}
END_TEST

/* A linear spring takes in the energy of an impact at the fastest speed at the depth of Hertz'. */
TEST(a_linear_spring_is_pressed_as_deep_as_one_of_hertz_at_the_fastest_speed)
{
    double force[2];
    for (int hertz = 0; hertz < 2; hertz++) {
        uint64_t seed = 3;
        struct throw t;
        double before, until;
        prepare(&t, &seed, NULL, 0, (struct mill_law){1.0, 0.0, 0.0});
        t.setup.soft.hertz = hertz;
        aim(&t, &seed, 0.0, 0.5, &before, &until);
        force[hertz] = run(&t, true, until).facts.force;
    }
    /* of the same energy at the same depth d: F = 2 E/d, and 5/2 E/d of Hertz */
    ck_assert_double_eq_tol(force[1] / force[0], 1.25, 0.005);
}
END_TEST

/* What is not in motion is in the springs. */
LOOP_TEST(an_elastic_impact_loses_nothing_at_any_moment, 2)
{
    uint64_t seed = 3;
    struct throw t;
    double before, until, most = 0.0;
    prepare(&t, &seed, NULL, 0, (struct mill_law){1.0, 0.0, 0.0});
    t.setup.soft.hertz = _i;
    t.setup.soft.steps = 400;
    aim(&t, &seed, 0.0, 0.0, &before, &until);
    struct bench b = {.world = open_world(&t, true)};
    ck_assert_int_eq(mill_sim_create(b.world, &b.sim, &b.error), MILL_OK);
    const double all = b.world->species[0].mass / 4.0; /* at 1 m/s, with the reduced mass */
    for (int k = 1; k <= 20; k++) {
        bench_run(&b, until * k / 20.0);
        most = fmax(most, b.world->account.elastic);
        ck_assert_double_lt(fabs(b.world->account.dissipation[MILL_BALL_BALL]), 1e-3 * all);
    }
    ck_assert_double_gt(most, 0.8 * all);
    bench_close(&b);
}
END_TEST

LOOP_TEST(two_balls_keep_momentum_and_angular_momentum, 2)
{
    uint64_t seed = 11;
    for (int k = 0; k < 8; k++) {
        struct throw t;
        double before, until;
        prepare(&t, &seed, NULL, 0, usual);
        t.setup.soft.hertz = _i;
        aim(&t, &seed, k % 2 ? 5.0 : 0.3, 0.125 * k, &before, &until);
        t.start[1].spin = vec3_make(3.0, -50.0, 20.0);
        const struct after a = run(&t, true, until);
        vec3 momentum = nought, turning = nought;
        for (int i = 0; i < 2; i++) {
            const vec3 spin = vec3_scale(vec3_sub(a.w[i], t.start[i].spin), 0.4 * radius * radius);
            const vec3 orbit = vec3_sub(vec3_cross(a.r[i], a.v[i]),
                                        vec3_cross(t.start[i].position, t.start[i].velocity));
            momentum = vec3_add(momentum, vec3_sub(a.v[i], t.start[i].velocity));
            turning = vec3_add(turning, vec3_add(spin, orbit));
        }
        ck_assert_double_lt(vec3_norm(momentum), 1e-13);
        ck_assert_double_lt(vec3_norm(turning), 1e-12 * radius);
        ck_assert_double_gt(vec3_norm(vec3_sub(a.w[0], t.start[0].spin)),
                            1.0); /* not for nothing */
    }
}
END_TEST

int main(void)
{
    return unit_run("soft");
}
