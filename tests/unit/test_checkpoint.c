/* Claims about /checkpoint: the state of a run comes back from the file as it was put there, and
 * whatever is not the whole state of this build is refused with a line that says what it is. */
#define H5Dread_chunk_vers 1 /* HDF5 2 has a second version with one argument more */
#include "app/starts.h"
#include "observe/tally.h"
#include "sim_fixture.h"

#include <hdf5.h>
#include <unistd.h>

/* A mill with all its observers, writing into a file */
struct run {
    struct bench bench;
    struct mill_h5 *file;
    struct mill_observers observers;
    struct mill_record_cost cost;
    struct mill_starts starts;
};

static void set_name(struct mill_state *state, const char *name)
{
    (void)state;
    (void)name;
}

/* What all that has a state would save now */
struct all {
    struct kept loop, observer[MILL_OBSERVERS];
    int observers;
};

static void keep_all(struct run *r, struct all *all)
{
    kept_init(&all->loop);
    mill_sim_state(r->bench.sim, &all->loop.state);
    forget_places(&all->loop, "plan");
    all->observers = r->observers.count;
    for (int k = 0; k < all->observers; k++) {
        const struct mill_observers one = {1, {r->observers.each[k]}};
        kept_init(&all->observer[k]);
        mill_observers_state(&one, &all->observer[k].state, set_name);
    }
}

static void free_all(struct all *all)
{
    kept_free(&all->loop);
    for (int k = 0; k < all->observers; k++)
        kept_free(&all->observer[k]);
}

static void assert_alike(const struct all *a, struct run *r)
{
    static struct all b;
    keep_all(r, &b);
    ck_assert(kept_alike(&a->loop, &b.loop));
    ck_assert(a->observers == 5 && b.observers == 5);
    for (int k = 0; k < a->observers; k++)
        ck_assert_msg(kept_alike(&a->observer[k], &b.observer[k]), "%s",
                      r->observers.each[k]->type->name);
    free_all(&b);
}

static char path[64];
static struct run run;
static struct all saved;

/* update: goes on in a file that is there, and takes up its state; the message where it cannot */
static const char *open_run(struct run *r, bool update)
{
    static struct mill_error error;
    const struct mill_observe asked = {.end = 1,
                                       .sample_from = 0.02,
                                       .strike_window = 1e-5,
                                       .frames = 0.01,
                                       .series = 1e-3,
                                       .precision = 1e-3,
                                       .sample_found = false,
                                       .log_impacts = true};
    memset(r, 0, sizeof *r);
    bench_open(&r->bench, &mills[0]);
    r->starts.count = 1;
    r->starts.plan.count = 1;
    r->starts.one[0].sim = r->bench.sim;
    enum mill_status status =
        mill_h5_create(path, update ? MILL_H5_UPDATE : MILL_H5_NEW, &r->file, &error);
    if (status == MILL_OK)
        status = mill_observers_create(&asked, r->bench.world, &r->observers, &error);
    r->starts.one[0].observers = r->observers;
    if (status == MILL_OK && update)
        status = mill_checkpoint_load(&r->starts, &r->cost, r->file, "mill.h5", &error);
    if (status == MILL_OK)
        status = mill_observers_open(&r->observers, &asked, r->file, mill_sim_world(r->bench.sim),
                                     r->bench.sim, &error);
    return status == MILL_OK ? "" : error.text;
}

static void close_run(struct run *r)
{
    mill_h5_abandon(r->file);
    mill_observers_free(&r->observers);
    bench_close(&r->bench);
}

/* A run that stands at 60 ms, its state published */
static void setup(void)
{
    snprintf(path, sizeof path, "/tmp/millsim_checkpoint_%ld.h5", (long)getpid());
    unlink(path);
    ck_assert_str_eq(open_run(&run, false), "");
    bench_run(&run.bench, 0.06);
    keep_all(&run, &saved);
    run.cost = (struct mill_record_cost){7.5, 3.25, 0.5, 9};
    mill_checkpoint_write(&run.starts, &run.cost, run.file);
    ck_assert_int_eq(mill_h5_close(run.file, NULL), MILL_OK);
    run.file = NULL;
}

