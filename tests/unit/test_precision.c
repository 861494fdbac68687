/* Claims about what is known of a run, and about the window that is found for it. */
#include "mill_fixture.h"
#include "observe/precision.h"
#include "unit.h"

enum { MOST = MILL_PRECISION_BATCHES };

static double x[MOST];
static uint64_t chance;

/* Normal deviates, by the sum of twelve */
static double normal(void)
{
    double sum = -6;
    for (int i = 0; i < 12; i++)
        sum += random_share(&chance);
    return sum;
}

/* x[n]: an autoregressive process of first order with variance 1, and a swing of the period */
static void fill(size_t n, double memory, size_t period, double swing)
{
    double last = normal();
    for (size_t i = 0; i < n; i++) {
        last = memory * last + sqrt(1 - memory * memory) * normal();
        x[i] =
            10 + last + (period ? swing * sin(2 * PI * (double)(i % period) / (double)period) : 0);
    }
}

/* Share of 2000 series whose true mean lies within the 95 % interval told; *reach: half its width
 * over that of the true one, rms */
static double held(size_t n, double memory, size_t period, double swing, double *reach)
{
    double told = 0, scatter = 0;
    int within = 0, known = 0;
    enum { SERIES = 2000 };
    chance = 7;
    for (int k = 0; k < SERIES; k++) {
        fill(n, memory, period, swing);
        const struct mill_precision_mean mean = mill_precision_mean(x, n, period);
        if (isnan(mean.error))
            continue;
        known++;
        within += fabs(mean.value - 10) <= 1.96 * mean.error;
        told += mean.error * mean.error;
        scatter += (mean.value - 10) * (mean.value - 10);
    }
    ck_assert_int_gt(known, SERIES / 2);
    *reach = sqrt(told / scatter);
    return (double)within / known;
}

/* ---- series ---- */

TEST(mser_cuts_a_start_up_that_stands_out)
{
    chance = 1;
    fill(200, 0, 0, 0);
    for (size_t i = 0; i < 40; i++)
        x[i] += 20 * exp(-(double)i / 8);
    const size_t cut = mill_precision_mser(x, 200);
    ck_assert_uint_ge(cut, 16); /* 20 exp(-2) = 2.7 standard deviations */
    ck_assert_uint_le(cut, 40);
}

TEST(mser_is_the_minimum_of_its_formula)
{
    chance = 2;
    fill(60, 0.5, 0, 0);
    for (size_t i = 0; i < 12; i++)
        x[i] -= (double)(12 - i) / 2;
    size_t best = 0;
    double least = INFINITY;
    for (size_t d = 0; d + 5 < 60; d++) {
        double mean = 0, squares = 0;
        for (size_t i = d; i < 60; i++)
            mean += x[i] / (double)(60 - d);
        for (size_t i = d; i < 60; i++)
            squares += (x[i] - mean) * (x[i] - mean);
        if (squares / pow((double)(60 - d), 2) < least) {
            least = squares / pow((double)(60 - d), 2);
            best = d;
        }
    }
    ck_assert_uint_eq(mill_precision_mser(x, 60), best);
    ck_assert_uint_gt(best, 0);
}

TEST(mser_keeps_all_of_a_series_too_short_to_judge)
{
    for (size_t n = 0; n <= 5; n++)
        ck_assert_uint_eq(mill_precision_mser(x, n), 0);
}

TEST(the_error_told_is_the_scatter_of_the_means)
{
    const double memory[] = {-0.2, 0, 0.5, 0.8};
    for (int i = 0; i < 4; i++) {
        double reach;
        const double share = held(480, memory[i], 0, 0, &reach);
        ck_assert_msg(share > 0.93 && share < 0.97, "memory %g: %g", memory[i], share);
        ck_assert_msg(reach > 0.95 && reach < 1.3, "memory %g: %g", memory[i], reach);
    }
}

TEST(in_short_series_the_interval_is_widened_so_that_it_still_holds)
{
    const double memory[] = {0, 0.3, 0.5, 0.8};
    for (int n = 48; n <= 192; n *= 2)
        for (int i = 0; i < 4; i++) {
            double reach;
            const double share = held((size_t)n, memory[i], 0, 0, &reach);
            ck_assert_msg(share > 0.92 && share < 0.97, "%d, %g: %g", n, memory[i], share);
            ck_assert_msg(reach > 1.05 && reach < 2, "%d, %g: %g", n, memory[i], reach);
        }
}

