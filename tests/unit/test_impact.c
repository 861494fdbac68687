/* Claims about the contact law, against the bookkeeping of two free bodies. */
#include "millsim/impact.h"

#include "draws.h"

/* A uniform sphere, or a surface that nothing can move (mass INFINITY). */
struct body {
    double radius, mass;
    vec3 v, spin;
};

static double inertia(const struct body *b)
{
    return 0.4 * b->mass * b->radius * b->radius;
}

static double energy(const struct body *b)
{
    return 0.5 * b->mass * vec3_dot(b->v, b->v) + 0.5 * inertia(b) * vec3_dot(b->spin, b->spin);
}

static struct body random_ball(uint64_t *seed)
{
    struct body b;
    b.radius = log_uniform(seed, 1e-4, 1e-1);
    b.mass = log_uniform(seed, 1e-7, 1e1);
    b.v = vec3_scale(direction(seed), log_uniform(seed, 1e-3, 30.0));
    b.spin = vec3_scale(direction(seed), log_uniform(seed, 1e-3, 30.0) / b.radius);
    return b;
}

static struct mill_law random_law(uint64_t *seed)
{
    const struct mill_law law = {uniform(seed, 0.0, 1.0),
                                 below(seed, 4) ? log_uniform(seed, 1e-3, 3.0) : 0.0,
                                 uniform(seed, -1.0, 1.0)};
    return law;
}

/* Velocity of a's surface relative to b's where they touch; n from a to b */
static vec3 slip_of(const struct body *a, const struct body *b, vec3 n)
{
    const vec3 spin = vec3_axpy(vec3_scale(a->spin, a->radius), b->radius, b->spin);
    return vec3_add(vec3_sub(a->v, b->v), vec3_cross(spin, n));
}

static double reduced_mass(const struct body *a, const struct body *b)
{
    return isinf(b->mass) ? a->mass : a->mass * b->mass / (a->mass + b->mass);
}

/* The impulse at the contact point, on a body whose surface there lies at radius * arm */
static void give(struct body *b, vec3 arm, vec3 impulse)
{
    if (isinf(b->mass))
        return;
    b->v = vec3_axpy(b->v, 1.0 / b->mass, impulse);
    b->spin = vec3_axpy(b->spin, b->radius / inertia(b), vec3_cross(arm, impulse));
}

static struct mill_rebound collide(const struct mill_law *law, double rebound_floor, struct body *a,
                                   struct body *b, vec3 n)
{
    const struct mill_rebound rebound =
        mill_impact_resolve(law, rebound_floor, reduced_mass(a, b), n, slip_of(a, b, n));
    give(a, n, vec3_scale(rebound.impulse, -1.0));
    give(b, vec3_scale(n, -1.0), rebound.impulse);
    return rebound;
}

/* A direction along which the two approach */
static vec3 closing_normal(uint64_t *seed, const struct body *a, const struct body *b)
{
    const vec3 n = direction(seed);
    return vec3_dot(vec3_sub(a->v, b->v), n) < 0.0 ? vec3_scale(n, -1.0) : n;
}

static double tangential_size(vec3 g, vec3 n)
{
    return vec3_norm(vec3_axpy(g, -vec3_dot(g, n), n));
}

/* ---- balances ---- */

TEST(momentum_and_angular_momentum_are_conserved)
{
    uint64_t seed = 1;
    for (int k = 0; k < 20000; k++) {
        struct body a = random_ball(&seed), b = random_ball(&seed);
        const struct mill_law law = random_law(&seed);
        const vec3 n = closing_normal(&seed, &a, &b);
        const vec3 ra = vec3_scale(n, -a.radius), rb = vec3_scale(n, b.radius);
        vec3 before = vec3_axpy(vec3_scale(a.v, a.mass), b.mass, b.v), after;
        const double size = a.mass * vec3_norm(a.v) + b.mass * vec3_norm(b.v);
        vec3 turn_before = vec3_axpy(vec3_scale(a.spin, inertia(&a)), inertia(&b), b.spin);
        turn_before = vec3_axpy(turn_before, a.mass, vec3_cross(ra, a.v));
        turn_before = vec3_axpy(turn_before, b.mass, vec3_cross(rb, b.v));
        collide(&law, 0.0, &a, &b, n);
        after = vec3_axpy(vec3_scale(a.v, a.mass), b.mass, b.v);
        vec3 turn_after = vec3_axpy(vec3_scale(a.spin, inertia(&a)), inertia(&b), b.spin);
        turn_after = vec3_axpy(turn_after, a.mass, vec3_cross(ra, a.v));
        turn_after = vec3_axpy(turn_after, b.mass, vec3_cross(rb, b.v));
        ck_assert_double_le(vec3_norm(vec3_sub(after, before)), 1e-13 * size);
        const double turn_size = inertia(&a) * vec3_norm(a.spin) + inertia(&b) * vec3_norm(b.spin) +
                                 size * (a.radius + b.radius);
        ck_assert_double_le(vec3_norm(vec3_sub(turn_after, turn_before)), 1e-13 * turn_size);
    }
}

