/* The progress line: fits the terminal, tells the share done honestly, and is rare in a log file.
 */
#include "app/progress.h"
#include "unit.h"

static const struct mill_progress start = {.end = 0.3};
static const struct mill_progress half = {
    .time = 0.15, .end = 0.3, .collisions = 12000000, .wall = 5.0};

TEST(all_is_told_where_there_is_room)
{
    char line[MILL_PROGRESS_LINE];
    mill_progress_format(&start, &half, 120, line);
    ck_assert_str_eq(
        line, "0.15 s of 0.3 s   50 %   2.4e+06 contacts/s   0.03 simulated s per s   5 s left");
}

TEST(the_line_is_never_wider_than_asked)
{
    char line[MILL_PROGRESS_LINE];
    for (int width = 0; width < 300; width++) {
        mill_progress_format(&start, &half, width, line);
        ck_assert_int_le((int)strlen(line), width);
        ck_assert(width < 4 || strstr(line, "50 %"));
    }
}

/* Every field as long as it can be: more than a line has room for in all. */
TEST(the_longest_fields_stay_within_the_line)
{
    static const char known[] =
        "median of v_n to 0.5 %, mean power to 0.25 %, both at level 95 %, and so on";
    const struct mill_progress then = {.end = 1e300};
    const struct mill_progress now = {.time = -1.235e-307,
                                      .end = -1.234e-307,
                                      .collisions = UINT64_MAX,
                                      .wall = 1e-300,
                                      .known = known};
    char line[2 * MILL_PROGRESS_LINE];
    for (int width = 0; width < 400; width++) {
        memset(line, '#', sizeof line);
        mill_progress_format(&then, &now, width, line);
        ck_assert_ptr_nonnull(memchr(line, 0, MILL_PROGRESS_LINE));
        ck_assert_int_le((int)strlen(line), width);
        for (size_t i = MILL_PROGRESS_LINE; i < sizeof line; i++)
            ck_assert_int_eq(line[i], '#');
    }
}

TEST(only_the_end_is_100_percent)
{
    char line[MILL_PROGRESS_LINE];
    struct mill_progress now = {.time = 0.29999999, .end = 0.3, .collisions = 1, .wall = 1.0};
    mill_progress_format(&start, &now, 120, line);
    ck_assert_ptr_nonnull(strstr(line, " 99 %"));
    now.time = 0.3;
    mill_progress_format(&start, &now, 120, line);
    ck_assert_ptr_nonnull(strstr(line, " 100 %"));
}

TEST(the_first_instant_claims_no_rates)
{
    char line[MILL_PROGRESS_LINE];
    mill_progress_format(&start, &start, 120, line);
    ck_assert_str_eq(line, "0 s of 0.3 s   0 %");
}

/* Balls placed are no simulated time: no rates come of them, neither now nor later. */
TEST(a_start_that_takes_long_is_shown_by_what_it_does)
{
    const struct mill_progress placing = {
        .time = 4e5, .end = 1e6, .wall = 2.5, .stage = "dropping balls"};
    const struct mill_progress begun = {.end = 0.3, .wall = 9.0, .begins = true};
    const struct mill_progress later = {.time = 0.15, .end = 0.3, .collisions = 100, .wall = 14.0};
    char *text = NULL;
    size_t size = 0;
    struct mill_progress_display display;
    mill_progress_init(&display, open_memstream(&text, &size), MILL_PROGRESS_TERMINAL);
    mill_progress_show(&display, &placing);
    mill_progress_show(&display, &begun);
    mill_progress_show(&display, &later);
    fclose(display.out);
    ck_assert_msg(strstr(text, "\rdropping balls   40 %"), "%s", text);
    ck_assert_msg(
        strstr(text,
               "\r0.15 s of 0.3 s   50 %   20 contacts/s   0.03 simulated s per s   5 s left"),
        "%s", text);
    free(text);
}

static const struct left {
    double wall; /* [s] for half of the run: as much is left */
    const char *text;
} lefts[] = {
    {7.2, "8 s left"},          {130.5, "2 min 10 s left"},    {3930.0, "1 h 05 min left"},
    {100000.0, "1 d 3 h left"}, {1e9, "more than 100 d left"},
};

LOOP_TEST(time_left_is_told_in_its_own_units, COUNT(lefts))
{
    char line[MILL_PROGRESS_LINE];
    const struct mill_progress now = {
        .time = 0.15, .end = 0.3, .collisions = 1, .wall = lefts[_i].wall};
    mill_progress_format(&start, &now, 150, line);
    ck_assert_ptr_nonnull(strstr(line, lefts[_i].text));
}

