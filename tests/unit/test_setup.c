/* Claims about mills made from plain numbers: what is unsound is refused with a code, at once, and
 * nothing is left behind. */
#include "mills.h"

#include <stddef.h>

static const struct mill_setup_ball resting[] = {{.position = {0.01, 0.0, -0.03}},
                                                 {.position = {-0.01, 0.0, -0.03}}};
static const struct model sound = {
    .setup = {.gravity.z = -9.81, .drum = {.radius = 0.04, .length = 0.04}, .speed = 1.0},
    .balls = {{.diameter = 0.005, .density = STEEL, .count = 2}},
    .rotor = {.speed = 100.0, .angle = 1.0},
    .shaft = 0.008,
    .blades = 1,
    .blade = {{.tip_radius = 0.03, .width = 0.008, .thickness = 0.005, .pitch = 0.1}},
    .law = {0.8, 0.3, 0.4}};

/* Refused with this code, with random places and with given ones */
static void refuse(const struct model *m, enum mill_fault_code code)
{
    struct model given = *m;
    struct mill_world *w = NULL;
    struct mill_fault fault;
    given.setup.start = resting;
    ck_assert_int_eq(model_start(m, NULL, &w, &fault), code);
    ck_assert_int_eq(fault.code, code);
    ck_assert_ptr_null(w);
    ck_assert_int_eq(model_start(&given, NULL, &w, NULL), code);
    ck_assert_ptr_null(w);
}

/* Numbers of a model that must be finite, and what else they must be */
static const struct {
    size_t at;
    bool positive, at_least_0; /* not 0, not negative */
} number[] = {
    {offsetof(struct model, setup.gravity.x), false, false},
    {offsetof(struct model, setup.gravity.z), false, false},
    {offsetof(struct model, setup.drum.radius), true, true},
    {offsetof(struct model, setup.drum.length), true, true},
    {offsetof(struct model, setup.speed), false, true},
    {offsetof(struct model, balls[0].diameter), true, true},
    {offsetof(struct model, balls[0].density), true, true},
    {offsetof(struct model, law.restitution), false, true},
    {offsetof(struct model, law.tangential), false, false},
    {offsetof(struct model, rotor.centre.y), false, false},
    {offsetof(struct model, rotor.speed), false, false},
    {offsetof(struct model, rotor.angle), false, false},
    {offsetof(struct model, shaft), false, false}, /* of a model none where it is 0 or less */
    {offsetof(struct model, blade[0].position), false, false},
    {offsetof(struct model, blade[0].angle), false, false},
    {offsetof(struct model, blade[0].tip_radius), true, true},
    {offsetof(struct model, blade[0].width), true, true},
    {offsetof(struct model, blade[0].thickness), true, true},
    {offsetof(struct model, blade[0].pitch), false, false},
};
enum { NUMBERS = sizeof number / sizeof *number };

LOOP_TEST(a_number_that_is_none_or_out_of_range_is_refused, NUMBERS)
{
    const double bad[] = {(double)NAN, (double)INFINITY, (double)-INFINITY, 0.0, -1e-3};
    mill_world_free(model_world(&sound));
    for (int k = 0; k < 3 + (number[_i].positive + number[_i].at_least_0); k++) {
        struct model m = sound;
        const int which = k < 3 ? k : number[_i].positive ? k : 4;
        if (number[_i].at == offsetof(struct model, balls[0].diameter) && !(bad[which] > 0.0))
            continue; /* a model without balls */
        if (number[_i].at == offsetof(struct model, shaft) && !(bad[which] > 0.0))
            continue; /* a model without shaft */
        memcpy((char *)&m + number[_i].at, &bad[which], sizeof(double));
        /* a radius of 0: there is no drum */
        refuse(&m, m.setup.drum.radius == 0.0 ? MILL_FAULT_CONTAINER : MILL_FAULT_NUMBER);
    }
}

TEST(laws_outside_their_range_are_refused)
{
    static const struct mill_law law[] = {{1.1, 0.0, 0.0}, {0.5, -0.1, 0.0}, {0.5, 0.0, 1.5}};
    for (int k = 0; k < 3; k++) {
        for (int kind = 0; kind < MILL_KINDS; kind++) {
            struct model m = sound;
            m.setup.law[kind] = law[k];
            refuse(&m, MILL_FAULT_NUMBER);
        }
    }
}

