/* Writes what a reader needs to trust a run: the program, its counts and its anomalies (/run). Only
 * /run may differ between two runs of one deck: it alone holds times and names of the machine's
 * libraries. */
#include "app/record.h"

#include "base/version.h"

#include <gsl/gsl_version.h>
#include <stdio.h>
#include <sys/resource.h>
#include <time.h>

void mill_record_start(struct mill_h5 *file, const char *command)
{
    char hdf5[32], started[32] = "unknown";
    const time_t now = time(NULL);
    struct tm utc;
    mill_h5_version(hdf5, sizeof hdf5);
    if (gmtime_r(&now, &utc))
        strftime(started, sizeof started, "%Y-%m-%dT%H:%M:%SZ", &utc);
    const struct {
        const char *path, *text, *meaning;
    } table[] = {
        {"/run/version", mill_version, "version of millsim"},
        {"/run/compiler", mill_version_compiler, "compiler that built it"},
        {"/run/flags", mill_version_flags, "flags it was built with"},
        {"/run/hdf5", hdf5, "version of the HDF5 library"},
        {"/run/gsl", gsl_version, "version of the GNU Scientific Library"},
        {"/run/command", command, "command line"},
        {"/run/started", started, "when the run was started, UTC"},
        {"/run/status", "running",
         "complete, stopped (by a signal), failed, or running (if it is not, it was killed)"},
    };
    for (size_t i = 0; i < sizeof table / sizeof table[0]; i++)
        mill_h5_write_text(file, table[i].path, table[i].text, table[i].meaning);
}

static void write_counts(struct mill_h5 *file, const struct mill_counts *counts)
{
    const struct {
        const char *path;
        uint64_t value;
        const char *meaning;
    } table[] = {
        {"/run/events/cell_crossings", counts->cell_crossings, "balls changing their cell"},
        {"/run/events/stale", counts->stale,
         "events dropped: the partner had changed course, or a search is to go on"},
        {"/run/events/predictions", counts->predictions, "full predictions of a ball's next event"},
        {"/run/events/pair_tests", counts->pair_tests, "pairs of balls tested for a contact"},
        {"/run/events/quartics", counts->quartics.solves, "quartic equations solved"},
        {"/run/events/quartic_fallbacks", counts->quartics.fallbacks,
         "of these: the closed form was not trusted and a Sturm sequence took over"},
        {"/run/not_closing", counts->not_closing,
         "anomaly: a contact that was due found itself opening; the rebound floor was applied"},
        {"/run/reliefs", counts->reliefs,
         "anomaly: balls let go by the blades because they were pinched"},
        {"/run/smoothed", counts->smoothed,
         "anomaly: contacts made frictionless because time stood still at them"},
        {"/run/overlaps", counts->overlaps,
         "anomaly: balls found deeper than 1e-9 m in another body"},
    };
    for (size_t i = 0; i < sizeof table / sizeof table[0]; i++)
        mill_h5_write_count(file, table[i].path, table[i].value, table[i].meaning);
    mill_h5_write_double(file, "/run/largest_overlap", counts->largest_overlap, "m",
                         "largest overlap seen at a contact or an audit");
}

static void write_kinds(struct mill_h5 *file, const struct mill_account *account)
{
    char path[128];
    for (int kind = 0; kind < MILL_KINDS; kind++) {
        snprintf(path, sizeof path, "/run/events/collisions/%s", mill_kind_name[kind]);
        mill_h5_write_count(file, path, account->collisions[kind],
                            "impacts of this kind, from t = 0");
        snprintf(path, sizeof path, "/run/floored/%s", mill_kind_name[kind]);
        mill_h5_write_count(file, path, account->floored[kind],
                            "impacts of this kind, from t = 0, that left with no more than the "
                            "rebound floor");
    }
}

void mill_record_finish(struct mill_h5 *file, const struct mill_world *world,
                        const struct mill_record_end *end)
{
    double off, turnover;
    mill_world_balance(world, end->local_time, &off, &turnover);
    const struct {
        const char *path;
        double value;
        const char *unit, *meaning;
    } table[] = {
        {"/run/time", end->time, "s", "simulated time reached"},
        {"/run/energy_turnover", turnover, "J",
         "energy turned over: what the balance's error is measured against"},
        {"/run/energy_balance_error", turnover > 0 ? off / turnover : 0, "1",
         "|rotor work - change of energy - dissipation| over the energy turned over"},
        {"/run/wall_time", end->cost.wall, "s", "time on the wall's clock"},
        {"/run/cpu_time", end->cost.cpu, "s", "processor time"},
        {"/run/checkpoint_time", end->cost.saving, "s",
         "time on the wall's clock that checkpoints took"},
        {"/run/peak_memory", end->peak_memory, "byte", "largest resident memory"},
    };
    mill_h5_write_text(
        file, "/run/status", end->status,
        "complete, stopped (by a signal), failed, or running (if it is not, it was killed)");
    for (size_t i = 0; i < sizeof table / sizeof table[0]; i++)
        mill_h5_write_double(file, table[i].path, table[i].value, table[i].unit, table[i].meaning);
    if (end->ended_by)
        mill_h5_write_text(file, "/run/ended_by", end->ended_by,
                           "what ended the run: time (run.time), precision (run.precision), "
                           "max_collisions, or none as yet");
    mill_h5_write_count(file, "/run/checkpoints", end->cost.checkpoints, "checkpoints taken");
    write_kinds(file, &world->account);
    write_counts(file, &world->counts);
}

double mill_record_peak_memory(void)
{
    /* Linux hands ru_maxrss of the process before exec on, so ask for this program's own first */
    FILE *status = fopen("/proc/self/status", "r");
    char line[128];
    long kilobyte = 0;
    while (status && kilobyte == 0 && fgets(line, sizeof line, status))
        sscanf(line, "VmHWM: %ld", &kilobyte);
    if (status)
        fclose(status);
    if (kilobyte > 0)
        return 1024.0 * (double)kilobyte;
    struct rusage usage;
    return getrusage(RUSAGE_SELF, &usage) == 0 ? 1024.0 * (double)usage.ru_maxrss : 0;
}

double mill_record_cpu_time(void)
{
    struct timespec now;
    if (clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now) != 0)
        return 0;
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}
