/* Bodies: converts shaft, blades and the [body.NAME], with their axes, copies and kinds of contact,
 * to the engine's form, and finds the one that holds the balls. */
#include "base/elementary.h"
#include "deck/deck_private.h"
#include "deck/stl.h"
#include "geometry/shapes.h"
#include "mesh/facets_unite.h"

enum {
    MOST_BODIES = 20000,  /* limit of the engine's numbers of surfaces, with the blades */
    MOST_FACETS = 5000000 /* of all copies of a mesh: 3 GB of memory */
};
/* Relative to the drum's radius: bounds this close are exact enough; less than this is no fault */
#define SNUG 1e-11
#define TOUCHING 1e-5
/* an axis nearer than this to x: its part across x is only rounding */
#define ALONG 1e-6

/* ---- places ---- */

/* Exactly 0 and 1 for quarter turns, so that the copies are exactly symmetric */
static struct mill_heading heading(double angle)
{
    struct mill_heading at = mill_elementary_heading(angle);
    const double nothing = 0x1p-50;
    if (fabs(at.cos) < nothing)
        at = (struct mill_heading){0.0, copysign(1.0, at.sin)};
    else if (fabs(at.sin) < nothing)
        at = (struct mill_heading){copysign(1.0, at.cos), 0.0};
    return at;
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
    const struct mill_heading at = heading(given->angle);
    set_axes(is, is->z, vec3_turned(is->x, is->z, at.cos, at.sin));
}

static void move_on(const struct mill_deck_body *given, struct mill_body *is)
{
    const struct mill_heading at = heading(given->turn_by);
    const vec3 n = mill_deck_motions_unit(given->turn_about);
    is->centre = vec3_add(vec3_turned(is->centre, n, at.cos, at.sin), given->shift_by);
    set_axes(is, vec3_turned(is->z, n, at.cos, at.sin), vec3_turned(is->x, n, at.cos, at.sin));
}

/* ---- kinds of contact ---- */

static bool find_kind(struct mill_deck *deck, const struct mill_deck_section *section, int *kind)
{
    const char *given = ((struct mill_deck_body *)section->form)->kind;
    const char *name = given ? given : mill_deck_name(section);
    struct mill_kinds *kinds = &deck->mill.contacts;
    const bool prefixed = given && strncmp(given, MILL_DECK_BALL, strlen(MILL_DECK_BALL)) == 0;
    name += prefixed ? strlen(MILL_DECK_BALL) : 0;
    const char *wrong = NULL;
    if (!mill_deck_is_name(name) || strlen(name) >= MILL_NAME_LENGTH)
        wrong = "'%.80s' is not allowed: a name consists of letters, digits, '_', '-', '+' and '.'";
    else if (given && !prefixed)
        wrong = "a kind of contact begins with 'ball_': write '" MILL_DECK_BALL "%.60s'";
    if (wrong)
        return mill_deck_wrong(&deck->text, section->title, "kind", wrong, given);
    for (*kind = 0; *kind < kinds->count; ++*kind)
        if (strcmp(kinds->name[*kind] + strlen(MILL_DECK_BALL), name) == 0)
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
    if (*kind == kinds->count) {
        mill_kinds_add(kinds, name);
        deck->mill.kind[deck->setup.kinds++] = kinds->name[*kind] + strlen(MILL_DECK_BALL);
    }
    return true;
}

/* ---- meshes ---- */

/* Who hears of a mesh */
struct hearing {
    struct mill_deck *deck;
    const struct mill_deck_section *section;
};

static void hear(void *self, const char *text)
{
    const struct hearing *h = self;
    mill_deck_wrong(&h->deck->text, h->section->title, "file",
                    "%s; mend it with 'mill mesh %s -o OUT.stl'", text,
                    ((struct mill_deck_body *)h->section->form)->file);
}

static void pass_on(void *self, const char *what, int32_t done, int32_t all)
{
    const struct mill_start_watch *watch = ((struct hearing *)self)->deck->text.reading->watch;
    watch->tell(watch->self, what, done, all);
}

