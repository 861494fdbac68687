/* Claims about the notes: where hard spheres leave their reach, before a run and after it. */
#include "mill_fixture.h"
#include "observe/notes.h"
#include "unit.h"

static struct fixture f;
static struct mill_notes notes;

static void setup(void)
{
    fixture_init(&f);
}

static void teardown(void)
{
    fixture_free(&f);
}

static const struct mill_note *note_of(const char *code)
{
    for (int i = 0; i < notes.count; i++)
        if (notes.note[i].code && strcmp(notes.note[i].code, code) == 0)
            return &notes.note[i];
    ck_abort_msg("nothing is said of %s", code);
    return NULL;
}

static bool noted(const char *code)
{
    return note_of(code)->text[0] != '\0';
}

static void take(void)
{
    fixture_wait(&f, 1.5);
    ck_assert_int_eq(mill_tally_results_make(f.tally, &f.world, 1.5, &f.results, NULL), MILL_OK);
    mill_notes_take(&notes, &f.world, f.results, 1.5, false, false);
}

/* Two contacts of one pair, `gap` [s] apart, a hundred times */
static void play_pairs(double gap)
{
    fixture_create(&f);
    for (int i = 0; i < 100; i++) {
        fixture_play(&f, impact_of(0.6 + 0.001 * i, MILL_BALL_BALL, i % 40, 41, 0.1, 0.1));
        fixture_play(&f, impact_of(0.6 + 0.001 * i + gap, MILL_BALL_BALL, i % 40, 41, 0.1, 0.1));
    }
    take();
}

/* Below what was compared with soft spheres: 0.3 in a charge that nothing stirs */
TEST(friction_and_a_low_restitution_are_noted_before_the_run)
{
    f.world.law[MILL_BALL_DRUM] = (struct mill_law){.restitution = 0.29, .friction = 0.3};
    mill_notes_expect(&notes, &f.world, NULL, NAN);
    ck_assert(noted("restitution"));
    ck_assert_ptr_nonnull(strstr(note_of("restitution")->text, "ball_drum"));
    f.world.law[MILL_BALL_DRUM].restitution = 0.3;
    mill_notes_expect(&notes, &f.world, NULL, NAN);
    ck_assert(!noted("restitution"));
    f.world.law[MILL_BALL_DRUM] = (struct mill_law){.restitution = 0.2};
    mill_notes_expect(&notes, &f.world, NULL, NAN);
    ck_assert(!noted("restitution"));
}

TEST(a_law_that_no_contact_obeyed_is_not_noted_after_it)
{
    f.world.law[MILL_BALL_BLADE] = (struct mill_law){.restitution = 0.2, .friction = 0.3};
    play_pairs(1e-4);
    ck_assert(!noted("restitution"));
}

TEST(balls_hit_more_often_than_a_contact_lasts_are_noted)
{
    const double contact = mill_tally_contact(&f.world);
    const double rate = FIXTURE_BALLS / contact / 2; /* of all contacts: each hits two */
    mill_notes_expect(&notes, &f.world, NULL, 1.01 * rate);
    ck_assert(noted("contacts_at_once"));
    mill_notes_expect(&notes, &f.world, NULL, 0.99 * rate);
    ck_assert(!noted("contacts_at_once"));
}

TEST(hits_count_for_both_balls_of_a_contact)
{
    play_pairs(1e-4);
    const double hits = 2.0 * 200 / FIXTURE_BALLS; /* on a ball in the second of the window */
    const double expected = hits * mill_tally_contact(&f.world);
    ck_assert(fabs(note_of("contacts_at_once")->value / expected - 1) < 1e-12);
}

TEST(contacts_while_the_pair_still_touches_are_recontacts)
{
    play_pairs(9e-6);
    ck_assert(note_of("recontact_share")->value == 0.5);
    ck_assert(noted("recontact_share"));
}

TEST(contacts_after_the_pair_has_parted_are_none)
{
    play_pairs(11e-6);
    ck_assert(note_of("recontact_share")->value == 0);
    ck_assert(!noted("recontact_share"));
}

/* Of 10 J that the rotor does in the window, 2.1 J on pressed balls; before it, all of 10 J */
static void play_pinches(void)
{
    fixture_create(&f);
    fixture_work(&f, 10);
    f.world.account.pinch_work = 10;
    fixture_wait(&f, 0.6);
    fixture_work(&f, 10);
    f.world.account.pinch_work += 2.1;
    take();
}

TEST(pinches_are_a_share_of_the_power_in_the_window)
{
    play_pinches();
    ck_assert(fabs(note_of("pinches")->value / 0.21 - 1) < 1e-12);
    ck_assert(noted("pinches"));
}

TEST(shares_and_locks_of_a_trial_are_noted_before_the_run)
{
    play_pinches();
    ck_assert(!noted("locks"));
    f.world.counts.smoothed = 1;
    mill_notes_expect(&notes, &f.world, f.results, NAN);
    ck_assert(noted("pinches") && noted("locks"));
    ck_assert(isnan(note_of("contacts_at_once")->value) && !noted("contacts_at_once"));
}

LOOP_TEST(a_stirred_bed_that_rests_is_noted, 3)
{
    static struct mill_motion moves;
    struct mill_shape blade = {.motion = _i < 2 ? &moves : NULL}, *shape[] = {&blade};
    fixture_create(&f);
    f.world.shapes = 1;
    f.world.shape = shape;
    for (int i = 0; i < 100; i++) {
        fixture_play(&f, impact_of(0.6 + 0.001 * i, MILL_BALL_BALL, i % 40, 41, 0.1, 0.1));
        f.world.account.floored[MILL_BALL_BALL] += i < (_i == 0 ? 9 : 11);
    }
    take();
    ck_assert(noted("rubbing") == (_i == 1));
}

TEST(what_is_not_known_is_not_noted)
{
    fixture_create(&f);
    take();
    ck_assert(isnan(note_of("recontact_share")->value) && !noted("recontact_share"));
}

int main(void)
{
    return unit_run_in("notes", setup, teardown);
}
