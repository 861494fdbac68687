/* The only file that is compiled with MILL_VERSION, MILL_FLAGS, MILL_BUILD, and not without them */
#include "store/version.h"

#ifdef __clang__
#define COMPILER "clang " __VERSION__
#else
#define COMPILER "gcc " __VERSION__
#endif

const char mill_version[] = MILL_VERSION;
const char mill_version_line[] = "millsim " MILL_VERSION "\n";
const char mill_version_compiler[] = COMPILER;
const char mill_version_flags[] = MILL_FLAGS;
const char mill_version_build[] = MILL_BUILD;
