/* Numbers as texts; the mill as lines; its impacts as a table, a row for each kind */
#include "app/summary.h"
#include "geometry/mesh.h"
#include "millsim/start.h"
#include "observe/outline.h"

#include <stdarg.h>

enum { TEXT = 64, LISTED = 8 /* species */, MOMENTS = 60 /* of a period */ };

/* ---- numbers as texts ---- */

/* Format of a number with four significant digits: in units of `one`, with `decimals` decimals */
struct scale {
    double one;
    const char *prefix;
    int decimals;
};

const char *mill_summary_text(const char *format, ...)
{
    static char texts[8][TEXT];
    static unsigned turn;
    char *text = texts[turn++ % 8];
    va_list list;
    va_start(list, format);
    vsnprintf(text, TEXT, format, list);
    va_end(list);
    return text;
}

/* Sets the scale of a value; false: none fits. "M/s" would look like metres: counts have words. */
static bool fits(double value, const char *unit, struct scale *scale)
{
    static const char *const prefix[] = {"p", "n", "u", "m", "", "k", "M", "G", "T"};
    static const char *const word[] = {"", "thousand", "million", "billion", "trillion"};
    const bool counted = !*unit || strcmp(unit, "/s") == 0 || strcmp(unit, "/J") == 0;
    char digits[TEXT];
    if (isinf(value))
        return false;
    snprintf(digits, sizeof digits, "%.3e", value); /* round first: 999.96 becomes 1.000 k */
    const int exponent = value == 0 ? 0 : atoi(strchr(digits, 'e') + 1);
    if (exponent < -12 || exponent > 14)
        return false;
    int thousands = (exponent + 15) / 3 - 5; /* division rounded towards minus infinity */
    thousands = counted && thousands < 0 ? 0 : thousands;
    *scale = (struct scale){.one = pow(10, 3 * thousands),
                            .prefix = counted ? word[thousands] : prefix[thousands + 4],
                            .decimals = 3 - (exponent - 3 * thousands)};
    return true;
}

const char *mill_summary_si(double value, const char *unit)
{
    struct scale scale;
    if (isnan(value))
        return "-";
    if (value == 0)
        return mill_summary_text("0%s%s", *unit ? " " : "", unit);
    if (!*unit && value < 1000 && value == floor(value)) /* a count */
        return mill_summary_text("%.0f", value);
    if (!fits(value, unit, &scale))
        return mill_summary_text("%.3e %s", value, unit);
    return mill_summary_text("%.*f%s%s%s", scale.decimals, value / scale.one,
                             *scale.prefix || *unit ? " " : "", scale.prefix, unit);
}

const char *mill_summary_mean(const struct mill_spread_mean *mean, const char *unit)
{
    struct scale scale;
    const double most = fmax(fabs(mean->value), mean->error);
    if (isnan(mean->value) || isnan(mean->error) || !fits(most, unit, &scale))
        return mill_summary_si(mean->value, unit);
    while (mean->error > 0 && scale.decimals < 9 &&
           mean->error / scale.one < pow(10, -scale.decimals))
        scale.decimals++;
    return mill_summary_text("%.*f +- %.*f %s%s", scale.decimals, mean->value / scale.one,
                             scale.decimals, mean->error / scale.one, scale.prefix, unit);
}

/* A value on the scale of its column; what rounds to 0 but is not 0 gets a "<". */
static const char *cell(double value, struct scale scale)
{
    const double least = pow(10, -scale.decimals), shown = value / scale.one;
    if (isnan(value))
        return "-";
    return shown > 0 && shown < 0.5 * least ? mill_summary_text("<%.*f", scale.decimals, least)
                                            : mill_summary_text("%.*f", scale.decimals, shown);
}

void mill_summary_line(FILE *out, const char *label, const char *format, ...)
{
    va_list list;
    va_start(list, format);
    fprintf(out, "%-*s ", MILL_SUMMARY_LABEL, label);
    vfprintf(out, format, list);
    va_end(list);
}

/* ---- the mill ---- */

