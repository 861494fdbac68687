/* When does a flying ball meet a contour, from inside or as a body from outside, at rest or
 * turning? Against a march along the gap, which comes from the corners alone (contour_oracle.h) and
 * moves on by a bound of its speed (Lipschitz): before the time returned the ball is nowhere inside
 * the solid, and at that time it touches and does not move away; where none is returned it never is
 * inside. Then the ball rebounds, and the same is asked of its next flight, which begins at the
 * wall. */
#include "../unit/contour_oracle.h"
#include "../unit/lone_shape.h"
#include "fuzz.h"

#include "millsim/lining.h"

#define TOLERANCE 1e-9 /* [m] the promise about overlaps */
#define TOUCHING 1e-12 /* [m] wider than what rounding leaves of a gap at a contact */
enum { MOST_MARCH = 1000, MOST_HOPS = 8, MOST_ASKED = 50 };

struct shot {
    struct contour contour;
    struct mill_body body;
    struct mill_turn turn;
    struct mill_motion *motion; /* NULL: it stands */
    struct mill_flight flight;
    double radius, now, horizon, restitution, floor;
    bool boxed; /* asks for the pieces in reach only */
    struct mill_shape *shape;
};

/* ---- the gap, once more ---- */

static vec3 place(const struct shot *s, double t)
{
    return vec3_fly(s->flight.r, s->flight.v, s->flight.g, t);
}

/* [m] distance of a ball's centre from the solid, < 0 within it, at t */
static double depth(const struct shot *s, vec3 r, double t)
{
    const long double angle =
        s->motion ? s->turn.angle + (long double)s->turn.speed * (s->now + t) : 0.0L;
    const long double c = cosl(angle), n = sinl(angle);
    const vec3 o = s->turn.centre;
    const long double y = (long double)r.y - o.y, z = (long double)r.z - o.z;
    const double d =
        (double)contour_distance(&s->contour, o.y + c * y + n * z, o.z + c * z - n * y);
    const double past = fabs(r.x) - 0.5 * s->body.length;
    if (s->body.inside)
        return d;
    if (past > 0.0)
        return d > 0.0 ? past : hypot(d, past);
    return d > 0.0 ? -fmin(d, -past) : -d;
}

/* ---- from bytes ---- */

static void add_corner(struct contour *c, double r, double angle, double bulge)
{
    c->corner[c->n++] = (struct mill_corner){r * cos(angle), r * sin(angle), bulge};
}

static double bulge(struct fuzz_bytes *b)
{
    const int k = fuzz_choice(b, 6);
    const double size = k < 4 ? fuzz_uniform(b, 0.0, 1.0) : fuzz_log(b, 1e-16, 10.0);
    return k == 0 ? 0.0 : k % 2 ? size : -size;
}

static void make_lining(struct contour *c, struct fuzz_bytes *b, int form)
{
    struct mill_lining is = {.form = form,
                             .radius = fuzz_choice(b, 2) ? fuzz_log(b, 1e-3, 10.0) : 0.075};
    is.count = form == MILL_LINING_LIFTERS ? 1 + fuzz_choice(b, 24) : 2 + fuzz_choice(b, 24);
    is.angle = fuzz_choice(b, 2) ? fuzz_uniform(b, -7.0, 7.0) : 0.0;
    is.height =
        is.radius * (fuzz_choice(b, 2) ? fuzz_uniform(b, 0.0, 0.5) : fuzz_log(b, 1e-13, 1.0));
    is.height = fmin(is.height, 0.99 * is.radius);
    is.second = fuzz_choice(b, 2) ? is.height : is.radius * fuzz_log(b, 1e-9, 0.9);
    is.width = is.radius * fuzz_log(b, 1e-6, 0.5);
    is.front = fuzz_uniform(b, -1.0, 1.5);
    is.back = fuzz_choice(b, 2) ? is.front : fuzz_uniform(b, -1.0, 1.5);
    is.rounding = fuzz_choice(b, 2) ? is.width * fuzz_log(b, 1e-6, 1.0) : 0.0;
    for (int k = 0; k < MILL_LINING_WAVES && form == MILL_LINING_HARMONICS; k++) {
        is.wave[k] = is.radius * fuzz_uniform(b, -0.2, 0.2);
        is.lean[k] = fuzz_choice(b, 2) ? is.radius * fuzz_uniform(b, -0.2, 0.2) : 0.0;
    }
    if (mill_lining_most(&is) <= MOST_CORNERS)
        c->n = mill_lining_corners(&is, c->corner);
}

