/* The states of loop and observers behind one head, with a checksum (FNV-1a, 64 bits, over words of
 * 8 bytes) against damaged files, and the program's version, because the bytes are good for the
 * same program only. A state goes to the file from where it stands and comes back to there in
 * blocks: no run ever holds it twice. It is checked as a whole before any of it is believed, and
 * once more on its way back. */
#include "app/checkpoint.h"

#include "base/version.h"

#include <stdlib.h>
#include <string.h>

#define PATH "/checkpoint"

enum { BLOCK = 1 << 16 }; /* [byte] read at a time */

static const char magic[8] = {'M', 'I', 'L', 'L', 'C', 'K', 'P', '1'};

/* ---- the checksum ---- */

/* Of bytes that come in pieces of any length */
struct sum {
    uint64_t value;
    unsigned char rest[sizeof(uint64_t)]; /* of a word not complete yet */
    size_t rests;
};

static const struct sum no_bytes = {UINT64_C(14695981039346656037), {0}, 0};

static void add_word(struct sum *sum, const unsigned char *bytes)
{
    uint64_t word;
    memcpy(&word, bytes, sizeof word);
    sum->value = (sum->value ^ word) * UINT64_C(1099511628211);
    sum->value ^= sum->value >> 32; /* words, not bytes: the high bits must reach the low ones */
}

static void add(struct sum *sum, const unsigned char *bytes, size_t size)
{
    const size_t word = sizeof sum->rest;
    size_t at = 0;
    if (size == 0)
        return; /* a part may be empty and then have no address */
    if (sum->rests > 0) {
        at = word - sum->rests < size ? word - sum->rests : size;
        memcpy(sum->rest + sum->rests, bytes, at);
        sum->rests += at;
        if (sum->rests < word)
            return;
        add_word(sum, sum->rest);
    }
    for (; at + word <= size; at += word)
        add_word(sum, bytes + at);
    sum->rests = size - at;
    memcpy(sum->rest, bytes + at, sum->rests);
}

static uint64_t total(const struct sum *sum)
{
    uint64_t value = sum->value;
    for (size_t i = 0; i < sum->rests; i++)
        value = (value ^ sum->rest[i]) * UINT64_C(1099511628211);
    return value;
}

/* The head's own field counts as 0. */
static struct sum sum_of_head(const struct mill_checkpoint *head)
{
    struct sum sum = no_bytes;
    struct mill_checkpoint plain;
    memcpy(&plain, head, sizeof plain); /* its padding too */
    plain.checksum = 0;
    add(&sum, (const unsigned char *)&plain, sizeof plain);
    return sum;
}

/* ---- taking and writing ---- */

/* Adds the parts to the state, the first ones copied. NULL: out of memory. Owner: the state. */
static unsigned char *add_parts(struct mill_checkpoint_state *state, const struct mill_part *part,
                                size_t parts, size_t copied)
{
    const size_t bytes = mill_parts_size(part, copied);
    unsigned char *copy = malloc(bytes);
    if (!copy)
        return NULL;
    mill_parts_pack(part, copied, copy);
    state->part[state->parts++] = (struct mill_part){copy, bytes};
    for (size_t i = copied; i < parts; i++)
        state->part[state->parts++] = part[i];
    return copy;
}

enum mill_status mill_checkpoint_take(const struct mill_checkpoint_parts *parts,
                                      const struct mill_record_cost *cost,
                                      struct mill_checkpoint_state *state, struct mill_error *error)
{
    struct mill_checkpoint *head = &state->head;
    struct mill_part sim[MILL_SIM_PARTS], tally[MILL_TALLY_PARTS];
    size_t sim_values, tally_values;
    const size_t sims = mill_sim_parts(parts->sim, sim, &sim_values);
    const size_t tallies = mill_tally_parts(parts->tally, tally, &tally_values);
    memset(state, 0, sizeof *state); /* its padding too */
    memcpy(head->magic, magic, sizeof magic);
    strncpy(head->version, mill_version, sizeof head->version - 1);
    head->sim = mill_parts_size(sim, sims);
    head->tally = mill_parts_size(tally, tallies);
    head->size = sizeof *head + head->sim + head->tally;
    head->cost = *cost;
    mill_frames_save(parts->frames, &head->frames);
    mill_series_save(parts->series, &head->series);
    if (parts->log)
        mill_impactlog_save(parts->log, &head->log);
    state->part[state->parts++] = (struct mill_part){head, sizeof *head};
    state->sim = add_parts(state, sim, sims, sim_values);
    state->tally = add_parts(state, tally, tallies, tally_values);
    if (!state->sim || !state->tally)
        return mill_error_set(error, MILL_FAILED, "out of memory for a checkpoint");
    return MILL_OK;
}

void mill_checkpoint_release(struct mill_checkpoint_state *state)
{
    free(state->sim);
    free(state->tally);
    memset(state, 0, sizeof *state);
}

