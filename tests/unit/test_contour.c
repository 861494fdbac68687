/* Random contours, at rest and on every motion, met from inside and, with flat ends, from outside:
 * the first contact is the one of an oracle in extended precision that knows the corners alone. It
 * marches along the gap by a bound of its speed. */
#include "contour_fixture.h"

#define SUNK 1e-12L    /* [m] what the march calls missed */
#define STEP 1e-9L     /* [m] of the march, where the gap is nearly closed */
#define MOST_PULL 1e6L /* [m/s^2] more than any frame here has */
#define CLOSED 2e-14L  /* [m] a search calls 1e-15 closed; roundings of places up to 1 m away */
#define LATE 1e-12L    /* [s] where the gap closes by CLOSED in less */

/* way 0: it stands; 1: it turns about its own axis; 2: about a parallel one; 3: about its own while
 * it is carried around; then the chains of motion_fixture.h */
enum { STILL, OWN, ECCENTRIC, PLANET, CHAINS, WAYS = CHAINS + MOTION_KINDS + 2 };

struct scene {
    struct contour contour;
    struct chain chain;
    struct mill_body body;
    struct mill_shape *shape;
};

static void open_scene(uint64_t *seed, struct scene *s, int kind, bool inside, int way)
{
    const struct mill_reach places = {{-2.0, -2.0, -2.0}, {2.0, 2.0, 2.0}, INFINITY};
    random_contour(seed, &s->contour, kind);
    s->body =
        (struct mill_body){.inside = inside, .corners = s->contour.n, .corner = s->contour.corner};
    if (below(seed, 2)) { /* as a drum */
        s->body.centre = nought;
        s->body.x = vec3_make(0.0, 1.0, 0.0);
        s->body.y = vec3_make(0.0, 0.0, 1.0);
        s->body.z = vec3_make(1.0, 0.0, 0.0);
    } else {
        place_body(seed, &s->body);
    }
    s->body.length = inside ? 10.0 : log_uniform(seed, 1e-3, 0.3);
    s->chain = random_chain(seed, way < CHAINS ? 1 : 1 + way - CHAINS);
    if (way < CHAINS) {
        s->chain.count = way == STILL ? 0 : way == PLANET ? 2 : 1;
        random_link(seed, &s->chain.is[1], TURN);
        struct mill_turn *own = &s->chain.is[way == PLANET].turn;
        s->chain.is[0].turn.axis = own->axis = s->body.z;
        if (way != ECCENTRIC)
            own->centre = s->body.centre;
    }
    chain_open(&s->chain);
    ck_assert(mill_solid_is_sound(&mill_contour_solid, &s->body));
    s->shape = lone_shape(&mill_contour_solid, &s->body, s->chain.top, &places);
    ck_assert_ptr_nonnull(s->shape);
}

static void close_scene(struct scene *s)
{
    lone_shape_free(s->shape);
    chain_close(&s->chain);
}

/* In the frame of the motion */
static struct wide true_place(const struct scene *s, const struct flight *f, real t)
{
    const struct mill_flight *p = &f->path;
    const struct wide r = wide_axpy(wide_of(p->r), t, wide_of(p->v));
    return wide_in(&s->chain, wide_axpy(r, 0.5L * t * t, wide_of(p->g)), f->now + t);
}

static real true_gap(const struct scene *s, const struct flight *f, real t)
{
    return contour_gap(&s->contour, &s->body, true_place(s, f, t)) - f->radius;
}

static real true_rate(const struct scene *s, const struct flight *f, real t)
{
    const real h = 1e-9L;
    return (true_gap(s, f, t + h) - true_gap(s, f, t - h)) / (2.0L * h);
}

/* [s] a gap [m] stays open for so long: the ball's speed in the frame changes by less than
 * MOST_PULL
 */
static real soonest(const struct scene *s, const struct flight *f, real t, real gap)
{
    const real h = 1e-9L;
    const struct wide a = true_place(s, f, t - h), b = true_place(s, f, t + h);
    const struct wide way = wide_axpy(b, -1.0L, a);
    const real u = sqrtl(wide_dot(way, way)) / (2.0L * h);
    return 2.0L * gap / (u + sqrtl(u * u + 2.0L * MOST_PULL * gap));
}

/* The first time from `from` on at which the ball is sunk in; INFINITY: never. Where the ball
 * glides
 * (*lost), steps grow longer than the bound allows: then a dip of microseconds can be missed. */
static real first_sunk(const struct scene *s, const struct flight *f, real from, real until,
                       int *lost)
{
    enum { PATIENCE = 1000 };
    real t = from;
    for (int step = 0; t < until; step++) {
        const real gap = true_gap(s, f, t);
        if (gap < -SUNK)
            return t;
        *lost += step == PATIENCE;
        t += fmaxl(soonest(s, f, t, fmaxl(gap, STEP)), step < PATIENCE ? 0.0L : until / PATIENCE);
    }
    return INFINITY;
}