TEST(what_repeats_every_revolution_has_no_part_in_the_error)
{
    for (size_t turns = 3; turns <= 24; turns *= 2) {
        double reach;
        const double share = held(12 * turns, 0, 12, 30, &reach);
        ck_assert_msg(share > 0.93 && share < 0.98, "%zu revolutions: %g", turns, share);
        ck_assert_msg(reach > 1 && reach < 2, "%zu revolutions: %g", turns, reach);
    }
}

/* 5.5 revolutions of a swing of 30 shift the mean by 30 * 2/pi * 0.5/5.5 or so. */
TEST(a_revolution_that_is_not_whole_has_its_part_in_the_error)
{
    double reach;
    ck_assert_double_gt(held(66, 0, 12, 30, &reach), 0.98);
    ck_assert_msg(reach > 0.95 && reach < 1.8, "%g", reach);
}

TEST(the_interval_is_wider_the_fewer_batches_there_are_to_tell_it)
{
    double few, many;
    held(48, 0, 0, 0, &few);
    held(MOST, 0, 0, 0, &many);
    ck_assert_double_gt(few, 1.08 * many);
    ck_assert_double_eq_tol(many, 1, 0.2);
}

TEST(too_few_batches_have_no_error)
{
    fill(MILL_PRECISION_FEWEST, 0, 0, 0);
    const struct mill_precision_mean few = mill_precision_mean(x, MILL_PRECISION_FEWEST - 1, 0);
    ck_assert_double_eq_tol(few.value, 10, 1);
    ck_assert_double_nan(few.error);
    ck_assert(few.freedom == 0);
    ck_assert(mill_precision_mean(x, MILL_PRECISION_FEWEST, 0).error > 0);
}

/* ---- batches ---- */

static struct mill_precision_progress planned(double rotor_speed)
{
    struct mill_precision planned;
    struct fixture turning;
    fixture_init(&turning);
    fixture_speed(&turning, rotor_speed);
    ck_assert(mill_precision_init(&planned, 0, &turning.world, NULL));
    const struct mill_precision_progress progress = planned.at;
    mill_precision_free(&planned);
    return progress;
}

TEST(batches_are_parts_of_a_revolution_or_whole_ones)
{
    const double rpm[] = {0.2, 1, 10, 60, 300, 1000, 5000, 9000, 20000, 60000, 1e6};
    for (size_t i = 0; i < sizeof rpm / sizeof *rpm; i++) {
        const double turn = 60 / rpm[i];
        const struct mill_precision_progress p = planned(-2 * PI / turn);
        const double turns = (double)p.period * p.batch / turn;
        ck_assert_uint_ge(p.period, 1);
        ck_assert_double_eq_tol(turns, round(turns), 1e-9);
        ck_assert(p.period == 1 ? turns >= 1 : fabs(turns - 1) < 1e-9);
        ck_assert(p.batch > 0.999e-3 && p.batch < 25.001e-3);
    }
}

TEST(without_a_rotor_there_are_no_revolutions)
{
    const struct mill_precision_progress p = planned(0);
    ck_assert_uint_eq(p.period, 0);
    ck_assert(p.batch == 5e-3);
    ck_assert_uint_eq(planned(1e-300).period, 0);
}

static struct mill_spectrum_grid grid;
static struct mill_precision batches;

/* One more batch of `impacts`, at about `speed` (scattered by a fifth), and `work` [J] */
static void add_batch(struct mill_account *account, double work, double speed, int impacts)
{
    uint64_t count[MILL_SPECTRUM_SLOTS] = {0};
    for (int i = 0; i < impacts; i++) {
        const double v = speed * exp(0.2 * normal());
        count[mill_spectrum_find(&grid, v)]++;
        account->collisions[MILL_BALL_BALL]++;
        account->fast[MILL_BALL_BALL][1] += v >= 1;
    }
    account->work += work;
    account->motion[0].work += work;
    account->work_gross += fabs(work);
    account->incident += 1;
    mill_precision_close(&batches, count, account);
}

