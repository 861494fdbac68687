/* When does a flying ball meet a body, or the walls around it, on a chain of motions? Against a
 * march along the gap, which moves on by a bound of its speed (Lipschitz): before the time returned
 * the ball is nowhere inside, and at that time it touches and does not move away; where none is
 * returned it never is inside. Then the ball rebounds, and the same is asked of its next flight,
 * which begins at the body. Motions may be next to nothing, or swift; bodies may be thin, sharp or
 * flat. */
#include "fuzz.h"

#include "geometry/shapes.h"

#define TOLERANCE 1e-9 /* [m] the promise about overlaps */
#define TOUCHING 1e-12 /* [m] wider than what rounding leaves of a gap at a contact */
#define FAR 1.0        /* [m] balls stay within */
enum { CHAIN = 3, ROWS = 5, MOST_MARCH = 2000, MOST_HOPS = 6 };

struct link {
    int kind; /* turn, swing, shift, table */
    struct mill_turn turn;
    struct mill_swing swing;
    struct mill_shift shift;
    struct mill_table table;
    double row[ROWS][7];
};

struct shot {
    struct link link[CHAIN];
    int links;
    struct mill_motion *motion[CHAIN];
    const struct mill_solid *solid;
    const char *word; /* for it in a deck */
    struct mill_body body;
    struct mill_shape **shape;
    int shapes;
    struct mill_flight flight;
    double radius, now, horizon, restitution, floor;
};

/* ---- from bytes ---- */

static vec3 somewhere(struct fuzz_bytes *b, double most)
{
    return fuzz_choice(b, 3) ? vec3_scale(fuzz_direction(b), fuzz_log(b, 1e-9, most))
                             : vec3_make(0.0, 0.0, 0.0);
}

static vec3 axis(struct fuzz_bytes *b)
{
    static const vec3 plain[3] = {{0.0, 0.0, 1.0}, {1.0, 0.0, 0.0}, {0.0, -2.0, 0.0}};
    const int k = fuzz_choice(b, 4);
    return k < 3 ? plain[k] : vec3_scale(fuzz_direction(b), fuzz_log(b, 1e-6, 1e6));
}

static void make_rows(struct link *l, struct fuzz_bytes *b)
{
    const double period = fuzz_log(b, 1e-3, 10.0);
    for (int k = 0; k < ROWS; k++) {
        l->row[k][0] = (k ? l->row[k - 1][0] : 0.0) + period * fuzz_log(b, 1e-2, 1.0);
        for (int i = 1; i < 7; i++)
            l->row[k][i] = fuzz_uniform(b, -1.0, 1.0) * (i < 4 ? 0.02 : 2.0);
    }
    for (int i = 1; i < 7; i++)
        l->row[ROWS - 1][i] = l->row[0][i];
}

static void make_link(struct link *l, struct fuzz_bytes *b)
{
    l->kind = fuzz_choice(b, 4);
    const double frequency = fuzz_choice(b, 4) ? fuzz_log(b, 1e-3, 100.0) : 0.0;
    const double phase = fuzz_uniform(b, -7.0, 7.0);
    l->turn = (struct mill_turn){.centre = somewhere(b, 0.1), .axis = axis(b), .angle = phase};
    l->turn.speed =
        fuzz_choice(b, 4) ? fuzz_log(b, 1e-6, 300.0) * (fuzz_choice(b, 2) ? 1.0 : -1.0) : 0.0;
    l->swing = (struct mill_swing){l->turn.centre, l->turn.axis, fuzz_uniform(b, -1.0, 1.0),
                                   frequency, phase};
    l->shift =
        (struct mill_shift){somewhere(b, 0.02), vec3_make(phase, 2.0 * phase, 0.0), frequency};
    if (l->kind == 3)
        make_rows(l, b);
}

static void place_body(struct mill_body *is, struct fuzz_bytes *b)
{
    const vec3 z = axis(b), any = fuzz_direction(b);
    is->z = vec3_scale(z, 1.0 / vec3_norm(z));
    const vec3 x = vec3_axpy(any, -vec3_dot(any, is->z), is->z);
    is->x = vec3_norm(x) > 1e-3 ? vec3_scale(x, 1.0 / vec3_norm(x)) : vec3_make(1.0, 0.0, 0.0);
    is->y = vec3_cross(is->z, is->x);
    is->x = vec3_cross(is->y, is->z);
    is->centre = somewhere(b, 0.1);
}

