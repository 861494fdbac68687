/* Claims about the schedule: the first event in the calendar that is a contact is the first contact
 * of all, found by looking at every pair and every surface. */
#include "engine/schedule.h"
#include "mills.h"

#define HORIZON 0.0625 /* [s] */
enum { BLADE = 4 };    /* the first one, after drum, end walls and shaft */

/* ---- mills ---- */

struct setting {
    vec3 gravity;
    bool mixture, rotor;
};

static const struct setting setting[] = {
    {{0.0, 0.0, 0.0}, false, false},     {{0.0, 0.0, -9.81}, false, false},
    {{0.0, 0.0, -9.81}, false, true},    {{0.0, 0.0, 0.0}, true, true},
    {{3.0, -200.0, 150.0}, true, false}, {{0.0, 0.0, -9.81}, true, true},
};
enum { SETTINGS = sizeof setting / sizeof *setting };

static const struct mill_setup_balls equal = {.diameter = 0.005, .density = STEEL, .count = 200};
static const struct mill_setup_balls mixture[] = {
    {.diameter = 0.009, .density = STEEL, .count = 15},
    {.diameter = 0.004, .density = 2500.0, .count = 60},
    {.diameter = 0.0015, .density = 6000.0, .count = 125}};
static const struct mill_blade blade = {
    .tip_radius = 0.024, .width = 0.01, .thickness = 0.004, .pitch = 20 * DEG};

static vec3 random_velocity(uint64_t *seed)
{
    /* some at rest, most between a creep and a throw */
    return below(seed, 10) ? vec3_scale(direction(seed), log_uniform(seed, 1e-3, 5.0)) : nought;
}

static struct mill_world *make_mill(const struct setting *s, uint64_t *seed)
{
    struct model m = {.setup = {.gravity = s->gravity,
                                .drum = {.radius = 0.03, .length = 0.06},
                                .seed = 1 + (unsigned long)below(seed, 1000)},
                      .rotor = {.speed = 1500 * RPM, .angle = 40 * DEG},
                      .shaft = s->rotor ? 0.006 : 0.0,
                      .blades = s->rotor ? 3 : 0,
                      .blade = {blade},
                      .balls = {equal}};
    if (s->mixture)
        memcpy(m.balls, mixture, sizeof mixture);
    struct mill_world *w = model_world(&m);
    for (int32_t i = 0; i < w->balls; i++)
        w->ball[i].v = random_velocity(seed);
    return w;
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
    double t = 0.0;
    for (int asked = 0; asked < 1000; asked++) {
        /* its place is not told: what the schedule rejects by it is searched here */
        const struct mill_flight f = {.r = mill_world_position(w, i, now + t),
                                      .v = mill_world_velocity(w, i, now + t),
                                      .g = w->g,
                                      .pull = vec3_norm(w->g),
                                      .slack = (double)INFINITY,
                                      .travel = (double)INFINITY};
        const struct mill_hit hit = s->type->next_contact(s, &f, radius_of(w, i), now + t,
                                                          window - t, touching && t == 0.0);
        t += hit.t;
        if (hit.state != MILL_HIT_ASK_AGAIN)
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
            if (t < first.t)
                first = (struct first){t, i, j, MILL_NOBODY};
        }
    }
    for (int32_t i = 0; i < w->balls; i++) {
        for (int32_t k = 0; k < w->shapes; k++) {
            const double t =
                now + shape_contact(w, i, k, now, first.t - now, i == toucher && k == touched);
            if (t < first.t)
                first = (struct first){t, i, MILL_NOBODY, k};
        }
    }
    return first;
}

/* ---- the first contact by the calendar ---- */

static struct mill_schedule *start(struct mill_world *w)
{
    struct mill_schedule *p = NULL;
    struct mill_error error = {""};
    ck_assert_int_eq(mill_schedule_create(w, &p, &error), MILL_OK);
    mill_schedule_begin(p, HORIZON);
    for (int32_t i = 0; i < w->balls; i++)
        mill_schedule_ball(p, i, 0.0, MILL_NOBODY);
    return p;
}

/* The plan's kind is that of its earliest time, of equal ones a pair, then a surface. */
static void check_kind(const struct mill_plan *plan, double t)
{
    ck_assert_double_eq(mill_plan_time(plan), t);
    ck_assert_double_eq(t, fmin(fmin(plan->pair_t, plan->shape_t), plan->exit_t));
    ck_assert_int_eq(plan->next == MILL_NEXT_PAIR, plan->pair_t == t);
    ck_assert_int_eq(plan->next == MILL_NEXT_EXIT, plan->pair_t > t && plan->shape_t > t);
}

