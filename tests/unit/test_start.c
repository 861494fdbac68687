/* Claims about start files: every number read to the bit, every fault named with its line. */
#include "deck/deck.h"
#include "draws.h"

#include <stdio.h>
#include <unistd.h>

/* Writes `text` to a new file, whose name goes to path. */
static void write_file(char path[64], const char *text, size_t length)
{
    strcpy(path, "/tmp/millsim-test-XXXXXX");
    const int file = mkstemp(path);
    ck_assert_int_ge(file, 0);
    ck_assert_int_eq(write(file, text, length), (ssize_t)length);
    close(file);
}

static struct mill_deck *read_deck(const char *text)
{
    char path[64];
    struct mill_error error = {""};
    struct mill_deck *deck = NULL;
    write_file(path, text, strlen(text));
    const enum mill_status status = mill_deck_read(path, 0, NULL, NULL, NULL, NULL, &deck, &error);
    unlink(path);
    ck_assert_msg(status == MILL_OK, "%s", error.text);
    return deck;
}

/* A mill with shaft and one blade along +y, and two kinds of balls, of 10 and 6 mm. */
static const char mill[] = "[run]\ntime = 1 s\n[drum]\nradius = 75 mm\nlength = 120 mm\n"
                           "[contact]\nrestitution = 0.8\n"
                           "[rotor]\nspeed = 100 rpm\nshaft_radius = 15 mm\n"
                           "[blade.a]\nposition = 0 mm\nangle = 0 deg\ntip_radius = 50 mm\n"
                           "width = 20 mm\nthickness = 8 mm\n"
                           "[balls.large]\ncount = 2\ndiameter = 10 mm\ndensity = 7800 kg/m^3\n"
                           "[balls.small]\ncount = 1\ndiameter = 6 mm\ndensity = 7800 kg/m^3\n";

struct outcome {
    enum mill_status status;
    struct mill_error error;
    struct mill_world *world;
    char path[64]; /* of the start file, gone by now */
};

/* Builds the mill's world from this start file. */
static struct outcome start_from_file(const char *path)
{
    struct outcome out = {MILL_OK, {""}, NULL, ""};
    char text[2048];
    strcpy(out.path, path);
    snprintf(text, sizeof text, "%s[balls]\nstart = %s\n", mill, path);
    struct mill_deck *deck = read_deck(text);
    out.status = mill_deck_setup_world(deck, NULL, &out.world, &out.error);
    mill_deck_free(deck);
    return out;
}

static struct outcome start_from_bytes(const char *bytes, size_t length)
{
    char path[64];
    write_file(path, bytes, length);
    struct outcome out = start_from_file(path);
    unlink(path);
    return out;
}

static struct outcome start_from(const char *rows)
{
    return start_from_bytes(rows, strlen(rows));
}

/* The start must be refused as a wrong deck, at this line of the start file (0: of the deck), with
 * these words. */
static void refused(const char *rows, int line, const char *words)
{
    struct outcome out = start_from(rows);
    char where[96];
    ck_assert_msg(out.status == MILL_BAD_DECK, "status %d for: %s", (int)out.status, rows);
    ck_assert_ptr_null(out.world);
    snprintf(where, sizeof where, "%s:%d: ", out.path, line);
    if (line > 0)
        ck_assert_msg(strncmp(out.error.text, where, strlen(where)) == 0, "%s", out.error.text);
    else
        ck_assert_msg(strstr(out.error.text, "[balls] start: ") != NULL, "%s", out.error.text);
    ck_assert_msg(strstr(out.error.text, words) != NULL, "%s", out.error.text);
    ck_assert_ptr_null(strchr(out.error.text, '\n'));
}

static struct mill_world *accepted(const char *rows)
{
    struct outcome out = start_from(rows);
    ck_assert_msg(out.status == MILL_OK, "%s", out.error.text);
    return out.world;
}

static void same(vec3 a, double x, double y, double z)
{
    ck_assert(a.x == x && a.y == y && a.z == z);
}

