/* Checks of several keys together: do the times agree? Do the balls, shaft and shapes fit into the
 * drum, or the balls into the body that holds them? */
#include "deck/deck_private.h"

#include "base/elementary.h"
#include "base/profile.h"
#include "geometry/shapes.h"
#include "geometry/solid.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define MOST_SAMPLES 1e8
#define MOST_FRAMES 1e7
#define MANY_FRAMES 1e5    /* more frames are probably a mistake */
#define FRAME_OF_BALL 36.0 /* [B] nine numbers of four bytes */
/* relative to the drum's reach; more than the tolerance of wavy.c */
#define SNUG 1e-11
#define DENSEST 0.7404804896930611 /* pi / sqrt(18): no packing of equal balls is denser */

struct mill_setup_drum mill_deck_drum(const struct mill_deck *deck)
{
    return (struct mill_setup_drum){
        .radius = deck->given.drum_radius,
        .length = deck->given.drum_length,
        .buckles = (int)deck->given.buckles,
        .buckle_height = deck->given.buckle_height,
        .buckle_angle = deck->given.buckle_angle,
        .rides = deck->mill.drum_rides,
        .periodic = deck->given.periodic != 0,
    };
}

enum mill_status mill_deck_check_times(struct mill_deck *deck, struct mill_error *error)
{
    enum mill_status status = MILL_OK;
    if (deck->given.sample_from >= deck->given.time)
        status = mill_deck_fault(&deck->text, error, "run", "sample_from",
                                 "must be before the end of the run, %g s", deck->given.time);
    status = mill_deck_faults_keep(&deck->text, status, error);
    if (status == MILL_OK && deck->given.max_collisions != floor(deck->given.max_collisions))
        status = mill_deck_fault(&deck->text, error, "run", "max_collisions",
                                 "must be a whole number, got %.15g", deck->given.max_collisions);
    status = mill_deck_faults_keep(&deck->text, status, error);
    if (status == MILL_OK && deck->given.time / deck->given.series > MOST_SAMPLES)
        status = mill_deck_fault(&deck->text, error, "output", "series",
                                 "too short: more than 1e8 samples until %g s", deck->given.time);
    return status;
}

static struct mill_profile profile_of(const struct mill_deck *deck)
{
    const struct mill_setup_drum drum = mill_deck_drum(deck);
    const struct mill_body body = mill_setup_drum_body(&drum);
    return mill_prism_profile(&body);
}

/* Neighbouring buckles must not touch. Height and number limit each other. The message names the
 * height, because users more often need a certain number. */
enum mill_status mill_deck_check_profile(struct mill_deck *deck, struct mill_error *error)
{
    if (!deck->mill.drum || !deck->given.wavy)
        return MILL_OK;
    const struct mill_profile profile = profile_of(deck);
    if (mill_profile_is_sound(&profile))
        return MILL_OK;
    return mill_deck_fault(&deck->text, error, "drum", "buckle_height",
                           "%ld buckles on a radius of %g m must be lower than %.4g m, or "
                           "neighbouring ones run into each other; got %g m",
                           deck->given.buckles, deck->given.drum_radius,
                           mill_profile_highest((int)deck->given.buckles, deck->given.drum_radius),
                           deck->given.buckle_height);
}

/* [m] diameter of the widest ball that fits between the walls of a container and has its centre on
 * the container's axis; INFINITY: it has no walls. The gap to the nearest wall is concave along the
 * axis. */
static double width_of(const struct mill_setup_surface *container)
{
    const struct mill_hull hull = mill_solid_hull(container->solid, container->body);
    double from = -hull.half, to = hull.half, width = INFINITY;
    struct mill_wall wall[MILL_WALLS];
    if (!container->solid->walls)
        return width;
    const int walls = container->solid->walls(container->body, wall);
    for (int step = 0; step < 200; step++) {
        double least[2];
        for (int side = 0; side < 2; side++) {
            const vec3 at = {0.0, 0.0, from + (side ? 2.0 : 1.0) / 3.0 * (to - from)};
            least[side] = INFINITY;
            for (int k = 0; k < walls; k++)
                least[side] = fmin(least[side], mill_part_wall_gap(&wall[k], at));
        }
        if (least[0] < least[1])
            from += (to - from) / 3.0;
        else
            to -= (to - from) / 3.0;
        width = 2.0 * fmax(least[0], least[1]);
    }
    return width;
}

