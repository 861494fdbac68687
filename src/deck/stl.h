/* STL files: surfaces as lists of triangles. */
#ifndef MILL_STL_H
#define MILL_STL_H

#include "millsim/status.h"
#include "millsim/vec3.h"

#include <stddef.h>

enum { MILL_STL_MOST = 2000000 /* facets in a file */ };

/* Reads an STL file, binary or ASCII. unit: [m] length of one unit in the file. *facet: the corners
 * [m] in the order of the file; NULL on failure. Corners are in single precision in the file's
 * unit, so that corners which are meant to be the same point are equal. The normals in the file are
 * ignored: the order of the corners defines the outer side. Owner: the caller; free(). */
enum mill_status mill_stl_read(const char *path, double unit, vec3 (**facet)[3], size_t *facets,
                               struct mill_error *error);

#endif
