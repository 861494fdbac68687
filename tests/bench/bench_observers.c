/* What the observers cost: nanoseconds an impact for the tally (spectra, strikes and maps, as the
 * program has them) and for the log of all impacts, nanoseconds a ball for a snapshot of the maps.
 * The impacts are those of a mill: of a deck that is run for 50 ms, then recorded. They are played
 * back to back, everything in the cache ("replayed"), and beside the event loop, 64 at a time, with
 * the cache as the loop leaves it ("in the loop"); snapshots likewise with the cache warm, and
 * after a walk through 8 MiB. `bench_observers [--json FILE] [DECK]`; DECK: input/simoloyer.ini. */
#include "deck/deck.h"
#include "millsim/sim.h"
#include "observe/maps.h"
#include "observe/observers.h"
#include "observe/tally.h"
#include "store/h5.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

extern const struct mill_observing mill_impactlog_type;

enum { BATCH = 64, BATCHES = 2048, IMPACTS = BATCH * BATCHES };
enum { REPEATS = 7, SNAPSHOTS = 40, WALK = 8 << 20 };
enum { REPLAYED, IN_LOOP, LOG_STORED, LOG_WRITTEN, WARM, COLD, ROWS };

#define SETTLE 0.05 /* [s] the deck is run before anything is recorded */

static const char scratch[] = "bench_observers.h5";

static const struct {
    const char *name, *text, *unit;
} row[ROWS] = {
    {"tally_replayed", "tally, replayed", "ns per impact"},
    {"tally_in_loop", "tally, in the loop", "ns per impact"},
    {"log_stored", "log of impacts, into memory", "ns per impact"},
    {"log_written", "log of impacts, into the file", "ns per impact"},
    {"snapshot_warm", "snapshot, warm cache", "ns per ball"},
    {"snapshot_cold", "snapshot, cold cache", "ns per ball"},
};

/* An observer that keeps impacts, and then plays every BATCH of them on and notes the time. */
struct recorder {
    struct mill_observer observer;
    struct mill_observer *to; /* NULL: keep them */
    struct mill_impact impact[IMPACTS];
    size_t count;
    double taken[BATCHES]; /* [s] */
    size_t batches;
};

struct bench {
    struct mill_deck *deck;
    struct mill_world *world;
    struct mill_sim *sim;
    double cost[ROWS]; /* [ns] */
};

