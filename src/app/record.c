/* What a reader needs to trust a run: the program, its counts and its anomalies (/run); and to
 * repeat it: the deck (/deck), by entry and as a text that is itself a deck, and the start. Only
 * /run may differ between two runs of one deck: by times and names of the machine's libraries. */
#include "app/record.h"

#include "observe/kinds.h"
#include "store/draft.h"
#include "store/version.h"

#include <errno.h>
#include <gsl/gsl_version.h>
#include <inttypes.h>
#include <string.h>
#include <sys/resource.h>
#include <unistd.h>

#define DIGEST "/deck/digest"

static const char status_meaning[] = "complete, stopped (by a signal), failed, running (or killed)";

struct mill_totals mill_record_add(const struct mill_world *world, double local)
{
    const struct mill_counts *counts = &world->counts;
    struct mill_totals totals = {.energy = mill_world_energy(world, local)};
    for (int kind = 0; kind < world->kinds.count; kind++) {
        totals.contacts += world->account.collisions[kind];
        totals.dissipation += world->account.dissipation[kind];
    }
    mill_world_balance(world, local, &totals.balance_error, &totals.turnover);
    totals.anomalies = counts->not_closing + counts->reliefs + counts->smoothed + counts->overlaps +
                       !isfinite(totals.balance_error);
    return totals;
}

static void tell_kinds(struct mill_sink *sink, const char *name, const struct mill_world *world,
                       const uint64_t *count, const char *meaning)
{
    const struct mill_listed kinds = mill_kinds_listed(world);
    sink->open(sink, name);
    for (int k = 0; k < kinds.count; k++)
        mill_tell_count(sink, kinds.name[k], count[kinds.kind[k]], meaning);
    sink->close(sink);
}

static void tell_balance(struct mill_sink *sink, const struct mill_world *world,
                         const struct mill_totals *totals)
{
    const struct mill_counts *c = &world->counts;
    const struct mill_account *a = &world->account;
    const double turnover = totals->turnover;
    if (!sink->full) { /* the file has these as series */
        mill_tell_number(sink, "kinetic_energy", totals->energy.kinetic, "J", "");
        mill_tell_number(sink, "rotational_energy", totals->energy.rotational, "J", "");
        mill_tell_number(sink, "potential_energy", totals->energy.potential, "J", "");
        if (world->rotor >= 0)
            mill_tell_number(sink, "rotor_work", a->motion[world->rotor].work, "J", "");
        mill_tell_number(sink, "drive_work", a->work, "J", "");
        sink->open(sink, "motion_work");
        for (int k = 0; k < world->motions; k++)
            mill_tell_number(sink, world->motion_name[k], a->motion[k].work, "J", "");
        sink->close(sink);
        mill_tell_number(sink, "dissipation", totals->dissipation, "J", "");
    }
    mill_tell_number(sink, "energy_balance_error",
                     turnover == 0 ? 0 : totals->balance_error / turnover, "1",
                     "|work of all motions - change of energy - dissipation| / energy turned over");
    mill_tell_number(sink, "energy_turnover", turnover, "J",
                     "energy turned over: what the balance's error is measured against");
    mill_tell_count(
        sink, "not_closing", c->not_closing,
        "anomaly: contacts whose bodies were already separating; the rebound floor was applied");
    mill_tell_number(sink, "pinch_work", a->pinch_work, "J",
                     "part of the work of all motions that was done on pressed balls");
    mill_tell_count(sink, "pinch_contacts", c->pinch_contacts,
                    "contacts of balls while they were pressed: parts of one long contact, not "
                    "counted as impacts");
    mill_tell_number(sink, "pinch_time", c->pinch_time, "s",
                     "sum of the times in which balls were pressed");
    mill_tell_count(sink, "bridges", c->bridges, "pairs of balls that gave way between surfaces");
    mill_tell_number(sink, "bridge_work", a->bridge_work, "J", "most work done on such pairs");
    mill_tell_count(
        sink, "reliefs", c->reliefs,
        "anomaly: pinched balls let go: contacts with what pinched them were ignored for a while");
    mill_tell_count(sink, "smoothed", c->smoothed,
                    "anomaly: contacts computed without friction, because there was no time "
                    "between them");
    mill_tell_count(sink, "overlaps", c->overlaps, "anomaly: balls deeper than 1e-9 m in a body");
    mill_tell_number(sink, "largest_overlap", c->largest_overlap, "m",
                     "largest overlap seen at a contact or a check");
}

