/* Copies the decks of input/ that come with the program. */
#ifndef MILL_EXAMPLES_H
#define MILL_EXAMPLES_H

#include "millsim/status.h"

#include <stdio.h>

/* Copies the example decks and their files into a folder, which is made if necessary, and tells
 * `out` so. MILL_BAD_DECK: a file is there already, and nothing was copied. */
enum mill_status mill_examples_copy(const char *folder, FILE *out, struct mill_error *error);

#endif