/* A place where a ball of this radius touches a corner, or the middle of a side, from where the
 * balls are; in the own plane */
static vec3 place_beside(uint64_t *seed, const struct scene *s, double radius)
{
    const struct contour *c = &s->contour;
    const int k = below(seed, (int32_t)c->n);
    const struct mill_corner *a = &c->corner[k], *b = &c->corner[((size_t)k + 1) % c->n];
    const double share = below(seed, 2) ? 0.0 : uniform(seed, 0.0, 1.0);
    const double dx = b->x - a->x, dy = b->y - a->y, l = hypot(dx, dy);
    const double side = s->body.inside ? radius / l : -radius / l;
    return vec3_make(a->x + share * dx - side * dy, a->y + share * dy + side * dx,
                     uniform(seed, -0.6, 0.6) * s->body.length);
}

/* A ball of any size that is clear of the body; false: none was found */
static bool random_flight(uint64_t *seed, const struct scene *s, struct flight *f)
{
    const double far = s->contour.far * (s->body.inside ? 1.0 : 1.5);
    f->now = uniform(seed, 0.0, 0.06);
    f->radius = 0.0;
    f->path.g = below(seed, 3) ? vec3_scale(direction(seed), uniform(seed, 0.0, 20.0)) : nought;
    const struct mill_pose pose = mill_motion_pose(s->chain.top, f->now);
    vec3 own = vec3_make(uniform(seed, -far, far), uniform(seed, -far, far),
                         uniform(seed, -1.0, 1.0) * s->body.length);
    f->path.r = mill_pose_out(&pose, mill_body_out(&s->body, own));
    const double room = (double)true_gap(s, f, 0.0L);
    if (!(room > 1e-6))
        return false;
    const double least = below(seed, 2) ? 0.02 * room : 1e-5;
    f->radius = below(seed, 4) ? log_uniform(seed, fmin(least, 0.5 * room), room)
                               : room - log_uniform(seed, 1e-9, 0.5) * room;
    const vec3 to = place_beside(seed, s, f->radius);
    const double speed = below(seed, 8) ? log_uniform(seed, 0.03, 10.0) : 0.0;
    const int how = below(seed, 3);
    vec3 way = direction(seed);
    if (how == 0) { /* at a corner, or at a side */
        way = vec3_sub(mill_pose_out(&pose, mill_body_out(&s->body, to)), f->path.r);
        way = vec3_scale(way, 1.0 / vec3_norm(way));
    } else if (how == 1) { /* at the nearest point, or along it */
        const vec3 n = contact_of(s->shape, f->path.r, f->radius, f->now).normal;
        way = below(seed, 2) ? vec3_scale(n, -1.0)
                             : vec3_cross(mill_pose_turn_out(&pose, s->body.z), n);
    }
    f->path.v = vec3_scale(way, speed);
    if (below(seed, 3) == 0)
        f->path.v =
            vec3_add(f->path.v, contact_of(s->shape, f->path.r, f->radius, f->now).velocity);
    return true_gap(s, f, 0.0L) > SUNK;
}

/* How often a test saw what */
struct seen {
    int found, none, exact, lost, give_ups;
};

/* What the event loop asks, with the place in the motion's frame, has the same answer. */
static void check_known_place(const struct scene *s, const struct flight *f, double window,
                              bool touching)
{
    struct mill_flight path = path_of(f->path.r, f->path.v, f->path.g);
    tell_place(s->chain.top, f, window, 0.0, &path);
    const struct mill_hit hit = s->shape->type->next_contact(s->shape, &path, f->radius, f->now,
                                                             window, touching),
                          plain = ask(s->shape, f, window, touching);
    ck_assert_msg(hit.state == plain.state && hit.t == plain.t, "%.17g s, not %.17g s", hit.t,
                  plain.t);
}

/* The first contact within the horizon, held against the oracle from the time `from` on */
static double checked_contact(const struct scene *s, const struct flight *f, real from,
                              double horizon, bool touching, struct seen *n)
{
    const double t = first_contact(s->shape, f, horizon, touching, &n->give_ups);
    for (int k = 0; s->chain.top && k < 3; k++)
        check_known_place(s, f, horizon * (k == 0 ? 1.0 : k == 1 ? 0.1 : 0.01), touching);
    const real missed = first_sunk(s, f, from, fmin(t, horizon), &n->lost);
    ck_assert_msg(isinf(missed), "a gap of %Lg m at %.17Lg s, before the contact at %.17g s, r %g",
                  true_gap(s, f, missed), missed, t, f->radius);
    if (isinf(t)) {
        n->none++;
        return t;
    }
    const real gap = true_gap(s, f, t), rate = true_rate(s, f, t);
    ck_assert_msg(fabsl(gap) <= CLOSED, "a contact at %.17g s with a gap of %Lg m", t, gap);
    ck_assert_msg(rate < 1e-5L, "a contact at %.17g s that opens at %Lg m/s", t, rate);
    if (rate < -CLOSED / LATE) {
        ck_assert_msg(fabsl(gap / rate) <= LATE, "a contact that is %Lg s off", gap / rate);
        n->exact++;
    }
    n->found++;
    return t;
}