void mill_checkpoint_write(struct mill_checkpoint_state *state, struct mill_h5 *file)
{
    struct sum sum = sum_of_head(&state->head);
    for (size_t i = 1; i < state->parts; i++)
        add(&sum, state->part[i].at, state->part[i].bytes);
    state->head.checksum = total(&sum);
    mill_h5_write_parts(file, PATH, state->part, state->parts,
                        "state of an unfinished run: what millsim --resume goes on from");
}

void mill_checkpoint_rewind(const struct mill_checkpoint_state *state, struct mill_tally *tally)
{
    mill_tally_rewind(tally, state->tally);
}

void mill_checkpoint_remove(struct mill_h5 *file)
{
    mill_h5_remove(file, PATH);
}

/* ---- reading ---- */

/* /checkpoint behind its head, summed up on its way */
struct reader {
    struct mill_source source; /* first */
    struct mill_h5 *file;
    size_t at;
    struct sum sum;
};

static enum mill_status read_file(struct mill_source *self, void *to, size_t bytes,
                                  struct mill_error *error)
{
    struct reader *reader = (struct reader *)self;
    const enum mill_status status =
        mill_h5_read_bytes(reader->file, PATH, reader->at, bytes, to, error);
    reader->at += bytes;
    if (status == MILL_OK)
        add(&reader->sum, to, bytes);
    return status;
}

static struct reader read_behind(const struct mill_checkpoint *head, struct mill_h5 *file)
{
    return (struct reader){
        {read_file, (size_t)head->size - sizeof *head}, file, sizeof *head, sum_of_head(head)};
}

static enum mill_status damaged(const char *name, struct mill_error *error)
{
    return mill_error_set(error, MILL_FAILED,
                          "%s: its checkpoint is damaged; start again with --force", name);
}

/* The head, and that it is one of this program. */
static enum mill_status read_head(struct mill_h5 *file, const char *name,
                                  struct mill_checkpoint *head, struct mill_error *error)
{
    size_t size;
    enum mill_status status = mill_h5_count_bytes(file, PATH, &size, error);
    memset(head, 0, sizeof *head);
    if (status == MILL_OK && size >= sizeof *head)
        status = mill_h5_read_bytes(file, PATH, 0, sizeof *head, head, error);
    if (status != MILL_OK)
        return status;
    if (memcmp(head->magic, magic, sizeof magic) != 0)
        return mill_error_set(
            error, MILL_FAILED,
            "%s: its checkpoint is none of this program; start again with --force", name);
    char version[sizeof head->version + 1] = "";
    memcpy(version, head->version, sizeof head->version);
    if (strcmp(version, mill_version) != 0)
        return mill_error_set(
            error, MILL_FAILED,
            "%s: its checkpoint was written by millsim %s, and this is %s; resume "
            "it with that one, or start again with --force",
            name, version, mill_version);
    const uint64_t body = size - sizeof *head;
    if (head->size != size || head->sim > body || head->tally != body - head->sim)
        return damaged(name, error);
    return MILL_OK;
}

static enum mill_status check_sum(const struct mill_checkpoint *head, struct mill_h5 *file,
                                  const char *name, struct mill_error *error)
{
    struct reader reader = read_behind(head, file);
    unsigned char *block = malloc(BLOCK);
    enum mill_status status = MILL_OK;
    if (!block)
        return mill_error_set(error, MILL_FAILED, "out of memory for a checkpoint");
    while (status == MILL_OK && reader.source.left > 0) {
        const size_t bytes = reader.source.left < BLOCK ? reader.source.left : BLOCK;
        status = mill_parts_read(&reader.source, block, bytes, error);
    }
    free(block);
    if (status == MILL_OK && total(&reader.sum) != head->checksum)
        return damaged(name, error);
    return status;
}

enum mill_status mill_checkpoint_read(struct mill_h5 *file, const char *name,
                                      struct mill_checkpoint *head, bool *found,
                                      struct mill_error *error)
{
    enum mill_status status = MILL_OK;
    if (mill_h5_exists(file, PATH))
        status = read_head(file, name, head, error);
    *found = status == MILL_OK && mill_h5_exists(file, PATH);
    return *found ? check_sum(head, file, name, error) : status;
}

enum mill_status mill_checkpoint_load(struct mill_h5 *file, const char *name,
                                      const struct mill_checkpoint *head, struct mill_sim *sim,
                                      struct mill_tally *tally, struct mill_error *error)
{
    struct mill_checkpoint now;
    enum mill_status status = read_head(file, name, &now, error);
    if (status == MILL_OK && memcmp(&now, head, sizeof now) != 0)
        status = mill_error_set(error, MILL_FAILED,
                                "%s: another run has written to it meanwhile; see whether it still "
                                "needs --resume",
                                name);
    if (status != MILL_OK)
        return status;
    struct reader reader = read_behind(head, file);
    reader.source.left = (size_t)head->sim;
    status = mill_sim_load(sim, &reader.source, error);
    reader.source.left = (size_t)head->tally;
    if (status == MILL_OK)
        status = mill_tally_load(tally, &reader.source, error);
    if (status == MILL_OK && total(&reader.sum) != head->checksum)
        status = damaged(name, error);
    return status;
}