/* Corners around the axis; some in steps back, so that they overhang */
static void make_corners(struct contour *c, struct fuzz_bytes *b)
{
    const int n = 2 + fuzz_choice(b, 24);
    const double r = fuzz_choice(b, 2) ? fuzz_log(b, 1e-3, 10.0) : 0.075;
    for (int k = 0; k < n; k++) {
        const int how = fuzz_choice(b, 4);
        const double share = how < 2    ? 0.5
                             : how == 2 ? fuzz_log(b, 1e-6, 1.0)
                                        : -fuzz_uniform(b, 0.0, 1.0);
        const double far = r * (fuzz_choice(b, 2) ? 1.0 : fuzz_uniform(b, 0.1, 1.0));
        add_corner(c, far, 2.0 * MILL_PI * (k + 2.0 * share) / n, bulge(b));
    }
}

/* false: it is no contour */
static bool make_contour(struct contour *c, struct fuzz_bytes *b)
{
    size_t at[2];
    const int form = fuzz_choice(b, 4);
    if (form == 3)
        make_corners(c, b);
    else
        make_lining(c, b, MILL_LINING_WAVY + form);
    for (size_t k = 0; k < c->n; k++)
        if (!mill_solid_is_length(hypot(c->corner[(k + 1) % c->n].x - c->corner[k].x,
                                        c->corner[(k + 1) % c->n].y - c->corner[k].y),
                                  false))
            return false;
    contour_measure(c);
    return c->n > 1 && !mill_lining_crosses(c->corner, c->n, at) &&
           mill_lining_area(c->corner, c->n) > 0.0;
}

/* A place next to the contour's line, `off` [m] from it towards the balls, and the normal there */
static vec3 beside_side(const struct shot *s, struct fuzz_bytes *b, double off, vec3 *normal)
{
    const struct contour *c = &s->contour;
    const size_t k = (size_t)fuzz_bits(b, 2) % c->n;
    const struct mill_corner *p = &c->corner[k], *q = &c->corner[(k + 1) % c->n];
    const int how = fuzz_choice(b, 4);
    const double share = how == 0   ? 0.0
                         : how == 1 ? 0.5
                         : how == 2 ? fuzz_log(b, 1e-16, 1.0)
                                    : fuzz_uniform(b, 0.0, 1.0);
    vec3 on = contour_at(p, q, share, normal);
    if (!s->body.inside) {
        *normal = vec3_scale(*normal, -1.0);
        on.x = s->body.length * fuzz_uniform(b, -0.6, 0.6);
    }
    return vec3_axpy(on, off, *normal);
}

static double ball_radius(const struct contour *c, struct fuzz_bytes *b)
{
    const struct mill_corner *p = &c->corner[fuzz_bits(b, 2) % c->n];
    const double u = fabs(p->bulge), most = 0.5 * c->far;
    const double around = 0.25 * c->reach[p - c->corner] * (1.0 + u * u) / fmax(u, 1e-3);
    switch (fuzz_choice(b, 4)) {
    case 1: /* nearly as wide as an arc, or hardly wider */
        return fmin(most,
                    around * (1.0 + (fuzz_choice(b, 2) ? 1.0 : -1.0) * fuzz_log(b, 1e-16, 0.5)));
    case 2:
        return most * fuzz_log(b, 1e-4, 1.0);
    default:
        return fmin(0.3 * around, 0.3 * most);
    }
}

