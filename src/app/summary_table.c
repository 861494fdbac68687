/* Numbers as texts; the mill as a few lines, and its impacts as a table: a row for each kind, one
 * unit a column. */
#include "app/summary.h"
#include "geometry/mesh.h"
#include "millsim/start.h"
#include "observe/outline.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { TEXT = MILL_SUMMARY_TEXT };
#define RANDOM_PACKING 0.6 /* share that balls fill in a heap of balls: bulk density / density */

/* ---- numbers as texts ---- */

char *mill_summary_text_room(void)
{
    static char texts[8][TEXT];
    static unsigned turn;
    return texts[turn++ % 8];
}

/* Numbers of things and their rates have words: "M/s" would look like metres per second. */
static bool is_counted(const char *unit)
{
    return !*unit || strcmp(unit, "/s") == 0 || strcmp(unit, "/J") == 0;
}

bool mill_summary_text_fits(double value, const char *unit, struct mill_summary_scale *scale)
{
    static const char *const prefix[] = {"p", "n", "u", "m", "", "k", "M", "G", "T"};
    static const char *const word[] = {"", "thousand", "million", "billion", "trillion"};
    char digits[TEXT];
    if (isinf(value))
        return false;
    snprintf(digits, sizeof digits, "%.3e", value); /* round first: 999.96 becomes 1.000 k */
    const int exponent = value == 0 ? 0 : atoi(strchr(digits, 'e') + 1);
    if (exponent < -12 || exponent > 14)
        return false;
    int thousands = (exponent + 15) / 3 - 5; /* division rounded towards minus infinity */
    thousands = is_counted(unit) && thousands < 0 ? 0 : thousands;
    *scale = (struct mill_summary_scale){.one = pow(10, 3 * thousands),
                                         .prefix = is_counted(unit) ? word[thousands]
                                                                    : prefix[thousands + 4],
                                         .decimals = 3 - (exponent - 3 * thousands)};
    return true;
}

const char *mill_summary_text_si(double value, const char *unit)
{
    struct mill_summary_scale scale;
    char *text = mill_summary_text_room();
    if (isnan(value))
        snprintf(text, TEXT, "-");
    else if (value == 0)
        snprintf(text, TEXT, "0%s%s", *unit ? " " : "", unit);
    else if (!*unit && value < 1000 && value == floor(value)) /* a count */
        snprintf(text, TEXT, "%.0f", value);
    else if (!mill_summary_text_fits(value, unit, &scale))
        snprintf(text, TEXT, "%.3e %s", value, unit);
    else
        snprintf(text, TEXT, "%.*f%s%s%s", scale.decimals, value / scale.one,
                 *scale.prefix || *unit ? " " : "", scale.prefix, unit);
    return text;
}

const char *mill_summary_text_cell(double value, struct mill_summary_scale scale)
{
    const double least = pow(10, -scale.decimals), shown = value / scale.one;
    char *text = mill_summary_text_room();
    if (isnan(value))
        return "-";
    if (shown > 0 && shown < 0.5 * least)
        snprintf(text, TEXT, "<%.*f", scale.decimals, least);
    else
        snprintf(text, TEXT, "%.*f", scale.decimals, shown);
    return text;
}

void mill_summary_text_value(FILE *out, const struct mill_precision_mean *mean, const char *unit)
{
    struct mill_summary_scale scale;
    const double most = fmax(fabs(mean->value), mean->error);
    const bool known =
        !isnan(mean->value) && !isnan(mean->error) && mill_summary_text_fits(most, unit, &scale);
    while (known && mean->error > 0 && scale.decimals < 9 &&
           mean->error / scale.one < pow(10, -scale.decimals))
        scale.decimals++;
    if (known)
        fprintf(out, "%.*f +- %.*f %s%s", scale.decimals, mean->value / scale.one, scale.decimals,
                mean->error / scale.one, scale.prefix, unit);
    else
        fprintf(out, "%s", mill_summary_text_si(mean->value, unit));
}

void mill_summary_text_label(FILE *out, const char *label)
{
    fprintf(out, "%-*s ", MILL_SUMMARY_LABEL, label);
}

