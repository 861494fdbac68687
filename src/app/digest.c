/* The deck gives mill, balls and motions; the stream on standard input states, impacts, works and
 * losses, as records (docs/file-format.md). The observers process both as in a run. */
#include "app/run.h"
#include "app/samples.h"
#include "observe/replay.h"

#include <errno.h>
#include <inttypes.h>
#include <poll.h>
#include <string.h>
#include <unistd.h>

#define PATIENCE 250 /* [ms] between two checks of *stop */
enum { TYPE = 8 };   /* bytes of a record's type */

static const char magic[] = "millsim stream 1\n";

/* From file descriptor 0. Numbers are little-endian, as on this machine. */
struct stream {
    uint64_t records;    /* number of records begun */
    char type[TYPE + 1]; /* of the present record; "": end of the stream */
    uint64_t length;     /* [bytes] length of the present record's contents */
    char *bytes;         /* the contents, followed by a 0 */
};

struct digest {
    struct mill_run_order *order;
    const char *output; /* path */
    struct mill_error *error;
    struct mill_observe observe;
    struct mill_world *world;
    struct mill_observers observers;
    struct mill_replay replay;
    struct mill_samples samples;
    struct mill_facts_list facts;
    struct stream stream;
    struct mill_h5 *file;  /* NULL: not made yet */
    struct mill_error why; /* what is wrong with the present record */
    bool begun;            /* the record `begin` has been read */
    const char *ended;     /* how the run ended, from the stream; NULL: not yet */
};

/* ---- the stream ---- */

/* Describes what is wrong with the present record: "standard input: record 3 (state): WHY" */
static enum mill_status refuse(struct digest *d, enum mill_status status, const char *why)
{
    return mill_error_set(d->error, status == MILL_FAILED && !d->file ? MILL_BAD_DECK : status,
                          "standard input: record %" PRIu64 " (%s): %s", d->stream.records,
                          d->stream.type, why);
}

/* Reads bytes, and looks for a signal while there are none. *got < count: the stream has ended */
static enum mill_status fill(struct digest *d, char *to, size_t count, size_t *got)
{
    const volatile sig_atomic_t *stop = d->order->stop;
    struct pollfd input = {STDIN_FILENO, POLLIN, 0};
    ssize_t length = 1;
    *got = 0;
    while (*got < count && length != 0) {
        while (!*stop && poll(&input, 1, PATIENCE) <= 0)
            ;
        if (*stop)
            return mill_error_set(d->error, MILL_STOPPED, "stopped by signal %d", (int)*stop);
        length = read(STDIN_FILENO, to + *got, count - *got);
        if (length < 0 && errno != EINTR)
            return mill_error_set(d->error, MILL_FAILED, "standard input: cannot read: %s",
                                  strerror(errno));
        *got += length > 0 ? (size_t)length : 0;
    }
    return MILL_OK;
}

/* Reads the first line. */
static enum mill_status begin_stream(struct digest *d)
{
    char line[sizeof magic] = "";
    size_t got;
    const enum mill_status status = fill(d, line, sizeof magic - 1, &got);
    if (status != MILL_OK || strcmp(line, magic) == 0)
        return status;
    return mill_error_set(d->error, MILL_BAD_DECK, "standard input: is not a stream of a run: %s",
                          "expected the line 'millsim stream 1' first (docs/file-format.md)");
}

static enum mill_status tell_cut(struct digest *d)
{
    return mill_error_set(d->error, MILL_FAILED,
                          "standard input: is cut off in record %" PRIu64 ": expected more bytes",
                          d->stream.records);
}