vec3 mill_deck_bodies_size(const struct mill_body *mesh)
{
    vec3 lo = {INFINITY, INFINITY, INFINITY}, hi = {-INFINITY, -INFINITY, -INFINITY};
    for (size_t k = 0; k < 3 * mesh->facets; k++) {
        const vec3 at = mesh->facet[k / 3][k % 3];
        lo = vec3_make(fmin(lo.x, at.x), fmin(lo.y, at.y), fmin(lo.z, at.z));
        hi = vec3_make(fmax(hi.x, at.x), fmax(hi.y, at.y), fmax(hi.z, at.z));
    }
    return vec3_sub(hi, lo);
}

/* Reads the mesh of a placed body; leaves of its facets those that balls can meet. */
static bool read_mesh(struct mill_deck *deck, const struct mill_deck_section *section,
                      struct mill_body *is)
{
    const struct mill_deck_text *text = &deck->text;
    struct mill_deck_body *given = section->form;
    struct hearing h = {deck, section};
    struct mill_facets_report found = {.unit = given->unit, .fault = hear, .self = &h};
    struct mill_error why;
    vec3(*facet)[3] = NULL;
    if (!mill_deck_files_find(&deck->text, section->title, "file", &given->file))
        return false;
    const enum mill_status status =
        mill_stl_read(given->file, given->unit, &facet, &is->facets, &why);
    if (status == MILL_BAD_DECK)
        return mill_deck_wrong(text, section->title, "file", "%s", why.text);
    if (status != MILL_OK)
        return mill_deck_failed(text, "%s", why.text);
    is->facet = (const vec3(*)[3])mill_deck_keep(text, facet);
    if (!is->facet)
        return false;
    found.tell = text->reading->watch ? pass_on : NULL;
    const vec3 size = mill_deck_bodies_size(is);
    const double least = fmin(size.x, fmin(size.y, size.z));
    if (least > 0.0 && least < MILL_SOLID_LEAST)
        return mill_deck_wrong(
            text, section->title, "unit",
            "the mesh measures %.3g x %.3g x %.3g m, and no length of a body may be below %g m",
            size.x, size.y, size.z, MILL_SOLID_LEAST);
    if (!mill_facets_unite(is, facet, &found))
        return mill_deck_failed(text, "out of memory for the %zu facets of '%s'", is->facets,
                                given->file);
    if (found.faults > MILL_FACETS_TOLD)
        text->reading->more += found.faults - MILL_FACETS_TOLD;
    if (found.faults == 0 && found.hollow)
        mill_deck_faults_warn(deck, section->title, "file",
                              "it is a solid with a room in it, and the balls are in this room, "
                              "which is larger than the solid");
    if (found.faults == 0 && found.closed > 0.0)
        mill_deck_faults_warn(
            deck, section->title, "file",
            "it encloses %.4g cm3 that no ball can reach, and that are not filled",
            1e6 * found.closed);
    return found.faults == 0;
}

/* ---- the list ---- */

/* Checks what the ranges of single keys do not cover */
static bool check_form(const struct mill_deck *deck, const struct mill_deck_section *section,
                       const struct mill_solid *solid, const struct mill_body *is)
{
    struct mill_body sharp = *is;
    sharp.rounding = 0.0;
    if (mill_solid_is_sound(solid, is))
        return true;
    if (is->inside && solid->support && !solid->walls)
        return mill_deck_wrong(&deck->text, section->title, "side",
                               "a body of this shape cannot hold the balls: set 'side = outside'");
    if (mill_solid_is_sound(solid, &sharp))
        return mill_deck_wrong(
            &deck->text, section->title, "rounding",
            "%g m is too large for the sizes of the body, or smaller than %g m: change it",
            is->rounding, MILL_SOLID_LEAST);
    return mill_deck_wrong(
        &deck->text, section->title, NULL,
        "a size of the body is out of range: look at its radius, length and size");
}