TEST(a_log_gets_a_line_after_2_s_and_then_at_growing_gaps)
{
    static const double due[] = {2.0, 12.0, 32.0, 72.0, 152.0};
    struct mill_progress_display display;
    char *text = NULL;
    size_t size = 0;
    size_t lines = 0;
    FILE *out = open_memstream(&text, &size);
    ck_assert_ptr_nonnull(out);
    mill_progress_init(&display, out, MILL_PROGRESS_LOG);
    for (int tick = 1; tick <= 800; tick++) {
        const struct mill_progress now = {
            .time = 1e-6 * tick, .end = 0.3, .collisions = 1000, .wall = 0.25 * tick};
        const size_t before = size;
        mill_progress_show(&display, &now);
        if (size == before)
            continue;
        ck_assert_uint_lt(lines, sizeof due / sizeof *due);
        ck_assert(now.wall == due[lines]);
        lines++;
    }
    ck_assert_uint_eq(lines, sizeof due / sizeof *due);
    mill_progress_end(&display);
    fclose(out);
    ck_assert_ptr_null(strchr(text, '\r'));
    ck_assert(text[size - 1] == '\n' && text[size - 2] != '\n');
    free(text);
}

/* The n-th line of the text */
static const char *line_of(const char *text, int n)
{
    for (; n > 0; n--)
        text = strchr(text, '\n') + 1;
    return text;
}

static void is_line(const char *text, int n, const char *expected)
{
    const char *line = line_of(text, n);
    const size_t length = strcspn(line, "\n");
    ck_assert_msg(length == strlen(expected) && strncmp(line, expected, length) == 0,
                  "line %d: %.*s\nexpected: %s", n, (int)length, line, expected);
}

TEST(a_program_gets_objects_twice_a_second_and_when_the_state_changes)
{
    struct mill_progress_display display;
    struct mill_progress now = {.end = 8, .wall = 2, .begins = true};
    char *text = NULL;
    size_t size = 0;
    int lines = 0;
    mill_progress_init(&display, open_memstream(&text, &size), MILL_PROGRESS_OBJECTS);
    mill_progress_show(&display,
                       &(struct mill_progress){1, 4, .wall = 1, .stage = "dropping balls"});
    for (int quarter = 0; quarter <= 16; quarter++) { /* a second simulated takes half of one */
        now.time = 0.5 * quarter;
        now.wall = 2 + 0.25 * quarter;
        now.collisions = (uint64_t)quarter * 10;
        now.begins = quarter == 0;
        now.state = quarter < 3 ? "settling" : "sampling";
        now.known = quarter < 3 ? "" : "median +- 1 %";
        mill_progress_show(&display, &now);
    }
    now.state = "writing";
    mill_progress_show(&display, &now);
    mill_progress_show(&display,
                       &(struct mill_progress){3, 4, .wall = 6.5, .stage = "writing /VTKHDF"});
    mill_progress_end(&display);
    fclose(display.out);
    for (const char *p = text; (p = strchr(p, '\n')) != NULL; p++)
        lines++;
    is_line(text, 0,
            "{\"state\": \"starting\", \"time\": null, \"end\": null, \"share\": 0.25, "
            "\"left\": null, \"contacts\": null, \"contacts_per_second\": null, \"wall\": 1, "
            "\"what\": \"dropping balls\"}");
    is_line(text, 1,
            "{\"state\": \"settling\", \"time\": 0, \"end\": 8, \"share\": 0, \"left\": null, "
            "\"contacts\": 0, \"contacts_per_second\": null, \"wall\": 2, \"what\": \"\"}");
    is_line(text, 2,
            "{\"state\": \"settling\", \"time\": 1, \"end\": 8, \"share\": 0.125, \"left\": 3.5, "
            "\"contacts\": 20, \"contacts_per_second\": 40, \"wall\": 2.5, \"what\": \"\"}");
    is_line(text, 3,
            "{\"state\": \"sampling\", \"time\": 1.5, \"end\": 8, \"share\": 0.1875, \"left\": "
            "3.25, \"contacts\": 30, \"contacts_per_second\": 40, \"wall\": 2.75, \"what\": "
            "\"median +- 1 %\"}");
    is_line(text, lines - 2,
            "{\"state\": \"writing\", \"time\": 8, \"end\": 8, \"share\": 1, \"left\": 0, "
            "\"contacts\": 160, \"contacts_per_second\": 40, \"wall\": 6, \"what\": \"median +- 1 "
            "%\"}");
    is_line(text, lines - 1,
            "{\"state\": \"writing\", \"time\": null, \"end\": null, \"share\": 0.75, \"left\": "
            "null, \"contacts\": null, \"contacts_per_second\": null, \"wall\": 6.5, \"what\": "
            "\"writing /VTKHDF\"}");
    ck_assert_int_eq(lines, 1 + 2 + 7 + 2); /* 7: at 2.75, 3.25, ... 5.75 */
    free(text);
}

