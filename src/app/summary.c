/* The results of a run for standard output, in at most 80 columns: the mill and its balls, what it
 * does, impacts by kind in the sampled window, the health of the solver, cost, a short summary. */
#include "app/summary.h"
#include "observe/sink_json.h"

enum { ABOVE_1 = 1 }; /* mill_world_fast[1] is 1 m/s */

/* ---- accuracy of the results: for runs with run.precision ---- */

/* "+- 1.3 %" */
static const char *error_of(const struct mill_spread_mean *mean)
{
    const double error = mean->value != 0 ? mean->error / fabs(mean->value) : (double)NAN;
    return isnan(error) ? "unknown" /* or the value is 0 */
                        : mill_summary_text(error < 10 ? "+- %.2g %%" : "+- %.0f %%", 100 * error);
}

static const char *say_known(const struct mill_precision_known *known)
{
    return mill_summary_text("median %s%s%s", error_of(&known->median_fast),
                             known->idle ? "" : ", power ",
                             known->idle ? "" : error_of(&known->drive));
}

const char *mill_summary_known(const struct mill_observers *observers)
{
    const struct mill_tally *tally = mill_observers_tally(observers);
    if (tally->asked.precision == 0)
        return "";
    return tally->at.settled && tally->at.known.enough ? say_known(&tally->at.known) : "start-up";
}

/* Prints what was cut off and why the run ended; nothing if only its time could end it. */
static void print_end(const struct mill_summary *s)
{
    const struct mill_tally_results *r = s->results;
    const char *time = mill_summary_si(s->facts->time, "s");
    const bool open = r->tally->asked.precision == 0 && r->tally->collisions == UINT64_MAX;
    if (r->tally->search && r->begin > 0)
        fprintf(s->out, "left out the first %s (%s by MSER-5)%s", mill_summary_si(r->begin, "s"),
                r->at.settled ? "start-up" : "best guess of the start-up", open ? "\n" : ", ");
    if (open && r->tally->search && r->at.open && r->begin == 0 &&
        r->at.over < MILL_TALLY_TURNS * s->world->period && isfinite(s->world->period))
        fprintf(s->out, "the start-up is included: the run is shorter than ten periods\n");
    if (open)
        return;
    if (r->tally->at.ended == MILL_TALLY_PRECISION)
        fprintf(s->out, "ended at %s", time);
    else if (strcmp(s->facts->status, "stopped") == 0)
        fprintf(s->out, "stopped at %s", time);
    else if (r->tally->at.ended == MILL_TALLY_COLLISIONS)
        fprintf(s->out, "run.max_collisions = %s reached at %s",
                mill_summary_si((double)r->tally->collisions, ""), time);
    else
        fprintf(s->out, "run.time = %s reached", time);
    if (r->tally->asked.precision > 0)
        fprintf(s->out, ": %s",
                r->doubt != MILL_TALLY_KNOWN ? "no errors are known"
                : !r->at.settled             ? "the start-up may not be over"
                : r->at.known.enough         ? say_known(&r->at.known)
                                             : "too short for errors of median and power");
    if (r->tally->asked.precision > 0 && !r->reached)
        fprintf(s->out, "; requested: %.2g %%", 100 * r->tally->asked.precision);
    fputc('\n', s->out);
}

/* ---- what the mill does ---- */

