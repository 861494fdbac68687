/* Bodies: converts the [body.NAME], with their axes, copies and kinds of contact, to the engine's
 * form, and finds the one that holds the balls. */
#include "deck/deck_private.h"
#include "geometry/shapes.h"

#include "base/elementary.h"

#include <stdlib.h>
#include <string.h>

enum {
    MOST_BODIES = 20000,  /* limit of the engine's numbers of surfaces, with the blades */
    MOST_FACETS = 5000000 /* of all copies of a mesh: 3 GB of memory */
};
#define PREFIX "ball_"
/* an axis nearer than this to x: its part across x is only rounding */
#define ALONG 1e-6

/* ---- places ---- */

/* Exactly 0 and 1 for quarter turns, so that the copies are exactly symmetric */
static struct mill_heading heading(double angle)
{
    enum { NOTHING = -50 };
    struct mill_heading at = mill_elementary_heading(angle);
    const double nothing = ldexp(1.0, NOTHING);
    if (fabs(at.cos) < nothing)
        at = (struct mill_heading){0.0, copysign(1.0, at.sin)};
    else if (fabs(at.sin) < nothing)
        at = (struct mill_heading){copysign(1.0, at.cos), 0.0};
    return at;
}

/* a turned about the unit vector n (Rodrigues) */
static vec3 turned(vec3 a, vec3 n, struct mill_heading at)
{
    const vec3 along = vec3_scale(n, vec3_dot(n, a));
    const vec3 across = vec3_sub(a, along);
    return vec3_axpy(vec3_axpy(along, at.cos, across), at.sin, vec3_cross(n, a));
}

/* Sets unit vectors at right angles: z as given, x as near to the given x as possible */
static void set_axes(struct mill_body *is, vec3 z, vec3 x)
{
    is->z = mill_deck_motions_unit(z);
    is->x = mill_deck_motions_unit(vec3_axpy(x, -vec3_dot(x, is->z), is->z));
    is->y = vec3_cross(is->z, is->x);
}

static void place(const struct mill_deck_body *given, struct mill_body *is)
{
    const vec3 z = mill_deck_motions_unit(given->axis);
    const bool along_x = hypot(z.y, z.z) < ALONG;
    *is = given->is;
    set_axes(is, z, vec3_make(!along_x, along_x, 0.0));
    set_axes(is, is->z, turned(is->x, is->z, heading(given->angle)));
}

static void move_on(const struct mill_deck_body *given, struct mill_body *is)
{
    const struct mill_heading at = heading(given->turn_by);
    const vec3 n = mill_deck_motions_unit(given->turn_about);
    is->centre = vec3_add(turned(is->centre, n, at), given->shift_by);
    set_axes(is, turned(is->z, n, at), turned(is->x, n, at));
}

/* ---- kinds of contact ---- */

static enum mill_status find_kind(struct mill_deck *deck, const struct mill_deck_section *section,
                                  int *kind)
{
    const char *given = ((struct mill_deck_body *)section->form)->kind;
    const char *name = given ? given : strchr(section->title, '.') + 1;
    struct mill_kinds *kinds = &deck->mill.contacts;
    if (given && strncmp(given, PREFIX, strlen(PREFIX)) != 0)
        return mill_deck_wrong(&deck->text, section->title, "kind",
                               "a kind of contact begins with 'ball_': write '" PREFIX "%.60s'",
                               given);
    name += given ? strlen(PREFIX) : 0;
    if (!mill_deck_is_name(name) || strlen(name) >= MILL_NAME_LENGTH)
        return mill_deck_wrong(
            &deck->text, section->title, "kind",
            "'%.80s' is not allowed: a name consists of letters, digits, '_', '-', '+' and '.'",
            given);
    for (*kind = 0; *kind < kinds->count; ++*kind)
        if (strcmp(kinds->name[*kind] + strlen(PREFIX), name) == 0)
            break;
    if (*kind == MILL_BALL_BALL)
        return mill_deck_wrong(
            &deck->text, section->title, given ? "kind" : NULL,
            "'ball_ball' is the kind of contact of two balls: give the body another %s",
            given ? "kind" : "name");
    if (*kind == MILL_KINDS_MOST)
        return mill_deck_wrong(&deck->text, section->title, NULL,
                               "there are more than %d kinds of contact: give bodies that belong "
                               "together a common 'kind'",
                               MILL_KINDS_MOST);
    if (*kind == kinds->count)
        mill_kinds_add(kinds, name);
    return MILL_OK;
}

/* ---- the list ---- */

