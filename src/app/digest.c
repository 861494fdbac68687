/* The deck gives the mill, the balls and the motions. The stream gives states, impacts, works and
 * losses. The observers process both as in a run. docs/file-format.md describes the stream. */
#include "app/digest.h"

#include "app/asked.h"
#include "app/facts.h"
#include "app/record.h"
#include "app/stream.h"
#include "observe/notes.h"
#include "observe/replay.h"

#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static const char part[] = "normal"; /* the known part of the loss in a single impact */

struct digest {
    struct mill_run_order *order;
    const char *output; /* path */
    struct mill_error *error;
    struct mill_observe observe;
    struct mill_world *world;
    struct mill_observers observers;
    struct mill_replay replay;
    struct mill_facts_list facts;
    struct mill_stream stream;
    struct mill_h5 *file; /* NULL: not made yet */
    bool begun;           /* the record `begin` has been read */
    const char *ended;    /* how the run ended, from the stream; NULL: not yet */
};

static enum mill_status refuse(struct digest *d, enum mill_status status, const char *why)
{
    struct mill_error what;
    mill_error_set(&what, status, "%s", why);
    return mill_stream_refuse(&d->stream,
                              status == MILL_FAILED && !d->file ? MILL_BAD_DECK : status, what.text,
                              d->error);
}

/* ---- the mill ---- */

/* Results cannot end such a run, and its window begins where the deck says. */
static enum mill_status build(struct digest *d)
{
    const struct mill_deck *deck = d->order->deck;
    const struct mill_start_watch watch = {mill_progress_stage, &d->order->display};
    enum mill_status status = mill_deck_setup_world(deck, &watch, &d->world, d->error);
    mill_progress_end(&d->order->display);
    if (status != MILL_OK)
        return status;
    d->observe = mill_asked_observe(deck, d->world);
    d->observe.sample_found = false;
    d->observe.precision = d->observe.max_collisions = 0;
    return MILL_OK;
}

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
    struct mill_error why;
    memcpy(&told, d->stream.bytes, sizeof told);
    for (int i = 0; i < 3; i++)
        if (told.count[i] != own[i]) {
            mill_error_set(&why, MILL_BAD_DECK,
                           "it is of a mill with %" PRIu64 " %s, and the deck has %" PRIu64,
                           told.count[i], what[i], own[i]);
            return refuse(d, MILL_BAD_DECK, why.text);
        }
    if (!(told.apart >= 0) || isinf(told.apart) || told.springs > 1)
        return refuse(d, MILL_BAD_DECK, "expected a time of 0 s or more, and 0 or 1 for springs");
    d->observe.elastic = told.springs ? &d->replay.elastic : NULL;
    if (mill_observers_create(&d->observe, d->world, &d->observers, d->error) != MILL_OK)
        return MILL_FAILED;
    mill_replay_init(&d->replay, d->world, &d->observers, told.apart, d->observe.end);
    d->begun = true;
    return MILL_OK;
}

/* ---- the file ---- */

/* Makes the file when there is something to write. */
static enum mill_status open_output(struct digest *d)
{
    const bool force = d->order->asked->given[MILL_FORCE] != NULL;
    struct mill_error why;
    const char *known = part;
    if (mill_facts_check(&d->facts, &why) != MILL_OK)
        return refuse(d, MILL_BAD_DECK, why.text);
    *d->order->begun = 1;
    const enum mill_status status =
        mill_h5_create(d->output, force ? MILL_H5_OVERWRITE : MILL_H5_NEW, &d->file, d->error);
    if (status != MILL_OK)
        return status;
    mill_record_deck(d->file, d->order->deck);
    for (int k = 0; k < d->observers.count; k++) {
        struct mill_observer *one = d->observers.each[k];
        if (one->type->open)
            one->type->open(one, &d->observe, d->file, d->world);
    }
    if (d->observe.log_impacts) {
        const char *meaning = "energy lost in the impact, its normal part";
        mill_h5_attribute(d->file, "/impacts/dissipation", "part", MILL_H5_TEXT, 0, &known);
        mill_h5_attribute(d->file, "/impacts/dissipation", "description", MILL_H5_TEXT, 0,
                          &meaning);
    }
    return mill_h5_status(d->file, d->error);
}

