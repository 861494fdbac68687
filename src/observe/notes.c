/* Which results are not reliable, and why? Rules with fixed limits decide, from the account, the
 * contact laws and the statistics. The reason of each limit is given next to it. */
#include "observe/notes.h"

#include "geometry/shape.h"

#include <stdarg.h>
#include <stdio.h>

/* Down to these restitutions, beds with friction have been compared with soft spheres
 * (validation/referee, validation/dem). In a drum with bars, 30 % full, power, kinetic energy and
 * impacts above 0.5 m/s differ by at most 2 % at 0.8, 0.5 and 0.3. Where parts stir the charge, the
 * power differs by 7 to 15 % at 0.5, and the energy of the spin by a quarter. */
#define INELASTIC 0.3
#define INELASTIC_STIRRED 0.7
/* Part of the impacts at the rebound floor: from here on a stirred charge is a bed that rubs. In
 * attritors with 30 to 70 % of balls and voids the power differs from that of soft spheres by up to
 * 11 %, and impacts above 0.5 m/s are a fifth fewer (validation/referee/RESULTS-dense.md) */
#define RUBBING 0.1
/* A quarter more contacts than strikes: by so much the hard spheres' impacts on blades exceed those
 * of soft ones in the reference mill, until re-contacts are merged (validation/dem). */
#define RECONTACTS 0.2
/* The time between two hits of a ball is shorter than a contact. Soft spheres would then be in
 * permanent contact with several others, and the impacts of hard spheres do not exist in reality.
 * The reference mill reaches this limit when about 32 % of the drum are filled. */
#define AT_ONCE 1.0
#define UNSTEADY 0.05
/* Part of the drive's power that goes to pressed balls. At one half, it is within a tenth of that
 * of soft spheres of steel, but nearly twice that of softer spheres (validation/dem). */
#define PINCHED 0.2

/* Where a charge of one size rides on the wall nearly to the top, the hops at the rebound floor let
 * balls leave it too early, and the power is too large by 6 to 14 % (validation/tumbling). */
#define CARRIED (170.0 * MILL_PI / 180.0)

/* Mean speed along a periodic mill, relative to the balls' own speed. The mean of N balls that fly
 * at random is about sqrt(3 N) times slower than each of them. */
#define DRIFT 0.05
#define CHANCES 2.0

/* Soft spheres that are pressed together by more than this part of a diameter are other balls */
#define SOFT 0.05
/* [Pa] Below it rates of impacts differ from those of steel by a tenth and more (validation/dem) */
#define STIFF 1e11

/* Adds a rule's value; if `noted`, also its sentence. */
__attribute__((format(printf, 6, 7))) static void add(struct mill_notes *notes, const char *code,
                                                      double value, double limit, bool noted,
                                                      const char *format, ...)
{
    struct mill_note *note = &notes->note[notes->count++];
    va_list rest;
    *note = (struct mill_note){code, value, limit, ""};
    va_start(rest, format);
    if (noted)
        vsnprintf(note->text, sizeof note->text, format, rest);
    va_end(rest);
}

/* Does something move in the charge, besides the container and what moves with it? */
static bool is_stirred(const struct mill_world *world)
{
    for (int k = 0; k < world->shapes; k++)
        if (world->shape[k]->motion && world->shape[k]->motion != world->container.motion)
            return true;
    return false;
}

/* Lowest restitution of contacts with friction. met: only of kinds of contact that have occurred */
static void judge_law(struct mill_notes *notes, const struct mill_world *world, bool met)
{
    const double limit = is_stirred(world) ? INELASTIC_STIRRED : INELASTIC;
    int least = -1;
    for (int kind = 0; kind < world->kinds.count; kind++)
        if (world->law[kind].friction > 0 && (!met || world->account.collisions[kind] > 0) &&
            (least < 0 || world->law[kind].restitution < world->law[least].restitution))
            least = kind;
    const double value = least < 0 ? (double)NAN : world->law[least].restitution;
    add(notes, "restitution", value, limit, value < limit,
        "contacts with friction have a restitution of %.3g (%s): in a mill of this kind, hard "
        "spheres have been compared with soft ones from %.3g on. Below this, power and spin of a "
        "dense charge may differ by a tenth and more. Check it: mill check.",
        value, world->kinds.name[least < 0 ? 0 : least], limit);
}

/* How many hits on balls the contacts of a kind are. A ball that the wall of a moving container
 * presses makes small hops at the rebound floor, one contact of a soft ball: they do not count. */
