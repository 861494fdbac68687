/* Clashes before a run: their times are those of mills whose clash is known, or of many looks; what
 * may overlap is let be. */
#include "clash_fixture.h"
#include "parts.h"
#include "start/clash.h"

enum { MOST = 64, MESH = 2 * 44 * 46 };

/* ---- a mill of motions and bodies ---- */

struct mill {
    struct mill_setup setup;
    struct mill_turn turn[4];
    struct mill_setup_motion motion[4];
    struct mill_body body[MOST];
    struct mill_setup_surface surface[MOST];
};

static int add_turn(struct mill *m, int on, double speed, vec3 centre, vec3 axis)
{
    const int k = m->setup.motions++;
    m->turn[k] = (struct mill_turn){.centre = centre, .axis = axis, .speed = speed};
    m->motion[k] = (struct mill_setup_motion){&mill_turn_type, &m->turn[k], on, NULL};
    return k;
}

static struct mill_body *add_body(struct mill *m, const struct mill_solid *solid, int motion,
                                  vec3 centre)
{
    const int k = m->setup.surfaces++;
    m->surface[k] = (struct mill_setup_surface){
        .solid = solid, .body = &m->body[k], .number = k, .motion = motion};
    m->body[k] = (struct mill_body){
        .centre = centre, .x = {0.0, 1.0, 0.0}, .y = {0.0, 0.0, 1.0}, .z = {1.0, 0.0, 0.0}};
    return &m->body[k];
}

/* Along x */
static struct mill_body *add_pin(struct mill *m, int motion, vec3 centre, double radius,
                                 double length)
{
    struct mill_body *b = add_body(m, &mill_round_cylinder_solid, motion, centre);
    b->radius = radius;
    b->length = length;
    return b;
}

/* A standing jar along x */
static void add_jar(struct mill *m, int motion, double radius, double length)
{
    add_pin(m, motion, nought, radius, length)->inside = true;
}

/* The drum of the setup, as the first surface */
static void add_drum(struct mill *m, int motion)
{
    ck_assert_int_eq(m->setup.surfaces++, 0);
    m->body[0] = mill_setup_drum_body(&m->setup.drum);
    m->surface[0] = drum_surface(&m->body[0], motion);
}

static struct mill_fault find(struct mill *m)
{
    struct mill_motion *motion[4] = {NULL};
    struct mill_fault fault = {.code = MILL_FAULT_NONE, .unchecked.when = INFINITY};
    for (int k = 0; k < MILL_FAULT_PASSINGS; k++)
        fault.narrowest[k].gap = INFINITY;
    m->setup.motion = m->motion;
    m->setup.surface = m->surface;
    for (int k = 0; k < m->setup.motions; k++) {
        motion[k] = m->motion[k].type->create(m->motion[k].form);
        ck_assert_ptr_nonnull(motion[k]);
        motion[k]->number = k;
        motion[k]->on = m->motion[k].on == MILL_STILL ? NULL : motion[m->motion[k].on];
    }
    ck_assert(mill_clash_find(&m->setup, NULL, motion, &fault));
    for (int k = 0; k < m->setup.motions; k++) {
        ck_assert_ptr_eq(motion[k]->on,
                         m->motion[k].on == MILL_STILL ? NULL : motion[m->motion[k].on]);
        free(motion[k]);
    }
    return fault;
}

static void expect(struct mill *m, enum mill_fault_code code, double when, double within)
{
    const struct mill_fault f = find(m);
    ck_assert_msg(f.code == code, "code %d instead of %d at %.9g s", (int)f.code, (int)code,
                  f.when);
    ck_assert_msg(fabs(f.when - when) <= within, "at %.9g s instead of %.9g s", f.when, when);
}

/* ---- times ---- */

/* Round pins parallel to the axis touch when the chord between their centres is as long as both
 * radii. On its own, and carried around with all that is in the jar. */
