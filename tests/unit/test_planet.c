/* The contract of shapes for a box that rides on a turn on a turn, as in a planetary mill or on a
 * wobbling stirrer: the first contact is closed, closing, and nothing comes before it, by a march
 * along the gap that knows nothing but the greatest speed of the box. */
#include "geometry/convex.h"
#include "lone_shape.h"
#include "shape_fixture.h"

#define CLOSED 1e-12 /* [m] */

/* A long narrow drum and a flat wide one: what turns about x gets no farther than the drum's
 * radius, all else gets into the corners */
static const struct mill_setup_drum drums[] = {{.radius = 0.06, .length = 0.5},
                                               {.radius = 0.2, .length = 0.05}};

struct planet {
    const struct mill_setup_drum *drum;
    struct mill_motion *sun, *wheel;
    struct mill_shape *box;
};

static void open_planet(uint64_t *seed, struct planet *p, int kind)
{
    const vec3 x = {1.0, 0.0, 0.0};
    const bool fast = below(seed, 2);
    const struct mill_turn sun = {
        .centre = vec3_scale(direction(seed), below(seed, 2) ? uniform(seed, 0.0, 0.1) : 0.0),
        .axis = below(seed, 3) ? direction(seed) : x,
        .speed = below(seed, 6) ? uniform(seed, -60.0, 60.0) : 0.0,
        .angle = uniform(seed, -4.0, 4.0)};
    const struct mill_turn wheel = {
        .centre = vec3_scale(direction(seed), uniform(seed, 0.0, 0.1)),
        .axis = below(seed, 3) ? direction(seed) : sun.axis,
        .speed = below(seed, 6) ? uniform(seed, -1.0, 1.0) * (fast ? 400.0 : 60.0) : 0.0,
        .angle = uniform(seed, -4.0, 4.0)};
    const struct mill_blade box = {.position = uniform(seed, -0.04, 0.04),
                                   .angle = uniform(seed, -4.0, 4.0),
                                   .tip_radius = log_uniform(seed, 0.01, 0.05),
                                   .width = log_uniform(seed, 1e-3, 0.03),
                                   .thickness = log_uniform(seed, 1e-3, 0.03),
                                   .pitch = uniform(seed, -4.0, 4.0)};
    p->drum = &drums[kind];
    const struct mill_reach places = drum_places(p->drum);
    const struct mill_body is = mill_setup_blade(&box);
    p->sun = mill_turn_type.create(&sun);
    p->wheel = mill_turn_type.create(&wheel);
    p->wheel->on = p->sun;
    p->box = lone_shape(&mill_box_solid, &is, p->wheel, &places);
    ck_assert_ptr_nonnull(p->box);
}

static void close_planet(struct planet *p)
{
    lone_shape_free(p->box);
    free(p->wheel);
    free(p->sun);
}

static bool is_inside(const struct mill_setup_drum *d, vec3 r)
{
    return r.y * r.y + r.z * r.z < d->radius * d->radius && fabs(r.x) < 0.5 * d->length;
}

/* A ball in the drum and outside the box; some are next to it, some fly at it or along with it */
static bool random_flight(uint64_t *seed, const struct planet *p, struct flight *f)
{
    const vec3 hi = {0.5 * p->drum->length, p->drum->radius, p->drum->radius};
    f->radius = log_uniform(seed, 2e-4, 5e-3);
    f->now = uniform(seed, 0.0, 0.06);
    f->path.r = point_in(seed, vec3_scale(hi, -1.0), hi);
    struct mill_contact c = contact_of(p->box, f->path.r, f->radius, f->now);
    if (below(seed, 2)) { /* moved up to the box */
        f->path.r = vec3_axpy(f->path.r, log_uniform(seed, 1e-9, 1e-2) - c.gap, c.normal);
        c = contact_of(p->box, f->path.r, f->radius, f->now);
    }
    f->path.v = vec3_scale(below(seed, 2) ? direction(seed) : vec3_scale(c.normal, -1.0),
                           below(seed, 5) ? log_uniform(seed, 1e-3, 10.0) : 0.0);
    if (below(seed, 3) == 0)
        f->path.v = vec3_add(f->path.v, c.velocity);
    f->path.g = below(seed, 3) ? vec3_scale(direction(seed), uniform(seed, 0.0, 20.0)) : nought;
    return c.gap > 0.0 && is_inside(p->drum, f->path.r);
}