static void tell_soft(struct mill_sink *sink, const struct mill_world *world)
{
    const struct mill_soft_facts *s = &world->soft_facts;
    sink->open(sink, "soft");
    mill_tell_number(sink, "time_step", s->step, "s", "time step");
    mill_tell_number(sink, "contact_duration", s->duration, "s", "of the shortest contact");
    mill_tell_number(sink, "speed", s->speed, "m s-1", "at which linear springs are like Hertz'");
    mill_tell_number(sink, "largest_force", s->force, "N", "greatest normal force");
    mill_tell_count(sink, "steps", s->steps, "time steps taken");
    mill_tell_count(sink, "contacts", s->contacts, "contacts begun, from t = 0");
    mill_tell_count(sink, "crowded", s->crowded, "of these: a ball had another one, too");
    mill_tell_number(sink, "elastic_energy", world->account.elastic, "J", "in springs, at the end");
    sink->close(sink);
}

/* foreign: the events of millsim's own search are those of no other program */
static void tell_events(struct mill_sink *sink, const struct mill_world *world, bool foreign)
{
    const struct mill_counts *c = &world->counts;
    if (sink->full)
        sink->open(sink, "events");
    tell_kinds(sink, "collisions", world, world->account.collisions,
               "impacts of this kind, from t = 0");
    if (sink->full && !foreign) {
        mill_tell_count(sink, "cell_crossings", c->cell_crossings, "balls changing their cell");
        mill_tell_count(
            sink, "stale", c->stale,
            "events dropped: the partner had changed its path, or a search had to be continued");
        mill_tell_count(sink, "predictions", c->predictions,
                        "full predictions of a ball's next event");
        mill_tell_count(sink, "pair_tests", c->pair_tests, "pairs of balls tested for a contact");
        mill_tell_count(sink, "quartics", c->quartics.solves, "quartic equations solved");
        mill_tell_count(sink, "quartic_fallbacks", c->quartics.fallbacks,
                        "of these: solved by a Sturm sequence, because rounding left the fast "
                        "search undecided");
    }
    if (sink->full)
        sink->close(sink);
}

static void tell_cost(struct mill_sink *sink, const struct mill_facts *facts)
{
    const struct mill_record_cost *cost = &facts->cost;
    const double contacts = (double)facts->totals.contacts;
    mill_tell_number(sink, "wall_time", cost->wall, "s", "wall-clock time");
    mill_tell_number(sink, "cpu_time", cost->cpu, "s", "processor time");
    mill_tell_count(sink, "threads", (uint64_t)facts->threads, "threads that the run used");
    mill_tell_number(sink, "peak_memory", facts->peak_memory, "byte", "largest resident memory");
    if (sink->full) {
        mill_tell_number(sink, "checkpoint_time", cost->saving, "s",
                         "wall-clock time that checkpoints took");
        mill_tell_count(sink, "checkpoints", cost->checkpoints, "checkpoints taken");
    } else {
        mill_tell_number(sink, "contacts_per_cpu_second",
                         cost->cpu > 0 ? contacts / cost->cpu : (double)NAN, "s-1", "");
        mill_tell_number(sink, "simulated_per_wall_second",
                         cost->wall > 0 ? facts->starts * facts->time / cost->wall : (double)NAN,
                         "1", "");
    }
}

