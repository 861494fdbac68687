/* How sure are the mean power and torque of the rotor? Both swing with the blades' passage, so the
 * time is cut into blocks of whole revolutions: within a block the swing averages out, and the
 * blocks' scatter gives the standard error of the mean. One revolution is long against the memory
 * of the charge in a mill that is braked (it is steady after one or two), so blocks count as
 * independent. */
#include "observe/rotorstat.h"

#include <gsl/gsl_statistics_double.h>
#include <math.h>
#include <stdlib.h>

bool mill_rotorstat_init(struct mill_rotorstat *stat, double rotor_speed, double duration)
{
    *stat = (struct mill_rotorstat){.block = INFINITY, .revolutions = 1};
    if (rotor_speed == 0 || !(duration > 0))
        return true;
    stat->block = 2 * MILL_PI / fabs(rotor_speed);
    /* a window of exactly n revolutions has n, whatever the rounding */
    while (duration / stat->block * (1 + 1e-12) >= MILL_ROTORSTAT_MOST_BLOCKS + 1) {
        stat->revolutions *= 2;
        stat->block *= 2;
    }
    stat->planned = (size_t)(duration / stat->block * (1 + 1e-12));
    stat->power = calloc(stat->planned + 1, sizeof *stat->power);
    stat->torque = calloc(stat->planned + 1, sizeof *stat->torque);
    if (stat->power && stat->torque)
        return true;
    mill_rotorstat_free(stat);
    return false;
}

void mill_rotorstat_free(struct mill_rotorstat *stat)
{
    free(stat->power);
    free(stat->torque);
    stat->power = stat->torque = NULL;
}

double mill_rotorstat_next(const struct mill_rotorstat *stat)
{
    return stat->blocks < stat->planned ? (double)(stat->blocks + 1) * stat->block
                                        : (double)INFINITY;
}

void mill_rotorstat_open(struct mill_rotorstat *stat, const struct mill_account *account)
{
    stat->work = account->rotor_work;
    stat->impulse = account->rotor_impulse;
}

void mill_rotorstat_close(struct mill_rotorstat *stat, const struct mill_account *account)
{
    stat->power[stat->blocks] = (account->rotor_work - stat->work) / stat->block;
    stat->torque[stat->blocks] = (account->rotor_impulse - stat->impulse) / stat->block;
    stat->blocks++;
    mill_rotorstat_open(stat, account);
}

double mill_rotorstat_error(const double *values, size_t n)
{
    return n < 2 ? (double)NAN : gsl_stats_sd(values, 1, n) / sqrt((double)n);
}
