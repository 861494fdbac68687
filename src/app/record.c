/* Writes what a reader needs to trust a run: the program, its counts and its anomalies (/run). Only
 * /run may differ between two runs of one deck: it alone holds times and names of the machine's
 * libraries. */
#include "app/record.h"

#include "base/version.h"

#include <gsl/gsl_version.h>
#include <math.h>
#include <stdio.h>
#include <sys/resource.h>
#include <time.h>

static const char status_meaning[] =
    "complete, stopped (by a signal), failed, or running (if it is not, it was killed)";

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
        {"/run/status", "running", status_meaning},
    };
    for (size_t i = 0; i < sizeof table / sizeof table[0]; i++)
        mill_h5_write_text(file, table[i].path, table[i].text, table[i].meaning);
}

struct mill_totals mill_record_add(const struct mill_world *world, double local)
{
    const struct mill_counts *counts = &world->counts;
    struct mill_totals totals = {.energy = mill_world_energy(world, local)};
    for (int kind = 0; kind < MILL_KINDS; kind++) {
        totals.contacts += world->account.collisions[kind];
        totals.dissipation += world->account.dissipation[kind];
    }
    mill_world_balance(world, local, &totals.balance_error, &totals.turnover);
    totals.anomalies = counts->not_closing + counts->reliefs + counts->smoothed + counts->overlaps +
                       !isfinite(totals.balance_error);
    return totals;
}

static void tell_kinds(struct mill_sink *sink, const char *name, const uint64_t count[MILL_KINDS],
                       const char *meaning)
{
    sink->open(sink, name);
    for (int kind = 0; kind < MILL_KINDS; kind++)
        mill_tell_count(sink, mill_kind_name[kind], count[kind], meaning);
    sink->close(sink);
}

static void tell_energies(struct mill_sink *sink, const struct mill_world *world,
                          const struct mill_totals *totals)
{
    if (!sink->full) {
        mill_tell_number(sink, "kinetic_energy", totals->energy.kinetic, "J", "");
        mill_tell_number(sink, "rotational_energy", totals->energy.rotational, "J", "");
        mill_tell_number(sink, "potential_energy", totals->energy.potential, "J", "");
        mill_tell_number(sink, "rotor_work", world->account.rotor_work, "J", "");
        mill_tell_number(sink, "dissipation", totals->dissipation, "J", "");
    }
    mill_tell_number(sink, "energy_balance_error",
                     totals->turnover > 0 ? totals->balance_error / totals->turnover : 0, "1",
                     "|rotor work - change of energy - dissipation| over the energy turned over");
    mill_tell_number(sink, "energy_turnover", totals->turnover, "J",
                     "energy turned over: what the balance's error is measured against");
}

static void tell_anomalies(struct mill_sink *sink, const struct mill_counts *counts)
{
    mill_tell_count(
        sink, "not_closing", counts->not_closing,
        "anomaly: a contact that was due found itself opening; the rebound floor was applied");
    mill_tell_count(sink, "reliefs", counts->reliefs,
                    "anomaly: balls let go by the blades because they were pinched");
    mill_tell_count(sink, "smoothed", counts->smoothed,
                    "anomaly: contacts made frictionless because time stood still at them");
    mill_tell_count(sink, "overlaps", counts->overlaps,
                    "anomaly: balls found deeper than 1e-9 m in another body");
    mill_tell_number(sink, "largest_overlap", counts->largest_overlap, "m",
                     "largest overlap seen at a contact or an audit");
}

static void tell_events(struct mill_sink *sink, const struct mill_world *world)
{
    static const char collisions[] = "impacts of this kind, from t = 0";
    const struct mill_counts *counts = &world->counts;
    if (!sink->full) {
        tell_kinds(sink, "collisions", world->account.collisions, collisions);
        return;
    }
    sink->open(sink, "events");
    tell_kinds(sink, "collisions", world->account.collisions, collisions);
    mill_tell_count(sink, "cell_crossings", counts->cell_crossings, "balls changing their cell");
    mill_tell_count(sink, "stale", counts->stale,
                    "events dropped: the partner had changed course, or a search is to go on");
    mill_tell_count(sink, "predictions", counts->predictions,
                    "full predictions of a ball's next event");
    mill_tell_count(sink, "pair_tests", counts->pair_tests, "pairs of balls tested for a contact");
    mill_tell_count(sink, "quartics", counts->quartics.solves, "quartic equations solved");
    mill_tell_count(sink, "quartic_fallbacks", counts->quartics.fallbacks,
                    "of these: the closed form was not trusted and a Sturm sequence took over");
    sink->close(sink);
}

static void tell_cost(struct mill_sink *sink, const struct mill_facts *facts, uint64_t contacts)
{
    const struct mill_record_cost *cost = &facts->cost;
    mill_tell_number(sink, "wall_time", cost->wall, "s", "time on the wall's clock");
    mill_tell_number(sink, "cpu_time", cost->cpu, "s", "processor time");
    mill_tell_number(sink, "peak_memory", facts->peak_memory, "byte", "largest resident memory");
    if (sink->full) {
        mill_tell_number(sink, "checkpoint_time", cost->saving, "s",
                         "time on the wall's clock that checkpoints took");
        mill_tell_count(sink, "checkpoints", cost->checkpoints, "checkpoints taken");
    } else {
        mill_tell_number(sink, "contacts_per_cpu_second",
                         cost->cpu > 0 ? (double)contacts / cost->cpu : (double)NAN, "s-1", "");
        mill_tell_number(sink, "simulated_per_wall_second",
                         cost->wall > 0 ? facts->time / cost->wall : (double)NAN, "1", "");
    }
}

void mill_record_tell(const struct mill_world *world, const struct mill_facts *facts,
                      struct mill_sink *sink)
{
    const struct mill_totals totals = mill_record_add(world, facts->local);
    if (sink->full) {
        sink->text(sink, "status", facts->status, status_meaning);
        mill_tell_number(sink, "time", facts->time, "s", "simulated time reached");
    }
    if (facts->ended_by)
        sink->text(sink, "ended_by", facts->ended_by,
                   "what ended the run: time (run.time), precision (run.precision), "
                   "max_collisions, or none as yet");
    tell_events(sink, world);
    tell_kinds(sink, "floored", world->account.floored,
               "impacts of this kind, from t = 0, that left with no more than the rebound floor");
    tell_energies(sink, world, &totals);
    tell_anomalies(sink, &world->counts);
    tell_cost(sink, facts, totals.contacts);
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
