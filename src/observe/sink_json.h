/* Results as JSON in SI units, every number to full precision, null for NaN and infinity */
#ifndef MILL_SINK_JSON_H
#define MILL_SINK_JSON_H

#include "observe/sink.h"

#include <stdio.h>

struct mill_sink_json {
    struct mill_sink sink; /* first */
    FILE *out;
    bool first; /* true: the group has no member yet */
    int depth;  /* of indentation */
};

/* Begins an object, into which the sink writes; ends it. The caller checks `out` for errors. */
void mill_sink_json_begin(struct mill_sink_json *json, FILE *out);
void mill_sink_json_end(struct mill_sink_json *json);

/* Begins the next member, whose value the caller then writes to `out`. name: NULL in an array */
void mill_sink_json_next(struct mill_sink_json *json, const char *name);

/* Writes a text in quotes. Bytes that are not UTF-8 become U+FFFD. */
void mill_sink_json_string(const struct mill_sink_json *json, const char *text);

/* Opens an array as the next member; closes it */
void mill_sink_json_open_array(struct mill_sink_json *json, const char *name);
void mill_sink_json_close_array(struct mill_sink_json *json);

#endif