void mill_record_tell(const struct mill_world *world, const struct mill_facts *facts,
                      struct mill_sink *sink)
{
    const double sleep = world->counts.sleep + (double)world->counts.asleep * facts->local;
    if (sink->full) {
        mill_tell_text(sink, "status", facts->status, status_meaning);
        mill_tell_number(sink, "time", facts->time, "s", "simulated time reached");
    }
    if (facts->ended_by)
        mill_tell_text(sink, "ended_by", facts->ended_by,
                       "what ended the run: time (run.time), precision (run.precision), "
                       "max_collisions, or none as yet");
    tell_events(sink, world, facts->foreign);
    if (facts->foreign) {
        char hdf5[32];
        mill_h5_version(hdf5, sizeof hdf5);
        mill_tell_text(sink, "hdf5", hdf5, "version of the HDF5 library");
        return;
    }
    mill_tell_number(sink, "rebound_floor", world->rebound_floor, "m s-1",
                     "minimum normal speed after any contact");
    tell_kinds(sink, "floored", world, world->account.floored,
               "impacts of this kind, from t = 0, that the rebound floor ended");
    tell_balance(sink, world, &facts->totals);
    if (world->soft.on)
        tell_soft(sink, world);
    if (sleep > 0) { /* balls fell asleep, which needs a bed at rest */
        mill_tell_count(sink, "asleep", (uint64_t)world->counts.asleep,
                        "balls at rest at the end, without events");
        mill_tell_number(sink, "sleep_time", sleep, "s",
                         "sum of the times for which balls were at rest, without events");
    }
    tell_cost(sink, facts);
}

double mill_record_peak_memory(void)
{
    /* on Linux, ru_maxrss includes the process before exec: first ask for our own peak */
    FILE *status = fopen("/proc/self/status", "r");
    struct rusage usage;
    char line[128];
    long kilobyte = 0;
    while (status && kilobyte == 0 && fgets(line, sizeof line, status))
        sscanf(line, "VmHWM: %ld", &kilobyte);
    if (status)
        fclose(status);
    if (kilobyte <= 0 && getrusage(RUSAGE_SELF, &usage) == 0)
        kilobyte = usage.ru_maxrss;
    return 1024.0 * (double)kilobyte;
}

