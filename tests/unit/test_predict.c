/* Claims about prediction: the first event in the calendar that is a contact is the first contact
 * of all, found by looking at every pair and every surface. */
#include "engine/predict.h"
#include "geometry/shape.h"

#include "engine_fixture.h"

#define HORIZON 0.0625 /* [s] */

/* ---- mills ---- */

struct setting {
    const char *gravity, *balls, *rotor;
};

#define NO_ROTOR ""
#define ROTOR                                                                                      \
    "[rotor]\nspeed = 1500 rpm\nshaft_radius = 6 mm\nangle = 40 deg\n"                             \
    "[blades]\ncount = 3\ntip_radius = 24 mm\nwidth = 10 mm\nthickness = 4 mm\npitch = 20 deg\n"
#define EQUAL "[balls]\ncount = 200\ndiameter = 5 mm\ndensity = 7800 kg/m^3\n"
#define MIXTURE                                                                                    \
    "[balls.a]\ncount = 15\ndiameter = 9 mm\ndensity = 7800 kg/m^3\n"                              \
    "[balls.b]\ncount = 60\ndiameter = 4 mm\ndensity = 2500 kg/m^3\n"                              \
    "[balls.c]\ncount = 125\ndiameter = 1.5 mm\ndensity = 6000 kg/m^3\n"

static const struct setting setting[] = {
    {"0 0 0 m/s^2", EQUAL, NO_ROTOR},        {"0 0 -9.81 m/s^2", EQUAL, NO_ROTOR},
    {"0 0 -9.81 m/s^2", EQUAL, ROTOR},       {"0 0 0 m/s^2", MIXTURE, ROTOR},
    {"3 -200 150 m/s^2", MIXTURE, NO_ROTOR}, {"0 0 -9.81 m/s^2", MIXTURE, ROTOR},
};
enum { SETTINGS = sizeof setting / sizeof *setting };

static vec3 random_velocity(uint64_t *seed)
{
    /* some at rest, most between a creep and a throw */
    return below(seed, 10) ? vec3_scale(direction(seed), log_uniform(seed, 1e-3, 5.0))
                           : vec3_make(0.0, 0.0, 0.0);
}

static struct mill_world *make_mill(const struct setting *s, uint64_t *seed)
{
    char text[2048];
    snprintf(text, sizeof text,
             "[run]\ntime = 1 s\nseed = %d\n[gravity]\nacceleration = %s\n"
             "[drum]\nradius = 30 mm\nlength = 60 mm\n[contact]\nrestitution = 0.8\n%s%s",
             below(seed, 1000), s->gravity, s->balls, s->rotor);
    struct mill_deck *deck = read_deck(text);
    struct mill_world *w = make_world(deck);
    mill_deck_free(deck);
    for (int32_t i = 0; i < w->balls; i++)
        w->ball[i].v = random_velocity(seed);
    return w;
}

static double radius_of(const struct mill_world *w, int32_t i)
{
    return w->species[w->ball[i].species].radius;
}

static void move_to(struct mill_world *w, int32_t i, double t)
{
    struct mill_ball *b = &w->ball[i];
    b->r = mill_world_position(w, i, t);
    b->v = mill_world_velocity(w, i, t);
    b->t = t;
}

/* ---- the first contact of all, the slow way ---- */

struct first {
    double t; /* [s] local */
    int32_t ball;
    int32_t partner; /* ball, or MILL_NOBODY */
    int32_t shape;   /* or MILL_NOBODY */
};

/* Seconds from `now` to the contact of two balls, from the lower root of |d + u t|^2 = s^2 in long
 * double. */
static double pair_contact(const struct mill_world *w, int32_t i, int32_t j, double now)
{
    const vec3 ri = mill_world_position(w, i, now), rj = mill_world_position(w, j, now);
    const vec3 vi = mill_world_velocity(w, i, now), vj = mill_world_velocity(w, j, now);
    const long double dx = rj.x - ri.x, dy = rj.y - ri.y, dz = rj.z - ri.z;
    const long double ux = vj.x - vi.x, uy = vj.y - vi.y, uz = vj.z - vi.z;
    const long double s = (long double)radius_of(w, i) + (long double)radius_of(w, j);
    const long double a = ux * ux + uy * uy + uz * uz, b = dx * ux + dy * uy + dz * uz;
    const long double c = dx * dx + dy * dy + dz * dz - s * s, square = b * b - a * c;
    if (b >= 0.0L || square <= 0.0L)
        return (double)INFINITY;
    return c <= 0.0L ? 0.0 : (double)((-b - sqrtl(square)) / a);
}

/* Seconds from `now` to the contact with a surface, up to `window`. touching: it has just met it.
 */
