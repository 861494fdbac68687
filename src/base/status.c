/* The error record. It may contain text from decks and file names, so control characters are
 * replaced: a message stays on one line and cannot control the terminal. */
#include "millsim/status.h"

#include <stdarg.h>
#include <stdio.h>

enum mill_status mill_error_set(struct mill_error *error, enum mill_status status,
                                const char *format, ...)
{
    if (error) {
        va_list list;
        va_start(list, format);
        vsnprintf(error->text, sizeof error->text, format, list);
        va_end(list);
        for (char *p = error->text; *p; p++)
            if ((unsigned char)*p < 32 || *p == 127)
                *p = '?';
    }
    return status;
}
