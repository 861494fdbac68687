/* Reads the two kinds of STL files (3D Systems, StereoLithography Interface Specification, 1989).
 * Binary: 80 bytes of any content, the number of facets in 4 bytes, then 50 bytes a facet,
 * little-endian. ASCII: words with white space between them. Binary files may also begin with
 * "solid": a file is binary if its size agrees with its number of facets. */
#include "deck/stl.h"

#include "base/memory.h"
#include "deck/textfile.h"

#include <assert.h>
#include <ctype.h>
#include <float.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

enum {
    HEAD = 84,                     /* [B] of a binary file, before its facets */
    EACH = 50,                     /* [B] of a facet */
    LARGEST = 400 * MILL_STL_MOST, /* [B] of a file; an ASCII facet takes about 270 */
    LONG = 40                      /* number of characters of a wrong word that a message shows */
};

struct reading {
    const char *path;
    const char *bytes; /* [size], and a zero after them */
    size_t size;
    double unit;
    struct mill_error *error;
    enum mill_status status;
    const char *at, *end; /* of a text: the beginning, then after the last word; the end */
    /* state of reading an ASCII file: */
    const char *word; /* the last word and its length; length 0: the file has ended */
    size_t length;
    long line;
    struct mill_memory_list facet; /* the result: vec3[3] */
};

/* Notes what is wrong with the file. Returns false. */
static __attribute__((format(printf, 2, 3))) bool fault(struct reading *in, const char *format, ...)
{
    char what[400], line[32] = "";
    const size_t length = strlen(in->path), shown = 400;
    const char *path = in->path + (length > shown ? length - shown : 0);
    va_list list;
    va_start(list, format);
    vsnprintf(what, sizeof what, format, list);
    va_end(list);
    if (in->line > 0)
        snprintf(line, sizeof line, ":%ld", in->line);
    in->status = mill_error_set(in->error, MILL_BAD_DECK, "%s%s: %s", path, line, what);
    return false;
}

/* One more facet; NULL: the status says why there is none. */
static vec3 *next_facet(struct reading *in)
{
    const bool many = in->facet.count == MILL_STL_MOST;
    vec3 *corner = many ? NULL : mill_memory_add(&in->facet);
    if (many)
        fault(in, "more than %d facets: simplify the mesh", MILL_STL_MOST);
    else if (!corner)
        in->status = mill_error_set(in->error, MILL_FAILED, "out of memory for the facets of '%s'",
                                    in->path);
    return corner;
}

/* ---- binary ---- */

static uint32_t word_at(const char *at)
{
    const unsigned char *p = (const unsigned char *)at;
    return (uint32_t)p[0] | (uint32_t)p[1] << 8 | (uint32_t)p[2] << 16 | (uint32_t)p[3] << 24;
}

static double number_at(const char *at)
{
    const uint32_t bits = word_at(at);
    float x;
    memcpy(&x, &bits, sizeof x);
    return (double)x;
}

static bool is_binary(const struct reading *in)
{
    return in->size >= HEAD && in->size == HEAD + EACH * (size_t)word_at(in->bytes + HEAD - 4);
}

static void read_binary(struct reading *in)
{
    const size_t facets = (in->size - HEAD) / EACH;
    for (size_t k = 0; k < facets && in->status == MILL_OK; k++) {
        const char *p = in->bytes + HEAD + EACH * k + 12;
        vec3 *corner = next_facet(in);
        for (int i = 0; corner && i < 3; i++) {
            const vec3 at = {number_at(p + 12 * i), number_at(p + 12 * i + 4),
                             number_at(p + 12 * i + 8)};
            if (!isfinite(at.x + at.y + at.z))
                fault(in, "facet %zu has a corner that is not a number: export the file again",
                      k + 1);
            corner[i] = vec3_scale(at, in->unit);
        }
    }
}

/* ---- ASCII ---- */

static void next_word(struct reading *in)
{
    while (in->at < in->end && isspace((unsigned char)*in->at))
        in->line += *in->at++ == '\n';
    in->word = in->at;
    while (in->at < in->end && !isspace((unsigned char)*in->at))
        in->at++;
    in->length = (size_t)(in->at - in->word);
}

static bool is_word(const struct reading *in, const char *word)
{
    size_t k = 0;
    while (k < in->length && word[k] && tolower((unsigned char)in->word[k]) == word[k])
        k++;
    return k == in->length && !word[k];
}

static bool expected(struct reading *in, const char *what)
{
    if (in->length == 0)
        return fault(in, "the file ends where %s is expected: it is incomplete; export it again",
                     what);
    return fault(in, "expected %s, got '%.*s%s'", what, in->length > LONG ? LONG : (int)in->length,
                 in->word, in->length > LONG ? "..." : "");
}

/* strtod alone would also accept "0x1p3", "inf" and "nan", and would stop at a NUL. */
static bool take_number(const struct reading *in, double *value)
{
    char *end = NULL;
    bool good = in->length > 0;
    for (size_t k = 0; k < in->length; k++)
        good = good && in->word[k] && strchr("+-.0123456789eE", in->word[k]);
    const double read = good ? strtod(in->word, &end) : 0.0;
    *value = (double)(float)read;
    return good && end == in->at && fabs(read) <= (double)FLT_MAX;
}