static void teardown(void)
{
    free_all(&saved);
    close_run(&run);
    unlink(path);
}

TEST(loop_and_observers_go_on_from_it_to_the_same_bits)
{
    struct run later, straight;
    ck_assert_str_eq(open_run(&later, true), "");
    ck_assert(later.cost.wall == 7.5 && later.cost.cpu == 3.25);
    ck_assert(later.cost.saving == 0.5 && later.cost.checkpoints == 9);
    assert_alike(&saved, &later);
    bench_run(&later.bench, 0.15);
    free_all(&saved);
    keep_all(&later, &saved);
    close_run(&later);
    unlink(path);
    ck_assert_str_eq(open_run(&straight, false), "");
    bench_run(&straight.bench, 0.15);
    assert_alike(&saved, &straight);
    close_run(&straight);
}

/* Results are written beside it: they audit the mill and are taken from the statistics. */
TEST(results_written_meanwhile_change_nothing_in_it)
{
    struct run later;
    struct mill_tally_results *results = NULL;
    struct mill_sink_file to;
    ck_assert_str_eq(open_run(&later, true), "");
    mill_sink_file(&to, later.file, "");
    ck_assert_int_eq(mill_observers_results(&later.observers, later.bench.world,
                                            mill_sim_local_time(later.bench.sim), &to.sink,
                                            &results, NULL),
                     MILL_OK);
    mill_tally_results_free(results);
    assert_alike(&saved, &later);
    close_run(&later);
}

/* Looks into the file as --resume does; the message, "" where it is taken, "-" where there is none
 */
static const char *look(void)
{
    static struct mill_error error;
    struct mill_h5 *file;
    bool found;
    ck_assert_int_eq(mill_h5_create(path, MILL_H5_READ, &file, NULL), MILL_OK);
    const enum mill_status status = mill_checkpoint_find(file, "mill.h5", &found, &error);
    mill_h5_close(file, NULL);
    return status != MILL_OK ? error.text : found ? "" : "-";
}

TEST(a_file_without_a_state_has_none)
{
    struct mill_h5 *file;
    ck_assert_str_eq(look(), "");
    ck_assert_int_eq(mill_h5_create(path, MILL_H5_UPDATE, &file, NULL), MILL_OK);
    mill_checkpoint_remove(file);
    mill_checkpoint_remove(file);
    ck_assert_int_eq(mill_h5_close(file, NULL), MILL_OK);
    ck_assert_str_eq(look(), "-");
}

TEST(the_state_of_another_build_is_refused)
{
    struct mill_h5 *file;
    ck_assert_int_eq(mill_h5_create(path, MILL_H5_UPDATE, &file, NULL), MILL_OK);
    mill_h5_write_text(file, "/checkpoint/build", "0123456789abcdef", "-");
    ck_assert_int_eq(mill_h5_close(file, NULL), MILL_OK);
    ck_assert_ptr_nonnull(strstr(look(), "mill.h5: its checkpoint was written by another build of "
                                         "millsim (0123456789abcdef, and this is "));
}

TEST(what_is_no_state_is_refused)
{
    struct mill_h5 *file;
    ck_assert_int_eq(mill_h5_create(path, MILL_H5_UPDATE, &file, NULL), MILL_OK);
    mill_h5_remove(file, "/checkpoint");
    const double number = 1.5;
    mill_h5_write(file, "/checkpoint", MILL_H5_F64, 0, NULL, &number, "s", "-");
    ck_assert_int_eq(mill_h5_close(file, NULL), MILL_OK);
    ck_assert_str_eq(
        look(),
        "mill.h5: its checkpoint was not written by this program; start again with --force");
}

/* ---- damages ---- */

/* Flips a bit of what stands on the disk: of the first or last chunk of a dataset */
static void flip_bit(hid_t set, bool last, size_t k)
{
    hsize_t chunks, offset[1], bytes;
    unsigned filters;
    haddr_t place;
    const hid_t space = H5Dget_space(set);
    ck_assert(H5Dget_num_chunks(set, space, &chunks) >= 0 && chunks > 0);
    ck_assert(H5Dget_chunk_info(set, space, last ? chunks - 1 : 0, offset, &filters, &place,
                                &bytes) >= 0);
    unsigned char *chunk = malloc(bytes);
    ck_assert(H5Dread_chunk(set, H5P_DEFAULT, offset, &filters, chunk) >= 0);
    chunk[k * 7919 % bytes] ^= (unsigned char)(1u << k % 8);
    ck_assert(H5Dwrite_chunk(set, H5P_DEFAULT, filters, offset, bytes, chunk) >= 0);
    free(chunk);
    H5Sclose(space);
}

