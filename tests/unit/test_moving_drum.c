/* Round drums that move, with their end walls, on every motion. The first contact is
 * closed, closing, and nothing comes before it; a drum that turns about its own axis is met where
 * one that stands would be. */
#include "motion_fixture.h"
#include "shape_fixture.h"

#define CLOSED 1e-12 /* [m] */

enum { WAYS = MOTION_KINDS + 2 };

struct moving {
    struct chain chain;
    struct mill_setup_drum is;
    struct mill_shape **shape;
    int shapes;
};

static void open_drum(uint64_t *seed, struct moving *d, int way)
{
    d->is = (struct mill_setup_drum){.radius = 0.075, .length = 0.12};
    d->chain = random_chain(seed, way);
    chain_open(&d->chain);
    const struct mill_body drum = mill_setup_drum_body(&d->is);
    const struct mill_setup_surface surface = drum_surface(&drum, d->chain.count - 1);
    const struct mill_setup setup = {.motions = d->chain.count, .surfaces = 1, .surface = &surface};
    const struct mill_reach places = {{-1.0, -1.0, -1.0}, {1.0, 1.0, 1.0}, INFINITY};
    ck_assert(mill_shapes_create(&setup, &places, d->chain.link, &d->shape, &d->shapes));
    ck_assert_int_eq(d->shapes, 3);
}

static void close_drum(struct moving *d)
{
    mill_shapes_free(d->shape, d->shapes);
    chain_close(&d->chain);
}

static double least_gap(const struct moving *d, const struct flight *f, double t, int *which)
{
    double least = INFINITY;
    for (int k = 0; k < d->shapes; k++) {
        const double gap = gap_at(d->shape[k], f, t);
        if (gap < least) {
            least = gap;
            *which = k;
        }
    }
    return least;
}

static bool random_flight(uint64_t *seed, const struct moving *d, struct flight *f)
{
    int which = 0;
    f->radius = log_uniform(seed, 2e-4, 8e-3);
    f->now = uniform(seed, 0.0, 0.06);
    const struct mill_pose pose = mill_motion_pose(d->chain.top, f->now);
    const double rho = 0.09 * sqrt(uniform(seed, 0.0, 1.0)), a = uniform(seed, -PI, PI);
    f->path.r =
        mill_pose_out(&pose, vec3_make(uniform(seed, -0.06, 0.06), rho * cos(a), rho * sin(a)));
    if (!(least_gap(d, f, 0.0, &which) > 0.0))
        return false;
    struct mill_contact c = contact_of(d->shape[which], f->path.r, f->radius, f->now);
    if (below(seed, 2)) { /* moved up to the wall */
        f->path.r = vec3_axpy(f->path.r, log_uniform(seed, 1e-9, 1e-2) - c.gap, c.normal);
        c = contact_of(d->shape[which], f->path.r, f->radius, f->now);
    }
    f->path.v = vec3_scale(below(seed, 2) ? direction(seed) : vec3_scale(c.normal, -1.0),
                           below(seed, 5) ? log_uniform(seed, 1e-3, 10.0) : 0.0);
    if (below(seed, 3) == 0)
        f->path.v = vec3_add(f->path.v, c.velocity);
    f->path.g = below(seed, 3) ? vec3_scale(direction(seed), uniform(seed, 0.0, 20.0)) : nought;
    return least_gap(d, f, 0.0, &which) > CLOSED;
}

SLOW_TEST(a_moving_drum_is_met_when_it_is, WAYS)
{
    uint64_t seed = 1 + (uint64_t)_i;
    const int approaches = unit_draws(600);
    int found = 0, give_ups = 0, lost = 0;
    for (int i = 0; i < approaches; i++) {
        struct moving d;
        struct flight f;
        open_drum(&seed, &d, _i);
        if (random_flight(&seed, &d, &f)) {
            const double horizon = log_uniform(&seed, 1e-5, 0.03);
            double t = INFINITY;
            int which = 0;
            for (int k = 0; k < d.shapes; k++)
                t = fmin(t, first_contact(d.shape[k], &f, fmin(horizon, t), false, &give_ups));
            const double missed =
                first_below_any(d.shape, d.shapes, &f, fmin(t, horizon), CLOSED, &lost);
            ck_assert_msg(isinf(missed), "flight %d: below at %.17g, before the contact at %.17g",
                          i, missed, t);
            if (!isinf(t)) {
                found++;
                const double gap = least_gap(&d, &f, t, &which);
                ck_assert_double_eq_tol(gap, 0.0, 2e-15 + 2e-15 * vec3_norm(f.path.v));
                ck_assert_double_lt(gap_rate(d.shape[which], &f, t), 1e-5);
            }
        }
        close_drum(&d);
    }
    ck_assert_int_gt(found, approaches / 12);
    ck_assert_int_lt(give_ups, 1 + approaches / 60);
    ck_assert_int_lt(lost, 2 + approaches / 100);
}

TEST(what_turns_about_its_own_axis_is_met_like_what_stands)
{
    uint64_t seed = 3;
    for (int i = 0; i < 600; i++) {
        struct moving d;
        struct flight f;
        open_drum(&seed, &d, 0);
        const struct mill_body drum = mill_setup_drum_body(&round_drum);
        const struct mill_setup_surface surface = drum_surface(&drum, MILL_STILL);
        const struct mill_setup setup = {.surfaces = 1, .surface = &surface};
        const struct mill_reach places = drum_places(&round_drum);
        struct mill_shape **still;
        int count;
        ck_assert(mill_shapes_create(&setup, &places, NULL, &still, &count));
        if (random_flight(&seed, &d, &f))
            for (int k = 0; k < 3; k++) {
                const double t = first_contact(still[k], &f, 0.03, false, NULL);
                ck_assert(first_contact(d.shape[k], &f, 0.03, false, NULL) == t);
                const struct mill_contact c = contact_of(d.shape[k], f.path.r, f.radius, f.now);
                const vec3 at = c.point;
                const vec3 v = vec3_scale(vec3_make(0.0, -at.z, at.y), d.chain.is[0].turn.speed);
                ck_assert_double_le(vec3_norm(vec3_sub(v, c.velocity)),
                                    1e-15 * (1.0 + vec3_norm(v)));
            }
        mill_shapes_free(still, count);
        close_drum(&d);
    }
}

int main(void)
{
    return unit_run("moving_drum");
}