/* Prints number and mass of a species' balls, and the free volume that they fill; -1: of all */
static void print_species(const struct mill_world *world, int32_t species, FILE *out)
{
    const double room = mill_start_free_volume(world);
    double volume = 0, mass = 0;
    long count = 0;
    for (int32_t i = 0; i < world->balls; i++) {
        const struct mill_species *own = &world->species[world->ball[i].species];
        if (species >= 0 && world->ball[i].species != species)
            continue;
        volume += 4 * MILL_PI / 3 * pow(own->radius, 3);
        mass += own->mass;
        count++;
    }
    if (species < 0)
        mill_summary_line(out, "balls", "%ld, ", count);
    else
        mill_summary_line(out, world->species[species].name, "%ld of %s, ", count,
                          mill_summary_si(2 * world->species[species].radius, "m"));
    fprintf(out, "%s", mill_summary_si(1e3 * mass, "g"));
    if (room > 0)
        fprintf(out,
                species < 0 ? ": %.3g %% of the free room, %.3g %% with 40 %% voids"
                            : ": %.3g %%, %.3g %% with voids",
                100 * volume / room, 100 * volume / (room * MILL_START_PACKING));
    fputc('\n', out);
}

/* Sets the highest speed and acceleration of points of a motion, at MOMENTS of a period. Edges of
 * parts that stick out of the drum are where no ball is. */
static void find_highest(const struct mill_world *world, const struct mill_motion *motion,
                         const struct mill_mesh *mesh, double *speed, double *acceleration)
{
    const double period = isfinite(world->period) ? world->period : 1, step = 1e-4 * period;
    for (int k = 0; k < MOMENTS; k++)
        for (size_t i = 0; i < mesh->points; i++) {
            const double t = k * period / MOMENTS;
            vec3 v[3];
            const vec3 at = mill_motion_point(motion, t, mesh->point[i], &v[0]);
            if (world->container.drum && hypot(at.y, at.z) > 1.0001 * world->drum_radius)
                continue;
            mill_motion_point(motion, t - step, mesh->point[i], &v[1]);
            mill_motion_point(motion, t + step, mesh->point[i], &v[2]);
            *speed = fmax(*speed, vec3_norm(v[0]));
            *acceleration = fmax(*acceleration, vec3_norm(vec3_sub(v[2], v[1])) / (2 * step));
        }
}

/* Prints the highest speed and acceleration of the surfaces of each motion; of a drum that turns
 * about its own axis also the critical speed and the filling J. */
static void print_motions(const struct mill_world *world, const struct mill_deck *deck, FILE *out)
{
    const double g = vec3_norm(world->g), rpm = 30 / MILL_PI;
    for (int k = 0; k < world->motions; k++) {
        struct mill_mesh mesh = {0};
        double speed = 0, acceleration = 0;
        for (int i = 0; i < world->shapes; i++)
            if (world->shape[i]->motion == world->motion[k])
                mill_outline_draw(world->shape[i], 1e-2 * world->drum_radius, &mesh);
        find_highest(world, world->motion[k], &mesh, &speed, &acceleration);
        speed = mesh.failed ? (double)NAN : speed; /* out of memory: it is not known */
        mill_mesh_free(&mesh);
        if (speed == 0)
            continue;
        mill_summary_line(out, world->motion_name[k], "%s %s",
                          k == world->rotor ? "tip speed" : "surfaces at up to",
                          mill_summary_si(speed, "m/s"));
        if (g > 0)
            fprintf(out, ", Froude number %.3g", acceleration / g);
        fputc('\n', out);
        if (deck && k == deck->mill.carrier && deck->mill.critical > 0)
            mill_summary_line(
                out, "", "N %.3g rpm, %.3g %% of critical (%.3g rpm, D less d); J %.3g %%\n",
                deck->mill.share * deck->mill.critical * rpm, 100 * deck->mill.share,
                deck->mill.critical * rpm,
                100 * deck->mill.volume / MILL_START_PACKING / world->container.volume);
    }
}

/* Writes what a law takes from materials: ", restitution 0.9, friction 0.2" */
static void say_law(const struct mill_deck *deck, int kind, char text[2 * TEXT])
{
    const struct mill_deck_contact *is = &deck->mill.contact[kind];
    const struct mill_deck_law *law = &is->law;
    const struct mill_fall fall = mill_deck_laws_fall(law);
    const char *how = fall.points > 1    ? ", restitution %.3g..%.3g"
                      : fall.points == 1 ? ", restitution %.3g at %.3g m/s"
                                         : ", restitution %.3g";
    size_t used = 0;
    text[0] = '\0';
    if (is->takes.restitution)
        used += (size_t)snprintf(
            text, 2 * TEXT, how, fall.points > 1 ? fall.restitution[0] : law->restitution,
            fall.points > 1 ? fall.restitution[fall.points - 1] : fall.speed[0]);
    if (is->takes.friction)
        used += (size_t)snprintf(text + used, 2 * TEXT - used, ", friction %.3g", law->friction);
    if (is->takes.tangential)
        snprintf(text + used, 2 * TEXT - used, ", tangential %.3g", law->tangential);
}

