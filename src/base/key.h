/* A key of a deck: what its value may be, what it means, and where it lives. The deck has tables of
 * keys, and so has every kind of shape that a deck can name; reading, checking, printing and
 * messages treat all of them alike. */
#ifndef MILL_KEY_H
#define MILL_KEY_H

#include <stdbool.h>
#include <stddef.h>

/* Bound of all numbers that have no closer one: products of several stay far from overflow. */
#define MILL_KEY_LARGEST 1e9

/* Ranges of a struct mill_key */
#define MILL_KEY_ANY .lo = -MILL_KEY_LARGEST, .hi = MILL_KEY_LARGEST
#define MILL_KEY_POSITIVE .lo = 0.0, .above = true, .hi = MILL_KEY_LARGEST
#define MILL_KEY_NOT_NEGATIVE .lo = 0.0, .hi = MILL_KEY_LARGEST

enum mill_key_type {
    MILL_KEY_NUMBER, /* double */
    MILL_KEY_VECTOR, /* vec3: three numbers and one unit */
    MILL_KEY_WHOLE,  /* long */
    MILL_KEY_CHOICE, /* int: which of some words, from 0 */
    MILL_KEY_FILE,   /* const char *, NULL for the word in `words` */
    MILL_KEY_NAME    /* const char * of something of the deck, NULL: it is not given */
};

/* A table of keys ends with one without a name. */
struct mill_key {
    const char *name, *meaning;
    enum mill_key_type type;
    const char *unit;    /* SI; NULL: dimensionless; "1": the same, and % is understood */
    double lo, hi;       /* range in SI, ends included unless `above` */
    bool above;          /* lo itself is out */
    bool zero_is_off;    /* and is not printed then */
    bool direction;      /* of a vector: not zero */
    bool one_for_all;    /* of a vector: one number stands for three */
    bool unit_alone;     /* "mm" says 1 mm */
    const char *preset;  /* default as text; NULL: required, or `derived` */
    bool derived;        /* its default follows from other keys */
    const char *instead; /* another key that says the same: one of the two is given */
    size_t offset;       /* of the value in the struct of its table */
    const char *words;   /* CHOICE: "first|second"; FILE: the word for "no file", or NULL */
    /* Asked with that struct; NULL: never. true: the key says nothing here, needs no value and is
     * not printed. */
    bool (*hidden)(const void *form);
    const char *needs; /* is told to whoever gives a hidden key; NULL: it may be given */
};

#endif
