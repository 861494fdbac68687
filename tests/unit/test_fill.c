/* Claims about random first positions: nothing overlaps, the seed decides, what does not fit is
 * answered with a number that does. */
#include "mills.h"
#include "start/fill.h"

#include <time.h>

/* ---- mills to fill ---- */

struct kind {
    double diameter; /* [mm] */
    double share;    /* of the solid volume */
};

struct charge {
    double radius, length; /* [mm] of the drum */
    bool rotor;            /* shaft and pitched blades in proportion */
    struct kind kind[3];   /* diameter 0: no more */
    double fraction;       /* of the free volume */
    double speed;          /* [m/s] */
    unsigned long seed;
};

static const struct charge reference = {75, 120, true, {{5, 1}}, 0.3, 0, 1};

/* The mill of a charge, with one ball of each kind */
static struct model model_of(const struct charge *c)
{
    const double radius = 1e-3 * c->radius, length = 1e-3 * c->length;
    struct model m = {
        .setup = {.drum = {.radius = radius, .length = length}, .speed = c->speed, .seed = c->seed},
        .rotor = {.speed = 50.0, .angle = 25 * DEG},
        .shaft = c->rotor ? 0.2 * radius : 0.0,
        .blades = c->rotor ? 5 : 0,
        .blade = {{.tip_radius = 0.88 * radius,
                   .width = 0.15 * length,
                   .thickness = 0.08 * radius,
                   .pitch = 30 * DEG}}};
    for (int k = 0; k < 3; k++)
        m.balls[k] = (struct mill_setup_balls){
            .diameter = 1e-3 * c->kind[k].diameter, .density = STEEL, .count = 1};
    return m;
}

/* Volume outside the rotor [m^3], by throwing points. */
static double free_volume(const struct model *m)
{
    uint64_t seed = 99;
    struct mill_world *w = model_world(m);
    const vec3 hi = {0.5 * w->drum_length, w->drum_radius, w->drum_radius};
    const long points = 30000;
    long inside = 0;
    for (long n = 0; n < points; n++)
        inside += world_gap(w, point_in(&seed, vec3_scale(hi, -1.0), hi), 0.0, 0.0) > 0.0;
    mill_world_free(w);
    return 8.0 * hi.x * hi.y * hi.z * (double)inside / (double)points;
}

static struct model charged(const struct charge *c)
{
    struct model m = model_of(c);
    const double volume = c->fraction * free_volume(&m);
    for (int k = 0; k < 3 && c->kind[k].diameter > 0.0; k++)
        m.balls[k].count =
            (int32_t)lrint(volume * c->kind[k].share / (PI / 6.0 * pow(m.balls[k].diameter, 3.0)));
    return m;
}

static struct mill_world *fill(const struct charge *c)
{
    const struct model m = charged(c);
    return model_world(&m);
}

/* ---- no overlap ---- */

struct placed {
    vec3 r;
    double radius;
};

static int by_x(const void *a, const void *b)
{
    const struct placed *p = a, *q = b;
    return (p->r.x > q->r.x) - (p->r.x < q->r.x);
}

/* Pairs and surfaces that overlap, every pair looked at that is near enough along x. */
static long overlaps(const struct mill_world *w)
{
    struct placed *p = malloc(sizeof *p * (size_t)w->balls);
    double widest = 0.0;
    long bad = 0;
    for (int32_t i = 0; i < w->balls; i++) {
        p[i].r = w->ball[i].r;
        p[i].radius = radius_of(w, i);
        widest = fmax(widest, p[i].radius);
        bad += !(world_gap(w, p[i].r, p[i].radius, 0.0) >= 0.0);
    }
    qsort(p, (size_t)w->balls, sizeof *p, by_x);
    for (int32_t i = 0; i < w->balls; i++) {
        const double reach = p[i].radius + widest;
        for (int32_t j = i + 1; j < w->balls && p[j].r.x - p[i].r.x <= reach; j++)
            bad += vec3_norm(vec3_sub(p[j].r, p[i].r)) < p[i].radius + p[j].radius;
    }
    free(p);
    return bad;
}