LOOP_TEST(a_pin_meets_a_standing_one_at_the_angle_where_it_does, 2)
{
    uint64_t seed = 3 + (uint64_t)_i;
    for (int n = 0; n < 50; n++) {
        struct mill m = {.setup.motions = 0};
        const vec3 x = {1.0, 0.0, 0.0};
        const double speed = log_uniform(&seed, 1.0, 300.0), r = uniform(&seed, 0.05, 0.1);
        const double a = log_uniform(&seed, 5e-4, 0.01), b = log_uniform(&seed, 5e-4, 0.01);
        const double at = uniform(&seed, 0.6, 5.0);
        const int jar =
            _i ? add_turn(&m, MILL_STILL, 71.3, vec3_make(0.0, 0.4, 0.1), x) : MILL_STILL;
        const int rotor = add_turn(&m, jar, speed, nought, x);
        add_jar(&m, jar, 0.15, 0.1);
        add_pin(&m, rotor, vec3_make(0.0, r, 0.0), a, 0.05);
        add_pin(&m, jar, vec3_make(0.03, r * cos(at), r * sin(at)), b, 0.03);
        const double when = (at - 2.0 * asin((a + b) / (2.0 * r))) / speed;
        expect(&m, MILL_FAULT_CLASH, when, 1e-5);
        const struct mill_fault f = find(&m);
        ck_assert(f.ball == 1 && f.other == 2);
        m.body[2].centre.x = 0.0401; /* 0.1 mm beside the end of the other */
        expect(&m, MILL_FAULT_NONE, 0.0, 0.0);
    }
}

/* A box's face meets a box's edge: a paddle and a baffle */
TEST(a_paddle_meets_a_baffle_at_the_angle_where_it_does)
{
    struct mill m = {.setup.motions = 0};
    const int rotor = add_turn(&m, MILL_STILL, 20.0, nought, vec3_make(1.0, 0.0, 0.0));
    add_jar(&m, MILL_STILL, 0.1, 0.1);
    add_body(&m, &mill_box_solid, rotor, vec3_make(0.0, 0.03, 0.0))->size =
        vec3_make(0.06, 0.004, 0.05);
    add_body(&m, &mill_box_solid, MILL_STILL, vec3_make(0.02, 0.0, 0.07))->size =
        vec3_make(0.01, 0.06, 0.01);
    /* the baffle's lower corner is met by the paddle's face, 2 mm from its middle */
    const double corner = sqrt(0.04 * 0.04 + 0.005 * 0.005);
    expect(&m, MILL_FAULT_CLASH, (atan2(0.04, 0.005) - asin(0.002 / corner)) / 20.0, 1e-5);
    m.body[2].centre.z = 0.0903; /* beyond the tip now */
    expect(&m, MILL_FAULT_NONE, 0.0, 0.0);
}

/* Once in 50 turns a ball on an arm on a carrier reaches the farthest, at either side. */
static double farthest(double t)
{
    return fabs(0.06 * cos(2.0 * PI * (50.0 * t) + 2.0) + 0.03 * cos(2.0 * PI * (49.0 * t) + 0.5));
}

TEST(a_body_that_leaves_once_in_fifty_turns_is_found)
{
    struct mill m = {.setup.motions = 0};
    const vec3 x = {1.0, 0.0, 0.0};
    const int outer = add_turn(&m, MILL_STILL, 2.0 * PI * 50.0, nought, x);
    const int inner = add_turn(&m, outer, -2.0 * PI, vec3_make(0.0, 0.06, 0.0), x);
    m.turn[outer].angle = 2.0;
    m.turn[inner].angle = -1.5;
    double best = -1.0, second = -1.0, when = 0.0;
    for (int half = 0; half < 100; half++) {
        double peak = -1.0, at = 0.0;
        for (int k = 0; k < 2000; k++) {
            const double t = (half + k / 2000.0) / 100.0;
            at = farthest(t) > peak ? t : at;
            peak = fmax(peak, farthest(t));
        }
        when = peak > best ? at : when;
        second = peak > best ? best : fmax(second, peak);
        best = fmax(best, peak);
    }
    add_body(&m, &mill_box_solid, MILL_STILL, nought)->inside = true;
    add_body(&m, &mill_round_sphere_solid, inner, vec3_make(0.0, 0.09, 0.0))->radius = 0.002;
    for (int leaves = 0; leaves < 2; leaves++) {
        const double wall = leaves ? 0.5 * (best + second) : best + 1e-6;
        m.body[0].size = vec3_make(2.0 * (wall + 0.002), 0.3, 0.3);
        expect(&m, leaves ? MILL_FAULT_OUTSIDE : MILL_FAULT_NONE, leaves ? when : 0.0, 5e-4);
    }
    ck_assert_double_gt(when, 0.1); /* not in the first turns */
    ck_assert_int_eq(find(&m).other, 1);
}