TEST(counts_and_profiles_that_make_no_mill_are_refused)
{
    static const int32_t count[] = {0, -1, 50000001, INT32_MAX};
    /* a line, a corner twice, a cross, clockwise, a number that is none */
    static const struct mill_corner corner[5][4] = {
        {{-0.04, 0.0, 0.0}, {0.04, 0.0, 0.0}},
        {{-0.04, 0.0, 1.0}, {0.04, 0.0, 1.0}, {0.04, 0.0, 1.0}},
        {{-0.04, -0.04, 0.0}, {0.04, -0.04, 0.0}, {-0.04, 0.04, 0.0}, {0.05, 0.04, 0.0}},
        {{-0.04, -0.04, 0.0}, {-0.04, 0.04, 0.0}, {0.04, 0.04, 0.0}, {0.04, -0.04, 0.0}},
        {{-0.04, 0.0, 1.0}, {(double)NAN, 0.0, 1.0}}};
    static const size_t corners[] = {2, 3, 4, 4, 2};
    for (int k = 0; k < 4; k++) {
        struct model m = sound;
        m.balls[0].count = count[k];
        refuse(&m, MILL_FAULT_NUMBER);
    }
    for (int k = 0; k < 5; k++) {
        struct model m = sound;
        m.setup.drum.corners = corners[k];
        m.setup.drum.corner = corner[k];
        refuse(&m, MILL_FAULT_NUMBER);
    }
}

/* A setup of two motions and a surface, each of them on what */
static enum mill_fault_code start_on(int first, int second, int surface, vec3 axis)
{
    const struct mill_turn turn = {.axis = axis, .speed = 1.0};
    const struct mill_setup_motion motion[] = {
        {.type = &mill_turn_type, .form = &turn, .on = first},
        {.type = &mill_turn_type, .form = &turn, .on = second}};
    const struct mill_body box = mill_setup_blade(&sound.blade[0]);
    struct mill_setup_surface blade = blade_surface(&box, 0);
    struct mill_setup setup = sound.setup;
    struct mill_world *w;
    blade.motion = surface;
    setup.motions = 2;
    setup.motion = motion;
    setup.surfaces = 1;
    setup.surface = &blade;
    setup.species = 1;
    setup.balls = sound.balls;
    const enum mill_fault_code code = mill_start_world(&setup, NULL, &w, NULL);
    ck_assert_int_eq(w == NULL, code != MILL_FAULT_NONE);
    mill_world_free(w);
    return code;
}

TEST(a_surface_has_a_kind_of_contact_and_a_container_s_ends_one_that_all_mills_have)
{
    const struct mill_body box = mill_setup_blade(&sound.blade[0]),
                           jar = mill_setup_drum_body(&sound.setup.drum);
    const struct {
        int kind, ends;
        enum mill_fault_code code;
    } wrong[] = {{MILL_BALL_BLADE, MILL_BALL_WALL, MILL_FAULT_NONE},
                 {MILL_BALL_BLADE, 0, MILL_FAULT_NONE},
                 {MILL_BALL_BALL, MILL_BALL_WALL, MILL_FAULT_NUMBER},
                 {-1, MILL_BALL_WALL, MILL_FAULT_NUMBER},
                 {MILL_KINDS, MILL_BALL_WALL, MILL_FAULT_NUMBER},
                 {MILL_BALL_BLADE, MILL_KINDS, MILL_FAULT_NUMBER},
                 {MILL_BALL_BLADE, -1, MILL_FAULT_NUMBER}};
    for (int k = 0; k < COUNT(wrong); k++) {
        struct mill_setup_surface surface[] = {drum_surface(&jar, MILL_STILL),
                                               blade_surface(&box, 0)};
        struct mill_setup setup = sound.setup;
        struct mill_world *w;
        surface[1].motion = MILL_STILL;
        surface[1].kind = wrong[k].kind;
        surface[0].ends = wrong[k].ends;
        setup.drum.radius = 0.0;
        setup.surfaces = 2;
        setup.surface = surface;
        setup.species = 1;
        setup.balls = sound.balls;
        ck_assert_int_eq(mill_start_world(&setup, NULL, &w, NULL), wrong[k].code);
        mill_world_free(w);
    }
}

TEST(the_rotor_is_the_motion_that_is_named_so_by_its_number)
{
    const struct mill_turn turn = {.axis = {1.0, 0.0, 0.0}, .speed = 3.0},
                           other = {.axis = {1.0, 0.0, 0.0}, .speed = 7.0};
    const struct mill_setup_motion motion[] = {
        {.type = &mill_turn_type, .form = &turn, .on = MILL_STILL, .name = "a"},
        {.type = &mill_turn_type, .form = &other, .on = MILL_STILL}};
    const double speed[] = {0.0, 3.0, 7.0, 0.0};
    for (int rotor = MILL_STILL; rotor < 3; rotor++) {
        struct mill_setup setup = sound.setup;
        struct mill_world *w;
        setup.motions = 2;
        setup.motion = motion;
        setup.rotor = rotor;
        setup.species = 1;
        setup.balls = sound.balls;
        ck_assert_int_eq(mill_start_world(&setup, NULL, &w, NULL), MILL_FAULT_NONE);
        ck_assert_int_eq(w->rotor, rotor < 2 ? rotor : MILL_STILL);
        ck_assert_double_eq(w->rotor_speed, speed[rotor + 1]);
        ck_assert_str_eq(w->motion_name[1], rotor == 1 ? "rotor" : "");
        mill_world_free(w);
    }
}

