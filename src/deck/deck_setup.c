/* Builds a world from a deck: how many balls there are, where a mass or a filling is given; the
 * start file; the faults of the world in the deck's terms. */
#include "deck/deck_private.h"

#include <assert.h>

/* Relative to a ball's diameter: gaps between bodies are known to 10 %. Those to a drum are known
 * better, and one that equals the diameter also pinches a ball. */
#define NARROW 0.9
#define EQUAL 2e-4

/* ---- faults ---- */

/* The section of surface k of the setup; -1: the drum. copy: which one it is, "its copy 3 " */
static const char *find_section(const struct mill_deck *deck, int k, char copy[32])
{
    const char *title = k < 0 ? "drum" : mill_deck_section_of(deck, k);
    copy[0] = '\0';
    if (k >= deck->mill.parts &&
        ((struct mill_deck_body *)mill_deck_section(&deck->text, title)->form)->copies > 1)
        snprintf(copy, 32, "its copy %d ", deck->setup.surface[k].number);
    return title;
}

/* For a mixture the message gives counts such as "384 big, 3072 small". */
static void tell_no_room(const struct mill_deck *deck, const struct mill_deck_text *text,
                         const struct mill_fault *fault)
{
    const struct mill_deck_balls *first = &deck->mill.balls[0];
    const bool mixture = deck->setup.species > 1;
    char counts[512];
    size_t used = 0;
    for (int k = 0; k < deck->setup.species && k < MILL_FAULT_SPECIES && used < sizeof counts; k++)
        used +=
            (size_t)snprintf(counts + used, sizeof counts - used, mixture ? "%s%ld %s" : "%s%ld",
                             k ? ", " : "", (long)fault->fits[k], deck->setup.balls[k].name);
    if (fault->fits[0] == 0)
        mill_deck_wrong(
            text, first->section, first->given,
            "not a single ball%s fits: make the balls, or the bodies in the container, smaller",
            mixture ? " of each kind" : "");
    else
        mill_deck_wrong(text, first->section, first->given,
                        "%ld balls do not fit (solid fraction %.3f of the free volume); %s fit",
                        (long)deck->mill.all, fault->amount, counts);
}

/* Faults of bodies: they run into each other, leave the container, or touch periodic ends */
static void tell_bodies(const struct mill_deck *deck, const struct mill_deck_text *text,
                        const struct mill_fault *fault)
{
    char copy[32], other_copy[32], size[128] = "", by[32] = "";
    const char *section = find_section(deck, fault->other, copy);
    const struct mill_body *is = fault->other >= 0 ? deck->setup.surface[fault->other].body : NULL;
    if (is && is->facets > 0) { /* a mesh in the wrong unit is a thousand times too large */
        const vec3 m = mill_deck_bodies_size(is);
        snprintf(size, sizeof size,
                 "; with this 'unit' the mesh measures %.3g x %.3g x %.3g m: check 'unit'", m.x,
                 m.y, m.z);
    }
    if (fault->code == MILL_FAULT_OUTSIDE && fault->amount > 0.0)
        snprintf(by, sizeof by, " by %.2g mm", 1e3 * fault->amount);
    if (fault->code == MILL_FAULT_OUTSIDE)
        mill_deck_wrong(text, section, NULL, "%s" MILL_DECK_LEAVES "%s", copy, by, fault->when,
                        size);
    else if (fault->code == MILL_FAULT_CLASH)
        mill_deck_wrong(
            text, section, NULL,
            "%sruns into [%s] %sat t = %.6g s: make one of them smaller, or put both on one motion",
            copy, find_section(deck, fault->ball, other_copy), other_copy, fault->when);
    else if (fault->code == MILL_FAULT_MOVES)
        mill_deck_wrong(text, section, "motion",
                        "%smay only turn about the x axis if the drum's ends are periodic", copy);
    else
        mill_deck_wrong(text, section, NULL,
                        "%smust keep a ball's radius, %.4g mm, away from the periodic ends of the "
                        "drum, or reach from end to end with one cross-section, without a rounding",
                        copy, 1e3 * fault->amount);
}