static double hits_of(const struct mill_world *world, int kind, double contacts, double floored)
{
    if (kind == MILL_BALL_BALL)
        return 2 * contacts;
    return world->container.motion ? contacts - floored : contacts;
}

/* Contacts that a soft ball would have at a time. rate: hits per second [1/s] of a ball */
static void judge_rate(struct mill_notes *notes, const struct mill_world *world, double rate)
{
    const double contact = mill_tally_contact(world);
    add(notes, "contacts_at_once", rate * contact, AT_ONCE, rate * contact > AT_ONCE,
        "a ball is hit every %.3g us, and a contact of such balls, if they are as stiff as steel, "
        "lasts %.3g us: soft spheres would have several contacts at once, so rates and power of "
        "hard spheres may not be valid. Check it: mill check.",
        1e6 / rate, 1e6 * contact);
}

/* [1] In diameters, the narrowest gap (the widest: 2) in which friction locks two balls: the angle
 * of their line of centres and the normals is below the sum of two angles of friction. */
static double locking_gap(const struct mill_world *world)
{
    double friction = 0;
    for (int kind = MILL_BALL_BALL + 1; kind < world->kinds.count; kind++)
        friction = fmax(friction, world->law[kind].friction);
    const double angle = atan(friction) + atan(world->law[MILL_BALL_BALL].friction);
    return 1 + fmax(cos(angle), 0);
}

/* What balls do that lock between surfaces. Contacts without friction end contacts without end: how
 * many there were before, and the work that they did, depends on the program (STILL in
 * engine/sim_contact.c) and not on the mill. Bridges give way as stiff balls do. */
static void judge_locks(struct mill_notes *notes, const struct mill_world *world)
{
    const double smoothed = (double)world->counts.smoothed, work = fabs(world->account.work);
    const double share = work > 0 ? world->account.bridge_work / work : 0;
    add(notes, "locks", smoothed, 0, smoothed > 0,
        "time did not advance between contacts, so %.0f of them were computed without friction: "
        "balls are locked in a corner, or between surfaces that move past each other. Power and "
        "rates are not to be trusted. Two balls lock in gaps of 1 + cos(2 atan mu) to 2 diameters, "
        "here %.3g to 2: change gap or friction, or check with soft spheres (mill check).",
        smoothed, locking_gap(world));
    add(notes, "bridges", share, PINCHED, share > PINCHED,
        "up to %.0f %% of the work is done on pairs of balls that bridge surfaces sliding past "
        "each other, in gaps of %.3g to 2 diameters. Balls as stiff as steel are assumed, and this "
        "power depends on the stiffness, by a factor of 2 and more where many pairs jam. Another "
        "gap or less friction avoids it; mill check compares with soft spheres.",
        100 * fmin(share, 1), locking_gap(world));
}

bool mill_notes_of_rotor(const struct mill_world *world)
{
    bool alone = world->container.still && world->motions == 1 && world->rotor == 0;
    for (int k = 0; alone && k < world->shapes; k++)
        alone = !world->shape[k]->motion || world->shape[k]->kind < MILL_KINDS;
    return alone;
}

/* Parts of the window's power and contacts */
static void judge_shares(struct mill_notes *notes, const struct mill_tally_results *r)
{
    const double power = r->at.known.drive.value;
    const double pinched = power != 0 ? r->pinch_power / power : 0;
    const int fast = r->tally->batches.fast;
    const uint64_t impacts = mill_spectrum_total(&r->sums.impacts[r->all].normal, fast).count;
    const uint64_t strikes = mill_spectrum_total(&r->sums.strikes[r->all].normal, fast).count;
    const double share = impacts > 0 ? 1 - (double)strikes / (double)impacts : (double)NAN;
    const bool rotor = mill_notes_of_rotor(r->world);
    add(notes, "pinches", pinched, PINCHED, fabs(pinched) > PINCHED,
        "%.0f %% of the %s power goes to balls that %s against others and walls. This is computed "
        "for bodies as stiff as steel; softer ones take less. The rates of %s impacts are less "
        "accurate. Wider gaps around %s reduce this power; mill check compares with soft spheres.",
        100 * pinched, rotor ? "rotor's" : "drive's", rotor ? "it presses" : "moving bodies press",
        rotor ? "drum and blade" : "wall and body", rotor ? "the blades" : "the moving bodies");
    const double rests = r->floor_share[r->all];
    add(notes, "rubbing", rests, RUBBING, is_stirred(r->world) && rests > RUBBING,
        "parts stir a bed whose balls rest on each other (%.0f %% of the impacts are at the "
        "rebound floor). In such attritors the power of hard spheres differed from that of soft "
        "ones by up to 11 %%, and the fastest impacts were a fifth fewer. Check it: mill check.",
        100 * rests);
    add(notes, "recontact_share", share, RECONTACTS, share > RECONTACTS,
        "%.0f %% of the impacts above %.3g mm/s follow the last one of the same two bodies so soon "
        "that it is one contact of soft balls. Use strikes for rates.",
        100 * share, 1e3 * r->above_floor);
}

