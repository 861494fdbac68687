/* Samples: the states of all balls that a program with soft spheres gives several times in each
 * contact. millsim finds the impacts in them. docs/file-format.md describes the records. */
#ifndef MILL_SAMPLES_H
#define MILL_SAMPLES_H

#include "engine/soft.h"
#include "observe/replay.h"

#include <stdio.h>

/* All zero: no springs yet */
struct mill_samples {
    struct mill_soft *soft;          /* finds the contacts; NULL: no springs yet */
    struct mill_memory_list impacts; /* struct mill_replay_impact, of one sample */
    double *answer;
};

void mill_samples_free(struct mill_samples *samples);

/* Numbers in a record */
uint64_t mill_samples_length(const struct mill_world *world);
uint64_t mill_samples_springs_length(const struct mill_world *world);

/* These return MILL_FAILED, and one line that says why, for impossible input. */

enum mill_status mill_samples_springs(struct mill_samples *samples, struct mill_world *world,
                                      const double *values, struct mill_error *error);

/* Passes the impacts on, and the state if the sample says so. */
enum mill_status mill_samples_take(struct mill_samples *samples, struct mill_replay *replay,
                                   const double *values, struct mill_error *error);
enum mill_status mill_samples_part(struct mill_samples *samples, struct mill_error *error);

/* Tells what the samples have shown so far. */
enum mill_status mill_samples_answer(struct mill_samples *s, FILE *to, struct mill_error *error);

#endif