/* Two planets on a carrier, turning against each other, six pins each, their circles overlap */
static void add_planets(struct mill *m, double radius, double *gap, double *when)
{
    const vec3 x = {1.0, 0.0, 0.0};
    const double speed = 31.0, r = 0.05, apart = 0.088;
    const int sun = add_turn(m, MILL_STILL, 10.0, nought, x);
    add_jar(m, MILL_STILL, 0.2, 0.1);
    *gap = INFINITY;
    for (int p = 0; p < 2; p++) {
        const double at = p ? 0.5 * apart : -0.5 * apart;
        const int planet = add_turn(m, sun, p ? speed : -speed, vec3_make(0.0, at, 0.0), x);
        for (int k = 0; k < 6; k++) {
            const double a = (k + 0.5 * p) * PI / 3.0;
            add_pin(m, planet, vec3_make(0.0, at + r * cos(a), r * sin(a)), radius, 0.08);
        }
    }
    for (int n = 0; n <= 20000; n++) {
        const double t = n * 2.0 * PI / speed / 20000.0;
        for (int i = 0; i < 36; i++) {
            const double a = i % 6 * PI / 3.0 - speed * t, b = (i / 6 + 0.5) * PI / 3.0 + speed * t;
            const double y = apart + r * (cos(b) - cos(a)), z = r * (sin(b) - sin(a));
            const double d = sqrt(y * y + z * z) - 2.0 * radius;
            *when = d < 0.0 && *gap >= 0.0 ? t : *when;
            *gap = fmin(*gap, d);
        }
    }
}

TEST(planets_whose_pins_interleave_pass_or_touch)
{
    double gap, when = 0.0, least;
    struct mill none = {.setup.motions = 0};
    add_planets(&none, 0.0, &gap, &when);
    ck_assert_double_gt(gap, 4e-3);
    struct mill pass = {.setup.motions = 0}, touch = {.setup.motions = 0};
    add_planets(&pass, 0.5 * gap - 1e-4, &least, &when);
    ck_assert_double_eq_tol(least, 2e-4, 1e-9);
    expect(&pass, MILL_FAULT_NONE, 0.0, 0.0);
    add_planets(&touch, 0.5 * gap + 1e-5, &least, &when);
    expect(&touch, MILL_FAULT_CLASH, when, 2e-5);
}

/* Motions without a common period: 1 s, or as long as the setup says */
TEST(without_a_common_period_the_horizon_counts)
{
    struct mill m = {.setup.motions = 0};
    const vec3 x = {1.0, 0.0, 0.0};
    const int a = add_turn(&m, MILL_STILL, 2.0, nought, x);
    const int b = add_turn(&m, MILL_STILL, sqrt(2.0), nought, x);
    add_jar(&m, MILL_STILL, 0.2, 0.1);
    add_pin(&m, a, vec3_make(0.0, 0.1, 0.0), 0.001, 0.05);
    add_pin(&m, b, vec3_make(0.0, 0.0, 0.1), 0.001, 0.05);
    const double when = (0.5 * PI - 2.0 * asin(0.01)) / (2.0 - sqrt(2.0));
    expect(&m, MILL_FAULT_NONE, 0.0, 0.0);
    m.setup.horizon = when - 1e-3;
    expect(&m, MILL_FAULT_NONE, 0.0, 0.0);
    m.setup.horizon = when + 1e-3;
    expect(&m, MILL_FAULT_CLASH, when, 1e-5);
}

static const struct mill_motion_type *const motions[MOTION_KINDS] = {
    &mill_turn_type, &mill_swing_type, &mill_shift_type, &mill_table_type};

/* Of any kind, on one of the motions before it, or on none; never at rest: what stands may overlap
 */