/* The ball at its contact after t, thrown back with a share of its approach speed; every other one
 * is made to hop. Returns the speed at which the gap opens. */
static double rebound(uint64_t *seed, const struct scene *s, struct flight *f, double t,
                      vec3 *normal)
{
    const vec3 v = vec3_axpy(f->path.v, t, f->path.g),
               r = vec3_fly(f->path.r, f->path.v, f->path.g, t);
    const struct mill_pose pose = mill_shape_pose(s->shape, f->now + t);
    const struct mill_contact c = mill_shape_meet(s->shape, r, v, f->radius, &pose);
    const double approach = fmax(-vec3_dot(vec3_sub(v, c.velocity), c.normal), 0.0);
    double speed = fmax(uniform(seed, 0.0, 1.0) * approach, 5e-3);
    *f = later(f, t);
    if (below(seed, 2)) {
        f->path.v = vec3_axpy(c.velocity, log_uniform(seed, 1e-3, 1.0), direction(seed));
        f->path.g = vec3_axpy(vec3_scale(direction(seed), uniform(seed, 0.0, 2.0)),
                              -uniform(seed, 0.0, 20.0), c.normal);
        speed = log_uniform(seed, 5e-3, 0.1);
    }
    const double now = vec3_dot(vec3_sub(f->path.v, c.velocity), c.normal);
    f->path.v = vec3_axpy(f->path.v, speed - now, c.normal);
    *normal = c.normal;
    return speed;
}

/* [s] a gap that opens at this speed does not close sooner, unless the ball touches a second place:
 * the frame's accelerations are below 1e5 m/s^2 */
static double soon_after(const struct scene *s, const struct flight *f, double opening)
{
    const double v = fastest(s->shape, f, 0.05);
    double room = 0.1 * f->radius;
    for (size_t k = 0; k < s->contour.n; k++) {
        const struct mill_corner *a = &s->contour.corner[k],
                                 *b = &s->contour.corner[(k + 1) % s->contour.n];
        const double u = a->bulge,
                     r = 0.25 * hypot(b->x - a->x, b->y - a->y) * (1.0 + u * u) / fabs(u);
        if (fabs(r - f->radius) < room)
            room = fabs(r - f->radius);
    }
    return opening / (1e5 + v * v / room);
}

static void fly(bool inside, int way)
{
    enum { FLIGHTS = 6, HOPS = 3 };
    uint64_t seed = 1 + (uint64_t)(100 * inside + 1000 * way);
    const int contours = unit_draws(100);
    struct seen n = {0};
    for (int i = 0; i < contours * FLIGHTS; i++) {
        static struct scene s;
        struct flight f;
        if (i % FLIGHTS == 0)
            open_scene(&seed, &s, i / FLIGHTS % CONTOURS, inside, way);
        double t = INFINITY;
        if (random_flight(&seed, &s, &f))
            t = checked_contact(&s, &f, 0.0L, log_uniform(&seed, 1e-3, 0.1), false, &n);
        for (int hop = 0; hop < HOPS && !isinf(t); hop++) {
            vec3 normal;
            const double soon = soon_after(&s, &f, rebound(&seed, &s, &f, t, &normal));
            t = checked_contact(&s, &f, soon, log_uniform(&seed, 1e-4, 0.1), true, &n);
            if (t < soon) { /* at a second place, which it touches too */
                const struct flight g = later(&f, t);
                const struct mill_pose pose = mill_shape_pose(s.shape, g.now);
                const struct mill_contact c =
                    mill_shape_meet(s.shape, g.path.r, g.path.v, g.radius, &pose);
                ck_assert_double_gt(vec3_norm(vec3_sub(c.normal, normal)), 1e-3);
            }
        }
        if (i % FLIGHTS == FLIGHTS - 1)
            close_scene(&s);
    }
    ck_assert_int_gt(n.exact, contours / 2);
    ck_assert_int_gt(n.none, contours);
    ck_assert_int_lt(n.lost, n.found / 2 + 20);
    ck_assert_int_lt(n.give_ups, n.found / 10 + 2);
}

/* Thorough: of 1000 contours */
SLOW_TEST(contours_are_met_from_inside_when_they_are_and_after_a_rebound_not_at_once, WAYS)
{
    fly(true, _i);
}

SLOW_TEST(contours_with_flat_ends_are_met_from_outside_when_they_are, WAYS)
{
    fly(false, _i);
}

int main(void)
{
    return unit_run("contour");
}
