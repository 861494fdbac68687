/* The deck as a struct: what is read, what follows from it, what prints back to the same bits. The
 * messages are tested through the program, in tests/cli/test_deck.py. */
#include "deck/deck_private.h"
#include "deck_fixture.h"

#include <math.h>

#define BASE                                                                                       \
    "[run]\ntime = 0.3 s\n[drum]\nradius = 75 mm\nlength = 120 mm\n[contact]\nrestitution = 0.8\n"
#define BALLS "[balls]\ncount = 40\ndiameter = 5 mm\ndensity = 7800 kg/m^3\n"
#define ROTOR "[rotor]\nspeed = 1000 rpm\nshaft_radius = 15 mm\n"
#define BLADES "[blades]\ncount = 5\ntip_radius = 67 mm\nwidth = 12 mm\nthickness = 7 mm\n"
#define BLADE(name, x)                                                                             \
    "[blade." name "]\nposition = " x " mm\nangle = 90 deg\ntip_radius = 60 mm\n"                  \
    "width = 10 mm\nthickness = 5 mm\n"

/* Blade k, behind the shaft */
static const struct mill_body *blade_of(const struct mill_deck *deck, int k)
{
    ck_assert_int_lt(1 + k, deck->mill.parts);
    ck_assert_int_eq(deck->setup.surface[1 + k].number, k);
    ck_assert_int_eq(deck->setup.surface[1 + k].kind, MILL_BALL_BLADE);
    return deck->setup.surface[1 + k].body;
}

static bool is_blade(const struct mill_body *body, double position, double angle, double tip)
{
    return fabs(body->centre.x - position) < 1e-16 && fabs(body->size.y - tip) < 1e-16 &&
           fabs(body->centre.y - 0.5 * tip * cos(angle)) < 1e-15 &&
           fabs(body->centre.z - 0.5 * tip * sin(angle)) < 1e-15;
}

TEST(equal_blades_are_spread_along_the_drum_and_around_the_rotor)
{
    struct mill_deck *deck = read_good(BASE BALLS ROTOR BLADES);
    ck_assert_int_eq(deck->mill.parts, 1 + 5);
    for (int k = 0; k < 5; k++)
        ck_assert(
            is_blade(blade_of(deck, k), -0.06 + (k + 0.5) * 0.024, k * 2 * MILL_PI / 5, 0.067));
    ck_assert(blade_of(deck, 2)->centre.x == 0.0 && blade_of(deck, 2)->size.x == 0.012);
}

TEST(an_angle_step_of_ones_own_counts)
{
    struct mill_deck *deck = read_good(BASE BALLS ROTOR BLADES "angle_step = 90 deg\n");
    ck_assert(is_blade(blade_of(deck, 3), 0.024, 1.5 * MILL_PI, 0.067));
}

TEST(equal_blades_come_before_single_ones_in_the_decks_order)
{
    struct mill_deck *deck =
        read_good(BLADE("zebra", "10") BASE BALLS ROTOR BLADE("ant", "-10") BLADES);
    ck_assert_int_eq(deck->mill.parts, 1 + 7);
    ck_assert_str_eq(mill_deck_section_of(deck, 0), "rotor");
    ck_assert_str_eq(mill_deck_section_of(deck, 5), "blades");
    ck_assert_str_eq(mill_deck_section_of(deck, 6), "blade.zebra");
    ck_assert_str_eq(mill_deck_section_of(deck, 7), "blade.ant");
    ck_assert(blade_of(deck, 5)->centre.x == 0.01 && blade_of(deck, 6)->centre.x == -0.01);
}

