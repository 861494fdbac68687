/* Packs the states of loop and observers behind one head, with a checksum (FNV-1a, 64 bits, over
 * words of 8 bytes) against damaged files, and the program's version, because the bytes are good
 * for the same program only. */
#include "checkpoint.h"

#include <stdlib.h>
#include <string.h>

#ifndef MILL_VERSION
#define MILL_VERSION "unknown"
#endif

#define PATH "/checkpoint"

static const char magic[8] = {'M', 'I', 'L', 'L', 'C', 'K', 'P', '1'};

static uint64_t add_to(uint64_t sum, const unsigned char *bytes, size_t size)
{
    uint64_t word;
    size_t at = 0;
    for (; at + sizeof word <= size; at += sizeof word) {
        memcpy(&word, bytes + at, sizeof word);
        sum = (sum ^ word) * UINT64_C(1099511628211);
        sum ^= sum >> 32; /* words, not bytes: the high bits must reach the low ones */
    }
    for (; at < size; at++)
        sum = (sum ^ bytes[at]) * UINT64_C(1099511628211);
    return sum;
}

/* Of head and body, the head's own field counted as 0. */
static uint64_t checksum_of(const unsigned char *state, size_t size)
{
    struct mill_checkpoint head = mill_checkpoint_head(state);
    head.checksum = 0;
    const uint64_t sum =
        add_to(UINT64_C(14695981039346656037), (const unsigned char *)&head, sizeof head);
    return add_to(sum, state + sizeof head, size - sizeof head);
}

unsigned char *mill_checkpoint_take(const struct mill_checkpoint_parts *parts,
                                    const struct mill_record_cost *cost)
{
    struct mill_checkpoint head;
    memset(&head, 0, sizeof head); /* its padding too */
    memcpy(head.magic, magic, sizeof magic);
    strncpy(head.version, MILL_VERSION, sizeof head.version - 1);
    head.sim = mill_sim_state_size(parts->sim);
    head.tally = mill_tally_state_size(parts->tally);
    head.size = sizeof head + head.sim + head.tally;
    head.cost = *cost;
    mill_frames_save(parts->frames, &head.frames);
    mill_series_save(parts->series, &head.series);
    if (parts->log)
        mill_impactlog_save(parts->log, &head.log);
    unsigned char *state = malloc((size_t)head.size);
    if (!state)
        return NULL;
    mill_sim_save(parts->sim, state + sizeof head);
    mill_tally_save(parts->tally, state + sizeof head + head.sim);
    memcpy(state, &head, sizeof head);
    head.checksum = checksum_of(state, (size_t)head.size);
    memcpy(state, &head, sizeof head);
    return state;
}

struct mill_checkpoint mill_checkpoint_head(const unsigned char *state)
{
    struct mill_checkpoint head;
    memcpy(&head, state, sizeof head);
    return head;
}

enum mill_status mill_checkpoint_write(const unsigned char *state, struct mill_h5 *file,
                                       struct mill_error *error)
{
    const size_t size = (size_t)mill_checkpoint_head(state).size;
    return mill_h5_write(file, PATH, MILL_H5_U8, 1, &size, state, "byte",
                         "state of an unfinished run: what millsim --resume goes on from", error);
}

enum mill_status mill_checkpoint_remove(struct mill_h5 *file, struct mill_error *error)
{
    return mill_h5_remove(file, PATH, error);
}

static enum mill_status check(const unsigned char *state, size_t size, const char *name,
                              struct mill_error *error)
{
    struct mill_checkpoint head;
    if (size < sizeof head || memcmp(state, magic, sizeof magic) != 0)
        return mill_error_set(
            error, MILL_FAILED,
            "%s: its checkpoint is none of this program; start again with --force", name);
    head = mill_checkpoint_head(state);
    head.version[sizeof head.version - 1] = '\0';
    if (strcmp(head.version, MILL_VERSION) != 0)
        return mill_error_set(
            error, MILL_FAILED,
            "%s: its checkpoint was written by millsim %s, and this is %s; resume "
            "it with that one, or start again with --force",
            name, head.version, MILL_VERSION);
    const uint64_t body = size - sizeof head;
    if (head.size != size || head.sim > body || head.tally != body - head.sim ||
        head.checksum != checksum_of(state, size))
        return mill_error_set(error, MILL_FAILED,
                              "%s: its checkpoint is damaged; start again with --force", name);
    return MILL_OK;
}

enum mill_status mill_checkpoint_read(struct mill_h5 *file, const char *name, unsigned char **state,
                                      struct mill_error *error)
{
    size_t size;
    *state = NULL;
    if (!mill_h5_exists(file, PATH))
        return MILL_OK;
    enum mill_status status = mill_h5_read_bytes(file, PATH, state, &size, error);
    if (status == MILL_OK)
        status = check(*state, size, name, error);
    if (status != MILL_OK) {
        free(*state);
        *state = NULL;
    }
    return status;
}

enum mill_status mill_checkpoint_load_sim(const unsigned char *state, struct mill_sim *sim,
                                          struct mill_error *error)
{
    const struct mill_checkpoint head = mill_checkpoint_head(state);
    return mill_sim_load(sim, state + sizeof head, (size_t)head.sim, error);
}

enum mill_status mill_checkpoint_load_tally(const unsigned char *state, struct mill_tally *tally,
                                            struct mill_error *error)
{
    const struct mill_checkpoint head = mill_checkpoint_head(state);
    return mill_tally_load(tally, state + sizeof head + head.sim, (size_t)head.tally, error);
}