/* Prints what the motions do; for a single rotor in the words for a rotor */
static void print_drive(const struct mill_summary *s)
{
    const struct mill_tally_results *r = s->results;
    const struct mill_world *world = s->world;
    const struct mill_precision_known *known = &r->at.known;
    const bool rotor = world->motions == 1 && world->rotor == 0;
    const double times = r->duration / r->tally->starts / world->period;
    double mass = 0;
    for (int32_t i = 0; i < world->balls; i++)
        mass += world->species[world->ball[i].species].mass;
    const struct mill_spread_mean by_kg = {known->drive.value / mass, known->drive.error / mass, 0};
    mill_summary_line(s->out, rotor ? "rotor power" : "drive power", "%s, %s of balls\n",
                      mill_summary_mean(&known->drive, "W"), mill_summary_mean(&by_kg, "W/kg"));
    if (isnan(known->drive.error) && r->doubt == MILL_TALLY_KNOWN) {
        mill_summary_line(s->out, "", "(its error is not known: %.3g %s%s", times,
                          rotor ? "revolution" : "period", fabs(times - 1) < 5e-3 ? "" : "s");
        if (times < MILL_SPREAD_PERIODS)
            fprintf(s->out, ", %d needed", MILL_SPREAD_PERIODS);
        fprintf(s->out, ")\n");
    }
    if (rotor || (world->motions == 1 && !isnan(known->motion_torque[0].value)))
        mill_summary_line(s->out, rotor ? "rotor torque" : "drive torque", "%s\n",
                          mill_summary_mean(&known->motion_torque[0], "N m"));
    for (int k = 0; world->motions > 1 && k < world->motions; k++) {
        const bool turns = !isnan(known->motion_torque[k].value);
        mill_summary_line(s->out, world->motion_name[k], "%s%s%s\n",
                          mill_summary_mean(&known->motion_power[k], "W"), turns ? ", torque " : "",
                          turns ? mill_summary_mean(&known->motion_torque[k], "N m") : "");
    }
    if (r->pinch_power > 0)
        mill_summary_line(
            s->out, "pinches", "%s (%.2g %%) go to balls that parts press; harmless below 20 %%\n",
            mill_summary_si(r->pinch_power, "W"), 100 * r->pinch_power / known->drive.value);
}

/* Prints where the power goes: by direction, and by kind, the largest first. */
static void print_losses(const struct mill_summary *s)
{
    const struct mill_tally_results *r = s->results;
    const struct mill_spread_mean *loss = r->at.known.loss;
    const double all = loss[r->all].value, normal = r->at.known.loss_normal[r->all].value / all;
    int order[MILL_KINDS_MOST]; /* of the kinds, by loss */
    int column = MILL_SUMMARY_LABEL;
    if (!(all > 0))
        return;
    mill_summary_line(s->out, "losses", "%.1f %% by sliding, %.1f %% along the normal\n",
                      100 * (1 - normal), 100 * normal);
    mill_summary_line(s->out, "", "%s", "");
    for (int kind = 0; kind < r->all; kind++) {
        int n = kind;
        for (; n > 0 && loss[order[n - 1]].value < loss[kind].value; n--)
            order[n] = order[n - 1];
        order[n] = kind;
    }
    for (int n = 0; n < r->all; n++) {
        const int most = order[n];
        if (!(loss[most].value >= 5e-4 * all)) /* 0.0 % */
            break;
        const int width = (int)strlen(s->world->kinds.name[most]) + 9;
        if (n > 0 && column + width > MILL_SUMMARY_WIDTH) {
            fprintf(s->out, ",\n");
            mill_summary_line(s->out, "", "%s", "");
            column = MILL_SUMMARY_LABEL;
        } else if (n > 0) {
            fprintf(s->out, ", ");
        }
        column += width + 2;
        fprintf(s->out, "%.1f %% %s", 100 * loss[most].value / all, s->world->kinds.name[most]);
    }
    fputc('\n', s->out);
}

/* A rate of impacts. Of a few, only their number is known. */
static const char *text_rate(const struct mill_spread_mean *rate, double time)
{
    const double count = rate->value * time;
    return count > 0.5 && count < MILL_SPREAD_SEEN - 0.5
               ? mill_summary_text("%.0f seen in %s,", count, mill_summary_si(time, "s"))
               : mill_summary_mean(rate, "/s");
}