/* Reads type and length of the next record. */
static enum mill_status next_record(struct digest *d)
{
    struct stream *s = &d->stream;
    char head[TYPE + sizeof s->length];
    size_t got;
    memset(s->type, 0, sizeof s->type);
    s->length = 0;
    const enum mill_status status = fill(d, head, sizeof head, &got);
    if (status != MILL_OK || got == 0)
        return status;
    s->records++;
    if (got < sizeof head)
        return tell_cut(d);
    for (int i = 0; i < TYPE && head[i] != ' '; i++)
        s->type[i] = head[i] > ' ' && head[i] < 127 ? head[i] : '?';
    memcpy(&s->length, head + TYPE, sizeof s->length);
    if (!s->type[0])
        s->type[0] = '?';
    return MILL_OK;
}

static enum mill_status read_record(struct digest *d)
{
    struct stream *s = &d->stream;
    size_t got;
    char *bytes = realloc(s->bytes, s->length + 1);
    if (!bytes)
        return mill_error_set(d->error, MILL_FAILED,
                              "standard input: record %" PRIu64 " (%s): out of memory", s->records,
                              s->type);
    s->bytes = bytes;
    const enum mill_status status = fill(d, s->bytes, s->length, &got);
    if (status != MILL_OK)
        return status;
    s->bytes[got] = '\0';
    return got < s->length ? tell_cut(d) : MILL_OK;
}

/* ---- the mill ---- */

/* Checks that the stream is of this mill. */
static enum mill_status begin(struct digest *d)
{
    const struct mill_world *w = d->world;
    const uint64_t own[3] = {(uint64_t)w->balls, (uint64_t)w->kinds.count, (uint64_t)w->motions};
    static const char *const what[3] = {"balls", "kinds of contact", "motions"};
    struct {
        uint64_t count[3];
        double apart;
        uint64_t springs;
    } told;
    memcpy(&told, d->stream.bytes, sizeof told);
    for (int i = 0; i < 3; i++)
        if (told.count[i] != own[i])
            return mill_error_set(&d->why, MILL_BAD_DECK,
                                  "it is of a mill with %" PRIu64 " %s, and the deck has %" PRIu64,
                                  told.count[i], what[i], own[i]);
    if (!(told.apart >= 0) || isinf(told.apart) || told.springs > 1)
        return mill_error_set(&d->why, MILL_BAD_DECK,
                              "expected a time of 0 s or more, and 0 or 1 for springs");
    d->observe.springs = told.springs != 0;
    mill_replay_init(&d->replay, d->world, &d->observers, told.apart, d->observe.end);
    d->begun = true;
    return MILL_OK;
}

/* ---- the file ---- */

/* Makes the observers and the file when there is something to write. */
static enum mill_status open_output(struct digest *d)
{
    static const char *const of[] = {MILL_FACTS_PART, "energy lost in the impact, its normal part"};
    const bool force = d->order->asked->given[MILL_FORCE] != NULL;
    if (mill_facts_check(&d->facts, &d->why) != MILL_OK)
        return refuse(d, MILL_BAD_DECK, d->why.text);
    enum mill_status status = mill_observers_create(&d->observe, d->world, &d->observers, d->error);
    if (status != MILL_OK)
        return status;
    *d->order->begun = 1;
    status = mill_h5_create(d->output, force ? MILL_H5_OVERWRITE : MILL_H5_NEW, &d->file, d->error);
    if (status != MILL_OK)
        return status;
    mill_record_deck(d->file, d->order->deck);
    status = mill_observers_open(&d->observers, &d->observe, d->file, d->world, NULL, d->error);
    for (int k = 0; d->observe.log_impacts && k < 2; k++)
        mill_h5_attribute(d->file, "/impacts/dissipation", k ? "description" : "part", MILL_H5_TEXT,
                          0, &of[k]);
    return status == MILL_OK ? mill_h5_status(d->file, d->error) : status;
}

static void write_results(const struct digest *d, const char *status)
{
    const double local = d->replay.now - d->world->base;
    const struct mill_facts facts = {.status = status,
                                     .time = d->replay.now,
                                     .local = local,
                                     .totals = mill_record_add(d->world, local),
                                     .foreign = &d->facts};
    for (int k = 0; k < 2; k++) {
        const char *text = mill_facts_text(&d->facts, k ? "version" : "program");
        mill_h5_attribute(d->file, "/h5md/creator", k ? "version" : "name", MILL_H5_TEXT, 0, &text);
    }
    mill_run_write(d->file, &d->observers, d->world, &facts);
}

