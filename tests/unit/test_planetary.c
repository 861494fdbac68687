/* What the observers tell of a mill of bodies and motions: every kind, every motion, every pose. */
#include "app/starts.h"
#include "app/summary.h"
#include "planetary.h"
#include "unit.h"

static struct planetary p;

static void set_up(void)
{
    planetary_open(&p, MILL_H5_OVERWRITE);
    ck_assert_int_eq(mill_observers_open(&p.observers, &p.asked, p.file, p.world, p.sim, NULL),
                     MILL_OK);
    planetary_run(&p, p.asked.end);
    planetary_finish(&p);
}

static void tear_down(void)
{
    planetary_free(&p);
    if (!getenv("KEEP"))
        unlink(p.path);
}

static double told(const char *format, const char *name)
{
    char path[128];
    snprintf(path, sizeof path, format, name);
    return look_at(p.path, path, 0, 0);
}

TEST(kinds_of_bodies_are_told_in_every_result)
{
    const struct mill_account *a = &p.world->account;
    hsize_t dims[3];
    double *kind = look(p.path, "/impacts/kind", 1, dims),
           *time = look(p.path, "/impacts/time", 1, dims);
    double all = 0;
    int listed = 0; /* of the kinds so far: a mill without a drum has no ball_drum */
    for (int k = 0; k < PLANETARY_KINDS; k++) {
        if (k > 0 && k < MILL_KINDS)
            continue;
        const char *name = p.world->kinds.name[k];
        char path[128];
        double logged = 0, energies = 0;
        for (size_t i = 0; i < dims[0]; i++)
            logged += kind[i] == listed && time[i] >= 0.1 && time[i] < 0.75;
        const double count = told("/statistics/impacts/%s/count", name);
        hsize_t shape[3];
        snprintf(path, sizeof path, "/statistics/energies/%s/normal", name);
        double *bins = look(p.path, path, k == 0 ? 3 : 2, shape);
        for (size_t i = 0; i < MILL_ENERGIES_BINS; i++)
            energies += bins[i];
        free(bins);
        ck_assert(count > 20);
        ck_assert_double_eq(count, logged);
        ck_assert_double_eq(count, energies);
        ck_assert(told("/statistics/strikes/%s/count", name) <= count);
        ck_assert_double_eq_tol(told("/statistics/precision/rate/%s/value", name), count / WINDOW,
                                1e-9 * (count + 1));
        ck_assert(!(told("/statistics/floor_share/%s", name) > 1));
        snprintf(path, sizeof path, "/observables/collisions/%s/value", name);
        ck_assert_double_eq(look_at(p.path, path, 1, 75), (double)a->collisions[k]);
        all += count;
        listed++;
    }
    ck_assert_double_eq(told("/statistics/impacts/%s/count", "all"), all);
    free(kind);
    free(time);
}

TEST(the_motions_add_up_to_the_drive)
{
    double power = 0, work = 0;
    for (int k = 0; k < PLANETARY_MOTIONS; k++) {
        const char *name = p.world->motion_name[k];
        char path[128];
        power += told("/statistics/motions/%s/power", name);
        snprintf(path, sizeof path, "/observables/motion_work/%s/value", name);
        work += look_at(p.path, path, 1, 75);
        const double torque = told("/statistics/motions/%s/torque", name);
        ck_assert(k == SHAKE ? isnan(torque) : fabs(torque) > 0);
    }
    const double drive = look_at(p.path, "/statistics/drive/power", 0, 0);
    ck_assert_double_gt(drive, 0);
    ck_assert_double_eq_tol(power, drive, 1e-9 * drive);
    ck_assert_double_eq_tol(work, p.world->account.work, 1e-9 * p.world->account.work_gross);
    ck_assert_double_eq(look_at(p.path, "/statistics/precision/drive_power/value", 0, 0), drive);
    /* balls rest on the wall of a container that moves: one start gives no error */
    ck_assert_double_nan(look_at(p.path, "/statistics/precision/drive_power/standard_error", 0, 0));
    ck_assert_double_nan(look_at(p.path, "/statistics/drive/power_error", 0, 0));
    /* the sun turns at constant speed about an axis that stands: its own power is torque times it
     */
    ck_assert_double_eq_tol(told("/statistics/motions/%s/power", "sun"),
                            2 * PI * 5 * told("/statistics/motions/%s/torque", "sun"),
                            1e-9 * drive);
    /* and where there is no rotor nothing is told of one */
    static const char *const of_rotor[] = {
        "/statistics/rotor", "/observables/rotor_work", "/observables/rotor_torque",
        "/statistics/precision/rotor_power", "/statistics/impacts/ball_shaft"};
    const hid_t file = look_open(p.path);
    for (size_t i = 0; i < sizeof of_rotor / sizeof *of_rotor; i++)
        ck_assert_msg(H5Lexists(file, of_rotor[i], H5P_DEFAULT) == 0, "%s", of_rotor[i]);
    H5Fclose(file);
}

