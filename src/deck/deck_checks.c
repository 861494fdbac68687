/* Do the values of a deck agree with each other? Times and output; the parts of a classic mill: do
 * the balls and parts fit into the drum, or the balls into the body that holds them? */
#include "base/elementary.h"
#include "deck/deck_private.h"
#include "geometry/body.h"

#define STARTS 8
#define MOST_SAMPLES 1e8
#define MOST_FRAMES 1e7
/* relative to the drum's reach */
#define SNUG 1e-11
#define MANY_FRAMES 1e5 /* more frames are probably a mistake */
/* Limits of a motion: [m/s], [g], lengths of the container */
#define FAST 100.0
#define HARD 1000.0
#define WIDE 20.0
#define DENSEST 0.7404804896930611 /* pi / sqrt(18): no packing of equal balls is denser */

/* ---- [run] and [output] ---- */

void mill_deck_checks_run(struct mill_deck *deck)
{
    const struct mill_observe *is = &deck->observe;
    if (is->sample_from >= is->end)
        mill_deck_wrong(&deck->text, "run", "sample_from",
                        "must be before the end of the run, %g s", is->end);
    if (is->max_collisions != floor(is->max_collisions))
        mill_deck_wrong(&deck->text, "run", "max_collisions", "must be a whole number, got %.15g",
                        is->max_collisions);
    if (is->end / is->series > MOST_SAMPLES)
        mill_deck_wrong(&deck->text, "output", "series",
                        "too short: more than 1e8 samples until %g s", is->end);
}

/* Number of frames in the whole run, and the size of their ball states [GB] */
static double frames_of(const struct mill_deck *deck)
{
    return deck->observe.frames > 0.0 ? deck->observe.end / deck->observe.frames : 0.0;
}

static double size_of(const struct mill_deck *deck)
{
    enum { BALL = 36 /* [B] nine numbers of four bytes */ };
    return 1e-9 * frames_of(deck) * (double)deck->mill.all * BALL;
}

void mill_deck_checks_frames(struct mill_deck *deck)
{
    if (frames_of(deck) > MOST_FRAMES)
        mill_deck_wrong(&deck->text, "output", "frames",
                        "too short: more than 1e7 frames until %g s (%.3g GB of ball states)",
                        deck->observe.end, size_of(deck));
}

void mill_deck_checks_starts(struct mill_deck *deck)
{
    const bool counted = deck->observe.max_collisions > 0.0, file = deck->given.start != NULL;
    /* in a container that moves, a charge may keep its first arrangement for ever; elsewhere two
     * starts on two cores are known to run.precision sooner than one */
    const long usual = deck->mill.carrier >= 0 ? STARTS : deck->observe.precision > 0 ? 2 : 1;
    if (deck->observe.starts == 0)
        deck->observe.starts = counted || file ? 1 : usual;
    if (deck->observe.starts > 1 && (file || counted))
        mill_deck_wrong(&deck->text, "run", "starts",
                        file ? "with [balls] start all starts would be the same: give 1, or leave "
                               "out [balls] start"
                             : "with max_collisions the starts would end at other times: give 1, "
                               "or leave out max_collisions");
}

/* ---- the mill ---- */

/* [m] The distance of the drum's wall from the axis, where it comes nearest */
static double bore_of(const struct mill_deck *deck)
{
    const struct mill_body drum = mill_setup_drum_body(&deck->setup.drum);
    return mill_body_wall(mill_setup_drum_solid(&deck->setup.drum), &drum, 0).radius;
}

double mill_deck_checks_volume(const struct mill_deck *deck)
{
    const struct mill_setup_surface *container = deck->mill.container;
    const struct mill_setup_drum *drum = &deck->setup.drum;
    return container ? container->solid->volume(container->body)
                     : MILL_PI * drum->radius * drum->radius * drum->length;
}

/* [m^3] of the container without the shaft */
static double room_of(const struct mill_deck *deck)
{
    if (deck->mill.container)
        return mill_deck_checks_volume(deck);
    const double shaft = deck->mill.rotor ? deck->given.shaft_radius : 0.0;
    const struct mill_setup_drum *drum = &deck->setup.drum;
    const struct mill_body body = mill_setup_drum_body(drum);
    return mill_setup_drum_solid(drum)->volume(&body) - MILL_PI * shaft * shaft * drum->length;
}

/* [m] diameter of the widest ball on the axis of a container that fits between its walls; INFINITY:
 * it has none. The gap to the nearest wall is concave along the axis. */
