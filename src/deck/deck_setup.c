/* Builds a world from a deck: converts the deck to plain numbers, reads the start file, and
 * describes faults in the deck's terms. */
#include "deck/deck_private.h"
#include "geometry/shapes.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Relative to a ball's diameter: gaps between bodies are known to 10 %. Those to a drum are known
 * better, and one that equals the diameter also pinches a ball. */
#define NARROW 0.9
#define EQUAL 2e-4
/* Relative to the drum's radius: bounds this close are exact enough; less than this is no fault */
#define SNUG 1e-11
#define TOUCHING 1e-5

/* The lists that a setup needs */
struct lists {
    struct mill_setup_surface *surface;
    struct mill_setup_balls *balls;
    struct mill_setup_ball *ball; /* balls of a start file */
    long *line;                   /* line of each ball, from 1 */
    const char *kind[MILL_KINDS_MOST];
};

/* ---- the start file: one ball a line ---- */

static enum mill_status read_start(const struct mill_deck *deck,
                                   const struct mill_start_watch *watch, struct lists *lists,
                                   struct mill_error *error)
{
    struct mill_deck_rows rows = {.text = &deck->text,
                                  .section = "balls",
                                  .key = "start",
                                  .path = deck->given.start,
                                  .form =
                                      "3, 6 or 9 numbers 'x y z [vx vy vz [wx wy wz]]' in SI units",
                                  .columns = 1u << 3 | 1u << 6 | 1u << 9,
                                  .most = (long)deck->mill.all,
                                  .many = "more rows than the %ld balls of the deck",
                                  .alone = true,
                                  .watch = watch};
    const enum mill_status status = mill_deck_files_read(&rows, error);
    assert(sizeof *rows.row == sizeof *lists->ball);
    lists->ball = (struct mill_setup_ball *)rows.row; /* nine numbers each */
    lists->line = rows.line;
    return status != MILL_OK || rows.count == rows.most
               ? status
               : mill_deck_fault(&deck->text, error, "balls", "start",
                                 "'%s' has %ld rows, but the deck has %ld balls", rows.path,
                                 rows.count, rows.most);
}

/* ---- the setup ---- */

/* All but the balls */
static enum mill_status make_mill(const struct mill_deck *deck, struct lists *lists,
                                  struct mill_setup *setup, struct mill_error *error)
{
    *setup = (struct mill_setup){.gravity = deck->given.gravity,
                                 .drum = mill_deck_drum(deck),
                                 .motions = deck->mill.motions,
                                 .motion = deck->mill.motion,
                                 .rotor = mill_deck_motions_place(deck, "rotor"),
                                 .kinds = deck->mill.contacts.count - MILL_KINDS,
                                 .kind = lists->kind,
                                 .rebound_floor = deck->given.rebound_floor,
                                 .horizon = deck->given.time};
    for (int k = 0; k < deck->mill.contacts.count; k++) {
        const struct mill_deck_law *law = &deck->mill.contact[k].law;
        const double e = law->rows ? law->rows->restitution[0] : law->restitution;
        setup->law[k] = (struct mill_law){e, law->friction, law->tangential};
        setup->fall[k] = mill_deck_laws_fall(law);
    }
    for (int k = 0; k < setup->kinds; k++)
        lists->kind[k] = deck->mill.contacts.name[MILL_KINDS + k] + strlen("ball_");
    const struct mill_deck_bodies *list[] = {&deck->mill.parts, &deck->mill.bodies};
    const size_t all = (size_t)deck->mill.parts.count + (size_t)deck->mill.bodies.count;
    setup->surface = lists->surface = calloc(all + 1, sizeof *lists->surface);
    if (!lists->surface)
        return mill_error_set(error, MILL_FAILED, "out of memory for the mill's surfaces");
    for (int which = 0; which < 2; which++)
        for (int k = 0; k < list[which]->count; k++)
            lists->surface[setup->surfaces++] = list[which]->surface[k];
    return MILL_OK;
}

static enum mill_status add_balls(const struct mill_deck *deck,
                                  const struct mill_start_watch *watch, struct lists *lists,
                                  struct mill_setup *setup, struct mill_error *error)
{
    setup->species = deck->mill.kinds;
    setup->speed = deck->given.speed;
    setup->at_rest = deck->given.at_rest != 0;
    setup->seed = (unsigned long)deck->given.seed;
    setup->balls = lists->balls = calloc((size_t)deck->mill.kinds, sizeof *lists->balls);
    if (!lists->balls)
        return mill_error_set(error, MILL_FAILED, "out of memory for the kinds of balls");
    for (int k = 0; k < deck->mill.kinds; k++) {
        const struct mill_deck_balls *b = &deck->mill.balls[k];
        lists->balls[k] = (struct mill_setup_balls){.name = b->name,
                                                    .diameter = b->diameter,
                                                    .density = b->density,
                                                    .count = (int32_t)b->count};
    }
    const enum mill_status status =
        deck->given.start ? read_start(deck, watch, lists, error) : MILL_OK;
    setup->start = lists->ball;
    return status;
}

