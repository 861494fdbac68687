/* Motions and bodies of a deck: what is read, where it puts bodies, what prints back to the same
 * bits. The messages are tested through the program, in tests/cli/test_deck_bodies.py. */
#include "deck_fixture.h"

#define BALLS "[balls]\ncount = 5\ndiameter = 2 mm\ndensity = 7800 kg/m^3\n"
#define BASE "[run]\ntime = 20 ms\n[contact]\nrestitution = 0.8\n" BALLS
#define DRUM "[drum]\nradius = 75 mm\nlength = 120 mm\n"
#define JAR "[body.jar]\nshape = cylinder\nside = inside\nradius = 20 mm\nlength = 30 mm\n"
#define TURN(name) "[motion." name "]\nkind = turn\nspeed = 60 rpm\n"

static char table[40];

static void make_files(void)
{
    make_file();
    snprintf(table, sizeof table, "%s.txt", path);
}

static void remove_files(void)
{
    remove_file();
    unlink(table);
}

static void write_table(const char *text)
{
    FILE *file = fopen(table, "wb");
    ck_assert_ptr_nonnull(file);
    ck_assert_int_ge(fputs(text, file), 0);
    fclose(file);
}

static bool equals(vec3 a, double x, double y, double z)
{
    return a.x == x && a.y == y && a.z == z;
}

static bool is_near(vec3 a, double x, double y, double z)
{
    return vec3_norm(vec3_sub(a, vec3_make(x, y, z))) < 1e-15;
}

static const struct mill_body *form_of(const struct mill_deck *deck, int k)
{
    ck_assert_int_lt(k, deck->setup.surfaces);
    return deck->setup.surface[k].body;
}

/* ---- motions ---- */

TEST(a_turn_has_its_numbers_and_an_axis_of_length_one)
{
    struct mill_deck *deck = read_good(BASE JAR "[motion.a]\nkind = turn\naxis = 0 49 0\n"
                                                "centre = 1 2 3 mm\nspeed = 30 U/min\n"
                                                "angle = 90 deg\n");
    const struct mill_turn *turn = deck->mill.motion[0].form;
    ck_assert_int_eq(deck->setup.motions, 1);
    ck_assert_str_eq(deck->mill.motion[0].name, "a");
    ck_assert(deck->mill.motion[0].type == &mill_turn_type &&
              deck->mill.motion[0].on == MILL_STILL);
    ck_assert(equals(turn->axis, 0.0, 1.0, 0.0) && equals(turn->centre, 0.001, 0.002, 0.003));
    ck_assert_double_eq_tol(turn->speed, 3.141592653589793, 1e-15);
    ck_assert_double_eq_tol(turn->angle, 1.5707963267948966, 1e-15);
}

TEST(a_swing_has_its_numbers)
{
    struct mill_deck *deck = read_good(BASE JAR "[motion.a]\nkind = swing\naxis = 1 0 0\n"
                                                "amplitude = 6 deg\nfrequency = 1060 1/min\n"
                                                "phase = 1 rad\n");
    const struct mill_swing *swing = deck->mill.motion[0].form;
    ck_assert(deck->mill.motion[0].type == &mill_swing_type && equals(swing->axis, 1.0, 0.0, 0.0));
    ck_assert(swing->frequency == 1060.0 / 60.0 && swing->phase == 1.0);
    ck_assert_double_eq_tol(swing->amplitude, 0.10471975511965978, 1e-16);
}

TEST(a_shift_has_three_phases_or_one_for_all)
{
    struct mill_deck *deck = read_good(BASE JAR "[motion.a]\nkind = shift\nfrequency = 25 Hz\n"
                                                "amplitude = 1 2 -3 mm\nphase = 1 2 3 rad\n"
                                                "[motion.b]\nkind = shift\nfrequency = 25 Hz\n"
                                                "amplitude = 1 0 0 mm\nphase = 2 rad\n");
    const struct mill_shift *a = deck->mill.motion[0].form, *b = deck->mill.motion[1].form;
    ck_assert(deck->mill.motion[0].type == &mill_shift_type && a->frequency == 25.0);
    ck_assert(equals(a->amplitude, 0.001, 0.002, -0.003) && equals(a->phase, 1.0, 2.0, 3.0));
    ck_assert(equals(b->phase, 2.0, 2.0, 2.0));
}

