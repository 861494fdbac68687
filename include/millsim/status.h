/* How functions report errors. Only main prints and exits. Every other function returns a status
 * and fills an error record with one line: what is wrong, where, and how to mend it. */
#ifndef MILLSIM_STATUS_H
#define MILLSIM_STATUS_H

enum mill_status {
    MILL_OK = 0,
    MILL_FAILED = 1,   /* disk full, out of memory, file unreadable, endless contacts */
    MILL_BAD_DECK = 2, /* wrong usage or a wrong deck */
    MILL_STOPPED = 3,  /* stopped by a signal; all results up to then are valid */
    MILL_ENDED = 4     /* an observer has gathered enough; the error's text says why */
};

struct mill_error {
    char text[1024]; /* one line, no newline, without the program's name in front */
};

/* Fills `error` (may be NULL) like printf, replaces control characters, and returns `status`. */
enum mill_status mill_error_set(struct mill_error *error, enum mill_status status,
                                const char *format, ...) __attribute__((format(printf, 3, 4)));

#endif