/* ---- records: their functions say in d->why what is wrong with one ---- */

static enum mill_status take_end(struct digest *d)
{
    static const char *const known[] = {"complete", "stopped", "failed"};
    const char *told = d->stream.bytes + sizeof(double);
    double time;
    memcpy(&time, d->stream.bytes, sizeof time);
    for (size_t i = 0; i < sizeof known / sizeof *known && !d->ended; i++)
        d->ended = strcmp(told, known[i]) == 0 ? known[i] : NULL;
    if (!d->ended)
        return mill_error_set(&d->why, MILL_FAILED, "expected complete, stopped or failed");
    if (d->replay.accounts == 0 && d->ended == known[0])
        return mill_error_set(&d->why, MILL_FAILED, "expected an account before");
    return mill_replay_end(&d->replay, time, &d->why);
}

enum type { BEGIN, FACT, STATE, IMPACTS, ACCOUNT, PUBLISH, END, SPRINGS, SAMPLE, PART, ASK, NONE };

/* Does what the record says. Faults of the record are in d->why. */
static enum mill_status take(struct digest *d, enum type what)
{
    const void *bytes = d->stream.bytes;
    const double *values = bytes;
    switch (what) {
    case BEGIN:
        return begin(d);
    case FACT:
        return mill_facts_take(&d->facts, d->stream.bytes, d->stream.length, &d->why);
    case STATE:
        return mill_replay_state(&d->replay, values[0], values + 1, &d->why);
    case IMPACTS:
        return mill_replay_impacts(&d->replay, d->stream.length / sizeof(struct mill_replay_impact),
                                   bytes, &d->why);
    case ACCOUNT:
        return mill_replay_account(&d->replay, bytes, &d->why);
    case SPRINGS:
        return mill_samples_springs(&d->samples, d->world, values, &d->why);
    case SAMPLE:
        return mill_samples_take(&d->samples, &d->replay, values, &d->why);
    case PART:
        return mill_samples_part(&d->samples, &d->why);
    case ASK:
        return mill_samples_answer(&d->samples, stdout, &d->why);
    case PUBLISH:
        write_results(d, "running");
        return mill_h5_flush(d->file, &d->why);
    default:
        return take_end(d);
    }
}

/* Reads the next record. *over: it was the last one. */
static enum mill_status take_record(struct digest *d, bool *over)
{
    const uint64_t f8 = sizeof(double), row = sizeof(struct mill_replay_impact);
    const struct mill_world *w = d->world;
    const struct {
        const char *type;
        uint64_t least, more, step; /* [byte] up to so many more, in steps */
    } known[] = {[BEGIN] = {"begin", 5 * f8, 0, 1},
                 [FACT] = {"fact", 6, (1 << 20) - 6, 1},
                 [STATE] = {"state", f8 * (1 + 9 * (uint64_t)w->balls), 0, 1},
                 [IMPACTS] = {"impacts", 0, row << 20, row},
                 [ACCOUNT] = {"account", f8 * mill_replay_length(w), 0, 1},
                 [PUBLISH] = {"publish", 0, 0, 1},
                 [END] = {"end", f8 + 6, 2, 1},
                 [SPRINGS] = {"springs", f8 * mill_samples_springs_length(w), 0, 1},
                 [SAMPLE] = {"sample", f8 * mill_samples_length(w), 0, 1},
                 [PART] = {"part", 0, 0, 1},
                 [ASK] = {"ask", 0, 0, 1}},
      *r = known;
    const struct stream *s = &d->stream;
    enum type what = BEGIN;
    enum mill_status status = next_record(d);
    if (status != MILL_OK)
        return status;
    if (!s->type[0])
        return mill_error_set(
            d->error, MILL_FAILED,
            "standard input: ends without the record 'end', after %" PRIu64 " records", s->records);
    while (what < NONE && strcmp(known[what].type, s->type) != 0)
        what++;
    if (what == NONE || (what == BEGIN) == d->begun)
        return refuse(d, MILL_FAILED,
                      what == NONE ? "unknown record"
                      : d->begun   ? "a second record of this type"
                                   : "expected the record 'begin' first");
    r += what;
    const uint64_t more = s->length - r->least; /* beyond r->more if there are too few */
    if (more > r->more || more % r->step != 0) {
        const char *rest = r->step > 1 ? " for each impact, 2^20 impacts at most" : " or some more";
        mill_error_set(&d->why, MILL_FAILED, "%" PRIu64 " bytes: expected %" PRIu64 "%s", s->length,
                       r->step > 1 ? r->step : r->least, r->more > 0 ? rest : "");
        return refuse(d, MILL_FAILED, d->why.text);
    }
    status = read_record(d);
    if (status == MILL_OK && !d->file && what > FACT)
        status = open_output(d);
    if (status != MILL_OK)
        return status;
    *over = what == END;
    status = take(d, what);
    if (d->file && mill_h5_status(d->file, d->error) != MILL_OK)
        return MILL_FAILED; /* a failure to write is of the file, all others are of the stream */
    return status == MILL_OK ? status : refuse(d, status, d->why.text);
}