static void tell_ball(const struct mill_deck *deck, const struct mill_deck_rows *rows,
                      const struct mill_fault *fault)
{
    static const char *const met[MILL_KINDS] = {"another ball", "the drum", "an end wall",
                                                "the shaft", "a blade"};
    const bool own = fault->kind >= MILL_KINDS;
    const long *line = rows->line.item, at = line[fault->ball];
    if (fault->code == MILL_FAULT_SPEED)
        mill_deck_files_wrong(rows, at, "a speed above that of light: give m/s and rad/s");
    else if (fault->code == MILL_FAULT_BALL_IN_SHAPE)
        mill_deck_files_wrong(
            rows, at, "ball overlaps %s%s by %.4g m: move the ball", own ? "the body " : "",
            own ? deck->mill.contacts.name[fault->kind] + strlen(MILL_DECK_BALL) : met[fault->kind],
            fault->amount);
    else if (fault->code == MILL_FAULT_BALL_IN_BALL)
        mill_deck_files_wrong(rows, at,
                              "ball overlaps the one of line %ld by %.4g m: move one of them",
                              line[fault->other], fault->amount);
    else
        mill_deck_files_wrong(rows, at,
                              "x is %.6g m from the middle, beyond the periodic ends of the drum "
                              "at %g m: move the ball",
                              fault->amount, 0.5 * deck->setup.drum.length);
}

static void tell(const struct mill_deck *deck, const struct mill_deck_rows *rows,
                 const struct mill_fault *fault)
{
    const struct mill_deck_text *text = rows->text;
    const enum mill_fault_code code = fault->code;
    if (code == MILL_FAULT_NONE)
        return;
    if (code == MILL_FAULT_MEMORY)
        mill_deck_failed(text, "out of memory for the mill and its balls");
    else if (code == MILL_FAULT_NUMBER || code == MILL_FAULT_CONTAINER)
        mill_deck_failed(text, "a number of the deck is out of range");
    else if (code == MILL_FAULT_SPEED || code == MILL_FAULT_BALL_IN_SHAPE ||
             code == MILL_FAULT_BALL_IN_BALL || code == MILL_FAULT_BALL_OUTSIDE)
        tell_ball(deck, rows, fault);
    else if (code == MILL_FAULT_SHORT)
        mill_deck_wrong(
            text, "drum", "length",
            "with periodic ends, must be more than three diameters of a ball, %.6g m; got %g m",
            3.0 * fault->amount, deck->setup.drum.length);
    else if (code == MILL_FAULT_TILT)
        mill_deck_wrong(text, "gravity", "acceleration",
                        "must be 0 along x if the drum's ends are periodic, or the balls fall "
                        "without end; got %g m/s^2",
                        deck->setup.gravity.x);
    else if (code == MILL_FAULT_NO_ROOM)
        tell_no_room(deck, text, fault);
    else
        tell_bodies(deck, text, fault);
}

/* Warns of a place where a moving body comes nearer to another than a ball's diameter. unchecked:
 * warns instead that the check for clashes ended before this pair was finished */
static void warn_of(const struct mill_deck *deck, const struct mill_passing *place, bool unchecked)
{
    char copy[32], other_copy[32] = "";
    const double d = deck->mill.widest;
    const bool wall = place->kind[1] == MILL_BALL_WALL, drum = place->other < 0;
    const double near = (wall ? 1.0 + EQUAL : drum ? 1.0 - EQUAL : NARROW) * d;
    if (unchecked ? isinf(place->when) : !(place->gap < near))
        return;
    const char *section = find_section(deck, place->one, copy);
    const char *met = find_section(deck, place->other, other_copy);
    if (unchecked)
        mill_deck_faults_warn(deck, section, NULL,
                              "it was not checked whether %sruns into [%s] %safter t = %.4g s, "
                              "because this would take too long",
                              copy[0] ? copy : "it ", met, other_copy, place->when);
    else
        mill_deck_faults_warn(deck, section, NULL,
                              "%scomes as near as %.2g mm to %s[%s] %sat t = %.4g s, no more than "
                              "a ball's diameter of %.3g mm: balls can be pinched there",
                              copy, 1e3 * place->gap, wall ? "an end wall of " : "", met,
                              other_copy, place->when, 1e3 * d);
}

