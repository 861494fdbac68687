/* What the tests of the shapes share: a mill of one shape of every kind, and an independent search
 * for contacts that uses nothing but the gap. */
#ifndef SHAPE_FIXTURE_H
#define SHAPE_FIXTURE_H

#include "draws.h"
#include "parts.h"

enum { DRUM, WALL_0, WALL_1, SHAFT, BLADE, SHAPES };

static const double drum_radius = 0.075, drum_length = 0.12, shaft_radius = 0.015;
static const struct mill_setup_drum round_drum = {.radius = 0.075, .length = 0.12};

struct mill {
    double omega; /* [rad/s] */
    struct mill_motion *rotor;
    struct mill_shape **shape;
};

/* angle: of the rotor at local time 0 */
static inline void mill_build_in(struct mill *m, const struct mill_setup_drum *drum,
                                 const struct mill_blade *blade, double omega, double angle)
{
    const struct mill_turn turn = {.axis = {1.0, 0.0, 0.0}, .speed = omega, .angle = angle};
    const struct mill_body around = mill_setup_drum_body(drum), box = mill_setup_blade(blade),
                           shaft = mill_setup_shaft(shaft_radius, drum->length);
    const struct mill_setup_surface surface[] = {drum_surface(&around, MILL_STILL),
                                                 shaft_surface(&shaft), blade_surface(&box, 0)};
    const struct mill_setup setup = {.motions = 1, .surfaces = 3, .surface = surface};
    const struct mill_reach places = drum_places(drum);
    int count;
    m->omega = omega;
    m->rotor = mill_turn_type.create(&turn);
    ck_assert_ptr_nonnull(m->rotor);
    ck_assert(mill_shapes_create(&setup, &places, &m->rotor, &m->shape, &count));
    ck_assert_int_eq(count, SHAPES);
}

static inline void mill_build(struct mill *m, const struct mill_blade *blade, double omega,
                              double angle)
{
    mill_build_in(m, &round_drum, blade, omega, angle);
}

static inline void mill_demolish(struct mill *m)
{
    mill_shapes_free(m->shape, SHAPES);
    free(m->rotor);
}

static inline double gap_of(const struct mill_shape *s, vec3 r, double radius, double t)
{
    const struct mill_pose pose = mill_shape_pose(s, t);
    return mill_shape_gap(s, r, radius, &pose);
}

static inline struct mill_contact contact_of(const struct mill_shape *s, vec3 r, double radius,
                                             double t)
{
    const struct mill_pose pose = mill_shape_pose(s, t);
    return s->type->contact(s, r, radius, &pose);
}

/* Anywhere near the origin, or at it, in any direction */
static inline void place_body(uint64_t *seed, struct mill_body *b)
{
    b->centre = below(seed, 4) ? vec3_scale(direction(seed), uniform(seed, 0.0, 0.1)) : nought;
    const vec3 z = direction(seed), any = direction(seed);
    const vec3 x = vec3_axpy(any, -vec3_dot(any, z), z);
    b->x = vec3_scale(x, 1.0 / vec3_norm(x));
    b->y = vec3_cross(z, b->x);
    b->z = vec3_cross(b->x, b->y);
}

/* One ball in flight in that mill */
struct flight {
    struct mill_flight path; /* its pull is made when it is asked for: ask */
    double radius;           /* [m] */
    double now;              /* [s] local time of its start */
};

static inline double gap_at(const struct mill_shape *s, const struct flight *f, double t)
{
    return gap_of(s, vec3_fly(f->path.r, f->path.v, f->path.g, t), f->radius, f->now + t);
}

/* The same ball, t [s] later */
static inline struct flight later(const struct flight *f, double t)
{
    struct flight out = *f;
    out.path.r = vec3_fly(f->path.r, f->path.v, f->path.g, t);
    out.path.v = vec3_axpy(f->path.v, t, f->path.g);
    out.now = f->now + t;
    return out;
}

/* No gap changes faster than this during the flight [m/s] */
static inline double fastest(const struct mill_shape *s, const struct flight *f, double until)
{
    const struct mill_motion_bounds b = mill_motion_bounds(s->motion, nought);
    const double v = vec3_norm(f->path.v) + vec3_norm(f->path.g) * until;
    const double far = vec3_norm(vec3_sub(f->path.r, b.home)) + v * until + b.far;
    return v + b.speed + b.turning * far + 1e-12;
}

/* The first time in [0, until) at which the gap is below -tolerance, INFINITY if it never is. Steps
 * of gap/(greatest speed) cannot pass the surface; where the gap is nearly closed they go on by
 * what sinks in by `tolerance` at most. */
