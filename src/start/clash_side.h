/* Solids as their motions carry them. A motion that carries both of two solids is left out. This
 * file also finds the pairs that need no march: their distance never changes, or never becomes
 * small. */
#ifndef MILL_CLASH_SIDE_H
#define MILL_CLASH_SIDE_H

#include "start/clash_solid.h"

/* A line at rest, about which a motion turns */
struct mill_clash_line {
    bool is; /* there is such a line */
    vec3 through, direction;
};

struct mill_clash_side {
    const struct mill_clash_solid *is;
    const struct mill_motion *motion;
    struct mill_motion_bounds bounds; /* of the centre of the sphere around it */
    double size;                      /* [m] of that sphere */
    double speed;           /* [m/s] no point moves faster, where the solid changes its place */
    struct mill_pose begin; /* at t = 0 */
    vec3 centre, axis;      /* at t = 0 */
    bool keeps;             /* the solid always occupies the same points of space */
    struct mill_clash_line ring; /* the solid never leaves the ring around this line, */
    double inner, outer;         /* [m] between these distances from the line */
};

/* The line about which `own` turns. Where `own` is NULL (at rest): the line of `other`. Where both
 * turn, their lines must be parallel. */
struct mill_clash_line mill_clash_side_line(const struct mill_motion *own,
                                            const struct mill_motion *other);

struct mill_clash_side mill_clash_side_of(const struct mill_clash_solid *is,
                                          const struct mill_motion *motion,
                                          const struct mill_clash_line *line);

/* True if `s` only turns, and only about the axis of `round`. Where `round` is a ball: about any
 * axis through its centre. */
bool mill_clash_side_turns_about(const struct mill_clash_side *s,
                                 const struct mill_clash_side *round);

/* True if no point of the solid ever moves along this direction of the laboratory */
bool mill_clash_side_is_level(const struct mill_clash_side *s, vec3 direction);

/* True if the distance of the two solids never changes */
bool mill_clash_side_are_steady(const struct mill_clash_side *a, const struct mill_clash_side *b);

/* True if a simple estimate shows that the two solids never come nearer than `near` */
bool mill_clash_side_are_apart(const struct mill_clash_side *a, const struct mill_clash_side *b,
                               double near);

#endif