static void aim(struct shot *s, struct fuzz_bytes *b)
{
    const double speed = fuzz_choice(b, 5) ? fuzz_log(b, 1e-9, 1e3) : 0.0, far = s->contour.far;
    vec3 n = {0.0, 0.0, 1.0};
    if (fuzz_choice(b, 3)) {
        const double off = fuzz_choice(b, 2) ? fuzz_log(b, 1e-16, 1.0) * far : 0.0;
        s->flight.r = beside_side(s, b, s->radius + off, &n);
    } else {
        const double a = fuzz_uniform(b, 0.0, 2.0 * MILL_PI),
                     r = 1.2 * far * fuzz_uniform(b, 0.0, 1.0);
        s->flight.r = vec3_make(0.0, r * cos(a), r * sin(a));
    }
    const double t = s->horizon * fuzz_log(b, 1e-6, 1.0);
    switch (fuzz_choice(b, 4)) {
    case 0:
        s->flight.v = vec3_scale(fuzz_direction(b), speed);
        break;
    case 1: /* along the wall, nearly */
        s->flight.v = vec3_scale(vec3_make(0.0, -n.z, n.y), fuzz_choice(b, 2) ? speed : -speed);
        s->flight.v = vec3_axpy(s->flight.v, speed * fuzz_log(b, 1e-16, 1.0), n);
        break;
    case 2: /* away from it, into it, or away from the axis */
        s->flight.v = vec3_scale(n, fuzz_choice(b, 2) ? speed : -speed);
        break;
    default: /* to arrive somewhere at the wall after t */
        s->flight.v = vec3_scale(vec3_sub(beside_side(s, b, s->radius, &n), s->flight.r), 1.0 / t);
        s->flight.v = vec3_axpy(s->flight.v, -0.5 * t, s->flight.g);
        break;
    }
}

/* false: these bytes make none */
static bool make_shot(struct shot *s, struct fuzz_bytes *b)
{
    memset(s, 0, sizeof *s);
    if (!make_contour(&s->contour, b))
        return false;
    const struct mill_setup_drum drum = {.radius = 1.0,
                                         .length = s->contour.far * fuzz_log(b, 1e-3, 3.0),
                                         .corners = s->contour.n,
                                         .corner = s->contour.corner};
    s->body = mill_setup_drum_body(&drum);
    s->body.inside = fuzz_choice(b, 3) < 2;
    s->radius = ball_radius(&s->contour, b);
    s->horizon = fuzz_choice(b, 2) ? fuzz_log(b, 1e-9, 0.0625) : 0.0625;
    if (fuzz_choice(b, 3) == 2) {
        s->turn = (struct mill_turn){.axis = {1.0, 0.0, 0.0}, .angle = fuzz_uniform(b, -7.0, 7.0)};
        s->turn.speed = fuzz_log(b, 1e-6, 300.0) * (fuzz_choice(b, 2) ? 1.0 : -1.0);
        if (fuzz_choice(b, 2))
            s->turn.centre = vec3_make(0.0, s->contour.far * fuzz_uniform(b, -1.0, 1.0), 0.0);
        s->motion = mill_turn_type.create(&s->turn);
        fuzz_require(s->motion != NULL, "out of memory");
    }
    s->flight.g = fuzz_choice(b, 2) ? vec3_scale(fuzz_direction(b),
                                                 fuzz_choice(b, 2) ? 9.81 : fuzz_log(b, 1e-9, 1e3))
                                    : vec3_make(0.0, 0.0, fuzz_choice(b, 2) ? -9.81 : 0.0);
    s->restitution = 0.4 * fuzz_choice(b, 3);
    s->floor = fuzz_choice(b, 2) ? 0.0 : 5e-3;
    s->boxed = fuzz_choice(b, 2) && s->body.inside && !s->motion;
    aim(s, b);
    const struct mill_reach places = {{-100.0, -100.0, -100.0}, {100.0, 100.0, 100.0}, INFINITY};
    s->shape = lone_shape(&mill_contour_solid, &s->body, s->motion, &places);
    fuzz_require(s->shape != NULL, "out of memory");
    return true;
}

