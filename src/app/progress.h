/* How far the run is, told while it runs. */
#ifndef MILLSIM_PROGRESS_H
#define MILLSIM_PROGRESS_H

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

enum { MILL_PROGRESS_LINE = 160 }; /* characters */
#define MILL_PROGRESS_EVERY 0.25   /* [s] of wall time between two reports */
#define MILL_PROGRESS_JSON 0.5     /* [s] of wall time between two JSON objects, at least */

enum mill_progress_form {
    MILL_PROGRESS_LOG,      /* a plain line now and then */
    MILL_PROGRESS_TERMINAL, /* one line rewritten in place */
    MILL_PROGRESS_OBJECTS   /* a JSON object a line */
};

struct mill_progress {
    double time, end;   /* [s] simulated */
    double work, works; /* [s] done, and in all: in a mill that is steady, time and end */
    uint64_t collisions;
    double wall;       /* [s] of this leg */
    bool begins;       /* the run stands here: rates count from now on */
    const char *state; /* of a run: "settling", "sampling" or "writing" */
    const char *stage; /* NULL, or this is being done, and `time` of `end` are what is done of it */
    const char *known; /* how well the results are known by now; NULL or "": nothing to be said */
};

struct mill_progress_display {
    FILE *out; /* NULL: nothing is shown */
    enum mill_progress_form form;
    bool begun;                   /* what comes before the run is done */
    const char *state;            /* last told as JSON; NULL: nothing yet */
    int shown;                    /* columns of the line standing on the terminal; 0: none */
    double began, stage, run;     /* [s] wall time of its making; from then, of the last stage, and
                                     of the run's begin */
    double due, gap;              /* [s] wall time of the next plain line; to the one after */
    struct mill_progress then[2]; /* older states, to take rates from */
};

/* out: usually stderr */
void mill_progress_init(struct mill_progress_display *display, FILE *out,
                        enum mill_progress_form form);

/* Shows `now` when its turn has come. */
void mill_progress_show(struct mill_progress_display *display, const struct mill_progress *now);

/* The same for what is done before the run and after it; fits mill_start_watch.tell with the
 * display as self. */
void mill_progress_stage(void *display, const char *what, int32_t done, int32_t all);

/* Ends the line on the terminal: to be called before anything else is printed. */
void mill_progress_end(struct mill_progress_display *display);

/* One line without newline, at most `width` characters: what does not fit is left out. */
void mill_progress_format(const struct mill_progress *then, const struct mill_progress *now,
                          int width, char line[MILL_PROGRESS_LINE]);

#endif
