/* STL files: surfaces as lists of triangles. */
#ifndef MILL_STL_H
#define MILL_STL_H

#include "millsim/status.h"
#include "millsim/vec3.h"

#include <stddef.h>

enum { MILL_STL_MOST = 2000000 /* facets of a file */ };

/* Reads an STL file, binary or ASCII. unit: [m] the length of one unit in the file. *facet: the
 * corners [m] in the file's order, of single precision in the file's unit, so that corners which
 * programs mean to be one are equal; NULL on failure. Owner: the caller; free(). What facets say
 * about their normals is not looked at: the order of their corners tells. */
enum mill_status mill_stl_read(const char *path, double unit, vec3 (**facet)[3], size_t *facets,
                               struct mill_error *error);

#endif