/* Reads from after "facet" to "endfacet" */
static bool read_facet(struct reading *in)
{
    /* "#": a number; "*": a number of the normal, for which some programs write "nan" */
    static const char *const form[] = {"normal", "*", "*", "*",      "outer",   "loop",    "vertex",
                                       "#",      "#", "#", "vertex", "#",       "#",       "#",
                                       "vertex", "#", "#", "#",      "endloop", "endfacet"};
    vec3 *corner = next_facet(in);
    double value[9];
    int n = 0;
    for (size_t k = 0; corner && k < sizeof form / sizeof *form; k++) {
        char quoted[20];
        next_word(in);
        snprintf(quoted, sizeof quoted, "'%s'", form[k]);
        if (*form[k] == '#' ? !take_number(in, &value[n++])
                            : *form[k] != '*' && !is_word(in, form[k]))
            return expected(in, *form[k] == '#' ? "a number" : quoted);
    }
    for (int i = 0; corner && i < 3; i++)
        corner[i] =
            vec3_scale(vec3_make(value[3 * i], value[3 * i + 1], value[3 * i + 2]), in->unit);
    return corner != NULL;
}

/* Several solids in a file are one surface. */
static void read_ascii(struct reading *in)
{
    bool within = false, good = true;
    in->line = 1;
    for (next_word(in); good && (in->length > 0 || within); next_word(in)) {
        if (within && is_word(in, "facet")) {
            good = read_facet(in);
        } else if (is_word(in, within ? "endsolid" : "solid")) {
            within = !within;
            in->at += strcspn(in->at, "\r\n"); /* what follows may be a name */
        } else {
            good = expected(in, within ? "'facet' or 'endsolid'" : "'solid'");
        }
    }
}

/* ---- both ---- */

/* A text contains no zero byte. */
static bool is_text(const struct reading *in)
{
    const char *first = in->at;
    while (first < in->end && isspace((unsigned char)*first))
        first++;
    return in->end - first >= 5 && memchr("sS", *first, 2) &&
           !memchr(in->bytes, 0, in->size < 1000 ? in->size : 1000);
}

/* The formats that `mill mesh` reads, and how their files begin */
static const struct {
    const char *name, *begin;
} others[] = {{"an OBJ", "v "}, {"an OBJ", "vn "}, {"an OBJ", "vt "}, {"an OBJ", "mtllib "},
              {"an OBJ", "o "}, {"an OBJ", "g "},  {"a PLY", "ply"},  {"a 3MF", "PK\x03\x04"}};

/* The format that a file seems to have, if it is another one; comments come first in some. */
static const char *other_format(const struct reading *in)
{
    const char *at = in->at;
    while (at < in->end && (*at == '#' || isspace((unsigned char)*at)))
        at = *at == '#' ? at + strcspn(at, "\r\n") : at + 1;
    for (size_t k = 0; k < sizeof others / sizeof *others; k++)
        if (strncmp(at, others[k].begin, strlen(others[k].begin)) == 0)
            return others[k].name;
    return NULL;
}

static void read_bytes(struct reading *in)
{
    const bool binary = is_binary(in);
    const char *other = binary ? NULL : other_format(in);
    if (other)
        fault(in, "seems to be %s file, not STL: 'mill mesh %.200s -o OUT.stl' converts it", other,
              in->path);
    else if (binary)
        read_binary(in);
    else if (is_text(in))
        read_ascii(in);
    else if (in->size < HEAD)
        fault(in, "is not an STL file: it has %zu bytes, and does not begin with 'solid'",
              in->size);
    else
        fault(in,
              "is not a complete STL file: the %lu facets in its bytes 81 to 84 need %llu "
              "bytes, but it has %zu; export it again",
              (unsigned long)word_at(in->bytes + HEAD - 4),
              HEAD + EACH * (unsigned long long)word_at(in->bytes + HEAD - 4), in->size);
    in->line = 0;
    if (in->status == MILL_OK && in->facet.count == 0)
        fault(in, "has no facets");
}

enum mill_status mill_stl_read(const char *path, double unit, vec3 (**facet)[3], size_t *facets,
                               struct mill_error *error)
{
    assert(unit > 0.0);
    const char *wrong;
    struct reading in = {
        .path = path, .unit = unit, .error = error, .facet = {.size = sizeof **facet}};
    char *bytes = mill_textfile_read(path, LARGEST, &in.size, &wrong);
    if (bytes) {
        bytes[in.size] = '\0';
        in.bytes = bytes;
        in.at = bytes + mill_textfile_mark(bytes);
        in.end = bytes + in.size;
        read_bytes(&in);
    } else {
        fault(&in, wrong ? "%s" : "cannot be read: %s", wrong ? wrong : strerror(errno));
    }
    free(bytes);
    if (in.status != MILL_OK) {
        free(in.facet.item);
        in.facet = (struct mill_memory_list){.item = NULL};
    }
    *facet = in.facet.item;
    *facets = in.facet.count;
    return in.status;
}
