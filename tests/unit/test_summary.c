/* Claims about the summary, as a table and as JSON. */
#include "app/summary.h"
#include "mill_fixture.h"

static struct fixture f;
static struct mill_facts facts;
static char *text;

static void setup(void)
{
    fixture_init(&f);
    facts = (struct mill_facts){.status = "complete",
                                .cost = {.wall = 3.4, .cpu = 3.2},
                                .peak_memory = 34e6,
                                .time = 1.5,
                                .local = 1.5,
                                .version = "0.1",
                                .deck = "input/simoloyer.ini",
                                .output = "simoloyer.h5"};
    text = NULL;
}

static void teardown(void)
{
    fixture_free(&f);
    free(text);
}

/* A steady mill: balls of speed 1 m/s, a thousand contacts of three kinds */
static void run_mill(void)
{
    fixture_create(&f);
    for (int i = 0; i < 1000; i++) {
        const double time = 0.5005 + 0.001 * i;
        fixture_play(&f, impact_of(time, (enum mill_kind)(i % 2 ? 0 : i % 4), i % 40, 40,
                                   0.001 * (1 + i), 0.1));
        fixture_work(&f, 0.1);
    }
    for (int i = 0; i < FIXTURE_BALLS; i++)
        f.ball[i].v.x = 1;
    fixture_wait(&f, 1.5);
}

static const char *printed(bool json)
{
    size_t size;
    FILE *out;
    free(text);
    fixture_wait(&f, facts.time);
    const struct mill_observers observers = {1, {&f.tally->observer}};
    facts.totals = mill_record_add(&f.world, facts.local);
    facts.starts = 1;
    out = open_memstream(&text, &size);
    struct mill_summary summary = {out, &f.world, &observers, &facts, .results = NULL};
    ck_assert_int_eq(mill_summary_write(&summary, json, NULL), MILL_OK);
    fclose(out);
    return text;
}

static void assert_holds(const char *whole, const char *part)
{
    ck_assert_msg(strstr(whole, part) != NULL, "no \"%s\" in:\n%.4000s", part, whole);
}

static void assert_lacks(const char *whole, const char *part)
{
    ck_assert_msg(strstr(whole, part) == NULL, "there is \"%s\" in:\n%.4000s", part, whole);
}

static void assert_fits(const char *table)
{
    while (*table) {
        const size_t length = strcspn(table, "\n");
        ck_assert_msg(length <= 80, "%zu columns: %.*s", length, (int)length, table);
        table += length + (table[length] != '\0');
    }
}

TEST(numbers_have_four_digits_and_the_prefix_that_fits)
{
    static const struct {
        double value;
        const char *unit, *expected;
    } list[] = {
        {0.01234, "m/s", "12.34 mm/s"},     {1, "W", "1.000 W"},
        {999.94, "W", "999.9 W"},           {999.96, "W", "1.000 kW"},
        {123456, "/s", "123.5 thousand/s"}, {0.5, "/s", "0.5000 /s"},
        {2.5e6, "", "2.500 million"},       {12.5, "", "12.50"},
        {-3e-6, "J", "-3.000 uJ"},          {0, "J", "0 J"},
        {1e-12, "J", "1.000 pJ"},           {0.99996e-12, "J", "1.000 pJ"},
        {5e-13, "J", "5.000e-13 J"},        {9.9e14, "/s", "990.0 trillion/s"},
        {1e15, "/s", "1.000e+15 /s"},       {(double)NAN, "W", "-"},
        {INFINITY, "W", "inf W"},
    };
    for (size_t i = 0; i < sizeof list / sizeof *list; i++)
        ck_assert_str_eq(mill_summary_si(list[i].value, list[i].unit), list[i].expected);
}

TEST(the_table_names_the_kinds_that_occurred_and_all)
{
    run_mill();
    const char *table = printed(false);
    assert_holds(table, "\nball_ball ");
    assert_holds(table, "\nball_wall ");
    assert_holds(table, "\nall ");
    assert_lacks(table, "ball_shaft");
    assert_lacks(table, "nan");
}

TEST(the_summary_of_a_slow_run_fits_80_columns)
{
    run_mill();
    for (facts.cost.wall = 1e-3; facts.cost.wall < 1e6; facts.cost.wall *= 3)
        for (facts.cost.cpu = 1e-3; facts.cost.cpu < 1e6; facts.cost.cpu *= 3)
            assert_fits(printed(false));
}