static void check_charge(const struct charge *c)
{
    struct mill_world *w = fill(c);
    ck_assert_int_eq(overlaps(w), 0);
    mill_world_free(w);
}

SLOW_TEST(equal_balls_do_not_overlap_up_to_half_of_the_free_volume, 1)
{
    static const double fraction[] = {0.01, 0.1, 0.19, 0.21, 0.3, 0.4, 0.5};
    for (int k = 0; k < 7; k++) {
        struct charge c = {50, 80, true, {{5, 1}}, fraction[k], 0, 1};
        check_charge(&c);
        c.rotor = false;
        check_charge(&c);
    }
}

SLOW_TEST(mixtures_do_not_overlap_up_to_half_of_the_free_volume, 1)
{
    static const struct charge mixture[] = {
        {50, 80, true, {{10, 0.5}, {5, 0.5}}, 0.2, 0, 1},
        {50, 80, true, {{10, 0.5}, {5, 0.5}}, 0.5, 0, 1},
        {35, 40, true, {{10, 0.5}, {2, 0.5}}, 0.2, 0, 1},
        {35, 40, true, {{10, 0.5}, {2, 0.5}}, 0.5, 0, 1},
        {50, 80, true, {{2, 0.1}, {10, 0.9}}, 0.5, 0, 1}, /* small ones first in the deck */
        {50, 80, true, {{6, 0.3}, {5, 0.3}, {4.5, 0.4}}, 0.5, 0, 1}, /* sizes close together */
        {60, 60, false, {{20, 0.4}, {6, 0.4}, {2, 0.2}}, 0.45, 0, 1},
        {60, 60, false, {{30, 0.999}, {1, 0.001}}, 0.3, 0, 1},
    };
    for (size_t k = 0; k < sizeof mixture / sizeof *mixture; k++)
        check_charge(&mixture[k]);
}

TEST(balls_in_narrow_drums_do_not_overlap)
{
    static const struct charge narrow[] = {
        {15, 20, false, {{5, 1}}, 0.40, 0, 1},   {15, 200, false, {{5, 1}}, 0.42, 0, 1},
        {15, 100, true, {{5, 1}}, 0.10, 0, 1},   {10.2, 60, false, {{5, 1}}, 0.30, 0, 1},
        {75, 5.5, false, {{5, 1}}, 0.30, 0, 1},  {5.2, 100, false, {{5, 1}}, 0.2, 0, 1},
        {15, 20, false, {{5, 1}}, 0.0047, 0, 1},
    };
    for (size_t k = 0; k < sizeof narrow / sizeof *narrow; k++) {
        for (unsigned long seed = 1; seed <= 5; seed++) {
            struct charge c = narrow[k];
            c.seed = seed;
            check_charge(&c);
        }
    }
}

static int32_t lattice(double radius, double length)
{
    const struct model m = {.setup.drum = {.radius = radius, .length = length},
                            .balls = {{.diameter = 1e-9, .density = STEEL, .count = 1}}};
    struct mill_world *w = model_world(&m);
    struct mill_fill_room room;
    ck_assert(mill_fill_room_init(&room, w, 5e-10));
    const double points = (double)mill_cells_count(&room.lattice);
    ck_assert_double_eq_tol(room.volume / (PI * radius * radius * length), 1.0, 0.1);
    mill_fill_room_free(&room);
    mill_world_free(w);
    return (int32_t)fmin(points, INT32_MAX);
}

TEST(the_lattice_takes_as_little_memory_in_a_flat_or_thin_drum_as_in_any)
{
    ck_assert_int_gt(lattice(0.075, 0.12), 200000);
    ck_assert_int_lt(lattice(0.075, 0.12), 300000);
    ck_assert_int_lt(lattice(1e4, 1e-3), 2000000);
    ck_assert_int_lt(lattice(1e-3, 1e4), 2000000);
}

/* In a mill with this profile, however the lattice sorts the surfaces: a ball is clear of those
 * that it is told of just when it is clear of all. */
