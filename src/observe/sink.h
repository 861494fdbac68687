/* Receivers of results: a file that keeps all of them, or a summary for programs. Results are
 * written once, group by group, each with its name, unit and meaning. */
#ifndef MILL_SINK_H
#define MILL_SINK_H

#include "store/h5.h"

#include <stdlib.h>

struct mill_sink {
    bool full;                                              /* also wants histograms and maps */
    const char *failed;                                     /* first failure; NULL: none */
    void (*open)(struct mill_sink *sink, const char *name); /* a group within the present one */
    void (*close)(struct mill_sink *sink);
    /* values: C order, dims[rank] (NULL at rank 0 = a scalar) */
    void (*values)(struct mill_sink *sink, const char *name, enum mill_h5_type type, int rank,
                   const size_t *dims, const void *values, const char *unit, const char *meaning);
    /* For the same `values` in many groups: they are stored only once. NULL if not `full`. */
    void (*again)(struct mill_sink *sink, const char *name, size_t count, const double *values,
                  const char *unit, const char *meaning);
    /* Attribute of the result written last; count 0: a scalar. NULL if not `full`. */
    void (*attribute)(struct mill_sink *sink, const char *name, enum mill_h5_type type,
                      size_t count, const void *values);
    /* For another program's run: the part of the loss that is known of each single impact,
     * "normal"; the account has all of it. NULL: all of it is known, as in millsim's own runs. */
    const char *part;
};

/* Writes to a file. The group `root` ("": the file itself) is the outermost one. Opening a group
 * replaces an older one of its name. The file reports failures. */
struct mill_sink_file {
    struct mill_sink sink; /* first */
    struct mill_h5 *file;
    size_t root;         /* length of the path of the outermost group */
    char path[160];      /* of the present group */
    char last[192];      /* of the result written last */
    char once[192];      /* of the values given to `again`, */
    const double *known; /* and these values */
};

void mill_sink_file(struct mill_sink_file *sink, struct mill_h5 *file, const char *root);

/* Reports that results are missing. mill_observers_results() then fails. */
static inline void mill_sink_fail(struct mill_sink *sink, const char *why)
{
    sink->failed = sink->failed ? sink->failed : why;
}

/* Memory for `count` values. NULL: none, and the sink has failed. Owner: the caller; free() */
static inline void *mill_sink_room(struct mill_sink *sink, size_t count, size_t size)
{
    void *room = calloc(count + 1, size);
    if (!room)
        mill_sink_fail(sink, "out of memory for the results");
    return room;
}

static inline void mill_tell_number(struct mill_sink *sink, const char *name, double value,
                                    const char *unit, const char *meaning)
{
    sink->values(sink, name, MILL_H5_F64, 0, NULL, &value, unit, meaning);
}

static inline void mill_tell_text(struct mill_sink *sink, const char *name, const char *text,
                                  const char *meaning)
{
    sink->values(sink, name, MILL_H5_TEXT, 0, NULL, &text, "", meaning);
}

static inline void mill_tell_count(struct mill_sink *sink, const char *name, uint64_t value,
                                   const char *meaning)
{
    sink->values(sink, name, MILL_H5_U64, 0, NULL, &value, "1", meaning);
}

/* Marks the losses of single impacts that were written last with the known part of the loss. */
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
