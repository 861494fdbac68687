/* --digest: the run of another program, read as a stream, becomes a file like that of a run. */
#ifndef MILL_DIGEST_H
#define MILL_DIGEST_H

#include "app/run.h"

/* Reads the stream from standard input to its end and writes the output file. MILL_BAD_DECK: it is
 * of another mill, or no such stream; nothing is written. MILL_FAILED: it breaks off or holds what
 * cannot be; the file then has everything up to its last account. MILL_STOPPED: so, by a signal. */
enum mill_status mill_digest(struct mill_run_order *order);

#endif