TEST(batches_are_parts_of_the_period_of_all_motions)
{
    const struct mill_tally *tally = mill_observers_tally(&p.observers);
    ck_assert_double_eq_tol(p.world->period, PERIOD, 1e-12);
    ck_assert_double_eq_tol((double)tally->batches.at.period * tally->batches.at.batch, PERIOD,
                            1e-12);
}

/* By motions of their own that start anew at the frame's time */
TEST(poses_are_those_of_the_motions)
{
    struct mill_world *fresh = planetary_world();
    for (int k = 0; k < PLANETARY_MOTIONS; k++) {
        char path[2][128], time[128];
        hsize_t dims[3];
        for (int i = 0; i < 2; i++)
            snprintf(path[i], sizeof path[i], "/observables/pose/%s/%s/value",
                     p.world->motion_name[k], i ? "rotation" : "centre");
        snprintf(time, sizeof time, "/observables/pose/%s/centre/time", p.world->motion_name[k]);
        ck_assert(look_same(p.path, time, "/particles/trajectory/position/time"));
        double *centre = look(p.path, path[0], 2, dims), *rotation = look(p.path, path[1], 3, dims);
        ck_assert_uint_eq(dims[0], 16);
        double before = 0;
        for (size_t i = 0; i < dims[0]; i++) {
            const double t = fmin(0.05 * (double)i, 0.75);
            for (int m = 0; m < PLANETARY_MOTIONS; m++)
                fresh->motion[m]->type->restart(fresh->motion[m], t, t - before);
            before = t;
            const struct mill_pose pose = mill_motion_pose(fresh->motion[k], 0.0);
            const double *r = rotation + 9 * i, *c = centre + 3 * i;
            const vec3 x = {r[0], r[3], r[6]}, y = {r[1], r[4], r[7]}, z = {r[2], r[5], r[8]};
            ck_assert_double_le(vec3_norm(vec3_sub(vec3_make(c[0], c[1], c[2]), pose.place)),
                                1e-13);
            ck_assert_double_le(vec3_norm(vec3_sub(x, pose.x)), 1e-12);
            ck_assert_double_le(vec3_norm(vec3_sub(y, pose.y)), 1e-12);
            ck_assert_double_le(vec3_norm(vec3_sub(z, pose.z)), 1e-12);
        }
        free(centre);
        free(rotation);
    }
    mill_world_free(fresh);
}