static void open_batches(double rotor_speed, struct mill_account *account)
{
    chance = 5;
    memset(account, 0, sizeof *account);
    mill_spectrum_grid_init(&grid);
    struct fixture turning;
    fixture_init(&turning);
    fixture_speed(&turning, rotor_speed);
    ck_assert(mill_precision_init(&batches, 0, &turning.world, &grid));
    batches.accounts[0] = *account;
}

TEST(median_and_power_are_told_with_their_errors)
{
    struct mill_account account;
    open_batches(100, &account);
    for (int i = 0; i < 120; i++)
        add_batch(&account, 2 * batches.at.batch * (1 + 0.1 * normal()), 0.7, 100);
    const struct mill_precision_known known = mill_precision_tell(&batches, 0);
    ck_assert_double_eq_tol(known.power.value, 2, 4 * 0.2 / sqrt(120));
    /* widened, by about a sixth for some ten degrees of freedom */
    ck_assert_double_eq_tol(known.power.error, 1.17 * 0.2 / sqrt(120), 0.3 * 0.2 / sqrt(120));
    /* of the median of normal ln v: sqrt(pi/2) sigma / sqrt(n) */
    const double error = 0.7 * sqrt(PI / 2) * 0.2 / sqrt(12000);
    ck_assert_double_eq_tol(known.median_fast.value, 0.7, 4 * error);
    ck_assert_double_eq_tol(known.median_fast.error, 1.17 * error, 0.3 * error);
    ck_assert_double_eq_tol(known.median.error, known.median_fast.error, 1e-6 * error);
    /* of 12000 impacts in so much time */
    const double time = 120 * batches.at.batch;
    ck_assert_double_eq_tol(known.rate[MILL_BALL_BALL].value, 12000 / time, 1e-6 / time);
    ck_assert_double_eq_tol(known.rate[MILL_KINDS].error, sqrt(12000) / time, 1e-6 / time);
    ck_assert_double_gt(known.fast[MILL_BALL_BALL][1].error, 0);
    ck_assert_double_nan(known.rate[MILL_BALL_DRUM].error); /* none: nothing known */
    ck_assert(mill_precision_reached(&known, 0.02));
    ck_assert(!mill_precision_reached(&known, 0.005));
}

TEST(a_power_near_zero_is_never_known)
{
    struct mill_account account;
    open_batches(100, &account);
    for (int i = 0; i < 240; i++)
        add_batch(&account, 1e-3 * normal(), 0.7, 100);
    struct mill_precision_known known = mill_precision_tell(&batches, 0);
    ck_assert(known.median_fast.error < 0.02 * known.median_fast.value);
    ck_assert(!mill_precision_reached(&known, 0.2));
    /* nor where the charge has left the rotor altogether */
    for (int i = 0; i < 240; i++)
        add_batch(&account, 0, 0.7, 100);
    known = mill_precision_tell(&batches, 240);
    ck_assert(known.power.value == 0);
    ck_assert(!mill_precision_reached(&known, 0.2));
    mill_precision_free(&batches);
}

TEST(a_rotor_that_never_did_any_work_is_not_waited_for)
{
    struct mill_account account;
    open_batches(100, &account);
    for (int i = 0; i < 48; i++)
        add_batch(&account, 1e-18 * normal(), 0.7, 100);
    const struct mill_precision_known known = mill_precision_tell(&batches, 0);
    ck_assert(known.idle);
    ck_assert(mill_precision_reached(&known, 0.02));
    mill_precision_free(&batches);
}

TEST(without_fast_impacts_nothing_is_known)
{
    struct mill_account account;
    open_batches(0, &account);
    for (int i = 0; i < 48; i++)
        add_batch(&account, 0, 0.01, 100);
    const struct mill_precision_known known = mill_precision_tell(&batches, 0);
    ck_assert_double_nan(known.median_fast.value);
    ck_assert(!mill_precision_reached(&known, 1));
    mill_precision_free(&batches);
}

