/* The kinds of contact, in the order used by every array, table and file. */
#ifndef MILLSIM_KINDS_H
#define MILLSIM_KINDS_H

/* One row a kind: its number, its name in decks, files and tables, and what the ball meets, as it
 * stands in a sentence. Everything else that knows the kinds is made from this list. */
#define MILL_KIND_LIST(row)                                                                        \
    row(MILL_BALL_BALL, "ball_ball", "another ball") row(MILL_BALL_DRUM, "ball_drum", "the drum")  \
        row(MILL_BALL_WALL, "ball_wall", "an end wall")                                            \
            row(MILL_BALL_SHAFT, "ball_shaft", "the shaft")                                        \
                row(MILL_BALL_BLADE, "ball_blade", "a blade")

#define MILL_KIND_NUMBER(number, name, partner) number,
enum mill_kind { MILL_KIND_LIST(MILL_KIND_NUMBER) MILL_KINDS };

extern const char *const mill_kind_name[MILL_KINDS];

/* Those of a mill: the ones above, whether or not it has such surfaces, and from MILL_KINDS on
 * those of its bodies, "ball_NAME". */
enum { MILL_KINDS_MOST = 24, MILL_KINDS_LENGTH = 72 };
struct mill_kinds {
    int count;
    char name[MILL_KINDS_MOST][MILL_KINDS_LENGTH];
};

/* The first MILL_KINDS alone */
void mill_kinds_init(struct mill_kinds *kinds);

/* Adds that of a body of this name; its number. There must be room. */
int mill_kinds_add(struct mill_kinds *kinds, const char *body);

/* "another ball", "the drum", ...; of a body its name */
const char *mill_kinds_partner(const struct mill_kinds *kinds, int kind);

#endif
