/* Solids: what bodies are made of. Each kind is one file with one table. All that the program does
 * with a body asks this table: searches for contacts, bounds of places, the check for bodies that
 * collide, periodic ends, the speed of a tip, the room for balls, wear, pictures. */
#ifndef MILL_SOLID_H
#define MILL_SOLID_H

#include "base/key.h"
#include "geometry/shape.h"
#include "millsim/setup.h"

struct mill_mesh;

/* [m] no length of a body is smaller */
#define MILL_SOLID_LEAST 1e-9

/* A convex solid in its own frame: all that is within `grown` of the core, which `support` gives */
struct mill_core {
    double grown;     /* [m] */
    vec3 half;        /* [m] of a box: half of its sides; of a frustum only half.z */
    double shift;     /* [m] z of the frustum's centre */
    double low, high; /* [m] of a frustum: its radii at shift - half.z and shift + half.z */
    vec3 corner[3];   /* [m] of a triangle, a line or a point */
};

/* A container consists of walls. Each is a surface of its own. In the body's own frame: */
struct mill_wall {
    bool flat;
    vec3 point, normal; /* [m], unit into the mill: of a flat wall */
    double radius;      /* [m] of a round wall about z, at z = 0 */
    double slope;       /* change of the radius along z, if it has no round ends */
    double half;        /* [m] half of the straight part between round ends; INFINITY: no ends */
    const struct mill_shape_type *own; /* how balls meet it; NULL: as all walls (wall.c) */
};
enum { MILL_WALLS = 6 /* of one body, at most */, MILL_SOLID_WHOLE = -1 };

/* A volume that encloses a body, in its frame: all places within `radius` [m] of the line from
 * -half to +half [m] on one of its axes */
struct mill_hull {
    double half, radius;
    int axis; /* 0, 1, 2: its z, x or y */
};

struct mill_solid {
    const struct mill_shape_type *surface; /* how balls meet it from outside, or the whole of it */
    /* Are its sizes valid? */
    bool (*is_sound)(const struct mill_body *);
    double (*volume)(const struct mill_body *); /* [m^3] */
    /* Adds its outline in its motion's frame, seen from the side of the balls, with flats about
     * `tolerance` [m] from the surface; their number is limited. wall: adds only what this
     * wall of a container shows; or MILL_SOLID_WHOLE */
    void (*outline)(const struct mill_body *, int wall, double tolerance, struct mill_mesh *);
    /* Its core, and the point of the core that is farthest in a direction, which need not be of
     * length 1. NULL: it is not convex; the facets of its outline stand for it. */
    struct mill_core (*core)(const struct mill_body *);
    vec3 (*support)(const struct mill_core *, vec3 way);
    /* Its walls, if it is a container; returns their number. NULL: it is one surface, also from
     * inside, or it can only be met from outside (is_sound). */
    int (*walls)(const struct mill_body *, struct mill_wall wall[MILL_WALLS]);
    /* A hull of its own, narrower than the one from the support. NULL: from the support */
    struct mill_hull (*hull)(const struct mill_body *);
    const struct mill_key *key; /* its sizes in a deck: members of struct mill_body */
    bool round, ball;           /* a body of revolution about its own z; about any axis */
    /* What replaces it where it does not only turn about the x axis. NULL: it is no drum */
    const struct mill_solid *moving;
};

/* Keys that several solids have; in a mill of ten kilometres the resolution of a place is 2e-12 m,
 * in a larger one overlaps could exceed a nanometre. */
#define MILL_SOLID_AT(member) .offset = offsetof(struct mill_body, member)
#define MILL_SOLID_SIZE .unit = "m", .lo = MILL_SOLID_LEAST, .hi = 1e4
#define MILL_SOLID_WIDTH .unit = "m", .lo = 2.0 * MILL_SOLID_LEAST, .hi = 2e4, .factor = 0.5
#define MILL_SOLID_RADIUS "radius", "radius of the body", MILL_SOLID_SIZE, MILL_SOLID_AT(radius)
#define MILL_SOLID_DIAMETER                                                                        \
    "diameter", "diameter of the body", MILL_SOLID_WIDTH, .instead = "radius", MILL_SOLID_AT(radius)
#define MILL_SOLID_LENGTH                                                                          \
    "length", "length along its own z; of a capsule without its round ends", MILL_SOLID_SIZE,      \
        MILL_SOLID_AT(length)
