/* Files that come with the program. */
#ifndef MILL_SHARE_H
#define MILL_SHARE_H

#include <stdbool.h>

enum { MILL_SHARE_PATH = 4352 }; /* [B] of the path of such a file */

/* Writes the path of a file that can be read, such as "input/single.ini", into `path`
 * [MILL_SHARE_PATH]. false: it is not beside this program. */
bool mill_share_find(const char *name, char *path);

#endif