static void free_lists(struct lists *lists)
{
    free(lists->surface);
    free(lists->balls);
    free(lists->ball);
    free(lists->line);
}

/* ---- faults ---- */

/* For a mixture the message gives counts such as "384 big, 3072 small". */
static enum mill_status tell_no_room(const struct mill_deck *deck, const struct mill_fault *fault,
                                     struct mill_error *error)
{
    const char *section = deck->mill.balls[0].section, *amount = deck->mill.balls[0].given;
    const bool mixture = deck->mill.kinds > 1;
    char counts[512];
    size_t used = 0;
    if (fault->fits[0] == 0)
        return mill_deck_fault(
            &deck->text, error, section, amount,
            "not a single ball%s fits: make the balls, or the bodies in the container, smaller",
            mixture ? " of each kind" : "");
    for (int k = 0; k < deck->mill.kinds && k < MILL_FAULT_SPECIES && used < sizeof counts; k++)
        used += (size_t)snprintf(counts + used, sizeof counts - used, "%s%ld%s%s", k ? ", " : "",
                                 (long)fault->fits[k], mixture ? " " : "",
                                 mixture ? deck->mill.balls[k].name : "");
    return mill_deck_fault(&deck->text, error, section, amount,
                           "%ld balls do not fit (solid fraction %.3f of the free volume); %s fit",
                           (long)deck->mill.all, fault->amount, counts);
}

/* The section of surface k of the setup. `copy`: which of the body's copies it is, as in "its copy
 * 3 " */
static const char *find_section(const struct mill_deck *deck, int k, char copy[32])
{
    copy[0] = '\0';
    if (k < 0)
        return "drum";
    if (k < deck->mill.parts.count)
        return deck->mill.parts.section[k];
    k -= deck->mill.parts.count;
    if (k >= deck->mill.bodies.count)
        return NULL;
    const struct mill_deck_body *given =
        mill_deck_section(&deck->text, deck->mill.bodies.section[k])->form;
    if (given->copies > 1)
        snprintf(copy, 32, "its copy %d ", deck->mill.bodies.surface[k].number);
    return deck->mill.bodies.section[k];
}

/* Writes "; with this 'unit' the mesh measures 84 x 84 x 64 m ...": a mesh in the wrong unit is a
 * thousand times too large. */
static void say_size(const struct mill_deck *deck, const char *section, char text[128])
{
    const struct mill_body *is = NULL;
    vec3 lo = {INFINITY, INFINITY, INFINITY}, hi = {-INFINITY, -INFINITY, -INFINITY};
    for (int k = 0; k < deck->mill.bodies.count; k++)
        if (section && strcmp(deck->mill.bodies.section[k], section) == 0)
            is = deck->mill.bodies.surface[k].body;
    for (size_t k = 0; is && k < 3 * is->facets; k++) {
        const vec3 at = is->facet[k / 3][k % 3];
        lo = vec3_make(fmin(lo.x, at.x), fmin(lo.y, at.y), fmin(lo.z, at.z));
        hi = vec3_make(fmax(hi.x, at.x), fmax(hi.y, at.y), fmax(hi.z, at.z));
    }
    text[0] = '\0';
    if (is && is->facets > 0)
        snprintf(text, 128,
                 "; with this 'unit' the mesh measures %.3g x %.3g x %.3g m: check 'unit'",
                 hi.x - lo.x, hi.y - lo.y, hi.z - lo.z);
}

/* Describes faults of bodies: they run into each other, or their numbers are wrong */
static enum mill_status tell_bodies(const struct mill_deck *deck, const struct mill_fault *fault,
                                    struct mill_error *error)
{
    char copy[32], other_copy[32], size[128], by[32] = "";
    const char *section = find_section(deck, fault->other, copy);
    say_size(deck, section, size);
    if (fault->amount > 0.0)
        snprintf(by, sizeof by, " by %.2g mm", 1e3 * fault->amount);
    if (fault->code == MILL_FAULT_OUTSIDE)
        return mill_deck_fault(&deck->text, error, section, NULL, "%s" MILL_DECK_LEAVES "%s", copy,
                               by, fault->when, size);
    const char *met = find_section(deck, fault->ball, other_copy);
    return mill_deck_fault(
        &deck->text, error, section, NULL,
        "%sruns into [%s] %sat t = %.6g s: make one of them smaller, or put both "
        "on one motion",
        copy, met, other_copy, fault->when);
}