/* Lets cell crossings, stale plans and searches that gave up pass, to the first contact. */
static struct first first_by_calendar(struct mill_schedule *p, struct mill_world *w)
{
    for (;;) {
        double t = NAN;
        const int32_t i = mill_calendar_next(p->calendar, &t);
        const struct mill_plan *plan = &p->plan[i];
        if (i < 0 || t >= HORIZON) {
            return (struct first){HORIZON, MILL_NOBODY, MILL_NOBODY, MILL_NOBODY};
        }
        check_kind(plan, t);
        move_to(w, i, t);
        if (plan->next == MILL_NEXT_EXIT) {
            ck_assert(mill_schedule_cross(p, i, t));
            continue;
        }
        if (plan->next == MILL_NEXT_SURFACE)
            return (struct first){t, i, MILL_NOBODY, plan->shape};
        if (plan->next == MILL_NEXT_PAIR &&
            w->ball[plan->partner].contacts == plan->partner_contacts)
            return (struct first){t, i, plan->partner, MILL_NOBODY};
        mill_schedule_ball(p, i, t, MILL_NOBODY);
    }
}

static void check_same(const struct first *slow, const struct first *fast)
{
    /* at a millimetre a second: roundings of 1e-17 m, and gaps that a search by steps calls closed
     */
    const bool by_steps = slow->shape >= BLADE;
    ck_assert_double_eq_tol(fast->t, slow->t, (by_steps ? 1e-12 : 1e-14) + 1e-12 * slow->t);
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
static int32_t happen(struct mill_schedule *p, struct mill_world *w, const struct first *e,
                      uint64_t *seed)
{
    move_to(w, e->ball, e->t);
    if (e->shape != MILL_NOBODY) {
        const struct mill_shape *s = w->shape[e->shape];
        const struct mill_pose pose = mill_shape_pose(s, e->t);
        const struct mill_contact c =
            s->type->contact(s, w->ball[e->ball].r, radius_of(w, e->ball), &pose);
        throw_off(w, e->ball, c.normal, c.velocity, seed);
        mill_schedule_ball(p, e->ball, e->t, e->shape);
        return e->ball;
    }
    move_to(w, e->partner, e->t);
    const vec3 d = vec3_sub(w->ball[e->partner].r, w->ball[e->ball].r);
    const vec3 n = vec3_scale(d, 1.0 / vec3_norm(d));
    throw_off(w, e->ball, vec3_scale(n, -1.0), nought, seed);
    throw_off(w, e->partner, n, nought, seed);
    mill_schedule_ball(p, e->ball, e->t, MILL_NOBODY);
    mill_schedule_ball(p, e->partner, e->t, MILL_NOBODY);
    return MILL_NOBODY;
}

/* ---- claims ---- */

SLOW_TEST(the_first_contact_of_a_fresh_world_is_the_first_of_all_pairs_and_surfaces, SETTINGS)
{
    int shapes = 0, pairs = 0;
    for (uint64_t n = 0; n < 25; n++) {
        uint64_t seed = 1000 * n + 1;
        struct mill_world *w = make_mill(&setting[_i], &seed);
        struct mill_schedule *p = start(w);
        const struct first slow = first_of_all(w, 0.0, MILL_NOBODY, MILL_NOBODY);
        const struct first fast = first_by_calendar(p, w);
        check_same(&slow, &fast);
        shapes += fast.shape != MILL_NOBODY;
        pairs += fast.partner != MILL_NOBODY;
        mill_schedule_free(p);
        mill_world_free(w);
    }
    ck_assert_int_gt(pairs, 0);
    ck_assert_int_gt(pairs + shapes, 20);
}

/* Contact after contact, with balls thrown anew between them, so that plans are as stale as in a
 * run. */
SLOW_TEST(every_next_contact_of_a_run_is_the_first_of_all, SETTINGS)
{
    int shapes = 0, pairs = 0;
    for (uint64_t n = 0; n < 3; n++) {
        uint64_t seed = 1000 * n + 2;
        struct mill_world *w = make_mill(&setting[_i], &seed);
        struct mill_schedule *p = start(w);
        int32_t toucher = MILL_NOBODY, touched = MILL_NOBODY;
        double now = 0.0;
        for (int event = 0; event < unit_draws(120); event++) {
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
                mill_schedule_ball(p, other, now, MILL_NOBODY);
            }
        }
        mill_schedule_free(p);
        mill_world_free(w);
    }
    ck_assert_int_gt(pairs, unit_draws(50));
    ck_assert_int_gt(shapes, unit_draws(20));
}

SLOW_TEST(balls_that_overlap_and_close_meet_at_once, SETTINGS)
{
    uint64_t seed = 3;
    for (int n = 0; n < unit_draws(50); n++) {
        struct mill_world *w = make_mill(&setting[_i], &seed);
        const int32_t i = below(&seed, w->balls), j = (i + 1) % w->balls;
        /* ball j goes a hair into ball i, wherever that is, and drives on into it */
        const double sum = radius_of(w, i) + radius_of(w, j);
        const vec3 n_ij = direction(&seed);
        w->ball[j].r = vec3_axpy(w->ball[i].r, sum - log_uniform(&seed, 1e-16, 1e-9), n_ij);
        w->ball[j].v = vec3_axpy(w->ball[i].v, -0.1, n_ij);
        struct mill_schedule *p = start(w);
        ck_assert_double_le(p->plan[i].pair_t, 0.0);
        ck_assert_double_le(p->plan[j].pair_t, 0.0);
        /* opening: no contact of these two until they close */
        w->ball[j].v = vec3_axpy(w->ball[i].v, 0.1, n_ij);
        mill_schedule_ball(p, i, 0.0, MILL_NOBODY);
        ck_assert(p->plan[i].partner != j);
        mill_schedule_free(p);
        mill_world_free(w);
    }
}