static void add(struct mill_deck *deck, const char *section, struct mill_setup_surface surface,
                struct mill_body is)
{
    struct mill_body *body = mill_deck_keep(&deck->text, malloc(sizeof *body));
    struct mill_setup_surface *made = mill_memory_add(&deck->mill.surface);
    const char **of = mill_memory_add(&deck->mill.section);
    if (!body || !made || !of) {
        mill_deck_failed(&deck->text, "out of memory");
        return;
    }
    *of = section;
    *body = is;
    surface.body = body;
    *made = surface;
    deck->setup.surface = deck->mill.surface.item;
    deck->setup.surfaces++;
}

/* The body and its copies */
static bool add_body(struct mill_deck *deck, const struct mill_deck_section *section)
{
    struct mill_deck_body *given = section->form;
    struct mill_setup_surface surface = {.solid = mill_shapes_solid(given->shape)};
    struct mill_body is;
    if (!mill_deck_motions_find(deck, section->title, "motion", given->motion, &surface.motion) ||
        !find_kind(deck, section, &surface.kind))
        return false;
    if (given->is.inside)
        deck->mill.container = mill_shapes_container(&deck->setup);
    if (given->is.inside && (deck->mill.drum || deck->mill.container))
        return mill_deck_wrong(&deck->text, section->title, "side",
                               "[%s] holds the balls, and a mill has one container: %s",
                               mill_deck_holder(deck),
                               deck->mill.drum ? "leave [drum] out, or set 'side = outside'"
                                               : "set 'side = outside' here or there");
    place(given, &is);
    if ((given->file && surface.solid->key &&
         !mill_deck_lining_read(deck, section->title, &given->file, &is)) ||
        (!surface.solid->key && !read_mesh(deck, section, &is)) ||
        !check_form(deck, section, surface.solid, &is))
        return false;
    if (is.facets > 0 && given->copies > MOST_FACETS / (long)is.facets)
        return mill_deck_wrong(&deck->text, section->title, "copies",
                               "%ld copies of %zu facets are more than %d: simplify the mesh, or "
                               "put all copies into one",
                               given->copies, is.facets, MOST_FACETS);
    for (; surface.number < (given->is.inside ? 1 : given->copies); surface.number++) {
        if (surface.number > 0)
            move_on(given, &is);
        add(deck, section->title, surface, is);
    }
    return true;
}

void mill_deck_bodies_list(struct mill_deck *deck)
{
    const struct mill_deck_section *s = NULL;
    long all = 0;
    bool good = true;
    while ((s = mill_deck_named(&deck->text, "body", s))) {
        const long copies = ((struct mill_deck_body *)s->form)->copies;
        all += copies > 1 ? copies : 1;
        if (all > MOST_BODIES) {
            mill_deck_wrong(&deck->text, s->title, copies > 1 ? "copies" : NULL,
                            "more than %d bodies in all", MOST_BODIES);
            return;
        }
    }
    mill_kinds_init(&deck->mill.contacts);
    deck->setup.kind = deck->mill.kind;
    while ((s = mill_deck_named(&deck->text, "body", s)))
        good = add_body(deck, s) && good;
    deck->mill.container = mill_shapes_container(&deck->setup);
    if (good && !deck->mill.drum && !deck->mill.container)
        mill_deck_wrong(
            &deck->text, NULL, NULL,
            "nothing holds the balls: add [drum], or a [body.NAME] with 'side = inside'");
    deck->mill.carrier =
        deck->mill.container ? deck->mill.container->motion : deck->setup.drum.rides - 1;
}