static void check_room(int buckles, double buckle_height)
{
    const double reach = 4e-3;
    const struct model m = {
        .setup.drum = buckles > 0 ? wavy_drum(buckles, 0.075, 0.05, buckle_height, 0.0)
                                  : (struct mill_setup_drum){.radius = 0.075, .length = 0.05},
        .balls = {{.diameter = 2.0 * reach, .density = STEEL, .count = 1}},
        .rotor = {.speed = 50.0, .angle = 25 * DEG},
        .shaft = 0.015,
        .blades = 3,
        .blade = {{.tip_radius = 0.055, .width = 0.009, .thickness = 0.006, .pitch = 30 * DEG}}};
    struct mill_world *w = model_world(&m);
    struct mill_fill_room room;
    uint64_t seed = 7;
    ck_assert(mill_fill_room_init(&room, w, reach));
    const vec3 hi = {0.5 * w->drum_length, w->drum_radius, w->drum_radius};
    const int points = 100000;
    int clear = 0, outside = 0;
    for (int i = 0; i < points; i++) {
        const vec3 r = point_in(&seed, vec3_scale(hi, -1.0), hi);
        const double radius = uniform(&seed, 0.0, reach), gap = world_gap(w, r, radius, 0.0);
        ck_assert_int_eq(mill_fill_room_clear(&room, r, radius), gap > 0.0);
        clear += gap > 0.0;
        outside += gap <= -radius; /* the centre is in the steel */
    }
    ck_assert_int_gt(clear, points / 4);
    const double box = 8.0 * hi.x * hi.y * hi.z;
    ck_assert_double_eq_tol(room.volume / box, (points - outside) / (double)points, 0.01);
    mill_fill_room_free(&room);
    mill_world_free(w);
}

TEST(the_lattice_forgets_no_surface)
{
    check_room(0, 0.0);
    check_room(2, 0.008);
    check_room(7, 0.016);
}

SLOW_TEST(many_seeds_fill_without_overlap, 1)
{
    for (unsigned long seed = 1; seed <= (unsigned long)unit_draws(40); seed++) {
        const struct charge c = {30, 40, true, {{6, 0.5}, {3, 0.5}}, 0.45, 0, seed};
        check_charge(&c);
    }
}

/* ---- the seed ---- */

TEST(the_same_seed_gives_the_same_bits_and_another_one_other_places)
{
    static const double fraction[] = {0.1, 0.45};
    for (int k = 0; k < 2; k++) {
        struct charge c = reference;
        c.fraction = fraction[k];
        c.speed = 1.0;
        struct mill_world *a = fill(&c), *b = fill(&c);
        c.seed = 2;
        struct mill_world *other = fill(&c);
        int32_t same = 0;
        /* a single coordinate may agree: balls pushed off a wall stand at one distance from it */
        ck_assert_int_eq(memcmp(a->ball, b->ball, sizeof *a->ball * (size_t)a->balls), 0);
        for (int32_t i = 0; i < a->balls; i++)
            same += vec3_norm(vec3_sub(a->ball[i].r, other->ball[i].r)) == 0.0 ||
                    vec3_norm(vec3_sub(a->ball[i].v, other->ball[i].v)) == 0.0;
        ck_assert_int_eq(same, 0);
        mill_world_free(a);
        mill_world_free(b);
        mill_world_free(other);
    }
}

/* ---- speeds ---- */

/* Chi-square of counts in eight equal classes; 24.3 is exceeded once in a thousand. */
static double octants(const long *count)
{
    double total = 0.0, chi = 0.0;
    for (int k = 0; k < 8; k++)
        total += (double)count[k];
    for (int k = 0; k < 8; k++)
        chi += pow((double)count[k] - total / 8.0, 2.0) / (total / 8.0);
    return chi;
}

static int octant(vec3 a)
{
    return (a.x > 0.0) + 2 * (a.y > 0.0) + 4 * (a.z > 0.0);
}