/* Writes the notes of the other program, then millsim's notes on the results. */
static void write_notes(const struct digest *d, const struct mill_notes *notes)
{
    const char *own = mill_facts_text(&d->facts, "notes");
    const size_t length = strlen(own);
    char *text = malloc(length + sizeof notes->note + 2), *end = text;
    if (!text) {
        mill_h5_spend(d->file, "out of memory for the notes");
        return;
    }
    end += sprintf(end, "%s%s", own, length > 0 && own[length - 1] != '\n' ? "\n" : "");
    for (const struct mill_note *n = notes->note; n < notes->note + notes->count; n++)
        if (n->text[0])
            end += sprintf(end, "%s\n", n->text);
    mill_h5_write_text(d->file, "/run/notes", text,
                       "remarks on the validity of the results, one per line");
    free(text);
}

static void write_results(struct digest *d, const char *status)
{
    const char *const creator[2] = {mill_facts_text(&d->facts, "program"),
                                    mill_facts_text(&d->facts, "version")};
    const double now = d->replay.now, local = now - d->world->base;
    struct mill_tally_results *results;
    struct mill_notes notes;
    struct mill_sink_file to;
    struct mill_error error;
    mill_h5_attribute(d->file, "/h5md/creator", "name", MILL_H5_TEXT, 0, &creator[0]);
    mill_h5_attribute(d->file, "/h5md/creator", "version", MILL_H5_TEXT, 0, &creator[1]);
    mill_sink_file(&to, d->file, "");
    to.sink.part = part;
    if (mill_observers_results(&d->observers, d->world, local, &to.sink, &error) != MILL_OK)
        mill_h5_spend(d->file, error.text);
    mill_sink_file(&to, d->file, "/run");
    mill_record_foreign(d->world, status, now, &to.sink);
    mill_facts_write(&d->facts, d->file, "notes");
    if (mill_tally_results_make(mill_observers_tally(&d->observers), d->world, local, &results,
                                &error) != MILL_OK) {
        mill_h5_spend(d->file, error.text);
        return;
    }
    mill_notes_foreign(&notes, d->world, results, local, strcmp(status, "stopped") == 0);
    write_notes(d, &notes);
    mill_tally_results_free(results);
}

/* ---- the stream ---- */

static enum mill_status take_fact(struct digest *d)
{
    struct mill_error why;
    const enum mill_status status =
        mill_facts_take(&d->facts, d->stream.bytes, d->stream.length, &why);
    return status == MILL_OK ? status : refuse(d, status, why.text);
}

/* A failure to write is reported for the file, all other failures for the stream. */
static enum mill_status after(struct digest *d, enum mill_status status, const char *why)
{
    if (mill_h5_status(d->file, d->error) != MILL_OK)
        return MILL_FAILED;
    return status == MILL_OK ? status : refuse(d, status, why);
}

static enum mill_status take_state(struct digest *d)
{
    const double *values = (const void *)d->stream.bytes;
    struct mill_error why;
    return after(d, mill_replay_state(&d->replay, values[0], values + 1, &why), why.text);
}

static enum mill_status take_impacts(struct digest *d)
{
    const size_t count = d->stream.length / sizeof(struct mill_replay_impact);
    struct mill_error why;
    return after(d, mill_replay_impacts(&d->replay, count, (const void *)d->stream.bytes, &why),
                 why.text);
}

static enum mill_status take_account(struct digest *d)
{
    const double *from = (const void *)d->stream.bytes;
    const int motions = d->world->motions, kinds = d->world->kinds.count;
    struct mill_replay_account account = {.time = from[0], .elastic = from[1]};
    struct mill_error why;
    for (int i = 0; i < 2 * (motions + kinds) + 2; i++)
        if (isinf(from[i]))
            return refuse(d, MILL_FAILED, "expected finite numbers, or NaN for what is not known");
    from += 2;
    for (int k = 0; k < motions; k++, from += 2) {
        account.motion[k].work = from[0];
        account.motion[k].impulse = from[1];
    }
    for (int k = 0; k < kinds; k++, from += 2) {
        account.loss[k].all = from[0];
        account.loss[k].normal = from[1];
    }
    return after(d, mill_replay_account(&d->replay, &account, &why), why.text);
}

static enum mill_status publish(struct digest *d)
{
    write_results(d, "running");
    return mill_h5_flush(d->file, d->error);
}

static enum mill_status take_end(struct digest *d)
{
    static const char *const known[] = {"complete", "stopped", "failed"};
    const char *told = d->stream.bytes + sizeof(double);
    double time;
    struct mill_error why;
    memcpy(&time, d->stream.bytes, sizeof time);
    for (size_t i = 0; i < sizeof known / sizeof *known && !d->ended; i++)
        d->ended = strcmp(told, known[i]) == 0 ? known[i] : NULL;
    if (!d->ended)
        return refuse(d, MILL_FAILED, "expected complete, stopped or failed");
    return after(d, mill_replay_end(&d->replay, time, &why), why.text);
}