/* ---- the mill ---- */

/* Prints number and mass of the balls, and how much of the free volume they fill. */
static void print_balls(const struct mill_world *world, const char *lead, FILE *out)
{
    const double room = mill_start_free_volume(world);
    const double mass = mill_summary_mass(world);
    double volume = 0;
    for (int32_t i = 0; i < world->balls; i++)
        volume += 4 * MILL_PI / 3 * pow(world->species[world->ball[i].species].radius, 3);
    fputs(lead, out);
    mill_summary_text_label(out, "balls");
    fprintf(out, "%ld, %s", (long)world->balls, mill_summary_text_si(1e3 * mass, "g"));
    if (room > 0)
        fprintf(out, ": %.3g %% of the free room, %.3g %% with 40 %% voids", 100 * volume / room,
                100 * volume / (room * RANDOM_PACKING));
    fputc('\n', out);
}

/* Prints the highest speed and acceleration of the surfaces of each motion. */
static void print_motions(const struct mill_world *world, const char *lead, FILE *out)
{
    const double g = vec3_norm(world->g);
    for (int k = 0; k < world->motions; k++) {
        struct mill_mesh mesh = {0};
        double speed = 0, acceleration = 0;
        for (int i = 0; i < world->shapes; i++)
            if (world->shape[i]->motion == world->motion[k])
                mill_outline_draw(world->shape[i], 1e-2 * world->drum_radius, &mesh);
        for (size_t i = 0; i < mesh.points; i++) {
            const struct mill_motion_bounds b = mill_motion_bounds(world->motion[k], mesh.point[i]);
            speed = fmax(speed, b.speed);
            acceleration = fmax(acceleration, b.acceleration);
        }
        speed = mesh.failed ? (double)NAN : speed; /* out of memory: it is not known */
        mill_mesh_free(&mesh);
        if (speed == 0)
            continue;
        fputs(lead, out);
        mill_summary_text_label(out, world->motion_name[k]);
        fprintf(out, "%s %s", k == world->rotor ? "tip speed" : "surfaces at up to",
                mill_summary_text_si(speed, "m/s"));
        if (g > 0)
            fprintf(out, ", Froude number %.3g", acceleration / g);
        fputc('\n', out);
    }
}

/* Writes what the law of a kind of contact takes from materials: ", restitution 0.9, friction 0.2"
 */
static void say_law(const struct mill_deck *deck, int kind, char text[2 * TEXT])
{
    const struct mill_deck_law *law = &deck->mill.contact[kind].law;
    const struct mill_deck_takes *takes = &deck->mill.contact[kind].takes;
    const struct mill_fall fall = mill_deck_laws_fall(law);
    const char *how = fall.points > 1    ? ", restitution %.3g..%.3g"
                      : fall.points == 1 ? ", restitution %.3g at %.3g m/s"
                                         : ", restitution %.3g";
    size_t used = 0;
    text[0] = '\0';
    if (takes->restitution)
        used += (size_t)snprintf(
            text, 2 * TEXT, how, fall.points > 1 ? fall.restitution[0] : law->restitution,
            fall.points > 1 ? fall.restitution[fall.points - 1] : fall.speed[0]);
    if (takes->friction)
        used += (size_t)snprintf(text + used, 2 * TEXT - used, ", friction %.3g", law->friction);
    if (takes->tangential)
        snprintf(text + used, 2 * TEXT - used, ", tangential %.3g", law->tangential);
}

/* Prints what contact laws take from materials, each once. */
static void print_laws(const struct mill_deck *deck, const char *lead, FILE *out)
{
    char text[2 * TEXT], other[2 * TEXT];
    for (int kind = 0; kind < deck->mill.contacts.count; kind++) {
        bool said = !deck->mill.contact[kind].assumed[0];
        say_law(deck, kind, text);
        for (int k = 0; k < kind && !said; k++) {
            say_law(deck, k, other);
            said = strcmp(deck->mill.contact[k].assumed, deck->mill.contact[kind].assumed) == 0 &&
                   strcmp(other, text) == 0;
        }
        if (said)
            continue;
        fputs(lead, out);
        mill_summary_text_label(out, "contacts");
        fprintf(out, "assumed: %s\n%s", text + strlen(", "), lead);
        mill_summary_text_label(out, "");
        fprintf(out, "%s\n", deck->mill.contact[kind].assumed);
    }
}

