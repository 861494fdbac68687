/* Whole mills. Bytes that begin like a deck are one, with at most MOST_BALLS balls. All others are
 * read as choices, of a wavy drum after a '~': drum, rotor, blades, laws, and balls placed one by
 * one, in free flight, at rest on a wall, on each other, in corners. Each accepted mill runs for
 * some thousand events, in pieces, and never may bodies overlap, balls be lost or the books not
 * close. A second run, in one piece or saved halfway and taken up by another, must give the same
 * bits; or it is a paranoid one.
 */
#include "../unit/state_fixture.h"
#include "mill.h"
#include "proof/paranoid.h"

#include "../unit/contour_oracle.h"
#include "../unit/parts.h"
#include "deck/deck.h"
#include "deck/deck_private.h"

enum {
    MOST_BALLS = 100,
    MOST_PARTS = 41, /* the shaft and blades */
    EVENTS = 2000,
    LONG = 40000,
    PIECES = 8,
    CHECKED = 400,
    ROOM = 16384
};

struct script {
    char text[ROOM];
    size_t length;
};

static struct fuzz_file deck_file, start_file;

static void say(struct script *s, const char *format, ...) __attribute__((format(printf, 2, 3)));

static void say(struct script *s, const char *format, ...)
{
    va_list list;
    va_start(list, format);
    const int more = vsnprintf(s->text + s->length, ROOM - s->length, format, list);
    va_end(list);
    fuzz_require(more >= 0 && s->length + (size_t)more < ROOM, "the script is too long");
    s->length += (size_t)more;
}

/* ---- the deck ---- */

/* A part of something: any, or nearly all of it */
static double part(struct fuzz_bytes *b)
{
    switch (fuzz_choice(b, 4)) {
    case 0:
        return 0.5;
    case 1:
        return 1.0 - fuzz_log(b, 1e-12, 1e-1);
    case 2:
        return fuzz_log(b, 1e-6, 1.0);
    default:
        return fuzz_uniform(b, 0.0, 1.0);
    }
}

static double angle(struct fuzz_bytes *b)
{
    const int k = fuzz_choice(b, 3);
    return k == 0 ? 0.0 : k == 1 ? 0.25 * MILL_PI * fuzz_choice(b, 8) : fuzz_uniform(b, -7.0, 7.0);
}

static double signed_log(struct fuzz_bytes *b, double lo, double hi)
{
    const double x = fuzz_log(b, lo, hi);
    return fuzz_choice(b, 2) ? -x : x;
}

static void say_gravity(struct script *s, struct fuzz_bytes *b)
{
    const int k = fuzz_choice(b, 5);
    vec3 g = {0.0, 0.0, -9.81};
    if (k == 1)
        g = vec3_make(0.0, 0.0, 0.0);
    else if (k == 2)
        g = vec3_scale(fuzz_direction(b), 9.81);
    else if (k == 3) {
        const vec3 way = fuzz_direction(b); /* arguments are drawn in any order */
        g = vec3_scale(way, fuzz_log(b, 1e-6, 1e9));
    }
    say(s, "[gravity]\nacceleration = %.17g %.17g %.17g m/s^2\n", g.x, g.y, g.z);
}

static void say_law(struct script *s, struct fuzz_bytes *b)
{
    static const double e[4] = {0.8, 1.0, 0.0, 0.1};
    const int k = fuzz_choice(b, 6);
    say(s, "restitution = %.17g\n", k < 4 ? e[k] : fuzz_uniform(b, 0.0, 1.0));
    if (fuzz_choice(b, 2))
        say(s, "friction = %.17g\n", fuzz_log(b, 1e-3, 10.0));
    if (fuzz_choice(b, 2))
        say(s, "tangential_restitution = %.17g\n", fuzz_uniform(b, -1.0, 1.0));
}

