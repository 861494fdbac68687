/* The kinds of contact, in the order used by every array, table and file. */
#ifndef MILLSIM_KINDS_H
#define MILLSIM_KINDS_H

/* One row for each kind: its number, and its name in decks, files and tables. All other code about
 * kinds is made from this list. */
#define MILL_KIND_LIST(row)                                                                        \
    row(MILL_BALL_BALL, "ball_ball") row(MILL_BALL_DRUM, "ball_drum")                              \
        row(MILL_BALL_WALL, "ball_wall") row(MILL_BALL_SHAFT, "ball_shaft")                        \
            row(MILL_BALL_BLADE, "ball_blade")

#define MILL_KIND_NUMBER(number, name) number,
enum mill_kind { MILL_KIND_LIST(MILL_KIND_NUMBER) MILL_KINDS };

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

/* Adds the kind of the body with this name and returns its number. The caller makes sure that there
 * is room. */
int mill_kinds_add(struct mill_kinds *kinds, const char *body);

#endif