TEST(a_table_is_read_beside_the_deck)
{
    char text[512];
    write_table("# t x y z rx ry rz\n-1 0 0 0 0 0 0\n0, 1, 0, 0, 0, 0, 0.5 # half\n\n"
                "1 0 0 0 0 0 0\n2 0 -1e-3 0 0 0 0\n3 0 0 0 0 1e-13 0\n");
    snprintf(text, sizeof text, BASE JAR "[motion.a]\nkind = table\nfile = %s\n",
             strrchr(table, '/') + 1);
    struct mill_deck *deck = read_good(text);
    const struct mill_table *is = deck->mill.motion[0].form;
    ck_assert(deck->mill.motion[0].type == &mill_table_type && is->rows == 5);
    ck_assert(is->row[0][0] == -1.0 && is->row[1][1] == 1.0 && is->row[1][6] == 0.5);
    ck_assert(is->row[3][2] == -1e-3);
    ck_assert(deck->text.files.count == 1 && strcmp(*(char **)deck->text.files.item, table) == 0);
    char *printed = print(deck), line[64];
    snprintf(line, sizeof line, "file = %s", table);
    ck_assert_ptr_nonnull(strstr(printed, line));
}

static const struct wrong_table {
    const char *text, *words;
} wrong_tables[] = {
    {"0 0 0 0 0 0 0\n1 0 0 0 0 0\n", ":2: expected 7 numbers 't x y z rx ry rz' in SI units"},
    {"0 0 0 0 0 0 0 0\n", ":1: expected 7 numbers"},
    {"\n0 0 0 0 0 0 0\n1 1 0 0 0 0 0\n1 2 0 0 0 0 0\n3 0 0 0 0 0 0\n",
     ":4: times must ascend, but 1 s comes after 1 s"},
    {"0 0 0 0 0 0 0\n1 1 0 0 0 0 0\n2 0 0 0 0 0 0\n# end\n", ":3: 3 rows are too few"},
    {"", ":1: 0 rows are too few: a period needs at least 4"},
    {"0 0 0 0 0 0 0\n1 1 0 0 0 0 0\n2 0 1 0 0 0 0\n3 0 0 0 0 0.1 0\n",
     ":4: the last row must repeat the first, but ry is 0 there and 0.1 here, 0.1 rad off: write "
     "0"},
    {"0 0 0 0 0 0 0\n1 1e-3 0 0 0 0 0\n2 0 0 0 0 0 0\n3 1e-7 0 0 0 0 0\n",
     ":4: the last row must repeat the first, but x is 0 there and 1e-07 here, 1e-07 m off: write "
     "0"},
    {"0 0 0 0 0 0 1\n1 0 0 0 0 0 3\n2 0 0 0 0 0 5\n3 0 0 0 0 0 7.2833\n",
     ":4: the last row must repeat the first, but rz is 1 there and 7.2833 here, 0.00011 rad off: "
     "write 7.283185307"},
    {"0 0 0 0 0 0 0\n1 0 0 0 0 0.1 2\n2 0 0 0 0 0 4\n3 0 0 0 0 0 6.283185307\n",
     ":4: the last row must repeat the first, but rz is 0 there and 6.283185307 here, 6.3 rad off: "
     "write 0; whole turns are about one axis"},
    {"t x y z rx ry rz\n0 0 0 0 0 0 0\n",
     ":1: expected 7 numbers 't x y z rx ry rz' in SI units; is this a header? put a '#' in front "
     "of it"},
    {"0;0;0;0;0;0;0\n",
     ":1: expected 7 numbers 't x y z rx ry rz' in SI units; it has ';' between them: write "
     "blanks, and decimal points"},
    {"0 0 0 0 0 0 nan\n", ":1: expected 7 numbers"},
};

LOOP_TEST(a_wrong_table_is_named_with_its_line, COUNT(wrong_tables))
{
    char text[512], words[200];
    struct mill_deck *deck = NULL;
    write_table(wrong_tables[_i].text);
    snprintf(text, sizeof text, BASE JAR "[motion.a]\nkind = table\nfile = %s\n", table);
    ck_assert_int_eq(read_text(text, strlen(text), &deck), MILL_BAD_DECK);
    snprintf(words, sizeof words, "%s%s", table, wrong_tables[_i].words);
    const char *told = strstr(error.text, ":16: [motion.a] file: "); /* of the deck */
    ck_assert_msg(told && strstr(told, words), "%s", error.text);
}