static double width_of(const struct mill_setup_surface *container)
{
    const struct mill_hull hull = mill_solid_hull(container->solid, container->body);
    double from = -hull.half, to = hull.half, width = INFINITY;
    struct mill_wall wall[MILL_WALLS];
    if (container->body->corners > 0) /* it may be wide elsewhere than about its axis */
        return 2.0 * hull.half;
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

/* Shaft and blades */
void mill_deck_checks_parts(struct mill_deck *deck)
{
    static const char need[] = "need a [drum] that does not move; here give the part as a "
                               "[body.NAME] with 'motion = rotor'";
    const struct mill_deck_text *text = &deck->text;
    const struct mill_deck_mill *mill = &deck->mill;
    const bool still = mill->drum && deck->setup.drum.rides == 0;
    const double radius = deck->given.shaft_radius, bore = mill->drum ? bore_of(deck) : 0.0;
    const bool shaft = mill->rotor && radius > 0.0, wide = shaft && radius >= bore;
    const char *blades = mill->parts > shaft ? mill_deck_section_of(deck, shaft) : NULL;
    int hidden = shaft; /* the first blade that does not come out of the shaft */
    while (hidden < mill->parts && deck->setup.surface[hidden].body->size.y > radius)
        hidden++;
    if (shaft && !still)
        mill_deck_wrong(text, "rotor", "shaft_radius", "shafts %s", need);
    else if (shaft && radius < MILL_SOLID_LEAST)
        mill_deck_wrong(text, "rotor", "shaft_radius",
                        "must be 0 m (no shaft), or at least %g m; got %g m", MILL_SOLID_LEAST,
                        radius);
    else if (wide)
        mill_deck_wrong(
            text, "rotor", "shaft_radius", "must be less than the drum's radius%s, %g m",
            deck->setup.drum.corners > 0 ? " where its wall comes nearest to the axis" : "", bore);
    if (blades && !still)
        mill_deck_wrong(text, blades, NULL, "blades %s", need);
    else if (blades && !mill->rotor)
        mill_deck_wrong(text, blades, NULL, "blades need a section [rotor] that carries them");
    if (shaft && !wide && hidden < mill->parts)
        mill_deck_wrong(text, mill_deck_section_of(deck, hidden), "tip_radius",
                        "must be greater than the shaft's radius, %g m, got %g m", radius,
                        deck->setup.surface[hidden].body->size.y);
}

/* Does a ball of this kind fit in? One that fits exactly would hit both sides again and again. */
static bool check_size(const struct mill_deck *deck, const struct mill_deck_balls *balls)
{
    const struct mill_setup_surface *container = deck->mill.container;
    const struct mill_setup_drum *drum = &deck->setup.drum;
    const char *odd = drum->corners > 0 ? " where its wall comes nearest to the axis" : "";
    const double d = balls->diameter, bore = container ? 0.0 : bore_of(deck);
    const double apart = bore - deck->given.shaft_radius;
    const double width = container ? width_of(container) : (double)INFINITY;
    char what[200] = "";
    if (!(d < width * (1.0 - SNUG)))
        snprintf(
            what, sizeof what,
            "does not fit into the container [%s], whose smallest inner width or height is %g m",
            mill_deck_holder(deck), width);
    else if (!container && d >= 2.0 * bore)
        snprintf(what, sizeof what, "does not fit into a drum of radius %g m%s", bore, odd);
    else if (!container && d >= drum->length)
        snprintf(what, sizeof what, "does not fit into a drum %g m long", drum->length);
    else if (!container && deck->mill.rotor && d >= apart)
        snprintf(what, sizeof what, "does not fit between the shaft and the drum, %g m apart%s",
                 apart, odd);
    return !*what ||
           mill_deck_wrong(&deck->text, balls->section, "diameter", "a ball of %g m %s", d, what);
}

void mill_deck_checks_balls(struct mill_deck *deck)
{
    const struct mill_setup *setup = &deck->setup;
    const struct mill_deck_balls *balls = deck->mill.balls;
    const double room = room_of(deck), most = (setup->species == 1 ? DENSEST : 1.0) * room;
    const double volume = deck->mill.volume;
    bool good = true;
    for (int k = 0; k < setup->species; k++)
        good = check_size(deck, balls = &deck->mill.balls[k]) && good;
    if (good && deck->mill.all > MILL_DECK_MOST_BALLS)
        good = mill_deck_wrong(&deck->text, balls->section, balls->given,
                               "more than %d balls in all", MILL_DECK_MOST_BALLS);
    else if (good && volume > most)
        good = mill_deck_wrong(&deck->text, balls->section, balls->given,
                               "%ld balls do not fit: they fill %.3g litres of the %s's %.3g",
                               (long)deck->mill.all, 1e3 * volume,
                               deck->mill.drum ? "drum" : "container", 1e3 * room);
    for (int k = 0; k < 2 && good && deck->given.start; k++)
        if (k ? setup->at_rest : setup->speed != 0.0)
            mill_deck_wrong(&deck->text, "balls", k ? "start_motion" : "speed",
                            "is for a random start only; the start file has its own speeds");
}

/* ---- keys that other keys of [powder] need ---- */

void mill_deck_checks_powder(struct mill_deck *deck)
{
    const struct mill_deck_powder *p = &deck->given.powder;
    const bool vogel = p->law == MILL_DECK_VOGEL, power = p->law == MILL_DECK_POWER;
    const struct {
        bool lacks;
        const char *key, *sentence;
    } needs[] = {
        {(power || p->law == MILL_DECK_THRESHOLD) && p->coefficient == 0.0, "coefficient",
         "this law needs the coefficient c of each impact"},
        {power && p->exponent == 0.0, "exponent", "the power law needs its exponent n"},
        {vogel && p->strength == 0.0, "strength", "the law needs the material's f_Mat"},
        {vogel && p->size == 0.0, "size", "the law needs the diameter of a particle"},
        {p->law == MILL_DECK_RATES && !p->table, "table",
         "the law needs a file with a row 'E k' for each energy"},
        {p->capture == MILL_DECK_LAYER && p->layer == 0.0, "layer",
         "this capture needs the thickness of the powder on a surface"},
    };
    for (size_t k = 0; k < sizeof needs / sizeof *needs && p->mass > 0.0; k++)
        if (needs[k].lacks)
            mill_deck_wrong(&deck->text, "powder", needs[k].key, "%s", needs[k].sentence);
}

/* ---- warnings of what is allowed but is probably a mistake ---- */

/* A motion that carries nothing: the user has probably forgotten `on` or `motion`. */
static void warn_of_idle(const struct mill_deck *deck)
{
    for (int k = deck->mill.rotor; k < deck->setup.motions; k++) {
        bool carries = deck->setup.drum.rides == 1 + k;
        for (int i = 0; i < deck->setup.motions; i++)
            carries = carries || deck->mill.motion[i].on == k;
        for (int i = deck->mill.parts; i < deck->setup.surfaces; i++)
            carries = carries || deck->setup.surface[i].motion == k;
        if (carries)
            continue;
        mill_deck_faults_warn(
            deck, mill_deck_find(&deck->text, "motion", deck->mill.motion[k].name)->title, "kind",
            "this motion carries nothing: name it as 'on' of another motion or as 'motion' of a "
            "body, or leave it out");
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
    mill_deck_faults_warn(deck, mill_deck_holder(deck), "centre",
                          "the container's axis is %.3g mm away from the axis of [motion.%s]: give "
                          "a planetary jar and its motion the same 'centre'",
                          1e3 * away, motion->name);
}

/* The table of a motion in other units than those of the deck: nothing in a mill is so fast */
static void warn_of_table(const struct mill_deck *deck, const struct mill_setup_motion *motion)
{
    const struct mill_table *table = motion->form;
    const double size = cbrt(mill_deck_checks_volume(deck)), g = 9.80665;
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
    mill_deck_faults_warn(deck, mill_deck_find(&deck->text, "motion", motion->name)->title, "file",
                          "the table moves by %.3g m, at up to %.3g m/s and %.3g g: its rows are "
                          "in s, m and rad; divide lengths in mm and times in ms by 1000",
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
            "%.4g kg/m^3 is used, not the %.4g kg/m^3 of '%s'; leave it out to use that",
            b->density, found.is.density, b->material);
    }
    for (int kind = 0; kind < deck->mill.contacts.count; kind++)
        given = given && !deck->mill.contact[kind].assumed[0];
    if (!given || !(of_part || of_balls))
        return;
    mill_deck_faults_warn(deck, of_balls ? of_balls : of_part, "material",
                          of_balls ? "[contact] gives all values of the contacts; leave them out "
                                     "to use those of the material"
                          : mill_deck_entry(contact, "friction") &&
                                  mill_deck_entry(contact, "tangential_restitution")
                              ? "is not used: [contact] gives all values"
                              : "is not used: the balls have no 'material'");
}

void mill_deck_warn(const struct mill_deck *deck)
{
    const double frames = frames_of(deck);
    /* materials give the contacts of clean surfaces */
    const bool clean = deck->mill.contact[MILL_BALL_BALL].assumed[0] && !deck->given.between;
    if (clean && mill_deck_section(&deck->text, "powder"))
        mill_deck_faults_warn(deck, "powder", "mass",
                              "the contacts are those of clean surfaces; [contact] between = "
                              "powder gives those of surfaces with powder");
    if (frames > MANY_FRAMES)
        mill_deck_faults_warn(deck, "output", "frames",
                              "%.3g frames until %g s take %.3g GB; consider a longer interval",
                              frames, deck->observe.end, size_of(deck));
    mill_deck_lining_warn(deck);
    warn_of_idle(deck);
    warn_of_axes(deck);
    for (int k = 0; k < deck->setup.motions; k++)
        if (deck->mill.motion[k].type == &mill_table_type)
            warn_of_table(deck, &deck->mill.motion[k]);
    warn_of_materials(deck);
}
