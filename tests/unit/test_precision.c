/* Claims about what is known of a run, and about the window that is found for it. */
#include "mill_fixture.h"
#include "observe/precision.h"
#include "quantile.h"
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
static const struct mill_precision_set alone = {1, {&batches}};

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
    const struct mill_precision_known known = mill_precision_tell(&alone, 0);
    ck_assert_double_eq_tol(known.motion_power[0].value, 2, 4 * 0.2 / sqrt(120));
    /* of eight pieces, widened by a fifth for seven degrees of freedom */
    ck_assert_double_eq_tol(known.motion_power[0].error, 1.21 * 0.2 / sqrt(120),
                            0.5 * 0.2 / sqrt(120));
    /* of the median of normal ln v: sqrt(pi/2) sigma / sqrt(n) */
    const double error = 0.7 * sqrt(PI / 2) * 0.2 / sqrt(12000);
    ck_assert_double_eq_tol(known.median_fast.value, 0.7, 4 * error);
    ck_assert_double_eq_tol(known.median_fast.error, 1.21 * error, 0.5 * error);
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

static void ck_same(struct mill_spread_mean found, struct mill_spread_mean own)
{
    ck_assert(fabs(found.value - own.value) <= 1e-9 * fabs(own.value));
    ck_assert(found.freedom == own.freedom || fabs(found.freedom / own.freedom - 1) < 1e-6);
    ck_assert((isnan(found.error) && isnan(own.error)) ||
              fabs(found.error - own.error) <= 1e-9 * own.error);
}

TEST(each_number_of_the_account_is_told_with_the_error_of_its_own_series)
{
    enum { RATE, FAST, LOSS = FAST + MILL_WORLD_FAST, NORMAL, SORTS, ROWS = MILL_KINDS + 1 };
    static double own[SORTS][ROWS][MOST], moved[2][2][MOST];
    const uint64_t from = 5, none[MILL_SPECTRUM_SLOTS] = {0};
    struct mill_account a;
    open_batches(100, &a);
    batches.motions = 2;
    for (int n = 0; n < 60; n++) {
        for (int kind = 0; kind < MILL_KINDS; kind++)
            for (int sort = 0; sort < SORTS; sort++) {
                double more =
                    sort < LOSS ? floor((8 - 2 * kind) * random_share(&chance)) : normal();
                a.collisions[kind] += (uint64_t)(sort == RATE ? more : 0);
                if (sort >= FAST && sort < LOSS)
                    a.fast[kind][sort - FAST] += (uint64_t)more;
                a.dissipation[kind] += sort == LOSS ? more : 0;
                a.dissipation_normal[kind] += sort == NORMAL ? more : 0;
                own[sort][kind][n] = more / batches.at.batch;
                own[sort][MILL_KINDS][n] += more / batches.at.batch;
            }
        for (int k = 0; k < 2; k++) {
            a.motion[k].work += moved[k][0][n] = normal();
            a.motion[k].impulse += moved[k][1][n] = normal();
        }
        mill_precision_close(&batches, none, &a);
    }
    const struct mill_precision_known known = mill_precision_tell(&alone, from);
    for (int row = 0; row < ROWS; row++)
        for (int sort = 0; sort < SORTS; sort++) {
            struct mill_spread_mean mean =
                mill_spread_mean(own[sort][row] + from, (struct mill_spread_of){1, 55, 12});
            if (sort < LOSS) /* as independent impacts scatter, if there are ten */
                mean =
                    mill_spread_counted(own[sort][row] + from, (struct mill_spread_of){1, 55, 12},
                                        55 * batches.at.batch);
            ck_same(sort == RATE     ? known.rate[row]
                    : sort < LOSS    ? known.fast[row][sort - FAST]
                    : sort == NORMAL ? known.loss_normal[row]
                                     : known.loss[row],
                    mean);
        }
    for (int k = 0; k < 2; k++)
        for (int n = 0; n < 60; n++)
            for (int i = 0; i < 2; i++)
                moved[k][i][n] /= batches.at.batch;
    for (int k = 0; k < 2; k++) {
        ck_same(known.motion_power[k],
                mill_spread_mean(moved[k][0] + from, (struct mill_spread_of){1, 55, 12}));
        ck_same(known.motion_torque[k],
                mill_spread_mean(moved[k][1] + from, (struct mill_spread_of){1, 55, 12}));
    }
    mill_precision_free(&batches);
}

