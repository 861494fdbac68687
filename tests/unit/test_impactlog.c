/* The log of impacts: every one of them, in order, with all that is known of it. */
#include "h5_fixture.h"
#include "observe/observers.h"
#include "state_fixture.h"
#include "surfaces.h"

extern const struct mill_observing mill_impactlog_type;

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
    for (long k = first; k < end; k++) {
        const struct mill_impact impact = impact_number(k);
        ck_assert_int_eq(log->type->impact(log, &impact, NULL), MILL_OK);
    }
}

static struct mill_observer *open_log(struct kept *state)
{
    const struct mill_observe asked = {.log_impacts = true};
    static struct mill_world world;
    mill_kinds_init(&world.kinds);
    surfaces_give(&world);
    struct mill_observer *log = mill_observers_one(&mill_impactlog_type, &asked, &world, NULL);
    ck_assert_ptr_nonnull(log);
    if (state)
        mill_observe_type(log)->state(log, kept_load(state));
    mill_observe_type(log)->open(log, &asked, file, &world);
    return log;
}

static void close_all(struct mill_observer *log)
{
    mill_observers_free_one(log);
    close_file();
}

static void assert_all_logged(void)
{
    hsize_t dims[2];
    double *time = look(path, "/impacts/time", 1, dims);
    double *kind = look(path, "/impacts/kind", 1, dims);
    double *partner = look(path, "/impacts/partner", 1, dims);
    double *loss = look(path, "/impacts/dissipation", 1, dims);
    double *position = look(path, "/impacts/position", 2, dims);
    ck_assert(dims[0] == MANY && dims[1] == 3);
    for (long k = 0; k < MANY; k++) {
        const struct mill_impact impact = impact_number(k);
        ck_assert(time[k] == impact.time && kind[k] == (double)impact.kind);
        ck_assert(partner[k] == impact.partner && loss[k] == impact.dissipation);
        ck_assert(position[3 * k] == (double)(float)impact.position.x);
    }
    free(time);
    free(kind);
    free(partner);
    free(loss);
    free(position);
}

TEST(every_impact_is_logged_in_order)
{
    struct mill_observer *log = open_log(NULL);
    ck_assert(isinf(log->next));
    log_range(log, 0, MANY);
    close_all(log);
    assert_all_logged();
    assert_text(path, "/impacts/tangential_speed", "unit", "m s-1");
}

TEST(a_run_taken_up_again_leaves_the_same_log)
{
    struct kept state;
    struct mill_observer *log = open_log(NULL);
    log_range(log, 0, 70001);
    kept_init(&state);
    mill_observe_type(log)->state(log, &state.state);
    ck_assert_uint_eq(*(uint64_t *)state.field[0].value, 70001);
    log_range(log, 90000, 99999); /* lost: after the checkpoint */
    close_all(log);
    open_file(MILL_H5_UPDATE);
    log = open_log(&state);
    log_range(log, 70001, MANY);
    close_all(log);
    assert_all_logged();
    kept_free(&state);
}

int main(void)
{
    return unit_run_in("impactlog", open_new, remove_file);
}