TEST(less_than_three_revolutions_are_not_enough)
{
    struct mill_account account;
    open_batches(1.5, &account); /* a revolution of 4.2 s is many batches */
    ck_assert_uint_gt(batches.at.period, 48);
    for (uint64_t i = 0; i < 3 * batches.at.period - 1; i++)
        add_batch(&account, 1, 0.7, 10);
    ck_assert(!mill_precision_tell(&batches, 0).enough);
    add_batch(&account, 1, 0.7, 10);
    ck_assert(mill_precision_tell(&batches, 0).enough);
    mill_precision_free(&batches);
}

TEST(joined_batches_tell_the_same)
{
    struct mill_account account;
    open_batches(100, &account);
    for (int i = 0; i < MILL_PRECISION_BATCHES; i++) {
        ck_assert_uint_eq(mill_precision_join(&batches), 1);
        add_batch(&account, 0.3 + 0.01 * normal(), 0.7, 20);
    }
    const struct mill_precision_known before = mill_precision_tell(&batches, 0);
    const double end = mill_precision_next(&batches) - batches.at.batch;
    ck_assert_uint_eq(mill_precision_join(&batches), 2);
    const struct mill_precision_known after = mill_precision_tell(&batches, 0);
    ck_assert_uint_eq(batches.at.batches, MILL_PRECISION_BATCHES / 2);
    ck_assert_uint_eq(batches.at.period, 6);
    ck_assert_double_eq_tol(mill_precision_next(&batches) - batches.at.batch, end, 1e-9);
    ck_assert(after.median_fast.value == before.median_fast.value);
    ck_assert_double_eq_tol(after.power.value, before.power.value, 1e-9);
    /* half as many degrees of freedom, some 8, tell an error to a quarter */
    ck_assert_double_gt(after.power.error, 0.5 * before.power.error);
    ck_assert_double_lt(after.power.error, 2 * before.power.error);
    mill_precision_free(&batches);
}

/* ---- the window that is found ---- */

static struct fixture f;

/* A mill whose impacts are at 4 m/s and its power 500 W until 0.35 s, then 1 m/s and 100 W, both
 * scattered; 10 revolutions a second */
static void play(double from, double to)
{
    const double step = 2e-4;
    for (double time = from; time < to - step / 2; time += step) {
        const bool early = time < 0.35;
        const double v = (early ? 4 : 1) * exp(0.3 * normal());
        const int ball = (int)(39 * random_share(&chance));
        fixture_work(&f, (early ? 500 : 100) * (1 + 0.5 * normal()) * step);
        f.world.account.work_gross += 100 * step;
        f.world.account.incident += 0.1 * step;
        fixture_play(&f, impact_of(time, MILL_BALL_BALL, ball, ball + 1, v, 0.01));
    }
}

static void find_window(double precision)
{
    fixture_init(&f);
    chance = 3;
    f.asked.end = 20;
    f.asked.sample_from = 0;
    f.asked.sample_found = true;
    f.asked.precision = precision;
    fixture_create(&f);
}

TEST(nothing_from_before_the_cut_is_in_the_statistics)
{
    find_window(0.001);
    play(0, 2);
    fixture_finish(&f, 2);
    ck_assert(f.results->at.settled);
    ck_assert_double_ge(f.results->begin, 0.35);
    ck_assert_double_le(f.results->begin, 0.6);
    ck_assert_double_eq_tol(f.results->duration, 2 - f.results->begin, 1e-12);
    /* one impact every 0.2 ms, of 0.01 J each, none at 4 m/s */
    const struct mill_spectrum *normal_speed = &f.results->impacts[MILL_BALL_BALL].normal;
    const double impacts = f.results->duration / 2e-4;
    ck_assert_double_eq_tol((double)impacts_of(&f, MILL_BALL_BALL), impacts, 1.01);
    ck_assert_double_eq_tol(mill_spectrum_total(normal_speed, 0).dissipation, 0.01 * impacts,
                            0.011);
    ck_assert_double_eq_tol(mill_spectrum_quantile(&f.tally->grid, normal_speed, 0, 0.5), 1, 0.05);
    ck_assert_double_lt(mill_spectrum_quantile(&f.tally->grid, normal_speed, 0, 0.999), 4);
    ck_assert_double_eq_tol(f.results->at.known.power.value, 100, 5);
    uint64_t hits = 0;
    for (int i = 0; i < f.results->maps.cross.n[0] * f.results->maps.cross.n[1]; i++)
        hits += f.results->maps.cross.hits[i].count;
    ck_assert_uint_eq(hits, impacts_of(&f, f.results->all));
    ck_assert_uint_eq(f.results->blocks, (uint64_t)(f.results->duration / 0.1 + 1e-6));
    fixture_free(&f);
}

