/* Time series: the world's books at every interval. */
#include "output_fixture.h"

#define AT "/observables/"

/* One step of the loop's stand-in: the books move on by k between two samples. */
static void book(struct mill_world *world, int k)
{
    world->account.motion[0].work += 0.5 * k;
    world->account.motion[0].impulse += 1e-4 * k;
    world->account.dissipation[MILL_BALL_DRUM] += 0.25 * k;
    world->account.dissipation_normal[MILL_BALL_DRUM] += 0.125 * k;
    world->account.collisions[MILL_BALL_BLADE] += (uint64_t)k;
    world->account.fast[MILL_BALL_BLADE][1] += (uint64_t)k;
}

static void run_on(struct fixture *f, struct mill_observer *series, double until)
{
    while (series->next <= until) {
        ck_assert_int_eq(series->type->sample(series, &f->world, series->next, NULL), MILL_OK);
        book(&f->world, 1);
    }
}

static void close_all(struct mill_h5 *file, struct mill_observer *series)
{
    mill_observers_free_one(series);
    ck_assert_int_eq(mill_h5_close(file, NULL), MILL_OK);
}

static void run(struct fixture *f)
{
    struct mill_h5 *file;
    struct mill_observer *series;
    ck_assert_int_eq(mill_h5_create(f->path, MILL_H5_NEW, &file, NULL), MILL_OK);
    series = make_writer(&mill_series_type, f, file, NULL);
    run_on(f, series, f->asked.end);
    close_all(file, series);
}

TEST(rows_lie_at_multiples_of_the_interval_up_to_the_end)
{
    struct fixture f;
    fixture_init(&f);
    run(&f);
    ck_assert_uint_eq(look_rows(f.path, AT "rotor_work/value", 1), 31);
    ck_assert(look_at(f.path, AT "rotor_work/time", 1, 7) == 7 * 0.01);
    ck_assert(look_at(f.path, AT "rotor_work/step", 1, 30) == 30);
    unlink(f.path);
}

TEST(energies_are_those_of_the_world_at_the_time)
{
    struct fixture f;
    struct mill_energy energy;
    fixture_init(&f);
    run(&f);
    energy = mill_world_energy(&f.world, 5 * 0.01);
    ck_assert(look_at(f.path, AT "kinetic_energy/value", 1, 5) == energy.kinetic);
    ck_assert(look_at(f.path, AT "rotational_energy/value", 1, 5) == energy.rotational);
    ck_assert(look_at(f.path, AT "potential_energy/value", 1, 5) == energy.potential);
    unlink(f.path);
}

TEST(works_losses_and_counts_are_cumulative)
{
    struct fixture f;
    fixture_init(&f);
    run(&f);
    ck_assert(look_at(f.path, AT "rotor_work/value", 1, 6) == 3);
    ck_assert(look_at(f.path, AT "dissipation/ball_drum/value", 1, 6) == 1.5);
    ck_assert(look_at(f.path, AT "dissipation_normal/ball_drum/value", 1, 6) == 0.75);
    ck_assert(look_at(f.path, AT "collisions/ball_blade/value", 1, 6) == 6);
    ck_assert(look_at(f.path, AT "collisions/ball_ball/value", 1, 6) == 0);
    assert_text(f.path, AT "collisions/ball_ball/value", "unit", "1");
    /* three to a row: column 1 of row 6, and the ones beside it */
    ck_assert(look_at(f.path, AT "fast_collisions/ball_blade/value", 2, 19) == 6);
    ck_assert(look_at(f.path, AT "fast_collisions/ball_blade/value", 2, 18) == 0);
    ck_assert(look_at(f.path, AT "fast_collisions/ball_blade/value", 2, 20) == 0);
    unlink(f.path);
}

TEST(torque_is_the_impulse_over_the_interval_before)
{
    struct fixture f;
    fixture_init(&f);
    run(&f);
    ck_assert(look_at(f.path, AT "rotor_torque/value", 1, 0) == 0);
    ck_assert_double_eq_tol(look_at(f.path, AT "rotor_torque/value", 1, 1), 0.01, 1e-15);
    ck_assert_double_eq_tol(look_at(f.path, AT "rotor_torque/value", 1, 30), 0.01, 1e-15);
    assert_text(f.path, AT "rotor_torque/value", "unit", "N m");
    unlink(f.path);
}

TEST(step_and_time_are_stored_once)
{
    struct fixture f;
    fixture_init(&f);
    run(&f);
    ck_assert(look_same(f.path, AT "kinetic_energy/time", AT "rotor_torque/time"));
    ck_assert(look_same(f.path, AT "kinetic_energy/step", AT "collisions/ball_blade/step"));
    unlink(f.path);
}

TEST(a_run_taken_up_again_leaves_the_same_rows)
{
    struct fixture f;
    struct mill_h5 *file;
    struct mill_observer *series;
    struct kept state;
    struct mill_account books;
    hsize_t dims[1];
    double *straight, *resumed;
    fixture_init(&f);
    run(&f);
    straight = look(f.path, AT "rotor_torque/value", 1, dims);
    memset(&f.world.account, 0, sizeof f.world.account);
    ck_assert_int_eq(mill_h5_create(f.path, MILL_H5_OVERWRITE, &file, NULL), MILL_OK);
    series = make_writer(&mill_series_type, &f, file, NULL);
    run_on(&f, series, 0.123);
    save_writer(series, &state);
    books = f.world.account;
    run_on(&f, series, 0.2); /* lost: after the checkpoint */
    close_all(file, series);
    f.world.account = books;
    ck_assert_int_eq(mill_h5_create(f.path, MILL_H5_UPDATE, &file, NULL), MILL_OK);
    series = make_writer(&mill_series_type, &f, file, &state);
    run_on(&f, series, f.asked.end);
    close_all(file, series);
    resumed = look(f.path, AT "rotor_torque/value", 1, dims);
    ck_assert_uint_eq(dims[0], 31);
    ck_assert_mem_eq(straight, resumed, 31 * sizeof *straight);
    free(straight);
    free(resumed);
    kept_free(&state);
    unlink(f.path);
}

int main(void)
{
    return unit_run("series");
}
