/* --digest: reads another program's run as a stream and makes an output file like that of millsim's
 * own runs. */
#ifndef MILL_DIGEST_H
#define MILL_DIGEST_H

#include "app/run.h"

/* Reads the stream from standard input to its end and writes the output file. MILL_BAD_DECK: the
 * stream is of another mill, or is no such stream; nothing is written. MILL_FAILED: the stream is
 * cut off or contains impossible values; the file then holds everything up to the last account.
 * MILL_STOPPED: the same after a signal. */
enum mill_status mill_digest(struct mill_run_order *order);

#endif
