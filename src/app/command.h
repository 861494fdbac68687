/* The command line: what was asked for. */
#ifndef MILL_COMMAND_H
#define MILL_COMMAND_H

#include "millsim/status.h"

#include <stdbool.h>
#include <stdio.h>

enum mill_option {
    MILL_OUTPUT,
    MILL_SET,
    MILL_CHECK,
    MILL_RESUME,
    MILL_FORCE,
    MILL_JSON,
    MILL_QUIET,
    MILL_PROGRESS,
    MILL_EXPORT_START,
    MILL_VALUE,
    MILL_DIGEST,
    MILL_PARANOID,
    MILL_HELP,
    MILL_VERSION_LINE,
    MILL_OPTIONS
};

struct mill_command {
    const char *given[MILL_OPTIONS]; /* its value, or "" where it has none; NULL: not given */
    const char **set, **value;       /* all values of --set, and of --value */
    int sets, values;
    const char *deck; /* NULL: no run is asked for */
    char *line;       /* the command line as a shell would read it back */
    /* the file to be written: as given, or "some/mill.ini" -> "mill.h5"; what is cut is refused */
    char output[4104]; /* longer than any path that the system takes */
};

/* Reads the arguments; MILL_BAD_DECK with a line that says what is wrong. */
enum mill_status mill_command_read(int argc, char **argv, struct mill_command *command,
                                   struct mill_error *error);

/* Frees what it owns: lists and line. */
void mill_command_free(struct mill_command *command);

/* Prints what --help or --version ask for; false: neither was given. */
bool mill_command_answer(const struct mill_command *command, FILE *out);

#endif