/* Prints the hard impacts: those that were asked for, or those that lose half of the energy. */
static void print_hard(const struct mill_summary *s)
{
    const struct mill_tally_results *r = s->results;
    const struct mill_precision_known *known = &r->at.known;
    const char *sort = mill_energies_sums.sum[r->is_hard.sort].name;
    if (isnan(r->is_hard.energy)) {
        mill_summary_line(s->out, "fast impacts", "%s at 1 m/s or more\n",
                          text_rate(&known->fast[r->all][ABOVE_1], r->duration));
        return;
    }
    mill_summary_line(s->out, "hard impacts", "%s of %s%s%s or more%s\n",
                      text_rate(&r->hard, r->duration), mill_summary_si(r->is_hard.energy, "J"),
                      r->is_hard.sort > 0 ? " " : "", r->is_hard.sort > 0 ? sort : "",
                      isnan(r->tally->asked.hard) ? ": half the losses" : "");
    if (r->hard_per_joule.value * known->drive.value * r->duration > MILL_SPREAD_SEEN - 0.5)
        mill_summary_line(s->out, "", "%s of work of the drive\n",
                          mill_summary_mean(&r->hard_per_joule, "/J"));
}

/* Prints where the charge of a tumbling mill is: "146.4 +- 3.3", "-" for NaN. Angles are printed
 * also as Morrell counts them, from 3 o'clock. */
static void print_charge(const struct mill_summary *s)
{
    const char *t[MILL_CHARGE_FLIGHT + 1], *morrell[MILL_CHARGE_FLIGHT + 1];
    for (int i = 0; i <= MILL_CHARGE_FLIGHT; i++) {
        const double times = i == MILL_CHARGE_FLIGHT ? 100 : 180 / MILL_PI;
        const double value = times * s->results->charge[i].value;
        const double error = times * s->results->charge[i].error;
        const int digits = error < 0.1 ? 2 : 1;
        t[i] = isnan(value)   ? "-"
               : isnan(error) ? mill_summary_text("%.1f", value)
                              : mill_summary_text("%.*f +- %.*f", digits, value, digits, error);
        morrell[i] = isnan(value) ? "-" : mill_summary_text("%.0f", fmod(value + 630, 360));
    }
    if (!s->results->tally->charge.world)
        return;
    mill_summary_line(s->out, "charge", "toe %s deg, shoulder %s deg from 6 o'clock\n", t[0], t[1]);
    mill_summary_line(s->out, "", "(as Morrell counts %s, %s), repose %s deg, %s %% in flight\n",
                      morrell[0], morrell[1], t[2], t[3]);
}

static void print_means(const struct mill_summary *s)
{
    const struct mill_tally_results *r = s->results;
    const struct mill_precision_known *known = &r->at.known;
    if (s->world->period < (double)INFINITY)
        print_drive(s);
    print_charge(s);
    print_hard(s);
    mill_summary_line(s->out, "median v_n", "%s above %s, %s of all\n",
                      mill_summary_mean(&known->median_fast, "m/s"),
                      mill_summary_text("%.3g mm/s", 1e3 * r->above_floor),
                      mill_summary_mean(&known->median, "m/s"));
    if (known->median.value < r->above_floor && r->above_floor > 1.01 * MILL_TALLY_FAST)
        mill_summary_line(s->out, "", "(of all: set by the rebound floor of %s)\n",
                          mill_summary_si(s->world->rebound_floor, "m/s"));
    print_losses(s);
}

static void print_window(const struct mill_summary *s)
{
    const struct mill_tally_results *r = s->results;
    const bool rotor = s->world->motions == 1 && s->world->rotor == 0;
    const bool apart = r->tally->starts >= MILL_SPREAD_SEVERAL;
    const double each = r->duration / r->tally->starts, times = each / s->world->period;
    mill_summary_line(s->out, "sampled", "for %s, from %s to %s", mill_summary_si(each, "s"),
                      mill_summary_si(r->begin, "s"), mill_summary_si(r->begin + each, "s"));
    if (times > 0)
        fprintf(s->out, " (%.3g %s%s)", times, rotor ? "revolution" : "period",
                fabs(times - 1) < 5e-3 ? "" : "s");
    if (r->tally->starts > 1)
        fprintf(s->out, ", in %d starts", r->tally->starts);
    fputc('\n', s->out);
    print_end(s);
    if (r->doubt == MILL_TALLY_KNOWN && r->at.known.batches < (apart ? 1 : MILL_SPREAD_FEWEST))
        mill_summary_line(s->out, "", "no errors are known: the window is too short\n\n");
    else if (r->doubt == MILL_TALLY_KNOWN)
        mill_summary_line(s->out, "", "+- is one standard error, from %d %s\n\n",
                          r->tally->starts * (apart ? 1 : MILL_SPREAD_PIECES),
                          apart ? "starts" : "pieces of this time");
    else
        mill_summary_line(s->out, "", "no errors are given: see the note\n\n");
}

