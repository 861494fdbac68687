/* A key of a deck: range and meaning of its value, and its place in a struct. The deck and every
 * kind of shape that it can name have tables of keys: all are read, checked, printed alike. */
#ifndef MILL_KEY_H
#define MILL_KEY_H

#include <stdbool.h>
#include <stddef.h>

/* Bound of numbers without a closer one: products of several such numbers are far from overflow. */
#define MILL_KEY_LARGEST 1e9

/* Ranges of a struct mill_key */
#define MILL_KEY_ANY .lo = -MILL_KEY_LARGEST, .hi = MILL_KEY_LARGEST
#define MILL_KEY_POSITIVE .lo = 0.0, .above = true, .hi = MILL_KEY_LARGEST
#define MILL_KEY_NOT_NEGATIVE .lo = 0.0, .hi = MILL_KEY_LARGEST

enum mill_key_type {
    MILL_KEY_NUMBER, /* double */
    MILL_KEY_VECTOR, /* vec3: three numbers and one unit */
    MILL_KEY_WHOLE,  /* long */
    MILL_KEY_CHOICE, /* int: number of one of several words, from 0 */
    MILL_KEY_FILE,   /* const char *; NULL for the word in `words` */
    MILL_KEY_NAME    /* const char *: name of another part of the deck; NULL: not given */
};

/* A table of keys ends with a key without a name. */
struct mill_key {
    const char *name, *meaning;
    enum mill_key_type type;
    const char *unit;   /* SI; NULL: dimensionless; "1": dimensionless, and % is allowed */
    double lo, hi;      /* range in SI, with its ends; without lo if `above` */
    bool above;         /* lo itself is not allowed */
    bool zero_is_off;   /* 0 means off; the key is then not printed */
    bool direction;     /* of a vector: must not be zero */
    bool one_for_all;   /* of a vector: one number can be given for all three */
    bool unit_alone;    /* "mm" means 1 mm */
    const char *preset; /* default as text; NULL: required, or `derived` */
    bool derived;       /* its default follows from other keys */
    const char *unless; /* it is not required where this key of its section is given */
    /* The key that this one stands for. Of all keys that stand for the same one, and that one
     * itself, exactly one is given. Only that one is printed. */
    const char *instead;
    double factor; /* with `instead`: times this, it is the value of that key; 0: of its own */
    size_t offset; /* of the value, in the struct of its table */
    /* A number in the unit of this key, which has the same name, is that key's; NULL: none */
    const struct mill_key *also;
    const char *words; /* CHOICE: "first|second"; FILE: the word for "no file", or NULL */
    double named;      /* NUMBER: what the only word of `words` stands for */
    const char *known; /* FILE: "first|second": of the names, those that are no file's; or NULL */
    /* Of the table's struct; NULL: never. true: means nothing here, is not needed, not printed */
    bool (*hidden)(const void *form);
    const char *needs; /* for the message about a hidden key that a deck gives; NULL: it may */
};

#endif
