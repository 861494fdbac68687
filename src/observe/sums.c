/* Adding, clearing, saving and writing of all statistics, by the lists of their numbers. */
#include "observe/sums.h"

#include "base/memory.h"
#include "millsim/state.h"

#include <stdio.h>
#include <string.h>

bool mill_sums_make(struct mill_sums *sums, const struct mill_sums_list *list, size_t count)
{
    *sums = (struct mill_sums){list, count, mill_memory_get(count, list->size)};
    return sums->record;
}

void mill_sums_free(struct mill_sums *sums)
{
    free(sums->record);
    sums->record = NULL;
}

void mill_sums_clear(struct mill_sums *sums)
{
    memset(sums->record, 0, sums->count * sums->list->size);
}

static void add_row(enum mill_h5_type type, size_t n, size_t step, char *to, const char *more)
{
    if (type == MILL_H5_U64)
        for (size_t i = 0; i < n; i++, to += step, more += step)
            *(uint64_t *)(void *)to += *(const uint64_t *)(const void *)more;
    else
        for (size_t i = 0; i < n; i++, to += step, more += step)
            *(double *)(void *)to += *(const double *)(const void *)more;
}

void mill_sums_add_records(const struct mill_sums_list *list, size_t n, void *all, const void *from)
{
    for (const struct mill_sum *sum = list->sum; sum < list->sum + list->count; sum++) {
        char *to = (char *)all + sum->at;
        const char *more = (const char *)from + sum->at;
        for (size_t i = 0; i < n; i++, to += list->size, more += list->size)
            add_row(sum->type, sum->n > 0 ? sum->n : 1, sum->step, to, more);
    }
}

void mill_sums_add(struct mill_sums *into, const struct mill_sums *from)
{
    assert(into->list == from->list && into->count >= from->count);
    mill_sums_add_records(from->list, from->count, into->record, from->record);
}

void mill_sums_state(struct mill_sums *sums, const char *prefix, struct mill_state *state)
{
    char name[64];
    snprintf(name, sizeof name, "%s_%s", prefix, sums->list->name);
    mill_state_structs(state, name, sums->list->size, sums->count, sums->record);
}

void mill_sums_tell(const struct mill_sums *sums, int k, const struct mill_sums_view *view,
                    struct mill_sink *sink)
{
    static const char zero[sizeof(uint64_t)];
    const struct mill_sum *sum = &sums->list->sum[k];
    const size_t size = sum->type == MILL_H5_I32 ? sizeof(int32_t) : sizeof(uint64_t);
    const size_t n = view->n > 0 ? view->n : sum->n > 0 ? sum->n : 1;
    size_t dims[4] = {0}, records = 1;
    for (int i = 0; i < view->rank; records *= dims[i++])
        dims[i] = view->dims[i];
    dims[view->rank] = n;
    char *value = mill_sink_room(sink, records * n, size), *to = value;
    for (size_t i = 0; value && i < records; i++) {
        const int64_t which = view->which ? view->which[i] : (int64_t)i;
        const char *from = (const char *)sums->record + sum->at + view->first * sum->step;
        from += (size_t)(which < 0 ? 0 : which) * sums->list->size;
        for (size_t m = 0; m < n; m++, to += size)
            memcpy(to, which < 0 ? zero : from + m * sum->step, size);
    }
    if (value)
        sink->values(sink, sum->name, sum->type, view->rank + (sum->n > 0), dims, value, sum->unit,
                     sum->meaning);
    free(value);
}

void mill_sums_tell_all(const struct mill_sums *sums, struct mill_sink *sink)
{
    const struct mill_sums_view all = {.rank = 1, .dims = {sums->count}};
    for (int k = 0; k < sums->list->count; k++)
        mill_sums_tell(sums, k, &all, sink);
}