TEST(what_two_balls_lose_is_what_is_booked)
{
    uint64_t seed = 2;
    for (int k = 0; k < 20000; k++) {
        struct body a = random_ball(&seed), b = random_ball(&seed);
        const struct mill_law law = random_law(&seed);
        const double lift = below(&seed, 2) ? log_uniform(&seed, 1e-4, 10.0) : 0.0;
        const vec3 n = closing_normal(&seed, &a, &b);
        const double before = energy(&a) + energy(&b);
        const struct mill_rebound rebound = collide(&law, lift, &a, &b, n);
        const double loss = before - energy(&a) - energy(&b);
        const double size = before + energy(&a) + energy(&b);
        ck_assert_double_le(fabs(loss - rebound.dissipation), 1e-13 * size);
        ck_assert(rebound.floored || rebound.dissipation_normal >= 0.0);
        ck_assert_double_ge(rebound.dissipation - rebound.dissipation_normal,
                            -1e-15 * size); /* sliding and sticking never give energy */
    }
}

TEST(at_a_moving_wall_the_loss_is_the_work_less_the_gain)
{
    uint64_t seed = 3;
    for (int k = 0; k < 20000; k++) {
        struct body ball = random_ball(&seed), wall = random_ball(&seed);
        const struct mill_law law = random_law(&seed);
        const double lift = below(&seed, 2) ? log_uniform(&seed, 1e-4, 10.0) : 0.0;
        wall.mass = (double)INFINITY;
        wall.spin = vec3_make(0.0, 0.0, 0.0); /* v is its surface's velocity */
        const vec3 n = closing_normal(&seed, &ball, &wall), wall_v = wall.v;
        const double before = energy(&ball);
        const struct mill_rebound rebound = collide(&law, lift, &ball, &wall, n);
        const double work = -vec3_dot(rebound.impulse, wall_v);
        const double gain = energy(&ball) - before;
        const double size = before + energy(&ball) + fabs(work);
        ck_assert_double_le(fabs(work - gain - rebound.dissipation), 1e-13 * size);
    }
}

/* ---- the normal part ---- */

TEST(the_normal_speed_is_reversed_times_restitution)
{
    static const double restitution[] = {0.0, 0.3, 0.8, 1.0};
    uint64_t seed = 4;
    for (int k = 0; k < 20000; k++) {
        struct body a = random_ball(&seed), b = random_ball(&seed);
        struct mill_law law = random_law(&seed);
        law.restitution = restitution[k % 4];
        const vec3 n = closing_normal(&seed, &a, &b);
        const vec3 before = slip_of(&a, &b, n);
        const struct mill_rebound rebound = collide(&law, 0.0, &a, &b, n);
        const double after = vec3_dot(slip_of(&a, &b, n), n), g_n = vec3_dot(before, n);
        const double size = vec3_norm(before) + vec3_norm(a.v) + vec3_norm(b.v);
        ck_assert_double_eq(rebound.normal_speed, g_n);
        ck_assert_double_eq(rebound.tangential_speed, tangential_size(before, n));
        ck_assert_double_le(fabs(after + law.restitution * g_n), 1e-14 * size);
        ck_assert(!rebound.floored);
        const double m = reduced_mass(&a, &b);
        ck_assert_double_eq_tol(rebound.dissipation_normal,
                                0.5 * m * (1.0 - law.restitution * law.restitution) * g_n * g_n,
                                1e-14 * m * g_n * g_n);
    }
}