/* ---- what is read ---- */

TEST(rows_of_three_six_and_nine_numbers_are_read)
{
    struct mill_world *w = accepted("0.01 0.02 -0.03\n"
                                    "-0.02 0.05 0.01 1 2 3\n"
                                    "0.03 -0.05 0.01 -1 -2 -3 40 50 60\n");
    same(w->ball[0].r, 0.01, 0.02, -0.03);
    same(w->ball[0].v, 0.0, 0.0, 0.0);
    same(w->spin[0], 0.0, 0.0, 0.0);
    same(w->ball[1].r, -0.02, 0.05, 0.01);
    same(w->ball[1].v, 1.0, 2.0, 3.0);
    same(w->spin[1], 0.0, 0.0, 0.0);
    same(w->ball[2].v, -1.0, -2.0, -3.0);
    same(w->spin[2], 40.0, 50.0, 60.0);
    mill_world_free(w);
}

TEST(rows_belong_to_the_balls_in_the_order_of_the_deck)
{
    struct mill_world *w = accepted("0.01 0.02 -0.03\n0.03 0.02 -0.03\n0.04 -0.02 -0.03\n");
    ck_assert_int_eq(w->balls, 3);
    ck_assert_str_eq(w->species[w->ball[0].species].name, "large");
    ck_assert_str_eq(w->species[w->ball[1].species].name, "large");
    ck_assert_str_eq(w->species[w->ball[2].species].name, "small");
    same(w->ball[2].r, 0.04, -0.02, -0.03);
    mill_world_free(w);
}

TEST(comments_blank_lines_commas_tabs_and_line_ends_do_not_matter)
{
    struct mill_world *w = accepted("# x y z\n\n   \t\n"
                                    "0.01,0.02,-0.03 # first\r\n"
                                    "  -0.02 ,\t5.0e-2\t,1E-2, +1,2, 3#second\r\n"
                                    "#0.5 0.5 0.5\n"
                                    "0.03 -0.05 .01"); /* no newline at the end */
    same(w->ball[0].r, 0.01, 0.02, -0.03);
    same(w->ball[1].r, -0.02, 0.05, 0.01);
    same(w->ball[1].v, 1.0, 2.0, 3.0);
    same(w->ball[2].r, 0.03, -0.05, 0.01);
    mill_world_free(w);
}

SLOW_TEST(numbers_are_read_to_the_last_bit, 1)
{
    uint64_t seed = 1;
    for (int n = 0; n < 300; n++) {
        double x[3][9];
        char rows[2048];
        int used = 0;
        for (int ball = 0; ball < 3; ball++) {
            x[ball][0] = uniform(&seed, -0.05, -0.02) + 0.03 * ball;
            x[ball][1] = uniform(&seed, -0.03, -0.02);
            x[ball][2] = uniform(&seed, -0.05, -0.03);
            for (int k = 3; k < 9; k++)
                x[ball][k] = (below(&seed, 2) ? 1.0 : -1.0) * log_uniform(&seed, 1e-8, 50.0);
            x[ball][0] = fmin(x[ball][0], -0.04 + 0.03 * ball); /* apart by more than a diameter */
            for (int k = 0; k < 9; k++)
                used += snprintf(rows + used, sizeof rows - (size_t)used, "%.17g ", x[ball][k]);
            used += snprintf(rows + used, sizeof rows - (size_t)used, "\n");
        }
        struct mill_world *w = accepted(rows);
        for (int ball = 0; ball < 3; ball++) {
            same(w->ball[ball].r, x[ball][0], x[ball][1], x[ball][2]);
            same(w->ball[ball].v, x[ball][3], x[ball][4], x[ball][5]);
            same(w->spin[ball], x[ball][6], x[ball][7], x[ball][8]);
        }
        mill_world_free(w);
    }
}

/* ---- what is refused ---- */