TEST(the_table_gives_power_with_its_standard_error)
{
    run_mill();
    assert_holds(printed(false), "rotor power     100.0 +- 0.");
    assert_holds(text, "(10 revolutions)\n");
    assert_holds(text, " W, 5.000 +- 0.000 kW/kg of balls\n");
    /* a speed that rises through the whole run has a median that is hardly known */
    assert_holds(text,
                 "median v_n      525.1 +- 218.4 mm/s above 50 mm/s, 500.7 +- 240.7 mm/s of all\n");
    assert_holds(text, "hard impacts    0 /s of 1.000 mJ or more\n");
}

TEST(the_table_says_why_there_is_no_standard_error)
{
    f.asked.end = 0.65;
    facts.time = facts.local = 0.65;
    fixture_create(&f);
    assert_holds(printed(false), "(its error is not known: 1.5 revolutions, 3 needed)");
}

TEST(without_anomalies_it_says_none)
{
    run_mill();
    assert_holds(printed(false), "; anomalies: none\n");
    assert_holds(text, ", no anomalies\n");
}

TEST(anomalies_are_counted_by_what_they_are)
{
    run_mill();
    f.world.counts.reliefs = 2;
    f.world.counts.overlaps = 1;
    f.world.counts.largest_overlap = 2.5e-6;
    assert_holds(printed(false), "anomalies:\n                2 pinched balls released,\n         "
                                 "       1 overlaps (up to 2.500 um)\n");
    assert_holds(text, ", 3 anomalies\n");
}

TEST(control_characters_of_file_names_do_not_reach_the_terminal)
{
    facts.deck = "a\033[31mred\n.ini";
    facts.output = "b\033]0;title\007.h5";
    run_mill();
    assert_holds(printed(false), "output          b?]0;title?.h5\n");
    assert_holds(text, "\nmillsim 0.1 a?[31mred?.ini: 1.5 s");
}

TEST(an_energy_that_is_no_number_is_an_anomaly)
{
    run_mill();
    f.world.account.work = (double)NAN;
    assert_holds(printed(false), "1 energies that are not numbers\n");
    assert_holds(text, ", 1 anomaly\n");
}

TEST(the_last_line_says_it_all)
{
    run_mill();
    const char *table = printed(false);
    const char *last = strstr(table, "\nmillsim 0.1 input/simoloyer.ini: 1.5 s in 3.400 s wall, ");
    ck_assert_ptr_nonnull(last);
    ck_assert_ptr_eq(strchr(last + 1, '\n') + 1, table + strlen(table));
}

TEST(the_summary_fits_80_columns_with_every_note_and_large_numbers)
{
    run_mill();
    for (int kind = 0; kind < MILL_KINDS; kind++) {
        f.world.law[kind].restitution = 0.2;
        f.world.law[kind].friction = 0.3;
        f.tally->gathered.impacts[kind].normal.slot[900].count = 123456789012;
        f.tally->gathered.impacts[kind].normal.slot[900].dissipation = 123456.789;
        f.tally->at.at_end.floored[kind] = f.tally->at.at_end.collisions[kind];
    }
    facts.status = "stopped";
    const char *table = printed(false);
    assert_holds(table, "note: stopped at 1.5 s");
    assert_holds(table, "note: contacts with friction have a restitution of 0.2");
    assert_fits(table);
}

TEST(a_run_stopped_before_the_window_has_a_summary)
{
    fixture_create(&f);
    facts.time = facts.local = 0.2;
    facts.status = "stopped";
    assert_holds(printed(false), "nothing was sampled");
    assert_lacks(text, "nan");
    assert_fits(text);
    assert_holds(printed(true), "\"power\": null");
    assert_holds(text, "\"duration\": 0");
}

/* ---- a ring ---- */

/* The balls turn about the axis at `speed` [rad/s] and besides fly along it at `along` [m/s], half
 * of them each way; in the last tenth 1000 drum contacts, and `blade` at the blades. */