/* Does a ball of kind k fit into the container? One that fits exactly cannot move: it would hit
 * both sides again and again. */
static enum mill_status check_width(const struct mill_deck *deck, int k, struct mill_error *error)
{
    const double width = width_of(deck->mill.container);
    if (deck->mill.balls[k].diameter < width * (1.0 - SNUG))
        return MILL_OK;
    return mill_deck_fault(
        &deck->text, error, deck->mill.balls[k].section, "diameter",
        "a ball of %g m does not fit into the container [%s], whose "
        "smallest inner width or height is %g m",
        deck->mill.balls[k].diameter,
        deck->mill.bodies.section[deck->mill.container - deck->mill.bodies.surface], width);
}

static enum mill_status check_size(const struct mill_deck *deck, int k, struct mill_error *error)
{
    const double bore = deck->given.drum_radius - deck->given.buckle_height,
                 d = deck->mill.balls[k].diameter;
    const char *between = deck->given.wavy ? " where its buckles come nearest to the axis" : "";
    const char *title = deck->mill.balls[k].section;
    if (d >= 2.0 * bore)
        return mill_deck_fault(&deck->text, error, title, "diameter",
                               "a ball of %g m does not fit into a drum of radius %g m%s", d, bore,
                               between);
    /* the ball would touch a whole arc at once */
    if (deck->given.buckle_height > 0.0 &&
        fabs(d - 2.0 * profile_of(deck).arc) <= SNUG * (2.0 * deck->given.drum_radius - bore))
        return mill_deck_fault(&deck->text, error, title, "diameter",
                               "a ball of %g m is exactly as wide as a buckle of the drum and "
                               "would stick there: make it a little smaller or larger",
                               d);
    if (d >= deck->given.drum_length)
        return mill_deck_fault(&deck->text, error, title, "diameter",
                               "a ball of %g m does not fit into a drum %g m long", d,
                               deck->given.drum_length);
    if (deck->mill.rotor && d >= bore - deck->given.shaft_radius)
        return mill_deck_fault(
            &deck->text, error, title, "diameter",
            "a ball of %g m does not fit between the shaft and the drum, %g m apart%s", d,
            bore - deck->given.shaft_radius, between);
    return MILL_OK;
}

enum mill_status mill_deck_check_sizes(struct mill_deck *deck, struct mill_error *error)
{
    enum mill_status status = MILL_OK;
    for (int k = 0; k < deck->mill.kinds && status == MILL_OK; k++)
        status = mill_deck_faults_keep(
            &deck->text, (deck->mill.container ? check_width : check_size)(deck, k, error), error);
    return status;
}

/* [m^3] of the container without the shaft */
static double room_of(const struct mill_deck *deck)
{
    if (deck->mill.container)
        return mill_deck_bodies_volume(deck);
    const double shaft = deck->mill.rotor ? deck->given.shaft_radius : 0.0;
    const struct mill_profile drum = profile_of(deck);
    return (mill_profile_area(&drum) - MILL_PI * shaft * shaft) * deck->given.drum_length;
}

enum mill_status mill_deck_check_amount(struct mill_deck *deck, struct mill_error *error)
{
    const double room = room_of(deck);
    double volume = 0.0;
    long total = 0;
    for (int k = 0; k < deck->mill.kinds; k++) {
        const double d = deck->mill.balls[k].diameter;
        const char *title = deck->mill.balls[k].section;
        const char *amount = deck->mill.balls[k].given;
        total += deck->mill.balls[k].count;
        if (total > MILL_DECK_MOST_BALLS)
            return mill_deck_fault(&deck->text, error, title, amount, "more than %d balls in all",
                                   MILL_DECK_MOST_BALLS);
        volume += (double)deck->mill.balls[k].count * MILL_PI / 6.0 * d * d * d;
        if (volume > (deck->mill.kinds == 1 ? DENSEST : 1.0) * room)
            return mill_deck_fault(&deck->text, error, title, amount,
                                   "%ld balls do not fit: they fill %.3g litres of the %s's %.3g",
                                   total, 1e3 * volume, deck->mill.drum ? "drum" : "container",
                                   1e3 * room);
    }
    if (deck->given.start && deck->given.speed != 0.0)
        return mill_deck_fault(&deck->text, error, "balls", "speed",
                               "is for a random start only; the start file has its own speeds");
    if (deck->given.start && deck->given.at_rest)
        return mill_deck_fault(&deck->text, error, "balls", "start_motion",
                               "is for a random start only; the start file has its own speeds");
    return MILL_OK;
}

