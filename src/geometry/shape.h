/* A surface that balls meet: drum, end wall, shaft, blade, body. One shape = one file behind this
 * interface. Shapes never change; the pose of what moves is handed in. All of them keep one
 * contract for a contact: the first time at which gap <= 0 and the gap is closing (Bannerman et al.
 * 2014, arXiv 1211.6718). */
#ifndef MILLSIM_SHAPE_H
#define MILLSIM_SHAPE_H

#include "base/key.h"
#include "base/profile.h"
#include "millsim/kinds.h"
#include "millsim/motion.h"
#include "millsim/poly.h"

#include <stdint.h>

/* Some of a shape's parts: `count` of them from number `first` on, the first coming after the last.
 * Count 0: not known, so all. */
struct mill_span {
    int16_t first, count;
};

/* When can a body that turns about a line that stands still be met by a ball in some box? Only
 * while cos(angle) y + sin(angle) z >= cos, the angle that of its motion. */
struct mill_sector {
    double y, z, cos;
};

/* A ball's free flight from "now" on: r + v t + g t^2 / 2 */
struct mill_flight {
    vec3 r, v, g; /* [m], [m/s], [m/s^2] */
    double pull;  /* [m/s^2] length of g */
    /* In the frame of the shape's motion as it was lately: the ball's centre, and how much farther
     * than its radius it may reach until the horizon, whatever the motion has done since [m].
     * INFINITY: not known. */
    vec3 place;
    double travel;
    struct mill_span parts; /* which the ball can meet where it flies, of a shape that has parts */
};

/* What a search for a contact has found */
enum mill_hit_state {
    MILL_HIT_NONE,     /* no contact within the horizon */
    MILL_HIT_CONTACT,  /* the first one, at t */
    MILL_HIT_ASK_AGAIN /* certainly no contact before t > 0; the search has to go on from there */
};