static void run_ring(double speed, double along, uint64_t blade)
{
    f.world.g = vec3_make(0, 0, -9.81);
    for (int i = 0; i < FIXTURE_BALLS; i++) {
        f.ball[i].t = 1.5;
        f.ball[i].v =
            vec3_make(i % 2 ? along : -along, -speed * f.ball[i].r.z, speed * f.ball[i].r.y);
    }
    fixture_create(&f);
    fixture_wait(&f, 1);
    f.world.account.collisions[MILL_BALL_BLADE] += 1000;
    fixture_wait(&f, 1.45);
    f.world.account.collisions[MILL_BALL_DRUM] += 1000;
    f.world.account.collisions[MILL_BALL_BLADE] += blade;
}

TEST(a_ring_that_the_rotor_does_not_touch_is_noted_with_its_speed)
{
    run_ring(0.62 * f.world.rotor_speed, 0.1, 1);
    assert_holds(printed(false),
                 "note: the rotor no longer reaches the charge, which turns as a ring, at 62 %");
    assert_holds(text, "in a smooth drum without\n      friction");
    assert_fits(text);
}

TEST(the_drums_friction_is_not_denied_to_a_ring_that_has_it)
{
    f.world.law[MILL_BALL_DRUM].friction = 0.3;
    run_ring(0.62 * f.world.rotor_speed, 0.1, 1);
    assert_holds(printed(false), "turns as a ring, at 62 %");
    assert_lacks(text, "without friction");
}

TEST(a_charge_that_the_rotor_still_strikes_is_no_ring)
{
    run_ring(f.world.rotor_speed, 0, 10);
    assert_lacks(printed(false), "ring");
}

TEST(a_charge_too_slow_to_stay_up_is_no_ring)
{
    const double staying = sqrt(9.81 / 0.06);
    run_ring(0.99 * staying, 0, 0);
    assert_lacks(printed(false), "ring");
    teardown();
    setup();
    run_ring(1.01 * staying, 0, 0);
    assert_holds(printed(false), "ring");
}

TEST(a_charge_with_much_other_motion_is_no_ring)
{
    run_ring(20, 20 * 0.06 * 0.36,
             0); /* 1 - 1/(1 + 0.36^2) = 0.115 of the energy is along the axis */
    assert_lacks(printed(false), "ring");
}

TEST(an_inelastic_charge_without_friction_is_not_noted)
{
    f.world.law[MILL_BALL_BALL].restitution = 0.5;
    run_mill();
    assert_lacks(printed(false), "note:");
}

/* ---- JSON ---- */

TEST(json_gives_numbers_to_full_precision_and_no_nan)
{
    run_mill();
    f.world.account.motion[0].work = 0.1 + 0.2;
    const char *json = printed(true);
    assert_holds(json, "\"rotor_work\": 0.30000000000000004");
    assert_holds(json, "\"stopped\": false");
    assert_holds(json, "\"notes\": []");
    assert_lacks(json, "nan");
    assert_lacks(json, "inf");
    ck_assert_int_eq(json[0], '{');
    ck_assert_str_eq(json + strlen(json) - 2, "}\n");
}

TEST(json_escapes_what_a_file_name_may_hold)
{
    run_mill();
    facts.output = "a\"b\\c\nd\x7f"
                   "\xc3\xa9.h5";
    assert_holds(printed(true), "\"output\": \"a\\\"b\\\\c\\u000ad\\u007f\xc3\xa9.h5\"");
}

TEST(json_replaces_bytes_that_are_not_utf_8)
{
    run_mill();
    facts.output = "a\xff.h5\xc3";
    assert_holds(printed(true), "\"output\": \"a\\ufffd.h5\\ufffd\"");
}

TEST(json_groups_are_balanced_and_members_separated)
{
    int depth = 0;
    run_mill();
    facts.status = "stopped"; /* a note */
    for (const char *p = printed(true); *p; p++) {
        depth += *p == '{' || *p == '[';
        depth -= *p == '}' || *p == ']';
        ck_assert_int_ge(depth, 0);
        if (*p == ',')
            ck_assert(p[1] == '\n' || p[1] == ' ');
    }
    ck_assert_int_eq(depth, 0);
    assert_lacks(text, ",\n}");
    assert_lacks(text, "{,");
}

int main(void)
{
    return unit_run_in("summary", setup, teardown);
}
