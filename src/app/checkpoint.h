/* The state of a run in its own output file, as the datasets /checkpoint/OWNER/FIELD with checksums
 * of HDF5's own: what --resume goes on from. The file is published as a whole, so state and results
 * are always of one moment. The state goes to the file from where it stands and comes back to
 * there: no run holds it twice. */
#ifndef MILL_CHECKPOINT_H
#define MILL_CHECKPOINT_H

#include "app/record.h"
#include "observe/observers.h"

/* What has a state */
struct mill_checkpoint {
    struct mill_sim *sim;
    const struct mill_observers *observers;
    struct mill_record_cost *cost;
};

void mill_checkpoint_write(const struct mill_checkpoint *from, struct mill_h5 *file);

/* Removes it, if there is one. */
void mill_checkpoint_remove(struct mill_h5 *file);

/* *found: the file has one, and it is of this build of the program. MILL_FAILED: it is of another.
 * name: of the file, for messages. */
enum mill_status mill_checkpoint_find(struct mill_h5 *file, const char *name, bool *found,
                                      struct mill_error *error);

/* Puts the state into what is made from the same deck and has not run. After a failure that is good
 * for nothing. */
enum mill_status mill_checkpoint_load(const struct mill_checkpoint *to, struct mill_h5 *file,
                                      const char *name, struct mill_error *error);

#endif