TEST(a_wrong_number_of_rows_is_refused)
{
    refused("0.01 0.02 -0.03\n0.03 0.02 -0.03\n", 0, "has 2 rows, but the deck has 3 balls");
    refused("0.01 0.02 -0.03\n\n0.03 0.02 -0.03\n0.04 -0.02 -0.03\n#\n0.04 -0.04 -0.03\n", 6,
            "more rows than the 3 balls");
    refused("", 0, "has 0 rows");
    refused("# nothing\n\n", 0, "has 0 rows");
}

TEST(what_is_not_three_six_or_nine_numbers_is_refused)
{
    static const char *const row[] = {"0.01",
                                      "0.01 0.02",
                                      "0.01 0.02 -0.03 1",
                                      "0.01 0.02 -0.03 1 2",
                                      "0.01 0.02 -0.03 1 2 3 4",
                                      "0.01 0.02 -0.03 1 2 3 4 5",
                                      "0.01 0.02 -0.03 1 2 3 4 5 6 7",
                                      "0.01 0.02 -0.03 1 2 3 4 5 6 7 8 9",
                                      "0.01 0.02 x",
                                      "x y z",
                                      "0.01 0.02 -0.03m",
                                      "0.01 0.02 -0.03 mm",
                                      "0.01 0.02 --0.03",
                                      "0.01 0.02 1e",
                                      "0.01 0.02 1e999",
                                      "0.01;0.02;0.03",
                                      "0,01 0,02 -0,03", /* would be six numbers */
                                      "0.01,,0.02,-0.03",
                                      "0x1p-7 0.02 -0.03",
                                      "0.01 0.02 nan",
                                      "nan nan nan",
                                      "0.01 0.02 -0.03 inf 0 0",
                                      "0.01 0.02 -0.03 0 0 0 0 0 -infinity",
                                      "\x01\x02\x7f"};
    for (size_t k = 0; k < sizeof row / sizeof *row; k++) {
        char rows[256];
        snprintf(rows, sizeof rows, "0.05 0 0.05\n%s\n0.04 -0.02 -0.03\n", row[k]);
        refused(rows, 2, "expected 3, 6 or 9 numbers");
    }
}

TEST(a_zero_byte_does_not_hide_the_rest_of_a_line)
{
    static const char rows[] = "0.05 0 0.05\n0.01 0.02 -0.03\0 junk\n0.04 -0.02 -0.03\n";
    struct outcome out = start_from_bytes(rows, sizeof rows - 1);
    ck_assert_int_eq(out.status, MILL_BAD_DECK);
    ck_assert_msg(strstr(out.error.text, ":2: ") != NULL, "%s", out.error.text);
}

TEST(a_file_without_rows_is_refused_at_once_however_long_it_is)
{
    char path[64];
    write_file(path, "", 0);
    const int made = truncate(path, (off_t)1 << 40); /* takes no room: it has a hole */
    struct outcome out = start_from_file(path);
    unlink(path);
    ck_assert_int_eq(made, 0);
    ck_assert_int_eq(out.status, MILL_BAD_DECK);
    ck_assert_msg(strstr(out.error.text, ":1: expected 3, 6 or 9 numbers"), "%s", out.error.text);
}

TEST(a_row_may_have_many_digits_and_a_long_comment_but_not_no_end)
{
    char text[12000];
    int n = snprintf(text, sizeof text, "0.05 0 0.0");
    memset(text + n, '5', 3000);
    n += 3000;
    n += snprintf(text + n, sizeof text - (size_t)n, "\n0.01 0.02 -0.03 #");
    memset(text + n, '#', 8000);
    snprintf(text + n + 8000, sizeof text - (size_t)n - 8000, "\n0.04 -0.02 -0.03\n");
    struct mill_world *w = accepted(text);
    ck_assert_double_eq(w->ball[0].r.z, 1.0 / 18.0);
    mill_world_free(w);
    memset(text, ' ', 5000);
    snprintf(text + 5000, sizeof text - 5000, "0 0 0\n");
    refused(text, 1, "expected 3, 6 or 9 numbers");
}