/* By a motion of the engine: no step where the table begins again */
TEST(a_table_may_close_after_whole_turns)
{
    char text[512];
    write_table("0 0 0 0 0.1 0 0\n1 0 0 0 -2 0 0\n2 0 0 0 -4 0 0\n3 0 0 0 -6 0 0\n"
                "6 0 0 0 -12.466366 0 0\n");
    snprintf(text, sizeof text, BASE JAR "[motion.a]\nkind = table\nfile = %s\n", table);
    struct mill_deck *deck = read_good(text);
    const struct mill_table *is = deck->mill.motion[0].form;
    ck_assert_double_eq_tol(is->row[4][4], 0.1 - 4.0 * MILL_PI, 1e-14);
    struct mill_motion *motion = mill_table_type.create(is);
    const struct mill_pose end = mill_table_type.pose(motion, 6.0 - 1e-9);
    const struct mill_pose begin = mill_table_type.pose(motion, 0.0);
    ck_assert_double_lt(vec3_norm(vec3_sub(end.y, begin.y)), 1e-8);
    ck_assert_double_lt(vec3_norm(vec3_sub(end.angular_velocity, begin.angular_velocity)), 1e-7);
    ck_assert_double_lt(begin.angular_velocity.x, -1.0);
    free(motion);
}

TEST(carriers_come_before_what_they_carry_and_the_rotor_first)
{
    static const char *const name[] = {"rotor", "sun", "other", "wheel", "jar", "rider"};
    static const int on[] = {MILL_STILL, MILL_STILL, MILL_STILL, 1, 3, 0};
    struct mill_deck *deck =
        read_good(BASE JAR TURN("jar") "on = wheel\n" TURN("wheel") "on = sun\n" TURN("sun")
                      TURN("other") TURN("rider") "on = rotor\n"
                                                  "[rotor]\nspeed = 10 rpm\n");
    ck_assert_int_eq(deck->setup.motions, 6);
    for (int k = 0; k < 6; k++) {
        int at = 0;
        while (strcmp(deck->mill.motion[at].name, name[k]) != 0)
            at++;
        const int carrier = deck->mill.motion[at].on;
        ck_assert_int_lt(carrier, at);
        if (on[k] == MILL_STILL)
            ck_assert_int_eq(carrier, MILL_STILL);
        else
            ck_assert_str_eq(deck->mill.motion[carrier].name, name[on[k]]);
    }
    ck_assert_str_eq(deck->mill.motion[0].name, "rotor");
}

/* ---- bodies ---- */

TEST(own_x_is_the_projection_of_the_frames_x)
{
    struct mill_deck *deck = read_good(
        BASE DRUM "[body.a]\nshape = sphere\nradius = 1 mm\n"
                  "[body.b]\nshape = sphere\nradius = 1 mm\naxis = 0 -3 0\n"
                  "[body.c]\nshape = sphere\nradius = 1 mm\naxis = 1 0 1\n"
                  "[body.d]\nshape = sphere\nradius = 1 mm\naxis = 2 0 0\n"
                  "[body.e]\nshape = sphere\nradius = 1 mm\naxis = -1 1e-7 0\n"
                  "[body.f]\nshape = sphere\nradius = 1 mm\naxis = 0 0 1\nangle = 90 deg\n");
    const double h = sqrt(0.5);
    ck_assert(equals(form_of(deck, 0)->x, 1.0, 0.0, 0.0));
    ck_assert(equals(form_of(deck, 0)->y, 0.0, 1.0, 0.0));
    ck_assert(equals(form_of(deck, 0)->z, 0.0, 0.0, 1.0));
    ck_assert(equals(form_of(deck, 1)->x, 1.0, 0.0, 0.0));
    ck_assert(equals(form_of(deck, 1)->z, 0.0, -1.0, 0.0));
    ck_assert(is_near(form_of(deck, 2)->x, h, 0.0, -h) && is_near(form_of(deck, 2)->z, h, 0.0, h));
    ck_assert(equals(form_of(deck, 3)->x, 0.0, 1.0, 0.0));
    ck_assert(equals(form_of(deck, 3)->y, 0.0, 0.0, 1.0));
    ck_assert(form_of(deck, 4)->x.y > 0.999 && form_of(deck, 4)->z.x < -0.999);
    ck_assert(equals(form_of(deck, 5)->x, 0.0, 1.0, 0.0));
    ck_assert(equals(form_of(deck, 5)->y, -1.0, 0.0, 0.0));
    for (int k = 0; k < 6; k++)
        ck_assert(form_of(deck, k)->radius == 0.001 && deck->setup.surface[k].motion == MILL_STILL);
}

