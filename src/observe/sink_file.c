/* Writes results to an HDF5 file; each is a dataset. The file records its first failure and ignores
 * all later calls, so no call is checked here. */
#include "observe/sink.h"

#include <assert.h>
#include <stdio.h>
#include <string.h>

/* Returns "GROUP/NAME" and stores it as the last result */
static const char *place(struct mill_sink_file *f, const char *name)
{
    const int length = snprintf(f->last, sizeof f->last, "%s/%s", f->path, name);
    assert(length < (int)sizeof f->path);
    (void)length;
    return f->last;
}

static void open_group(struct mill_sink *sink, const char *name)
{
    struct mill_sink_file *f = (struct mill_sink_file *)sink;
    const bool outermost = strlen(f->path) == f->root;
    strcpy(f->path, place(f, name));
    if (outermost)
        mill_h5_remove(f->file, f->path);
}

static void close_group(struct mill_sink *sink)
{
    struct mill_sink_file *f = (struct mill_sink_file *)sink;
    assert(strlen(f->path) > f->root);
    *strrchr(f->path, '/') = '\0';
}

static void values(struct mill_sink *sink, const char *name, enum mill_h5_type type, int rank,
                   const size_t *dims, const void *values, const char *unit, const char *meaning)
{
    struct mill_sink_file *f = (struct mill_sink_file *)sink;
    mill_h5_write(f->file, place(f, name), type, rank, dims, values, unit, meaning);
}

static void again(struct mill_sink *sink, const char *name, size_t count, const double *values,
                  const char *unit, const char *meaning)
{
    struct mill_sink_file *f = (struct mill_sink_file *)sink;
    if (f->known == values) {
        mill_h5_link(f->file, f->once, place(f, name));
        return;
    }
    mill_tell_array(sink, name, count, values, unit, meaning);
    f->known = values;
    strcpy(f->once, f->last);
}

static void attribute(struct mill_sink *sink, const char *name, enum mill_h5_type type,
                      size_t count, const void *values)
{
    struct mill_sink_file *f = (struct mill_sink_file *)sink;
    if (!sink->failed) /* else the result that it belongs to may be missing */
        mill_h5_attribute(f->file, f->last, name, type, count, values);
}

void mill_sink_file(struct mill_sink_file *f, struct mill_h5 *file, const char *root)
{
    *f = (struct mill_sink_file){
        .sink = {true, NULL, open_group, close_group, values, again, attribute, NULL},
        .file = file,
        .root = strlen(root)};
    strcpy(f->path, root);
}