/* Checks what the ranges of single keys do not cover */
static enum mill_status check_form(const struct mill_deck *deck,
                                   const struct mill_deck_section *section,
                                   const struct mill_solid *solid, const struct mill_body *is)
{
    struct mill_body sharp = *is;
    sharp.rounding = 0.0;
    if (mill_solid_is_sound(solid, is))
        return MILL_OK;
    if (is->inside && solid->support && !solid->walls)
        return mill_deck_wrong(&deck->text, section->title, "side",
                               "a body of this shape cannot hold the balls: set 'side = outside'");
    if (mill_solid_is_sound(solid, &sharp))
        return mill_deck_wrong(&deck->text, section->title, "rounding",
                               "%g m is too large for the sizes of the body, or smaller than "
                               "%g m: change it",
                               is->rounding, MILL_SOLID_LEAST);
    return mill_deck_wrong(&deck->text, section->title, NULL, "%s",
                           solid->sizes ? solid->sizes
                                        : "a size of the body is out of range: look at its radius, "
                                          "length and size");
}

static enum mill_status check_container(const struct mill_deck *deck,
                                        const struct mill_deck_section *section)
{
    if (deck->mill.drum)
        return mill_deck_wrong(&deck->text, section->title, "side",
                               "[drum] holds the balls, and a mill has one container: leave [drum] "
                               "out, or set 'side = outside'");
    if (deck->mill.container)
        return mill_deck_wrong(
            &deck->text, section->title, "side",
            "[%s] holds the balls, and a mill has one container: set "
            "'side = outside' here or there",
            deck->mill.bodies.section[deck->mill.container - deck->mill.bodies.surface]);
    return MILL_OK;
}

static bool make_list(struct mill_deck_bodies *list, size_t most)
{
    list->surface = calloc(most + 1, sizeof *list->surface);
    list->form = calloc(most + 1, sizeof *list->form);
    list->section = calloc(most + 1, sizeof *list->section);
    return list->surface && list->form && list->section;
}

void mill_deck_bodies_free(struct mill_deck_bodies *list)
{
    free(list->surface);
    free(list->form);
    free(list->section);
}

static const struct mill_setup_surface *add(struct mill_deck_bodies *list, const char *section,
                                            struct mill_setup_surface surface,
                                            const struct mill_body *is)
{
    const int k = list->count++;
    list->form[k] = *is;
    list->section[k] = section;
    list->surface[k] = surface;
    list->surface[k].body = &list->form[k];
    return &list->surface[k];
}

/* The body and its copies */
static enum mill_status add_body(struct mill_deck *deck, const struct mill_deck_section *section)
{
    const struct mill_deck_body *given = section->form;
    struct mill_setup_surface surface = {.solid = mill_shapes_solid(given->shape)};
    struct mill_body is;
    enum mill_status status =
        mill_deck_motions_find(deck, section->title, "motion", given->motion, &surface.motion);
    if (status == MILL_OK)
        status = find_kind(deck, section, &surface.kind);
    if (status == MILL_OK && given->is.inside)
        status = check_container(deck, section);
    if (status != MILL_OK)
        return status;
    place(given, &is);
    if (!surface.solid->key)
        status = mill_deck_meshes_read(deck, section, &is);
    if (status == MILL_OK)
        status = check_form(deck, section, surface.solid, &is);
    if (status == MILL_OK && is.facets > 0 && given->copies > MOST_FACETS / (long)is.facets)
        return mill_deck_wrong(&deck->text, section->title, "copies",
                               "%ld copies of %zu facets are more than %d: simplify the mesh, or "
                               "put all copies into one",
                               given->copies, is.facets, MOST_FACETS);
    for (long k = 0; k < (given->is.inside ? 1 : given->copies) && status == MILL_OK; k++) {
        if (k > 0)
            move_on(given, &is);
        surface.number = (int)k;
        const struct mill_setup_surface *body =
            add(&deck->mill.bodies, section->title, surface, &is);
        if (given->is.inside)
            deck->mill.container = body;
    }
    return status;
}

enum mill_status mill_deck_bodies_list(struct mill_deck *deck)
{
    const struct mill_deck_section *s = NULL;
    long all = 0;
    while ((s = mill_deck_named(&deck->text, "body", s))) {
        const long copies = ((struct mill_deck_body *)s->form)->copies;
        all += copies > 1 ? copies : 1;
        if (all > MOST_BODIES)
            return mill_deck_wrong(&deck->text, s->title, copies > 1 ? "copies" : NULL,
                                   "more than %d bodies in all", MOST_BODIES);
    }
    mill_kinds_init(&deck->mill.contacts);
    if (!make_list(&deck->mill.bodies, (size_t)all))
        return mill_deck_memory(&deck->text);
    enum mill_status status = MILL_OK;
    bool good = true;
    while (status == MILL_OK && (s = mill_deck_named(&deck->text, "body", s))) {
        status = add_body(deck, s);
        good = good && status == MILL_OK;
        status = mill_deck_faults_keep(&deck->text, status);
    }
    if (good && !deck->mill.drum && !deck->mill.container)
        return mill_deck_wrong(&deck->text, NULL, NULL,
                               "nothing holds the balls: add [drum], or a [body.NAME] with "
                               "'side = inside'");
    deck->mill.carried =
        deck->mill.container ? deck->mill.container->motion >= 0 : deck->mill.drum_rides > 0;
    return status;
}