void mill_summary_mill(const struct mill_world *world, const struct mill_deck *deck,
                       const char *lead, FILE *out)
{
    print_balls(world, lead, out);
    print_motions(world, lead, out);
    if (deck)
        print_laws(deck, lead, out);
}

double mill_summary_mass(const struct mill_world *world)
{
    double mass = 0;
    for (int32_t i = 0; i < world->balls; i++)
        mass += world->species[world->ball[i].species].mass;
    return mass;
}

/* ---- the table: one unit a column ---- */

/* Name, and units with their decimals, of the columns of rates, speeds and powers */
struct columns {
    int name;
    struct mill_summary_scale rate, speed, power;
};

static struct mill_summary_scale scale_of(double value, const char *unit)
{
    struct mill_summary_scale scale = {1, "", 3};
    if (value > 0)
        mill_summary_text_fits(value, unit, &scale);
    return scale;
}

static void print_row(FILE *out, const struct mill_tally_results *r, int n, const struct columns *c)
{
    const struct mill_tally_row *row = &r->impacts[r->kinds.kind[n]];
    const double floored = 100 * r->floor_share[r->kinds.kind[n]];
    fprintf(out, "%-*s %12llu %11s %8s %9s %8s %6s %9s\n", c->name, r->kinds.name[n],
            (unsigned long long)row->count, mill_summary_text_cell(row->rate, c->rate),
            mill_summary_text_cell(row->normal.median, c->speed),
            mill_summary_text_cell(row->normal.median_fast, c->speed),
            mill_summary_text_cell(row->normal.mean, c->speed),
            mill_summary_text_cell(floored, (struct mill_summary_scale){1, "", 1}),
            mill_summary_text_cell(row->power, c->power));
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
    struct columns c = {10, scale_of(all->rate, "/s"), {1, "", 3}, scale_of(all->power, "W")};
    char unit[3][TEXT];
    double fastest = 0; /* in the table */
    for (int n = 0; n <= r->kinds.count; n++) {
        const struct mill_tally_speed *speed = &r->impacts[r->kinds.kind[n]].normal;
        const int width = (int)strlen(r->kinds.name[n]);
        c.name = is_shown(r, n) && width > c.name ? width : c.name;
        fastest = fmax(fastest, fmax(speed->mean, speed->median_fast)); /* fmax ignores NaN */
    }
    c.speed = scale_of(fastest, "m/s");
    snprintf(unit[0], TEXT, "%s/s", c.rate.prefix);
    snprintf(unit[1], TEXT, "%sm/s", c.speed.prefix);
    snprintf(unit[2], TEXT, "%sW", c.power.prefix);
    const char *const head[3][7] = {{"", "rate", "median", "median", "mean", "at the", "power"},
                                    {"", "", "v_n", ">50 mm/s", "v_n", "floor", "lost"},
                                    {"impacts", unit[0], unit[1], unit[1], unit[1], "%", unit[2]}};
    fputc('\n', s->out);
    for (int i = 0; i < 3; i++)
        fprintf(s->out, "%-*s %12s %11s %8s %9s %8s %6s %9s\n", c.name, i < 2 ? "" : "kind",
                head[i][0], head[i][1], head[i][2], head[i][3], head[i][4], head[i][5], head[i][6]);
    for (int n = 0; n <= r->kinds.count; n++)
        if (is_shown(r, n))
            print_row(s->out, r, n, &c);
    if (r->tally->pairs.window > 0)
        fprintf(s->out, "%-*s %12llu %11s  impacts of a pair within %s are one\n", c.name,
                "strikes", (unsigned long long)strikes->count,
                mill_summary_text_cell(strikes->rate, c.rate),
                mill_summary_text_si(r->tally->pairs.window, "s"));
    fputc('\n', s->out);
}