/* ---- the sizes of balls ---- */

struct size {
    double diameter, share; /* [m]; of the mass */
};

/* Classes of equal mass; half of the mass of each is finer than its diameter. The share that is
 * finer than d is (d/largest)^3.8, of a charge worn to equilibrium with one size added (Bond 1961),
 * or 1 - exp(-(d/d63)^n) (Rosin & Rammler 1933). */
static long list_law(const struct mill_deck *deck, const char *section,
                     const struct mill_deck_balls *is, struct size *size)
{
    const bool bond = is->d63 == 0.0;
    const double n = bond ? 3.8 : is->uniformity, one = bond ? is->diameter : is->d63;
    const double least = is->smallest > 0.0 ? is->smallest : is->diameter / 3.0;
    const double lo = pow(least / one, n), hi = pow(is->diameter / one, n);
    const double from = bond ? lo : -expm1(-lo), all = (bond ? hi : -expm1(-hi)) - from;
    if (!(all > 1e-3))
        return mill_deck_wrong(&deck->text, section, "smallest",
                               "less than 0.1 %% of the balls is from %g m, the smallest, to %g m",
                               least, is->diameter);
    for (long k = 0; k < is->classes; k++) {
        const double f = from + all * ((double)k + 0.5) / (double)is->classes;
        size[k] = (struct size){one * pow(bond ? f : -log1p(-f), 1.0 / n), 1.0};
    }
    return is->classes;
}

/* The classes of a table: sizes with their shares, or screens with what passes them */
static long list_rows(struct mill_deck *deck, const char *section, const char *path,
                      struct size *size)
{
    static const char form[] = "2 numbers 'd m': diameter in m, share of the mass";
    struct mill_deck_rows rows = {
        &deck->text, section, "sizes", path, form, 1u << 2, .most = MILL_DECK_MOST_CLASSES};
    bool good = mill_deck_files_read(&rows);
    const double(*row)[2] = rows.row.item, none[2] = {0.0, 0.0}, *last = none;
    const bool screens = rows.row.count > 1 && row[0][1] == 0.0;
    double all = 0.0;
    long n = 0;
    for (size_t k = 0; k < rows.row.count && good; last = row[k++]) {
        const double d = row[k][0], share = row[k][1] - (screens ? last[1] : 0.0);
        if (!(d > last[0] && d < 1.0 && share >= 0.0))
            good = mill_deck_files_wrong(&rows, ((long *)rows.line.item)[k],
                                         "diameters, in m, and what passes must ascend from 0");
        size[n] = (struct size){screens ? sqrt(last[0] * d) : d, share};
        n += share > 0.0;
        all += share;
    }
    if (good && !(fabs(all - 1.0) < 0.01 || fabs(all - 100.0) < 1.0))
        good = mill_deck_wrong(
            &deck->text, section, "sizes",
            "the shares in '%s' add up to %g, not to 100 %%; what passes begins at 0", path, all);
    return good ? n : 0;
}

