/* Claims about blades that are told at once to be out of reach: it never hides a contact, and it
 * happens often. */
#include "shape_fixture.h"

struct shot {
    struct mill_deck_blade spec;
    struct flight flight;
    double horizon; /* [s] the ball stays inside the drum until then */
};

/* A rotor and a ball not far from the blade along the axis, as it is asked by the loop, half of
 * them next to it, half of them flying towards it or along with it */
static struct shot random_shot(uint64_t *seed, struct mill *m)
{
    struct shot s;
    static const double speeds[] = {0.0, 10.0, 105.0, -105.0, 400.0};
    s.spec = blade_spec(uniform(seed, 0.02, 0.07), log_uniform(seed, 1e-3, 0.05),
                        log_uniform(seed, 1e-3, 0.02), uniform(seed, -4.0, 4.0));
    s.spec.position = uniform(seed, -0.03, 0.03);
    s.spec.angle = uniform(seed, -7.0, 7.0);
    mill_build(m, &s.spec, speeds[(int)uniform(seed, 0.0, 5.0)]);
    struct flight *f = &s.flight;
    f->radius = log_uniform(seed, 5e-4, 5e-3);
    f->turn = uniform(seed, -7.0, 7.0);
    const double near = uniform(seed, 0.0, 1.0) < 0.5 ? 1e-3 : HUGE_VAL;
    double gap;
    do {
        const double rho = drum_radius * sqrt(uniform(seed, 0.0, 1.0));
        const double a = uniform(seed, 0.0, 2.0 * PI);
        f->path.r =
            vec3_make(s.spec.position + uniform(seed, -0.02, 0.02), rho * cos(a), rho * sin(a));
        gap = m->shape[BLADE]->ops->gap(m->shape[BLADE], f->path.r, f->radius, f->turn);
    } while (gap < 0.0 || gap > near);
    const struct mill_shape *b = m->shape[BLADE];
    const vec3 at_it = vec3_scale(b->ops->contact(b, f->path.r, f->radius, f->turn).normal, -1.0);
    const vec3 way = uniform(seed, 0.0, 1.0) < 0.5 ? direction(seed) : at_it;
    f->path.v = vec3_scale(way, log_uniform(seed, 0.1, 10.0));
    if (uniform(seed, 0.0, 1.0) < 0.5) { /* so that only what pulls counts */
        const vec3 r = f->path.r;
        f->path.v = vec3_axpy(vec3_make(0.0, -m->omega * r.z, m->omega * r.y),
                              log_uniform(seed, 1e-3, 0.1), way);
    }
    f->path.g = vec3_scale(direction(seed), uniform(seed, 0.0, 1.0) < 0.5 ? 9.81 : 0.0);
    const double v = vec3_norm(f->path.v) + 0.06 * vec3_norm(f->path.g);
    const double far = drum_radius - hypot(f->path.r.y, f->path.r.z);
    s.horizon = fmin(log_uniform(seed, 1e-4, 0.06), far / v);
    return s;
}

static double answer(const struct mill *m, const struct shot *s, struct mill_heading heading,
                     double turn)
{
    struct mill_flight path = s->flight.path;
    path.heading = heading;
    return m->shape[BLADE]->ops->next_contact(m->shape[BLADE], &path, s->flight.radius, turn,
                                              s->horizon, false);
}

static struct mill_heading heading_of(double turn)
{
    const struct mill_heading heading = {cos(turn), sin(turn)};
    return heading;
}

/* The heading may be wrong by 1e-12. */
START_TEST(a_known_heading_changes_no_contact)
{
    uint64_t seed = 1;
    long met = 0, missed = 0;
    for (int n = 0; n < 100000; n++) {
        struct mill m;
        const struct shot s = random_shot(&seed, &m);
        const struct mill_heading unknown = {0.0, 0.0};
        const double searched = answer(&m, &s, unknown, s.flight.turn);
        for (int k = -1; k <= 1; k++) {
            const double with =
                answer(&m, &s, heading_of(s.flight.turn + k * 0.7e-12), s.flight.turn);
            ck_assert_double_eq(with, searched);
        }
        met += !isinf(searched);
        missed += isinf(searched);
        mill_demolish(&m);
    }
    ck_assert_int_gt(met, 2000);
    ck_assert_int_gt(missed, 5000);
}
END_TEST

/* Nothing but the gap is asked here. */
START_TEST(a_blade_that_is_said_to_be_missed_is_nowhere_entered)
{
    uint64_t seed = 2;
    long missed = 0;
    for (int n = 0; n < 20000; n++) {
        struct mill m;
        const struct shot s = random_shot(&seed, &m);
        if (isinf(answer(&m, &s, heading_of(s.flight.turn), s.flight.turn))) {
            const double in = first_below(&m, BLADE, &s.flight, s.horizon, 1e-9);
            ck_assert_msg(isinf(in), "inside at %g s of %g s", in, s.horizon);
            missed++;
        }
        mill_demolish(&m);
    }
    ck_assert_int_gt(missed, 5000);
}
END_TEST

/* The search by steps knows the angle, the rejection the heading alone: without an angle only the
 * rejection can say that there is no contact. */
START_TEST(most_blades_that_are_missed_are_rejected_at_once)
{
    uint64_t seed = 3;
    long missed = 0, rejected = 0, along = 0;
    for (int n = 0; n < 5000; n++) {
        struct mill m;
        const struct shot s = random_shot(&seed, &m);
        const struct mill_heading unknown = {0.0, 0.0};
        const struct mill_heading heading = heading_of(s.flight.turn);
        missed += isinf(answer(&m, &s, heading, s.flight.turn));
        rejected += isinf(answer(&m, &s, heading, NAN));
        along += isinf(answer(&m, &s, unknown, NAN)); /* by the way along the axis alone */
        mill_demolish(&m);
    }
    ck_assert_msg(2 * rejected > missed, "%ld of %ld rejected", rejected, missed);
    ck_assert_msg(3 * along < 2 * rejected, "%ld of %ld without the heading", along, rejected);
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("blade_reach");
    TCase *tests = tcase_create("blade_reach");
    tcase_set_timeout(tests, 60);
    tcase_add_test(tests, a_known_heading_changes_no_contact);
    tcase_add_test(tests, a_blade_that_is_said_to_be_missed_is_nowhere_entered);
    tcase_add_test(tests, most_blades_that_are_missed_are_rejected_at_once);
    suite_add_tcase(suite, tests);
    SRunner *runner = srunner_create(suite);
    srunner_run_all(runner, CK_NORMAL);
    const int failed = srunner_ntests_failed(runner);
    srunner_free(runner);
    return failed != 0;
}