static void say_contacts(struct script *s, struct fuzz_bytes *b)
{
    say(s, "[contact]\n");
    say_law(s, b);
    const int k = fuzz_choice(b, 3);
    if (k > 0)
        say(s, "rebound_floor = %.17g m/s\n", k == 1 ? 0.0 : fuzz_log(b, 1e-9, 10.0));
    const int kinds = fuzz_choice(b, 32);
    for (int kind = 0; kind < MILL_KINDS; kind++)
        if (kinds >> kind & 1) {
            say(s, "[contact.%s]\n", mill_kind_name[kind]);
            say_law(s, b);
        }
}

static void say_rotor(struct script *s, struct fuzz_bytes *b, double radius, double length)
{
    const int turning = fuzz_choice(b, 5);
    if (turning == 4)
        return;
    const double shaft = fuzz_choice(b, 3) == 0 ? 0.0 : radius * 0.7 * part(b);
    const double speed = turning == 0   ? 104.7
                         : turning == 1 ? 0.0
                                        : signed_log(b, 1e-6, turning == 2 ? 1e3 : 1e9);
    say(s, "[rotor]\nspeed = %.17g rad/s\nshaft_radius = %.17g m\nangle = %.17g rad\n", speed,
        shaft, angle(b));
    const int equal = fuzz_choice(b, 6), single = fuzz_choice(b, 4);
    for (int k = equal ? -1 : 0; k < single; k++) {
        const double tip = shaft + (radius - shaft) * part(b);
        const double pitch = fuzz_choice(b, 2) ? angle(b) : 0.0;
        /* what the corners may be wide around the axis, and what the blade may take along it */
        const double around = 2.0 * sqrt(radius * radius - tip * tip);
        const double along = k < 0 ? length / equal : length;
        const double thickness = fmin(around, radius) * 0.7 * fuzz_log(b, 1e-6, 1.0);
        const double width = (pitch != 0.0 ? 0.5 * fmin(around, along) : along) * part(b);
        if (k < 0)
            say(s, "[blades]\ncount = %d\nangle_step = %.17g rad\n", equal, angle(b));
        else {
            const double x = fuzz_choice(b, 2) ? 0.0 : fuzz_uniform(b, -0.5, 0.5);
            say(s, "[blade.b%d]\nposition = %.17g m\nangle = %.17g rad\n", k, x * (length - width),
                angle(b));
        }
        say(s, "tip_radius = %.17g m\nwidth = %.17g m\nthickness = %.17g m\npitch = %.17g rad\n",
            tip, width, thickness, pitch);
    }
}

/* Returns their height [m]. */
static double say_buckles(struct script *s, struct fuzz_bytes *b, double radius)
{
    const int buckles = 2 + fuzz_choice(b, 20);
    const double height = mill_deck_lining_highest(buckles, radius) * part(b);
    say(s, "profile = wavy\nbuckles = %d\nbuckle_height = %.17g m\nbuckle_angle = %.17g rad\n",
        buckles, height, angle(b));
    return height;
}

/* A mill of `kinds` kinds of balls, one each. */
static void say_mill(struct script *s, struct fuzz_bytes *b, int kinds, bool wavy)
{
    static const double sizes[4] = {0.075, 1e-3, 0.5, 10.0};
    const int size = fuzz_choice(b, 8);
    const double radius = size < 4   ? sizes[size]
                          : size < 7 ? fuzz_log(b, 1e-6, 1e3)
                                     : fuzz_log(b, 1e-8, 1e9);
    const double length = radius * (fuzz_choice(b, 2) ? fuzz_log(b, 0.05, 20.0) : 1.6);
    say(s, "[run]\ntime = 10 s\n[drum]\nradius = %.17g m\nlength = %.17g m\n", radius, length);
    const double bore = wavy ? radius - say_buckles(s, b, radius) : radius;
    say_gravity(s, b);
    say_contacts(s, b);
    say_rotor(s, b, bore, length);
    for (int k = 0; k < kinds; k++) {
        const int how = fuzz_choice(b, 4);
        const double most = fmin(2.0 * bore, length);
        const double d =
            how == 0 ? 5e-3 / 75e-3 * bore : most * (how == 1 ? part(b) : fuzz_log(b, 0.01, 0.5));
        say(s, "[balls.k%d]\ncount = 1\ndiameter = %.17g m\ndensity = %.17g kg/m^3\n", k, d,
            fuzz_choice(b, 2) ? fuzz_log(b, 1e-3, 1e6) : 7800.0);
    }
}

