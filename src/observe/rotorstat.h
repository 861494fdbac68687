/* Mean power and torque of the rotor, with standard errors from blocks of whole revolutions. */
#ifndef MILL_ROTORSTAT_H
#define MILL_ROTORSTAT_H

#include "millsim/world.h"

#include <stdbool.h>
#include <stddef.h>

enum { MILL_ROTORSTAT_MOST_BLOCKS = 100000 };

struct mill_rotorstat {
    double
        block; /* [s] a whole number of revolutions; INFINITY: the rotor stands or there is none */
    double
        revolutions; /* of one block; 1 unless the run has more than MILL_ROTORSTAT_MOST_BLOCKS */
    size_t planned;  /* whole blocks in the window */
    size_t blocks;   /* closed so far */
    double *power;   /* [W] of each block */
    double *torque;  /* [N m] of each block */
    double work;     /* [J] of the account when the last block was closed */
    double impulse;  /* [N m s] likewise */
};

/* Plans the blocks of a window of `duration` [s] at `rotor_speed` [rad/s]. false: out of memory. */
bool mill_rotorstat_init(struct mill_rotorstat *stat, double rotor_speed, double duration);
void mill_rotorstat_free(struct mill_rotorstat *stat);

/* Seconds into the window at which the block now open ends; INFINITY when no whole one is left. */
double mill_rotorstat_next(const struct mill_rotorstat *stat);

/* The window opens; the block that ends here is closed and the next one opens. */
void mill_rotorstat_open(struct mill_rotorstat *stat, const struct mill_account *account);
void mill_rotorstat_close(struct mill_rotorstat *stat, const struct mill_account *account);

/* Standard error of the mean of independent values[n]: NaN for n < 2. */
double mill_rotorstat_error(const double *values, size_t n);

#endif