struct mill_hit {
    enum mill_hit_state state;
    double t; /* [s] from now; INFINITY: none */
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

/* [m] a search by steps takes a gap below this for closed: some 50 roundings of a position */
#define MILL_SHAPE_CLOSED 1e-15

/* The room of the container: every other shape ends where it begins */
struct mill_chamber {
    struct mill_profile drum; /* its cross-section; of a body the circle around it */
    double half_length;       /* [m] */
    struct mill_reach places; /* of the laboratory that it ever comes into */
};

/* The mill that a form has to fit into */
struct mill_shape_fit {
    double bore;         /* [m] how near the drum's wall comes to the axis */
    bool wavy;           /* where it has buckles */
    double length;       /* [m] of the drum */
    double shaft_radius; /* [m] 0: no shaft */
    bool spread;         /* one of equal ones, whose places follow from their number */
};

/* How wide a ball finds the gaps between a form and the drum, and between it and the nearer end
 * wall [m]; and the keys that set them */
struct mill_shape_gaps {
    double drum, wall;
    const char *drum_key, *wall_key;
};

enum { MILL_SHAPE_FAULT = 200 }; /* characters of a fault */

/* A container that is a body is made of walls, each a surface of its own. In the body's frame: */
struct mill_wall {
    bool flat;
    vec3 point, normal; /* [m], unit into the mill: of a flat one */
    double radius;      /* [m] of a round one about z, at z = 0 */
    double slope;       /* of the radius along z, where it has no end */
    double half;        /* [m] half of its straight part, round ends beyond it; INFINITY: no end */
};
enum { MILL_WALLS = 6 }; /* of a body, at most */

/* What encloses a body, in its frame: the place nearer than `radius` [m] to the line from -half to
 * +half on its z axis [m] */
struct mill_hull {
    double half, radius;
};

struct mill_body;
struct mill_mesh;
struct mill_shape;

/* A kind of shape. Poses are those of the shape's motion; what stands still has mill_pose_still. */
struct mill_shape_type {
    const char *name; /* "blade", "end wall": in messages, and of a deck's sections [blade.NAME] */
    enum mill_kind kind; /* of its contacts; MILL_BALL_BALL: that of the body */
    bool pinches;        /* may press a ball against another body, and lets it go then */
    /* Of kinds that a deck can name, those listed in mill_shapes_named: */
    bool on_rotor;              /* the rotor carries them; else they stand still */
    const struct mill_key *key; /* the numbers of the form */
    size_t form;                /* its size */
    /* What is wrong with a form in this mill: the key to mend, and a sentence in `text`. NULL:
     * nothing is. */
    const char *(*fault)(const void *form, const struct mill_shape_fit *,
                         char text[MILL_SHAPE_FAULT]);
    /* Gaps in which it can pinch balls; NULL: it has none */
    struct mill_shape_gaps (*gaps)(const void *form, const struct mill_shape_fit *);
    /* Of all kinds: */
    /* Do these numbers, a struct of this kind, make a shape? NULL: the drum's own have none */
    bool (*is_sound)(const void *form);
    size_t size; /* of its struct */
    /* Fills its struct, of zeros but for what all shapes have; form: sound numbers. false: out of
     * memory; freed in any case. */
    bool (*create)(struct mill_shape *, const void *form, const struct mill_chamber *chamber);
    void (*free)(struct mill_shape *); /* what it holds, besides its struct; NULL: nothing */
    /* The first contact within `horizon` [s] of local time `now` [s], the horizon included.
     * touching: the ball has just been in contact with this shape, now. */
    struct mill_hit (*next_contact)(const struct mill_shape *, const struct mill_flight *,
                                    double radius, double now, double horizon, bool touching);
    /* With whatever is nearest of the shape, at any distance. */
    struct mill_contact (*contact)(const struct mill_shape *, vec3 centre, double radius,
                                   const struct mill_pose *);
    /* false: no ball of this radius with its centre in the box [lo, hi] ever touches the shape,
     * wherever its motion takes it. May be true too often, never false wrongly. */
    bool (*reachable)(const struct mill_shape *, vec3 lo, vec3 hi, double radius);
    /* The parts that such a ball can touch, none if it cannot reach the shape; for a shape of many
     * parts, else NULL. Handed back with every flight that stays in the box. */
    struct mill_span (*parts)(const struct mill_shape *, vec3 lo, vec3 hi, double radius);
    /* For such a ball, of a body whose motion turns about a line that stands still; NULL: it may be
     * met at any angle. */
    struct mill_sector (*sector)(const struct mill_shape *, vec3 lo, vec3 hi, double radius);
    /* true: the ball, of velocity v, touches the shape in another place as well, told in *contact,
     * and closes on that. NULL for a shape that no ball ever touches twice. */
    bool (*beside)(const struct mill_shape *, vec3 centre, vec3 v, double radius,
                   const struct mill_pose *, struct mill_contact *contact);
    /* Adds what balls can see of it, in its own frame, no flat farther than `tolerance` [m] from
     * the surface. */
    void (*draw)(const struct mill_shape *, const struct mill_chamber *, double tolerance,
                 struct mill_mesh *);
    /* Of bodies: */
    /* Its walls, as a container; returns how many. NULL: it is one surface from inside as well. */
    int (*walls)(const struct mill_body *, struct mill_wall wall[MILL_WALLS]);
    struct mill_hull (*hull)(const struct mill_body *);
    double (*volume)(const struct mill_body *); /* [m^3] */
    /* Adds its outline in its motion's frame, seen from the side where the balls are. */
    void (*outline)(const struct mill_body *, double tolerance, struct mill_mesh *);
};

/* Every shape starts with this. */
struct mill_shape {
    const struct mill_shape_type *type;
    const struct mill_motion *motion; /* that carries it; NULL: it stands still */
    int kind;                         /* of its contacts: of the world's */
    int number;    /* which of its kind: end wall 0 (x < 0) or 1, blade 0.. ; -1: the only one */
    bool pinches;  /* may press a ball against another body, and lets it go then */
    bool fixed;    /* no point of space ever changes its distance from it */
    double hollow; /* [m] least radius of what is curved around the ball; 0: nothing is */
    struct mill_poly_counts *counts; /* where its solver counts; may be NULL */
};

/* Its pose at local time t [s] */
static inline struct mill_pose mill_shape_pose(const struct mill_shape *shape, double t)
{
    return mill_motion_pose(shape->motion, t);
}

/* Distance of the ball's surface from the shape [m], < 0: they overlap by that much. */
static inline double mill_shape_gap(const struct mill_shape *shape, vec3 centre, double radius,
                                    const struct mill_pose *pose)
{
    return shape->type->contact(shape, centre, radius, pose).gap;
}

/* The contact of a ball that is due to meet the shape: of two places that it touches, the one that
 * it is closing on. */
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

/* [s] until a ball's centre first touches the circular cylinder of radius rho about the line
 * (y0, z0) along x, from within (s = 1) or from outside (s = -1). In the plane across x a flight is
 * a parabola p(t), and |p|^2 = rho^2 a quartic with leading coefficient g^2/4 (a quadratic where
 * gravity has no component there); the sign makes it rise where the gap closes. */
static inline double mill_shape_circle(const struct mill_flight *f, double y0, double z0,
                                       double rho, double s, double horizon, bool touching,
                                       struct mill_poly_counts *counts)
{
    const double y = f->r.y - y0, z = f->r.z - z0;
    const double p[5] = {
        s * (y * y + z * z - rho * rho),
        s * 2.0 * (y * f->v.y + z * f->v.z),
        s * (f->v.y * f->v.y + f->v.z * f->v.z + y * f->g.y + z * f->g.z),
        s * (f->v.y * f->g.y + f->v.z * f->g.z),
        s * 0.25 * (f->g.y * f->g.y + f->g.z * f->g.z),
    };
    return mill_poly_first_rise(p, horizon, touching, counts);
}

#endif