TEST(two_balls_that_overlap_are_named_by_both_their_lines)
{
    /* the large ones are 10 mm wide, the small one 6 mm */
    refused("# start\n0.01 0.02 -0.03\n\n0.0199 0.02 -0.03\n0.04 -0.02 -0.03\n", 4,
            "overlaps the one of line 2 by 0.0001 m");
    refused("0.01 0.02 -0.03\n0.03 0.02 -0.03\n0.03 0.0125 -0.03\n", 3,
            "overlaps the one of line 2 by 0.0005 m");
    refused("0.01 0.02 -0.03\n0.03 0.02 -0.03\n0.01 0.02 -0.03\n", 3, "of line 1 by 0.008 m");
}

TEST(balls_that_touch_are_accepted)
{
    mill_world_free(accepted("0.01 0.02 -0.03\n0.02 0.02 -0.03\n0.028 0.02 -0.03\n"));
    /* on the drum's bottom, at both end walls */
    mill_world_free(accepted("-0.055 0 -0.07\n0.055 0 -0.07\n0 0 -0.072\n"));
}

TEST(balls_beyond_a_surface_are_refused_with_its_name)
{
    refused("0 0 -0.07\n0 0 -0.0701\n0.04 -0.02 -0.03\n", 2, "overlaps the drum by 0.0001 m");
    refused("0 0 -0.07\n0 0.5 0\n0.04 -0.02 -0.03\n", 2, "overlaps the drum");
    refused("0.0552 0 -0.05\n0 0 -0.03\n0.04 -0.02 -0.03\n", 1, "overlaps an end wall by 0.0002 m");
    refused("-3 0 -0.05\n0 0 -0.03\n0.04 -0.02 -0.03\n", 1, "overlaps an end wall");
    refused("0.05 0 -0.05\n0.04 -0.02 -0.03\n\n0.05 0 -0.0177\n", 4,
            "overlaps the shaft by 0.0003 m");
    refused("0.05 0 -0.05\n0.04 -0.02 -0.03\n0.05 0 0\n", 3, "overlaps the shaft");
    refused("0 0.03 0.0085\n0.04 -0.02 -0.03\n0.04 0.02 -0.03\n", 1,
            "overlaps a blade by 0.0005 m");
    refused("0 0.03 0\n0.04 -0.02 -0.03\n0.04 0.02 -0.03\n", 1, "overlaps a blade");
    refused("1e300 1e300 1e300\n0.04 -0.02 -0.03\n0.04 0.02 -0.03\n", 1, "overlaps");
}

/* Nothing that the loop would square into infinity, and no light. */
TEST(speeds_beyond_all_sense_are_refused)
{
    refused("0.05 0 0.05\n0.01 0.02 -0.03 1e200 0 0\n0.04 -0.02 -0.03\n", 2, "speed");
    refused("0.05 0 0.05\n0.01 0.02 -0.03 0 0 0 1e200 0 0\n0.04 -0.02 -0.03\n", 2, "speed");
}

TEST(a_file_that_cannot_be_read_is_named_with_the_key_that_asks_for_it)
{
    static const char *const path[] = {"/tmp/millsim-no-such-folder/start.txt", "/tmp",
                                       "/dev/full/x"};
    for (int k = 0; k < 3; k++) {
        const struct outcome out = start_from_file(path[k]);
        ck_assert_int_eq(out.status, MILL_BAD_DECK);
        ck_assert_ptr_null(out.world);
        ck_assert_msg(strstr(out.error.text, path[k]) != NULL, "%s", out.error.text);
        ck_assert_msg(strstr(out.error.text, "[balls] start: ") != NULL, "%s", out.error.text);
    }
}

/* ---- random starts ---- */

