/* A surface that balls meet: drum, end wall, shaft, blade, body. Each shape is one file behind this
 * interface. A shape never changes; the pose of a moving shape is an argument. All shapes define a
 * contact in the same way: it is the first time at which gap <= 0 and the gap is closing (Bannerman
 * et al. 2014, arXiv 1211.6718). */
#ifndef MILLSIM_SHAPE_H
#define MILLSIM_SHAPE_H

#include "base/key.h"
#include "base/profile.h"
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

/* The cosine of the sum of two angles of at most a right angle, from their sines */
static inline double mill_sector_cos(double s, double t)
{
    return sqrt((1.0 - s * s) * (1.0 - t * t)) - s * t;
}

/* A ball's free flight from now on: r + v t + g t^2 / 2 */
struct mill_flight {
    vec3 r, v, g; /* [m], [m/s], [m/s^2] */
    double pull;  /* [m/s^2] length of g */
    /* place: the ball's centre in a recent frame of the shape's motion [m]. travel: the ball's
     * surface stays within radius + travel of this place until the horizon; the movement of the
     * frame since then is included [m]. travel INFINITY: not known. */
    vec3 place;
    double travel;
    struct mill_span parts; /* the parts that the ball can meet, of a shape that has parts */
    struct mill_poly_counts *counts; /* of solvers; may be NULL */
};

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

/* [m] a search by steps takes a gap below this as closed: about 50 rounding errors of a position */
#define MILL_SHAPE_CLOSED 1e-15

/* The room inside the container, which bounds all other shapes */
struct mill_chamber {
    struct mill_profile drum; /* its cross-section; for a body: the circle around it */
    double half_length;       /* [m] */
    struct mill_reach places; /* all places of the laboratory that it reaches */
};

/* Data of the mill, to check whether a form fits into it */
struct mill_shape_fit {
    double bore;         /* [m] minimum distance of the drum's wall from the axis */
    bool wavy;           /* the wall has buckles */
    double length;       /* [m] of the drum */
    double shaft_radius; /* [m] 0: no shaft */
    bool spread;         /* one of a set of equal shapes, whose places follow from their number */
};

/* The clearances between a form and the drum, and between it and the nearer end wall [m], and the
 * keys that set them */
struct mill_shape_gaps {
    double drum, wall;
    const char *drum_key, *wall_key;
};

enum { MILL_SHAPE_FAULT = 200 }; /* maximum length of a fault's text */

/* A container that is a body consists of walls. Each is a surface of its own. In the body's
 * frame: */
struct mill_wall {
    bool flat;
    vec3 point, normal; /* [m], unit into the mill: of a flat wall */
    double radius;      /* [m] of a round wall about z, at z = 0 */
    double slope;       /* change of the radius along z, if it has no round ends */
    double half;        /* [m] half of the straight part between round ends; INFINITY: no ends */
};
enum { MILL_WALLS = 6 }; /* of one body, at most */

/* A volume that encloses a body, in its frame: all places within `radius` [m] of the line from
 * -half to +half [m] on its z axis */
struct mill_hull {
    double half, radius;
};

struct mill_body;
struct mill_mesh;
struct mill_shape;

/* A kind of shape. Poses are poses of the shape's motion; without a motion it is
 * mill_pose_still. */
struct mill_shape_type {
    const char *name; /* "blade", "end wall": in messages, and in a deck's sections [blade.NAME] */
    enum mill_kind kind; /* of its contacts; MILL_BALL_BALL: the kind of the body */
    bool pinches;        /* it can pinch balls */
    /* Only for the kinds in mill_shapes_named, which a deck can name: */
    bool on_rotor;              /* they are on the rotor; else they do not move */
    const struct mill_key *key; /* keys for the numbers of the form */
    size_t form;                /* its size */
    /* What is wrong with a form in this mill: returns the key to mend, and a sentence in `text`.
     * NULL: no fault. */
    const char *(*fault)(const void *form, const struct mill_shape_fit *,
                         char text[MILL_SHAPE_FAULT]);
    /* Clearances in which it can pinch balls; NULL: it has none */
    struct mill_shape_gaps (*gaps)(const void *form, const struct mill_shape_fit *);
    /* For all kinds: */
    /* Do these numbers, a struct of this kind, describe a valid shape? NULL: the drum's own
     * surfaces, which have no numbers */
    bool (*is_sound)(const void *form);
    size_t size; /* of its struct */
    /* Fills its struct, in which the caller has set the members of struct mill_shape; the rest is
     * zero. form: valid numbers. false: out of memory; `free` is called in any case. */
    bool (*create)(struct mill_shape *, const void *form, const struct mill_chamber *chamber);
    void (*free)(struct mill_shape *); /* frees all that it allocated, except its struct; NULL:
                                          nothing to free */
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
    /* The parts that such a ball can touch, none if it cannot reach the shape; NULL: the shape has
     * no parts. Every flight within the box gets these parts in `parts`. */
    struct mill_span (*parts)(const struct mill_shape *, vec3 lo, vec3 hi, double radius);
    /* The sector for such a ball, of a body whose motion turns about a line at rest; NULL: the ball
     * may be met at any angle. */
    struct mill_sector (*sector)(const struct mill_shape *, vec3 lo, vec3 hi, double radius);
    /* true: the ball, with velocity v, also touches the shape at a second place and closes on it;
     * *contact is the contact there. NULL: no ball ever touches this shape at two places. */
    bool (*beside)(const struct mill_shape *, vec3 centre, vec3 v, double radius,
                   const struct mill_pose *, struct mill_contact *contact);
    /* Adds the surface that balls can reach, in its own frame. No flat is farther than `tolerance`
     * [m] from the surface. */
    void (*draw)(const struct mill_shape *, const struct mill_chamber *, double tolerance,
                 struct mill_mesh *);
    /* Sets the frame in which the faces of the shape lie along the axes, in coordinates of its
     * motion's frame. true: the shape can turn about x of this frame without a change. NULL: it is
     * the motion's frame, and the shape is flat. */
    bool (*chart)(const struct mill_shape *, struct mill_pose *frame);
    /* Only for bodies: */
    /* Its walls, if it is a container; returns their number. NULL: it is one surface, also from
     * inside. */
    int (*walls)(const struct mill_body *, struct mill_wall wall[MILL_WALLS]);
    struct mill_hull (*hull)(const struct mill_body *);
    double (*volume)(const struct mill_body *); /* [m^3] */
    /* Adds its outline in its motion's frame, seen from the side of the balls. */
    void (*outline)(const struct mill_body *, double tolerance, struct mill_mesh *);
};

/* Every shape starts with this. */
struct mill_shape {
    const struct mill_shape_type *type;
    const struct mill_motion *motion; /* the motion that moves it; NULL: none */
    int kind;                         /* of its contacts: a kind of the world */
    int number;    /* its number among its kind: end wall 0 (x < 0) or 1, blade 0..; -1: the only
                      one */
    bool pinches;  /* it can pinch balls */
    bool fixed;    /* the distance of any point of space from it never changes */
    double hollow; /* [m] minimum radius of surfaces that curve around the ball; 0: none */
};

/* `chart` of surfaces about the x axis of their motion's frame */
static inline bool mill_shape_chart(const struct mill_shape *shape, struct mill_pose *frame)
{
    (void)shape;
    *frame = mill_pose_still;
    frame->about_x = true; /* fewer operations */
    return true;
}

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

/* The contact of a ball that is due to meet the shape. If the ball touches two places, it is the
 * place that it closes on. */
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
 * gravity has no component in this plane). The sign s makes the polynomial rise when the gap
 * closes. */
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
