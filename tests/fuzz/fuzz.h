/* What the fuzz targets share: numbers drawn from the bytes of an input, files made of them, and
 * how a claim fails. A target is a function of bytes alone, so every find repeats. Bytes that have
 * run out read as zero, and choice 0 is always the plain one: short inputs are plain cases. */
#ifndef FUZZ_H
#define FUZZ_H

#include "millsim/vec3.h"

#include <math.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

/* Whoever replays one input by hand wants to see it: FUZZ_SHOW=1 prints what the bytes stand for.
 */
static inline bool fuzz_shown(void)
{
    return getenv("FUZZ_SHOW") != NULL;
}

static inline void fuzz_require(bool holds, const char *format, ...)
    __attribute__((format(printf, 2, 3)));

static inline void fuzz_require(bool holds, const char *format, ...)
{
    va_list list;
    if (holds)
        return;
    va_start(list, format);
    fputs("claim fails: ", stderr);
    vfprintf(stderr, format, list);
    fputc('\n', stderr);
    va_end(list);
    abort();
}

struct fuzz_bytes {
    const uint8_t *at;
    size_t left;
};

static inline uint8_t fuzz_byte(struct fuzz_bytes *b)
{
    if (b->left == 0)
        return 0;
    b->left--;
    return *b->at++;
}

static inline uint64_t fuzz_bits(struct fuzz_bytes *b, int bytes)
{
    uint64_t bits = 0;
    for (int i = 0; i < bytes; i++)
        bits = bits << 8 | fuzz_byte(b);
    return bits;
}

static inline int fuzz_choice(struct fuzz_bytes *b, int choices)
{
    return fuzz_byte(b) % choices;
}

/* in [lo, hi), three bytes */
static inline double fuzz_uniform(struct fuzz_bytes *b, double lo, double hi)
{
    return lo + (hi - lo) * ((double)fuzz_bits(b, 3) * 0x1p-24);
}

static inline double fuzz_log(struct fuzz_bytes *b, double lo, double hi)
{
    return lo * pow(hi / lo, fuzz_uniform(b, 0.0, 1.0));
}

static inline vec3 fuzz_direction(struct fuzz_bytes *b)
{
    static const vec3 axis[6] = {{1, 0, 0},  {0, 1, 0},  {0, 0, 1},
                                 {-1, 0, 0}, {0, -1, 0}, {0, 0, -1}};
    const int k = fuzz_choice(b, 12);
    if (k < 6)
        return axis[k];
    const double x = fuzz_uniform(b, -1.0, 1.0), a = fuzz_uniform(b, 0.0, 2.0 * MILL_PI);
    return vec3_make(x, sqrt(1.0 - x * x) * cos(a), sqrt(1.0 - x * x) * sin(a));
}

/* Any double that is finite: of the everyday, of any magnitude, or any bits at all */
static inline double fuzz_finite(struct fuzz_bytes *b)
{
    static const double some[8] = {0.0, 1.0, -1.0, 0.5, 1e-16, -1e-16, 1.0000000000000002, -0.0};
    uint64_t bits;
    double x;
    switch (fuzz_choice(b, 5)) {
    case 0:
        return some[fuzz_choice(b, 8)];
    case 1:
        return fuzz_choice(b, 256) / 16.0 - 8.0;
    case 2:
        x = fuzz_log(b, 1e-12, 1e12);
        return fuzz_choice(b, 2) ? -x : x;
    case 3:
        return fuzz_uniform(b, -1.0, 1.0);
    default:
        bits = fuzz_bits(b, 8);
        memcpy(&x, &bits, sizeof x);
        return isfinite(x) ? x : 0.0;
    }
}

/* A file that has no name but the path returned; each `file` of the target is made once. */
struct fuzz_file {
    FILE *file;
    char path[40];
};

static inline const char *fuzz_file_write(struct fuzz_file *f, const void *data, size_t size)
{
    if (!f->file) {
        f->file = tmpfile();
        fuzz_require(f->file != NULL, "no temporary file");
        snprintf(f->path, sizeof f->path, "/proc/self/fd/%d", fileno(f->file));
    }
    rewind(f->file);
    fuzz_require(ftruncate(fileno(f->file), 0) == 0, "the temporary file cannot be emptied");
    fuzz_require(fwrite(data, 1, size, f->file) == size && fflush(f->file) == 0,
                 "the temporary file cannot be written");
    return f->path;
}

/* An error must say something, on one line. */
static inline void fuzz_require_message(const char *text)
{
    fuzz_require(*text != '\0', "an error without words");
    for (const char *p = text; *p; p++)
        fuzz_require((unsigned char)*p >= 32 && *p != 127, "control character in '%s'", text);
}

#endif