double mill_record_clock(clockid_t clock)
{
    struct timespec now = {0};
    clock_gettime(clock, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

void mill_record_name(FILE *out, const char *name)
{
    for (; *name; name++)
        putc((unsigned char)*name < 32 || *name == 127 ? '?' : *name, out);
}

/* ---- the deck ---- */

static void write_entry(void *self, const char *section, const struct mill_key *key,
                        const char *value)
{
    char path[4 * MILL_NAME_LENGTH];
    char *name = path + strlen("/deck/");
    snprintf(path, sizeof path, "/deck/%s|%s", section, key->name);
    for (; *name; name++) /* a name from the deck must not be taken for a path */
        *name = *name == '/' ? '_' : *name;
    *strrchr(path, '|') = '/';
    mill_h5_write_text(self, path, value, key->meaning);
}

/* false: the deck names no table or mesh */
static bool print_digest(const struct mill_deck *deck, char text[20])
{
    const uint64_t digest = mill_deck_files_digest(deck);
    snprintf(text, 20, "%016" PRIx64, digest);
    return digest != 0;
}

void mill_record_deck(struct mill_h5 *file, const struct mill_deck *deck)
{
    char digest[20], *text = mill_deck_printed(deck, mill_deck_print);
    char *contour = mill_deck_printed(deck, mill_deck_lining_print);
    mill_h5_remove(file, "/deck");
    mill_deck_each(deck, write_entry, file);
    if (text)
        mill_h5_write_text(file, "/deck/text", text,
                           "the deck as run, with all defaults; itself a deck");
    else
        mill_h5_spend(file, "out of memory for the deck's text");
    if (contour && *contour)
        mill_h5_write_text(file, "/deck/contour", contour,
                           "contours of drum and bodies: a row 'x y bulge' for each corner");
    free(text);
    free(contour);
    if (print_digest(deck, digest))
        mill_h5_write_text(file, DIGEST, digest, "changes with the tables and meshes of the deck");
}

void mill_record_start(struct mill_h5 *file, const struct mill_deck *deck, const char *command)
{
    char hdf5[32], started[32] = "unknown";
    const time_t now = time(NULL);
    struct tm utc;
    mill_h5_version(hdf5, sizeof hdf5);
    if (gmtime_r(&now, &utc))
        strftime(started, sizeof started, "%Y-%m-%dT%H:%M:%SZ", &utc);
    mill_record_deck(file, deck);
    mill_h5_write_text(file, "/run/version", mill_version, "version of millsim");
    mill_h5_write_text(file, "/run/compiler", mill_version_compiler, "compiler that built it");
    mill_h5_write_text(file, "/run/flags", mill_version_flags, "flags it was built with");
    mill_h5_write_text(file, "/run/hdf5", hdf5, "version of the HDF5 library");
    mill_h5_write_text(file, "/run/gsl", gsl_version, "version of the GNU Scientific Library");
    mill_h5_write_text(file, "/run/command", command, "command line");
    mill_h5_write_text(file, "/run/started", started, "when the run was started, UTC");
    mill_h5_write_text(file, "/run/status", "running", status_meaning);
    for (int kind = 0; kind < deck->mill.contacts.count; kind++) {
        char path[MILL_KINDS_LENGTH + 16];
        snprintf(path, sizeof path, "/run/assumed/%s", deck->mill.contacts.name[kind]);
        if (deck->mill.contact[kind].assumed[0])
            mill_h5_write_text(file, path, deck->mill.contact[kind].assumed,
                               "materials from which this contact law follows");
    }
}

/* A printed deck that is being compared */
struct lines {
    char *rest;
    bool skips; /* the lines of this section do not change the run */
};

/* The next line that matters for the comparison, without its comment. Skips empty lines, the
 * interval of checkpoints, the number of threads, [powder] and [heat] and the values of [wear],
 * which do not change the run. Of a file only its name is left. "" at the end. */
static const char *next_line(struct lines *text)
{
    while (*text->rest) {
        char *line = text->rest, *end = line + strcspn(line, "\n"), *comment, *path;
        text->rest = end + (*end == '\n');
        *end = '\0';
        if ((comment = strstr(line, " #")))
            *(end = comment) = '\0';
        while (end > line && end[-1] == ' ')
            *--end = '\0';
        if ((path = strstr(line, " = /")))
            memmove(path + strlen(" = "), strrchr(line, '/') + 1, strlen(strrchr(line, '/')));
        const bool wear = strncmp(line, "[wear", 5) == 0;
        if (*line == '[')
            text->skips = wear || strcmp(line, "[powder]") == 0 || strcmp(line, "[heat]") == 0;
        if (*line && *line != '#' && (!text->skips || wear) &&
            strncmp(line, "checkpoint = ", 13) != 0 && strncmp(line, "threads = ", 10) != 0)
            return line;
    }
    return "";
}

/* The tables and meshes may have changed under the same names. */
static enum mill_status compare_files(struct mill_h5 *file, const char *name,
                                      const struct mill_deck *deck, struct mill_error *error)
{
    char here[20], *there = NULL;
    if (!print_digest(deck, here) || !mill_h5_exists(file, DIGEST))
        return MILL_OK;
    enum mill_status status = mill_h5_read_text(file, DIGEST, &there, error);
    if (status == MILL_OK && strcmp(here, there) != 0)
        status = mill_error_set(error, MILL_BAD_DECK,
                                "%s: a table or mesh of its deck has changed since: put the old "
                                "one back to resume, or start again with --force",
                                name);
    free(there);
    return status;
}

enum mill_status mill_record_compare(struct mill_h5 *file, const char *name,
                                     const struct mill_deck *deck, struct mill_error *error)
{
    const char *was = "", *here = "", *section = "", *more = "nothing more";
    char *old = NULL, *new = mill_deck_printed(deck, mill_deck_print),
         *cut[2] = {NULL, new ? strdup(new) : NULL};
    struct mill_error w;
    enum mill_status status = mill_h5_read_text(file, "/deck/text", &old, NULL);
    if (status != MILL_OK)
        mill_error_set(error, status, "%s: is not an output file of millsim", name);
    else if (!cut[1] || !(cut[0] = strdup(old)))
        status = mill_error_set(error, MILL_FAILED, "out of memory for the deck's text");
    struct lines from = {cut[0], false}, to = {cut[1], false};
    while (status == MILL_OK && (*from.rest || *to.rest) && strcmp(was, here) == 0) {
        was = next_line(&from);
        here = next_line(&to);
        section = *here == '[' || !*here ? here : section;
    }
    if (*was == '[' && !strstr(new, was))
        mill_error_set(&w, MILL_OK, "its deck has a section %s, and the given deck has none", was);
    else if (*here == '[' && !strstr(old, here))
        mill_error_set(&w, MILL_OK, "its deck has no section %s, and the given deck has one", here);
    else
        mill_error_set(&w, MILL_OK, "%s %s'%.400s' in the file, '%.400s' in the deck", section,
                       strcspn(was, "=") == strcspn(here, "=") ? "" : "has other keys: ",
                       *was ? was : more, *here ? here : more);
    if (strcmp(was, here) != 0)
        status = mill_error_set(error, MILL_BAD_DECK,
                                "%s: is of another deck: %s; resume it with its own deck, or start "
                                "again with --force",
                                name, w.text);
    free(old);
    free(new);
    free(cut[0]);
    free(cut[1]);
    return status == MILL_OK ? compare_files(file, name, deck, error) : status;
}

/* ---- the start ---- */

/* Returns 0 or an errno. 17 digits restore every double exactly, and the order of rows the numbers
 * of balls: a random start numbers them by place, a start file keeps its order. */
static int write_rows(const struct mill_world *world, const char *deck, FILE *out)
{
    bool spins = false;
    const vec3 none = {0.0, 0.0, 0.0};
    for (int32_t i = 0; i < world->balls && !spins; i++)
        spins = memcmp(&world->spin[i], &none, sizeof none) != 0; /* -0 counts */
    errno = 0;
    fprintf(out, "# x y z [m] vx vy vz [m/s]%s, one ball a line: start of ",
            spins ? " wx wy wz [rad/s]" : "");
    mill_record_name(out, deck);
    putc('\n', out);
    for (int32_t i = 0; i < world->balls && !ferror(out); i++) {
        const vec3 r = world->ball[i].r, v = world->ball[i].v, w = world->spin[i];
        fprintf(out, "%.17g %.17g %.17g %.17g %.17g %.17g", r.x, r.y, r.z, v.x, v.y, v.z);
        if (spins)
            fprintf(out, " %.17g %.17g %.17g", w.x, w.y, w.z);
        putc('\n', out);
    }
    if (fflush(out) == 0 && !ferror(out))
        return 0;
    return errno ? errno : EIO;
}

/* Writes into the open draft and publishes it. Returns 0 or an errno. */
static int write_draft(const struct mill_world *world, const char *deck, struct mill_draft *draft)
{
    const int fd = dup(draft->fd);
    FILE *out = fd < 0 ? NULL : fdopen(fd, "w");
    int failed = out ? write_rows(world, deck, out) : errno;
    if (out && fclose(out) != 0 && !failed)
        failed = errno;
    if (!out && fd >= 0)
        close(fd);
    return failed ? failed : mill_draft_publish(draft, true);
}

enum mill_status mill_record_export(const struct mill_world *world, const char *deck,
                                    const char *path, bool over, struct mill_error *error)
{
    struct mill_draft draft;
    enum mill_status status = MILL_OK;
    mill_draft_init(&draft, path, NULL);
    int failed = mill_draft_open(&draft, over ? MILL_DRAFT_FORCE : MILL_DRAFT_EMPTY);
    if (!failed && !over && access(path, F_OK) == 0)
        status =
            mill_error_set(error, MILL_BAD_DECK, "%s: exists already; --force overwrites it", path);
    else if (!failed)
        failed = write_draft(world, deck, &draft);
    if (failed)
        status = mill_draft_tell(&draft, path, "write", failed, error);
    mill_draft_end(&draft);
    return status;
}
