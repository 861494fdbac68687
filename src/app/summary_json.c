/* The summary for programs: one JSON object in SI units, with every number to full precision, and
 * null for NaN and infinity. docs/file-format.md explains the keys. */
#include "app/summary.h"

#include <assert.h>
#include <math.h>
#include <string.h>

struct json {
    struct mill_sink sink; /* first */
    FILE *out;
    bool first; /* true: the group has no member yet */
    int depth;  /* depth of indentation */
};

/* Length in bytes of the UTF-8 character that starts here; 0: invalid (names of files may contain
 * any bytes) */
static int character(const unsigned char *p)
{
    static const unsigned lowest[5] = {0, 0, 0x80, 0x800, 0x10000};
    const int bytes = *p < 0x80 ? 1 : *p >> 5 == 6 ? 2 : *p >> 4 == 14 ? 3 : *p >> 3 == 30 ? 4 : 0;
    if (bytes < 2)
        return bytes;
    unsigned code = *p & (0x7fu >> bytes);
    for (int i = 1; i < bytes; i++) {
        if (p[i] >> 6 != 2)
            return 0;
        code = code << 6 | (p[i] & 0x3fu);
    }
    /* 0x1b: surrogates */
    return code >= lowest[bytes] && code <= 0x10ffff && code >> 11 != 0x1b ? bytes : 0;
}

static void text_value(struct json *json, const char *text)
{
    const unsigned char *p = (const unsigned char *)text;
    fputc('"', json->out);
    while (*p) {
        const int bytes = character(p);
        if (bytes == 0)
            fprintf(json->out, "\\ufffd");
        else if (*p == '"' || *p == '\\')
            fprintf(json->out, "\\%c", *p);
        else if (*p < 32 || *p == 127)
            fprintf(json->out, "\\u%04x", (unsigned)*p);
        else
            fwrite(p, 1, (size_t)bytes, json->out);
        p += bytes ? bytes : 1;
    }
    fputc('"', json->out);
}

/* Starts the next member; name: NULL in an array. */
static void next(struct json *json, const char *name)
{
    fprintf(json->out, "%s\n%*s", json->first ? "" : ",", 2 * json->depth, "");
    json->first = false;
    if (name) {
        text_value(json, name);
        fprintf(json->out, ": ");
    }
}

static void open_group(struct mill_sink *sink, const char *name)
{
    struct json *json = (struct json *)sink;
    next(json, name);
    fputc('{', json->out);
    json->first = true;
    json->depth++;
}

static void close_group(struct mill_sink *sink)
{
    struct json *json = (struct json *)sink;
    json->depth--;
    json->first = false;
    fprintf(json->out, "\n%*s}", 2 * json->depth, "");
}

/* A summary contains only whole numbers, numbers and short rows of numbers. */
static void values(struct mill_sink *sink, const char *name, enum mill_h5_type type, int rank,
                   const size_t *dims, const void *values, const char *unit, const char *meaning)
{
    struct json *json = (struct json *)sink;
    (void)unit;
    (void)meaning;
    assert((type == MILL_H5_U64 || type == MILL_H5_F64) && rank <= 1);
    next(json, name);
    fputs(rank > 0 ? "[" : "", json->out);
    for (size_t i = 0; i < (rank > 0 ? dims[0] : 1); i++) {
        fputs(i > 0 ? ", " : "", json->out);
        if (type == MILL_H5_U64)
            fprintf(json->out, "%llu", (unsigned long long)((const uint64_t *)values)[i]);
        else if (isfinite(((const double *)values)[i]))
            fprintf(json->out, "%.17g", ((const double *)values)[i]);
        else
            fputs("null", json->out);
    }
    fputs(rank > 0 ? "]" : "", json->out);
}

static void text(struct mill_sink *sink, const char *name, const char *value, const char *meaning)
{
    struct json *json = (struct json *)sink;
    (void)meaning;
    next(json, name);
    text_value(json, value);
}

enum mill_status mill_summary_json(const struct mill_summary *s, struct mill_error *error)
{
    struct json json = {
        {false, open_group, close_group, values, text, NULL, NULL, NULL}, s->out, true, 1};
    struct mill_sink *sink = &json.sink;
    const struct mill_facts *facts = s->facts;
    fputc('{', s->out);
    text(sink, "version", facts->version, "");
    text(sink, "deck", facts->deck, "");
    text(sink, "output", facts->output, "");
    next(&json, "stopped");
    fputs(strcmp(facts->status, "stopped") == 0 ? "true" : "false", s->out);
    mill_tell_number(sink, "time", facts->time, "s", "");
    mill_tell_number(sink, "sample_from", s->results->begin, "s", "");
    open_group(sink, "run");
    mill_record_tell(s->world, facts, sink);
    mill_notes_tell(&s->notes, sink);
    close_group(sink);
    open_group(sink, "assumed");
    for (int kind = 0; s->deck && kind < s->deck->contacts.count; kind++)
        if (s->deck->assumed[kind][0])
            text(sink, s->deck->contacts.name[kind], s->deck->assumed[kind], "");
    close_group(sink);
    const enum mill_status status =
        mill_observers_results(s->observers, s->world, facts->local, sink, error);
    next(&json, "notes");
    fputc('[', s->out);
    json.first = true;
    json.depth++;
    for (const struct mill_note *n = s->notes.note; n < s->notes.note + s->notes.count; n++)
        if (n->text[0]) {
            next(&json, NULL);
            text_value(&json, n->text);
        }
    fputs("]\n}\n", s->out);
    return status;
}