/* Taken back by the stored pose the points of a block are the same in every frame. */
TEST(blocks_move_as_the_poses_say)
{
    static const char *const block[] = {"jar", "paddle"};
    for (int b = 0; b < 2; b++) {
        char path[3][128];
        hsize_t dims[3];
        snprintf(path[0], sizeof path[0], "/VTKHDF/%s/Points", block[b]);
        snprintf(path[1], sizeof path[1], "/observables/pose/%s/centre/value", block[b]);
        snprintf(path[2], sizeof path[2], "/observables/pose/%s/rotation/value", block[b]);
        double *centre = look(p.path, path[1], 2, dims), *rotation = look(p.path, path[2], 3, dims);
        double *point = look(p.path, path[0], 2, dims);
        const size_t points = dims[0] / 16;
        ck_assert_uint_eq(points * 16, dims[0]);
        ck_assert_uint_gt(points, 7);
        for (size_t i = 0; i < dims[0]; i++) {
            const double *r = rotation + 9 * (i / points), *c = centre + 3 * (i / points);
            double *at = point + 3 * i, back[3];
            for (int k = 0; k < 3; k++)
                back[k] =
                    r[k] * (at[0] - c[0]) + r[3 + k] * (at[1] - c[1]) + r[6 + k] * (at[2] - c[2]);
            memcpy(at, back, sizeof back);
            for (int k = 0; k < 3; k++)
                ck_assert_double_eq_tol(at[k], point[3 * (i % points) + (size_t)k], 5e-8);
        }
        free(centre);
        free(rotation);
        free(point);
    }
}

TEST(what_carries_nothing_has_no_block)
{
    struct mill_h5 *file;
    ck_assert_int_eq(mill_h5_create(p.path, MILL_H5_READ, &file, NULL), MILL_OK);
    ck_assert(mill_h5_exists(file, "/VTKHDF/jar"));
    ck_assert(!mill_h5_exists(file, "/VTKHDF/sun"));
    ck_assert(!mill_h5_exists(file, "/VTKHDF/drum"));
    ck_assert(!mill_h5_exists(file, "/VTKHDF/still"));
    mill_h5_close(file, NULL);
}

TEST(maps_are_the_jars_own)
{
    hsize_t dims[3];
    const double radius = 0.03;
    double *edge = look(p.path, "/statistics/maps/cross_section/y_edges", 1, dims);
    ck_assert_double_eq_tol(edge[0], -radius, 1e-12);
    ck_assert_double_eq_tol(edge[60], radius, 1e-12);
    free(edge);
    /* balls stay within the jar, and are seen to go to and fro in it, not around the sun */
    double *u = look(p.path, "/statistics/maps/cross_section/velocity_y", 2, dims);
    double *solid = look(p.path, "/statistics/maps/axial/solid_fraction", 2, dims);
    double filled = 0;
    for (int i = 0; i < 3600; i++)
        ck_assert(!(fabs(u[i]) > 2 * PI * 10 * radius * 3));
    for (size_t i = 0; i < dims[0]; i++)
        for (size_t k = 0; k < dims[1]; k++)
            filled += solid[i * dims[1] + k] * (2 * (double)k + 1);
    const double room = PI * radius * radius * 0.04, ball = 4 * PI / 3 * pow(0.002, 3);
    ck_assert_double_eq_tol(filled / (double)(dims[0] * 900), PLANETARY_BALLS * ball / room,
                            2e-3 * PLANETARY_BALLS * ball / room);
    free(u);
    free(solid);
}

static char *summary_of(bool json)
{
    struct mill_facts facts = {.status = "complete",
                               .time = p.asked.end,
                               .local = mill_sim_local_time(p.sim),
                               .totals = mill_record_add(p.world, mill_sim_local_time(p.sim)),
                               .version = "0",
                               .deck = "jar.ini",
                               .output = "jar.h5"};
    char *text;
    size_t size;
    FILE *out = open_memstream(&text, &size);
    struct mill_summary s = {out, p.world, &p.observers, &facts, .results = NULL};
    ck_assert_int_eq(mill_summary_write(&s, json, NULL), MILL_OK);
    fclose(out);
    return text;
}