static struct mill_deck *read_deck(const char *text, size_t size)
{
    struct mill_error error = {""};
    struct mill_deck *deck = NULL;
    const char *path = fuzz_file_write(&deck_file, text, size);
    const enum mill_status status = mill_deck_read(path, 0, NULL, NULL, NULL, NULL, &deck, &error);
    if (status != MILL_OK && fuzz_shown())
        fprintf(stderr, "%s\n", error.text);
    return deck;
}

/* ---- the balls ---- */

struct place {
    vec3 r;
    double radius;
};

struct placing {
    const struct mill_deck *deck;
    struct mill_motion *rotor;
    struct mill_shape **shape;
    int shapes;
    struct place ball[MOST_BALLS];
    int balls;
    struct script rows;
};

/* The centre of a ball that touches the contour of a drum: at a joint, anywhere on it */
static vec3 at_contour(const struct mill_setup_drum *drum, struct fuzz_bytes *b, double x,
                       double radius)
{
    const int k = fuzz_choice(b, (int)drum->corners);
    vec3 normal;
    vec3 r = contour_at(&drum->corner[k], &drum->corner[((size_t)k + 1) % drum->corners],
                        fuzz_choice(b, 2) ? part(b) : 0.0, &normal);
    r.x = x;
    return vec3_axpy(r, radius, normal);
}

/* Somewhere in the drum: anywhere, or touching wall, end, shaft, corner, or an earlier ball */
static vec3 somewhere(const struct placing *p, struct fuzz_bytes *b, double radius)
{
    const struct mill_deck *d = p->deck;
    const struct mill_setup_drum drum = d->setup.drum;
    const double rho = drum_places(&drum).radius - radius;
    const double half = 0.5 * drum.length - radius;
    const int how = fuzz_choice(b, 6);
    if (how == 5 && p->balls > 0) {
        const struct place *o = &p->ball[fuzz_choice(b, p->balls)];
        return vec3_axpy(o->r, o->radius + radius, fuzz_direction(b));
    }
    const double a = angle(b);
    double x = fuzz_uniform(b, -half, half), far = rho * sqrt(fuzz_uniform(b, 0.0, 1.0));
    if (how == 1 || how == 4)
        far = rho;
    if (how == 2 || how == 4)
        x = fuzz_choice(b, 2) ? half : -half;
    if (how == 3)
        far = d->given.shaft_radius + radius;
    if (drum.corners > 0 && (how == 1 || how == 4))
        return at_contour(&drum, b, x, radius);
    return vec3_make(x, far * cos(a), far * sin(a));
}

static bool is_free(const struct placing *p, vec3 r, double radius)
{
    for (int k = 0; k < p->shapes; k++) {
        const struct mill_pose pose = mill_shape_pose(p->shape[k], 0.0);
        if (!(mill_shape_gap(p->shape[k], r, radius, &pose) >= -1e-12))
            return false;
    }
    for (int i = 0; i < p->balls; i++)
        if (!(vec3_norm(vec3_sub(p->ball[i].r, r)) - p->ball[i].radius - radius >= -1e-12))
            return false;
    return true;
}

static vec3 velocity(struct fuzz_bytes *b)
{
    const int k = fuzz_choice(b, 4);
    if (k == 0)
        return vec3_make(0.0, 0.0, 0.0);
    const vec3 way = fuzz_direction(b);
    return vec3_scale(way, k == 1 ? 1.0 : fuzz_log(b, 1e-12, k == 2 ? 1e2 : 2e8));
}

static void place_kind(struct placing *p, struct fuzz_bytes *b, struct mill_deck_balls *kind)
{
    const double radius = 0.5 * kind->diameter;
    const int tries = 1 + fuzz_choice(b, 60);
    kind->count = 0;
    for (int i = 0; i < tries && p->balls < MOST_BALLS && b->left > 0; i++) {
        const vec3 r = somewhere(p, b, radius), v = velocity(b);
        const vec3 w = fuzz_choice(b, 4) ? vec3_make(0.0, 0.0, 0.0) : velocity(b);
        if (!is_free(p, r, radius))
            continue;
        p->ball[p->balls++] = (struct place){r, radius};
        kind->count++;
        say(&p->rows, "%.17g %.17g %.17g %.9g %.9g %.9g %.9g %.9g %.9g\n", r.x, r.y, r.z, v.x, v.y,
            v.z, w.x, w.y, w.z);
    }
}

