/* The command line: what was asked for. */
#ifndef MILL_COMMAND_H
#define MILL_COMMAND_H

#include "millsim/status.h"

#include <stdbool.h>
#include <stdio.h>

enum mill_option {
    MILL_OUTPUT,
    MILL_SET,
    MILL_SOFT,
    MILL_CHECK,
    MILL_RESUME,
    MILL_FORCE,
    MILL_JSON,
    MILL_QUIET,
    MILL_PROGRESS,
    MILL_EXPORT_START,
    MILL_CONTOUR,
    MILL_VALUE,
    MILL_DIGEST,
    MILL_EXAMPLES,
    MILL_PARANOID,
    MILL_HELP,
    MILL_VERSION_LINE,
    MILL_OPTIONS
};

struct mill_command {
    const char *given[MILL_OPTIONS]; /* values; "": given without a value; NULL: not given */
    const char **set, **value;       /* all values of --set; all values of --value */
    int sets, values;
    const char *deck; /* NULL: no run was asked for */
    char *line;       /* the command line, quoted for a shell */
    /* the file to be written, as given, or "some/mill.ini" -> "mill.h5"; longer than any path */
    char output[4104];
};

/* Reads the arguments. MILL_BAD_DECK: the error says what is wrong. */
enum mill_status mill_command_read(int argc, char **argv, struct mill_command *command,
                                   struct mill_error *error);

/* Prints the text for --help or --version. false: neither was given. */
bool mill_command_answer(const struct mill_command *command, FILE *out);

/* --examples (examples.c): copies the example decks and their files into a folder, which is made if
 * necessary, and tells `out` so. MILL_BAD_DECK: a file is there already, and nothing was copied. */
enum mill_status mill_examples_copy(const char *folder, FILE *out, struct mill_error *error);

#endif