enum mill_status mill_deck_check_parts(struct mill_deck *deck, struct mill_error *error)
{
    static const char mend[] = "need a [drum] that does not move; here give the part as a "
                               "[body.NAME] with 'motion = rotor'";
    const struct mill_deck_block named = {.title = "blade", .named = true};
    const bool still = deck->mill.drum && deck->mill.drum_rides == 0;
    const double bore = deck->given.drum_radius - deck->given.buckle_height;
    if (deck->mill.rotor && deck->given.shaft_radius > 0.0 && !still)
        return mill_deck_fault(&deck->text, error, "rotor", "shaft_radius", "shafts %s", mend);
    if (deck->mill.rotor && deck->given.shaft_radius > 0.0 && deck->given.shaft_radius >= bore)
        return mill_deck_fault(&deck->text, error, "rotor", "shaft_radius",
                               "must be less than the drum's radius%s, %g m",
                               deck->given.wavy ? " less the height of its buckles" : "", bore);
    const struct mill_deck_section *s = mill_deck_section(&deck->text, "blades");
    for (s = s ? s : mill_deck_next(&deck->text, &named, NULL); s;
         s = mill_deck_next(&deck->text, &named, s)) {
        if (!still)
            return mill_deck_fault(&deck->text, error, s->title, NULL, "blades %s", mend);
        if (!deck->mill.rotor)
            return mill_deck_fault(&deck->text, error, s->title, NULL,
                                   "blades need a section [rotor] that carries them");
    }
    return MILL_OK;
}

/* [GB] of the ball states in this number of frames */
static double size_of(const struct mill_deck *deck, double frames)
{
    return 1e-9 * frames * (double)deck->mill.all * FRAME_OF_BALL;
}

static double frames_of(const struct mill_deck *deck)
{
    return deck->given.frames > 0.0 ? deck->given.time / deck->given.frames : 0.0;
}

enum mill_status mill_deck_check_frames(struct mill_deck *deck, struct mill_error *error)
{
    const double frames = frames_of(deck);
    if (frames > MOST_FRAMES)
        return mill_deck_fault(
            &deck->text, error, "output", "frames",
            "too short: more than 1e7 frames until %g s (%.3g GB of ball states)", deck->given.time,
            size_of(deck, frames));
    return MILL_OK;
}

static void warn_of_frames(const struct mill_deck *deck)
{
    const double frames = frames_of(deck);
    struct mill_error line;
    if (frames <= MANY_FRAMES)
        return;
    mill_deck_fault(&deck->text, &line, "output", "frames",
                    "%.3g frames until %g s take %.3g GB; consider a longer interval", frames,
                    deck->given.time, size_of(deck, frames));
    deck->warn(line.text);
}

/* A random start puts balls into all free room, also into buckles with a narrow opening. */
static void warn_of_mouths(const struct mill_deck *deck)
{
    struct mill_error line;
    if (!deck->mill.drum || !deck->given.wavy || deck->given.start)
        return;
    const struct mill_profile p = profile_of(deck);
    /* opening between the inner arcs on both sides of a buckle */
    const double mouth = 2.0 * (p.inner * mill_elementary_sin(MILL_PI / p.buckles) - p.arc);
    if (p.half_outer <= 0.5 * MILL_PI)
        return;
    for (int k = 0; k < deck->mill.kinds; k++) {
        const double d = deck->mill.balls[k].diameter;
        if (d <= mouth || d >= 2.0 * p.arc)
            continue;
        mill_deck_fault(
            &deck->text, &line, "drum", "buckle_height",
            "the openings of the buckles are only %.3g mm wide, less than a ball's diameter of "
            "%.3g mm: balls that start in a buckle stay there",
            1e3 * mouth, 1e3 * d);
        deck->warn(line.text);
        return;
    }
}

