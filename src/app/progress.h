/* Progress of a run, shown while it runs */
#ifndef MILLSIM_PROGRESS_H
#define MILLSIM_PROGRESS_H

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

enum { MILL_PROGRESS_LINE = 160 }; /* characters */
#define MILL_PROGRESS_EVERY 0.25   /* [s] of wall time between two reports */
#define MILL_PROGRESS_JSON 0.5     /* [s] minimum wall time between two JSON objects */

enum mill_progress_form {
    MILL_PROGRESS_LOG,      /* a plain line from time to time */
    MILL_PROGRESS_TERMINAL, /* one line rewritten in place */
    MILL_PROGRESS_OBJECTS   /* a JSON object per line */
};

struct mill_progress {
    double time, end; /* [s] simulated */
    double early;     /* [s] until then the rate of contacts may grow */
    uint64_t collisions;
    double wall;       /* [s] since this process started the run */
    bool begins;       /* true: the run starts here; rates count from now on */
    const char *state; /* of a run: "settling", "sampling" or "writing" */
    const char *stage; /* NULL, or the name of another task; `time` of `end` is then its progress */
    const char *known; /* accuracy of the results so far; NULL or "": nothing to show */
};

struct mill_progress_display {
    FILE *out; /* NULL: shows nothing */
    enum mill_progress_form form;
    bool begun;        /* the tasks before the run are finished */
    const char *state; /* last one written as JSON; NULL: none yet */
    int shown;         /* width of the line on the terminal now; 0: none */
    double began;      /* [s] wall time when the display was made */
    double stage, run; /* [s] from then to the last task, and to the start of the run */
    double due, gap;   /* [s] wall time of the next plain line; time to the one after it */
    struct mill_progress then[2]; /* older states, for computing rates */
};

/* out: usually stderr */
void mill_progress_init(struct mill_progress_display *d, FILE *out, enum mill_progress_form form);

/* Shows `now` if it is time for a new report. */
void mill_progress_show(struct mill_progress_display *display, const struct mill_progress *now);

/* The same for a task before or after the run; a mill_start_watch.tell, with the display as self */
void mill_progress_stage(void *display, const char *what, int32_t done, int32_t all);

/* Ends the line on the terminal. To be called before any other output. */
void mill_progress_end(struct mill_progress_display *display);

/* Writes a line without newline, of at most `width` characters, without fields that do not fit */
void mill_progress_format(const struct mill_progress *then, const struct mill_progress *now,
                          int width, char line[MILL_PROGRESS_LINE]);

#endif