static void add_any(uint64_t *seed, struct mill *m, struct link *is)
{
    const int k = m->setup.motions++, kind = below(seed, MOTION_KINDS);
    random_link(seed, is, kind);
    is->turn.speed += is->turn.speed == 0.0 ? 20.0 : 0.0;
    is->swing.frequency += is->swing.frequency == 0.0 ? 3.0 : 0.0;
    is->shift.frequency += is->shift.frequency == 0.0 ? 3.0 : 0.0;
    is->table = (struct mill_table){ROWS, (const double(*)[7])is->row};
    const void *form[MOTION_KINDS] = {&is->turn, &is->swing, &is->shift, &is->table};
    m->motion[k] =
        (struct mill_setup_motion){motions[kind], form[kind], below(seed, k + 1) - 1, NULL};
}

/* What a look at the mill at one time tells: bounds of the gap between its two bodies */
static struct mill_part_gap gap_at(const struct mill *m, struct mill_motion *const *motion,
                                   const struct mill_clash_solid solid[2], double t)
{
    struct mill_pose pose[2];
    for (int k = 0; k < 2; k++)
        pose[k] =
            mill_motion_pose(m->surface[k].motion < 0 ? NULL : motion[m->surface[k].motion], t);
    const struct mill_pose in = {.place = mill_pose_in(&pose[1], pose[0].place),
                                 .x = mill_pose_turn_in(&pose[1], pose[0].x),
                                 .y = mill_pose_turn_in(&pose[1], pose[0].y),
                                 .z = mill_pose_turn_in(&pose[1], pose[0].z)};
    return mill_clash_gap_solids(&solid[0], &solid[1], &in, 1e-9);
}

/* Any bodies on any motions: none of many looks finds them together before the time that is told,
 * and then they touch. */
SLOW_TEST(no_clash_is_missed_and_none_invented, 3)
{
    uint64_t seed = 11 + (uint64_t)_i;
    int met = 0, missed = 0;
    for (int n = 0; n < unit_draws(100); n++) {
        struct mill m = {.setup.horizon = 0.5};
        struct link link[3];
        struct lone body[2];
        struct mill_motion *motion[3];
        struct mill_clash_solid solid[2];
        for (int k = 0; k < 3; k++)
            add_any(&seed, &m, &link[k]);
        for (int k = 0; k < 2; k++) {
            lone_open(&seed, &body[k], below(&seed, KINDS), vec3_scale(direction(&seed), 0.15));
            mill_clash_solid_free(&body[k].solid);
            add_body(&m, body[k].kind, k ? below(&seed, 3) - 1 : 2, nought);
            m.body[k] = body[k].body;
        }
        const struct mill_fault f = find(&m);
        for (int k = 0; k < 3; k++) {
            motion[k] = m.motion[k].type->create(m.motion[k].form);
            motion[k]->on = m.motion[k].on < 0 ? NULL : motion[m.motion[k].on];
        }
        for (int k = 0; k < 2; k++)
            ck_assert(mill_clash_solid_init(&solid[k], &m.setup, k, motion));
        const double size = solid[0].all.radius + solid[1].all.radius;
        const double until = f.code == MILL_FAULT_NONE ? 0.5 : f.when;
        for (int k = 0; k < 2000 && until > 0.0; k++)
            ck_assert_double_gt(gap_at(&m, motion, solid, until * k / 2000.0).most, 0.0);
        if (f.code != MILL_FAULT_NONE)
            ck_assert_double_le(gap_at(&m, motion, solid, f.when).least, 1.001e-6 * size);
        met += f.code == MILL_FAULT_CLASH && f.when > 0.0;
        missed += f.code == MILL_FAULT_NONE;
        for (int k = 0; k < 2; k++)
            mill_clash_solid_free(&solid[k]);
        for (int k = 0; k < 3; k++)
            free(motion[k]);
    }
    ck_assert_int_gt(met, unit_draws(4));
    ck_assert_int_gt(missed, unit_draws(5));
}

/* [m] how far a place of the laboratory is from the container's walls at t, < 0: outside */
static double depth(const struct mill *m, struct mill_motion *const *motion, vec3 place, double t)
{
    const int on = m->surface[0].motion;
    const struct mill_pose pose = mill_motion_pose(on < 0 ? NULL : motion[on], t);
    return (double)wide_gap(m->surface[0].solid, &m->body[0], wide_of(mill_pose_in(&pose, place)));
}

/* The same of the container: no place of the body is found outside before it is told to leave, and
 * then some place is at a wall. */