/* A motion that carries nothing: the user has probably forgotten `on` or `motion`. */
static void warn_of_idle(const struct mill_deck *deck)
{
    for (int k = deck->mill.rotor; k < deck->mill.motions; k++) {
        char section[MILL_NAME_LENGTH + 16];
        struct mill_error line;
        bool carries = deck->mill.drum_rides == 1 + k;
        for (int i = 0; i < deck->mill.motions; i++)
            carries = carries || deck->mill.motion[i].on == k;
        for (int i = 0; i < deck->mill.bodies.count; i++)
            carries = carries || deck->mill.bodies.surface[i].motion == k;
        if (carries)
            continue;
        snprintf(section, sizeof section, "motion.%s", deck->mill.motion[k].name);
        mill_deck_fault(&deck->text, &line, section, "kind",
                        "this motion carries nothing: name it as 'on' of another motion or as "
                        "'motion' of a body, or leave it out");
        deck->warn(line.text);
    }
}

/* A planetary jar turns about its own axis, on a disk that carries it. The container's axis and the
 * axis of this turn must be the same line. */
static void warn_of_axes(const struct mill_deck *deck)
{
    struct mill_error line;
    if (!deck->mill.container || deck->mill.container->motion < 0)
        return;
    const struct mill_body *is = deck->mill.container->body;
    const struct mill_setup_motion *motion = &deck->mill.motion[deck->mill.container->motion];
    if (motion->type != &mill_turn_type || motion->on < 0 || is->length <= 0.0)
        return;
    const struct mill_turn *turn = motion->form;
    const vec3 off = vec3_sub(is->centre, turn->centre);
    const double away = vec3_norm(vec3_axpy(off, -vec3_dot(off, turn->axis), turn->axis));
    if (vec3_norm(vec3_cross(turn->axis, is->z)) > 1e-6 || away <= 1e-6 * is->length)
        return;
    mill_deck_fault(&deck->text, &line,
                    deck->mill.bodies.section[deck->mill.container - deck->mill.bodies.surface],
                    "centre",
                    "the container's axis is %.3g mm away from the axis of [motion.%s]: give a "
                    "planetary jar and its motion the same 'centre'",
                    1e3 * away, motion->name);
    deck->warn(line.text);
}

/* Values of the deck come before those of a material. Says where a material has no effect. */
static void warn_of_materials(const struct mill_deck *deck)
{
    const struct mill_deck_law *all = &deck->given.general;
    const char *of_part = deck->given.drum_material    ? "drum"
                          : deck->given.rotor_material ? "rotor"
                                                       : NULL;
    const struct mill_deck_section *contact = mill_deck_section(&deck->text, "contact");
    const char *of_balls = NULL;
    bool given = all->rows || !isnan(all->restitution);
    struct mill_deck_found found;
    struct mill_error line;
    for (int k = 0; k < deck->mill.kinds; k++) {
        const struct mill_deck_balls *b = &deck->mill.balls[k];
        if (!b->material || mill_deck_materials_find(deck, b->section, "material", b->material,
                                                     &found, &line) != MILL_OK)
            continue;
        of_balls = b->section;
        if (!(found.is.density > 0.0) || fabs(b->density / found.is.density - 1.0) < 0.01)
            continue;
        mill_deck_fault(&deck->text, &line, b->section, "density",
                        "%.4g kg/m^3 is used, not the %.4g kg/m^3 of '%s'; leave it out to use "
                        "that",
                        b->density, found.is.density, b->material);
        deck->warn(line.text);
    }
    for (int kind = 0; kind < deck->mill.contacts.count; kind++)
        given = given && !deck->mill.contact[kind].assumed[0];
    if (!given || !(of_part || of_balls))
        return;
    mill_deck_fault(&deck->text, &line, of_balls ? of_balls : of_part, "material",
                    of_balls ? "[contact] gives all values of the contacts; leave them out to use "
                               "those of the material"
                    : mill_deck_entry(contact, "friction") &&
                            mill_deck_entry(contact, "tangential_restitution")
                        ? "is not used: [contact] gives all values"
                        : "is not used: the balls have no 'material'");
    deck->warn(line.text);
}

void mill_deck_check_warn(const struct mill_deck *deck)
{
    if (!deck->warn)
        return;
    warn_of_frames(deck);
    warn_of_mouths(deck);
    warn_of_idle(deck);
    warn_of_axes(deck);
    warn_of_materials(deck);
}