TEST(every_ball_has_the_speed_asked_for_in_a_random_direction)
{
    struct charge c = reference;
    long count[8] = {0};
    vec3 sum = nought;
    c.speed = 2.5;
    struct mill_world *w = fill(&c);
    for (int32_t i = 0; i < w->balls; i++) {
        ck_assert_double_eq_tol(vec3_norm(w->ball[i].v), 2.5, 1e-14);
        ck_assert_double_eq(vec3_norm(w->spin[i]), 0.0);
        sum = vec3_axpy(sum, 1.0 / 2.5, w->ball[i].v);
        count[octant(w->ball[i].v)]++;
    }
    ck_assert_double_lt(octants(count), 24.3);
    /* 3 |sum|^2 / N is chi-square with three degrees of freedom */
    ck_assert_double_lt(3.0 * vec3_dot(sum, sum) / w->balls, 16.3);
    mill_world_free(w);
}

TEST(without_a_speed_the_balls_rest)
{
    struct mill_world *w = fill(&reference);
    for (int32_t i = 0; i < w->balls; i++)
        ck_assert_double_eq(vec3_norm(w->ball[i].v), 0.0);
    mill_world_free(w);
}

/* ---- where they are ---- */

TEST(balls_are_spread_evenly)
{
    for (unsigned long seed = 1; seed <= 8; seed++) {
        struct charge c = reference;
        long count[8] = {0};
        c.rotor = false;
        c.fraction = seed % 2 ? 0.12 : 0.3; /* dropped; dropped and pushed */
        c.seed = seed;
        struct mill_world *w = fill(&c);
        long inner = 0;
        const double reach = w->drum_radius - radius_of(w, 0);
        for (int32_t i = 0; i < w->balls; i++) {
            const vec3 r = w->ball[i].r;
            count[octant(r)]++;
            inner += r.y * r.y + r.z * r.z < 0.5 * reach * reach;
        }
        ck_assert_double_lt(octants(count), 24.3);
        /* half of the room for centres; balls at the wall stand a little denser */
        ck_assert_double_eq_tol((double)inner / w->balls, 0.5, 0.04);
        mill_world_free(w);
    }
}

TEST(neighbours_in_memory_are_neighbours_in_space)
{
    struct mill_world *w = fill(&reference);
    double beside = 0.0, anywhere = 0.0;
    for (int32_t i = 1; i < w->balls; i++) {
        const int32_t j = (int32_t)((i * (int64_t)7919) % w->balls);
        beside += vec3_norm(vec3_sub(w->ball[i].r, w->ball[i - 1].r));
        anywhere += vec3_norm(vec3_sub(w->ball[i].r, w->ball[j].r));
    }
    ck_assert_double_lt(beside, 0.25 * anywhere);
    mill_world_free(w);
}

/* ---- too many ---- */

/* The model is refused; the numbers that are told to fit, of which none is larger than asked for,
 * do so. */
static struct mill_fault refused(const struct model *m)
{
    struct model less = *m;
    struct mill_world *w;
    struct mill_fault fault;
    ck_assert_int_eq(model_start(m, NULL, &w, &fault), MILL_FAULT_NO_ROOM);
    ck_assert_ptr_null(w);
    ck_assert_int_eq(fault.code, MILL_FAULT_NO_ROOM);
    for (int k = 0; k < MODEL_SPECIES; k++) {
        ck_assert(m->balls[k].diameter == 0.0 || fault.fits[k] < m->balls[k].count);
        less.balls[k].count = fault.fits[k];
    }
    if (fault.fits[0] > 0)
        mill_world_free(model_world(&less));
    return fault;
}

SLOW_TEST(too_many_balls_are_refused_with_a_number_that_fits, 1)
{
    static const double fraction[] = {0.585, 0.62, 0.70};
    for (int k = 0; k < 3; k++) {
        const struct charge c = {30, 48, true, {{5, 1}}, fraction[k], 0, 3};
        const struct model m = charged(&c);
        const struct mill_fault fault = refused(&m);
        ck_assert_double_eq_tol(fault.amount, fraction[k], 0.01);
        ck_assert_int_gt(fault.fits[0], m.balls[0].count * 7 / 10);
        ck_assert_int_eq(fault.fits[1], 0);
    }
}