/* Puts a section for each class of sizes in the place of the one that gives them all. */
static bool split(struct mill_deck *deck, struct mill_deck_section *s)
{
    struct kind {
        struct mill_deck_section section;
        struct mill_deck_balls balls;
        char title[MILL_NAME_LENGTH + 32];
    } * made;
    struct mill_deck_balls all = *(struct mill_deck_balls *)s->form;
    struct mill_deck_section *last = s;
    struct size size[MILL_DECK_MOST_CLASSES];
    const char *name = mill_deck_name(s);
    double number = 0.0, mass = 0.0, before = 0.0; /* number: for one m^3, times pi/6 */
    if (all.classes == 0 && !mill_deck_files_find(&deck->text, s->title, "sizes", &all.sizes))
        return false;
    const long classes = all.classes > 0 ? list_law(deck, s->title, &all, size)
                                         : list_rows(deck, s->title, all.sizes, size);
    all.sizes = NULL;
    for (long k = 0; k < classes; k++) {
        char text[32]; /* four digits are the same on every computer */
        snprintf(text, sizeof text, "%.4g", size[k].diameter);
        size[k].diameter = strtod(text, NULL);
        number += size[k].share / pow(size[k].diameter, 3);
        mass += size[k].share;
    }
    for (long k = 0; k < classes; k++, last = last->next) {
        const double share = size[k].share / mass, cube = pow(size[k].diameter, 3);
        const double till = before + (double)all.count * size[k].share / cube / number;
        if (!(made = mill_deck_keep(&deck->text, malloc(sizeof *made))))
            return false;
        *made = (struct kind){.section = *s, .balls = all};
        snprintf(made->title, sizeof made->title, "balls.%s_%ld", name, k + 1);
        if (strlen(name) > MILL_NAME_LENGTH - 4 || mill_deck_section(&deck->text, made->title))
            return mill_deck_wrong(
                &deck->text, s->title, "sizes",
                "its classes are [balls.%s_1], ...: give one section another name", name);
        made->section.title = made->title;
        made->section.form = &made->balls;
        made->section.next = last->next;
        made->balls.diameter = size[k].diameter;
        made->balls.count = lround(till) - lround(before);
        made->balls.fill *= share;
        made->balls.bulk_fill *= share;
        made->balls.mass *= share;
        last->next = &made->section;
        before = till;
    }
    if (classes > 0 && strcmp(s->title, "balls") != 0)
        *s = *s->next;
    return classes > 0;
}

/* ---- the balls ---- */

/* Converts what is given instead of the number of balls. volume: [m^3] free; < 0: not known yet */
static bool count_balls(const struct mill_deck *deck, struct mill_deck_balls *balls, double *volume)
{
    const double d = balls->diameter, one = MILL_PI / 6.0 * d * d * d;
    double given = (double)balls->count;
    balls->given = "count";
    if (balls->fill > 0.0) {
        balls->given = "fill";
        given = balls->fill * mill_deck_checks_volume(deck) / one;
    } else if (balls->bulk_fill > 0.0) {
        balls->given = "bulk_fill";
        const struct mill_fault fault = {
            .code =
                *volume < 0.0 ? mill_start_free_volume_of(&deck->setup, volume) : MILL_FAULT_NONE};
        tell(deck, &(struct mill_deck_rows){.text = &deck->text}, &fault);
        if (fault.code != MILL_FAULT_NONE)
            return false;
        given = MILL_START_PACKING * balls->bulk_fill * *volume / one;
    } else if (balls->mass > 0.0) {
        balls->given = "mass";
        given = balls->mass / balls->density / one;
    }
    if (!(given >= 0.5 && given < MILL_DECK_MOST_BALLS + 0.5))
        return mill_deck_wrong(&deck->text, balls->section, balls->given,
                               "gives %.3g balls of %g m; expected 1 to %d", given, d,
                               MILL_DECK_MOST_BALLS);
    balls->count = lround(given);
    return true;
}

/* Sets the density of balls whose section gives only a material. */
static bool find_density(const struct mill_deck *deck, struct mill_deck_balls *balls)
{
    struct mill_deck_found found = {.is = {.density = 0.0}};
    if (balls->material &&
        !mill_deck_materials_find(deck, balls->section, "material", balls->material, &found))
        return false;
    if (!(balls->density > 0.0))
        balls->density = found.is.density;
    return balls->density > 0.0 ||
           mill_deck_wrong(&deck->text, balls->section, "material",
                           "the density of '%s' is not known: give 'density'", found.name);
}