/* Equal counts in the bins around a median make the density of ln v known exactly. */
TEST(the_error_of_a_median_is_that_of_the_share_below_it_over_the_density)
{
    static const int middle[] = {3, MILL_SPECTRUM_FAST + 2, MILL_SPECTRUM_FAST + 200,
                                 MILL_SPECTRUM_BINS - 2};
    struct mill_account account;
    for (size_t i = 0; i < 4; i++)
        for (int scatters = 0; scatters < 2; scatters++) {
            const int reach = i == 2 ? 10 : 2,
                      seen = i == 2 ? 11 : 8; /* bins that density() sees */
            open_batches(0, &account);
            for (int n = 0; n < 48; n++) {
                uint64_t count[MILL_SPECTRUM_SLOTS] = {0};
                const int more = (n < 24 ? 20 : -20) * (n % 24 * 7 % 5 - 2) * scatters;
                for (int bin = -reach; bin <= reach; bin++)
                    count[middle[i] + bin] = (uint64_t)(100 + (bin < 0) * more - (bin > 0) * more);
                x[n] = reach * more;
                mill_precision_close(&batches, count, &account);
            }
            const double many = 100 * (2 * reach + 1) * 48, within = many / (2 * reach + 1);
            const double density =
                within * (reach < 5 ? 2 * reach + 1 : 11) / many / (seen * MILL_SPECTRUM_LOG_BIN);
            const double value = grid.edge[middle[i] - 1] * exp(0.5 * MILL_SPECTRUM_LOG_BIN);
            const struct mill_spread_mean scatter =
                mill_spread_mean(x, (struct mill_spread_of){1, 48, 0});
            const struct mill_precision_known known = mill_precision_tell(&alone, 0);
            const struct mill_spread_mean median = i > 0 ? known.median_fast : known.median;
            ck_assert_double_eq_tol(median.value / value, 1, 1e-12);
            ck_assert_double_eq_tol(median.error / value * density,
                                    scatters ? scatter.error * 48 / many : 0.5 / sqrt(many), 1e-9);
            ck_assert(median.freedom == scatter.freedom);
            ck_assert(i > 0 || isnan(known.median_fast.value));
            uint64_t beyond[MILL_SPECTRUM_SLOTS] = {[MILL_SPECTRUM_BINS + 1] = 1000000};
            mill_precision_close(&batches, beyond, &account);
            ck_assert(mill_precision_tell(&alone, 0).median.value == grid.edge[MILL_SPECTRUM_BINS]);
            mill_precision_free(&batches);
        }
}

TEST(the_median_of_a_single_impact_is_in_the_middle_of_its_bin)
{
    struct mill_account account;
    uint64_t count[MILL_SPECTRUM_SLOTS] = {[MILL_SPECTRUM_FAST + 2] = 1};
    open_batches(0, &account);
    for (int n = 0; n < 48; n++, count[MILL_SPECTRUM_FAST + 2] = 0)
        mill_precision_close(&batches, count, &account);
    const struct mill_precision_known known = mill_precision_tell(&alone, 0);
    ck_assert_double_eq_tol(known.median_fast.value / grid.edge[MILL_SPECTRUM_FAST + 1],
                            exp(0.5 * MILL_SPECTRUM_LOG_BIN), 1e-12);
    mill_precision_free(&batches);
}