/* Prints what contact laws take from materials, each once. */
static void print_laws(const struct mill_deck *deck, FILE *out)
{
    const struct mill_deck_contact *contact = deck->mill.contact;
    char text[2 * TEXT], one[2 * TEXT];
    for (int kind = 0; kind < deck->mill.contacts.count; kind++) {
        bool said = !contact[kind].assumed[0];
        say_law(deck, kind, text);
        for (int k = 0; k < kind && !said; k++) {
            say_law(deck, k, one);
            said = strcmp(contact[k].assumed, contact[kind].assumed) == 0 && strcmp(one, text) == 0;
        }
        if (said)
            continue;
        mill_summary_line(out, "contacts", "assumed: %s\n", text + strlen(", "));
        mill_summary_line(out, "", "%s\n", contact[kind].assumed);
    }
}

void mill_summary_mill(const struct mill_world *world, const struct mill_deck *deck, FILE *out)
{
    print_species(world, -1, out);
    for (int32_t k = 0; k < world->species_count && world->species_count > 1 && k < LISTED; k++)
        print_species(world, k, out);
    if (world->species_count > LISTED)
        mill_summary_line(out, "", "and %d more kinds\n", (int)world->species_count - LISTED);
    print_motions(world, deck, out);
    if (deck)
        print_laws(deck, out);
}

/* ---- the table: one unit a column ---- */

static struct scale scale_of(double value, const char *unit)
{
    struct scale scale = {1, "", 3};
    if (value > 0)
        fits(value, unit, &scale);
    return scale;
}

/* Is the row shown in the table? Kinds without contacts are left out. */
static bool is_shown(const struct mill_tally_results *r, int n)
{
    return n == r->kinds.count || r->impacts[r->kinds.kind[n]].count > 0;
}

void mill_summary_table(const struct mill_summary *s)
{
    const struct mill_tally_results *r = s->results;
    const struct mill_tally_row *all = &r->impacts[r->all], *strikes = &r->strikes[r->all];
    const struct scale rate = scale_of(all->rate, "/s"), power = scale_of(all->power, "W");
    const struct scale share = {1, "", 1};
    char unit[4][TEXT];
    int name = 10;      /* width of the names */
    double fastest = 0; /* in the table */
    for (int n = 0; n <= r->kinds.count; n++) {
        const struct mill_tally_speed *v = &r->impacts[r->kinds.kind[n]].normal;
        const int width = (int)strlen(r->kinds.name[n]);
        name = is_shown(r, n) && width > name ? width : name;
        fastest = fmax(fastest, fmax(v->mean, v->median_fast)); /* fmax ignores NaN */
    }
    const struct scale speed = scale_of(fastest, "m/s");
    snprintf(unit[0], TEXT, "%s/s", rate.prefix);
    snprintf(unit[1], TEXT, "%sm/s", speed.prefix);
    snprintf(unit[2], TEXT, "%sW", power.prefix);
    snprintf(unit[3], TEXT, ">%.3g", r->above_floor / speed.one);
    const char *const head[3][7] = {{"", "rate", "median", "median", "mean", "at the", "power"},
                                    {"", "", "v_n", unit[3], "v_n", "floor", "lost"},
                                    {"impacts", unit[0], unit[1], unit[1], unit[1], "%", unit[2]}};
    fputc('\n', s->out);
    for (int i = 0; i < 3; i++)
        fprintf(s->out, "%-*s %12s %11s %8s %9s %8s %6s %9s\n", name, i < 2 ? "" : "kind",
                head[i][0], head[i][1], head[i][2], head[i][3], head[i][4], head[i][5], head[i][6]);
    for (int n = 0; n <= r->kinds.count; n++) {
        const int kind = r->kinds.kind[n];
        const struct mill_tally_row *row = &r->impacts[kind];
        if (is_shown(r, n))
            fprintf(s->out, "%-*s %12llu %11s %8s %9s %8s %6s %9s\n", name, r->kinds.name[n],
                    (unsigned long long)row->count, cell(row->rate, rate),
                    cell(row->normal.median, speed), cell(row->normal.median_fast, speed),
                    cell(row->normal.mean, speed), cell(100 * r->floor_share[kind], share),
                    cell(row->power, power));
    }
    if (r->tally->pairs.window > 0)
        fprintf(s->out, "%-*s %12llu %11s  impacts of a pair within %s are one\n", name, "strikes",
                (unsigned long long)strikes->count, cell(strikes->rate, rate),
                mill_summary_si(r->tally->pairs.window, "s"));
    fputc('\n', s->out);
}
