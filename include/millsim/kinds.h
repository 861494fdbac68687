/* The kinds of contact, in the order used by every array, table and file. */
#ifndef MILLSIM_KINDS_H
#define MILLSIM_KINDS_H

enum mill_kind {
    MILL_BALL_BALL,
    MILL_BALL_DRUM,
    MILL_BALL_WALL,
    MILL_BALL_SHAFT,
    MILL_BALL_BLADE,
    MILL_KINDS
};

/* In decks, files and tables */
extern const char *const mill_kind_name[MILL_KINDS];

/* The kinds of one mill. The first MILL_KINDS are the ones above, even if the mill has no such
 * surface. The kinds of its bodies, "ball_NAME", follow. Files and tables list only those of which
 * the mill has a surface (src/observe/kinds.h). */
enum { MILL_KINDS_MOST = 24, MILL_KINDS_LENGTH = 72 };
struct mill_kinds {
    int count;
    char name[MILL_KINDS_MOST][MILL_KINDS_LENGTH];
};

/* Sets only the first MILL_KINDS kinds. */
void mill_kinds_init(struct mill_kinds *kinds);

/* Adds the kind of the body with this name, for which there must be room; returns its number. */
int mill_kinds_add(struct mill_kinds *kinds, const char *body);

#endif