SLOW_TEST(too_many_of_a_mixture_are_refused_with_counts_that_fit, 1)
{
    const struct charge c = {35, 56, true, {{8, 0.5}, {4, 0.3}, {2, 0.2}}, 0.70, 0, 3};
    const struct model m = charged(&c);
    const struct mill_fault fault = refused(&m);
    for (int k = 0; k < 3; k++)
        ck_assert_int_gt(fault.fits[k], m.balls[k].count / 2);
}

TEST(a_mill_without_room_for_one_ball_says_so)
{
    /* six blades from end to end, the sectors between them too narrow for a ball */
    struct model m = {.setup.drum = {.radius = 0.03, .length = 0.06},
                      .balls = {{.diameter = 0.02, .density = STEEL, .count = 1}},
                      .shaft = 0.005,
                      .blades = 6};
    for (int k = 0; k < 6; k++)
        m.blade[k] = (struct mill_blade){
            .angle = k * 60 * DEG, .tip_radius = 0.029, .width = 0.06, .thickness = 0.012};
    ck_assert_int_eq(refused(&m).fits[0], 0);
}

TEST(one_ball_that_just_fits_is_placed)
{
    /* of the drum's volume 0.37 and nearly 2/3, the most there is: with 0.1 mm to spare, and 1 um
     */
    static const struct charge tight[] = {
        {40, 60, false, {{59.9, 1}}, 0, 0, 0},
        {20, 40, false, {{39.9, 1}}, 0, 0, 0},
        {20, 40, false, {{39.999, 1}}, 0, 0, 0},
    };
    for (size_t k = 0; k < sizeof tight / sizeof *tight; k++) {
        for (unsigned long seed = 1; seed <= 20; seed++) {
            struct model m = model_of(&tight[k]);
            m.setup.seed = seed;
            mill_world_free(model_world(&m));
        }
    }
}

/* ---- how far it is ---- */

struct told {
    int times, stages, backwards;
    const char *what;
    int32_t done;
};

static void take_note(void *self, const char *what, int32_t done, int32_t all)
{
    struct told *told = self;
    if (strcmp(what, "checking bodies") == 0) /* comes first */
        return;
    ck_assert(done >= 0 && done <= all && all > 30000);
    if (!told->what || strcmp(told->what, what) != 0)
        told->stages++;
    else
        told->backwards += done < told->done && told->stages == 1; /* pushing may stir others */
    told->times++;
    told->what = what;
    told->done = done;
}

SLOW_TEST(a_long_start_tells_how_far_it_is_and_is_the_same_unwatched, 1)
{
    const struct charge c = {104, 166, true, {{5, 1}}, 0.42, 0, 1};
    const struct model m = charged(&c);
    struct told told = {0};
    const struct mill_start_watch watch = {take_note, &told};
    struct mill_world *watched, *plain = model_world(&m);
    ck_assert_int_eq(model_start(&m, &watch, &watched, NULL), MILL_FAULT_NONE);
    ck_assert_int_gt(told.times, 7);
    ck_assert_int_eq(told.stages, 2); /* dropped, then pushed apart */
    ck_assert_int_eq(told.backwards, 0);
    /* the end comes as soon as nothing overlaps: a few may still be nearer than the spacing */
    ck_assert_int_gt(told.done, plain->balls - plain->balls / 100);
    for (int32_t i = 0; i < plain->balls; i++)
        ck_assert(vec3_norm(vec3_sub(plain->ball[i].r, watched->ball[i].r)) == 0.0);
    mill_world_free(watched);
    mill_world_free(plain);
}

/* ---- cost ---- */

static double seconds_to_fill(const struct charge *c, int at_least)
{
    struct timespec begin, end;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &begin);
    struct mill_world *w = fill(c);
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &end);
    ck_assert_int_gt(w->balls, at_least);
    mill_world_free(w);
    return (double)(end.tv_sec - begin.tv_sec) + 1e-9 * (double)(end.tv_nsec - begin.tv_nsec);
}

/* If every ball were compared with every other, ten times as many would take a hundred times as
 * long. */
