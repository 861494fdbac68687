/* A contour as balls meet it: lines, arcs and corners. contour.c has its pieces, contour_meet.c its
 * contacts. All in the body's own x and y, with the balls on the left. */
#ifndef MILL_CONTOUR_H
#define MILL_CONTOUR_H

#include "geometry/shapes.h"

/* A line, an arc of less than half a turn, or a corner that points towards the balls. With q from
 * its middle, its circle is where normal . q = bend q^2: a line is an arc without a bend, so a flat
 * arc needs no far centre. Neighbours that are tangent, and a corner with its neighbours, part the
 * places beside them by one and the same line. */
struct mill_contour_piece {
    double x, y;   /* [m] its middle; of a corner its place */
    double nx, ny; /* unit: its normal there, towards the balls; of a corner 0 */
    double bend; /* [1/m] half of the curvature; > 0: it curves around the balls; of a corner -1 */
    /* A place is beside the piece where from . place >= from[2] and to . place > to[2] [m]. */
    double from[3], to[3];
    double end[2][2]; /* [m] */
    double half;      /* [m] none of its points is farther from the middle; of a corner 0 */
};

/* A square of the plane, and the pieces near to it; small, because there are many */
struct mill_contour_nook {
    float near, beyond; /* [m] no piece is nearer to a place of the square, no other one either */
    int32_t first;
    int16_t count, close; /* `close`: the first ones; one of them is the nearest */
};

struct mill_contour {
    struct mill_bodied body;
    bool plain;            /* its own x and y are y and z of its motion's frame */
    double half;           /* [m] half of its length; INFINITY: other walls are its ends */
    double low, high, far; /* [m] the distances of its points from its axis; far: bound of places */
    int pieces;
    struct mill_contour_piece *piece;
    double corner[2], size; /* [m] of the squares: their corner, the side of one */
    int squares;            /* along each side */
    struct mill_contour_nook *nook;
    int16_t *list; /* the pieces of each square */
};

/* The place in the plane of the contour, and how far it is beyond the ends */
struct mill_contour_spot {
    double x, y, beyond; /* [m]; beyond < 0: at the own z < 0 */
};

static inline struct mill_contour_spot mill_contour_spot_of(const struct mill_contour *c,
                                                            vec3 place)
{
    struct mill_contour_spot s = {place.y, place.z, 0.0};
    if (!c->plain) {
        const vec3 own = mill_body_in(&c->body.is, place);
        s.x = own.x;
        s.y = own.y;
        const double beyond = fabs(own.z) - c->half;
        s.beyond = beyond > 0.0 ? copysign(beyond, own.z) : 0.0;
    }
    return s;
}

/* The nearest point of a piece */
struct mill_contour_view {
    double d;        /* [m] distance in the plane; < 0: the place is behind the piece */
    double nx, ny;   /* unit: from the piece towards the place, if the place is not behind it */
    double straight; /* distance from the centre of its circle over the radius; of a line 1 */
    bool beside;     /* false: its nearest point is an end */
    double out;      /* if so: [m] how far the place is along the normal there */
};

static inline double mill_contour_past(const double line[3], double x, double y)
{
    return line[0] * x + line[1] * y - line[2];
}

static inline bool mill_contour_is_beside(const struct mill_contour_piece *p, double x, double y)
{
    return mill_contour_past(p->from, x, y) >= 0.0 && mill_contour_past(p->to, x, y) > 0.0;
}

/* Is a place before the whole line or circle of a piece by more than `reach` [m]? */
static inline bool mill_contour_is_before(const struct mill_contour_piece *p, double at_x,
                                          double at_y, double reach)
{
    const double x = at_x - p->x, y = at_y - p->y;
    return p->nx * x + p->ny * y - p->bend * (x * x + y * y) > reach * (1.0 - p->bend * reach);
}

/* Is a place behind the chord of an arc that curves away from the balls? There the distance from it
 * is not convex. */
static inline bool mill_contour_is_behind(const struct mill_contour_piece *p, double x, double y)
{
    return p->bend < 0.0 && p->half > 0.0 &&
           p->nx * (x - p->end[0][0]) + p->ny * (y - p->end[0][1]) < 0.0;
}

/* Is the piece certainly farther from a place than `reach` [m]? */
static inline bool mill_contour_is_out_of_reach(const struct mill_contour_piece *p, double at_x,
                                                double at_y, double reach)
{
    const double x = at_x - p->x, y = at_y - p->y, square = x * x + y * y, far = reach + p->half;
    if (square > far * far)
        return true;
    return p->half > 0.0 && 2.0 * p->bend * reach < 1.0 &&
           mill_contour_is_before(p, at_x, at_y, reach);
}

/* [m] the distance of a place from the nearest point of a piece. In a place beside it, `from` is
 * normal . q - bend q^2, of which the distance is a function without cancellation. */
static inline struct mill_contour_view mill_contour_look(const struct mill_contour_piece *p,
                                                         double x, double y)
{
    const double qx = x - p->x, qy = y - p->y, square = qx * qx + qy * qy;
    struct mill_contour_view v = {.beside = mill_contour_is_beside(p, x, y)};
    const double gx = p->nx - 2.0 * p->bend * qx, gy = p->ny - 2.0 * p->bend * qy;
    v.straight = sqrt(gx * gx + gy * gy);
    if (v.beside && p->half > 0.0) {
        const double from = p->nx * qx + p->ny * qy - p->bend * square;
        v.d = 2.0 * from / (1.0 + v.straight);
        v.nx = v.straight > 0.0 ? gx / v.straight : p->nx;
        v.ny = v.straight > 0.0 ? gy / v.straight : p->ny;
        return v;
    }
    const double ax = x - p->end[0][0], ay = y - p->end[0][1];
    const double bx = x - p->end[1][0], by = y - p->end[1][1];
    const double a = ax * ax + ay * ay, b = bx * bx + by * by;
    v.d = sqrt(mill_least(a, b));
    v.nx = v.d > 0.0 ? (a < b ? ax : bx) / v.d : 1.0;
    v.ny = v.d > 0.0 ? (a < b ? ay : by) / v.d : 0.0;
    v.out = a < b ? p->from[0] * ay - p->from[1] * ax : p->to[1] * bx - p->to[0] * by;
    return v;
}

/* The square of a place; all pieces, if it is in none */
struct mill_contour_nook mill_contour_nook_at(const struct mill_contour *c, double x, double y);

/* Piece number i of a square */
static inline int mill_contour_listed(const struct mill_contour *c, struct mill_contour_nook n,
                                      int i)
{
    return n.first < 0 ? i : c->list[n.first + i];
}

/* Number of the piece that is nearest to a place */
int mill_contour_nearest(const struct mill_contour *c, double x, double y);

/* [m] The distances of the nearest and the farthest of its points from its axis */
void mill_contour_reach(const struct mill_body *is, double *low, double *high);

/* create and free of struct mill_shape_type */
bool mill_contour_create(struct mill_shape *shape);
void mill_contour_free(struct mill_shape *shape);

/* parts and reachable of struct mill_shape_type */
struct mill_span mill_contour_parts(const struct mill_shape *shape, vec3 lo, vec3 hi,
                                    double radius);
bool mill_contour_reachable(const struct mill_shape *shape, vec3 lo, vec3 hi, double radius);

/* How balls meet it, from inside and from outside */
extern const struct mill_shape_type mill_contour_surface;

#endif
