#include "observe/sink_json.h"

#include <assert.h>
#include <math.h>

/* Bytes of the UTF-8 character that starts here; 0: invalid (names of files may be anything) */
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

void mill_sink_json_string(const struct mill_sink_json *json, const char *text)
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

void mill_sink_json_next(struct mill_sink_json *json, const char *name)
{
    fprintf(json->out, "%s\n%*s", json->first ? "" : ",", 2 * json->depth, "");
    json->first = false;
    if (name) {
        mill_sink_json_string(json, name);
        fprintf(json->out, ": ");
    }
}

static void open_group(struct mill_sink *sink, const char *name)
{
    struct mill_sink_json *json = (struct mill_sink_json *)sink;
    mill_sink_json_next(json, name);
    fputc('{', json->out);
    json->first = true;
    json->depth++;
}

static void close_group(struct mill_sink *sink)
{
    struct mill_sink_json *json = (struct mill_sink_json *)sink;
    json->depth--;
    json->first = false;
    fprintf(json->out, "\n%*s}", 2 * json->depth, "");
}

void mill_sink_json_open_array(struct mill_sink_json *json, const char *name)
{
    mill_sink_json_next(json, name);
    fputc('[', json->out);
    json->first = true;
    json->depth++;
}

void mill_sink_json_close_array(struct mill_sink_json *json)
{
    json->depth--;
    json->first = false;
    fputc(']', json->out);
}

static void put(const struct mill_sink_json *json, enum mill_h5_type type, const void *of, size_t i)
{
    if (type == MILL_H5_TEXT)
        mill_sink_json_string(json, ((const char *const *)of)[i]);
    else if (type == MILL_H5_U64)
        fprintf(json->out, "%llu", (unsigned long long)((const uint64_t *)of)[i]);
    else if (isfinite(((const double *)of)[i]))
        fprintf(json->out, "%.17g", ((const double *)of)[i]);
    else
        fputs("null", json->out);
}

/* A summary contains only texts, whole numbers and numbers, and short rows of them. */
static void values(struct mill_sink *sink, const char *name, enum mill_h5_type type, int rank,
                   const size_t *dims, const void *values, const char *unit, const char *meaning)
{
    struct mill_sink_json *json = (struct mill_sink_json *)sink;
    (void)unit;
    (void)meaning;
    assert((type == MILL_H5_TEXT || type == MILL_H5_U64 || type == MILL_H5_F64) && rank <= 1);
    if (rank == 0) {
        mill_sink_json_next(json, name);
        put(json, type, values, 0);
        return;
    }
    mill_sink_json_open_array(json, name);
    for (size_t i = 0; i < dims[0]; i++) {
        if (type == MILL_H5_TEXT)
            mill_sink_json_next(json, NULL);
        else
            fputs(i > 0 ? ", " : "", json->out);
        put(json, type, values, i);
    }
    mill_sink_json_close_array(json);
}

void mill_sink_json_begin(struct mill_sink_json *json, FILE *out)
{
    *json = (struct mill_sink_json){
        {false, NULL, open_group, close_group, values, NULL, NULL, NULL}, out, true, 1};
    fputc('{', out);
}

void mill_sink_json_end(struct mill_sink_json *json)
{
    fputs("\n}\n", json->out);
}