SLOW_TEST(the_time_of_a_start_grows_like_the_number_of_balls, 1)
{
    static const struct charge many[] = {
        {130, 208, true, {{5, 1}}, 0.21, 0, 1},
        {104, 166, true, {{5, 1}}, 0.42, 0, 1},
        {52, 83, true, {{10, 0.5}, {2, 0.5}}, 0.45, 0, 1},
    };
    for (size_t k = 0; k < sizeof many / sizeof *many; k++) {
        struct charge tenth = many[k];
        tenth.radius /= cbrt(10.0);
        tenth.length /= cbrt(10.0);
        const double all = seconds_to_fill(&many[k], 30000), part = seconds_to_fill(&tenth, 3000);
        ck_assert_double_lt(all, 30.0 * part);
    }
}

/* ---- the free volume ---- */

/* The drum of 75 x 120 mm with a shaft, and `discs` discs of this thickness on it. The exact free
 * volume goes to *free. */
static struct mill_setup with_discs(int discs, double thickness, struct mill_body *disc,
                                    struct mill_setup_surface *surface, double *free)
{
    static struct mill_body shaft;
    static const struct mill_turn turn = {.axis = {1, 0, 0}, .speed = 50};
    static const struct mill_setup_motion rotor = {
        .type = &mill_turn_type, .form = &turn, .on = MILL_STILL};
    struct mill_setup s = {.drum = {.radius = 0.075, .length = 0.12},
                           .motions = 1,
                           .motion = &rotor,
                           .surfaces = 1 + discs,
                           .surface = surface};
    shaft = mill_setup_shaft(0.015, 0.12);
    surface[0] = shaft_surface(&shaft);
    *free = PI * (0.075 * 0.075 - 0.015 * 0.015) * 0.12;
    for (int k = 0; k < discs; k++) {
        disc[k] = (struct mill_body){.centre = {-0.06 + (k + 0.37) * 0.12 / discs, 0, 0},
                                     .x = {0, 1, 0},
                                     .y = {0, 0, 1},
                                     .z = {1, 0, 0},
                                     .radius = 0.06,
                                     .length = thickness};
        surface[1 + k] = (struct mill_setup_surface){
            .solid = &mill_round_cylinder_solid, .body = &disc[k], .kind = MILL_BALL_BLADE};
        *free -= PI * (0.06 * 0.06 - 0.015 * 0.015) * thickness;
    }
    return s;
}

TEST(the_free_volume_is_known_to_a_thousandth_without_any_ball)
{
    static const double thickness[] = {5e-3, 1.3e-3, 0.7e-2};
    for (int n = 0; n < 9; n++) {
        struct mill_body disc[8];
        struct mill_setup_surface surface[9];
        double exact, found;
        const struct mill_setup s = with_discs(n, thickness[n % 3], disc, surface, &exact);
        ck_assert_int_eq(mill_start_free_volume_of(&s, &found), MILL_FAULT_NONE);
        ck_assert_double_eq_tol(found / exact, 1.0, 1e-3);
    }
}

TEST(the_free_volume_of_a_world_is_that_of_its_setup_and_leaves_out_blades)
{
    const struct model m = charged(&reference);
    struct mill_world *w = model_world(&m);
    const double found = mill_start_free_volume(w);
    ck_assert_double_eq_tol(found, free_volume(&m), 0.01 * found); /* by throwing points */
    /* shaft, and five blades outside of it, in proportion to the drum */
    const double r = 0.075, l = 0.12, blade = 0.15 * l * 0.08 * r * (0.88 - 0.2) * r;
    const double exact = PI * r * r * (1 - 0.04) * l - 5 * blade;
    ck_assert_double_eq_tol(found / exact, 1.0, 1e-3);
    mill_world_free(w);
}

TEST(a_mill_that_cannot_be_has_no_free_volume)
{
    const struct mill_setup none = {.drum = {.radius = 0.0}}, wrong = {.drum = {.radius = -1.0}};
    double found = 7.0;
    ck_assert_int_eq(mill_start_free_volume_of(&none, &found), MILL_FAULT_CONTAINER);
    ck_assert_int_eq(mill_start_free_volume_of(&wrong, &found), MILL_FAULT_NUMBER);
    ck_assert(found == 7.0);
}

int main(void)
{
    return unit_run("fill");
}
