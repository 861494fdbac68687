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
extern const char *const mill_kinds_partner[MILL_KINDS];

#endif
