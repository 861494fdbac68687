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

/* "ball_ball", "ball_drum", ...: names in decks, files and tables */
extern const char *const mill_kind_name[MILL_KINDS];

#endif
