/* The command line: what was asked for. */
#ifndef MILL_COMMAND_H
#define MILL_COMMAND_H

#include "millsim/status.h"

#include <stdbool.h>

struct mill_command {
    const char *deck;
    const char *output;       /* NULL: by the deck's name */
    const char *export_start; /* file for the start instead of a run, or NULL */
    const char **set;
    int sets;
    const char **value; /* of keys to be told about, instead of a run */
    int values;
    bool check, resume, force, json, quiet, paranoid;
    const char *text; /* to be printed instead of a run, or NULL */
};

/* Reads the arguments into *command, whose `set` and `value` have room for argc of them;
 * MILL_BAD_DECK with a line that says what is wrong. */
enum mill_status mill_command_read(int argc, char **argv, struct mill_command *command,
                                   struct mill_error *error);

/* The name of the file to be written: as given, or "some/simoloyer.ini" -> "simoloyer.h5". NULL:
 * out of memory. Owner: the caller. */
char *mill_command_output(const struct mill_command *command);

/* The command line as a shell would read it back. NULL: out of memory. Owner: the caller. */
char *mill_command_quote(int argc, char **argv);

#endif