/* Equal blades: number k = 0.. is at x = -L/2 + (k + 1/2) L/count, at the angle k angle_step. */
void mill_deck_bodies_parts(struct mill_deck *deck)
{
    const struct mill_setup_surface shaft = {
        .solid = &mill_prism_solid, .number = -1, .kind = MILL_BALL_SHAFT};
    struct mill_setup_surface surface = {.solid = &mill_box_solid, .kind = MILL_BALL_BLADE};
    struct mill_deck_blades *all = &deck->given.blades;
    const double length = deck->setup.drum.length, count = (double)all->count;
    const struct mill_deck_section *s = NULL;
    if (deck->mill.rotor && deck->given.shaft_radius > 0.0)
        add(deck, "rotor", shaft, mill_setup_shaft(deck->given.shaft_radius, length));
    if (all->count > 0 && !mill_deck_entry(mill_deck_section(&deck->text, "blades"), "angle_step"))
        all->angle_step = 2.0 * MILL_PI / count;
    for (; surface.number < all->count; surface.number++) {
        struct mill_blade blade = all->form;
        blade.position = (surface.number + 0.5 - 0.5 * count) * (length / count);
        blade.angle = surface.number * all->angle_step;
        add(deck, "blades", surface, mill_setup_blade(&blade));
    }
    for (; (s = mill_deck_named(&deck->text, "blade", s)); surface.number++)
        add(deck, s->title, surface, mill_setup_blade(s->form));
    deck->mill.parts = deck->setup.surfaces;
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

void mill_deck_bodies_turn(struct mill_deck *deck)
{
    double tip = deck->given.blades.count > 0 ? deck->given.blades.form.tip_radius : 0.0;
    if (deck->given.tip_speed == 0.0)
        return;
    for (const struct mill_deck_section *s = NULL; (s = mill_deck_named(&deck->text, "blade", s));)
        tip = fmax(tip, ((const struct mill_blade *)s->form)->tip_radius);
    for (int k = deck->mill.parts; k < deck->setup.surfaces; k++) {
        const struct mill_setup_surface *body = &deck->setup.surface[k];
        const double far =
            body->motion == 0 ? mill_deck_bodies_reach(body->solid, body->body) : 0.0;
        if (far < 0.0)
            mill_deck_failed(&deck->text, "out of memory");
        tip = fmax(tip, far);
    }
    if (tip == 0.0)
        mill_deck_wrong(&deck->text, "rotor", "tip_speed",
                        "needs blades, or bodies with 'motion = rotor': their largest distance "
                        "from the axis is the radius of the tip; without them give 'speed'");
    else
        deck->given.rotor.speed = deck->given.tip_speed / tip;
}

/* Bounds of how far the blade reaches beyond the walls of the drum, < 0 [m]. Neither moves but
 * about the axis. The check of a whole mill also finds what is not told here. */
static double beyond(const struct mill_body *drum, const struct mill_body *blade)
{
    const struct mill_pose own = {.place = drum->centre, .x = drum->x, .y = drum->y, .z = drum->z};
    const struct mill_pose in = mill_pose_relative(&mill_pose_still, &own);
    struct mill_wall wall[MILL_WALLS];
    double most = 0.0;
    const int walls =
        (drum->corners > 0 ? &mill_contour_solid : &mill_prism_solid)->walls(drum, wall);
    const struct mill_part box = mill_part_of(&mill_box_solid, blade),
                           part = mill_part_move(&box, &in);
    for (int k = 0; k < walls; k++)
        if (wall[k].flat || drum->corners == 0)
            most = fmin(most, mill_part_to_wall(&part, &wall[k], SNUG * drum->radius).most);
    return most;
}

void mill_deck_bodies_inside(struct mill_deck *deck)
{
    const char *told = "rotor"; /* equal blades are one section */
    char text[32];
    if (!deck->mill.drum || deck->setup.drum.rides != 0)
        return;
    const struct mill_body drum = mill_setup_drum_body(&deck->setup.drum);
    for (int k = 0; k < deck->mill.parts; k++) {
        const char *section = mill_deck_section_of(deck, k);
        if (strcmp(section, told) == 0)
            continue;
        const double by = -beyond(&drum, deck->setup.surface[k].body);
        if (!(by > TOUCHING * drum.radius))
            continue;
        told = section;
        snprintf(text, sizeof text, " by %.2g mm", 1e3 * by);
        mill_deck_wrong(&deck->text, told, NULL, MILL_DECK_LEAVES, text, 0.0);
    }
}