TEST(without_friction_the_spins_and_the_tangential_velocity_are_untouched)
{
    uint64_t seed = 5;
    for (int k = 0; k < 10000; k++) {
        struct body a = random_ball(&seed), b = random_ball(&seed);
        struct mill_law law = random_law(&seed);
        law.friction = 0.0;
        const struct body was_a = a, was_b = b;
        const vec3 n = closing_normal(&seed, &a, &b);
        const struct mill_rebound rebound = collide(&law, 0.0, &a, &b, n);
        ck_assert_double_le(tangential_size(rebound.impulse, n),
                            1e-15 * vec3_norm(rebound.impulse));
        ck_assert_double_le(vec3_norm(vec3_sub(a.spin, was_a.spin)) * a.radius,
                            1e-15 * vec3_norm(vec3_sub(a.v, was_a.v)));
        ck_assert_double_le(vec3_norm(vec3_sub(b.spin, was_b.spin)) * b.radius,
                            1e-15 * vec3_norm(vec3_sub(b.v, was_b.v)));
        ck_assert_double_eq(rebound.dissipation, rebound.dissipation_normal);
        /* v1' = v1 - (1 + e) m2/(m1 + m2) (v1 - v2).n n */
        const double share = (1.0 + law.restitution) * b.mass / (a.mass + b.mass);
        const double g_n = vec3_dot(vec3_sub(was_a.v, was_b.v), n);
        const vec3 expected = vec3_axpy(was_a.v, -share * g_n, n);
        ck_assert_double_le(vec3_norm(vec3_sub(a.v, expected)),
                            1e-13 * (vec3_norm(was_a.v) + vec3_norm(was_a.spin) * a.radius +
                                     vec3_norm(was_b.v) + vec3_norm(was_b.spin) * b.radius));
    }
}

TEST(elastic_balls_that_rebound_with_all_their_slip_lose_nothing)
{
    uint64_t seed = 6;
    for (int k = 0; k < 2000; k++) {
        struct body a = random_ball(&seed), b = random_ball(&seed);
        /* mu so large that no contact slides */
        const struct mill_law law = {1.0, 1e30, k % 2 ? 1.0 : -1.0};
        const vec3 n = closing_normal(&seed, &a, &b);
        const double before = energy(&a) + energy(&b);
        const struct mill_rebound rebound = collide(&law, 0.0, &a, &b, n);
        ck_assert_double_le(fabs(rebound.dissipation), 1e-14 * before);
        ck_assert_double_le(fabs(energy(&a) + energy(&b) - before), 1e-13 * before);
    }
}

/* ---- the tangential part ---- */

TEST(a_falling_restitution_goes_through_its_points)
{
    uint64_t seed = 7;
    const struct mill_fall power = {1, {2.0}, {0.8}, 0.0};
    const struct mill_fall table = {3, {0.5, 1.0, 4.0}, {0.9, 0.7, 0.4}, 0.0};
    ck_assert_double_eq(mill_impact_restitution(&power, 0.0), 1.0);
    ck_assert_double_eq(mill_impact_restitution(&power, -1e-18), 1.0);
    ck_assert_double_lt(mill_impact_restitution(&power, 1e9), 0.05);
    ck_assert_double_eq_tol(mill_impact_restitution(&power, 2.0), 0.8, 1e-14);
    struct mill_fall known = power; /* as a world keeps it */
    known.loss = mill_impact_loss(0.8);
    for (int k = 0; k < 1000; k++) {
        const double v = log_uniform(&seed, 1e-6, 30.0), e = mill_impact_restitution(&power, v);
        ck_assert(e > mill_impact_restitution(&power, 1.01 * v) && e < 1.0);
        ck_assert_double_eq(e, mill_impact_restitution(&known, v));
        /* slow impacts: the first term, 1 - e ~ v^(1/5) */
        const double slow = (1.0 - mill_impact_restitution(&power, 1e-9 * v)) /
                            (1.0 - mill_impact_restitution(&power, 1e-11 * v));
        ck_assert_double_eq_tol(slow, pow(100.0, 0.2), 0.03);
    }
    const struct mill_fall elastic = {1, {2.0}, {1.0}, 0.0};
    ck_assert_double_eq(mill_impact_restitution(&elastic, 5.0), 1.0);
    for (int k = 0; k < 3; k++)
        ck_assert_double_eq(mill_impact_restitution(&table, table.speed[k]), table.restitution[k]);
    ck_assert_double_eq(mill_impact_restitution(&table, 0.0), 0.9);
    ck_assert_double_eq(mill_impact_restitution(&table, 99.0), 0.4);
    ck_assert_double_eq_tol(mill_impact_restitution(&table, 2.0), 0.6, 1e-15);
}

/* At 0.001, 0.1 and 10 times the speed of the point: the equation of motion of viscoelastic spheres
 * (force ~ x^1.5 + a x^0.5 x'), integrated until the force is zero (by Runge-Kutta, rtol 1e-10) */
