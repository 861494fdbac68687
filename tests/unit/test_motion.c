/* Claims about motions: a pose is where its turns, one after the other, take a frame; velocities
 * and bounds are held against finite differences of the pose. */
#include "draws.h"
#include "millsim/motion.h"

enum { CHAIN = 3, MANY = 300 };

/* Up to three turns, each on the one before it */
struct chain {
    struct mill_turn is[CHAIN];
    struct mill_motion *turn[CHAIN];
    int count;
    const struct mill_motion *top;
};

static void chain_open(struct chain *c)
{
    for (int k = 0; k < c->count; k++) {
        c->turn[k] = mill_turn_type.create(&c->is[k]);
        ck_assert_ptr_nonnull(c->turn[k]);
        c->turn[k]->on = k > 0 ? c->turn[k - 1] : NULL;
    }
    c->top = c->turn[c->count - 1];
}

static void chain_close(struct chain *c)
{
    for (int k = 0; k < c->count; k++)
        free(c->turn[k]);
}

/* _i 0: a rotor. Others: turns about any axis through any centre, some about one axis, as those of
 * a planetary mill, some that stand */
static struct chain random_chain(uint64_t *seed, int which)
{
    struct chain c = {.count = which == 0 ? 1 : 1 + below(seed, CHAIN)};
    const bool parallel = below(seed, 3) == 0;
    for (int k = 0; k < c.count; k++) {
        struct mill_turn *is = &c.is[k];
        is->axis = which == 0          ? vec3_make(2.0, 0.0, 0.0)
                   : parallel && k > 0 ? vec3_scale(c.is[0].axis, -2.0)
                                       : vec3_scale(direction(seed), log_uniform(seed, 0.1, 10.0));
        is->centre = which > 0 && below(seed, 4)
                         ? vec3_scale(direction(seed), uniform(seed, 0.0, 0.3))
                         : nought;
        is->speed = below(seed, 5) ? uniform(seed, -100.0, 100.0) : 0.0;
        is->angle = uniform(seed, -10.0, 10.0);
    }
    chain_open(&c);
    return c;
}

/* Rodrigues' formula, on its own */
static vec3 turned(vec3 a, vec3 axis, double angle)
{
    const vec3 e = vec3_scale(axis, 1.0 / vec3_norm(axis));
    const vec3 along = vec3_scale(e, vec3_dot(e, a));
    return vec3_axpy(vec3_axpy(along, cos(angle), vec3_sub(a, along)), sin(angle),
                     vec3_cross(e, a));
}

static vec3 carried(const struct chain *c, vec3 point, double t)
{
    for (int k = c->count - 1; k >= 0; k--) {
        const struct mill_turn *is = &c->is[k];
        point = vec3_add(is->centre,
                         turned(vec3_sub(point, is->centre), is->axis, is->angle + is->speed * t));
    }
    return point;
}

static void same(vec3 a, vec3 b, double tolerance)
{
    ck_assert_msg(vec3_norm(vec3_sub(a, b)) <= tolerance, "(%g %g %g), not (%g %g %g)", a.x, a.y,
                  a.z, b.x, b.y, b.z);
}

static vec3 difference(vec3 a, vec3 b, double h)
{
    return vec3_scale(vec3_sub(a, b), 0.5 / h);
}

START_TEST(a_pose_is_where_its_turns_take_a_frame)
{
    uint64_t seed = 1 + (uint64_t)_i;
    for (int n = 0; n < MANY; n++) {
        struct chain c = random_chain(&seed, _i);
        const double t = uniform(&seed, 0.0, 0.0625);
        const struct mill_pose p = mill_motion_pose(c.top, t);
        const vec3 point = vec3_scale(direction(&seed), 0.3), way = direction(&seed);
        same(mill_pose_out(&p, point), carried(&c, point, t), 1e-14);
        same(mill_pose_in(&p, mill_pose_out(&p, point)), point, 1e-15);
        same(mill_pose_turn_in(&p, mill_pose_turn_out(&p, way)), way, 1e-14);
        same(mill_pose_turn_out(&p, way), vec3_sub(mill_pose_out(&p, way), p.place), 1e-14);
        ck_assert_double_eq_tol(vec3_norm(p.x), 1.0, 2e-15);
        ck_assert_double_eq_tol(vec3_norm(p.y), 1.0, 2e-15);
        ck_assert_double_eq_tol(vec3_dot(p.x, p.y), 0.0, 2e-15);
        same(vec3_cross(p.x, p.y), p.z, 2e-15);
        chain_close(&c);
    }
}
END_TEST