TEST(a_start_up_of_power_or_of_speeds_alone_is_cut)
{
    for (int of = 0; of < 3; of++) {
        struct mill_account account;
        bool settled;
        open_batches(100, &account);
        for (int i = 0; i < 120; i++)
            add_batch(&account, i < 40 && of != 0 ? 5 : 1, i < 20 && of != 1 ? 3 : 0.7, 100);
        const uint64_t cut = mill_precision_cut(&alone, &settled);
        ck_assert_msg(cut == (of ? 40 : 20), "%d: %d", of, (int)cut);
        ck_assert(settled);
        for (int i = 0; i < 120; i++)
            add_batch(&account, 3, 5, 100); /* what has just begun: the first half is given up */
        ck_assert_uint_eq(mill_precision_cut(&alone, &settled), 120);
        ck_assert(settled);
        add_batch(&account, 9, 50, 100);
        mill_precision_free(&batches);
    }
}

/* ---- several starts ---- */

enum { STARTS = 8 };
static struct mill_precision starts[STARTS];

/* Starts of 64 batches: each loses about `lost(k, i)` W in its batch i */
static struct mill_precision_set several(double (*lost)(int k, int i))
{
    struct mill_precision_set set = {.count = STARTS};
    struct mill_account account;
    for (int k = 0; k < STARTS; k++) {
        const uint64_t now = chance;
        open_batches(100, &account);
        chance = k > 0 ? now : chance; /* each start has its own numbers */
        for (int i = 0; i < 64; i++) {
            const double work = lost(k, i) * batches.at.batch;
            account.dissipation[MILL_BALL_BALL] += work;
            add_batch(&account, work, 0.7, 100);
        }
        starts[k] = batches;
        set.of[k] = &starts[k];
    }
    return set;
}

static void free_several(void)
{
    for (int k = 0; k < STARTS; k++)
        mill_precision_free(&starts[k]);
}

/* Each start keeps its own arrangement for ever. */
static double frozen(int k, int i)
{
    return 10 + k + 0.01 * (i % 2);
}

TEST(the_error_of_frozen_starts_is_their_scatter_and_not_that_in_time)
{
    const struct mill_precision_set set = several(frozen);
    const struct mill_precision_known known = mill_precision_tell(&set, 0);
    const double error = sqrt(42.0 / 7 / 8) * 2.3646 / 1.96; /* of 10, 11 ... 17 */
    ck_assert_double_eq_tol(known.loss[MILL_KINDS].value, 13.505, 1e-9);
    ck_assert_double_eq_tol(known.loss[MILL_KINDS].error, error, 1e-4 * error);
    ck_assert(known.loss[MILL_KINDS].freedom == 7);
    ck_assert(known.enough && !known.drifts);
    ck_assert_double_eq_tol(mill_precision_one(&starts[3], 0, 64,
                                               &mill_precision_rates[MILL_PRECISION_LOSS],
                                               MILL_KINDS, 0),
                            13.005, 1e-9);
    free_several();
}

/* All starts slow down by a hundredth over the whole time: less than each of them scatters. */
static double falling(int k, int i)
{
    return 10 + 0.1 * k - 0.1 * i / 64 + 0.1 * normal();
}

static double settled(int k, int i)
{
    return 10 + 0.1 * k + 0.1 * normal() + 0 * i;
}

TEST(a_drift_that_all_starts_share_is_found_and_chance_is_none)
{
    struct mill_precision_set set = several(falling);
    ck_assert(mill_precision_tell(&set, 0).drifts);
    free_several();
    set = several(settled);
    ck_assert(!mill_precision_tell(&set, 0).drifts);
    free_several();
}

static double starting(int k, int i)
{
    return 10 + 0.1 * k + 0.1 * normal() + 5 * exp(-i / 4.0);
}

TEST(the_start_up_of_several_starts_is_cut_where_their_mean_is_steady)
{
    bool over;
    const struct mill_precision_set set = several(starting);
    const uint64_t cut = mill_precision_cut(&set, &over);
    ck_assert_msg(cut >= 16 && cut <= 32, "%d", (int)cut); /* 5 exp(-4) = 0.09 */
    ck_assert(over && !mill_precision_tell(&set, cut).drifts);
    free_several();
}

