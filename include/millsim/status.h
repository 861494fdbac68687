/* How functions say what went wrong. Only main prints and exits; everything else returns a status
 * and fills an error record with one line that names what, where and the mend. */
#ifndef MILLSIM_STATUS_H
#define MILLSIM_STATUS_H

enum mill_status {
    MILL_OK = 0,
    MILL_FAILED = 1,   /* disk full, out of memory, file unreadable, time stands still */
    MILL_BAD_DECK = 2, /* wrong usage or a wrong deck */
    MILL_STOPPED = 3,  /* stopped by a signal; everything up to then is good */
    MILL_ENDED = 4     /* an observer has seen enough; the error's text says why */
};

struct mill_error {
    char text[1024]; /* one line, no newline, without the program's name in front */
};

/* Fills `error` (may be NULL) printf-wise, control characters replaced, and returns `status`. */
enum mill_status mill_error_set(struct mill_error *error, enum mill_status status,
                                const char *format, ...) __attribute__((format(printf, 3, 4)));

#endif