TEST(a_motion_rides_on_an_earlier_one_and_a_surface_on_any)
{
    const vec3 x = {1.0, 0.0, 0.0};
    static const int wrong[][3] = {{0, MILL_STILL, 0},  {1, MILL_STILL, 0}, {-2, MILL_STILL, 0},
                                   {MILL_STILL, 1, 0},  {MILL_STILL, 2, 0}, {MILL_STILL, 0, 2},
                                   {MILL_STILL, 0, -2}, {7000, 0, 0}};
    for (int surface = MILL_STILL; surface < 2; surface++) {
        ck_assert_int_eq(start_on(MILL_STILL, MILL_STILL, surface, x), MILL_FAULT_NONE);
        ck_assert_int_eq(start_on(MILL_STILL, 0, surface, x), MILL_FAULT_NONE);
    }
    for (size_t k = 0; k < sizeof wrong / sizeof *wrong; k++)
        ck_assert_int_eq(start_on(wrong[k][0], wrong[k][1], wrong[k][2], x), MILL_FAULT_NUMBER);
    ck_assert_int_eq(start_on(MILL_STILL, 0, 0, nought), MILL_FAULT_NUMBER); /* no axis */
}

TEST(a_surface_beyond_the_drum_is_refused_by_its_number)
{
    const struct {
        size_t at; /* a number of the model */
        double wrong;
        enum mill_fault_code code;
        int32_t surface;
    } fault[] = {{offsetof(struct model, shaft), 0.05, MILL_FAULT_NO_ROOM, 0},
                 {offsetof(struct model, blade[0].tip_radius), 0.05, MILL_FAULT_OUTSIDE, 1},
                 {offsetof(struct model, blade[0].width), 0.2, MILL_FAULT_OUTSIDE, 1}};
    for (size_t k = 0; k < sizeof fault / sizeof *fault; k++) {
        struct model m = sound;
        struct mill_world *w;
        struct mill_fault told;
        memcpy((char *)&m + fault[k].at, &fault[k].wrong, sizeof(double));
        ck_assert_int_eq(model_start(&m, NULL, &w, &told), fault[k].code);
        ck_assert_ptr_null(w);
        ck_assert_int_eq(told.other, fault[k].surface);
    }
}

TEST(a_shaft_on_a_turn_off_the_drum_s_axis_goes_round_it)
{
    struct model m = sound;
    m.rotor.centre.y = 0.002;
    struct mill_world *w = model_world(&m);
    const struct mill_shape *shaft = w->shape[3];
    ck_assert_int_eq(shaft->kind, MILL_BALL_SHAFT);
    for (int k = 0; k < 100; k++) { /* from 2 mm to 0 and back; its own place is the origin */
        const double t = k * 1e-3, a = m.rotor.angle + 100.0 * t;
        const double y = 0.002 - 0.002 * cos(a), z = -0.002 * sin(a);
        const struct mill_pose pose = mill_shape_pose(shaft, t);
        const double gap = mill_shape_gap(shaft, vec3_make(0.001, 0.02, 0.01), 0.003, &pose);
        ck_assert_double_eq_tol(gap, hypot(0.02 - y, 0.01 - z) - 0.008 - 0.003, 1e-15);
    }
    mill_world_free(w);
}

TEST(given_balls_are_checked_for_number_speed_and_overlap)
{
    const struct mill_setup_ball far = {.position.y = 0.05}, fast = {.velocity.x = 3e8},
                                 nan = {.position.x = (double)NAN},
                                 slow_nan = {.velocity.z = (double)NAN};
    const struct {
        struct mill_setup_ball second;
        enum mill_fault_code code;
    } start[] = {{far, MILL_FAULT_BALL_IN_SHAPE},
                 {nan, MILL_FAULT_BALL_IN_SHAPE},
                 {fast, MILL_FAULT_SPEED},
                 {slow_nan, MILL_FAULT_SPEED},
                 {{.position = {0.012, 0.0, -0.03}}, MILL_FAULT_BALL_IN_BALL}};
    for (size_t k = 0; k < sizeof start / sizeof *start; k++) {
        const struct mill_setup_ball ball[] = {resting[0], start[k].second};
        struct model m = sound;
        struct mill_world *w;
        struct mill_fault fault;
        m.setup.start = ball;
        ck_assert_int_eq(model_start(&m, NULL, &w, &fault), start[k].code);
        ck_assert_ptr_null(w);
        ck_assert_int_eq(fault.ball, 1);
        ck_assert_int_eq(fault.other, 0);
    }
}

TEST(every_fault_has_its_words)
{
    for (int code = MILL_FAULT_NONE; code <= MILL_FAULT_BALL_OUTSIDE; code++)
        ck_assert_int_gt((int)strlen(mill_setup_fault_text((enum mill_fault_code)code)), 5);
}

int main(void)
{
    return unit_run("setup");
}