static void damage_dataset(const char *name, bool last, size_t k)
{
    const hid_t file = H5Fopen(path, H5F_ACC_RDWR, H5P_DEFAULT);
    const hid_t set = H5Dopen2(file, name, H5P_DEFAULT);
    ck_assert_msg(set >= 0, "no %s", name);
    flip_bit(set, last, k);
    H5Dclose(set);
    H5Fclose(file);
}

TEST(a_single_bit_flipped_is_noticed)
{
    static const char *const names[] = {"run/cost",
                                        "loop/base",
                                        "loop/account",
                                        "loop/ball",
                                        "loop/plan",
                                        "loop/cell",
                                        "statistics/progress",
                                        "statistics/now_spectra",
                                        "statistics/now_flow",
                                        "statistics/batch_counts",
                                        "statistics/pairs",
                                        "frames/rows",
                                        "series/rotor_impulse",
                                        "impacts/rows"};
    for (size_t k = 0; k < 2 * sizeof names / sizeof *names; k++) {
        struct run later;
        char name[64];
        snprintf(name, sizeof name, "/checkpoint/%s", names[k / 2]);
        damage_dataset(name, k % 2, k);
        const char *said = open_run(&later, true);
        ck_assert_msg(strstr(said, "damaged: /checkpoint/"), "%s: %s", name, said);
        ck_assert_ptr_nonnull(strstr(said, names[k / 2]));
        ck_assert_ptr_nonnull(strstr(said, "; start again with --force"));
        close_run(&later);
        damage_dataset(name, k % 2, k); /* back */
    }
    struct run whole;
    ck_assert_str_eq(open_run(&whole, true), "");
    close_run(&whole);
}

TEST(a_field_that_is_missing_or_of_another_length_or_type_is_refused)
{
    static const char *const names[] = {"/checkpoint/loop/spin", "/checkpoint/statistics/accounts",
                                        "/checkpoint/frames/rows"};
    const uint64_t few[3] = {1, 2, 3};
    const size_t count = 3, one = 1;
    for (int k = 0; k < 9; k++) {
        struct run later;
        struct mill_h5 *file;
        const char *name = names[k / 3];
        ck_assert_int_eq(mill_h5_create(path, MILL_H5_UPDATE, &file, NULL), MILL_OK);
        mill_h5_remove(file, name);
        if (k % 3 == 1)
            mill_h5_write_checked(file, name, MILL_H5_U64, count, few, "-");
        if (k % 3 == 2)
            mill_h5_write_checked(file, name, MILL_H5_U8, one, few, "-");
        ck_assert_int_eq(mill_h5_close(file, NULL), MILL_OK);
        ck_assert_ptr_nonnull(strstr(open_run(&later, true), "damaged: /checkpoint/"));
        close_run(&later);
        teardown();
        setup();
    }
}

/* Its checksum is right, what it says is not. */
TEST(an_index_out_of_range_is_refused)
{
    struct run later;
    struct mill_h5 *file;
    const size_t count = (size_t)run.bench.world->balls;
    int32_t *cell = calloc(count, sizeof *cell);
    ck_assert_int_eq(mill_h5_create(path, MILL_H5_UPDATE, &file, NULL), MILL_OK);
    mill_h5_write_checked(file, "/checkpoint/loop/cell", MILL_H5_I32, count, cell, "-");
    ck_assert_int_eq(mill_h5_close(file, NULL), MILL_OK);
    ck_assert_str_eq(
        open_run(&later, true),
        "mill.h5: its checkpoint: the saved balls are damaged; start again with --force");
    close_run(&later);
    free(cell);
}

int main(void)
{
    return unit_run_in("checkpoint", setup, teardown);
}