/* Impacts of a start become `times` as many, and each batch of all has `slow` more below the floor.
 */
static void change_speeds(int start, uint32_t times, uint32_t slow)
{
    for (int k = 0; k < STARTS; k++)
        for (int i = 0; i < 64; i++) {
            for (int slot = 0; slot < MILL_SPECTRUM_SLOTS && k == start; slot++)
                starts[k].counts[i][slot] *= times;
            starts[k].counts[i][MILL_SPECTRUM_FAST - 9] += slow;
        }
}

TEST(a_median_has_no_error_where_few_starts_have_most_of_the_impacts)
{
    const struct mill_precision_set set = several(settled);
    struct mill_precision_known known = mill_precision_tell(&set, 0);
    ck_assert(known.median_fast.error > 0 && known.median_fast.freedom == 7);
    change_speeds(5, 9, 0); /* nine of sixteen: as good as 16^2 / (9^2 + 7) = 2.9 equal starts */
    known = mill_precision_tell(&set, 0);
    ck_assert(isnan(known.median_fast.error) && known.median_fast.freedom == 0);
    ck_assert(known.drive.freedom == 7 && !known.slips);
    free_several();
}

TEST(a_median_of_rare_slips_has_no_error_and_no_run_waits_for_it)
{
    const struct mill_precision_set set = several(settled);
    change_speeds(0, 1, 100 * 900);
    struct mill_precision_known known = mill_precision_tell(&set, 0);
    ck_assert(known.median_fast.error > 0 && !known.slips);
    change_speeds(0, 1, 100 * 200);
    known = mill_precision_tell(&set, 0);
    ck_assert(isnan(known.median_fast.error) && known.slips);
    ck_assert(mill_precision_reached(&known, 0.1) && !mill_precision_reached(&known, 1e-4));
    free_several();
}

TEST(a_power_near_zero_is_never_known)
{
    struct mill_account account;
    open_batches(100, &account);
    for (int i = 0; i < 240; i++)
        add_batch(&account, 1e-3 * normal(), 0.7, 100);
    struct mill_precision_known known = mill_precision_tell(&alone, 0);
    ck_assert(known.median_fast.error < 0.02 * known.median_fast.value);
    ck_assert(!mill_precision_reached(&known, 0.2));
    /* nor where the charge has left the rotor altogether */
    for (int i = 0; i < 240; i++)
        add_batch(&account, 0, 0.7, 100);
    known = mill_precision_tell(&alone, 240);
    ck_assert(known.motion_power[0].value == 0);
    ck_assert(!mill_precision_reached(&known, 0.2));
    mill_precision_free(&batches);
}

TEST(a_rotor_that_never_did_any_work_is_not_waited_for)
{
    struct mill_account account;
    open_batches(100, &account);
    for (int i = 0; i < 48; i++)
        add_batch(&account, 1e-18 * normal(), 0.7, 100);
    const struct mill_precision_known known = mill_precision_tell(&alone, 0);
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
    const struct mill_precision_known known = mill_precision_tell(&alone, 0);
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
    ck_assert(!mill_precision_tell(&alone, 0).enough);
    add_batch(&account, 1, 0.7, 10);
    ck_assert(mill_precision_tell(&alone, 0).enough);
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
    const struct mill_precision_known before = mill_precision_tell(&alone, 0);
    const double end = mill_precision_next(&batches) - batches.at.batch;
    ck_assert_uint_eq(mill_precision_join(&batches), 2);
    const struct mill_precision_known after = mill_precision_tell(&alone, 0);
    ck_assert_uint_eq(batches.at.batches, MILL_PRECISION_BATCHES / 2);
    ck_assert_uint_eq(batches.at.period, 6);
    ck_assert_double_eq_tol(mill_precision_next(&batches) - batches.at.batch, end, 1e-9);
    ck_assert(after.median_fast.value == before.median_fast.value);
    ck_assert_double_eq_tol(after.motion_power[0].value, before.motion_power[0].value, 1e-9);
    /* half as many degrees of freedom, some 8, tell an error to a quarter */
    ck_assert_double_gt(after.motion_power[0].error, 0.5 * before.motion_power[0].error);
    ck_assert_double_lt(after.motion_power[0].error, 2 * before.motion_power[0].error);
    mill_precision_free(&batches);
}