/* Describes faults of a drum with periodic ends */
static enum mill_status tell_ends(const struct mill_deck *deck, const struct mill_fault *fault,
                                  struct mill_error *error)
{
    char copy[32] = "";
    const char *section = find_section(deck, fault->other, copy);
    switch ((int)fault->code) {
    case MILL_FAULT_SHORT:
        return mill_deck_fault(&deck->text, error, "drum", "length",
                               "with periodic ends, must be at least three diameters of a ball, "
                               "%.6g m; got %g m",
                               3.0 * fault->amount, deck->given.drum_length);
    case MILL_FAULT_TILT:
        return mill_deck_fault(
            &deck->text, error, "gravity", "acceleration",
            "must be 0 along x if the drum's ends are periodic, or the balls fall "
            "without end; got %g m/s^2",
            deck->given.gravity.x);
    case MILL_FAULT_MOVES:
        return mill_deck_fault(&deck->text, error, section, "motion",
                               "%smay only turn about the x axis if the drum's ends are periodic",
                               copy);
    default:
        return mill_deck_fault(&deck->text, error, section, NULL,
                               "%smust keep a ball's radius, %g m, away from the periodic ends of "
                               "the drum, or reach from end to end with one cross-section",
                               copy, fault->amount);
    }
}

static enum mill_status tell(const struct mill_deck *deck, const long *line,
                             const struct mill_fault *fault, struct mill_error *error)
{
    static const char *const met[MILL_KINDS] = {"another ball", "the drum", "an end wall",
                                                "the shaft", "a blade"};
    const bool own = fault->kind >= MILL_KINDS;
    switch (fault->code) {
    case MILL_FAULT_NONE:
        return MILL_OK;
    case MILL_FAULT_MEMORY:
        return mill_error_set(error, MILL_FAILED, "out of memory for the mill and its balls");
    case MILL_FAULT_NUMBER:
    case MILL_FAULT_CONTAINER:
        return mill_error_set(error, MILL_FAILED, "a number of the deck is out of range");
    case MILL_FAULT_OUTSIDE:
    case MILL_FAULT_CLASH:
        return tell_bodies(deck, fault, error);
    case MILL_FAULT_SPEED:
        return mill_error_set(error, MILL_BAD_DECK,
                              "%s:%ld: a speed above that of light: give m/s and rad/s",
                              deck->given.start, line[fault->ball]);
    case MILL_FAULT_BALL_IN_SHAPE:
        return mill_error_set(
            error, MILL_BAD_DECK, "%s:%ld: ball overlaps %s%s by %.4g m: move the ball",
            deck->given.start, line[fault->ball], own ? "the body " : "",
            own ? deck->mill.contacts.name[fault->kind] + strlen("ball_") : met[fault->kind],
            fault->amount);
    case MILL_FAULT_BALL_IN_BALL:
        return mill_error_set(
            error, MILL_BAD_DECK,
            "%s:%ld: ball overlaps the one of line %ld by %.4g m: move one of them",
            deck->given.start, line[fault->ball], line[fault->other], fault->amount);
    case MILL_FAULT_BALL_OUTSIDE:
        return mill_error_set(
            error, MILL_BAD_DECK,
            "%s:%ld: x is %.6g m from the middle, beyond the periodic ends of the "
            "drum at %g m: move the ball",
            deck->given.start, line[fault->ball], fault->amount, 0.5 * deck->given.drum_length);
    case MILL_FAULT_SHORT:
    case MILL_FAULT_TILT:
    case MILL_FAULT_MOVES:
    case MILL_FAULT_END:
        return tell_ends(deck, fault, error);
    case MILL_FAULT_NO_ROOM:
        break;
    }
    return tell_no_room(deck, fault, error);
}

/* Warns of a place where a moving body comes nearer to another than a ball's diameter. unchecked:
 * warns instead that the check for clashes ended before this pair was finished */