TEST(the_summary_has_a_line_for_each_motion)
{
    char *text = summary_of(false);
    const char *drive = strstr(text, "\ndrive power ");
    ck_assert_ptr_nonnull(drive);
    ck_assert_ptr_nonnull(strstr(text, " (3.25 periods)\n"));
    ck_assert_ptr_nonnull(strstr(drive, "W/kg of balls\nshake "));
    for (int k = 0; k < PLANETARY_MOTIONS; k++) {
        char start[80];
        snprintf(start, sizeof start, "\n%-15s ", p.world->motion_name[k]);
        const char *line = strstr(drive, start);
        ck_assert_msg(line != NULL, "no %s in\n%s", p.world->motion_name[k], text);
        const char *end = strchr(line + 1, '\n'), *torque = strstr(line, "N m\n");
        ck_assert(k == SHAKE ? !torque || torque > end : torque && torque + 3 == end);
    }
    ck_assert_ptr_null(strstr(text, "rotor"));
    ck_assert_ptr_nonnull(strstr(text, "\nball_paddle "));
    ck_assert_ptr_null(strstr(text, "ball_drum"));
    free(text);
    text = summary_of(true);
    ck_assert_ptr_nonnull(strstr(text, "\"motion_work\": {\n      \"shake\": "));
    ck_assert_ptr_nonnull(strstr(text, "\"motions\": {\n      \"shake\": {\n        \"power\": "));
    ck_assert_ptr_nonnull(strstr(text, "\"drive\": {\n      \"power\": "));
    ck_assert_ptr_nonnull(strstr(text, "\"ball_paddle\": "));
    free(text);
}

/* 0.65 s of a mill of that period are no whole periods, but it is judged by all motions' power. */
TEST(notes_speak_of_the_drive)
{
    struct mill_notes notes;
    struct mill_tally_results *results;
    const struct mill_tally *tally = mill_observers_tally(&p.observers);
    const double local = mill_sim_local_time(p.sim);
    ck_assert_int_eq(mill_tally_results_make(tally, p.world, local, &results, NULL), MILL_OK);
    results->at.known.drive.value *= 2;
    mill_notes_take(&notes, p.world, results, local, false, false);
    bool told_so = false;
    for (int i = 0; i < notes.count; i++)
        told_so = told_so || strstr(notes.note[i].text, "not steady: the drive's power");
    ck_assert(told_so);
    ck_assert(!mill_notes_of_rotor(p.world));
    mill_tally_results_free(results);
}

SLOW_TEST(a_run_taken_up_again_has_the_same_poses_and_pictures, 1)
{
    static const char *const same[] = {"/observables/pose/jar/centre/value", "/VTKHDF/jar/Points",
                                       "/VTKHDF/paddle/Points",
                                       "/observables/motion_work/sun/value"};
    struct mill_record_cost cost = {0};
    double *straight[4];
    hsize_t dims[3], again[3];
    for (int i = 0; i < 4; i++)
        straight[i] = look(p.path, same[i], i == 3 ? 1 : 2, dims);
    planetary_free(&p);
    planetary_open(&p, MILL_H5_OVERWRITE);
    ck_assert_int_eq(mill_observers_open(&p.observers, &p.asked, p.file, p.world, p.sim, NULL),
                     MILL_OK);
    planetary_run(&p, 0.43);
    struct mill_starts alone = {.plan = {0, 1, false}, .count = 1};
    alone.one[0] = (struct mill_starts_one){.sim = p.sim, .observers = p.observers};
    mill_checkpoint_write(&alone, &cost, p.file);
    ck_assert_int_eq(mill_h5_flush(p.file, NULL), MILL_OK);
    planetary_run(&p, 0.6); /* lost */
    mill_h5_abandon(p.file);
    planetary_free(&p);
    planetary_open(&p, MILL_H5_UPDATE);
    alone.one[0] = (struct mill_starts_one){.sim = p.sim, .observers = p.observers};
    ck_assert_int_eq(mill_checkpoint_load(&alone, &cost, p.file, p.path, NULL), MILL_OK);
    ck_assert_int_eq(mill_observers_open(&p.observers, &p.asked, p.file, p.world, p.sim, NULL),
                     MILL_OK);
    planetary_run(&p, p.asked.end);
    planetary_finish(&p);
    for (int i = 0; i < 4; i++) {
        double *resumed = look(p.path, same[i], i == 3 ? 1 : 2, again);
        const size_t count = (size_t)(again[0] * (i == 3 ? 1 : again[1]));
        ck_assert_mem_eq(straight[i], resumed, sizeof *resumed * count);
        free(straight[i]);
        free(resumed);
    }
}

int main(void)
{
    return unit_run_after("planetary", set_up, tear_down);
}