/* Until when the ball is in the drum, as all balls are */
static double time_inside(const struct planet *p, const struct flight *f, double wanted)
{
    for (int i = 1; i <= 1000; i++) {
        const vec3 r = vec3_fly(f->path.r, f->path.v, f->path.g, wanted * i / 1000);
        if (!is_inside(p->drum, r))
            return wanted * (i - 1) / 1000;
    }
    return wanted;
}

SLOW_TEST(the_first_contact_is_closed_closing_and_nothing_comes_before_it, 2)
{
    uint64_t seed = 1 + (uint64_t)_i;
    int found = 0, none = 0, give_ups = 0;
    for (int i = 0; i < unit_draws(8000); i++) {
        struct planet p;
        struct flight f;
        open_planet(&seed, &p, _i);
        if (random_flight(&seed, &p, &f)) {
            const double horizon = time_inside(&p, &f, log_uniform(&seed, 1e-5, 0.06));
            const double t = first_contact(p.box, &f, horizon, false, &give_ups);
            const double missed = first_below(p.box, &f, fmin(t, horizon), CLOSED);
            ck_assert_msg(isinf(missed), "flight %d: gap %g at %.17g, before the contact at %.17g",
                          i, gap_at(p.box, &f, missed), missed, t);
            if (isinf(t)) {
                none++;
            } else {
                found++;
                ck_assert_double_ge(gap_at(p.box, &f, t), -CLOSED);
                ck_assert_double_le(gap_at(p.box, &f, t), CLOSED);
                ck_assert_double_lt(gap_rate(p.box, &f, t), 1e-5);
            }
        }
        close_planet(&p);
    }
    ck_assert_int_gt(found, unit_draws(400));
    ck_assert_int_gt(none, unit_draws(400));
    ck_assert_int_lt(give_ups, unit_draws(20));
}

LOOP_TEST(the_box_moves_as_its_gap_says, 2)
{
    uint64_t seed = 3 + (uint64_t)_i;
    for (int i = 0; i < 3000; i++) {
        struct planet p;
        struct flight f;
        open_planet(&seed, &p, _i);
        if (random_flight(&seed, &p, &f)) {
            const struct mill_contact c = contact_of(p.box, f.path.r, f.radius, f.now);
            const double h = 1e-9;
            const double rate = (gap_of(p.box, f.path.r, f.radius, f.now + h) -
                                 gap_of(p.box, f.path.r, f.radius, f.now - h)) /
                                (2.0 * h);
            ck_assert_double_eq_tol(vec3_dot(c.velocity, c.normal), -rate, 1e-4);
            ck_assert_double_eq_tol(gap_of(p.box, c.point, 0.0, f.now), 0.0, 1e-15);
        }
        close_planet(&p);
    }
}

/* Steps are as long as the accelerations in the box's frame allow; each is found here by
 * differences of the gap of a ball that falls freely. */
LOOP_TEST(no_gap_bends_faster_than_the_search_believes, 2)
{
    uint64_t seed = 5 + (uint64_t)_i;
    for (int i = 0; i < unit_draws(8000); i++) {
        struct planet p;
        struct flight f;
        open_planet(&seed, &p, _i);
        if (random_flight(&seed, &p, &f)) {
            const struct mill_convex *c = (const struct mill_convex *)p.box;
            const struct mill_flight path = path_of(f.path.r, f.path.v, f.path.g);
            const double h = 1e-6;
            const double bend =
                (gap_at(p.box, &f, h) - 2.0 * gap_at(p.box, &f, 0.0) + gap_at(p.box, &f, -h)) /
                (h * h);
            const struct mill_pose pose = mill_shape_pose(p.box, f.now);
            const struct mill_seen seen = mill_convex_see(c, &path, &pose, f.path.r, f.path.v, h);
            ck_assert_double_ge(bend, -seen.acceleration * (1.0 + 1e-3) - 1e-2);
        }
        close_planet(&p);
    }
}

int main(void)
{
    return unit_run("planet");
}
