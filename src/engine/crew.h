/* A crew: threads that share a piece of work and wait for each other at its end. */
#ifndef MILLSIM_CREW_H
#define MILLSIM_CREW_H

struct mill_crew;

enum { MILL_CREW_MOST = 64 }; /* parts */

/* Does part `part` of the work. */
typedef void mill_crew_fn(void *work, int part);

/* A crew for work of this many parts; it has no threads yet. NULL: out of memory */
struct mill_crew *mill_crew_create(int parts);
void mill_crew_free(struct mill_crew *crew);

/* Starts and ends the threads. Between these calls there are none: the process may fork. Returns
 * the number of threads, the caller's included; the crew can only work if each part has one. */
int mill_crew_begin(struct mill_crew *crew);
void mill_crew_end(struct mill_crew *crew);

/* Does all parts of the work, part 0 on the caller's thread. Returns when all are done. */
void mill_crew_do(struct mill_crew *crew, mill_crew_fn *part, void *work);

#endif