void mill_notes_expect(struct mill_notes *notes, const struct mill_world *world,
                       const struct mill_tally_results *trial, double rate)
{
    notes->count = 0;
    if (world->soft.on)
        return;
    judge_locks(notes, world);
    judge_law(notes, world, false);
    double hits = 0, all = 0; /* hits on balls in the contacts so far */
    for (int kind = 0; kind < world->kinds.count; kind++) {
        const double contacts = (double)world->account.collisions[kind];
        all += contacts;
        hits += hits_of(world, kind, contacts, (double)world->account.floored[kind]);
    }
    judge_rate(notes, world, (all > 0 ? hits / all : 2) * rate / world->balls);
    if (trial)
        judge_shares(notes, trial);
}

/* Angular speed [rad/s] of the ring that the charge has become; 0: it is no ring. In the last tenth
 * of the window, at most one in 200 contacts is with the rotor (or a body). At least nine tenths of
 * the kinetic energy belong to the turning of the charge about the axis: L^2 / 2I, with angular
 * momentum L and moment of inertia I. The ring does not fall: w^2 r > g with w = L / I, r^2 = I /
 * m. A charge in a smooth drum without friction ends as a ring. A thick ring has nearly the rotor's
 * speed; a thin one is slower once the rotor does not reach it. */
static double ring_speed(const struct mill_world *w, const struct mill_tally_results *r, double t)
{
    if (w->rotor_speed == 0 || !w->container.still)
        return 0;
    uint64_t all = 0, rotor = 0; /* contacts in the last tenth */
    for (int kind = 0; kind < w->kinds.count; kind++) {
        const uint64_t late = r->at.at_end.collisions[kind] - r->late.collisions[kind];
        const bool moves = kind == MILL_BALL_SHAFT || kind == MILL_BALL_BLADE || kind >= MILL_KINDS;
        all += late;
        rotor += moves ? late : 0;
    }
    if (all < (uint64_t)w->balls || (double)rotor > 5e-3 * (double)all)
        return 0;
    double mass = 0, inertia = 0, momentum = 0;
    for (int32_t i = 0; i < w->balls; i++) {
        const double m = w->species[w->ball[i].species].mass;
        const vec3 x = mill_world_position(w, i, t), v = mill_world_velocity(w, i, t);
        mass += m;
        inertia += m * (x.y * x.y + x.z * x.z);
        momentum += m * (x.y * v.z - x.z * v.y);
    }
    const double speed = momentum / inertia, gravity = hypot(w->g.y, w->g.z);
    const bool turning =
        0.5 * momentum * speed >= 0.9 * mill_world_energy(w, t).kinetic && speed != 0;
    return turning && speed * speed * sqrt(inertia / mass) > gravity ? speed : 0;
}

/* Two rules: the charge has become a ring; motions' power and losses of the window differ. */
static void judge_motion(struct mill_notes *notes, const struct mill_world *world,
                         const struct mill_tally_results *r, double t)
{
    const double ring = ring_speed(world, r, t);
    double dissipated = 0;
    for (int kind = 0; kind < world->kinds.count; kind++)
        dissipated += r->at.at_end.dissipation[kind] - r->at.at_begin.dissipation[kind];
    dissipated = mill_tally_per_second(r, dissipated);
    const double power = r->at.known.drive.value;
    const double most = fmax(fabs(power), fabs(dissipated));
    const bool works = world->period < (double)INFINITY && r->duration > 0 && most > 0 &&
                       r->impacts[r->all].count >= MILL_SPREAD_SEEN;
    const double off = works ? fabs(power - dissipated) / most : (double)NAN;
    add(notes, "ring", ring != 0 ? ring / world->rotor_speed : 0, 0, ring != 0,
        "the rotor no longer reaches the charge, which turns as a ring, at %.0f %% of the rotor's "
        "speed%s.",
        100 * ring / world->rotor_speed,
        world->law[MILL_BALL_DRUM].friction > 0
            ? ""
            : ": nothing brakes the balls in a smooth drum without friction");
    add(notes, "unsteady", off, UNSTEADY,
        ring == 0 && off > UNSTEADY && r->doubt != MILL_TALLY_DRIFTS,
        "not steady: the %s power and the dissipated power differ by more than 5 %% over the "
        "sampled window. Sample later or for longer.",
        mill_notes_of_rotor(world) ? "rotor's" : "drive's");
}

