/* Where is the charge of a tumbling mill, seen along its axis? docs/tumbling.md defines the
 * numbers. Angles are from the lowest place of the wall towards the side where it rises. */
#ifndef MILL_CHARGE_H
#define MILL_CHARGE_H

#include "observe/energies.h"

enum { MILL_CHARGE_ANGLES = 180, MILL_CHARGE_SECTORS = 60, MILL_CHARGE_RINGS = 30 };
enum { MILL_CHARGE_WIDE = 36, MILL_CHARGE_SIZES = 36 };

/* What the liner got at an angle: all that turns with the wall, but no end of it */
struct mill_charge_hits {
    double count, normal, sliding;         /* [J] lost along the normal, in the surface */
    double outward, forward;               /* [N s] from the axis, and with the turning */
    double lifter_outward, lifter_forward; /* [N s] of these on lifters */
};
extern const struct mill_sums_list mill_charge_hits;

/* Of a stretch of time, sums over samples; angles begin at the highest place. All are doubles. */
struct mill_charge_sum {
    double samples, mass, across, up;                    /* [kg], [kg m] mass times place */
    double flight;                                       /* [s] */
    double layer[MILL_CHARGE_ANGLES];                    /* [kg] at the wall */
    double flow[MILL_CHARGE_SECTORS][MILL_CHARGE_RINGS]; /* [kg m/s] around the axis */
    struct mill_charge_hits hit[MILL_CHARGE_ANGLES];
    double sizes[MILL_CHARGE_WIDE][MILL_CHARGE_SIZES]; /* [N s] on lifters, by size of impact */
};

/* What is known of it, after the flight the centres of mass and of circulation, across and up */
enum { MILL_CHARGE_TOE, MILL_CHARGE_SHOULDER, MILL_CHARGE_REPOSE, MILL_CHARGE_FLIGHT };
enum { MILL_CHARGE_ABOVE_TOE = MILL_CHARGE_FLIGHT + 5, MILL_CHARGE_NUMBERS };
extern const char *const mill_charge_words[MILL_CHARGE_NUMBERS][3]; /* name, unit, meaning */

struct mill_charge {
    const struct mill_world *world; /* NULL: the mill does not tumble, and nothing is gathered */
    double interval;                /* [s] between the samples of the flow */
    uint64_t every;                 /* of them is a sample of the charge */
    vec3 centre, down, rising;      /* [m] of the axis; unit */
    double inner;                   /* [m] where the layer at the wall begins */
    double tip;                     /* [m] what is nearer to the axis is a lifter */
    double unit;                    /* [N s] lower bound of sizes, of which two double it */
    struct mill_sums blocks;        /* at the times of mill_energies_blocks */
    struct mill_charge_sum *block;  /* their records */
    double *met;                    /* [s][balls] when they had their last impact */
};

/* false: out of memory. The caller frees `blocks` and `met` in both cases. */
bool mill_charge_init(struct mill_charge *charge, const struct mill_world *world, double interval);

/* Adds the balls at local time t to a block, if some of the samples [done, until) are due. */
void mill_charge_sample(const struct mill_charge *charge, uint64_t block, double t, uint64_t done,
                        uint64_t until);

/* Ends the flights of the impact's balls, adds what the liner gets. They count if it is `open`. */
void mill_charge_impact(const struct mill_charge *charge, uint64_t block, bool open,
                        const struct mill_impact *impact);

/* `before` blocks have become `after`. */
void mill_charge_join(const struct mill_charge *charge, uint64_t before, uint64_t after);

/* Adds the blocks [from, to) to *sum; sets the numbers of this sum. */
void mill_charge_estimate(const struct mill_charge *charge, uint64_t from, uint64_t to,
                          struct mill_charge_sum *sum, double number[MILL_CHARGE_NUMBERS]);

/* Adds up the blocks [from, to) of some starts. The errors are from the starts (see spread.h). */
void mill_charge_results(const struct mill_charge *const *start, int starts, uint64_t from,
                         uint64_t to, struct mill_charge_sum *sum,
                         struct mill_spread_mean number[MILL_CHARGE_NUMBERS]);

#endif