static inline double first_below(const struct mill_shape *s, const struct flight *f, double until,
                                 double tolerance)
{
    const double v = fastest(s, f, until);
    double t = 0.0;
    for (long step = 0; t < until; step++) {
        const double d = gap_at(s, f, t);
        if (d < -tolerance)
            return t;
        if (step == 100000000)
            ck_abort_msg("the march along a surface does not end");
        t += fmax(fabs(d), tolerance) / v;
    }
    return INFINITY;
}

/* The same of several surfaces; where a ball glides along one the march is given up: nothing is
 * known then, and *lost is one more. */
static inline double first_below_any(struct mill_shape *const *shape, int shapes,
                                     const struct flight *f, double until, double tolerance,
                                     int *lost)
{
    double t = 0.0, speed = 0.0;
    for (int k = 0; k < shapes; k++)
        speed = fmax(speed, fastest(shape[k], f, until));
    for (int step = 0; t < until; step++) {
        double least = INFINITY;
        for (int k = 0; k < shapes; k++)
            least = fmin(least, gap_at(shape[k], f, t));
        if (least < -tolerance)
            return t;
        if (step == 300000) {
            ++*lost;
            return INFINITY;
        }
        t += fmax(fabs(least), tolerance) / speed;
    }
    return INFINITY;
}

/* d(gap)/dt by central difference: good to 1e-6 m/s where the gap is smooth */
static inline double gap_rate(const struct mill_shape *s, const struct flight *f, double t)
{
    const double h = 1e-8;
    return (gap_at(s, f, t + h) - gap_at(s, f, t - h)) / (2.0 * h);
}

/* A flight as a search is asked for it, its place in the shape's frame not known */
static inline struct mill_flight path_of(vec3 r, vec3 v, vec3 g)
{
    struct mill_flight f = {.window = 0.0};
    mill_flight_set(&f, r, v, g, vec3_norm(g), NULL);
    return f;
}

/* Tells where the ball is in the motion's frame within `window` [s], by the frame as it was `ago`
 * [s], as the schedule does; but the bounds are as near as can be. */
static inline void tell_place(const struct mill_motion *motion, const struct flight *f,
                              double window, double ago, struct mill_flight *path)
{
    enum { STEPS = 200 };
    static struct mill_pose late; /* the path refers to it */
    late = mill_motion_pose(motion, f->now - ago);
    const vec3 frame = mill_pose_velocity(&late, path->r);
    path->place = mill_pose_in(&late, vec3_axpy(path->r, -ago, frame));
    path->course = vec3_sub(path->v, frame);
    path->pose = &late;
    path->window = window;
    path->slack = path->travel = 0.0;
    double way = 0.0, bend = 0.0; /* between two steps */
    const vec3 course = mill_pose_turn_in(&late, path->course);
    vec3 last = nought, last_off = nought;
    for (int k = 0; k <= STEPS; k++) {
        const double t = window * k / STEPS;
        const struct mill_pose pose = mill_motion_pose(motion, f->now + t);
        const vec3 at =
            vec3_sub(mill_pose_in(&pose, vec3_fly(path->r, path->v, path->g, t)), path->place);
        const vec3 off = vec3_axpy(at, -t, course);
        path->travel = fmax(path->travel, vec3_norm(at));
        path->slack = fmax(path->slack, vec3_norm(off));
        way = k > 0 ? fmax(way, vec3_norm(vec3_sub(at, last))) : 0.0;
        bend = k > 0 ? fmax(bend, vec3_norm(vec3_sub(off, last_off))) : 0.0;
        last = at;
        last_off = off;
    }
    path->travel += way + 1e-13;
    path->slack += bend + 1e-13;
}

/* What the shape says of the flight */
static inline struct mill_hit ask(const struct mill_shape *s, const struct flight *f,
                                  double horizon, bool touching)
{
    const struct mill_flight path = path_of(f->path.r, f->path.v, f->path.g);
    return s->type->next_contact(s, &path, f->radius, f->now, horizon, touching);
}

/* The first contact as the loop finds it: a search that gives up early is asked again from there.
 * give_ups may be NULL. */
static inline double first_contact(const struct mill_shape *s, const struct flight *f,
                                   double horizon, bool touching, int *give_ups)
{
    double t = 0.0;
    for (int asked = 0; asked < 1000; asked++) {
        const struct flight from = later(f, t);
        const struct mill_hit hit = ask(s, &from, horizon - t, touching && asked == 0);
        ck_assert_int_eq(hit.state == MILL_HIT_NONE, isinf(hit.t) != 0);
        if (hit.state == MILL_HIT_NONE)
            return INFINITY;
        ck_assert(hit.t >= 0.0 && hit.t <= horizon - t);
        t += hit.t;
        if (hit.state == MILL_HIT_CONTACT)
            return t;
        ck_assert_double_gt(hit.t, 0.0);
        if (give_ups)
            ++*give_ups;
    }
    ck_abort_msg("a search does not end");
    return INFINITY;
}

#endif