/* What is said of a drum of 50 mm and these balls */
static const char *answer(const char *balls)
{
    static struct mill_error error;
    char text[1024];
    struct mill_world *w;
    snprintf(text, sizeof text,
             "[run]\ntime = 1 s\n[drum]\nradius = 50 mm\nlength = 100 mm\n[contact]\n"
             "restitution = 0.8\n%s",
             balls);
    struct mill_deck *deck = read_deck(text);
    ck_assert_int_eq(mill_deck_setup_world(deck, NULL, &w, &error), MILL_BAD_DECK);
    ck_assert_ptr_null(w);
    mill_deck_free(deck);
    return error.text;
}

TEST(what_does_not_fit_is_told_with_numbers_that_do)
{
    long large = 0, small = 0;
    const char *one = answer("[balls]\ncount = 1000\ndiameter = 10 mm\ndensity = 7800 kg/m^3\n");
    ck_assert_msg(strstr(one, "[balls] count: 1000 balls do not fit (solid fraction 0.66") != NULL,
                  "%s", one);
    ck_assert_int_eq(sscanf(strchr(one, ';'), "; %ld fit", &large), 1);
    ck_assert(large > 700 && large < 1000);
    const char *two = answer("[balls.large]\ncount = 500\ndiameter = 10 mm\n"
                             "density = 7800 kg/m^3\n[balls.small]\ncount = 8000\n"
                             "diameter = 4 mm\ndensity = 7800 kg/m^3\n");
    ck_assert_msg(strstr(two, "[balls.large] count: 8500 balls do not fit (") != NULL, "%s", two);
    ck_assert_int_eq(sscanf(strchr(two, ';'), "; %ld large, %ld small fit", &large, &small), 2);
    ck_assert(large > 250 && large < 500 && small > 4000 && small < 8000);
}

TEST(where_not_one_ball_fits_this_is_said)
{
    const char *none =
        answer("[balls]\ncount = 1\ndiameter = 40 mm\ndensity = 7800 kg/m^3\n"
               "[rotor]\nspeed = 1 rpm\nshaft_radius = 0 m\n[blade.a]\nposition = 0 mm\n"
               "angle = 0 deg\ntip_radius = 35 mm\nwidth = 100 mm\n"
               "thickness = 70 mm\n[blade.b]\nposition = 0 mm\nangle = 180 deg\n"
               "tip_radius = 35 mm\nwidth = 100 mm\nthickness = 70 mm\n");
    ck_assert_msg(
        strstr(none,
               "not a single ball fits: make the balls, or the bodies in the container, smaller") !=
            NULL,
        "%s", none);
}

/* A slow check of all pairs would take minutes here. */
TEST(many_rows_are_checked_quickly)
{
    enum { BALLS = 100000 };
    char *rows = malloc(BALLS * 64), path[64], text[512];
    size_t used = 0;
    for (int i = 0; i < BALLS; i++)
        used += (size_t)sprintf(rows + used, "%.6f %.6f %.6f\n", 1e-3 * (i % 100 - 49.5),
                                1e-3 * (i / 100 % 32 - 15.5), 1e-3 * (i / 3200 - 15.5));
    write_file(path, rows, used);
    snprintf(text, sizeof text,
             "[run]\ntime = 1 s\n[drum]\nradius = 75 mm\nlength = 120 mm\n[contact]\n"
             "restitution = 0.8\n[balls]\ncount = %d\ndiameter = 0.999 mm\n"
             "density = 7800 kg/m^3\nstart = %s\n",
             BALLS, path);
    struct mill_deck *deck = read_deck(text);
    struct mill_world *w = NULL;
    struct mill_error error = {""};
    ck_assert_msg(mill_deck_setup_world(deck, NULL, &w, &error) == MILL_OK, "%s", error.text);
    ck_assert_double_eq(w->ball[BALLS - 1].r.x, 49.5e-3);
    mill_world_free(w);
    mill_deck_free(deck);
    unlink(path);
    free(rows);
}

int main(void)
{
    return unit_run("start");
}