START_TEST(velocities_are_the_rates_of_the_pose)
{
    uint64_t seed = 2 + (uint64_t)_i;
    for (int n = 0; n < MANY; n++) {
        struct chain c = random_chain(&seed, _i);
        const double t = uniform(&seed, 0.0, 0.0625), h = 1e-7;
        const struct mill_pose p = mill_motion_pose(c.top, t);
        const struct mill_pose a = mill_motion_pose(c.top, t - h),
                               b = mill_motion_pose(c.top, t + h);
        const vec3 point = vec3_scale(direction(&seed), 0.3);
        same(p.velocity, difference(b.place, a.place, h), 1e-6);
        same(vec3_cross(p.angular_velocity, p.x), difference(b.x, a.x, h), 1e-5);
        same(vec3_cross(p.angular_velocity, p.y), difference(b.y, a.y, h), 1e-5);
        same(mill_pose_velocity(&p, mill_pose_out(&p, point)),
             difference(mill_pose_out(&b, point), mill_pose_out(&a, point), h), 1e-5);
        chain_close(&c);
    }
}
END_TEST

START_TEST(bounds_hold_at_all_times)
{
    uint64_t seed = 3 + (uint64_t)_i;
    for (int n = 0; n < MANY; n++) {
        struct chain c = random_chain(&seed, _i);
        const struct mill_motion_bounds o = mill_motion_bounds(c.top);
        const bool constant = vec3_norm(o.axis) > 0.0;
        ck_assert(!constant || fabs(vec3_norm(o.axis) - 1.0) < 1e-15);
        for (int k = 0; k < 100; k++) {
            const double t = uniform(&seed, 0.0, 2.0), h = 1e-6;
            const struct mill_pose p = mill_motion_pose(c.top, t);
            const struct mill_pose a = mill_motion_pose(c.top, t - h);
            const struct mill_pose b = mill_motion_pose(c.top, t + h);
            const double hair = 1.0 + 1e-9;
            const vec3 push = difference(b.velocity, a.velocity, h);
            const vec3 spin_up = difference(b.angular_velocity, a.angular_velocity, h);
            ck_assert_double_le(vec3_norm(p.place), o.far * hair);
            ck_assert_double_le(vec3_norm(p.velocity), o.speed * hair);
            ck_assert_double_le(vec3_norm(push), o.acceleration * (1.0 + 1e-6) + 1e-5);
            ck_assert_double_le(vec3_norm(p.angular_velocity), o.turning * hair);
            ck_assert_double_le(vec3_norm(spin_up), o.spin_up * (1.0 + 1e-6) + 1e-5);
            if (constant)
                same(vec3_cross(p.angular_velocity, o.axis), nought, 1e-12);
        }
        chain_close(&c);
    }
}
END_TEST