TEST(quarter_turns_of_copies_are_exact)
{
    static const double c[4] = {1.0, 0.0, -1.0, 0.0}, s[4] = {0.0, 1.0, 0.0, -1.0};
    struct mill_deck *deck =
        read_good(BASE DRUM "[body.arm]\nshape = box\nsize = 20 4 6 mm\n"
                            "centre = 10 0 -40 mm\ncopies = 12\nturn_by = 90 deg\n"
                            "shift_by = 0 0 5 mm\n");
    double z = -0.04;
    ck_assert_int_eq(deck->setup.surfaces, 12);
    for (int k = 0; k < 12; k++, z += 0.005) {
        const struct mill_body *is = form_of(deck, k);
        ck_assert(equals(is->centre, c[k % 4] * 0.01, s[k % 4] * 0.01, z));
        ck_assert(equals(is->x, c[k % 4], s[k % 4], 0.0) && equals(is->z, 0.0, 0.0, 1.0));
        ck_assert(equals(is->size, 0.02, 0.004, 0.006));
        ck_assert_int_eq(deck->setup.surface[k].number, k);
        ck_assert_int_eq(deck->setup.surface[k].kind, MILL_KINDS);
    }
    ck_assert_str_eq(deck->mill.contacts.name[MILL_KINDS], "ball_arm");
}

/* Rodrigues' formula for a turn about a slanted axis, applied k times, against one turn by k angles
 * of coordinates along and across that axis */
TEST(copies_turn_about_the_frames_origin_and_stay_orthogonal)
{
    struct mill_deck *deck =
        read_good(BASE DRUM "[body.pin]\nshape = capsule\nradius = 1 mm\nlength = 3 mm\n"
                            "centre = 30 0 0 mm\naxis = 1 0 0\ncopies = 1000\nturn_by = 7 deg\n"
                            "turn_about = 0 2 0\n");
    for (int k = 0; k < 1000; k++) {
        const struct mill_body *is = form_of(deck, k);
        const double angle = k * 7.0 * MILL_PI / 180.0;
        const vec3 out = {cos(angle), 0.0, -sin(angle)};
        ck_assert_double_lt(vec3_norm(vec3_sub(is->centre, vec3_scale(out, 0.03))), 1e-14);
        ck_assert_double_lt(vec3_norm(vec3_sub(is->z, out)), 1e-12);
        ck_assert_double_lt(fabs(vec3_dot(is->x, is->z)), 1e-15);
        ck_assert_double_lt(vec3_norm(vec3_sub(vec3_cross(is->x, is->y), is->z)), 1e-15);
    }
}

