/* Warns of what is allowed but is probably a mistake. */
#include "base/elementary.h"
#include "base/profile.h"
#include "deck/deck_private.h"

#include <stdio.h>

#define MANY_FRAMES 1e5 /* more frames are probably a mistake */
/* Limits of a motion: [m/s], [g], lengths of the container */
#define FAST 100.0
#define HARD 1000.0
#define WIDE 20.0

static void warn_of_frames(const struct mill_deck *deck)
{
    const double frames = mill_deck_checks_count(deck);
    if (frames > MANY_FRAMES)
        mill_deck_faults_warn(deck, "output", "frames",
                              "%.3g frames until %g s take %.3g GB; consider a longer interval",
                              frames, deck->observe.end, mill_deck_checks_size(deck));
}

/* A random start puts balls into all free room, also into buckles with a narrow opening. */
static void warn_of_mouths(const struct mill_deck *deck)
{
    if (!deck->mill.drum || !deck->given.wavy || deck->given.start)
        return;
    const struct mill_profile p = mill_deck_checks_profile(deck);
    /* opening between the inner arcs on both sides of a buckle */
    const double mouth = 2.0 * (p.inner * mill_elementary_sin(MILL_PI / p.buckles) - p.arc);
    if (p.half_outer <= 0.5 * MILL_PI)
        return;
    for (int k = 0; k < deck->setup.species; k++) {
        const double d = deck->mill.balls[k].diameter;
        if (d <= mouth || d >= 2.0 * p.arc)
            continue;
        mill_deck_faults_warn(
            deck, "drum", "buckle_height",
            "the openings of the buckles are only %.3g mm wide, less than a ball's diameter of "
            "%.3g mm: balls that start in a buckle stay there",
            1e3 * mouth, 1e3 * d);
        return;
    }
}

/* A motion that carries nothing: the user has probably forgotten `on` or `motion`. */
static void warn_of_idle(const struct mill_deck *deck)
{
    for (int k = deck->mill.rotor; k < deck->setup.motions; k++) {
        char section[MILL_NAME_LENGTH + 16];
        bool carries = deck->setup.drum.rides == 1 + k;
        for (int i = 0; i < deck->setup.motions; i++)
            carries = carries || deck->mill.motion[i].on == k;
        for (int i = deck->mill.parts; i < deck->setup.surfaces; i++)
            carries = carries || deck->setup.surface[i].motion == k;
        if (carries)
            continue;
        snprintf(section, sizeof section, "motion.%s", deck->mill.motion[k].name);
        mill_deck_faults_warn(
            deck, section, "kind",
            "this motion carries nothing: name it as 'on' of another motion or as "
            "'motion' of a body, or leave it out");
    }
}

/* A planetary jar turns about its own axis, on a disk that carries it. The container's axis and the
 * axis of this turn must be the same line. */
static void warn_of_axes(const struct mill_deck *deck)
{
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
    mill_deck_faults_warn(
        deck, mill_deck_holder(deck), "centre",
        "the container's axis is %.3g mm away from the axis of [motion.%s]: give a "
        "planetary jar and its motion the same 'centre'",
        1e3 * away, motion->name);
}

/* The table of a motion in other units than those of the deck: nothing in a mill is so fast */
static void warn_of_table(const struct mill_deck *deck, const struct mill_setup_motion *motion)
{
    const struct mill_table *table = motion->form;
    const double size = cbrt(mill_deck_checks_volume(deck)), g = 9.80665;
    char section[MILL_NAME_LENGTH + 16];
    vec3 before = {0.0, 0.0, 0.0}, first = {0.0, 0.0, 0.0};
    double speed = 0.0, push = 0.0, far = 0.0, since = 0.0;
    for (size_t k = 0; k + 1 < table->rows; k++) {
        const double *a = table->row[k], *b = table->row[k + 1], time = b[0] - a[0];
        const vec3 at = {a[1], a[2], a[3]}, next = {b[1], b[2], b[3]};
        const vec3 v = vec3_scale(vec3_sub(next, at), 1.0 / time);
        first = k == 0 ? at : first;
        far = fmax(far, vec3_norm(vec3_sub(next, first)));
        speed = fmax(speed, vec3_norm(v));
        if (k > 0)
            push = fmax(push, 2.0 * vec3_norm(vec3_sub(v, before)) / (time + since));
        before = v;
        since = time;
    }
    if (speed <= FAST && push <= HARD * g && far <= WIDE * size)
        return;
    snprintf(section, sizeof section, "motion.%s", motion->name);
    mill_deck_faults_warn(
        deck, section, "file",
        "the table moves by %.3g m, at up to %.3g m/s and %.3g g: its rows are in "
        "s, m and rad; divide lengths in mm and times in ms by 1000",
        far, speed, push / g);
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
    for (int k = 0; k < deck->setup.species; k++) {
        const struct mill_deck_balls *b = &deck->mill.balls[k];
        if (!b->material ||
            !mill_deck_materials_find(deck, b->section, "material", b->material, &found))
            continue;
        of_balls = b->section;
        if (!(found.is.density > 0.0) || fabs(b->density / found.is.density - 1.0) < 0.01)
            continue;
        mill_deck_faults_warn(
            deck, b->section, "density",
            "%.4g kg/m^3 is used, not the %.4g kg/m^3 of '%s'; leave it out to use "
            "that",
            b->density, found.is.density, b->material);
    }
    for (int kind = 0; kind < deck->mill.contacts.count; kind++)
        given = given && !deck->mill.contact[kind].assumed[0];
    if (!given || !(of_part || of_balls))
        return;
    mill_deck_faults_warn(
        deck, of_balls ? of_balls : of_part, "material",
        of_balls ? "[contact] gives all values of the contacts; leave them out to use "
                   "those of the material"
        : mill_deck_entry(contact, "friction") && mill_deck_entry(contact, "tangential_restitution")
            ? "is not used: [contact] gives all values"
            : "is not used: the balls have no 'material'");
}

void mill_deck_warn(const struct mill_deck *deck)
{
    warn_of_frames(deck);
    warn_of_mouths(deck);
    warn_of_idle(deck);
    warn_of_axes(deck);
    for (int k = 0; k < deck->setup.motions; k++)
        if (deck->mill.motion[k].type == &mill_table_type)
            warn_of_table(deck, &deck->mill.motion[k]);
    warn_of_materials(deck);
}