/* Equal blades: number k = 0.. has its centre at x = -L/2 + (k + 1/2) L/count and points at the
 * angle k angle_step. */
enum mill_status mill_deck_bodies_parts(struct mill_deck *deck)
{
    const struct mill_setup_surface shaft = {
        .solid = &mill_prism_solid, .number = -1, .kind = MILL_BALL_SHAFT};
    struct mill_setup_surface surface = {.solid = &mill_box_solid, .kind = MILL_BALL_BLADE};
    struct mill_deck_blades *all = &deck->given.blades;
    const double length = deck->given.drum_length, count = (double)all->count;
    if (!make_list(&deck->mill.parts, (size_t)all->count + (size_t)deck->text.sections + 1))
        return mill_deck_memory(&deck->text);
    if (deck->mill.rotor && deck->given.shaft_radius > 0.0) {
        const struct mill_body is = mill_setup_shaft(deck->given.shaft_radius, length);
        add(&deck->mill.parts, "rotor", shaft, &is);
    }
    if (all->count > 0 && !mill_deck_entry(mill_deck_section(&deck->text, "blades"), "angle_step"))
        all->angle_step = 2.0 * MILL_PI / count;
    for (; surface.number < all->count; surface.number++) {
        struct mill_blade blade = all->form;
        blade.position = (surface.number + 0.5 - 0.5 * count) * (length / count);
        blade.angle = surface.number * all->angle_step;
        const struct mill_body is = mill_setup_blade(&blade);
        add(&deck->mill.parts, "blades", surface, &is);
    }
    for (const struct mill_deck_section *s = NULL;
         (s = mill_deck_named(&deck->text, "blade", s));) {
        const struct mill_body is = mill_setup_blade(s->form);
        add(&deck->mill.parts, s->title, surface, &is);
        surface.number++;
    }
    return MILL_OK;
}

/* The farthest point of a convex part is also the farthest one in its own direction. The search
 * goes from a farthest point to a farther one, from several first directions. */
static double reach_of(const struct mill_part *p)
{
    enum { WAYS = 32, STEPS = 100 };
    double far = 0.0;
    for (int n = 0; n < WAYS; n++) {
        const struct mill_heading to = mill_elementary_heading(n * (2.0 * MILL_PI / WAYS));
        vec3 way = {0.0, to.cos, to.sin};
        double last = 0.0;
        for (int k = 0; k < STEPS; k++) {
            const vec3 at = mill_part_support(p, way);
            const double d = sqrt(at.y * at.y + at.z * at.z);
            if (!(d > last))
                break;
            way = vec3_make(0.0, at.y / d, at.z / d);
            last = d;
        }
        far = fmax(far, last);
    }
    return far + p->core.grown;
}

double mill_deck_bodies_reach(const struct mill_solid *solid, const struct mill_body *is)
{
    struct mill_part *part;
    int32_t count;
    double far = -1.0;
    if (mill_part_list(solid, is, &part, &count))
        for (int32_t k = 0; k < count; k++)
            far = fmax(far, reach_of(&part[k]));
    free(part);
    return far;
}

/* The speed of the rotor, where the speed of its tips is given */
enum mill_status mill_deck_bodies_turn(struct mill_deck *deck)
{
    const struct mill_deck_bodies *bodies = &deck->mill.bodies;
    double tip = deck->given.blades.count > 0 ? deck->given.blades.form.tip_radius : 0.0;
    if (deck->given.tip_speed == 0.0)
        return MILL_OK;
    for (const struct mill_deck_section *s = NULL; (s = mill_deck_named(&deck->text, "blade", s));)
        tip = fmax(tip, ((const struct mill_blade *)s->form)->tip_radius);
    for (int k = 0; k < bodies->count; k++) {
        const struct mill_setup_surface *body = &bodies->surface[k];
        const double far =
            body->motion == 0 ? mill_deck_bodies_reach(body->solid, body->body) : 0.0;
        if (far < 0.0)
            return mill_deck_memory(&deck->text);
        tip = fmax(tip, far);
    }
    if (tip == 0.0)
        return mill_deck_wrong(&deck->text, "rotor", "tip_speed",
                               "needs blades, or bodies with 'motion = rotor': their largest "
                               "distance from the axis is the radius of the tip; without them give "
                               "'speed'");
    deck->given.rotor.speed = deck->given.tip_speed / tip;
    return MILL_OK;
}