TEST(the_window_ends_when_it_is_known)
{
    find_window(0.03);
    double time = 0;
    for (; time < 10 && !f.tally->at.closed; time += 0.05)
        play(time, time + 0.05);
    ck_assert(f.tally->at.closed);
    ck_assert_int_eq(f.tally->at.ended, MILL_TALLY_PRECISION);
    const uint64_t then = f.world.account.collisions[MILL_BALL_BALL];
    fixture_finish(&f, time);
    const struct mill_precision_known *known = &f.results->at.known;
    ck_assert(f.results->reached);
    ck_assert_double_le(known->median_fast.error, 0.03 * known->median_fast.value);
    ck_assert_double_le(known->power.error, 0.03 * known->power.value);
    ck_assert_uint_lt(impacts_of(&f, MILL_BALL_BALL), then);
    fixture_free(&f);
}

TEST(a_strike_that_began_before_the_cut_is_not_counted_nor_what_follows_it)
{
    find_window(0.001);
    play(0, 0.2);
    /* a ball that rests on a wall from the start-up to the end: contacts every 8 us */
    for (int k = 0; k < 6500; k++) {
        const double time = 0.2 + 2e-4 * k;
        play(time, time + 2e-4);
        for (int i = 1; i <= 25; i++)
            fixture_play(&f, impact_of(time + 8e-6 * i - 4e-6, MILL_BALL_WALL, 7, 0, 0.01, 1e-6));
    }
    play(1.5, 2.5);
    fixture_finish(&f, 2.5);
    ck_assert(f.results->begin > 0.2 && f.results->begin < 1.2);
    ck_assert_uint_gt(impacts_of(&f, MILL_BALL_WALL), 0);
    ck_assert_uint_eq(strikes_of(&f, MILL_BALL_WALL), 0);
    ck_assert(mill_spectrum_total(&f.results->strikes[MILL_BALL_WALL].normal, 0).dissipation == 0);
    fixture_free(&f);
}

TEST(what_strikes_lose_is_what_impacts_lose_across_all_portions)
{
    find_window(0.001);
    /* steady from the start: all is kept; chains of contacts run through many portions */
    for (double time = 1e-6; time < 1.5; time += 9e-6)
        fixture_play(
            &f, impact_of(time, MILL_BALL_WALL, 7, 0, 0.2 + 0.1 * random_share(&chance), 1e-6));
    fixture_finish(&f, 1.5);
    if (f.results->begin == 0) {
        ck_assert_uint_eq(strikes_of(&f, MILL_BALL_WALL), 1);
        ck_assert_double_eq_tol(
            mill_spectrum_total(&f.results->strikes[MILL_BALL_WALL].normal, 0).dissipation,
            mill_spectrum_total(&f.results->impacts[MILL_BALL_WALL].normal, 0).dissipation, 1e-9);
    } else {
        ck_assert_uint_eq(strikes_of(&f, MILL_BALL_WALL), 0);
    }
    fixture_free(&f);
}

TEST(portions_are_joined_and_a_long_run_still_finds_its_cut)
{
    find_window(1e-6);
    play(0, 12); /* 1440 batches: both are joined several times */
    ck_assert_double_gt(f.tally->batches.at.batch, 1.5 * 0.1 / 12);
    fixture_finish(&f, 12);
    ck_assert_double_ge(f.results->begin, 0.35);
    ck_assert_double_le(f.results->begin, 1.2); /* a portion is up to a 12th of the run */
    ck_assert_double_eq_tol((double)impacts_of(&f, MILL_BALL_BALL), f.results->duration / 2e-4,
                            1.01);
    fixture_free(&f);
}

int main(void)
{
    return unit_run("precision");
}
