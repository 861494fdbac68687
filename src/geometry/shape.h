/* A surface that balls meet: a body, or one wall of the container. How balls meet it is behind this
 * interface; what it looks like, its solid says (solid.h). A shape never changes; the pose of a
 * moving shape is an argument. All shapes define a contact in the same way: it is the first time at
 * which gap <= 0 and the gap is closing (Bannerman et al. 2014, arXiv 1211.6718). */
#ifndef MILLSIM_SHAPE_H
#define MILLSIM_SHAPE_H

#include "millsim/kinds.h"
#include "millsim/motion.h"
#include "millsim/poly.h"

#include <stdint.h>

/* Some of a shape's parts: `count` parts from number `first` on. The parts form a circle: after the
 * last one comes number 0. Count 0: not known, thus all. */
struct mill_span {
    int16_t first, count;
};

/* The angles at which a ball in some box can meet a body that turns about a line at rest: only if
 * cos(angle) y + sin(angle) z >= cos, where angle is the angle of the motion. */
struct mill_sector {
    double y, z, cos;
};

/* A ball's free flight from now on: r + v t + g t^2 / 2 */
struct mill_flight {
    vec3 r, v, g; /* [m], [m/s], [m/s^2] */
    double pull;  /* [m/s^2] length of g */
    /* The flight in the frame of the shape's motion, from now until the horizon, `window` [s]
     * later: place + course t [m], [m/s]; the course is along the axes of the laboratory, and
     * `pose` turns it. The error is at most `slack` [m], and the ball's centre stays within
     * `travel` [m] of `place`. INFINITY: not known. */
    vec3 place, course;
    const struct mill_pose *pose;
    double window, slack, travel;
    struct mill_span parts; /* the parts that the ball can meet, of a shape that has parts */
    struct mill_poly_counts *counts; /* of solvers; may be NULL */
};

/* Sets a flight whose place in the frame of the shape's motion is not known. Field by field: an
 * initializer would first clear all of it. */
static inline void mill_flight_set(struct mill_flight *f, vec3 r, vec3 v, vec3 g, double pull,
                                   struct mill_poly_counts *counts)
{
    f->r = r;
    f->v = v;
    f->g = g;
    f->pull = pull;
    f->place = r; /* for any test that does not look at `travel` first */
    f->slack = f->travel = (double)INFINITY;
    f->parts = (struct mill_span){0, 0};
    f->counts = counts;
}

/* The result of a search for a contact */
enum mill_hit_state {
    MILL_HIT_NONE,     /* no contact within the horizon */
    MILL_HIT_CONTACT,  /* the first contact, at t */
    MILL_HIT_ASK_AGAIN /* certainly no contact before t > 0; continue the search from there */
};

struct mill_hit {
    enum mill_hit_state state;
    double t; /* [s] from now; INFINITY: no contact */
};

/* A contact at t, or none where t is INFINITY */
static inline struct mill_hit mill_hit_at(double t)
{
    return (struct mill_hit){t < (double)INFINITY ? MILL_HIT_CONTACT : MILL_HIT_NONE, t};
}

struct mill_contact {
    vec3 normal;   /* unit, from the surface into the ball */
    vec3 point;    /* [m] where ball and surface touch */
    vec3 velocity; /* [m/s] of the surface there */
    double gap;    /* [m] between the ball's surface and the shape, < 0: overlap */
};

/* Of a ball whose centre is at distance d [m] from the surface, in the direction n */
static inline struct mill_contact mill_shape_touch(vec3 centre, double d, vec3 n, double radius,
                                                   const struct mill_pose *pose)
{
    const vec3 point = vec3_axpy(centre, -d, n);
    return (struct mill_contact){n, point, mill_pose_velocity(pose, point), d - radius};
}

/* [m] a search by steps takes a gap below this as closed: about 50 rounding errors of a position */
#define MILL_SHAPE_CLOSED 1e-15

struct mill_shape;