static void show(const struct shot *s)
{
    for (size_t k = 0; k < s->contour.n; k++)
        fprintf(stderr, "%.17g %.17g %.17g\n", s->contour.corner[k].x, s->contour.corner[k].y,
                s->contour.corner[k].bulge);
    fprintf(stderr,
            "inside %d length %.17g turns %d speed %.17g angle %.17g centre %.17g\n"
            "ball radius %.17g now %.17g horizon %.17g restitution %g floor %g boxed %d\n"
            "r %.17g %.17g %.17g v %.17g %.17g %.17g g %.17g %.17g %.17g gap %g\n",
            s->body.inside, s->body.length, s->motion != NULL, s->turn.speed, s->turn.angle,
            s->turn.centre.y, s->radius, s->now, s->horizon, s->restitution, s->floor, s->boxed,
            s->flight.r.x, s->flight.r.y, s->flight.r.z, s->flight.v.x, s->flight.v.y,
            s->flight.v.z, s->flight.g.x, s->flight.g.y, s->flight.g.z,
            depth(s, s->flight.r, 0.0) - s->radius);
}

static void require(const struct shot *s, bool holds, const char *what, double x, double t)
{
    if (holds)
        return;
    show(s);
    fuzz_require(false, what, x, t);
}

/* ---- claims ---- */

/* The gap does not change faster than this within the horizon [m/s] */
static double fastest(const struct shot *s)
{
    const double v = vec3_norm(s->flight.v) + vec3_norm(s->flight.g) * s->horizon;
    const double far = vec3_norm(vec3_sub(s->flight.r, s->turn.centre)) + v * s->horizon;
    return v + fabs(s->turn.speed) * far + 1e-12;
}

static void check_outside(const struct shot *s, double until)
{
    const double v = fastest(s), small = 1e-14 * s->contour.far;
    double t = 0.0;
    for (int step = 0; step < MOST_MARCH && t < until; step++) {
        const double d = depth(s, place(s, t), t) - s->radius;
        require(s, d >= -TOLERANCE && d >= -fmax(0.01 * s->radius, small),
                "a gap of %g m at %.17g s, before any contact", d, t);
        t += fmax(d, 0.5 * TOLERANCE) / v;
    }
}

/* The wall's own words for where the ball is: the gap is the distance, the contact a contact */
static void check_wall(const struct shot *s, vec3 r)
{
    const double d = depth(s, r, 0.0) - s->radius, small = 1e-12 * (s->contour.far + vec3_norm(r));
    const struct mill_pose pose = mill_shape_pose(s->shape, s->now);
    const struct mill_contact k = s->shape->type->contact(s->shape, r, s->radius, &pose);
    require(s, fabs(k.gap - d) <= small, "a contact's gap is not the distance %.17g (%.17g)", d,
            k.gap);
    require(s, fabs(vec3_norm(k.normal) - 1.0) <= 1e-14, "a normal of %.17g (%g)",
            vec3_norm(k.normal), 0.0);
    require(s, fabs(depth(s, k.point, 0.0)) <= 2.0 * small, "touches %g m off the wall (%g)",
            depth(s, k.point, 0.0), 0.0);
    const vec3 there = vec3_axpy(k.point, s->radius + d, k.normal);
    require(s, vec3_norm(vec3_sub(there, r)) <= small, "a contact %g m off the ball (%g)",
            vec3_norm(vec3_sub(there, r)), 0.0);
}

/* Pieces in reach of a box in which the flight stays */
static struct mill_span in_reach(const struct shot *s)
{
    const double h = s->horizon, x = 1e-9 * s->contour.far;
    const vec3 r = s->flight.r, v = s->flight.v, g = s->flight.g;
    const vec3 way = {fabs(v.x) * h + fabs(g.x) * h * h + x, fabs(v.y) * h + fabs(g.y) * h * h + x,
                      fabs(v.z) * h + fabs(g.z) * h * h + x};
    return s->shape->type->parts(s->shape, vec3_sub(r, way), vec3_add(r, way), s->radius);
}