/* The deck's surfaces, before it has balls */
static void make_surfaces(struct placing *p)
{
    static struct mill_setup_surface surface[MOST_PARTS + 1];
    const struct mill_deck *d = p->deck;
    const struct mill_turn turn = {
        .axis = {1.0, 0.0, 0.0}, .speed = d->given.rotor.speed, .angle = d->given.rotor.angle};
    const struct mill_setup_drum drum = d->setup.drum;
    const struct mill_body around = mill_setup_drum_body(&drum);
    const struct mill_reach places = drum_places(&drum);
    struct mill_setup setup = {.motions = d->mill.rotor, .surface = surface};
    fuzz_require(d->mill.parts <= MOST_PARTS, "%d parts", d->mill.parts);
    surface[setup.surfaces++] = drum_surface(&around, MILL_STILL);
    for (int k = 0; k < d->mill.parts; k++)
        surface[setup.surfaces++] = d->setup.surface[k];
    p->rotor = mill_turn_type.create(&turn);
    fuzz_require(p->rotor && mill_shapes_create(&setup, &places, &p->rotor, &p->shape, &p->shapes),
                 "no surfaces");
}

/* Puts balls into the deck's start file; false when some kind has none. */
static bool place_balls(struct mill_deck *deck, struct fuzz_bytes *b)
{
    static struct placing p;
    p.deck = deck;
    p.balls = 0;
    p.rows.length = 0;
    make_surfaces(&p);
    bool all = true;
    for (int k = 0; k < deck->setup.species && all; k++) {
        place_kind(&p, b, &deck->mill.balls[k]);
        ((struct mill_setup_balls *)deck->setup.balls)[k].count =
            (int32_t)deck->mill.balls[k].count;
        all = deck->mill.balls[k].count > 0;
    }
    mill_shapes_free(p.shape, p.shapes);
    free(p.rotor);
    fuzz_file_write(&start_file, p.rows.text, p.rows.length);
    deck->given.start = start_file.path;
    if (fuzz_shown())
        fprintf(stderr, "start file:\n%.*s\n", (int)p.rows.length, p.rows.text);
    return all;
}

/* ---- the run ---- */

struct way {
    uint64_t events, piece;
    bool saved;    /* halfway, and taken up by another */
    bool paranoid; /* each event against brute force */
};

struct mill {
    struct mill_world *world;
    struct mill_sim *sim;
};

static bool open_mill(const struct mill_deck *deck, struct mill *m)
{
    struct mill_error error = {""};
    const enum mill_status status = mill_deck_setup_world(deck, NULL, &m->world, &error);
    if (status != MILL_OK) {
        fuzz_require(status == MILL_BAD_DECK && !m->world, "status %d: %s", (int)status,
                     error.text);
        fuzz_require_message(error.text);
        if (fuzz_shown())
            fprintf(stderr, "%s\n", error.text);
        return false;
    }
    mill_check_overlaps(m->world, NULL);
    fuzz_require(mill_sim_create(m->world, &m->sim, &error) == MILL_OK, "%s", error.text);
    return true;
}

static void close_mill(struct mill *m)
{
    mill_sim_free(m->sim);
    mill_world_free(m->world);
}

/* A paranoid run allows for the roundings of mills, not for those of balls that would be kilometres
 * away by the time they might meet; and looks into each of a million revolutions. */
static bool is_swift(const struct mill_world *w)
{
    enum { SWIFT = 1000 }; /* [m/s] */
    bool swift =
        fabs(w->rotor_speed) * fmax(w->drum_radius, 0.01) > SWIFT || vec3_norm(w->g) > SWIFT;
    for (int32_t i = 0; i < w->balls; i++)
        swift = swift || vec3_norm(w->ball[i].v) > SWIFT;
    return swift;
}

