/* The record of a run: its deck and how it went. */
#include "app/record.h"
#include "output_fixture.h"

static const char deck_text[] = "[run]\n"
                                "time = 250 ms\n"
                                "[balls]\n"
                                "count = 3\n"
                                "diameter = 5 mm\n"
                                "density = 7800 kg/m^3\n"
                                "[drum]\n"
                                "radius = 75 mm\n"
                                "length = 40 mm\n"
                                "[contact]\n"
                                "restitution = 0.8\n";

static struct mill_deck *read_deck(const char *text)
{
    struct mill_deck *deck = NULL;
    struct mill_error error = {""};
    char path[64];
    FILE *out;
    snprintf(path, sizeof path, "/tmp/millsim_test_%ld.ini", (long)getpid());
    out = fopen(path, "w");
    ck_assert_ptr_nonnull(out);
    fputs(text, out);
    fclose(out);
    ck_assert_msg(mill_deck_read(path, 0, NULL, NULL, NULL, &deck, &error) == MILL_OK, "%s",
                  error.text);
    unlink(path);
    return deck;
}

static struct mill_h5 *new_file(struct fixture *f)
{
    struct mill_h5 *file;
    fixture_init(f);
    ck_assert_int_eq(mill_h5_create(f->path, MILL_H5_NEW, &file, NULL), MILL_OK);
    return file;
}

TEST(the_deck_is_stored_entry_by_entry_with_defaults)
{
    struct fixture f;
    struct mill_h5 *file = new_file(&f);
    struct mill_deck *deck = read_deck(deck_text);
    char *text;
    mill_record_start(file, deck, "millsim");
    ck_assert_int_eq(mill_h5_close(file, NULL), MILL_OK);
    text = look_text(f.path, "/deck/run/time", NULL);
    ck_assert(strtod(text, NULL) > 0);
    free(text);
    assert_text(f.path, "/deck/run/seed", NULL, "1"); /* a default */
    text = look_text(f.path, "/deck/drum/radius", "description");
    ck_assert(strlen(text) > 0);
    free(text);
    mill_deck_free(deck);
    unlink(f.path);
}

TEST(the_stored_text_is_a_deck_with_the_same_values)
{
    struct fixture f;
    struct mill_h5 *file = new_file(&f);
    struct mill_deck *deck = read_deck(deck_text), *again;
    char *text;
    mill_record_start(file, deck, "millsim");
    mill_h5_close(file, NULL);
    text = look_text(f.path, "/deck/text", NULL);
    again = read_deck(text);
    ck_assert(again->time == deck->time);
    ck_assert(again->drum_radius == deck->drum_radius);
    ck_assert(again->balls[0].density == deck->balls[0].density);
    ck_assert(again->strike_window == deck->strike_window);
    free(text);
    mill_deck_free(deck);
    mill_deck_free(again);
    unlink(f.path);
}

TEST(a_run_in_progress_says_so)
{
    struct fixture f;
    struct mill_h5 *file = new_file(&f);
    struct mill_deck *deck = read_deck(deck_text);
    char *started;
    mill_record_start(file, deck, "millsim 'my deck.ini'");
    mill_deck_free(deck);
    mill_h5_close(file, NULL);
    assert_text(f.path, "/run/status", NULL, "running");
    assert_text(f.path, "/run/command", NULL, "millsim 'my deck.ini'");
    started = look_text(f.path, "/run/started", NULL);
    ck_assert_uint_eq(strlen(started), strlen("2026-01-01T00:00:00Z"));
    free(started);
    unlink(f.path);
}

TEST(the_end_replaces_what_a_checkpoint_wrote)
{
    struct fixture f;
    struct mill_h5 *file = new_file(&f);
    struct mill_facts facts = {
        .status = "running", .time = 0.1, .local = 0.1, .cost = {3, 2, 0.5, 7}, .peak_memory = 1e6};
    struct mill_sink_file to;
    struct mill_deck *deck = read_deck(deck_text);
    mill_record_start(file, deck, "millsim");
    mill_deck_free(deck);
    f.world.account.collisions[MILL_BALL_WALL] = 5;
    mill_sink_file(&to, file, "/run");
    mill_record_tell(&f.world, &facts, &to.sink);
    facts.status = "complete";
    facts.time = 0.3;
    f.world.account.collisions[MILL_BALL_WALL] = 17;
    f.world.account.floored[MILL_BALL_BALL] = 4;
    f.world.counts.reliefs = 2;
    f.world.counts.largest_overlap = 1e-12;
    mill_sink_file(&to, file, "/run");
    mill_record_tell(&f.world, &facts, &to.sink);
    mill_h5_close(file, NULL);
    assert_text(f.path, "/run/status", NULL, "complete");
    ck_assert(look_at(f.path, "/run/time", 0, 0) == 0.3);
    ck_assert(look_at(f.path, "/run/events/collisions/ball_wall", 0, 0) == 17);
    ck_assert(look_at(f.path, "/run/floored/ball_ball", 0, 0) == 4);
    ck_assert(look_at(f.path, "/run/reliefs", 0, 0) == 2);
    ck_assert(look_at(f.path, "/run/largest_overlap", 0, 0) == 1e-12);
    ck_assert(look_at(f.path, "/run/wall_time", 0, 0) == 3);
    ck_assert(look_at(f.path, "/run/cpu_time", 0, 0) == 2);
    ck_assert(look_at(f.path, "/run/checkpoint_time", 0, 0) == 0.5);
    ck_assert(look_at(f.path, "/run/checkpoints", 0, 0) == 7);
    ck_assert(look_at(f.path, "/run/peak_memory", 0, 0) == 1e6);
    assert_text(f.path, "/run/largest_overlap", "unit", "m");
    unlink(f.path);
}

TEST(memory_and_processor_time_are_those_of_this_process)
{
    ck_assert(mill_record_peak_memory() > 1e6 && mill_record_peak_memory() < 1e11);
    const double used = mill_record_clock(CLOCK_PROCESS_CPUTIME_ID);
    ck_assert(used > 0 && used < 1000);
}

int main(void)
{
    return unit_run("record");
}