/* All that a run is made from, to the bit. */
static void assert_same(const struct mill_deck *a, const struct mill_deck *b)
{
    ck_assert(a->observe.end == b->observe.end &&
              a->observe.sample_from == b->observe.sample_from && a->setup.seed == b->setup.seed);
    ck_assert_mem_eq(&a->setup.gravity, &b->setup.gravity, sizeof a->setup.gravity);
    ck_assert_int_eq(a->setup.species, b->setup.species);
    for (int k = 0; k < a->setup.species; k++) {
        ck_assert_str_eq(a->setup.balls[k].name, b->setup.balls[k].name);
        ck_assert(a->mill.balls[k].count == b->mill.balls[k].count);
        ck_assert(a->mill.balls[k].diameter == b->mill.balls[k].diameter);
        ck_assert(a->mill.balls[k].density == b->mill.balls[k].density);
    }
    ck_assert(!a->given.start == !b->given.start &&
              (!a->given.start || strcmp(a->given.start, b->given.start) == 0));
    ck_assert(a->setup.speed == b->setup.speed && a->mill.rotor == b->mill.rotor);
    ck_assert(a->given.rotor.speed == b->given.rotor.speed);
    ck_assert(a->setup.drum.radius == b->setup.drum.radius &&
              a->setup.drum.length == b->setup.drum.length);
    ck_assert(a->given.shaft_radius == b->given.shaft_radius &&
              a->given.rotor.angle == b->given.rotor.angle);
    ck_assert_int_eq(a->mill.parts, b->mill.parts);
    for (int k = 0; k < a->mill.parts; k++)
        ck_assert_mem_eq(a->setup.surface[k].body, b->setup.surface[k].body,
                         sizeof(struct mill_body));
    for (int k = 0; k < a->mill.contacts.count; k++) {
        const struct mill_deck_law *x = &a->mill.contact[k].law, *y = &b->mill.contact[k].law;
        ck_assert(x->restitution == y->restitution && x->speed == y->speed && !x->rows && !y->rows);
        ck_assert(x->friction == y->friction && x->tangential == y->tangential);
    }
    const double floor[2] = {a->setup.rebound_floor, b->setup.rebound_floor};
    ck_assert(floor[0] == floor[1] || (isnan(floor[0]) && isnan(floor[1])));
    ck_assert(a->observe.frames == b->observe.frames && a->observe.starts == b->observe.starts);
    ck_assert(a->observe.series == b->observe.series &&
              a->observe.log_impacts == b->observe.log_impacts);
    ck_assert(isnan(a->observe.strike_window) && isnan(b->observe.strike_window));
    ck_assert(isnan(a->observe.hard) && isnan(b->observe.hard));
    ck_assert(a->given.checkpoint == b->given.checkpoint);
}

LOOP_TEST(a_printed_deck_reads_back_to_the_same_bits, 4)
{
    static const char *const decks[] = {
        BASE BALLS,
        BASE BALLS ROTOR BLADES "pitch = 7 deg\n" BLADE("a", "3.3") "[output]\nimpacts = all\n",
        BASE BALLS "start = \"a # b; c.txt\"\n[contact.ball_drum]\nfriction = 0.17\n",
        BASE "[balls.z]\ncount=3\ndiameter=5.1 mm\ndensity=7.77 g/cm^3\n"
             "[balls.a]\ncount=4\ndiameter=3.3 mm\ndensity=480 lb/ft^3\n" ROTOR,
    };
    struct mill_deck *deck = read_good(decks[_i]);
    char *text = print(deck);
    struct mill_deck *again = read_good(text);
    assert_same(deck, again);
    char *second = print(again);
    ck_assert_str_eq(second, text);
}

/* The motion of the rotor follows from it, in whatever order the sections are. */
TEST(a_tip_speed_gives_the_rotors_motion)
{
    static const char *const decks[] = {
        BASE BALLS "[rotor]\ntip_speed = 3.35 m/s\nshaft_radius = 15 mm\n" BLADES,
        BLADES "[rotor]\ntip_speed = 3.35 m/s\nshaft_radius = 15 mm\n" BASE BALLS,
        BASE BALLS "[rotor]\nspeed = 1 rpm\nshaft_radius = 15 mm\n" BLADES,
    };
    for (int k = 0; k < 3; k++) {
        struct mill_deck *deck = read_good(decks[k]);
        const struct mill_turn *turn = deck->mill.motion[0].form;
        ck_assert_double_eq_tol(turn->speed, k < 2 ? 50.0 : MILL_PI / 30.0, 1e-14);
        ck_assert(deck->given.tip_speed == (k < 2 ? 3.35 : 0.0));
        ck_assert_ptr_null(strstr(print(deck), "tip_speed"));
    }
}

/* The printed deck has a section for each kind, also where the text that was read has none. */
TEST(a_law_of_materials_says_where_it_comes_from_and_is_printed)
{
    struct mill_deck *deck = read_good(
        "[run]\ntime = 1 s\n[drum]\nradius = 75 mm\nlength = 120 mm\nmaterial = agate\n"
        "[contact]\nfriction = 0.3\n[contact.ball_wall]\nrestitution = 0.5\nfriction = 0.1\n" BALLS
        "material = steel\n");
    const struct mill_deck_contact *ball = &deck->mill.contact[MILL_BALL_BALL];
    const struct mill_deck_contact *drum = &deck->mill.contact[MILL_BALL_DRUM];
    const struct mill_deck_contact *wall = &deck->mill.contact[MILL_BALL_WALL];
    ck_assert(ball->takes.restitution && !ball->takes.friction && ball->takes.tangential);
    ck_assert(ball->law.rows && isnan(ball->law.restitution) && ball->law.friction == 0.3);
    ck_assert_int_eq(mill_deck_laws_fall(&ball->law).points, 10);
    ck_assert_ptr_nonnull(strstr(ball->assumed, "steel on steel: "));
    ck_assert_str_eq(drum->assumed, "steel on agate: the lower values of both");
    ck_assert(wall->law.restitution == 0.5 && !wall->law.rows && !wall->takes.restitution);
    ck_assert(wall->law.friction == 0.1 && !wall->takes.friction);
    ck_assert(wall->law.tangential == drum->law.tangential && wall->takes.tangential);
    ck_assert_str_eq(wall->assumed, "steel on agate");
    const char *printed = print(deck), *first = strstr(printed, "[contact.ball_wall]");
    ck_assert_ptr_nonnull(first);
    ck_assert(first < strstr(printed, "[contact.ball_ball]"));
    ck_assert_ptr_nonnull(strstr(printed, "restitution_table = steel"));
}