/* Why no errors are given, and what gives them */
static void judge_start(struct mill_notes *notes, const struct mill_tally_results *r)
{
    static const char *const why[] = {
        [MILL_TALLY_KNOWN] = "",
        [MILL_TALLY_ONE_START] =
            "no errors are known from one start: the container moves, and balls rest on its wall, "
            "so the charge may keep its first arrangement for ever, and other starts differ. Run "
            "several: run.starts = 8.",
        [MILL_TALLY_FIRST_OF_ALL] =
            "results are of the first starts alone, without errors, because the run was stopped "
            "when the others were not as far: --resume goes on with all.",
        [MILL_TALLY_FEW_STARTS] =
            "the scatter of fewer than 4 starts gives no errors: run.starts = 8.",
        [MILL_TALLY_DRIFTS] =
            "not settled: from the first quarter of the sampled window to its last half the starts "
            "drift all in one direction, so no errors are given. Sample later (run.sample_from), "
            "and for longer."};
    const double all = (double)r->impacts[r->all].count;
    const int fast = r->tally->batches.fast;
    add(notes, NULL, r->tally->starts, 1, r->doubt != MILL_TALLY_KNOWN, "%s", why[r->doubt]);
    add(notes, NULL, r->tally->starts, 1, r->at.known.slips && all > 0,
        "only %.3g of %.3g impacts are faster than %.3g mm/s: rare slips of the charge, which no "
        "start or one may have seen, so their median has no error. Compare power, losses and rates "
        "of all impacts, or a threshold that is lower (run.hard_impact).",
        (double)mill_spectrum_total(&r->sums.impacts[r->all].normal, fast).count, all,
        1e3 * r->above_floor);
}

static void judge_carried(struct mill_notes *notes, const struct mill_world *world,
                          const struct mill_tally_results *r)
{
    const double shoulder = r->charge[MILL_CHARGE_SHOULDER].value;
    if (r->tally->charge.world && world->species_count == 1)
        add(notes, "carried", shoulder, CARRIED, shoulder > CARRIED,
            "the wall carries the charge up to %.0f deg. Hard balls of one size leave it too early "
            "there: their power was 6 to 14 %% above that of soft ones. Check it: mill check.",
            shoulder * 180.0 / MILL_PI);
}

/* A body that no ball reaches is probably a mistake: of its place, or of the unit of its mesh. */
static void judge_reach(struct mill_notes *notes, const struct mill_world *world,
                        const struct mill_tally_results *r)
{
    const char *never = NULL;
    for (int kind = MILL_KINDS; kind < world->kinds.count && !never; kind++)
        if (world->account.collisions[kind] == 0)
            never = world->kinds.name[kind];
    add(notes, NULL, 0, 0, r->duration > 0 && never,
        "no ball has met a surface of the kind %s: is it where it should be, and of the right "
        "size?",
        never ? never : "");
}

/* Screw-like blades convey the balls through periodic ends. End walls would stop this flow. */
static void judge_drift(struct mill_notes *notes, const struct mill_world *world,
                        const struct mill_tally_results *r, double t)
{
    const struct mill_map *map = &r->tally->plan.maps.axial;
    const struct mill_map_flow *cell = r->sums.flow + map->first;
    const struct mill_energy e = mill_world_energy(world, t);
    double volume = 0, flow = 0, mass = 0;
    if (!(world->container.period > 0) || world->motions == 0)
        return;
    for (int i = 0; r->duration > 0 && i < map->n[0] * map->n[1]; i++) {
        volume += cell[i].volume;
        flow += cell[i].flow[0];
    }
    for (int32_t i = 0; i < world->balls; i++)
        mass += world->species[world->ball[i].species].mass;
    const double drift = volume > 0 ? fabs(flow / volume) : 0;
    const double share = drift > 0 ? drift / sqrt(2 * e.kinetic / mass) : 0;
    const double limit = fmax(DRIFT, CHANCES / sqrt(3.0 * world->balls));
    add(notes, "drift", share, limit, share > limit,
        "the balls drift along the axis at %.3g m/s, %.0f %% of their speed, because the mill "
        "conveys them through the periodic ends. End walls would stop this flow: a mill with them "
        "differs, also far from them.",
        drift, 100 * share);
}