SLOW_TEST(no_leaving_is_missed_and_none_invented, KINDS)
{
    uint64_t seed = 21 + (uint64_t)_i;
    int left = 0, stayed = 0;
    for (int n = 0; n < 100; n++) {
        struct mill m = {.setup.horizon = 0.5};
        struct link link[3];
        struct lone jar, body;
        struct mill_motion *motion[3];
        for (int k = 0; k < 3; k++)
            add_any(&seed, &m, &link[k]);
        lone_open(&seed, &jar, _i, nought);
        lone_open(&seed, &body, below(&seed, KINDS), vec3_scale(direction(&seed), 0.03));
        add_body(&m, jar.kind, below(&seed, 3) - 1, nought)->inside = true;
        add_body(&m, body.kind, 2, nought);
        jar.body.inside = true;
        jar.body.rounding = 0.0;
        jar.body.size = vec3_make(0.5, 0.6, 0.7);
        jar.body.radius = jar.body.end_radius = uniform(&seed, 0.1, 0.5);
        jar.body.length = 0.8;
        m.body[0] = jar.body;
        m.body[1] = body.body;
        const struct mill_fault f = find(&m);
        for (int k = 0; k < 3; k++) {
            motion[k] = m.motion[k].type->create(m.motion[k].form);
            motion[k]->on = m.motion[k].on < 0 ? NULL : motion[m.motion[k].on];
        }
        const double until = f.code == MILL_FAULT_NONE ? 0.5 : f.when;
        double least = INFINITY;
        for (int k = 0; k < 4000; k++) {
            const double t = until * k / 4000.0;
            const struct mill_pose own = mill_motion_pose(motion[2], t),
                                   end = mill_motion_pose(motion[2], until);
            const vec3 place = place_of(&seed, &body);
            if (f.code == MILL_FAULT_NONE || f.when > 0.0)
                ck_assert_double_gt(depth(&m, motion, mill_pose_out(&own, place), t), 0.0);
            least = fmin(least, depth(&m, motion, mill_pose_out(&end, place), until));
        }
        if (f.code != MILL_FAULT_NONE)
            ck_assert_double_lt(least, 0.1 * body.solid.all.radius);
        left += f.code == MILL_FAULT_OUTSIDE && f.when > 0.0;
        stayed += f.code == MILL_FAULT_NONE;
        mill_clash_solid_free(&jar.solid);
        mill_clash_solid_free(&body.solid);
        for (int k = 0; k < 3; k++)
            free(motion[k]);
    }
    ck_assert_int_gt(left, 2);
    ck_assert_int_gt(stayed, 5);
}

/* ---- what may overlap ---- */

TEST(overlaps_that_harm_nobody_are_allowed)
{
    struct mill m = {.setup.motions = 0};
    const vec3 x = {1.0, 0.0, 0.0};
    const int jar = add_turn(&m, MILL_STILL, 9.0, vec3_make(0.0, 0.3, 0.0), x);
    const int rotor = add_turn(&m, jar, 77.0, nought, vec3_make(3.0, 0.0, 0.0));
    add_jar(&m, jar, 0.1, 0.1);
    /* a lifter through the wall, a shaft through both lids, pins in it, a disc on it, and a
       standing bearing around it */
    add_body(&m, &mill_box_solid, jar, vec3_make(0.0, 0.1, 0.0))->size = vec3_make(0.02, 0.01, 0.2);
    add_pin(&m, rotor, nought, 0.01, 0.2);
    add_body(&m, &mill_round_capsule_solid, rotor, vec3_make(0.0, 0.03, 0.0))->radius = 0.004;
    add_pin(&m, rotor, vec3_make(0.02, 0.0, 0.0), 0.05, 0.01);
    add_pin(&m, jar, vec3_make(-0.05, 0.0, 0.0), 0.02, 0.03);
    add_body(&m, &mill_box_solid, jar, vec3_make(0.05, 0.0, 0.0))->size =
        vec3_make(0.05, 0.05, 0.01);
    expect(&m, MILL_FAULT_NONE, 0.0, 0.0);
    /* a shaft of four edges would stir the lid */
    m.surface[2].solid = &mill_box_solid;
    m.body[2].size = vec3_make(0.01, 0.01, 0.2);
    expect(&m, MILL_FAULT_OUTSIDE, 0.0, 0.0);
    ck_assert_int_eq(find(&m).other, 2);
}