/* ---- the end ---- */

/* Writes the file with everything that the stream has given, for any kind of end. */
static enum mill_status conclude(struct digest *d, enum mill_status status)
{
    const struct mill_error what = *d->error;
    const char *ended = status == MILL_OK        ? d->ended
                        : status == MILL_STOPPED ? "stopped"
                                                 : "failed";
    struct mill_h5 *file = d->file;
    if (!file || (status != MILL_OK && d->replay.accounts == 0)) {
        if (status == MILL_STOPPED)
            mill_error_set(d->error, status, "%s before there was anything to write", what.text);
        return status;
    }
    if (mill_h5_status(file, NULL) != MILL_OK)
        return MILL_FAILED;
    write_results(d, ended);
    mill_observers_finish(&d->observers, d->world, NULL);
    d->file = NULL;
    if (mill_h5_close(file, d->error) != MILL_OK)
        return MILL_FAILED;
    if (status != MILL_OK)
        mill_error_set(d->error, status, "%s; %s holds the run up to %.6g s", what.text, d->output,
                       d->replay.now);
    return status;
}

enum mill_status mill_digest(struct mill_run_order *order)
{
    struct digest d = {.order = order,
                       .output = order->asked->output,
                       .error = order->error,
                       .observe = order->deck->observe};
    bool over = false;
    /* results cannot end such a run, and its window begins where the deck says */
    d.observe.sample_found = false;
    d.observe.starts = 1;
    d.observe.precision = d.observe.max_collisions = 0;
    enum mill_status status = mill_deck_setup_world(order->deck, &order->watch, &d.world, d.error);
    mill_progress_end(&order->display);
    if (status == MILL_OK)
        status = begin_stream(&d);
    while (status == MILL_OK && !over)
        status = take_record(&d, &over);
    if (status != MILL_BAD_DECK)
        status = conclude(&d, status);
    if (status == MILL_OK && !order->asked->given[MILL_QUIET])
        fprintf(order->page, "%s: %.6g s of %s %s, %s, %" PRIu64 " impacts\n", d.output,
                d.replay.now, mill_facts_text(&d.facts, "program"),
                mill_facts_text(&d.facts, "version"), d.ended,
                mill_record_add(d.world, d.replay.now - d.world->base).contacts);
    mill_h5_abandon(d.file); /* still open: the file stays as last published */
    mill_replay_free(&d.replay);
    mill_observers_free(&d.observers);
    mill_facts_free(&d.facts);
    mill_samples_free(&d.samples);
    free(d.stream.bytes);
    mill_world_free(d.world);
    return status;
}
