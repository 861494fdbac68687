/* Notes for the reader of the results: where the model of hard spheres is not valid, and where a
 * run did not do what was probably wanted. Only this file decides about them. */
#ifndef MILL_NOTES_H
#define MILL_NOTES_H

#include "observe/sink.h"
#include "observe/tally.h"

struct mill_note {
    const char *code;    /* name of the rule in files; NULL: it is on the run, not its physics */
    double value, limit; /* what the rule compares; NaN: not known */
    char text[512];      /* sentences; "": within the limit */
};

struct mill_notes {
    int count;
    struct mill_note note[20];
};

/* True if only a shaft and blades move, in a drum at rest. The notes then speak of a rotor. */
bool mill_notes_of_rotor(const struct mill_world *world);

/* Notes before a run. rate: contacts per second [1/s] to be expected; NaN: not known. trial:
 * results of a short run of the same mill; NULL: none. */
void mill_notes_expect(struct mill_notes *notes, const struct mill_world *world,
                       const struct mill_tally_results *trial, double rate);

/* Notes on the results of a run. The world is at local time t. stopped: a signal has stopped the
 * run. foreign: it is another program's run, without the notes that concern hard spheres only */
void mill_notes_take(struct mill_notes *notes, const struct mill_world *world,
                     const struct mill_tally_results *r, double t, bool stopped, bool foreign);

/* Writes values and limits as the group "reach"; in a file also the sentences as "notes". others:
 * notes of the other program that made the run, to which the sentences are added; NULL: none did */
void mill_notes_tell(const struct mill_notes *notes, const char *others, struct mill_sink *sink);

/* Writes the texts as the array "notes". */
void mill_notes_write(const struct mill_notes *notes, struct mill_sink *sink);

#endif
