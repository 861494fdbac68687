/* A surface that balls meet: drum, end wall, shaft, blade. One shape = one file behind this
 * interface. Shapes never change; the rotor's angle is handed in. All of them keep one contract for
 * a contact: the first time at which gap <= 0 and the gap is closing (Bannerman et al. 2014, arXiv
 * 1211.6718). */
#ifndef MILLSIM_SHAPE_H
#define MILLSIM_SHAPE_H

#include "base/elementary.h"
#include "base/profile.h"
#include "millsim/kinds.h"
#include "millsim/poly.h"
#include "millsim/vec3.h"

#include <stdbool.h>
#include <stdint.h>

/* Some of a shape's parts: `count` of them from number `first` on, the first coming after the last.
 * Count 0: not known, so all. */
struct mill_span {
    int16_t first, count;
};

/* A ball's free flight from "now" on: r + v t + g t^2 / 2 */
struct mill_flight {
    vec3 r;                      /* [m] */
    vec3 v;                      /* [m/s] */
    vec3 g;                      /* [m/s^2] */
    struct mill_heading heading; /* of the rotor, within 1e-12; both 0: not known */
    struct mill_span parts; /* which the ball can meet where it flies, of a shape that has parts */
};

/* Such a flight, the rotor at the angle `turn` [rad]; its heading is found anew. */
static inline struct mill_flight mill_shape_flight(vec3 r, vec3 v, vec3 g, double turn)
{
    const struct mill_flight flight = {r, v, g, mill_elementary_heading(turn), {0, 0}};
    return flight;
}

struct mill_contact {
    vec3 normal;   /* unit, from the surface into the ball */
    vec3 point;    /* [m] where ball and surface touch */
    vec3 velocity; /* [m/s] of the surface there */
    double gap;    /* [m] between the ball's surface and the shape, < 0: overlap */
};

/* [m] a search by steps takes a gap below this for closed: some 50 roundings of a position */
#define MILL_SHAPE_CLOSED 1e-15

/* How far a mill reaches, for shapes that end where others begin */
struct mill_chamber {
    struct mill_profile drum;
    double half_length; /* [m] */
    double tolerance;   /* [m] of what is drawn with flats */
};

struct mill_mesh;
struct mill_shape;

struct mill_shape_ops {
    enum mill_kind kind;
    /* Seconds from now to the first contact within [0, horizon], INFINITY when there is none. turn:
     * the rotor's angle now [rad]. touching: the ball has just been in contact with this shape,
     * now. A search that took too long says so by a negative -t: there is no contact before t > 0,
     * and the caller asks again from there. */
    double (*next_contact)(const struct mill_shape *, const struct mill_flight *, double radius,
                           double turn, double horizon, bool touching);
    /* Distance of the ball's surface from the shape [m], < 0: they overlap by that much. */
    double (*gap)(const struct mill_shape *, vec3 centre, double radius, double turn);
    struct mill_contact (*contact)(const struct mill_shape *, vec3 centre, double radius,
                                   double turn);
    /* false: no ball of this radius with its centre in the box [lo, hi] ever touches the shape,
     * whatever the rotor's angle. May be true too often, never false wrongly. */
    bool (*reachable)(const struct mill_shape *, vec3 lo, vec3 hi, double radius);
    void (*free)(struct mill_shape *);
    /* The parts that such a ball can touch, none if it cannot reach the shape; for a shape of many
     * parts, else NULL. Handed back with every flight that stays in the box. */
    struct mill_span (*parts)(const struct mill_shape *, vec3 lo, vec3 hi, double radius);
    /* true: the ball touches the shape in a second place as well, told in *contact. NULL for a
     * shape on which no ball ever does. */
    bool (*beside)(const struct mill_shape *, vec3 centre, double radius,
                   struct mill_contact *contact);
    /* Adds what balls can see of it, the rotor at angle 0. */
    void (*draw)(const struct mill_shape *, const struct mill_chamber *, struct mill_mesh *);
};

/* Every shape starts with this. */
struct mill_shape {
    const struct mill_shape_ops *ops;
    int number;    /* which of its kind: end wall 0 (x < 0) or 1, blade 0.. ; -1 where there is only
                      one */
    bool turns;    /* moves with the rotor */
    double hollow; /* [m] least radius of what is curved around the ball; 0: nothing is */
    struct mill_poly_counts *counts; /* where its solver counts; may be NULL */
};

/* The contact of a ball that is due to meet the shape: of two places that it touches, the one that
 * it is closing on. */
static inline struct mill_contact mill_shape_meet(const struct mill_shape *shape, vec3 r, vec3 v,
                                                  double radius, double turn)
{
    const struct mill_contact k = shape->ops->contact(shape, r, radius, turn);
    struct mill_contact other;
    if (shape->ops->beside && vec3_dot(vec3_sub(v, k.velocity), k.normal) >= 0.0 &&
        shape->ops->beside(shape, r, radius, &other) &&
        vec3_dot(vec3_sub(v, other.velocity), other.normal) < 0.0)
        return other;
    return k;
}

/* What a drum draws, whatever its profile: it is the chamber's wall. */
void mill_shape_draw_drum(const struct mill_shape *, const struct mill_chamber *,
                          struct mill_mesh *);

#endif
