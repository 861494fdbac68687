/* Frames: at the right times, in the right order, as H5MD lays them out. */
#include "output_fixture.h"

#define AT "/particles/trajectory/"

/* A run of the fixture's world; leaves the finished file. */
static void run(struct fixture *f)
{
    struct mill_h5 *file;
    struct mill_observer *frames;
    ck_assert_int_eq(mill_h5_create(f->path, MILL_H5_NEW, &file, NULL), MILL_OK);
    frames = make_writer(&mill_frames_type, f, file, NULL);
    run_samples(frames, &f->world, f->asked.end);
    mill_observers_free_one(frames);
    ck_assert_int_eq(mill_h5_close(file, NULL), MILL_OK);
}

TEST(frames_lie_at_multiples_of_the_interval_from_zero_to_the_end)
{
    struct fixture f;
    int k;
    fixture_init(&f); /* 3 * 0.1 is above 0.3 by a rounding error */
    run(&f);
    ck_assert_uint_eq(look_rows(f.path, AT "position/time", 1), 4);
    for (k = 0; k < 3; k++) {
        ck_assert(look_at(f.path, AT "position/time", 1, (size_t)k) == k * 0.1);
        ck_assert(look_at(f.path, AT "position/step", 1, (size_t)k) == k);
    }
    ck_assert(look_at(f.path, AT "position/time", 1, 3) == 0.3);
    unlink(f.path);
}

TEST(times_do_not_drift_over_many_frames)
{
    struct fixture f;
    fixture_init(&f);
    f.asked.end = 1000;
    run(&f);
    ck_assert_uint_eq(look_rows(f.path, AT "position/time", 1), 10001);
    ck_assert(look_at(f.path, AT "position/time", 1, 9999) == 9999 * 0.1);
    unlink(f.path);
}

TEST(an_end_between_two_frames_adds_none)
{
    struct fixture f;
    fixture_init(&f);
    f.asked.end = 0.29;
    run(&f);
    ck_assert_uint_eq(look_rows(f.path, AT "position/time", 1), 3);
    unlink(f.path);
}

TEST(each_state_of_each_ball_is_stored)
{
    struct fixture f;
    hsize_t dims[3];
    double *r, *v, *w;
    const size_t at = (2 * 3 + 1) * 3; /* frame 2, ball 1 */
    const double t = 0.2;
    fixture_init(&f);
    run(&f);
    r = look(f.path, AT "position/value", 3, dims);
    ck_assert(dims[0] == 4 && dims[1] == 3 && dims[2] == 3);
    v = look(f.path, AT "velocity/value", 3, dims);
    w = look(f.path, AT "angular_velocity/value", 3, dims);
    ck_assert_double_eq_tol(r[at], 0.01, 1e-9);
    ck_assert_double_eq_tol(r[at + 1], 0.5 * t, 1e-8);
    ck_assert_double_eq_tol(r[at + 2], 0.02 + t - 4 * t * t, 1e-8);
    ck_assert_double_eq_tol(v[at + 2], 1 - 8 * t, 1e-7);
    ck_assert(w[at] == 1 && w[at + 1] == 10 && w[at + 2] == -1);
    free(r);
    free(v);
    free(w);
    unlink(f.path);
}

TEST(balls_carry_number_kind_mass_and_diameter)
{
    struct fixture f;
    fixture_init(&f);
    run(&f);
    ck_assert(look_at(f.path, AT "id", 1, 2) == 2);
    ck_assert(look_at(f.path, AT "species", 1, 1) == 0);
    ck_assert(look_at(f.path, AT "species", 1, 2) == 1);
    ck_assert(look_at(f.path, AT "mass", 1, 2) == 0.0002);
    ck_assert(look_at(f.path, AT "diameter", 1, 0) == 0.005);
    assert_text(f.path, AT "mass", "unit", "kg");
    unlink(f.path);
}

TEST(step_and_time_are_stored_once)
{
    struct fixture f;
    fixture_init(&f);
    run(&f);
    ck_assert(look_same(f.path, AT "position/time", AT "velocity/time"));
    ck_assert(look_same(f.path, AT "position/step", AT "angular_velocity/step"));
    ck_assert(!look_same(f.path, AT "position/step", AT "position/time"));
    unlink(f.path);
}

TEST(units_are_texts_that_h5md_readers_know)
{
    struct fixture f;
    fixture_init(&f);
    run(&f);
    assert_text(f.path, AT "position/value", "unit", "m");
    assert_text(f.path, AT "velocity/value", "unit", "m s-1");
    assert_text(f.path, AT "angular_velocity/value", "unit", "rad s-1");
    assert_text(f.path, AT "position/time", "unit", "s");
    assert_text(f.path, "/h5md/modules/units", "system", "SI");
    unlink(f.path);
}

TEST(without_frames_the_balls_are_still_described)
{
    struct fixture f;
    struct mill_h5 *file;
    fixture_init(&f);
    f.asked.frames = 0;
    run(&f);
    ck_assert_uint_eq(look_rows(f.path, AT "mass", 1), 3);
    ck_assert_int_eq(mill_h5_create(f.path, MILL_H5_UPDATE, &file, NULL), MILL_OK);
    ck_assert(!mill_h5_exists(file, AT "position"));
    mill_h5_close(file, NULL);
    unlink(f.path);
}

TEST(a_run_taken_up_again_leaves_the_same_frames)
{
    struct fixture f;
    struct mill_h5 *file;
    struct mill_observer *frames;
    struct kept state;
    hsize_t dims[3];
    double *straight, *resumed;
    fixture_init(&f);
    run(&f);
    straight = look(f.path, AT "position/value", 3, dims);
    ck_assert_int_eq(mill_h5_create(f.path, MILL_H5_OVERWRITE, &file, NULL), MILL_OK);
    frames = make_writer(&mill_frames_type, &f, file, NULL);
    run_samples(frames, &f.world, 0.15);
    save_writer(frames, &state);
    run_samples(frames, &f.world, 0.25); /* lost: after the checkpoint */
    mill_observers_free_one(frames);
    mill_h5_close(file, NULL);
    ck_assert_int_eq(mill_h5_create(f.path, MILL_H5_UPDATE, &file, NULL), MILL_OK);
    frames = make_writer(&mill_frames_type, &f, file, &state);
    ck_assert(frames->next == 0.2);
    run_samples(frames, &f.world, f.asked.end);
    mill_observers_free_one(frames);
    mill_h5_close(file, NULL);
    resumed = look(f.path, AT "position/value", 3, dims);
    ck_assert_uint_eq(dims[0], 4);
    ck_assert_mem_eq(straight, resumed, 4 * 9 * sizeof *straight);
    free(straight);
    free(resumed);
    kept_free(&state);
    unlink(f.path);
}

int main(void)
{
    return unit_run("frames");
}