#define MILL_SOLID_ROUNDING                                                                        \
    "rounding", "radius of its rounded edges",                                                     \
        .unit = "m", .lo = 0, .hi = 1e4, .preset = "0 m", MILL_SOLID_AT(rounding),                 \
        .hidden = mill_solid_is_inside,                                                            \
        .needs = "a container's edges are not rounded: leave it out"
bool mill_solid_is_inside(const void *body);

/* Is this a length that a body can have: at least MILL_SOLID_LEAST, or, if `none`, zero? */
bool mill_solid_is_length(double length, bool none);

/* Do these numbers describe a body of this solid: are its sizes valid, its centre and axes finite,
 * and the axes unit, orthogonal and right-handed? Can it hold the balls, if they are inside? */
bool mill_solid_is_sound(const struct mill_solid *solid, const struct mill_body *body);

/* The words for the solids of a deck, with '|' between them */
#define MILL_SOLID_WORD(word, solid) "|" #word
#define MILL_SOLID_WORDS (&MILL_SOLID_LIST(MILL_SOLID_WORD)[1])

/* [m] How far the core reaches along each of its own axes */
vec3 mill_solid_extents(const struct mill_solid *solid, const struct mill_core *core);

/* The hull: of a container about its own z, of another body about its longest axis */
struct mill_hull mill_solid_hull(const struct mill_solid *solid, const struct mill_body *body);

/* Conversion between the body's own axes and its motion's frame */
static inline vec3 mill_body_turn_in(const struct mill_body *b, vec3 a)
{
    return vec3_make(vec3_dot(b->x, a), vec3_dot(b->y, a), vec3_dot(b->z, a));
}

static inline vec3 mill_body_turn_out(const struct mill_body *b, vec3 a)
{
    return vec3_axpy(vec3_axpy(vec3_scale(b->x, a.x), a.y, b->y), a.z, b->z);
}

static inline vec3 mill_body_in(const struct mill_body *b, vec3 place)
{
    return mill_body_turn_in(b, vec3_sub(place, b->centre));
}

static inline vec3 mill_body_out(const struct mill_body *b, vec3 place)
{
    return vec3_add(b->centre, mill_body_turn_out(b, place));
}

/* ---- convex parts (part.c) ---- */

/* A convex part of a body: its core at a place in some frame */
struct mill_part {
    vec3 (*support)(const struct mill_core *, vec3 way);
    struct mill_core core;
    vec3 centre, x, y, z; /* [m], unit */
    double around;        /* [m] no point of the part is farther from the centre */
};

/* A convex body as its own part */
struct mill_part mill_part_of(const struct mill_solid *solid, const struct mill_body *body);

/* The parts of a body: itself, or facets of its outline. false: out of memory. Owner: the caller */
bool mill_part_list(const struct mill_solid *solid, const struct mill_body *body,
                    struct mill_part **part, int32_t *count);

/* A triangle, a line (b = c) or a point, grown by a distance [m] */
struct mill_part mill_part_facet(vec3 a, vec3 b, vec3 c, double grown);

/* The part in another frame. `to`: the pose of the part's frame in that frame */
struct mill_part mill_part_move(const struct mill_part *part, const struct mill_pose *to);

/* The point of the core that is farthest in a direction */
static inline vec3 mill_part_support(const struct mill_part *p, vec3 way)
{
    const vec3 own = {vec3_dot(p->x, way), vec3_dot(p->y, way), vec3_dot(p->z, way)};
    const vec3 at = p->support(&p->core, own);
    return vec3_axpy(vec3_axpy(vec3_axpy(p->centre, at.x, p->x), at.y, p->y), at.z, p->z);
}

/* Maximum of way . p over all points p of the part */
static inline double mill_part_extent(const struct mill_part *p, vec3 way)
{
    return vec3_dot(way, mill_part_support(p, way)) + p->core.grown * vec3_norm(way);
}

/* [m] Distance of a place from a wall, both in the body's own frame; < 0: it is outside */
double mill_part_wall_gap(const struct mill_wall *wall, vec3 place);

/* Bounds of the gap between the part and a wall, in one frame; < 0: the part is beyond the wall.
 * They differ by less than 0.01 % of the gap (1 % at round ends) or 5 % of `near` [m]. */
struct mill_part_gap {
    double least, most; /* [m] */
    long looks;         /* how often the part was asked for its support: the work done */
};
struct mill_part_gap mill_part_to_wall(const struct mill_part *part, const struct mill_wall *wall,
                                       double near);

/* A frame whose z axis goes through a point in this direction, of length 1 */
struct mill_pose mill_part_frame(vec3 through, vec3 direction);

#endif