static void print_anomalies(FILE *out, const struct mill_counts *counts, double balance_error)
{
    const struct {
        uint64_t count;
        const char *what;
    } list[] = {{counts->not_closing, "contacts with an opening gap"},
                {counts->reliefs, "pinched balls released"},
                {counts->smoothed, "contacts without friction"},
                {!isfinite(balance_error), "energies that are not numbers"},
                {counts->overlaps, "overlaps"}};
    const char *comma = "";
    for (size_t i = 0; i < sizeof list / sizeof *list; i++)
        if (list[i].count > 0) {
            fprintf(out, "%s\n", comma);
            mill_summary_line(out, "", "%llu %s", (unsigned long long)list[i].count, list[i].what);
            comma = ",";
        }
    if (counts->overlaps > 0)
        fprintf(out, " (up to %s)", mill_summary_si(counts->largest_overlap, "m"));
    fprintf(out, *comma ? "\n" : " none\n");
}

static void print_soft(const struct mill_summary *s)
{
    const struct mill_soft_facts *facts = &s->world->soft_facts;
    mill_summary_line(s->out, "soft spheres", "modulus %s, steps of %s",
                      mill_summary_si(s->world->soft.modulus, "Pa"),
                      mill_summary_si(facts->step, "s"));
    fprintf(s->out, ", pressed in by up to %s\n",
            mill_summary_si(s->world->counts.largest_overlap, "m"));
    if (facts->contacts > 0)
        mill_summary_line(s->out, "", "%.0f %% of the contacts beside another one of the ball\n",
                          100.0 * (double)facts->crowded / (double)facts->contacts);
}

static void print_state(const struct mill_summary *s, const struct mill_totals *totals)
{
    if (s->world->soft.on)
        print_soft(s);
    mill_summary_line(s->out, "kinetic energy", "%s at the end, and %s in the balls' spin\n",
                      mill_summary_si(totals->energy.kinetic, "J"),
                      mill_summary_si(totals->energy.rotational, "J"));
    if (s->world->counts.asleep > 0)
        mill_summary_line(s->out, "at rest", "%lld of %ld balls asleep at the end\n",
                          (long long)s->world->counts.asleep, (long)s->world->balls);
    mill_summary_line(s->out, "solver", "energy error %s of %s",
                      mill_summary_si(totals->balance_error, "J"),
                      mill_summary_si(totals->turnover, "J"));
    if (totals->turnover > 0)
        fprintf(s->out, " (%.1e)", totals->balance_error / totals->turnover);
    fprintf(s->out, "; anomalies:");
    print_anomalies(s->out, &s->world->counts, totals->balance_error);
}

/* Prints "note: ...", with line breaks between words */
static void print_note(FILE *out, const char *text)
{
    int column = fprintf(out, "note:");
    while (*text) {
        const int word = (int)strcspn(text, " ");
        if (column + 1 + word > MILL_SUMMARY_WIDTH)
            column = fprintf(out, "\n     ") - 1;
        column += fprintf(out, " %.*s", word, text);
        text += word;
        text += strspn(text, " ");
    }
    fputc('\n', out);
}