static double seconds(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void need(bool held, const char *what)
{
    if (held)
        return;
    fprintf(stderr, "bench_observers: %s\n", what);
    remove(scratch);
    exit(1);
}

static enum mill_status play(struct mill_observer *to, const struct mill_impact *impact, size_t n)
{
    enum mill_status status = MILL_OK;
    for (size_t i = 0; i < n && status == MILL_OK; i++)
        status = to->type->impact(to, &impact[i], NULL);
    return status;
}

static enum mill_status record(struct mill_observer *self, const struct mill_impact *impact,
                               struct mill_error *error)
{
    struct recorder *r = (struct recorder *)self;
    enum mill_status status = MILL_OK;
    (void)error;
    if (r->count < IMPACTS)
        r->impact[r->count++] = *impact;
    if (r->to && r->count == BATCH) {
        const double start = seconds();
        status = play(r->to, r->impact, BATCH);
        if (r->batches < BATCHES)
            r->taken[r->batches++] = seconds() - start;
        r->count = 0;
    }
    return status;
}

/* It samples from 0 on. */
static struct mill_observer *new_tally(const struct bench *b)
{
    const struct mill_observe asked = {.end = b->deck->observe.end,
                                       .strike_window = b->deck->observe.strike_window};
    struct mill_observer *tally = mill_observers_one(&mill_tally_type, &asked, b->world, NULL);
    need(tally != NULL, "out of memory");
    return tally;
}

static int ascending(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static void measure_in_loop(struct bench *b, struct recorder *r)
{
    struct mill_error error;
    struct mill_observer *tally = new_tally(b);
    r->count = 0;
    r->to = tally;
    while (r->batches < BATCHES)
        need(mill_sim_run(b->sim, 1e9, 10000, NULL, &error) == MILL_OK, error.text);
    qsort(r->taken, BATCHES, sizeof r->taken[0], ascending);
    b->cost[IN_LOOP] = 1e9 * r->taken[BATCHES / 2] / BATCH; /* the median: others run, too */
    r->to = NULL;
    mill_observers_free_one(tally);
}

static void measure_replayed(struct bench *b, const struct recorder *r)
{
    double best = INFINITY;
    for (int k = 0; k < REPEATS; k++) {
        struct mill_observer *tally = new_tally(b);
        const double start = seconds();
        need(play(tally, r->impact, IMPACTS) == MILL_OK, "an impact failed");
        best = fmin(best, seconds() - start);
        mill_observers_free_one(tally);
    }
    b->cost[REPLAYED] = 1e9 * best / IMPACTS;
}

/* Into memory: the lesser half of all batches, in which nothing is written to the file. */
static void measure_log(struct bench *b, struct recorder *r)
{
    struct mill_error error;
    struct mill_h5 *file;
    struct mill_observer *log;
    need(mill_h5_create(scratch, MILL_H5_OVERWRITE, &file, &error) == MILL_OK, error.text);
    const struct mill_observe asked = {.log_impacts = true};
    log = mill_observers_one(&mill_impactlog_type, &asked, b->world, &error);
    need(log != NULL, error.text);
    mill_observe_type(log)->open(log, &asked, file, b->world);
    const double begun = seconds();
    for (size_t i = 0; i < BATCHES; i++) {
        const double start = seconds();
        need(play(log, r->impact + i * BATCH, BATCH) == MILL_OK, "a write failed");
        r->taken[i] = seconds() - start;
    }
    need(mill_h5_flush(file, &error) == MILL_OK, error.text);
    need(mill_h5_status(file, &error) == MILL_OK, error.text);
    b->cost[LOG_WRITTEN] = 1e9 * (seconds() - begun) / IMPACTS;
    qsort(r->taken, BATCHES, sizeof r->taken[0], ascending);
    b->cost[LOG_STORED] = 1e9 * r->taken[BATCHES / 2] / BATCH;
    mill_observers_free_one(log);
    mill_h5_abandon(file);
    remove(scratch);
}

static void walk(void)
{
    static volatile unsigned char room[WALK];
    for (size_t i = 0; i < WALK; i += 64)
        room[i]++;
}

static void measure_snapshots(struct bench *b, int which)
{
    struct mill_maps maps;
    struct mill_sums flow;
    const double t = mill_sim_local_time(b->sim);
    double best = INFINITY;
    need(mill_maps_init(&maps, b->world), "out of memory");
    need(mill_sums_make(&flow, &mill_maps_flow, maps.cells), "out of memory");
    for (int k = 0; k < SNAPSHOTS; k++) {
        if (which == COLD)
            walk();
        const double start = seconds();
        mill_maps_sample(&maps, flow.record, b->world, t + 1e-6 * k, 1);
        best = fmin(best, seconds() - start);
    }
    b->cost[which] = 1e9 * best / b->world->balls;
    mill_sums_free(&flow);
    mill_maps_free(&maps);
}

static void start(struct bench *b, const char *path, struct recorder *r)
{
    static const struct mill_observer_type recorder = {.impact = record};
    static const char *const orders[] = {"run.sample_from=0 s"};
    struct mill_error error;
    need(mill_deck_read(path, 1, orders, NULL, NULL, NULL, &b->deck, &error) == MILL_OK,
         error.text);
    need(mill_deck_setup_world(b->deck, NULL, &b->world, &error) == MILL_OK, error.text);
    need(mill_sim_create(b->world, &b->sim, &error) == MILL_OK, error.text);
    need(mill_sim_run(b->sim, SETTLE, UINT64_MAX, NULL, &error) == MILL_OK, error.text);
    r->observer = (struct mill_observer){&recorder, INFINITY};
    need(mill_sim_observe(b->sim, &r->observer) == MILL_OK, "too many observers");
    while (r->count < IMPACTS)
        need(mill_sim_run(b->sim, 1e9, 10000, NULL, &error) == MILL_OK, error.text);
}

static int write_json(const char *path, const struct bench *b)
{
    FILE *file = fopen(path, "w");
    if (!file)
        return 1;
    fprintf(file, "{\"unit\": \"ns\", \"rows\": [");
    for (int i = 0; i < ROWS; i++)
        fprintf(file, "%s\n  {\"name\": \"%s\", \"per\": \"%s\", \"cost\": %.2f}", i ? "," : "",
                row[i].name, row[i].unit + 7, b->cost[i]);
    fprintf(file, "\n]}\n");
    return fclose(file) != 0;
}

int main(int argc, char **argv)
{
    const char *json = NULL, *deck = "input/simoloyer.ini";
    for (int i = 1; i < argc; i++) {
        if (strcmp(argv[i], "--json") == 0 && i + 1 < argc)
            json = argv[++i];
        else
            deck = argv[i];
    }
    struct bench b = {0};
    struct recorder *r = calloc(1, sizeof *r);
    need(r != NULL, "out of memory");
    start(&b, deck, r);
    measure_replayed(&b, r);
    measure_log(&b, r);
    measure_snapshots(&b, WARM);
    measure_snapshots(&b, COLD);
    measure_in_loop(&b, r);
    printf("%s\n", deck);
    for (int i = 0; i < ROWS; i++)
        printf("%-30s %7.1f %s\n", row[i].text, b.cost[i], row[i].unit);
    mill_sim_free(b.sim);
    mill_world_free(b.world);
    mill_deck_free(b.deck);
    free(r);
    return json ? write_json(json, &b) : 0;
}
