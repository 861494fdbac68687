/* What a statistic adds up, described once: a list of its numbers, from which adding, clearing,
 * saving and writing follow. It knows only how an impact changes it, and what results from it. */
#ifndef MILL_SUMS_H
#define MILL_SUMS_H

#include "observe/sink.h"

struct mill_state;

/* A number of a record, or a row of n numbers that are `step` bytes apart */
struct mill_sum {
    const char *name, *unit, *meaning;
    enum mill_h5_type type; /* MILL_H5_F64 or MILL_H5_U64; also integers if it is only told */
    size_t at;              /* offset in the record */
    size_t n, step;         /* n = 0: a single number */
};

/* The description of a record, which consists of these numbers only */
struct mill_sums_list {
    const char *name; /* of its field in a checkpoint */
    size_t size;      /* [bytes] of a record */
    int count;
    const struct mill_sum *sum;
};

/* The state of a statistic: records for kinds of contact, for cells, for pairs, ... */
struct mill_sums {
    const struct mill_sums_list *list;
    size_t count;
    void *record; /* [count], aligned to a cache line */
};

/* Makes `count` records of zeros. false: out of memory. The caller frees them in both cases. */
bool mill_sums_make(struct mill_sums *sums, const struct mill_sums_list *list, size_t count);
void mill_sums_free(struct mill_sums *sums);
void mill_sums_clear(struct mill_sums *sums);

/* into += from, which has as many records or fewer: of two stretches of time, or of two runs */
void mill_sums_add(struct mill_sums *into, const struct mill_sums *from);

/* The same for n records of this list */
void mill_sums_add_records(const struct mill_sums_list *list, size_t n, void *to, const void *from);

/* Saves or loads the records as the field PREFIX_NAME. */
void mill_sums_state(struct mill_sums *sums, const char *prefix, struct mill_state *state);

/* Part of the records, as an array: `rank` dimensions of records, then numbers of each record */
struct mill_sums_view {
    int rank;
    size_t dims[3];
    const int32_t *which; /* [dims] numbers of the records, -1: zeros; NULL: all in their order */
    size_t first, n;      /* of the numbers of a row; n = 0: the whole row */
};

/* Writes number `k` of the list. Out of memory: the sink fails. */
void mill_sums_tell(const struct mill_sums *sums, int k, const struct mill_sums_view *view,
                    struct mill_sink *sink);

/* Writes all numbers of the list, each as an array over the records. */
void mill_sums_tell_all(const struct mill_sums *sums, struct mill_sink *sink);

#endif
