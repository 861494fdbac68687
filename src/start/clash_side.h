/* Solids as their motions carry them, where what carries both of two motions is left out; and what
 * makes a march unneeded: the distance never changes, or it never gets small. */
#ifndef MILL_CLASH_SIDE_H
#define MILL_CLASH_SIDE_H

#include "geometry/shape.h"
#include "start/clash_solid.h"

/* A line that stands still, about which a motion turns */
struct mill_clash_line {
    bool is; /* there is one */
    vec3 through, direction;
};

struct mill_clash_side {
    const struct mill_clash_solid *is;
    const struct mill_motion *motion;
    struct mill_motion_bounds bounds; /* at the middle of the sphere around it */
    double size;                      /* [m] of that sphere */
    double speed;                     /* [m/s] of any point where the solid changes */
    struct mill_pose begin;           /* at t = 0 */
    vec3 centre, axis;                /* there */
    bool keeps;                       /* no point of space ever changes its distance from it */
    struct mill_clash_line ring;      /* its places stay between these distances from that: */
    double inner, outer;              /* [m] */
};

/* That of a motion, or where it stands (NULL) that of the other; where both turn, about parallel
 * lines. */
struct mill_clash_line mill_clash_side_line(const struct mill_motion *own,
                                            const struct mill_motion *other);

struct mill_clash_side mill_clash_side_of(const struct mill_clash_solid *is,
                                          const struct mill_motion *motion,
                                          const struct mill_clash_line *line);

/* The pose a as seen from b */
struct mill_pose mill_clash_side_relative(const struct mill_pose *a, const struct mill_pose *b);

/* All turns of `s` are about the axis of `round`, of a ball about any through its centre. */
bool mill_clash_side_turns_about(const struct mill_clash_side *s,
                                 const struct mill_clash_side *round);

/* A direction of the laboratory along which no place of the solid ever moves */
bool mill_clash_side_is_level(const struct mill_clash_side *s, vec3 direction);

/* Their distance never changes. */
bool mill_clash_side_are_steady(const struct mill_clash_side *a, const struct mill_clash_side *b);

/* They never come nearer than that, and one sees it at once. */
bool mill_clash_side_are_apart(const struct mill_clash_side *a, const struct mill_clash_side *b,
                               double near);

#endif
