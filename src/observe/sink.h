/* Who is told results: a file that keeps all of them, or a summary for programs. They are told
 * once, group by group, each with its name, unit and meaning. */
#ifndef MILL_SINK_H
#define MILL_SINK_H

#include "store/h5.h"

#include <stdbool.h>

struct mill_sink {
    bool full; /* wants histograms and maps, too */
    /* A group within the present one, and back out of it */
    void (*open)(struct mill_sink *sink, const char *name);
    void (*close)(struct mill_sink *sink);
    /* values: C order, dims[rank] (NULL at rank 0 = a scalar) */
    void (*values)(struct mill_sink *sink, const char *name, enum mill_h5_type type, int rank,
                   const size_t *dims, const void *values, const char *unit, const char *meaning);
    void (*text)(struct mill_sink *sink, const char *name, const char *text, const char *meaning);
    /* The same `values` every time: they need be kept only once. NULL where not `full`. */
    void (*again)(struct mill_sink *sink, const char *name, size_t count, const double *values,
                  const char *unit, const char *meaning);
    /* Of what was told last; a scalar where count is 0. NULL where not `full`. */
    void (*attribute)(struct mill_sink *sink, const char *name, enum mill_h5_type type,
                      size_t count, const void *values);
    /* Of another program's run: which part of its loss is known of a single impact, "normal"; all
     * of it only stands in the account. NULL: all of it, and the run is millsim's. */
    const char *part;
};

/* Into the file, with the group `root` ("": the file itself) as the outermost one. What the file
 * had of a group opened there is replaced. A failure is the file's to tell. */
struct mill_sink_file {
    struct mill_sink sink; /* first */
    struct mill_h5 *file;
    size_t root;         /* length of the outermost group's path */
    char path[160];      /* of the present one, */
    char last[192];      /* of what was told last, */
    char once[192];      /* of what is told again and again, */
    const double *known; /* and its values */
};

void mill_sink_file(struct mill_sink_file *sink, struct mill_h5 *file, const char *root);

static inline void mill_tell_number(struct mill_sink *sink, const char *name, double value,
                                    const char *unit, const char *meaning)
{
    sink->values(sink, name, MILL_H5_F64, 0, NULL, &value, unit, meaning);
}

static inline void mill_tell_count(struct mill_sink *sink, const char *name, uint64_t value,
                                   const char *meaning)
{
    sink->values(sink, name, MILL_H5_U64, 0, NULL, &value, "1", meaning);
}

/* What was told last are losses of single impacts: how much of these is known. */
static inline void mill_tell_part(struct mill_sink *sink)
{
    if (sink->part)
        sink->attribute(sink, "part", MILL_H5_TEXT, 0, &sink->part);
}

static inline void mill_tell_array(struct mill_sink *sink, const char *name, size_t count,
                                   const double *values, const char *unit, const char *meaning)
{
    sink->values(sink, name, MILL_H5_F64, 1, &count, values, unit, meaning);
}

#endif
