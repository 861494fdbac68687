/* The state of a run in its own output file, in the datasets /checkpoint/OWNER/FIELD with checksums
 * of HDF5. --resume continues from it. The file is published as a whole, so state and results
 * always belong to the same moment. The state is written from where it is in memory and read back
 * to there, so that no run holds it twice. */
#ifndef MILL_CHECKPOINT_H
#define MILL_CHECKPOINT_H

#include "app/record.h"
#include "app/starts.h"

void mill_checkpoint_write(struct mill_starts *starts, struct mill_record_cost *cost,
                           struct mill_h5 *file);

/* Removes the state, if there is one. */
void mill_checkpoint_remove(struct mill_h5 *file);

/* *found: the file has a state, and this build of the program wrote it. MILL_FAILED: another build
 * wrote it. name: of the file, for messages. */
enum mill_status mill_checkpoint_find(struct mill_h5 *file, const char *name, bool *found,
                                      struct mill_error *error);

/* Loads the state into objects that were made from the same deck and have not run. After a failure
 * they must not be used. */
enum mill_status mill_checkpoint_load(struct mill_starts *starts, struct mill_record_cost *cost,
                                      struct mill_h5 *file, const char *name,
                                      struct mill_error *error);

#endif