/* Type of a record, its function, and its length in bytes: minimum, step, maximum */
struct record {
    const char *type;
    enum mill_status (*take)(struct digest *);
    uint64_t least, step, most;
};

/* Reads the next record. *over: it was the last one. */
static enum mill_status take_record(struct digest *d, bool *over)
{
    const uint64_t f8 = sizeof(double), row = sizeof(struct mill_replay_impact);
    const uint64_t state = f8 * (1 + 9 * (uint64_t)d->world->balls);
    const uint64_t account = f8 * 2 * (uint64_t)(1 + d->world->motions + d->world->kinds.count);
    const struct record known[] = {{"begin", begin, 5 * f8, 1, 5 * f8},
                                   {"fact", take_fact, 6, 1, 1 << 20},
                                   {"state", take_state, state, 1, state},
                                   {"impacts", take_impacts, 0, row, row << 20},
                                   {"account", take_account, account, 1, account},
                                   {"publish", publish, 0, 1, 0},
                                   {"end", take_end, f8 + 6, 1, f8 + 8}};
    const struct record *r = known, *none = known + sizeof known / sizeof *known;
    const struct mill_stream *s = &d->stream;
    struct mill_error why;
    enum mill_status status = mill_stream_next(&d->stream, d->error);
    if (status != MILL_OK)
        return status;
    if (!s->type[0])
        return mill_error_set(
            d->error, MILL_FAILED,
            "standard input: ends without the record 'end', after %" PRIu64 " records", s->records);
    while (r < none && strcmp(r->type, s->type) != 0)
        r++;
    if (r == none || (r == known) == d->begun)
        return refuse(d, MILL_FAILED,
                      r == none  ? "unknown record"
                      : d->begun ? "a second record of this type"
                                 : "expected the record 'begin' first");
    if (s->length < r->least || s->length > r->most || (s->length - r->least) % r->step != 0) {
        mill_error_set(&why, MILL_FAILED, "%" PRIu64 " bytes: expected %" PRIu64 "%s", s->length,
                       r->step > 1 ? r->step : r->least,
                       r->step > 1          ? " for each impact, 2^20 impacts at most"
                       : r->most > r->least ? " or some more"
                                            : "");
        return refuse(d, MILL_FAILED, why.text);
    }
    status = mill_stream_take(&d->stream, d->error);
    if (status == MILL_OK && !d->file && r->take != begin && r->take != take_fact)
        status = open_output(d);
    *over = r->take == take_end;
    return status == MILL_OK ? r->take(d) : status;
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
            mill_error_set(d->error, status,
                           "stopped by signal %d before there was anything to write",
                           (int)*d->order->stop);
        return status;
    }
    if (mill_h5_status(file, NULL) != MILL_OK)
        return MILL_FAILED;
    write_results(d, ended);
    mill_observers_finish(&d->observers, d->world, NULL);
    d->file = NULL;
    if (mill_h5_close(file, d->error) != MILL_OK)
        return MILL_FAILED;
    if (status == MILL_STOPPED)
        return mill_error_set(d->error, status,
                              "stopped by signal %d; %s holds the run up to %.6g s",
                              (int)*d->order->stop, d->output, d->replay.now);
    if (status != MILL_OK)
        mill_error_set(d->error, status, "%s; %s holds the run up to %.6g s", what.text, d->output,
                       d->replay.now);
    return status;
}

static void tell(const struct digest *d)
{
    uint64_t impacts = 0;
    for (int k = 0; k < d->world->kinds.count; k++)
        impacts += d->world->account.collisions[k];
    fprintf(d->order->page, "%s: %.6g s of %s %s, %s, %" PRIu64 " impacts\n", d->output,
            d->replay.now, mill_facts_text(&d->facts, "program"),
            mill_facts_text(&d->facts, "version"), d->ended, impacts);
}

enum mill_status mill_digest(struct mill_run_order *order)
{
    struct digest d = {order, order->asked->output, order->error, .stream.stop = order->stop};
    bool over = false;
    enum mill_status status = build(&d);
    if (status == MILL_OK)
        status = mill_stream_begin(&d.stream, d.error);
    while (status == MILL_OK && !over)
        status = take_record(&d, &over);
    if (status != MILL_BAD_DECK)
        status = conclude(&d, status);
    if (status == MILL_OK && !order->asked->given[MILL_QUIET])
        tell(&d);
    mill_h5_abandon(d.file); /* still open: the file stays as last published */
    mill_replay_free(&d.replay);
    mill_observers_free(&d.observers);
    mill_facts_free(&d.facts);
    mill_stream_free(&d.stream);
    mill_world_free(d.world);
    return status;
}