static void print_all(const struct mill_summary *s)
{
    const struct mill_facts *facts = s->facts;
    const struct mill_totals totals = facts->totals;
    const double wall = facts->cost.wall, cpu = facts->cost.cpu;
    const unsigned long long anomalies = totals.anomalies;
    const int starts = s->results->tally->starts;
    char threads[32] = "", many[32] = "";
    if (starts > 1)
        snprintf(many, sizeof many, "%d starts of ", starts);
    if (facts->threads > 1)
        snprintf(threads, sizeof threads, " of %d threads", facts->threads);
    mill_summary_mill(s->world, s->deck, s->out);
    print_window(s);
    print_means(s);
    mill_summary_table(s);
    print_state(s, &totals);
    mill_summary_line(s->out, "speed", "%s contacts per CPU second, %s simulated per s\n",
                      mill_summary_si(cpu > 0 ? (double)totals.contacts / cpu : (double)NAN, ""),
                      mill_summary_si(wall > 0 ? starts * facts->time / wall : (double)NAN, "s"));
    mill_summary_line(s->out, "cost", "%s wall, %s CPU%s, %s memory at most\n",
                      mill_summary_si(wall, "s"), mill_summary_si(cpu, "s"), threads,
                      mill_summary_si(facts->peak_memory, "B"));
    mill_summary_line(s->out, "output", "%s", "");
    mill_record_name(s->out, facts->output);
    fputc('\n', s->out);
    for (int i = 0; i < s->notes.count; i++)
        if (s->notes.note[i].text[0])
            print_note(s->out, s->notes.note[i].text);
    fprintf(s->out, "\nmillsim %s ", facts->version);
    mill_record_name(s->out, facts->deck);
    fprintf(s->out, ": %s%.6g s in %s wall, ", many, facts->time, mill_summary_si(wall, "s"));
    if (anomalies > 0)
        fprintf(s->out, "%llu anomal%s\n", anomalies, anomalies == 1 ? "y" : "ies");
    else
        fprintf(s->out, "no anomalies\n");
}

/* In SI units, each number to full precision, null for NaN and infinity: docs/file-format.md */
static enum mill_status print_json(const struct mill_summary *s, struct mill_error *error)
{
    struct mill_sink_json json;
    struct mill_sink *sink = &json.sink;
    const struct mill_facts *facts = s->facts;
    mill_sink_json_begin(&json, s->out);
    mill_tell_text(sink, "version", facts->version, "");
    mill_tell_text(sink, "deck", facts->deck, "");
    mill_tell_text(sink, "output", facts->output, "");
    mill_sink_json_next(&json, "stopped");
    fputs(strcmp(facts->status, "stopped") == 0 ? "true" : "false", s->out);
    mill_tell_number(sink, "time", facts->time, "s", "");
    mill_tell_number(sink, "sample_from", s->results->begin, "s", "");
    sink->open(sink, "run");
    mill_record_tell(s->world, facts, sink);
    mill_notes_tell(&s->notes, NULL, sink);
    sink->close(sink);
    sink->open(sink, "assumed");
    for (int kind = 0; s->deck && kind < s->deck->mill.contacts.count; kind++)
        if (s->deck->mill.contact[kind].assumed[0])
            mill_tell_text(sink, s->deck->mill.contacts.name[kind],
                           s->deck->mill.contact[kind].assumed, "");
    sink->close(sink);
    struct mill_tally_results *known = s->results;
    const enum mill_status status =
        mill_observers_results(s->observers, s->world, facts->local, sink, &known, error);
    mill_notes_write(&s->notes, sink);
    mill_sink_json_end(&json);
    return status;
}

enum mill_status mill_summary_write(struct mill_summary *s, bool json, struct mill_error *error)
{
    enum mill_status status = mill_tally_results_make(mill_observers_tally(s->observers), s->world,
                                                      s->facts->local, &s->results, error);
    if (status != MILL_OK)
        return status;
    mill_notes_take(&s->notes, s->world, s->results, s->facts->local,
                    strcmp(s->facts->status, "stopped") == 0, false);
    if (json)
        status = print_json(s, error);
    else
        print_all(s);
    mill_tally_results_free(s->results);
    return status;
}
