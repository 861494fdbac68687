/* Names of the contact kinds: one list for decks, files and tables. */
#include "millsim/kinds.h"

const char *const mill_kind_name[MILL_KINDS] = {"ball_ball", "ball_drum", "ball_wall", "ball_shaft",
                                                "ball_blade"};