/* How balls meet a kind of surface. Poses are those of its motion; mill_pose_still without one. */
struct mill_shape_type {
    size_t size; /* of its struct */
    /* Fills what its struct has in addition to struct mill_bodied, all of which is set; the rest is
     * zero. false: out of memory; `free` is called in any case. NULL: nothing to fill */
    bool (*create)(struct mill_shape *);
    void (*free)(struct mill_shape *); /* all that it allocated, except its struct; NULL: nothing */
    /* The first contact within `horizon` [s] of local time `now` [s], horizon included. touching:
     * the ball has had a contact with this shape at this moment. */
    struct mill_hit (*next_contact)(const struct mill_shape *, const struct mill_flight *,
                                    double radius, double now, double horizon, bool touching);
    /* The contact with the nearest point of the shape, at any distance */
    struct mill_contact (*contact)(const struct mill_shape *, vec3 centre, double radius,
                                   const struct mill_pose *);
    /* false: no ball of this radius with its centre in the box [lo, hi] can ever touch the shape,
     * at any time of its motion. It may be true without need, but never false by mistake. */
    bool (*reachable)(const struct mill_shape *, vec3 lo, vec3 hi, double radius);
    /* true: the ball, with velocity v, also touches the shape at a second place and closes on it;
     * *contact is the contact there. NULL: no ball ever touches this shape at two places. */
    bool (*beside)(const struct mill_shape *, vec3 centre, vec3 v, double radius,
                   const struct mill_pose *, struct mill_contact *contact);
    /* The contacts with all places of the shape that the ball overlaps and that are nearer to its
     * centre than all places around them, `most` at most; returns how many. If it overlaps none:
     * 1, the nearest place. NULL: there is one at most, and `contact` gives it. */
    int (*places)(const struct mill_shape *, vec3 centre, double radius, const struct mill_pose *,
                  struct mill_contact *contact, int most);
    /* The parts that such a ball can touch, none if it cannot reach the shape; NULL: the shape has
     * no parts. Every flight within the box gets these parts in `parts`. */
    struct mill_span (*parts)(const struct mill_shape *, vec3 lo, vec3 hi, double radius);
    /* The sector for such a ball, of a body that turns about a line at rest; NULL: any angle */
    struct mill_sector (*sector)(const struct mill_shape *, vec3 lo, vec3 hi, double radius);
};

struct mill_solid;

/* Every shape starts with this. */
struct mill_shape {
    const struct mill_shape_type *type;
    const struct mill_solid *solid;   /* of its body */
    int wall;                         /* its number among the walls of a container; -1: all of it */
    const struct mill_motion *motion; /* the motion that moves it; NULL: none */
    int kind;                         /* of its contacts: a kind of the world */
    int number;    /* among its kind: end wall 0 (x < 0) or 1, blade 0..; -1: the only one */
    bool pinches;  /* it can pinch balls */
    bool fixed;    /* the distance of any point of space from it never changes */
    double hollow; /* [m] minimum radius of surfaces that curve around the ball; 0: none */
};

/* Its pose at local time t [s] */
static inline struct mill_pose mill_shape_pose(const struct mill_shape *shape, double t)
{
    return mill_motion_pose(shape->motion, t);
}

/* Distance of the ball's surface from the shape [m]; < 0: depth of the overlap */
static inline double mill_shape_gap(const struct mill_shape *shape, vec3 centre, double radius,
                                    const struct mill_pose *pose)
{
    return shape->type->contact(shape, centre, radius, pose).gap;
}

/* All contacts of a ball that may overlap the shape: see `places` of struct mill_shape_type */
static inline int mill_shape_places(const struct mill_shape *shape, vec3 centre, double radius,
                                    const struct mill_pose *pose, struct mill_contact *contact,
                                    int most)
{
    if (shape->type->places)
        return shape->type->places(shape, centre, radius, pose, contact, most);
    *contact = shape->type->contact(shape, centre, radius, pose);
    return 1;
}

/* The contact of a ball that is due to meet the shape; of two places, the one that it closes on */
static inline struct mill_contact mill_shape_meet(const struct mill_shape *shape, vec3 r, vec3 v,
                                                  double radius, const struct mill_pose *pose)
{
    const struct mill_contact k = shape->type->contact(shape, r, radius, pose);
    struct mill_contact other;
    if (shape->type->beside && vec3_dot(vec3_sub(v, k.velocity), k.normal) >= 0.0 &&
        shape->type->beside(shape, r, v, radius, pose, &other))
        return other;
    return k;
}

/* [s] until a ball's centre first touches the circular cylinder of radius rho about the line (y0,
 * z0) along x, from inside (s = 1) or from outside (s = -1). In the plane normal to x a flight is a
 * parabola p(t), and |p|^2 = rho^2 is a quartic with leading coefficient g^2/4 (a quadratic if
 * gravity has no component in this plane). With s, it rises when the gap closes. */
static inline double mill_shape_circle(const struct mill_flight *f, double y0, double z0,
                                       double rho, double s, double horizon, bool touching)
{
    const double y = f->r.y - y0, z = f->r.z - z0;
    const double p[5] = {
        s * (y * y + z * z - rho * rho),
        s * 2.0 * (y * f->v.y + z * f->v.z),
        s * (f->v.y * f->v.y + f->v.z * f->v.z + y * f->g.y + z * f->g.z),
        s * (f->v.y * f->g.y + f->v.z * f->g.z),
        s * 0.25 * (f->g.y * f->g.y + f->g.z * f->g.z),
    };
    return mill_poly_first_rise(p, horizon, touching, f->counts);
}

#endif
