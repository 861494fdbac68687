/* Claims about /checkpoint: the state of a run comes back from the file as it was put there, and
 * whatever is not this program's whole state is refused with a line that says what it is. And about
 * the list of places that states are made from. */
#include "app/checkpoint.h"
#include "sim_mills.h"

#include <stddef.h>

/* A mill with all its observers, writing into a file */
struct run {
    struct bench bench;
    char path[64];
    struct mill_h5 *file;
    struct mill_checkpoint_parts parts;
};

static void observe(struct run *r, struct mill_observer *observer)
{
    ck_assert_int_eq(mill_sim_observe(r->bench.sim, observer), MILL_OK);
}

static void open_run(struct run *r, const char *deck)
{
    struct mill_error error = {""};
    struct bench *b = &r->bench;
    memset(r, 0, sizeof *r);
    bench_open(b, deck, NULL);
    snprintf(r->path, sizeof r->path, "/tmp/millsim_checkpoint_%ld.h5", (long)getpid());
    unlink(r->path);
    struct mill_checkpoint_parts *p = &r->parts;
    p->sim = b->sim;
    ck_assert_msg(
        mill_h5_create(r->path, MILL_H5_NEW, &r->file, &error) == MILL_OK &&
            mill_tally_create(b->deck, b->world, &p->tally, &error) == MILL_OK &&
            mill_frames_create(r->file, b->deck, b->world, &p->frames, &error) == MILL_OK &&
            mill_series_create(r->file, b->deck, b->world, &p->series, &error) == MILL_OK &&
            mill_impactlog_create(r->file, b->deck, b->world, &p->log, &error) == MILL_OK,
        "%s", error.text);
    observe(r, mill_tally_observer(p->tally));
    observe(r, p->frames);
    observe(r, p->series);
    observe(r, p->log);
}

static void close_run(struct run *r)
{
    mill_frames_free(r->parts.frames);
    mill_series_free(r->parts.series);
    mill_impactlog_free(r->parts.log);
    mill_tally_free(r->parts.tally);
    mill_h5_abandon(r->file);
    bench_close(&r->bench);
    unlink(r->path);
}

static struct run run;
static const struct mill_record_cost cost = {7.5, 3.25, 0.5, 9};
static struct mill_checkpoint_state taken;
static unsigned char *state; /* its bytes */
static size_t size;

/* Writes /checkpoint and gives its bytes. */
static unsigned char *write_state(struct mill_checkpoint_state *from, size_t *count)
{
    mill_checkpoint_write(from, run.file);
    ck_assert_int_eq(mill_h5_count_bytes(run.file, "/checkpoint", count, NULL), MILL_OK);
    unsigned char *bytes = malloc(*count);
    ck_assert_int_eq(mill_h5_read_bytes(run.file, "/checkpoint", 0, *count, bytes, NULL), MILL_OK);
    return bytes;
}

/* A run that stands at 60 ms, and its state */
static void setup(void)
{
    open_run(&run, mills[0]);
    bench_run(&run.bench, 0.06);
    ck_assert_int_eq(mill_checkpoint_take(&run.parts, &cost, &taken, NULL), MILL_OK);
    state = write_state(&taken, &size);
    ck_assert_uint_eq(size, taken.head.size);
}

static void teardown(void)
{
    free(state);
    mill_checkpoint_release(&taken);
    close_run(&run);
}

static void store(const unsigned char *bytes, size_t count)
{
    mill_h5_write(run.file, "/checkpoint", MILL_H5_U8, 1, &count, bytes, "byte", "-");
}

/* What reading says of these bytes, stored as /checkpoint of the run's own file; "" where it takes
 * them. */
static const char *verdict(const unsigned char *bytes, size_t count)
{
    static struct mill_error error;
    struct mill_checkpoint head;
    bool found = false;
    error.text[0] = '\0';
    store(bytes, count);
    if (mill_checkpoint_read(run.file, "mill.h5", &head, &found, &error) == MILL_OK) {
        ck_assert(found);
        ck_assert_mem_eq(&head, bytes, sizeof head);
        return "";
    }
    return error.text;
}