TEST(a_shorter_line_wipes_out_the_longer_one_before)
{
    struct mill_progress_display display;
    char *text = NULL;
    size_t size = 0;
    FILE *out = open_memstream(&text, &size);
    ck_assert_ptr_nonnull(out);
    mill_progress_init(&display, out, MILL_PROGRESS_TERMINAL);
    mill_progress_show(&display, &half);
    const size_t longer = size;
    mill_progress_show(&display, &start);
    ck_assert_uint_eq(size, 2 * longer);
    mill_progress_end(&display);
    ck_assert_uint_eq(size, 2 * longer + 1);
    mill_progress_end(&display);
    ck_assert_uint_eq(size, 2 * longer + 1);
    fclose(out);
    free(text);
}

/* Runs of the reference mill with other charges: millions of contacts at these shares of the time
 * (the series of `collisions`, seed 1). */
enum { MARKS = 20 };
static const double mark[MARKS] = {0,   0.02, 0.04, 0.06, 0.08, 0.1, 0.12, 0.14, 0.16, 0.18,
                                   0.2, 0.25, 0.3,  0.4,  0.5,  0.6, 0.7,  0.8,  0.9,  1};
static const struct recorded {
    int balls;
    double rpm, restitution, end; /* [s] */
    double contacts[MARKS];
} runs[] = {
    {4000, 1000, 0.8, 0.3, {0,       0.002271, 0.008272, 0.01625, 0.02691, 0.04168, 0.06591,
                            0.09842, 0.1353,   0.1803,   0.2151,  0.314,   0.4222,  0.6513,
                            0.8996,  1.187,    1.463,    1.737,   2.011,   2.301}},
    {6154, 600, 0.8, 0.3, {0,       0.002473, 0.009011, 0.02069, 0.03416, 0.05085, 0.07136,
                           0.09755, 0.1451,   0.2231,   0.3225,  0.5868,  0.886,   1.472,
                           1.965,   2.526,    3.109,    3.693,   4.333,   5.089}},
    {7693, 1000, 0.6, 0.2, {0,     0.01072, 0.07707, 0.1778, 0.3051, 0.4816, 0.8157,
                            1.348, 2.143,   3.156,   4.563,  7.518,  10.51,  17.63,
                            25.02, 32.37,   39.78,   47.65,  55.24,  63.09}},
    {12308, 1000, 0.8, 0.2, {0,     0.09304, 0.2855, 0.5923, 1.336, 2.824, 4.925,
                             7.007, 8.729,   10.04,  11.57,  15.53, 19.54, 27.93,
                             35.58, 42.67,   49.94,  56.94,  64.03, 70.88}},
};
#define CONTACT 2e-5 /* [s] of wall time: a slow machine */

/* Share of the time that is done after so many contacts */
static double share_at(const struct recorded *run, double contacts)
{
    int k = 1;
    while (k < MARKS - 1 && run->contacts[k] < contacts)
        k++;
    const double part =
        (contacts - run->contacts[k - 1]) / (run->contacts[k] - run->contacts[k - 1]);
    return mark[k - 1] + part * (mark[k] - mark[k - 1]);
}

/* [s] of "1 h 05 min left" and the like */
static double seconds_of(const char *line)
{
    const char *left = strstr(line, " left");
    int a = 0, b = 0;
    ck_assert_msg(left != NULL, "%s", line);
    while (left > line && strncmp(left - 3, "   ", 3) != 0)
        left--;
    left += strncmp(left, "at least ", 9) == 0 ? 9 : 0;
    if (sscanf(left, "%d h %d min left", &a, &b) == 2)
        return 3600 * a + 60 * b;
    if (sscanf(left, "%d min %d s left", &a, &b) == 2)
        return 60 * a + b;
    ck_assert_int_eq(sscanf(left, "%d s left", &a), 1);
    return a;
}

LOOP_TEST(from_a_tenth_on_the_time_left_is_right_within_a_factor_of_2, COUNT(runs))
{
    const struct recorded *run = &runs[_i];
    const double takes = 1e6 * run->contacts[MARKS - 1] * CONTACT;
    struct mill_progress_display display;
    char *text = NULL;
    size_t size = 0;
    int told = 0;
    mill_progress_init(&display, open_memstream(&text, &size), MILL_PROGRESS_TERMINAL);
    mill_progress_show(&display, &(struct mill_progress){.end = run->end, .begins = true});
    for (double wall = 0.25; wall < takes; wall += 0.25) {
        const double share = share_at(run, wall / CONTACT * 1e-6), left = takes - wall;
        const size_t before = size;
        const struct mill_progress now = {
            .time = share * run->end, .end = run->end, .early = 60 / run->rpm, .wall = wall};
        mill_progress_show(&display, &now);
        if (share < 0.1 || left < 2) /* whole seconds are told */
            continue;
        const bool bound = strstr(text + before, "at least ") != NULL;
        const double said = seconds_of(text + before);
        ck_assert(bound == (share * run->end < 60 / run->rpm));
        ck_assert_msg(said < 2 * left && (bound || said > left / 2),
                      "at %.0f %%: %.0f s told, %.0f s left", 100 * share, said, left);
        told++;
    }
    ck_assert_int_gt(told, 100);
    fclose(display.out);
    free(text);
}

int main(void)
{
    return unit_run("progress");
}