TEST(every_shape_has_its_sizes)
{
    struct mill_deck *deck = read_good(
        BASE DRUM "[body.a]\nshape = box\nsize = 1 2 3 mm\nrounding = 0.5 mm\n"
                  "[body.b]\nshape = cylinder\nradius = 3 mm\nlength = 4 mm\nrounding = 1 mm\n"
                  "[body.c]\nshape = cone\nradius = 5 mm\nend_radius = 0 mm\nlength = 6 mm\n"
                  "[body.d]\nshape = capsule\nradius = 7 mm\nlength = 8 mm\n"
                  "[body.e]\nshape = sphere\nradius = 9 mm\ncentre = 1 0 0 mm\n");
    const struct mill_solid *const solid[] = {&mill_box_solid, &mill_round_cylinder_solid,
                                              &mill_round_cone_solid, &mill_round_capsule_solid,
                                              &mill_round_sphere_solid};
    for (int k = 0; k < 5; k++) {
        ck_assert(deck->setup.surface[k].solid == solid[k] && !form_of(deck, k)->inside);
        ck_assert_int_eq(deck->setup.surface[k].kind, MILL_KINDS + k);
    }
    ck_assert(equals(form_of(deck, 0)->size, 0.001, 0.002, 0.003));
    ck_assert(form_of(deck, 0)->rounding == 0.0005 && form_of(deck, 1)->rounding == 0.001);
    ck_assert(form_of(deck, 1)->radius == 0.003 && form_of(deck, 1)->length == 0.004);
    ck_assert(form_of(deck, 2)->radius == 0.005 && form_of(deck, 2)->end_radius == 0.0);
    ck_assert(form_of(deck, 2)->length == 0.006);
    ck_assert(form_of(deck, 3)->radius == 0.007 && form_of(deck, 3)->length == 0.008);
    ck_assert(form_of(deck, 4)->radius == 0.009 && form_of(deck, 4)->centre.x == 0.001);
    ck_assert(!deck->mill.container && deck->mill.drum && deck->mill.carrier < 0);
}

TEST(bodies_share_a_kind_and_take_fixed_ones_by_name)
{
    struct mill_deck *deck =
        read_good(BASE JAR TURN("a") "[body.p]\nshape = sphere\nradius = 1 mm\nkind = ball_pins\n"
                                     "[body.q]\nshape = sphere\nradius = 1 mm\nkind = ball_pins\n"
                                     "motion = a\n"
                                     "[body.shaft]\nshape = sphere\nradius = 1 mm\n"
                                     "[contact.ball_pins]\nfriction = 0.25\n");
    ck_assert_int_eq(deck->mill.contacts.count, MILL_KINDS + 2);
    ck_assert_str_eq(deck->mill.contacts.name[MILL_KINDS], "ball_jar");
    ck_assert_str_eq(deck->mill.contacts.name[MILL_KINDS + 1], "ball_pins");
    ck_assert(deck->setup.surface[1].kind == MILL_KINDS + 1 &&
              deck->setup.surface[2].kind == MILL_KINDS + 1);
    ck_assert_int_eq(deck->setup.surface[3].kind, MILL_BALL_SHAFT);
    ck_assert(deck->setup.surface[2].motion == 0 && deck->setup.surface[1].motion == MILL_STILL);
    ck_assert(deck->mill.contact[MILL_KINDS + 1].law.friction == 0.25 &&
              deck->mill.contact[MILL_KINDS].law.friction == 0.0);
    ck_assert(deck->mill.contact[MILL_KINDS + 1].law.restitution == 0.8);
}

/* ---- what holds the balls ---- */

static const struct container {
    const char *text;
    double volume;
} containers[] = {
    {"shape = box\nsize = 20 30 40 mm\n", 0.02 * 0.03 * 0.04},
    {"shape = cylinder\nradius = 20 mm\nlength = 30 mm\n", MILL_PI * 0.0004 * 0.03},
    {"shape = cone\nradius = 10 mm\nend_radius = 20 mm\nlength = 30 mm\n",
     MILL_PI / 3.0 * 0.0007 * 0.03},
    {"shape = capsule\nradius = 10 mm\nlength = 30 mm\n",
     MILL_PI * 0.0001 * 0.03 + 4.0 / 3.0 * MILL_PI * 1e-6},
    {"shape = sphere\nradius = 20 mm\n", 4.0 / 3.0 * MILL_PI * 8e-6},
};

LOOP_TEST(a_fill_counts_the_containers_volume, COUNT(containers))
{
    char text[512];
    snprintf(text, sizeof text,
             "[run]\ntime = 20 ms\n[contact]\nrestitution = 0.8\n[balls]\nfill = 10 %%\n"
             "diameter = 1 mm\ndensity = 7800 kg/m^3\n[body.jar]\nside = inside\n%s",
             containers[_i].text);
    struct mill_deck *deck = read_good(text);
    ck_assert_ptr_eq(deck->mill.container, &deck->setup.surface[0]);
    ck_assert(!deck->mill.drum && form_of(deck, 0)->inside);
    ck_assert_int_eq(deck->mill.all, lround(0.1 * containers[_i].volume / (MILL_PI / 6.0 * 1e-9)));
}

