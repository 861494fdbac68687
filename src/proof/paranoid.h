/* A paranoid run: every event is checked by brute force, and other solvers look at each quartic.
 * None of this is part of the library: it is the program's proof that the library is right. */
#ifndef MILL_PARANOID_H
#define MILL_PARANOID_H

#include "millsim/sim.h"

/* Is t the first rise (poly.h) of c, which begins below zero? c[4] is not 0, t or t_end finite. */
typedef bool mill_paranoid_opinion(const double c[5], double t_end, bool at_root, double t);

/* By the roots in closed form, to 1e-9 of the terms; by GSL, true also if it finds no roots */
mill_paranoid_opinion mill_quartic_agrees, mill_opinion_agrees;

/* All four roots of c[4] t^4 + ... + c[0], c[4] != 0, re[k] + i im[k]; conjugates adjacent. */
void mill_quartic_roots(const double c[5], double re[4], double im[4]);

/* Asks of each first rise that a search has found, and counts the answers */
struct mill_paranoid_quartics {
    struct mill_poly_check check;   /* look: mill_paranoid_look */
    mill_paranoid_opinion *second;  /* beside the closed form; NULL: none */
    unsigned long asked;            /* first rises that were compared */
    unsigned long refuted, doubted; /* by the closed form, by the second opinion */
};
void mill_paranoid_look(struct mill_poly_check *check, const double c[5], double t_end,
                        bool at_root, double t);

/* How often each property was checked and found true */
struct mill_paranoid_checks {
    uint64_t events;      /* due now, the earliest of all, of bodies that touch */
    uint64_t entries;     /* of the calendar, compared with the plan of the ball */
    uint64_t predictions; /* plans of one ball, compared with brute force */
    uint64_t pairs;       /* of balls: no overlap now, no contact before the next event of either */
    uint64_t surfaces;    /* of a ball and a surface: no overlap, no earlier contact */
    uint64_t samples;     /* of gaps to surfaces until the next event */
    uint64_t quartics;    /* solved for contacts, compared with other solvers */
    uint64_t places;      /* balls that are in their cell */
    uint64_t accounts;    /* balances of the energy account */
};

/* Checks every event from now on, and the present state before it returns; nothing in the world
 * changes. The first fault ends the run with MILL_FAILED and one line "paranoid: ...". An event
 * costs the more the more balls there are. second: is asked of each quartic too; NULL: nobody */
enum mill_status mill_paranoid_start(struct mill_sim *sim, mill_paranoid_opinion *second,
                                     struct mill_error *error);
void mill_paranoid_stop(struct mill_sim *sim);

/* The checks made since the start; all zero if there are none. */
struct mill_paranoid_checks mill_paranoid_done(const struct mill_sim *sim);

#endif