static double shape_contact(const struct mill_world *w, int32_t i, int32_t k, double now,
                            double window, bool touching)
{
    const struct mill_shape *s = w->shape[k];
    const double a = radius_of(w, i);
    double t = 0.0;
    for (int asked = 0; asked < 1000; asked++) {
        /* no heading: what prediction rejects by it is searched here */
        const struct mill_flight f = {.r = mill_world_position(w, i, now + t),
                                      .v = mill_world_velocity(w, i, now + t),
                                      .g = w->g};
        const double turn = w->turn + w->rotor_speed * (now + t);
        const double dt = s->ops->next_contact(s, &f, a, turn, window - t, touching && t == 0.0);
        t += fabs(dt);
        if (dt >= 0.0)
            return t;
    }
    ck_abort_msg("no end to the search");
    return t;
}

static struct first first_of_all(const struct mill_world *w, double now, int32_t toucher,
                                 int32_t touched)
{
    struct first first = {HORIZON, MILL_NOBODY, MILL_NOBODY, MILL_NOBODY};
    for (int32_t i = 0; i < w->balls; i++) {
        for (int32_t j = i + 1; j < w->balls; j++) {
            const double t = now + pair_contact(w, i, j, now);
            if (t < first.t) {
                const struct first found = {t, i, j, MILL_NOBODY};
                first = found;
            }
        }
    }
    for (int32_t i = 0; i < w->balls; i++) {
        for (int32_t k = 0; k < w->shapes; k++) {
            const double t =
                now + shape_contact(w, i, k, now, first.t - now, i == toucher && k == touched);
            if (t < first.t) {
                const struct first found = {t, i, MILL_NOBODY, k};
                first = found;
            }
        }
    }
    return first;
}

/* ---- the first contact by the calendar ---- */

static struct mill_predict *start(struct mill_world *w)
{
    struct mill_predict *p = NULL;
    struct mill_error error = {""};
    ck_assert_int_eq(mill_predict_create(w, &p, &error), MILL_OK);
    p->horizon = HORIZON;
    for (int32_t i = 0; i < w->balls; i++)
        mill_predict_ball(p, i, 0.0, MILL_NOBODY);
    return p;
}

/* Lets cell crossings, stale plans and searches that gave up pass, to the first contact. */
static struct first first_by_calendar(struct mill_predict *p, struct mill_world *w)
{
    for (;;) {
        double t = NAN;
        const int32_t i = mill_calendar_next(p->calendar, &t);
        const struct mill_plan *plan = &p->plan[i];
        if (i < 0 || t >= HORIZON) {
            const struct first none = {HORIZON, MILL_NOBODY, MILL_NOBODY, MILL_NOBODY};
            return none;
        }
        ck_assert_double_eq(t, fmin(fmin(plan->pair_t, plan->shape_t), plan->exit_t));
        if (plan->pair_t <= plan->shape_t && plan->pair_t <= plan->exit_t) {
            const struct first found = {t, i, plan->partner, MILL_NOBODY};
            if (w->ball[plan->partner].contacts == plan->partner_contacts)
                return found;
        } else if (plan->shape_t <= plan->exit_t) {
            const struct first found = {t, i, MILL_NOBODY, plan->shape};
            if (!plan->again)
                return found;
        } else {
            move_to(w, i, t);
            ck_assert(mill_predict_cross(p, i, t));
            continue;
        }
        move_to(w, i, t);
        mill_predict_ball(p, i, t, MILL_NOBODY);
    }
}

static void check_same(const struct first *slow, const struct first *fast)
{
    ck_assert_double_eq_tol(fast->t, slow->t, 1e-15 + 1e-12 * slow->t);
    if (slow->ball == MILL_NOBODY)
        return;
    ck_assert_int_eq(fast->shape, slow->shape);
    if (fast->partner == MILL_NOBODY) {
        ck_assert_int_eq(fast->ball, slow->ball);
    } else {
        ck_assert_int_eq(fast->ball < fast->partner ? fast->ball : fast->partner, slow->ball);
        ck_assert_int_eq(fast->ball < fast->partner ? fast->partner : fast->ball, slow->partner);
    }
}

/* Gives ball i a new velocity that leaves along n. */
static void throw_off(struct mill_world *w, int32_t i, vec3 n, vec3 surface, uint64_t *seed)
{
    vec3 v = random_velocity(seed);
    const double out = vec3_dot(vec3_sub(v, surface), n);
    v = vec3_axpy(v, fabs(out) + 1e-3 - out, n);
    w->ball[i].v = v;
    w->ball[i].contacts++;
}