TEST(a_restitution_that_falls_is_that_of_the_integrated_contact)
{
    static const double integrated[][4] = {{0.9, 0.974, 0.935, 0.848},
                                           {0.8, 0.944, 0.867, 0.709},
                                           {0.7, 0.910, 0.794, 0.582},
                                           {0.5, 0.822, 0.629, 0.365}};
    for (int k = 0; k < 4; k++) {
        const struct mill_fall fall = {1, {3.0}, {integrated[k][0]}, 0.0};
        for (int i = 1; i < 4; i++) {
            const double v = 3.0 * (i == 1 ? 1e-3 : i == 2 ? 0.1 : 10.0);
            ck_assert_double_eq_tol(mill_impact_restitution(&fall, v), integrated[k][i], 0.005);
        }
    }
}

TEST(a_sticking_contact_reverses_the_slip_by_exactly_its_restitution)
{
    uint64_t seed = 7;
    for (int k = 0; k < 10000; k++) {
        struct body a = random_ball(&seed), b = random_ball(&seed);
        struct mill_law law = random_law(&seed);
        law.friction = 1e30;
        if (k % 2)
            b.mass = (double)INFINITY;
        const vec3 n = closing_normal(&seed, &a, &b);
        const vec3 before = slip_of(&a, &b, n);
        const vec3 g_t = vec3_axpy(before, -vec3_dot(before, n), n);
        collide(&law, 0.0, &a, &b, n);
        const vec3 after = slip_of(&a, &b, n);
        const vec3 h_t = vec3_axpy(after, -vec3_dot(after, n), n);
        const double size = vec3_norm(before) + vec3_norm(a.v) + vec3_norm(b.v) +
                            a.radius * vec3_norm(a.spin) + b.radius * vec3_norm(b.spin);
        ck_assert_double_le(vec3_norm(vec3_axpy(h_t, law.tangential, g_t)), 1e-13 * size);
    }
}

TEST(friction_never_exceeds_coulombs_bound_and_opposes_the_slip)
{
    uint64_t seed = 8;
    int sliding = 0, sticking = 0;
    for (int k = 0; k < 20000; k++) {
        struct body a = random_ball(&seed), b = random_ball(&seed);
        struct mill_law law = random_law(&seed);
        law.friction = log_uniform(&seed, 1e-3, 3.0);
        const vec3 n = closing_normal(&seed, &a, &b), slip = slip_of(&a, &b, n);
        const vec3 g_t = vec3_axpy(slip, -vec3_dot(slip, n), n);
        const struct mill_rebound rebound = collide(&law, 0.0, &a, &b, n);
        const double j_n = vec3_dot(rebound.impulse, n);
        const vec3 j_t = vec3_axpy(rebound.impulse, -j_n, n);
        const double most = law.friction * j_n, s_t = vec3_norm(g_t);
        const double stick = 2.0 / 7.0 * reduced_mass(&a, &b) * (1.0 + law.tangential) * s_t;
        const double rounding = 1e-14 * vec3_norm(rebound.impulse);
        ck_assert_double_le(vec3_norm(j_t), most + rounding);
        ck_assert_double_le(fabs(vec3_norm(j_t) - fmin(most, stick)), rounding);
        ck_assert_double_le(fabs(vec3_dot(j_t, g_t) - vec3_norm(j_t) * s_t), rounding * s_t);
        sliding += most < stick;
        sticking += most > stick;
    }
    ck_assert_int_gt(sliding, 1000);
    ck_assert_int_gt(sticking, 1000);
}

TEST(equal_balls_lose_what_the_formula_says)
{
    uint64_t seed = 9;
    for (int k = 0; k < 20000; k++) {
        struct body a = random_ball(&seed), b = random_ball(&seed);
        const struct mill_law law = random_law(&seed);
        b.mass = a.mass;
        b.radius = a.radius;
        const vec3 n = closing_normal(&seed, &a, &b), slip = slip_of(&a, &b, n);
        const struct mill_rebound rebound = collide(&law, 0.0, &a, &b, n);
        const double g_n = vec3_dot(slip, n), g_t = tangential_size(slip, n);
        const double e = law.restitution;
        /* how much of the slip comes back: beta0 when sticking, less reversal when sliding */
        const double slide = -1.0 + 3.5 * law.friction * (1.0 + e) * g_n / g_t;
        const double beta = law.friction > 0.0 ? fmin(law.tangential, slide) : -1.0;
        const double loss =
            a.mass / 4.0 *
            ((1.0 - e * e) * g_n * g_n + 2.0 / 7.0 * (1.0 - beta * beta) * g_t * g_t);
        ck_assert_double_eq_tol(rebound.dissipation, loss,
                                1e-13 * a.mass * (g_n * g_n + g_t * g_t));
    }
}