LOOP_TEST(the_deepest_overlap_is_that_of_all_pairs_and_surfaces, SETTINGS)
{
    uint64_t seed = 4;
    for (int n = 0; n < 10; n++) {
        struct mill_world *w = make_mill(&setting[_i], &seed);
        /* crowd them: some overlaps, some outside */
        for (int32_t i = 0; i < w->balls; i++)
            w->ball[i].r = vec3_axpy(w->ball[i].r, 1e-3, direction(&seed));
        struct mill_schedule *p = start(w);
        int overlapping = 0;
        for (int32_t i = 0; i < w->balls; i++) {
            double deepest = -world_gap(w, w->ball[i].r, radius_of(w, i), 0.0);
            for (int32_t j = 0; j < w->balls; j++) {
                const double d = vec3_norm(vec3_sub(w->ball[j].r, w->ball[i].r));
                if (j != i)
                    deepest = fmax(deepest, radius_of(w, i) + radius_of(w, j) - d);
            }
            const double found = mill_schedule_overlap(p, i, 0.0);
            overlapping += deepest > 0.0;
            if (deepest > 0.0)
                ck_assert_double_eq_tol(found, deepest, 1e-16);
            else
                ck_assert_double_le(found, 0.0);
        }
        ck_assert_int_gt(overlapping, 3);
        mill_schedule_free(p);
        mill_world_free(w);
    }
}

/* ---- the place in a body's frame, as a shape is told it ---- */

/* The last question put to a blade */
static struct {
    long asked;
    double now, horizon;
    struct mill_flight flight;
} heard;

static struct mill_hit listen(const struct mill_shape *shape, const struct mill_flight *f,
                              double radius, double now, double horizon, bool touching)
{
    (void)shape, (void)radius, (void)touching;
    heard.asked++;
    heard.now = now;
    heard.horizon = horizon;
    heard.flight = *f;
    return mill_hit_at(INFINITY);
}

/* How much of the travel told the ball needs at most within the horizon, and of the slack around
 * the course told */
static double share_of_travel(const struct mill_motion *motion, double *slack)
{
    const struct mill_flight *f = &heard.flight;
    const vec3 course = mill_pose_turn_in(f->pose, f->course);
    double farthest = 0.0, off = 0.0;
    for (int k = 0; k <= 20; k++) {
        const double t = heard.horizon * k / 20.0;
        const struct mill_pose pose = mill_motion_pose(motion, heard.now + t);
        const vec3 at = mill_pose_in(&pose, vec3_fly(f->r, f->v, f->g, t));
        farthest = fmax(farthest, vec3_norm(vec3_sub(at, f->place)));
        off = fmax(off, vec3_norm(vec3_sub(at, vec3_axpy(f->place, t, course))));
    }
    *slack = off / f->slack;
    return farthest / f->travel;
}

/* Times that grow, stand and fall back, by steps for which the last pose serves and by longer ones;
 * balls of any speed */
LOOP_TEST(a_ball_is_never_farther_from_the_place_told_than_told, SETTINGS)
{
    uint64_t seed = 5;
    if (!setting[_i].rotor)
        return;
    struct mill_world *w = make_mill(&setting[_i], &seed);
    struct mill_shape_type listener = *mill_box_solid.surface;
    long asked = 0;
    double now = 0.0, most = 0.0, sum = 0.0, slack = 0.0, widest = 0.0;
    listener.next_contact = listen;
    for (int k = 0; k < w->shapes; k++) {
        if (w->shape[k]->solid == &mill_box_solid)
            w->shape[k]->type = &listener;
    }
    struct mill_schedule *p = start(w);
    for (int n = 0; n < 100000; n++) {
        const int32_t i = below(&seed, w->balls);
        struct mill_ball *b = &w->ball[i];
        now = below(&seed, 100) ? now + log_uniform(&seed, 1e-9, 1e-3) : 0.0;
        now = now > HORIZON ? 0.0 : now;
        b->t = now;
        b->v = vec3_scale(direction(&seed), below(&seed, 5) ? log_uniform(&seed, 1e-3, 50.0) : 0.0);
        const long before = heard.asked;
        mill_schedule_ball(p, i, now, MILL_NOBODY);
        if (heard.asked == before)
            continue;
        const double share = share_of_travel(w->motion[0], &slack);
        asked++;
        most = fmax(most, share);
        widest = fmax(widest, slack);
        ck_assert_double_ge(heard.flight.window, heard.horizon);
        sum += share;
    }
    ck_assert_int_gt(asked, 10000);
    ck_assert_double_le(most, 1.0);
    ck_assert_double_le(widest, 1.0);
    ck_assert_double_gt(widest, 0.5);
    ck_assert_double_gt(sum / (double)asked, 0.25); /* and it is not told much too far */
    mill_schedule_free(p);
    mill_world_free(w);
}

int main(void)
{
    return unit_run("schedule");
}