/* The contact happens, somehow: those who met part with new velocities. Returns the ball that
 * touches a surface. */
static int32_t happen(struct mill_predict *p, struct mill_world *w, const struct first *e,
                      uint64_t *seed)
{
    const vec3 still = {0.0, 0.0, 0.0};
    move_to(w, e->ball, e->t);
    if (e->shape != MILL_NOBODY) {
        const struct mill_shape *s = w->shape[e->shape];
        const struct mill_contact c = s->ops->contact(s, w->ball[e->ball].r, radius_of(w, e->ball),
                                                      w->turn + w->rotor_speed * e->t);
        throw_off(w, e->ball, c.normal, c.velocity, seed);
        mill_predict_ball(p, e->ball, e->t, e->shape);
        return e->ball;
    }
    move_to(w, e->partner, e->t);
    const vec3 d = vec3_sub(w->ball[e->partner].r, w->ball[e->ball].r);
    const vec3 n = vec3_scale(d, 1.0 / vec3_norm(d));
    throw_off(w, e->ball, vec3_scale(n, -1.0), still, seed);
    throw_off(w, e->partner, n, still, seed);
    mill_predict_ball(p, e->ball, e->t, MILL_NOBODY);
    mill_predict_ball(p, e->partner, e->t, MILL_NOBODY);
    return MILL_NOBODY;
}

/* ---- claims ---- */

START_TEST(the_first_contact_of_a_fresh_world_is_the_first_of_all_pairs_and_surfaces)
{
    int shapes = 0, pairs = 0;
    for (uint64_t n = 0; n < 25; n++) {
        uint64_t seed = 1000 * n + 1;
        struct mill_world *w = make_mill(&setting[_i], &seed);
        struct mill_predict *p = start(w);
        const struct first slow = first_of_all(w, 0.0, MILL_NOBODY, MILL_NOBODY);
        const struct first fast = first_by_calendar(p, w);
        check_same(&slow, &fast);
        shapes += fast.shape != MILL_NOBODY;
        pairs += fast.partner != MILL_NOBODY;
        mill_predict_free(p);
        mill_world_free(w);
    }
    ck_assert_int_gt(pairs, 0);
    ck_assert_int_gt(pairs + shapes, 20);
}
END_TEST

/* Contact after contact, with balls thrown anew between them, so that plans are as stale as in a
 * run. */
START_TEST(every_next_contact_of_a_run_is_the_first_of_all)
{
    int shapes = 0, pairs = 0;
    for (uint64_t n = 0; n < 3; n++) {
        uint64_t seed = 1000 * n + 2;
        struct mill_world *w = make_mill(&setting[_i], &seed);
        struct mill_predict *p = start(w);
        int32_t toucher = MILL_NOBODY, touched = MILL_NOBODY;
        double now = 0.0;
        for (int event = 0; event < 120; event++) {
            const struct first slow = first_of_all(w, now, toucher, touched);
            const struct first fast = first_by_calendar(p, w);
            check_same(&slow, &fast);
            if (fast.ball == MILL_NOBODY)
                break;
            now = fast.t;
            shapes += fast.shape != MILL_NOBODY;
            pairs += fast.partner != MILL_NOBODY;
            toucher = happen(p, w, &fast, &seed);
            touched = fast.shape;
            const int32_t other = below(&seed, w->balls);
            if (event % 3 == 0 && other != fast.ball && other != fast.partner) {
                move_to(w, other, now);
                w->ball[other].v = random_velocity(&seed);
                w->ball[other].contacts++;
                mill_predict_ball(p, other, now, MILL_NOBODY);
            }
        }
        mill_predict_free(p);
        mill_world_free(w);
    }
    ck_assert_int_gt(pairs, 50);
    ck_assert_int_gt(shapes, 20);
}
END_TEST

START_TEST(balls_that_overlap_and_close_meet_at_once)
{
    uint64_t seed = 3;
    for (int n = 0; n < 50; n++) {
        struct mill_world *w = make_mill(&setting[_i], &seed);
        const int32_t i = below(&seed, w->balls), j = (i + 1) % w->balls;
        /* ball j goes a hair into ball i, wherever that is, and drives on into it */
        const double sum = radius_of(w, i) + radius_of(w, j);
        const vec3 n_ij = direction(&seed);
        w->ball[j].r = vec3_axpy(w->ball[i].r, sum - log_uniform(&seed, 1e-16, 1e-9), n_ij);
        w->ball[j].v = vec3_axpy(w->ball[i].v, -0.1, n_ij);
        struct mill_predict *p = start(w);
        ck_assert_double_le(p->plan[i].pair_t, 0.0);
        ck_assert_double_le(p->plan[j].pair_t, 0.0);
        /* opening: no contact of these two until they close */
        w->ball[j].v = vec3_axpy(w->ball[i].v, 0.1, n_ij);
        mill_predict_ball(p, i, 0.0, MILL_NOBODY);
        ck_assert(p->plan[i].partner != j);
        mill_predict_free(p);
        mill_world_free(w);
    }
}
END_TEST

