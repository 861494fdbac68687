/* How far the run is, told while it runs. */
#ifndef MILLSIM_PROGRESS_H
#define MILLSIM_PROGRESS_H

#include "app/run.h"

#include <stdbool.h>
#include <stdio.h>

enum { MILL_PROGRESS_LINE = 160 };

struct mill_progress_display {
    FILE *out;
    bool terminal;                /* one line rewritten in place; else a plain line now and then */
    int shown;                    /* columns of the line standing on the terminal; 0: none */
    double due;                   /* [s] wall time of the next plain line */
    double gap;                   /* [s] from it to the one after */
    struct mill_progress then[2]; /* older states, to take rates from: 5 to 10 s ago */
};

/* out: usually stderr; terminal: whether it is one. */
void mill_progress_init(struct mill_progress_display *display, FILE *out, bool terminal);

/* Shows `now` when its turn has come; fits mill_run_options.progress with the display as self. */
void mill_progress_show(void *display, const struct mill_progress *now);

/* Ends the line on the terminal: to be called before anything else is printed. */
void mill_progress_end(struct mill_progress_display *display);

/* One line without newline, at most `width` characters: what does not fit is left out, rates first.
 */
void mill_progress_format(const struct mill_progress *then, const struct mill_progress *now,
                          int width, char line[MILL_PROGRESS_LINE]);

#endif