START_TEST(a_state_comes_back_from_the_file_as_it_was)
{
    struct mill_error error = {""};
    struct mill_checkpoint head;
    bool found = false;
    ck_assert_msg(mill_checkpoint_read(run.file, "mill.h5", &head, &found, &error) == MILL_OK, "%s",
                  error.text);
    ck_assert(found);
    ck_assert_mem_eq(&head, &taken.head, sizeof head);
    ck_assert(head.cost.saving == 0.5 && head.cost.checkpoints == 9);
    ck_assert(head.cost.wall == 7.5 && head.cost.cpu == 3.25);
    ck_assert_uint_eq(head.frames.rows, 7); /* one every 10 ms, from 0 on */
    ck_assert_uint_eq(head.series.rows, 61);
    ck_assert_uint_eq(head.log.rows, bench_collisions(&run.bench));
}
END_TEST

START_TEST(a_file_without_a_state_has_none)
{
    struct mill_checkpoint head;
    bool found = true;
    mill_checkpoint_remove(run.file);
    ck_assert(!mill_h5_exists(run.file, "/checkpoint"));
    ck_assert_int_eq(mill_checkpoint_read(run.file, "mill.h5", &head, &found, NULL), MILL_OK);
    ck_assert(!found);
    mill_checkpoint_remove(run.file);
}
END_TEST

START_TEST(a_state_taken_twice_is_the_same_bytes)
{
    struct mill_checkpoint_state again;
    size_t count;
    ck_assert_int_eq(mill_checkpoint_take(&run.parts, &cost, &again, NULL), MILL_OK);
    unsigned char *bytes = write_state(&again, &count);
    ck_assert_uint_eq(count, size);
    ck_assert_mem_eq(bytes, state, size);
    free(bytes);
    mill_checkpoint_release(&again);
}
END_TEST

/* Results are written between the taking and the writing: they audit the mill and close the
 * statistics. */
START_TEST(results_written_meanwhile_change_nothing_in_it)
{
    size_t count;
    run.bench.world->counts.largest_overlap = -1.0; /* so that the audit has something to change */
    mill_checkpoint_release(&taken);
    ck_assert_int_eq(mill_checkpoint_take(&run.parts, &cost, &taken, NULL), MILL_OK);
    free(state);
    state = write_state(&taken, &size);
    mill_sim_audit(run.bench.sim);
    ck_assert(run.bench.world->counts.largest_overlap > -1.0);
    unsigned char *bytes = write_state(&taken, &count);
    ck_assert_uint_eq(count, size);
    ck_assert_mem_eq(bytes, state, size);
    free(bytes);
}
END_TEST

START_TEST(loop_and_statistics_go_on_from_it_to_the_same_bits)
{
    struct run later = {0};
    struct mill_checkpoint_state end;
    struct mill_error error = {""};
    size_t count;
    const size_t head = sizeof end.head;
    bench_open(&later.bench, mills[0], NULL);
    later.parts = run.parts; /* whose rows the head tells */
    later.parts.sim = later.bench.sim;
    ck_assert_int_eq(
        mill_tally_create(later.bench.deck, later.bench.world, &later.parts.tally, NULL), MILL_OK);
    observe(&later, mill_tally_observer(later.parts.tally));
    ck_assert_msg(mill_checkpoint_load(run.file, "mill.h5", &taken.head, later.bench.sim,
                                       later.parts.tally, &error) == MILL_OK,
                  "%s", error.text);
    bench_run(&later.bench, 0.15);
    bench_run(&run.bench, 0.15);
    runs_are_alike(&run.bench, &later.bench);
    unsigned char *bytes[2];
    for (int k = 0; k < 2; k++) {
        ck_assert_int_eq(mill_checkpoint_take(k ? &later.parts : &run.parts, &cost, &end, NULL),
                         MILL_OK);
        bytes[k] = write_state(&end, &count);
        forget_places(k ? &later.bench : &run.bench, bytes[k] + head);
        mill_checkpoint_release(&end);
    }
    ck_assert_mem_eq(bytes[0] + head, bytes[1] + head, count - head);
    free(bytes[0]);
    free(bytes[1]);
    mill_tally_free(later.parts.tally);
    bench_close(&later.bench);
}
END_TEST

/* Between looking into a file and opening it for writing another run may have gone on with it. */
START_TEST(a_state_that_was_replaced_meanwhile_is_refused)
{
    const struct mill_checkpoint seen = taken.head;
    struct mill_checkpoint_state later;
    struct mill_error error = {""};
    size_t count;
    bench_run(&run.bench, 0.08);
    ck_assert_int_eq(mill_checkpoint_take(&run.parts, &cost, &later, NULL), MILL_OK);
    free(write_state(&later, &count));
    mill_checkpoint_release(&later);
    ck_assert_int_eq(
        mill_checkpoint_load(run.file, "mill.h5", &seen, run.bench.sim, run.parts.tally, &error),
        MILL_FAILED);
    ck_assert_str_eq(error.text, "mill.h5: another run has written to it meanwhile; see whether it "
                                 "still needs --resume");
}
END_TEST