/* A drum with a standing shaft; a wavy one would stir it where it reaches its buckles. */
TEST(drums_are_pierced_where_they_turn_in_themselves)
{
    struct mill m = {.setup = {.drum = {.radius = 0.1, .length = 0.1}}};
    add_drum(&m, add_turn(&m, MILL_STILL, 9.0, nought, vec3_make(1.0, 0.0, 0.0)));
    add_pin(&m, MILL_STILL, nought, 0.01, 0.2);
    add_pin(&m, MILL_STILL, vec3_make(0.0, 0.0, 0.08), 0.01, 0.2);
    expect(&m, MILL_FAULT_NONE, 0.0, 0.0);
    for (int k = 0; k < 2; k++) {
        const struct mill_setup_drum drum = wavy_drum(6, 0.1, 0.1, k ? 0.015 : 0.005, 0.0);
        m.body[0] = mill_setup_drum_body(&drum);
        m.surface[0] = drum_surface(&m.body[0], 0);
        if (k == 0)
            expect(&m, MILL_FAULT_NONE, 0.0, 0.0);
    }
    expect(&m, MILL_FAULT_OUTSIDE, 0.0, 0.0);
    ck_assert_int_eq(find(&m).other, 1);
}

/* ---- what may be touched ---- */

TEST(a_body_may_slide_along_a_flat_wall_and_reach_no_farther)
{
    static const double beyond[] = {0.0, 1e-4, 1e-3};
    for (int k = 0; k < 3; k++) {
        struct mill m = {.setup.motions = 0};
        const int rotor = add_turn(&m, MILL_STILL, 9.0, nought, vec3_make(1.0, 0.0, 0.0));
        add_jar(&m, MILL_STILL, 0.1, 0.1);
        add_body(&m, &mill_box_solid, rotor, vec3_make(beyond[k], 0.03, 0.0))->size =
            vec3_make(0.02, 0.01, 0.1); /* the last one along x */
        expect(&m, k ? MILL_FAULT_OUTSIDE : MILL_FAULT_NONE, 0.0, 0.0);
        if (k) {
            ck_assert_int_eq(find(&m).other, 1);
            ck_assert_double_eq_tol(find(&m).amount, beyond[k], 1e-15);
        }
        m.turn[rotor].axis.y = 1e-3; /* it does not slide along the wall, it tilts into it */
        expect(&m, MILL_FAULT_OUTSIDE, 0.0, 0.0);
    }
}

/* ---- the narrowest places ---- */

/* A ball on an arm passes one that stands as much beside it as it is farther out, at an angle.
 * Their paths are no rings that are apart, thus the gap is looked for. */
static void add_passing(struct mill *m, double radius, double far, double angle, double gap,
                        int kind)
{
    const double off = (2.0 * radius + gap) / sqrt(2.0);
    const vec3 at = {off, (far + off) * cos(angle), (far + off) * sin(angle)};
    struct mill_body *b = add_body(m, &mill_round_sphere_solid, MILL_STILL, at);
    b->radius = radius;
    m->surface[m->setup.surfaces - 1].kind = kind;
}

TEST(of_each_two_kinds_the_narrowest_place_is_told_in_the_order_of_the_gaps)
{
    enum { ROUND = 20, LID, RUNS, STANDS, ALSO_STANDS };
    struct mill m = {.setup.motions = 0};
    const int rotor = add_turn(&m, MILL_STILL, 30.0, nought, vec3_make(1.0, 0.0, 0.0));
    add_jar(&m, MILL_STILL, 0.1, 0.1);
    m.surface[0].kind = ROUND;
    m.surface[0].ends = LID;
    for (int k = 0; k < 2; k++) {
        add_body(&m, &mill_round_sphere_solid, rotor, vec3_make(0.0, 0.05 - 0.11 * k, 0.0))
            ->radius = 0.002;
        m.surface[1 + k].kind = RUNS;
    }
    add_passing(&m, 0.002, 0.05, 1.0, 1e-3, STANDS);
    add_passing(&m, 0.002, 0.06, 4.0, 5e-4, ALSO_STANDS);
    add_passing(&m, 0.002, 0.05, 2.5, 3e-4, STANDS);
    add_passing(&m, 0.002, 0.06, 2.0, 8e-4, ALSO_STANDS);
    const struct mill_passing told[] = {
        {.one = 1, .other = 5, .kind = {RUNS, STANDS}, .gap = 3e-4},
        {.one = 2, .other = 4, .kind = {RUNS, ALSO_STANDS}, .gap = 5e-4},
        {.one = 2, .other = 0, .kind = {RUNS, ROUND}, .gap = 0.038},
        {.one = 1, .other = 0, .kind = {RUNS, LID}, .gap = 0.048}};
    const struct mill_fault f = find(&m);
    ck_assert_int_eq(f.code, MILL_FAULT_NONE);
    for (int k = 0; k < 4; k++) {
        const struct mill_passing *p = &f.narrowest[k];
        ck_assert(p->one == told[k].one && p->other == told[k].other);
        ck_assert(p->kind[0] == told[k].kind[0] && p->kind[1] == told[k].kind[1]);
        ck_assert_double_eq_tol(p->gap, told[k].gap, 0.1 * told[k].gap);
    }
    for (int k = 4; k < MILL_FAULT_PASSINGS; k++)
        ck_assert(isinf(f.narrowest[k].gap));
}