/* ---- the window that is found ---- */

static struct fixture f;

/* The batches of the window have all of its impacts by speed, and the blocks all of its batches. */
static void ck_whole(void)
{
    const struct mill_precision *p = &f.tally->batches;
    const struct mill_energies_blocks *b = &f.tally->blocks;
    for (int i = 0; i < MILL_SPECTRUM_SLOTS; i++) {
        uint64_t count = 0;
        for (uint64_t k = f.results->from; k < p->at.batches; k++)
            count += p->counts[k][i];
        ck_assert_uint_eq(count, f.results->sums.impacts[f.results->all].normal.slot[i].count);
    }
    ck_assert_uint_eq(b->blocks, p->at.batches / b->length);
    ck_assert(b->length == 1 || b->blocks >= 36);
}

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

static long asked_starts = 1;

static void find_window(double precision)
{
    fixture_init(&f);
    chance = 3;
    f.asked.end = 20;
    f.asked.sample_from = 0;
    f.asked.sample_found = true;
    f.asked.precision = precision;
    f.asked.starts = asked_starts;
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
    const struct mill_spectrum *normal_speed = &f.results->sums.impacts[MILL_BALL_BALL].normal;
    const double impacts = f.results->duration / 2e-4;
    ck_assert_double_eq_tol((double)impacts_of(&f, MILL_BALL_BALL), impacts, 1.01);
    ck_assert_double_eq_tol(mill_spectrum_total(normal_speed, 0).dissipation, 0.01 * impacts,
                            0.011);
    ck_assert_double_eq_tol(quantile_of(&f.tally->grid, normal_speed, 0, 0.5), 1, 0.05);
    ck_assert_double_lt(quantile_of(&f.tally->grid, normal_speed, 0, 0.999), 4);
    ck_assert_double_eq_tol(f.results->at.known.motion_power[0].value, 100, 5);
    uint64_t hits = 0;
    for (int i = 0; i < f.tally->plan.maps.cross.n[0] * f.tally->plan.maps.cross.n[1]; i++)
        hits += f.results->sums.hits[i].count;
    ck_assert_uint_eq(hits, impacts_of(&f, f.results->all));
    ck_whole();
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
    ck_assert(mill_spectrum_total(&f.results->sums.strikes[MILL_BALL_WALL].normal, 0).dissipation ==
              0);
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
            mill_spectrum_total(&f.results->sums.strikes[MILL_BALL_WALL].normal, 0).dissipation,
            mill_spectrum_total(&f.results->sums.impacts[MILL_BALL_WALL].normal, 0).dissipation,
            1e-9);
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
    ck_whole();
    fixture_free(&f);
}

/* Of several starts there are fewer portions. Three are joined when a period has three of them. */
TEST(joined_portions_of_several_starts_keep_all_impacts)
{
    asked_starts = 8;
    for (int end = 4; end < 60; end += 5) { /* tenths of a second: of a revolution, 12 batches */
        find_window(1e-6);
        play(0, 0.1 * end);
        fixture_finish(&f, 0.1 * end);
        ck_assert_double_eq_tol((double)impacts_of(&f, MILL_BALL_BALL), f.results->duration / 2e-4,
                                1.01);
        fixture_free(&f);
    }
    asked_starts = 1;
}

int main(void)
{
    return unit_run("precision");
}