/* false: these numbers make no body */
static bool make_body(struct shot *s, struct fuzz_bytes *b)
{
    static const char *const word[] = {"box", "cylinder", "cone", "capsule", "sphere"};
    const int kind = fuzz_choice(b, 5);
    struct mill_body *is = &s->body;
    s->solid = mill_shapes_solid(kind);
    s->word = word[kind];
    is->inside = fuzz_choice(b, 2);
    place_body(is, b);
    const double lo = is->inside ? 0.01 : 1e-6;
    is->size = vec3_make(fuzz_log(b, lo, 0.1), fuzz_log(b, lo, 0.1), fuzz_log(b, lo, 0.1));
    is->radius = fuzz_log(b, lo, 0.1);
    is->end_radius = fuzz_choice(b, 4) ? fuzz_log(b, lo, 0.1) : 0.0;
    is->length = fuzz_log(b, lo, 0.2);
    is->rounding = !is->inside && fuzz_choice(b, 2) ? fuzz_log(b, 1e-9, 0.05) : 0.0;
    return mill_solid_is_sound(s->solid, is);
}

static bool make_shot(struct shot *s, struct fuzz_bytes *b)
{
    memset(s, 0, sizeof *s);
    s->links = fuzz_choice(b, CHAIN + 1);
    for (int k = 0; k < s->links; k++)
        make_link(&s->link[k], b);
    s->radius = fuzz_log(b, 1e-4, 0.01);
    s->now = fuzz_uniform(b, 0.0, 0.0625);
    s->horizon = fuzz_choice(b, 2) ? fuzz_log(b, 1e-7, 0.05) : 0.01;
    s->restitution = fuzz_uniform(b, 0.0, 1.0);
    s->floor = fuzz_choice(b, 2) ? 5e-3 : fuzz_log(b, 1e-6, 1.0);
    s->flight.g = fuzz_choice(b, 2) ? vec3_scale(fuzz_direction(b), fuzz_log(b, 1e-6, 100.0))
                                    : vec3_make(0.0, 0.0, -9.81);
    s->flight.pull = vec3_norm(s->flight.g);
    s->flight.slack = s->flight.travel = INFINITY;
    return make_body(s, b);
}

/* ---- the mill around it ---- */

static void open_mill(struct shot *s)
{
    for (int k = 0; k < s->links; k++) {
        struct link *l = &s->link[k];
        l->table = (struct mill_table){ROWS, (const double(*)[7])l->row};
        s->motion[k] = l->kind == 0   ? mill_turn_type.create(&l->turn)
                       : l->kind == 1 ? mill_swing_type.create(&l->swing)
                       : l->kind == 2 ? mill_shift_type.create(&l->shift)
                                      : mill_table_type.create(&l->table);
        fuzz_require(s->motion[k], "out of memory");
        s->motion[k]->on = k > 0 ? s->motion[k - 1] : NULL;
    }
    const struct mill_setup_surface surface = {
        .solid = s->solid, .body = &s->body, .motion = s->links - 1, .kind = MILL_KINDS};
    const struct mill_setup setup = {.motions = s->links, .surfaces = 1, .surface = &surface};
    const struct mill_reach places = {{-FAR, -FAR, -FAR}, {FAR, FAR, FAR}, INFINITY};
    fuzz_require(mill_shapes_create(&setup, &places, s->motion, &s->shape, &s->shapes),
                 "out of memory");
}

static void close_mill(struct shot *s)
{
    mill_shapes_free(s->shape, s->shapes);
    for (int k = 0; k < s->links; k++)
        free(s->motion[k]);
}

static double gap_of(const struct shot *s, vec3 r, double t, int *which)
{
    double least = INFINITY;
    for (int k = 0; k < s->shapes; k++) {
        const struct mill_pose pose = mill_shape_pose(s->shape[k], s->now + t);
        const double gap = mill_shape_gap(s->shape[k], r, s->radius, &pose);
        if (gap < least) {
            least = gap;
            *which = k;
        }
    }
    return least;
}

/* A ball clear of it, at rest or flying; false: none was found */
static bool aim(struct shot *s, struct fuzz_bytes *b)
{
    int which = 0;
    const struct mill_pose pose =
        mill_motion_pose(s->links ? s->motion[s->links - 1] : NULL, s->now);
    vec3 r = mill_pose_out(&pose, vec3_add(s->body.centre, somewhere(b, 0.05)));
    double gap = gap_of(s, r, 0.0, &which);
    const struct mill_pose at = mill_shape_pose(s->shape[which], s->now);
    const struct mill_contact c =
        s->shape[which]->type->contact(s->shape[which], r, s->radius, &at);
    if (fuzz_choice(b, 2)) { /* next to it, or touching */
        r = vec3_axpy(r, (fuzz_choice(b, 2) ? fuzz_log(b, 1e-15, 1e-2) : 0.0) - c.gap, c.normal);
        gap = gap_of(s, r, 0.0, &which);
    }
    const double speed = fuzz_choice(b, 5) ? fuzz_log(b, 1e-6, 30.0) : 0.0;
    s->flight.r = r;
    s->flight.v =
        vec3_scale(fuzz_choice(b, 2) ? fuzz_direction(b) : vec3_scale(c.normal, -1.0), speed);
    if (fuzz_choice(b, 2))
        s->flight.v = vec3_add(s->flight.v, c.velocity);
    return gap >= -TOUCHING && vec3_norm(r) < 0.5 * FAR;
}