TEST(random_numbers_read_back_to_the_same_bits)
{
    srand(7);
    for (int n = 0; n < 40; n++) {
        char text[1200];
        const double u = rand() / 2147483647.0, v = rand() / 2147483647.0;
        snprintf(text, sizeof text,
                 "[run]\ntime = %.17g s\n[drum]\nradius = %.17g mm\nlength = %.17g inch\n"
                 "[contact]\nrestitution = %.17g\n" BALLS
                 "[rotor]\nspeed = %.17g rpm\nshaft_radius = %.17g mm\nangle = %.17g deg\n",
                 0.1 + u, 60 + u, 3 + v, v, 4000 * (v - 0.5), 10 * u, 1e3 * (u - v));
        struct mill_deck *deck = read_good(text);
        char *printed = print(deck);
        struct mill_deck *again = read_good(printed);
        assert_same(deck, again);
    }
}

/* Whatever a file holds, reading it ends with a deck or with one line. */
TEST(a_damaged_deck_is_read_or_refused_in_one_line)
{
    static const char whole[] = BASE BALLS ROTOR BLADES BLADE("a", "0");
    static const char *const bits[] = {"[",     "]",   "=",   "\"", "\n", " #",
                                       "1e999", "nan", "0x1", "mm", "-"};
    srand(3);
    for (int n = 0; n < 300; n++) {
        char text[2 * sizeof whole];
        size_t length = sizeof whole - 1;
        memcpy(text, whole, length);
        for (int k = rand() % 4; k >= 0; k--) {
            const size_t at = (size_t)rand() % length;
            const char *bit = bits[(size_t)rand() % (sizeof bits / sizeof *bits)];
            if (rand() % 2) {
                text[at] = (char)rand();
            } else {
                memmove(text + at + strlen(bit), text + at, length - at);
                memcpy(text + at, bit, strlen(bit));
                length += strlen(bit);
            }
        }
        struct mill_deck *deck = NULL;
        const enum mill_status status = read_text(text, length, &deck);
        ck_assert(status == MILL_OK ? deck != NULL : deck == NULL && status == MILL_BAD_DECK);
        ck_assert(status == MILL_OK || strncmp(error.text, path, strlen(path)) == 0);
        ck_assert_ptr_null(strchr(error.text, '\n'));
        mill_deck_free(deck);
    }
}

/* "drum.diameter": is it a key, or without a point a section, of the table? */
static bool is_here(const char *here, const char *key)
{
    char title[64];
    snprintf(title, sizeof title, "%.*s", key ? (int)(key - 1 - here) : 60, here);
    return mill_deck_table_find(title) && (!key || mill_deck_table_key(title, key, 0));
}

/* Every mend of a word of the trade names a key or section that exists, and is said for this word.
 */
TEST(every_word_of_the_trade_leads_to_a_key_or_section_that_exists)
{
    int words = 0;
    for (const struct mill_deck_synonym *row = mill_deck_suggest_synonyms; row->of; row++) {
        const bool section = !*row->of, any = strcmp(row->of, "*") == 0;
        const char *key = row->here && !section ? strrchr(row->here, '.') + 1 : NULL;
        char title[64], all[400], hint[400];
        ck_assert_msg(!row->here || is_here(row->here, key), "%s", row->here);
        ck_assert(row->here || row->remark);
        snprintf(title, sizeof title, "%s", any ? "run" : row->of);
        if (strcmp(title, "blade") == 0 || strcmp(title, "motion") == 0 ||
            strcmp(title, "body") == 0)
            strcat(title, ".NAME");
        ck_assert(section || is_here(title, NULL));
        snprintf(all, sizeof all, "%s", row->words);
        for (char *word = strtok(all, " "); word; word = strtok(NULL, " "), words++) {
            /* not a right name, and not in an earlier row */
            ck_assert_msg(section ? !is_here(word, NULL) : !mill_deck_table_key(title, word, 0),
                          "%s.%s", title, word);
            mill_deck_suggest_key(section ? word : title, section ? NULL : word, hint, sizeof hint);
            ck_assert_msg(any || strstr(hint, row->here ? row->here : row->remark), "%s.%s: '%s'",
                          title, word, hint);
        }
    }
    ck_assert_int_gt(words, 200);
}

int main(void)
{
    return unit_run_in("deck", make_file, remove_file);
}