TEST(a_drum_rides_on_a_motion)
{
    struct mill_deck *deck = read_good(BASE DRUM "motion = roll\n" TURN("a") TURN("roll"));
    ck_assert_int_eq(deck->setup.drum.rides, 2);
    ck_assert(deck->mill.carrier >= 0 && deck->setup.at_rest == 0);
}

TEST(a_rotor_without_a_drum_has_no_shaft)
{
    struct mill_deck *deck =
        read_good(BASE JAR "[rotor]\nspeed = 10 rpm\n[body.arm]\nmotion = rotor\nshape = sphere\n"
                           "radius = 1 mm\n");
    ck_assert(deck->given.shaft_radius == 0.0 && deck->setup.surface[1].motion == 0);
    char *text = print(deck);
    ck_assert_ptr_null(strstr(text, "shaft_radius"));
}

/* ---- printing ---- */

/* Everything that there is, in an order that is not the printed one */
static const char everything[] =
    BASE "[body.arm]\nshape = box\nsize = 1 2 3 mm\nmotion = wobble\naxis = 1 2 3\n"
         "angle = 0.3 rad\ncopies = 3\nturn_by = 7 deg\nshift_by = 0 1 2 mm\nturn_about = 1 1 0\n"
         "kind = ball_pins\nrounding = 0.1 mm\ncentre = 1 1 1 mm\n" JAR "motion = wobble\n"
         "[body.ball]\nshape = sphere\nradius = 1 mm\nkind = ball_pins\n"
         "[motion.wobble]\nkind = swing\non = path\namplitude = 5 deg\nfrequency = 7 1/min\n"
         "phase = 10 deg\naxis = 1 2 3\ncentre = 1 2 3 mm\n"
         "[motion.path]\nkind = shift\namplitude = 1 2 3 inch\nfrequency = 20 1/min\n"
         "phase = 30 deg\n"
         "[contact.ball_pins]\nfriction = 0.1\n[contact.ball_jar]\nrestitution = 0.7\n";

TEST(a_printed_deck_prints_the_same_again)
{
    struct mill_deck *deck = read_good(everything);
    char *first = print(deck);
    struct mill_deck *again = read_good(first);
    char *second = print(again);
    ck_assert_str_eq(first, second);
    ck_assert_int_eq(deck->setup.surfaces, again->setup.surfaces);
    for (int k = 0; k < deck->setup.surfaces; k++) {
        /* sections of the text are printed in their order */
        ck_assert_int_eq(memcmp(form_of(deck, k), form_of(again, k), sizeof(struct mill_body)), 0);
        ck_assert_int_eq(deck->setup.surface[k].kind, again->setup.surface[k].kind);
        ck_assert_int_eq(deck->setup.surface[k].motion, again->setup.surface[k].motion);
    }
    for (int k = 0; k < deck->setup.motions; k++)
        ck_assert_int_eq(
            memcmp(&deck->mill.form[k].as, &again->mill.form[k].as, sizeof deck->mill.form[k].as),
            0);
}

TEST(what_says_nothing_is_not_printed)
{
    static const char *const words[] = {"copies", "rounding", "turn_by", "shift_by", "turn_about",
                                        "on",     "kind",     "motion",  "[drum",    "[rotor"};
    char line[32];
    struct mill_deck *deck = read_good(BASE JAR);
    char *text = print(deck);
    for (int k = 0; k < 10; k++) {
        snprintf(line, sizeof line, "\n%s", words[k]);
        ck_assert_msg(!strstr(text, line), "%s in\n%s", line, text);
    }
    ck_assert_ptr_nonnull(strstr(text, "\ncentre = "));
}

TEST(balls_at_rest_are_told_where_it_makes_a_difference)
{
    struct mill_deck *deck = read_good(BASE "start_motion = still\n" JAR "motion = a\n" TURN("a"));
    char *text = print(deck);
    ck_assert_int_eq(deck->setup.at_rest, 1);
    ck_assert_ptr_nonnull(strstr(text, "start_motion = still"));
    deck = read_good(BASE "start_motion = still\n" JAR);
    text = print(deck);
    ck_assert_ptr_null(strstr(text, "start_motion"));
}

int main(void)
{
    return unit_run_in("deck_bodies", make_files, remove_files);
}
