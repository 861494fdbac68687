/* Claims about motions: a pose is where its turns, one after the other, take a frame; velocities
 * and bounds are held against finite differences of the pose. */
#include "motion_fixture.h"

enum { MANY = 300, ALL = MOTION_KINDS + 2 };

/* Through the links from the top down; a table's rows are held elsewhere */
static vec3 carried(const struct chain *c, vec3 point, double t)
{
    for (int k = c->count - 1; k >= 0; k--) {
        const struct link *is = &c->is[k];
        const struct mill_shift *shift = &is->shift;
        const double wave = 2.0 * PI * is->swing.frequency * t + is->swing.phase;
        const double w = 2.0 * PI * shift->frequency * t;
        const struct mill_pose at = c->link[k]->type->pose(c->link[k], t);
        if (is->kind == TURN)
            point =
                vec3_add(is->turn.centre, turned(vec3_sub(point, is->turn.centre), is->turn.axis,
                                                 is->turn.angle + is->turn.speed * t));
        else if (is->kind == SWING)
            point =
                vec3_add(is->swing.centre, turned(vec3_sub(point, is->swing.centre), is->swing.axis,
                                                  is->swing.amplitude * sin(wave)));
        else if (is->kind == SHIFT)
            point = vec3_add(point, vec3_make(shift->amplitude.x * sin(w + shift->phase.x),
                                              shift->amplitude.y * sin(w + shift->phase.y),
                                              shift->amplitude.z * sin(w + shift->phase.z)));
        else
            point = mill_pose_out(&at, point);
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

LOOP_TEST(a_pose_is_where_its_turns_take_a_frame, ALL)
{
    uint64_t seed = 1 + (uint64_t)_i;
    for (int n = 0; n < MANY; n++) {
        struct chain c = random_chain(&seed, _i);
        chain_open(&c);
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

LOOP_TEST(velocities_are_the_rates_of_the_pose, ALL)
{
    uint64_t seed = 2 + (uint64_t)_i;
    for (int n = 0; n < MANY; n++) {
        struct chain c = random_chain(&seed, _i);
        chain_open(&c);
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

SLOW_TEST(bounds_hold_at_all_times, ALL)
{
    uint64_t seed = 3 + (uint64_t)_i;
    for (int n = 0; n < MANY; n++) {
        struct chain c = random_chain(&seed, _i);
        chain_open(&c);
        const vec3 point = below(&seed, 3) ? vec3_scale(direction(&seed), 0.2) : nought;
        const struct mill_motion_bounds o = mill_motion_bounds(c.top, point);
        const bool constant = vec3_norm(o.axis) > 0.0;
        ck_assert(!constant || fabs(vec3_norm(o.axis) - 1.0) < 1e-15);
        for (int k = 0; k < 100; k++) {
            const double t = uniform(&seed, 0.0, 2.0), h = 1e-6, hair = 1.0 + 1e-9;
            const struct mill_pose p = mill_motion_pose(c.top, t);
            const struct mill_pose a = mill_motion_pose(c.top, t - h);
            const struct mill_pose b = mill_motion_pose(c.top, t + h);
            const vec3 at = mill_pose_out(&p, point);
            const vec3 v = mill_pose_velocity(&p, at);
            const vec3 push = difference(mill_pose_velocity(&b, mill_pose_out(&b, point)),
                                         mill_pose_velocity(&a, mill_pose_out(&a, point)), h);
            const vec3 spin_up = difference(b.angular_velocity, a.angular_velocity, h);
            ck_assert_double_le(vec3_norm(vec3_sub(at, o.home)), o.far * hair + 1e-15);
            ck_assert_double_le(vec3_norm(v), o.speed * hair + 1e-14);
            ck_assert_double_le(vec3_norm(push), o.acceleration * (1.0 + 1e-6) + 1e-4);
            ck_assert_double_le(vec3_norm(p.angular_velocity), o.turning * hair);
            ck_assert_double_le(vec3_norm(spin_up), o.spin_up * (1.0 + 1e-6) + 1e-4);
            if (constant)
                same(vec3_cross(p.angular_velocity, o.axis), nought, 1e-12);
        }
        chain_close(&c);
    }
}

/* Of a single turn they are what it reaches, and of two about one axis the axis is known. */
TEST(bounds_are_no_larger_than_they_must_be)
{
    struct chain c = {
        .is = {{.turn = {.centre = {0.0, 0.3, 0.0}, .axis = {0.0, 0.0, 5.0}, .speed = 10.0}},
               {.turn = {.axis = {0.0, 0.0, -1.0}, .speed = 20.0}}},
        .count = 2};
    chain_open(&c);
    const struct mill_motion_bounds one = mill_motion_bounds(c.link[0], nought);
    const struct mill_motion_bounds two = mill_motion_bounds(c.link[1], nought);
    const struct mill_motion_bounds off = mill_motion_bounds(c.link[1], vec3_make(0.0, 0.1, 7.0));
    same(one.home, vec3_make(0.0, 0.3, 0.0), 0.0);
    ck_assert_double_eq_tol(one.far, 0.3, 1e-15);
    ck_assert_double_eq_tol(one.speed, 3.0, 1e-15);
    ck_assert_double_eq_tol(one.acceleration, 30.0, 1e-13);
    ck_assert_double_eq(one.turning, 10.0);
    ck_assert_double_eq(one.spin_up, 0.0);
    ck_assert_double_eq(two.turning, 30.0);
    ck_assert_double_eq(two.spin_up, 0.0);
    ck_assert_double_eq(fabs(two.axis.z), 1.0);
    /* on the carrier's radius, and around it */
    ck_assert_double_eq_tol(off.far, 0.3 + 0.1, 1e-15);
    ck_assert_double_eq_tol(off.speed, 10.0 * 0.3 + 30.0 * 0.1, 1e-14);
    ck_assert_double_eq_tol(off.acceleration, 100.0 * 0.3 + 900.0 * 0.1, 1e-12);
    const struct mill_motion_bounds none = mill_motion_bounds(NULL, nought);
    ck_assert(none.far == 0.0 && none.speed == 0.0 && none.turning == 0.0);
    chain_close(&c);
}

static void same_pose(const struct mill_pose *a, const struct mill_pose *b, double tolerance)
{
    same(a->place, b->place, tolerance);
    same(a->x, b->x, tolerance);
    same(a->y, b->y, tolerance);
    same(a->z, b->z, tolerance);
}

LOOP_TEST(a_restart_of_local_time_keeps_the_poses, ALL)
{
    uint64_t seed = 4 + (uint64_t)_i;
    for (int n = 0; n < MANY; n++) {
        struct chain c = random_chain(&seed, _i);
        chain_open(&c);
        double t[10];
        struct mill_pose before[10];
        for (int k = 0; k < 10; k++) {
            t[k] = uniform(&seed, 0.0, 0.125);
            before[k] = mill_motion_pose(c.top, t[k]);
        }
        for (int k = 0; k < c.count; k++)
            c.link[k]->type->restart(c.link[k], 0.0625, 0.0625);
        for (int k = 0; k < 10; k++) {
            const struct mill_pose after = mill_motion_pose(c.top, t[k] - 0.0625);
            same_pose(&before[k], &after, 1e-12);
        }
        chain_close(&c);
    }
}

/* 17 hours of simulated time; a rotor's angle is summed up, by a bit of 2 pi a restart and a turn
 */
TEST(phases_stay_small_and_true_over_a_million_restarts)
{
    static const double speed[] = {0.0, 104.71975511965977, -1e4, 3e-7};
    for (int k = 0; k < 8; k++) {
        const double w = speed[k % 4];
        const bool rotor = k < 4;
        struct chain c = {.is = {{.turn = {.axis = {1.0, 0.0, 0.0}, .speed = w, .angle = 0.3}}},
                          .count = 1};
        if (!rotor)
            c.is[0].turn.centre.x = 0.01;
        chain_open(&c);
        for (int n = 1; n <= 1000000; n++)
            mill_turn_type.restart(c.link[0], 0.0625 * n, 0.0625);
        const struct mill_pose p = mill_motion_pose(c.top, 0.0), q = mill_motion_pose(c.top, 1e-3);
        const long double turn = 6.283185307179586476925286766559L;
        const long double angle = remainderl(0.3L + (long double)w * 62500.0L, turn);
        const double off = remainder(atan2(p.y.z, p.y.y) - (double)angle, 2.0 * PI);
        /* long double itself knows the angle to some 1e-19 of it */
        const double most =
            rotor ? 1e6 * (1e-15 + 2.5e-16 * fabs(w) * 0.0625) : 1e-15 + 1e-14 * fabs(w);
        ck_assert_double_lt(fabs(off), most);
        /* the angle itself is small: a step of time shows in full */
        const double step = remainder(atan2(q.y.z, q.y.y) - atan2(p.y.z, p.y.y), 2.0 * PI);
        ck_assert_double_eq_tol(step, remainder(1e-3 * w, 2.0 * PI), 1e-14);
        chain_close(&c);
    }
}

/* 17 hours and a bit: swings, shifts and tables are where whole periods have left them. */
TEST(waves_and_tables_do_not_drift)
{
    uint64_t seed = 5;
    for (int n = 0; n < MANY; n++) {
        struct chain c = random_chain(&seed, 2 + n % 3);
        struct link *is = &c.is[0];
        is->swing.frequency = is->shift.frequency = (1 + below(&seed, 40)) * 0.25;
        const double late = 62500.0;
        is->row[ROWS - 1][0] = is->row[0][0] + 0.25; /* as many tables as there are quarters */
        for (int k = 1; k < ROWS - 1; k++)
            is->row[k][0] = is->row[0][0] + 0.25 * k / (ROWS - 1);
        chain_open(&c);
        const double t = uniform(&seed, 0.0, 0.0625);
        const struct mill_pose before = mill_motion_pose(c.top, t);
        c.top->type->restart(c.link[0], late, 0.0625);
        const struct mill_pose after = mill_motion_pose(c.top, t);
        same_pose(&before, &after, 2e-15);
        chain_close(&c);
    }
}

TEST(a_table_goes_through_its_rows_and_closes_smoothly)
{
    uint64_t seed = 6;
    for (int n = 0; n < MANY; n++) {
        struct chain c = random_chain(&seed, 1 + TABLE);
        chain_open(&c);
        const double(*row)[7] = (const double(*)[7])c.is[0].row;
        const double period = row[ROWS - 1][0] - row[0][0], h = 1e-7;
        for (int k = 0; k < ROWS; k++) {
            const double t = row[k][0] - row[0][0];
            const struct mill_pose p = mill_motion_pose(c.top, t);
            const vec3 r = {row[k][4], row[k][5], row[k][6]}, way = direction(&seed);
            same(p.place, vec3_make(row[k][1], row[k][2], row[k][3]), 1e-15);
            same(mill_pose_turn_out(&p, way), turned(way, r, vec3_norm(r)), 1e-14);
        }
        const struct mill_pose end = mill_motion_pose(c.top, period - h);
        const struct mill_pose begin = mill_motion_pose(c.top, h);
        same_pose(&end, &begin, 1e-4);
        same(end.velocity, begin.velocity, 1e-3);
        same(end.angular_velocity, begin.angular_velocity,
             1e-3 * (10.0 + vec3_norm(end.angular_velocity)));
        chain_close(&c);
    }
}

TEST(motions_repeat_after_their_cycle)
{
    struct chain c = {.count = 2};
    c.is[0].turn = (struct mill_turn){.axis = {0.0, 0.0, 1.0}, .speed = 10.0};
    c.is[1].turn = (struct mill_turn){.axis = {0.0, 0.0, 1.0}, .speed = -21.9};
    chain_open(&c);
    const struct mill_motion_cycle two = mill_motion_cycle(c.link, 2);
    const struct mill_motion_cycle one = mill_motion_cycle(c.link, 1);
    ck_assert_int_eq(one.singles, 1);
    ck_assert_double_eq(one.period, 2.0 * PI / 10.0);
    ck_assert_int_eq(two.singles, 100);
    ck_assert_double_eq(two.single, 2.0 * PI / 10.0);
    chain_close(&c);
    c.is[1].turn.speed = -10.0 * sqrt(5.0);
    chain_open(&c);
    const struct mill_motion_cycle none = mill_motion_cycle(c.link, 2);
    ck_assert_int_eq(none.singles, 0);
    ck_assert_double_eq(none.period, 2.0 * PI / 10.0);
    chain_close(&c);
    c.is[0].turn.speed = 0.0;
    chain_open(&c);
    ck_assert(isinf(mill_motion_cycle(c.link, 1).period));
    chain_close(&c);
}

int main(void)
{
    return unit_run("motion");
}
