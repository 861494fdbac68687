#include "millsim/kinds.h"

#define NAME(number, name, partner) [number] = name,
#define PARTNER(number, name, partner) [number] = partner,

const char *const mill_kind_name[MILL_KINDS] = {MILL_KIND_LIST(NAME)};
const char *const mill_kinds_partner[MILL_KINDS] = {MILL_KIND_LIST(PARTNER)};