void mill_deck_balls_list(struct mill_deck *deck)
{
    struct mill_deck_section *s = NULL;
    struct mill_deck_mill *mill = &deck->mill;
    size_t most = 1;
    double volume = -1.0;
    for (; (s = mill_deck_next_balls(&deck->text, s)); most++)
        if (((struct mill_deck_balls *)s->form)->sizes && !split(deck, s))
            return;
    struct mill_setup_balls *all = mill_deck_keep(&deck->text, calloc(most, sizeof *all));
    mill->balls = mill_deck_keep(&deck->text, calloc(most, sizeof *mill->balls));
    deck->setup.balls = all;
    while (all && mill->balls && (s = mill_deck_next_balls(&deck->text, s))) {
        struct mill_deck_balls *balls = s->form;
        balls->section = s->title;
        if (!find_density(deck, balls) || !count_balls(deck, balls, &volume))
            return;
        mill->all += balls->count;
        mill->widest = fmax(mill->widest, balls->diameter);
        const double count = (double)balls->count, cube = pow(balls->diameter, 3);
        mill->volume += count * MILL_PI / 6.0 * cube;
        mill->mass += count * balls->density * MILL_PI / 6.0 * cube;
        all[deck->setup.species] = (struct mill_setup_balls){mill_deck_name(s), balls->diameter,
                                                             balls->density, (int32_t)balls->count};
        mill->balls[deck->setup.species++] = *balls;
    }
    mill_deck_files_find(&deck->text, "balls", "start", &deck->given.start);
}

/* Converts the ratio of the masses of balls and powder to a mass of powder, and finds its table. */
void mill_deck_balls_powder(struct mill_deck *deck)
{
    struct mill_deck_powder *powder = &deck->given.powder;
    if (powder->ball_to_powder > 0.0)
        powder->mass = deck->mill.mass / powder->ball_to_powder;
    mill_deck_files_find(&deck->text, "powder", "table", &powder->table);
    if (powder->mass > 0.0) {
        deck->observe.hard_by = powder->energy;
        if (isnan(powder->threshold))
            powder->threshold = deck->observe.hard;
        else if (!isnan(deck->observe.hard) && deck->observe.hard != powder->threshold)
            mill_deck_wrong(&deck->text, "powder", "threshold",
                            "differs from run.hard_impact: give only one of them");
        else
            deck->observe.hard = powder->threshold;
    }
    deck->setup.asked = isnan(deck->observe.hard) ? 0.0 : deck->observe.hard;
}

/* ---- the world ---- */

/* Reads the start file, one ball a line, into the setup. */
static bool read_start(struct mill_deck_rows *rows, struct mill_setup *setup)
{
    if (!rows->path)
        return true;
    if (!mill_deck_files_read(rows))
        return false;
    assert(rows->row.size == sizeof *setup->start);
    setup->start = rows->row.item; /* nine numbers each */
    return rows->row.count == (size_t)rows->most ||
           mill_deck_wrong(rows->text, "balls", "start",
                           "'%s' has %zu rows, but the deck has %ld balls", rows->path,
                           rows->row.count, rows->most);
}

enum mill_status mill_deck_setup_world(const struct mill_deck *deck,
                                       const struct mill_start_watch *watch,
                                       struct mill_world **world, struct mill_error *error)
{
    struct mill_memory_list memory = {.size = sizeof(void *)};
    struct mill_deck_reading reading = {.error = error, .memory = &memory, .watch = watch};
    struct mill_deck_text text = deck->text;
    static const char form[] = "3, 6 or 9 numbers 'x y z [vx vy vz [wx wy wz]]' in SI units";
    struct mill_deck_rows rows = {&text, "balls", "start", deck->given.start, form, .alone = true};
    rows.columns = 1u << 3 | 1u << 6 | 1u << 9;
    rows.most = (long)deck->mill.all;
    struct mill_setup setup = deck->setup;
    struct mill_fault fault = {.code = MILL_FAULT_NONE};
    *world = NULL;
    text.reading = &reading;
    if (read_start(&rows, &setup)) {
        mill_start_world(&setup, watch, world, &fault);
        tell(deck, &rows, &fault);
    }
    const enum mill_status status = mill_deck_faults_tell(&text, NULL);
    for (int k = 0; status == MILL_OK && k < MILL_FAULT_PASSINGS; k++)
        warn_of(deck, &fault.narrowest[k], false);
    if (status == MILL_OK)
        warn_of(deck, &fault.unchecked, true);
    mill_deck_release(&memory);
    return status;
}