TEST(of_more_kinds_than_can_be_told_the_narrowest_are)
{
    struct mill m = {.setup.motions = 0};
    const int rotor = add_turn(&m, MILL_STILL, 30.0, nought, vec3_make(1.0, 0.0, 0.0));
    add_jar(&m, MILL_STILL, 0.2, 0.2);
    add_body(&m, &mill_round_sphere_solid, rotor, vec3_make(0.0, 0.1, 0.0))->radius = 0.01;
    m.surface[0].kind = m.surface[1].kind = 20;
    for (int k = 0; k < 12; k++) /* gaps of 0.5 mm, 1 mm, ... in another order */
        add_passing(&m, 0.01, 0.1, (k + 0.5) * PI / 6.0, 5e-4 * (k * 5 % 12 + 1), 30 + k * 5 % 12);
    const struct mill_fault f = find(&m);
    ck_assert_int_eq(f.code, MILL_FAULT_NONE);
    for (int k = 0; k < MILL_FAULT_PASSINGS; k++) {
        ck_assert_int_eq(f.narrowest[k].kind[1], 30 + k);
        ck_assert_double_eq_tol(f.narrowest[k].gap, 5e-4 * (k + 1), 5e-5 * (k + 1));
    }
}

/* ---- blades and shafts ---- */

TEST(blades_and_shafts_run_into_bodies_too)
{
    struct mill m = {.setup = {.drum = {.radius = 0.1, .length = 0.1}}};
    const int rotor = add_turn(&m, MILL_STILL, 10.0, nought, vec3_make(1.0, 0.0, 0.0));
    add_drum(&m, MILL_STILL);
    m.body[1] = mill_setup_shaft(0.01, 0.1);
    m.body[2] = mill_setup_blade(
        &(struct mill_blade){.tip_radius = 0.08, .width = 0.02, .thickness = 0.004});
    m.surface[1] = shaft_surface(&m.body[1]);
    m.surface[2] = blade_surface(&m.body[2], 0);
    m.surface[1].motion = m.surface[2].motion = rotor;
    m.setup.surfaces = 3;
    struct mill_body *pin = add_pin(&m, MILL_STILL, vec3_make(0.0, 0.0, 0.06), 0.003, 0.01);
    /* the blade's face is 2 mm from its middle, the pin 3 mm from its axis */
    expect(&m, MILL_FAULT_CLASH, (0.5 * PI - asin(0.005 / 0.06)) / 10.0, 1e-5);
    ck_assert(find(&m).ball == 1 && find(&m).other == 2);
    pin->centre = vec3_make(0.0151, 0.0, 0.06);
    expect(&m, MILL_FAULT_NONE, 0.0, 0.0);
    pin->centre = vec3_make(0.03, 0.0, 0.0125);
    expect(&m, MILL_FAULT_NONE, 0.0,
           0.0); /* within the shaft, which is round and turns in itself */
    const int other = add_turn(&m, MILL_STILL, 1.0, vec3_make(0.0, 0.0, 0.05), vec3_make(1, 0, 0));
    m.surface[3].motion = other;
    expect(&m, MILL_FAULT_CLASH, 0.0, 0.0);
    ck_assert(find(&m).ball == 0 && find(&m).other == 2);
}

