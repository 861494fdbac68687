/* What a reader of the numbers ought to know: where hard spheres leave their reach, and a run that
 * is not what it was meant to be. Decided here and nowhere else, before the run or after it. */
#ifndef MILL_NOTES_H
#define MILL_NOTES_H

#include "observe/sink.h"
#include "observe/tally.h"

struct mill_note {
    const char *code;    /* its name in files; NULL: of this run, not of its physics */
    double value, limit; /* what is judged; NaN: not known */
    char text[256];      /* a sentence; "": within the limit */
};

struct mill_notes {
    int count;
    struct mill_note note[12];
};

/* Is it a mill of which only shaft and blades move, in a still drum? It is spoken of as a rotor. */
bool mill_notes_of_rotor(const struct mill_world *world);

/* Of a mill that has yet to run, with `rate` [1/s] contacts to be expected; NaN: not known.
 * trial: what a short run of it came to; NULL: none. */
void mill_notes_expect(struct mill_notes *notes, const struct mill_world *world,
                       const struct mill_tally_results *trial, double rate);

/* Of its results, world at local time t. stopped: the run was, by a signal. */
void mill_notes_take(struct mill_notes *notes, const struct mill_world *world,
                     const struct mill_tally_results *results, double t, bool stopped);

/* The same of another program's run: without what is said of hard spheres only. */
void mill_notes_foreign(struct mill_notes *notes, const struct mill_world *world,
                        const struct mill_tally_results *results, double t, bool stopped);

/* Tells values and limits as the group "reach", and to a file the sentences as "notes". */
void mill_notes_tell(const struct mill_notes *notes, struct mill_sink *sink);

#endif