/* ---- the rebound floor ---- */

TEST(no_contact_ends_slower_than_the_floor)
{
    uint64_t seed = 10;
    int floored = 0;
    for (int k = 0; k < 20000; k++) {
        struct body a = random_ball(&seed), b = random_ball(&seed);
        const struct mill_law law = random_law(&seed);
        const double lift = log_uniform(&seed, 1e-4, 10.0);
        const vec3 n = closing_normal(&seed, &a, &b), slip = slip_of(&a, &b, n);
        const double g_n = vec3_dot(slip, n), m = reduced_mass(&a, &b);
        const struct mill_rebound rebound = collide(&law, lift, &a, &b, n);
        const double after = -vec3_dot(slip_of(&a, &b, n), n);
        const double expected = fmax(law.restitution * g_n, lift);
        ck_assert_double_eq_tol(after, expected,
                                1e-13 *
                                    (expected + vec3_norm(slip) + vec3_norm(a.v) + vec3_norm(b.v)));
        ck_assert_int_eq(rebound.floored, law.restitution * g_n < lift);
        ck_assert_double_eq_tol(rebound.dissipation_normal,
                                0.5 * m * (g_n * g_n - expected * expected),
                                1e-14 * m * (g_n * g_n + expected * expected));
        floored += rebound.floored;
    }
    ck_assert_int_gt(floored, 1000);
    ck_assert_int_lt(floored, 19000);
}

TEST(a_touch_without_speed_is_lifted_by_the_floor_at_the_cost_booked)
{
    const struct mill_law law = {0.8, 0.3, 0.5};
    const double m = 5e-4, lift = 5e-3;
    const vec3 n = {0.0, 0.0, 1.0};
    const struct mill_rebound rebound =
        mill_impact_resolve(&law, lift, m, n, vec3_make(0.0, 0.0, 0.0));
    ck_assert(rebound.floored);
    ck_assert_double_eq(rebound.impulse.z, m * lift);
    ck_assert_double_eq(rebound.normal_speed, 0.0);
    ck_assert_double_eq_tol(rebound.dissipation, -0.5 * m * lift * lift, 1e-24);
}

/* Rounding may hand over a contact that opens by a hair; it counts as a touch without speed, and
 * the books stay exact. */
TEST(a_contact_that_opens_already_is_lifted_and_booked_exactly)
{
    uint64_t seed = 11;
    for (int k = 0; k < 5000; k++) {
        struct body a = random_ball(&seed), b = random_ball(&seed);
        const struct mill_law law = random_law(&seed);
        const vec3 n = vec3_scale(closing_normal(&seed, &a, &b), -1.0);
        const double opening = -vec3_dot(slip_of(&a, &b, n), n), lift = 5e-3;
        const double before = energy(&a) + energy(&b);
        const struct mill_rebound rebound = collide(&law, lift, &a, &b, n);
        const double after = -vec3_dot(slip_of(&a, &b, n), n);
        const double size = before + energy(&a) + energy(&b);
        ck_assert_double_eq(rebound.normal_speed, 0.0);
        ck_assert(rebound.floored);
        ck_assert_double_ge(after, fmax(lift, opening) * (1.0 - 1e-9));
        ck_assert_double_le(fabs(before - energy(&a) - energy(&b) - rebound.dissipation),
                            1e-13 * size);
    }
}

/* Newton's equation with Hertz's force, in small steps */
TEST(a_contact_of_steel_lasts_as_long_as_hertz_says)
{
    const double mass = 2.5e-4, radius = 1.25e-3, steel = 2.1e11 / (2.0 * 0.91), step = 1e-9;
    for (int k = 0; k < 3; k++) {
        const double speed = (double[]){0.1, 1.0, 7.0}[k];
        double x = speed * step, v = speed, time = step;
        for (; x > 0.0; time += step) {
            v -= step / mass * 4.0 / 3.0 * steel * sqrt(radius) * x * sqrt(x);
            x += v * step;
        }
        ck_assert_double_eq_tol(mill_impact_duration(mass, radius, speed), time, 1e-3 * time);
    }
}

int main(void)
{
    return unit_run("impact");
}