/* ---- meshes ---- */

/* A ball of facets about the origin, its poles on x; every facet out of true by less than `rough`
 */
static void make_ball(uint64_t *seed, vec3 facet[MESH][3], double radius, double rough)
{
    static vec3 at[47][44];
    int n = 0;
    for (int i = 0; i < 47; i++)
        for (int k = 0; k < 44; k++) {
            const double a = PI * i / 46.0, b = 2.0 * PI * k / 44.0;
            const double r = radius - (i % 46 ? uniform(seed, 0.0, rough) : 0.0);
            at[i][k] = vec3_make(r * cos(a), r * sin(a) * cos(b), r * sin(a) * sin(b));
        }
    for (int i = 0; i < 46; i++)
        for (int k = 0; k < 44; k++) {
            const vec3 a = at[i][k], b = at[i + 1][k], c = at[i + 1][(k + 1) % 44],
                       d = at[i][(k + 1) % 44];
            const vec3 two[2][3] = {{a, b, c}, {a, c, d}};
            memcpy(facet[n], two, sizeof two);
            n += 2;
        }
}

static struct mill_body *add_mesh(struct mill *m, int motion, vec3 centre, vec3 facet[MESH][3])
{
    struct mill_body *b = add_body(m, &mill_facets_solid, motion, centre);
    b->facets = MESH;
    b->facet = (const vec3(*)[3])facet;
    b->x = vec3_make(1.0, 0.0, 0.0);
    b->y = vec3_make(0.0, 1.0, 0.0);
    b->z = vec3_make(0.0, 0.0, 1.0);
    return b;
}

TEST(a_mesh_meets_pins_when_it_does)
{
    static vec3 facet[MESH][3];
    uint64_t seed = 5;
    struct mill m = {.setup.motions = 0};
    const int rotor = add_turn(&m, MILL_STILL, 10.0, nought, vec3_make(1.0, 0.0, 0.0));
    make_ball(&seed, facet, 0.03, 1e-4);
    add_jar(&m, MILL_STILL, 0.15, 0.2);
    add_mesh(&m, rotor, vec3_make(0.0, 0.05, 0.0), facet);
    struct mill_body *pin = add_pin(&m, MILL_STILL, vec3_make(0.0, -0.05, 0.0), 0.01, 0.05);
    const double when = (PI - 2.0 * asin(0.04 / 0.1)) / 10.0;
    expect(&m, MILL_FAULT_CLASH, when + 2e-4, 2.1e-4); /* a mesh is a little less than its ball */
    pin->centre.y = -0.0901;
    expect(&m, MILL_FAULT_NONE, 0.0, 0.0);
    pin->centre.y = 0.05; /* within the mesh, away from all its facets */
    pin->length = 0.01;
    expect(&m, MILL_FAULT_CLASH, 0.0, 0.0);
    m.surface[0].motion = rotor; /* whoever carries the jar */
    expect(&m, MILL_FAULT_CLASH, 0.0, 0.0);
}

TEST(a_mesh_holds_what_is_in_it)
{
    static vec3 facet[MESH][3];
    uint64_t seed = 6;
    struct mill m = {.setup.motions = 0};
    const int rotor = add_turn(&m, MILL_STILL, 10.0, vec3_make(0.0, 0.04, 0.0), vec3_make(1, 0, 0));
    make_ball(&seed, facet, 0.1, 1e-4);
    add_mesh(&m, MILL_STILL, nought, facet)->inside = true;
    struct mill_body *ball =
        add_body(&m, &mill_round_sphere_solid, rotor, vec3_make(0.0, 0.0, 0.0));
    ball->radius = 0.015;
    expect(&m, MILL_FAULT_NONE, 0.0, 0.0); /* as far as 0.095 */
    ball->radius = 0.021;
    expect(&m, MILL_FAULT_OUTSIDE, 0.25, 0.06);
    ball->centre.y = 0.3;
    expect(&m, MILL_FAULT_OUTSIDE, 0.0, 0.0);
    m.body[0].inside = false; /* two bodies, and no container looked at */
    expect(&m, MILL_FAULT_NONE, 0.0, 0.0);
}

int main(void)
{
    return unit_run("clash");
}