/* Its state goes to another mill of the same deck. */
static void hand_over(const struct mill_deck *deck, struct mill *m)
{
    struct kept kept;
    kept_init(&kept);
    mill_sim_state(m->sim, &kept.state);
    close_mill(m);
    fuzz_require(open_mill(deck, m), "the same deck is refused");
    struct mill_state *state = kept_load(&kept);
    mill_sim_state(m->sim, state);
    fuzz_require(state->status == MILL_OK, "%s", kept.error.text);
    kept_free(&kept);
}

/* Returns the number of predictions, 0 for a mill that was refused. */
static uint64_t run(const struct mill_deck *deck, const struct way *way, struct mill_ball *state)
{
    struct mill m = {NULL, NULL};
    struct mill_error error = {""};
    if (!open_mill(deck, &m))
        return 0;
    const bool swift = is_swift(m.world);
    /* in a swift mill, each search for each blade may need its most steps: fewer events */
    const uint64_t fewer = swift && way->events > CHECKED ? way->events / CHECKED : 1;
    const uint64_t piece = way->piece / fewer;
    uint64_t events = way->events / fewer;
    if (way->paranoid && !swift)
        fuzz_require(mill_paranoid_start(m.sim, NULL, &error) == MILL_OK, "%s", error.text);
    if (way->saved && mill_run_checked(m.sim, deck->observe.end, events / 2, piece)) {
        hand_over(deck, &m);
        events -= events / 2;
    }
    mill_run_checked(m.sim, deck->observe.end, events, piece);
    memcpy(state, m.world->ball, sizeof *state * (size_t)m.world->balls);
    const uint64_t predictions = m.world->counts.predictions;
    close_mill(&m);
    return predictions;
}

static long mill_balls(const struct mill_deck *deck)
{
    long balls = 0;
    for (int k = 0; k < deck->setup.species; k++)
        balls += deck->mill.balls[k].count;
    return balls;
}

static struct mill_deck *deck_from(struct fuzz_bytes *b, const uint8_t *data, size_t size)
{
    if (size > 0 && (*data == '[' || *data == '#')) {
        struct mill_deck *deck = read_deck((const char *)data, size);
        if (deck && !deck->given.start && mill_balls(deck) <= MOST_BALLS &&
            deck->mill.parts <= MOST_PARTS)
            return deck;
        mill_deck_free(deck);
        return NULL;
    }
    static struct script s;
    const bool wavy = size > 0 && *data == '~';
    s.length = 0;
    if (wavy)
        fuzz_byte(b);
    say_mill(&s, b, 1 + fuzz_choice(b, 3), wavy);
    if (fuzz_shown())
        fprintf(stderr, "%s\n", s.text);
    struct mill_deck *deck = read_deck(s.text, s.length);
    if (deck && !place_balls(deck, b)) {
        mill_deck_free(deck);
        return NULL;
    }
    return deck;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static struct mill_ball once[MOST_BALLS], again[MOST_BALLS];
    struct fuzz_bytes b = {data, size};
    struct mill_deck *deck = deck_from(&b, data, size);
    if (!deck)
        return 0;
    memset(once, 0, sizeof once);
    memset(again, 0, sizeof again);
    const long balls = mill_balls(deck);
    /* few balls may go on until one is pinched and let go */
    const uint64_t events = balls <= 3 && size % 8 == 3 ? LONG : EVENTS;
    const struct way plain = {events, events / PIECES, false, false};
    const struct way other[4] = {{events, events, false, false},
                                 {events, events / 2, true, false},
                                 {CHECKED, CHECKED, false, true},
                                 {0, 0, false, false}};
    const struct way *second = &other[size % 4];
    const uint64_t predictions = run(deck, &plain, once);
    if (predictions > 0 && second->events > 0) {
        const uint64_t same = run(deck, second, again);
        fuzz_require(second->paranoid ||
                         (same == predictions && memcmp(once, again, sizeof once) == 0),
                     "another run, other bits");
    }
    mill_deck_free(deck);
    return 0;
}