static void warn_of(const struct mill_deck *deck, const struct mill_passing *place, bool unchecked)
{
    char copy[32], other_copy[32] = "";
    double d = 0.0;
    for (int k = 0; k < deck->mill.kinds; k++)
        d = fmax(d, deck->mill.balls[k].diameter);
    const bool wall = place->kind[1] == MILL_BALL_WALL, drum = place->other < 0;
    if (unchecked ? isinf(place->when)
                  : !(place->gap < (wall   ? 1.0 + EQUAL
                                    : drum ? 1.0 - EQUAL
                                           : NARROW) *
                                       d))
        return;
    const char *section = find_section(deck, place->one, copy);
    const char *met = find_section(deck, place->other, other_copy);
    if (unchecked)
        mill_deck_faults_warn(deck, section, NULL,
                              "it was not checked whether %sruns into [%s] %safter t = %.4g s, "
                              "because this would take too long",
                              copy[0] ? copy : "it ", met, other_copy, place->when);
    else
        mill_deck_faults_warn(
            deck, section, NULL,
            "%scomes as near as %.2g mm to %s[%s] %sat t = %.4g s, no more than a "
            "ball's diameter of %.3g mm: balls can be pinched there",
            copy, 1e3 * place->gap, wall ? "an end wall of " : "", met, other_copy, place->when,
            1e3 * d);
}

/* Bounds of how far the blade reaches beyond the walls of the drum, < 0 [m]. Neither moves but
 * about the axis. The check of a whole mill also finds what is not told here. */
static double beyond(const struct mill_body *drum, bool wavy, const struct mill_body *blade)
{
    const struct mill_pose lab = {.x = {1.0, 0.0, 0.0}, .y = {0.0, 1.0, 0.0}, .z = {0.0, 0.0, 1.0}};
    const struct mill_pose own = {.place = drum->centre, .x = drum->x, .y = drum->y, .z = drum->z};
    const struct mill_pose in = mill_pose_relative(&lab, &own);
    struct mill_wall wall[MILL_WALLS];
    struct mill_part *box;
    int32_t count;
    double most = 0.0;
    const int walls = mill_prism_solid.walls(drum, wall);
    if (!mill_part_list(&mill_box_solid, blade, &box, &count))
        return NAN;
    const struct mill_part part = mill_part_move(box, &in);
    for (int k = 0; k < walls; k++)
        if (wall[k].flat || !wavy)
            most = fmin(most, mill_part_to_wall(&part, &wall[k], SNUG * drum->radius).most);
    free(box);
    return most;
}

enum mill_status mill_deck_setup_inside(struct mill_deck *deck)
{
    const struct mill_setup_drum drum = mill_deck_drum(deck);
    const struct mill_body body = mill_setup_drum_body(&drum);
    const struct mill_deck_bodies *parts = &deck->mill.parts;
    enum mill_status status = MILL_OK;
    char text[32];
    const char *told = "rotor"; /* equal blades are one section */
    if (!deck->mill.drum || deck->mill.drum_rides != 0)
        return MILL_OK;
    for (int k = 0; k < parts->count && status == MILL_OK; k++) {
        if (strcmp(parts->section[k], told) == 0)
            continue;
        const double by = -beyond(&body, deck->given.wavy, &parts->form[k]);
        if (isnan(by))
            return mill_deck_memory(&deck->text);
        if (!(by > TOUCHING * body.radius))
            continue;
        told = parts->section[k];
        snprintf(text, sizeof text, " by %.2g mm", 1e3 * by);
        mill_deck_wrong(&deck->text, told, NULL, MILL_DECK_LEAVES, text, 0.0);
        status = mill_deck_faults_keep(&deck->text, MILL_BAD_DECK);
    }
    return status;
}

enum mill_status mill_deck_setup_world(const struct mill_deck *deck,
                                       const struct mill_start_watch *watch,
                                       struct mill_world **world, struct mill_error *error)
{
    struct lists lists = {.surface = NULL};
    struct mill_setup setup;
    struct mill_fault fault;
    *world = NULL;
    enum mill_status status = make_mill(deck, &lists, &setup, error);
    if (status == MILL_OK)
        status = add_balls(deck, watch, &lists, &setup, error);
    if (status == MILL_OK) {
        mill_start_world(&setup, watch, world, &fault);
        status = tell(deck, lists.line, &fault, error);
        if (status == MILL_OK)
            for (int k = 0; k < MILL_FAULT_PASSINGS; k++)
                warn_of(deck, &fault.narrowest[k], false);
        if (status == MILL_OK)
            warn_of(deck, &fault.unchecked, true);
    }
    free_lists(&lists);
    return status;
}

enum mill_status mill_deck_setup_free_volume(const struct mill_deck *deck, double *volume,
                                             struct mill_error *error)
{
    struct lists lists = {.surface = NULL};
    struct mill_setup setup;
    enum mill_status status = make_mill(deck, &lists, &setup, error);
    if (status == MILL_OK) {
        const struct mill_fault fault = {.code = mill_start_free_volume_of(&setup, volume)};
        status = tell(deck, NULL, &fault, error);
    }
    free_lists(&lists);
    return status;
}
