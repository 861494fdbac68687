/* Version and build of this program, from the Makefile */
#ifndef MILL_VERSION_H
#define MILL_VERSION_H

extern const char mill_version[];      /* "v1.2-3-gabcdef0" */
extern const char mill_version_line[]; /* "millsim VERSION\n" */
extern const char mill_version_compiler[], mill_version_flags[];
extern const char mill_version_build[]; /* a hash of sources, flags and compiler */

#endif