/* Seconds until the next contact, INFINITY without one; checked. *known: what comes until then */
static double contact_time(const struct shot *s, bool touching, double *known)
{
    double t = 0.0;
    struct mill_hit hit = mill_hit_at(INFINITY);
    *known = s->horizon;
    for (int asked = 0;; asked++) {
        struct mill_flight f = s->flight;
        f.r = place(s, t);
        f.v = vec3_axpy(s->flight.v, t, s->flight.g);
        f.pull = vec3_norm(f.g);
        f.slack = f.travel = INFINITY;
        if (s->boxed)
            f.parts = in_reach(s);
        const double left = s->horizon - t;
        if (s->boxed && f.parts.count == 0) /* nothing is in reach */
            break;
        hit = s->shape->type->next_contact(s->shape, &f, s->radius, s->now + t, left,
                                           touching && asked == 0);
        require(s, hit.state == MILL_HIT_NONE ? isinf(hit.t) : hit.t >= 0.0 && hit.t <= left,
                "%g is no time (%g)", hit.t, left);
        t += hit.t;
        if (hit.state != MILL_HIT_ASK_AGAIN)
            break;
        require(s, hit.t > 0.0, "a search that stays where it is (%g, %g)", hit.t, t);
        if (asked == MOST_ASKED) {
            *known = t;
            t = INFINITY;
            break;
        }
    }
    t = hit.state == MILL_HIT_CONTACT ? t : (double)INFINITY;
    check_outside(s, fmin(t, *known));
    return t;
}

/* Brings the ball to its contact after t and lets it rebound. */
static void rebound(struct shot *s, double t)
{
    const vec3 r = place(s, t), v = vec3_axpy(s->flight.v, t, s->flight.g);
    const double gap = depth(s, r, t) - s->radius;
    const struct mill_pose pose = mill_shape_pose(s->shape, s->now + t);
    const struct mill_contact k = mill_shape_meet(s->shape, r, v, s->radius, &pose);
    /* where an arc is hardly wider than the ball, its centre hardly leaves the arc's, and roundings
     * turn the normal */
    double room = s->contour.far;
    for (size_t i = 0; i < s->contour.n; i++) {
        const struct mill_corner *a = &s->contour.corner[i],
                                 *b = &s->contour.corner[(i + 1) % s->contour.n];
        const double u = fabs(a->bulge),
                     arc = 0.25 * hypot(b->x - a->x, b->y - a->y) * (1.0 + u * u) / u;
        room = fmin(room, fabs(arc - s->radius));
    }
    const double noise =
        1e-9 + fastest(s) * (1e-12 + 1e-15 * s->contour.far / fmax(room, 1e-15 * s->contour.far));
    const double closing = -vec3_dot(k.normal, vec3_sub(v, k.velocity));
    require(s, gap <= TOUCHING * (1.0 + s->contour.far), "a gap of %g m when due at %.17g s", gap,
            t);
    require(s, closing >= -noise, "closing by %g m/s when due at %.17g s", closing, t);
    const double after = fmax(s->restitution * fmax(closing, 0.0), s->floor);
    s->flight.r = r;
    s->flight.v = vec3_axpy(v, fmax(closing, 0.0) + after, k.normal);
    s->now += t;
    s->horizon -= t;
}

static void check_shot(struct shot *s)
{
    bool touching = false;
    for (int hop = 0; hop < MOST_HOPS && s->horizon > 0.0; hop++) {
        double known;
        check_wall(s, s->flight.r);
        const double t = contact_time(s, touching, &known);
        if (isinf(t))
            return;
        rebound(s, t);
        touching = true;
    }
}

/* A deck with such a ball is refused. */
static bool is_refused(const struct shot *s)
{
    return s->shape->hollow > 0.0 && fabs(s->shape->hollow - s->radius) <= 1e-11 * s->contour.far;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static struct shot s;
    struct fuzz_bytes b = {data, size};
    for (int i = 0; i < 2 && (i == 0 || b.left > 0); i++) {
        if (!make_shot(&s, &b))
            continue;
        if (fuzz_shown())
            show(&s);
        /* within the solid there is nothing to know */
        if (!is_refused(&s) && depth(&s, s.flight.r, 0.0) >= s.radius - 1e-15 * s.contour.far)
            check_shot(&s);
        lone_shape_free(s.shape);
        free(s.motion);
    }
    return 0;
}