START_TEST(bytes_that_change_on_their_way_back_are_noticed)
{
    struct mill_error error = {""};
    const struct mill_checkpoint *head = &taken.head;
    state[sizeof *head + head->sim + head->tally - 1] ^= 1; /* in a map: nothing else would tell */
    store(state, size);
    ck_assert_int_eq(
        mill_checkpoint_load(run.file, "mill.h5", head, run.bench.sim, run.parts.tally, &error),
        MILL_FAILED);
    ck_assert_str_eq(error.text, "mill.h5: its checkpoint is damaged; start again with --force");
}
END_TEST

START_TEST(bytes_of_another_program_are_refused)
{
    state[0] = 'm';
    ck_assert_str_eq(verdict(state, size),
                     "mill.h5: its checkpoint is none of this program; start again with --force");
}
END_TEST

START_TEST(the_state_of_another_version_is_refused_by_its_name)
{
    memcpy(state + offsetof(struct mill_checkpoint, version), "0.0.1", 6);
    const char *said = verdict(state, size);
    ck_assert_msg(
        strstr(said, "mill.h5: its checkpoint was written by millsim 0.0.1, and this is "), "%s",
        said);
}
END_TEST

START_TEST(a_version_without_an_end_is_no_way_out_of_the_state)
{
    memset(state + offsetof(struct mill_checkpoint, version), 'v', 64);
    const char *said = verdict(state, size);
    ck_assert_msg(strstr(said, "was written by millsim vvv"), "%s", said);
    ck_assert_ptr_null(strchr(said, '\n'));
}
END_TEST

static const char damaged[] = "mill.h5: its checkpoint is damaged; start again with --force";

START_TEST(a_single_bit_flipped_behind_the_head_is_noticed)
{
    const size_t head = sizeof(struct mill_checkpoint);
    for (size_t k = 0; k < 200; k++) {
        const size_t at = head + (k * 7919 + k * k * 104729) % (size - head);
        state[at] ^= (unsigned char)(1u << k % 8);
        ck_assert_str_eq(verdict(state, size), damaged);
        state[at] ^= (unsigned char)(1u << k % 8);
    }
    ck_assert_str_eq(verdict(state, size), "");
}
END_TEST

/* Wrong numbers of rows would put the results out of step with the balls. */
START_TEST(a_single_bit_flipped_in_the_head_is_noticed)
{
    const size_t from = offsetof(struct mill_checkpoint, size);
    int missed = 0;
    for (size_t at = from; at < sizeof(struct mill_checkpoint); at++) {
        state[at] ^= 4;
        missed += strcmp(verdict(state, size), damaged) != 0;
        state[at] ^= 4;
    }
    ck_assert_int_eq(missed, 0);
}
END_TEST

START_TEST(words_that_changed_places_are_noticed)
{
    unsigned char *at = state + sizeof(struct mill_checkpoint), word[8];
    for (int k = 0; k < 1000; k++, at += 8) {
        if (memcmp(at, at + 8, 8) == 0)
            continue;
        memcpy(word, at, 8);
        memmove(at, at + 8, 8);
        memcpy(at + 8, word, 8);
        ck_assert_str_eq(verdict(state, size), damaged);
        return;
    }
    ck_abort_msg("all words are alike");
}
END_TEST

START_TEST(a_state_cut_short_or_with_more_behind_it_is_refused)
{
    const size_t head = sizeof(struct mill_checkpoint);
    const size_t counts[] = {0, 1, 8, head - 1, head, head + 1, size / 2, size - 1, size + 1};
    unsigned char *longer = calloc(1, size + 1);
    memcpy(longer, state, size);
    for (size_t k = 0; k < sizeof counts / sizeof *counts; k++) {
        const char *said = verdict(longer, counts[k]);
        ck_assert_msg(strstr(said, "mill.h5: its checkpoint is "), "%zu: %s", counts[k], said);
    }
    free(longer);
}
END_TEST