/* Rules for soft spheres */
static void judge_soft(struct mill_notes *notes, const struct mill_world *world)
{
    double least = INFINITY;
    for (int k = 0; k < world->species_count; k++)
        least = fmin(least, 2 * world->species[k].radius);
    const double pressed = world->counts.largest_overlap / least;
    add(notes, "softness", pressed, SOFT, pressed > SOFT,
        "balls are pressed in by up to %.2g %% of a diameter: a larger soft.modulus makes them "
        "stiffer.",
        100 * pressed);
    add(notes, NULL, world->soft.modulus, STIFF, world->soft.modulus < STIFF,
        "at %.3g Pa slow impacts merge into longer contacts: compare rates of impacts at "
        "soft.modulus = steel.",
        world->soft.modulus);
}

void mill_notes_take(struct mill_notes *notes, const struct mill_world *world,
                     const struct mill_tally_results *r, double t, bool stopped, bool foreign)
{
    const bool hard = !foreign && !world->soft.on;
    const double now = world->base + t;
    double hits = 0; /* on balls */
    for (int kind = 0; kind < world->kinds.count; kind++) {
        const double contacts = (double)r->impacts[kind].count;
        hits += contacts > 0 ? hits_of(world, kind, contacts, contacts * r->floor_share[kind]) : 0;
    }
    notes->count = 0;
    add(notes, NULL, now, r->tally->end, stopped,
        "stopped at %.6g s of %.6g s; the file holds everything up to then.", now, r->tally->end);
    add(notes, NULL, r->duration, 0, !(r->duration > 0),
        "nothing was sampled: the run ended before run.sample_from = %.6g s.", r->tally->begin);
    judge_start(notes, r);
    if (hard)
        judge_locks(notes, world);
    judge_motion(notes, world, r, t);
    if (hard) {
        judge_law(notes, world, true);
        judge_rate(notes, world, r->duration > 0 ? hits / world->balls / r->duration : (double)NAN);
        judge_shares(notes, r);
        judge_carried(notes, world, r);
    }
    judge_reach(notes, world, r);
    if (!foreign)
        judge_drift(notes, world, r, t);
    if (!foreign && !hard)
        judge_soft(notes, world);
}

static void tell_reach(const struct mill_notes *notes, struct mill_sink *sink)
{
    sink->open(sink, "reach");
    for (const struct mill_note *note = notes->note; note < notes->note + notes->count; note++) {
        if (!note->code)
            continue;
        sink->open(sink, note->code);
        mill_tell_number(
            sink, "value", note->value, "1",
            "what a rule on the validity of the model compares with its limit; NaN: not known");
        mill_tell_number(sink, "limit", note->limit, "1", "limit beyond which there is a note");
        sink->close(sink);
    }
    sink->close(sink);
}

void mill_notes_tell(const struct mill_notes *notes, const char *others, struct mill_sink *sink)
{
    const size_t length = others ? strlen(others) : 0;
    if (!others)
        tell_reach(notes, sink);
    if (!sink->full)
        return;
    char *lines = mill_sink_room(sink, length + sizeof notes->note + 1, 1), *end = lines;
    if (!lines)
        return;
    if (length > 0)
        end += sprintf(end, "%s%s", others, others[length - 1] == '\n' ? "" : "\n");
    for (const struct mill_note *note = notes->note; note < notes->note + notes->count; note++)
        if (note->text[0])
            end += sprintf(end, "%s\n", note->text);
    mill_tell_text(sink, "notes", lines, "remarks on the validity of the results, one per line");
    free(lines);
}

void mill_notes_write(const struct mill_notes *notes, struct mill_sink *sink)
{
    const char *text[sizeof notes->note / sizeof *notes->note];
    size_t count = 0;
    for (const struct mill_note *n = notes->note; n < notes->note + notes->count; n++)
        if (n->text[0])
            text[count++] = n->text;
    sink->values(sink, "notes", MILL_H5_TEXT, 1, &count, text, "", "");
}
