/* The log of impacts: every one of them, in order, with all that is known of it. */
#include "output_fixture.h"

#define MANY 150000 /* more than two blocks of the log */

static struct mill_impact impact_number(long k)
{
    struct mill_impact impact;
    memset(&impact, 0, sizeof impact);
    impact.time = 1e-6 * (double)k;
    impact.kind = (enum mill_kind)(k % MILL_KINDS);
    impact.ball = (int32_t)(k % 1000);
    impact.partner = (int32_t)(k % 3) - 1;
    impact.position = vec3_make(0.5 * (double)k, -1, 2);
    impact.normal = vec3_make(0, 1, 0);
    impact.normal_speed = (double)k / 7;
    impact.tangential_speed = (double)k / 9;
    impact.dissipation = -(double)k / 11;
    return impact;
}

static void log_range(struct mill_observer *log, long first, long end)
{
    long k, refused = 0;
    for (k = first; k < end; k++) {
        const struct mill_impact impact = impact_number(k);
        refused += log->type->impact(log, &impact, NULL) != MILL_OK;
    }
    ck_assert_int_eq(refused, 0);
}

static void close_all(struct mill_h5 *file, struct mill_observer *log)
{
    mill_observers_free_one(log);
    ck_assert_int_eq(mill_h5_close(file, NULL), MILL_OK);
}

static void assert_all_logged(const char *path)
{
    hsize_t dims[2];
    double *time = look(path, "/impacts/time", 1, dims);
    double *kind = look(path, "/impacts/kind", 1, dims);
    double *partner = look(path, "/impacts/partner", 1, dims);
    double *loss = look(path, "/impacts/dissipation", 1, dims);
    double *position = look(path, "/impacts/position", 2, dims);
    long k, wrong = 0;
    ck_assert(dims[0] == MANY && dims[1] == 3);
    for (k = 0; k < MANY; k++) {
        const struct mill_impact impact = impact_number(k);
        wrong += time[k] != impact.time || kind[k] != (double)impact.kind ||
                 partner[k] != impact.partner || loss[k] != impact.dissipation ||
                 position[3 * k] != (double)(float)impact.position.x;
    }
    ck_assert_int_eq(wrong, 0);
    free(time);
    free(kind);
    free(partner);
    free(loss);
    free(position);
}

TEST(every_impact_is_logged_in_order)
{
    struct fixture f;
    struct mill_h5 *file;
    struct mill_observer *log;
    fixture_init(&f);
    f.asked.log_impacts = true;
    mill_h5_create(f.path, MILL_H5_NEW, &file, NULL);
    log = make_writer(&mill_impactlog_type, &f, file, NULL);
    ck_assert(isinf(log->next));
    log_range(log, 0, MANY);
    close_all(file, log);
    assert_all_logged(f.path);
    assert_text(f.path, "/impacts/tangential_speed", "unit", "m s-1");
    unlink(f.path);
}

TEST(finishing_in_between_loses_and_doubles_nothing)
{
    struct fixture f;
    struct mill_h5 *file;
    struct mill_observer *log;
    fixture_init(&f);
    f.asked.log_impacts = true;
    mill_h5_create(f.path, MILL_H5_NEW, &file, NULL);
    log = make_writer(&mill_impactlog_type, &f, file, NULL);
    log_range(log, 0, 1234);
    log_range(log, 1234, MANY);
    close_all(file, log);
    assert_all_logged(f.path);
    unlink(f.path);
}

TEST(a_run_taken_up_again_leaves_the_same_log)
{
    struct fixture f;
    struct mill_h5 *file;
    struct mill_observer *log;
    struct kept state;
    fixture_init(&f);
    f.asked.log_impacts = true;
    mill_h5_create(f.path, MILL_H5_NEW, &file, NULL);
    log = make_writer(&mill_impactlog_type, &f, file, NULL);
    log_range(log, 0, 70001);
    save_writer(log, &state);
    ck_assert_uint_eq(*(uint64_t *)state.field[0].value, 70001);
    log_range(log, 90000, 99999); /* lost: after the checkpoint */
    close_all(file, log);
    mill_h5_create(f.path, MILL_H5_UPDATE, &file, NULL);
    log = make_writer(&mill_impactlog_type, &f, file, &state);
    log_range(log, 70001, MANY);
    close_all(file, log);
    assert_all_logged(f.path);
    kept_free(&state);
    unlink(f.path);
}

int main(void)
{
    return unit_run("impactlog");
}