/* Sizes that are wrong but fit together, or overflow */
START_TEST(wrong_sizes_of_the_parts_are_refused)
{
    const struct mill_checkpoint good = taken.head;
    const uint64_t sims[] = {0, good.sim + 8, good.sim - 8, UINT64_MAX, good.sim + good.tally + 8};
    for (size_t k = 0; k < sizeof sims / sizeof *sims; k++) {
        struct mill_checkpoint head = good;
        head.sim = sims[k];
        head.tally = good.tally + good.sim - sims[k];
        memcpy(state, &head, sizeof head);
        ck_assert_str_eq(verdict(state, size), damaged);
    }
}
END_TEST

START_TEST(parts_are_packed_one_after_another_and_come_back)
{
    int32_t a = 7;
    double b[3] = {1, 2, 3};
    char c[5] = "abcd";
    const struct mill_part part[] = {{&a, sizeof a}, {NULL, 0}, {b, sizeof b}, {c, 0}, {c, 5}};
    unsigned char bytes[64];
    ck_assert_uint_eq(mill_parts_size(part, 5), 4 + 24 + 5);
    ck_assert_ptr_eq(mill_parts_pack(part, 5, bytes), bytes + 33);
    a = 0;
    memset(b, 0, sizeof b);
    memset(c, 0, sizeof c);
    ck_assert_ptr_eq(mill_parts_unpack(part, 5, bytes), bytes + 33);
    ck_assert_int_eq(a, 7);
    ck_assert(b[0] == 1 && b[1] == 2 && b[2] == 3);
    ck_assert_str_eq(c, "abcd");
    ck_assert_uint_eq(mill_parts_size(part, 0), 0);
    memset(b, 0, sizeof b);
    struct mill_source_memory memory = mill_parts_from(bytes, 33);
    ck_assert_int_eq(mill_parts_read_all(&memory.source, part, 5, NULL), MILL_OK);
    ck_assert(a == 7 && b[0] == 1 && b[1] == 2 && b[2] == 3);
    ck_assert_uint_eq(memory.source.left, 0);
    ck_assert_int_eq(mill_parts_read(&memory.source, &a, 1, NULL), MILL_FAILED);
}
END_TEST

START_TEST(parts_of_which_there_are_too_few_bytes_stay_as_they_are)
{
    double a = 1, b = 2;
    const struct mill_part part[] = {{&a, sizeof a}, {&b, sizeof b}};
    const unsigned char bytes[15] = {0};
    struct mill_source_memory memory = mill_parts_from(bytes, sizeof bytes);
    struct mill_error error = {""};
    ck_assert_int_eq(mill_parts_read_all(&memory.source, part, 2, &error), MILL_FAILED);
    ck_assert_str_eq(error.text, "the saved state is cut short");
    ck_assert(a == 1 && b == 2);
}
END_TEST

int main(void)
{
    const TTest *const tests[] = {
        a_state_comes_back_from_the_file_as_it_was,
        a_file_without_a_state_has_none,
        a_state_taken_twice_is_the_same_bytes,
        results_written_meanwhile_change_nothing_in_it,
        loop_and_statistics_go_on_from_it_to_the_same_bits,
        a_state_that_was_replaced_meanwhile_is_refused,
        bytes_that_change_on_their_way_back_are_noticed,
        bytes_of_another_program_are_refused,
        the_state_of_another_version_is_refused_by_its_name,
        a_version_without_an_end_is_no_way_out_of_the_state,
        a_single_bit_flipped_behind_the_head_is_noticed,
        a_single_bit_flipped_in_the_head_is_noticed,
        words_that_changed_places_are_noticed,
        a_state_cut_short_or_with_more_behind_it_is_refused,
        wrong_sizes_of_the_parts_are_refused,
        parts_are_packed_one_after_another_and_come_back,
        parts_of_which_there_are_too_few_bytes_stay_as_they_are,
    };
    Suite *suite = suite_create("checkpoint");
    TCase *test = tcase_create("checkpoint");
    tcase_set_timeout(test, 60.0);
    tcase_add_checked_fixture(test, setup, teardown);
    for (size_t i = 0; i < sizeof tests / sizeof *tests; i++)
        tcase_add_test(test, tests[i]);
    suite_add_tcase(suite, test);
    SRunner *runner = srunner_create(suite);
    srunner_run_all(runner, CK_NORMAL);
    const int failed = srunner_ntests_failed(runner);
    srunner_free(runner);
    return failed != 0;
}