/* Of a single turn they are what it reaches, and of two about one axis the axis is known. */
START_TEST(bounds_are_no_larger_than_they_must_be)
{
    struct chain c = {.is = {{.centre = {0.0, 0.3, 0.0}, .axis = {0.0, 0.0, 5.0}, .speed = 10.0},
                             {.axis = {0.0, 0.0, -1.0}, .speed = 20.0}},
                      .count = 2};
    chain_open(&c);
    const struct mill_motion_bounds one = mill_motion_bounds(c.turn[0]);
    const struct mill_motion_bounds two = mill_motion_bounds(c.turn[1]);
    ck_assert_double_eq_tol(one.far, 0.6, 1e-15);
    ck_assert_double_eq_tol(one.speed, 3.0, 1e-15);
    ck_assert_double_eq_tol(one.acceleration, 30.0, 1e-13);
    ck_assert_double_eq(one.turning, 10.0);
    ck_assert_double_eq(one.spin_up, 0.0);
    ck_assert_double_eq(two.turning, 30.0);
    ck_assert_double_eq(two.spin_up, 0.0);
    ck_assert_double_eq(fabs(two.axis.z), 1.0);
    const struct mill_motion_bounds none = mill_motion_bounds(NULL);
    ck_assert(none.far == 0.0 && none.speed == 0.0 && none.turning == 0.0);
    chain_close(&c);
}
END_TEST

static void same_pose(const struct mill_pose *a, const struct mill_pose *b, double tolerance)
{
    same(a->place, b->place, tolerance);
    same(a->x, b->x, tolerance);
    same(a->y, b->y, tolerance);
    same(a->z, b->z, tolerance);
}

START_TEST(a_restart_of_local_time_keeps_the_poses)
{
    uint64_t seed = 4 + (uint64_t)_i;
    for (int n = 0; n < MANY; n++) {
        struct chain c = random_chain(&seed, _i);
        double t[10];
        struct mill_pose before[10];
        for (int k = 0; k < 10; k++) {
            t[k] = uniform(&seed, 0.0, 0.125);
            before[k] = mill_motion_pose(c.top, t[k]);
        }
        for (int k = 0; k < c.count; k++)
            c.turn[k]->type->restart(c.turn[k], 0.0625);
        for (int k = 0; k < 10; k++) {
            const struct mill_pose after = mill_motion_pose(c.top, t[k] - 0.0625);
            same_pose(&before[k], &after, 1e-12);
        }
        chain_close(&c);
    }
}
END_TEST

/* 17 hours of simulated time */
START_TEST(angles_stay_small_and_true_over_a_million_restarts)
{
    static const double speed[] = {0.0, 104.71975511965977, -1e4, 3e-7};
    for (int k = 0; k < 4; k++) {
        struct chain c = {.is = {{.axis = {1.0, 0.0, 0.0}, .speed = speed[k], .angle = 0.3}},
                          .count = 1};
        chain_open(&c);
        for (int n = 0; n < 1000000; n++)
            mill_turn_type.restart(c.turn[0], 0.0625);
        const struct mill_pose p = mill_motion_pose(c.top, 0.0), q = mill_motion_pose(c.top, 1e-3);
        /* each restart may round the angle and its turns off, by a bit of 2 pi */
        const long double turn = 6.283185307179586476925286766559L;
        const long double angle = remainderl(0.3L + (long double)speed[k] * 62500.0L, turn);
        const double off = remainder(atan2(p.y.z, p.y.y) - (double)angle, 2.0 * PI);
        ck_assert_double_lt(fabs(off), 1e6 * (1e-15 + 2.5e-16 * fabs(speed[k]) * 0.0625));
        /* the angle itself is small: a step of time shows in full */
        const double step = remainder(atan2(q.y.z, q.y.y) - atan2(p.y.z, p.y.y), 2.0 * PI);
        ck_assert_double_eq_tol(step, remainder(1e-3 * speed[k], 2.0 * PI), 1e-14);
        chain_close(&c);
    }
}
END_TEST

int main(void)
{
    const struct unit_test tests[] = {
        {a_pose_is_where_its_turns_take_a_frame, 2},
        {velocities_are_the_rates_of_the_pose, 2},
        {bounds_hold_at_all_times, 2},
        {bounds_are_no_larger_than_they_must_be, 1},
        {a_restart_of_local_time_keeps_the_poses, 2},
        {angles_stay_small_and_true_over_a_million_restarts, 1},
    };
    return unit_run("motion", tests, sizeof tests / sizeof *tests);
}