/* ---- claims ---- */

static vec3 place(const struct shot *s, double t)
{
    return vec3_fly(s->flight.r, s->flight.v, s->flight.g, t);
}

/* No gap changes faster during the flight [m/s] */
static double fastest(const struct shot *s)
{
    const struct mill_motion *m = s->links ? s->motion[s->links - 1] : NULL;
    const struct mill_motion_bounds o = mill_motion_bounds(m, s->body.centre);
    const double v = vec3_norm(s->flight.v) + s->flight.pull * s->horizon;
    const double reach = vec3_norm(vec3_sub(s->flight.r, o.home)) + o.far + v * s->horizon;
    return v + o.speed + o.turning * reach + 1e-9;
}

/* Nowhere deeper than the tolerance before `end`, as far as the march has patience */
static void march(const struct shot *s, double end, double t_contact)
{
    const double v = fastest(s), least = 0.5 * TOLERANCE;
    int which;
    double t = 0.0;
    for (int step = 0; t < end && step < MOST_MARCH; step++) {
        const double gap = gap_of(s, place(s, t), t, &which);
        fuzz_require(gap >= -TOLERANCE, "a %s overlaps by %.3g m at %.17g s, before %.17g s",
                     s->word, -gap, t, t_contact);
        t += fmax(fabs(gap), least) / v;
    }
}

/* The first contact of all surfaces; asks again where a search asks for it, but does not go on for
 * ever where a body whirls a thousand times within the horizon: *known: what comes until then. */
static double first_contact(struct shot *s, int *which, double *known)
{
    double best = INFINITY;
    *known = s->horizon;
    for (int k = 0; k < s->shapes; k++) {
        double t = 0.0;
        for (int asked = 0;; asked++) {
            if (asked == 50) {
                *known = fmin(*known, t);
                break;
            }
            struct mill_flight f = s->flight;
            f.r = place(s, t);
            f.v = vec3_axpy(s->flight.v, t, s->flight.g);
            const double left = fmin(s->horizon, best) - t;
            if (!(left >= 0.0))
                break;
            const struct mill_hit hit = s->shape[k]->type->next_contact(s->shape[k], &f, s->radius,
                                                                        s->now + t, left, false);
            fuzz_require(hit.state == MILL_HIT_NONE || (hit.t >= 0.0 && hit.t <= left),
                         "a contact after %g s within %g s", hit.t, left);
            if (hit.state == MILL_HIT_NONE)
                break;
            t += hit.t;
            if (hit.state == MILL_HIT_CONTACT) {
                best = t;
                *which = k;
                break;
            }
            fuzz_require(hit.t > 0.0, "a search that stays where it is");
        }
    }
    return best;
}

/* The ball touches and does not part; then it rebounds. */
static void meet(struct shot *s, double t, int which)
{
    const struct mill_shape *shape = s->shape[which];
    const vec3 r = place(s, t), v = vec3_axpy(s->flight.v, t, s->flight.g);
    const struct mill_pose pose = mill_shape_pose(shape, s->now + t);
    const struct mill_contact c = mill_shape_meet(shape, r, v, s->radius, &pose);
    const double approach = -vec3_dot(vec3_sub(v, c.velocity), c.normal);
    const double slack = TOUCHING * (1.0 + vec3_norm(v) + vec3_norm(c.velocity));
    fuzz_require(c.gap <= slack, "a %s is met with a gap of %.3g m", s->word, c.gap);
    fuzz_require(approach >= -1e-6 * (1.0 + vec3_norm(v) + vec3_norm(c.velocity)),
                 "a %s is met while they part at %.3g m/s", s->word, -approach);
    fuzz_require(fabs(vec3_norm(c.normal) - 1.0) < 1e-12, "a normal of length %.17g",
                 vec3_norm(c.normal));
    s->flight.v = vec3_axpy(v, approach + fmax(s->restitution * approach, s->floor), c.normal);
    s->flight.r = r;
    s->now += t;
    s->horizon -= t;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct fuzz_bytes b = {data, size};
    struct shot s;
    if (!make_shot(&s, &b))
        return 0;
    open_mill(&s);
    if (fuzz_shown())
        printf("%s %s, %d motions, a ball of %g m\n", s.word, s.body.inside ? "inside" : "outside",
               s.links, s.radius);
    bool flies = aim(&s, &b);
    for (int meeting = 0; flies && meeting < MOST_HOPS; meeting++) {
        int which = 0;
        double known;
        const double t = first_contact(&s, &which, &known);
        march(&s, fmin(t, known), t);
        flies = t <= known;
        if (flies)
            meet(&s, t, which);
    }
    close_mill(&s);
    return 0;
}