START_TEST(the_deepest_overlap_is_that_of_all_pairs_and_surfaces)
{
    uint64_t seed = 4;
    for (int n = 0; n < 10; n++) {
        struct mill_world *w = make_mill(&setting[_i], &seed);
        const double turn = w->turn;
        /* crowd them: some overlaps, some outside */
        for (int32_t i = 0; i < w->balls; i++)
            w->ball[i].r = vec3_axpy(w->ball[i].r, 1e-3, direction(&seed));
        struct mill_predict *p = start(w);
        int overlapping = 0;
        for (int32_t i = 0; i < w->balls; i++) {
            double deepest = -mill_world_gap(w, w->ball[i].r, radius_of(w, i), turn);
            for (int32_t j = 0; j < w->balls; j++) {
                const double d = vec3_norm(vec3_sub(w->ball[j].r, w->ball[i].r));
                if (j != i)
                    deepest = fmax(deepest, radius_of(w, i) + radius_of(w, j) - d);
            }
            const double found = mill_predict_overlap(p, i, 0.0);
            overlapping += deepest > 0.0;
            if (deepest > 0.0)
                ck_assert_double_eq_tol(found, deepest, 1e-16);
            else
                ck_assert_double_le(found, 0.0);
        }
        ck_assert_int_gt(overlapping, 3);
        mill_predict_free(p);
        mill_world_free(w);
    }
}
END_TEST

/* ---- the rotor's heading, as a surface is told it ---- */

/* The last question put to the drum */
static struct {
    long asked;
    double turn;
    struct mill_heading heading;
} heard;

static double listen(const struct mill_shape *shape, const struct mill_flight *f, double radius,
                     double turn, double horizon, bool touching)
{
    (void)shape, (void)radius, (void)horizon, (void)touching;
    heard.asked++;
    heard.turn = turn;
    heard.heading = f->heading;
    return (double)INFINITY;
}

/* Plans a ball at the drum with the rotor at `turn`: how wrong the heading is. */
static double heading_error(struct mill_predict *p, struct mill_world *w, int32_t i, double turn)
{
    const long before = heard.asked;
    w->turn = turn;
    mill_predict_ball(p, i, 0.0, MILL_NOBODY);
    ck_assert_int_eq(heard.asked, before + 1);
    ck_assert_double_eq(heard.turn, turn);
    return fmax(fabs(heard.heading.cos - cos(turn)), fabs(heard.heading.sin - sin(turn)));
}

/* Angles that grow, fall, rest and jump, by steps that are turned on and by steps that are not */
START_TEST(the_heading_is_that_of_the_rotor_s_angle)
{
    uint64_t seed = 5;
    struct mill_world *w = make_mill(&setting[2], &seed);
    struct mill_predict *p = start(w);
    struct mill_shape_ops ops = *w->shape[0]->ops;
    const struct mill_shape_ops *const real = w->shape[0]->ops;
    int32_t i = 0;
    double turn = 0.0, worst = 0.0;
    ck_assert_int_eq(ops.kind, MILL_BALL_DRUM);
    ops.next_contact = listen;
    w->shape[0]->ops = &ops;
    for (int32_t k = 0; k < w->balls; k++) { /* the one nearest to the drum */
        if (hypot(w->ball[k].r.y, w->ball[k].r.z) > hypot(w->ball[i].r.y, w->ball[i].r.z))
            i = k;
    }
    for (int n = 0; n < 500000; n++) {
        const double way = n / 1000 % 3 == 2 ? -1.0 : 1.0;
        switch (below(&seed, 200)) {
        case 0:
            turn = uniform(&seed, -20.0, 20.0);
            break;
        case 1:
            turn += way * 0.02 * (1.0 + uniform(&seed, -1e-15, 1e-15));
            break;
        case 2:
            break;
        default:
            turn += way * log_uniform(&seed, 1e-9, 0.03);
        }
        worst = fmax(worst, heading_error(p, w, i, turn));
    }
    ck_assert_double_lt(worst, 1e-14);
    w->shape[0]->ops = real;
    mill_predict_free(p);
    mill_world_free(w);
}
END_TEST

int main(void)
{
    const struct unit_test tests[] = {
    };
    return unit_run("schedule", tests, sizeof tests / sizeof *tests);
}
