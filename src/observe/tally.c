/* The statistics from run.sample_from to the end of the run. This observer sorts every impact into
 * spectra, strikes and maps, in tens of nanoseconds. It looks at the world when the window opens
 * and ends, at the ends of batches, for samples of the maps: all times depend on the deck alone. */
#include "observe/tally.h"
#include "observe/observers.h"

#include "millsim/state.h"

#include <stdio.h>

/* ---- the start of the window ----
 *
 * Where does the window begin? Without run.sample_from, the length of the start-up is not known
 * while the statistics are gathered. They cannot be subtracted later, because rounded sums do not
 * cancel exactly. So they are kept in separate portions of a few batches, at most
 * MILL_TALLY_PORTIONS, which are joined as the run becomes longer (3 become one where 3 make a
 * period, else 2). Only the portions after the cut are added up; a cut inside a portion is moved to
 * its end. */

/* Makes a portion's memory, once: a run that ends early needs few. false: out of memory */
static bool make_portion(struct mill_tally *t, uint64_t number)
{
    struct mill_gathered *portion = &t->portion[number];
    return portion->impacts || mill_gathered_make(portion, &t->plan, t->plan.kinds);
}

/* Moves statistics; `from` gets the memory that `to` had. */
static void move(struct mill_gathered *to, struct mill_gathered *from)
{
    const struct mill_gathered room = *to;
    *to = *from;
    *from = room;
    from->last = to->last;
}

static void join_portions(struct mill_tally *t)
{
    const uint64_t length = t->at.length, period = t->batches.at.period;
    /* or more, so that whole portions make a period, or periods make a portion */
    uint64_t many = 2;
    while (length < period && period % (length * many) != 0)
        many++;
    for (uint64_t k = 0; t->search && k < t->at.portions / many; k++) {
        struct mill_gathered *first = &t->portion[many * k];
        for (uint64_t m = 1; m < many; m++)
            mill_gathered_add(first, &first[m]);
        first->last = first[many - 1].last;
        move(&t->portion[k], first);
    }
    t->at.portions /= many;
    t->at.length *= many;
}

/* Returns the strikes of an earlier portion. */
static struct mill_speeds *strikes_of(struct mill_tally *t, int32_t portion)
{
    for (uint64_t i = 0; t->search && i < t->at.portions; i++)
        if (portion <= t->portion[i].last)
            return t->portion[i].strikes;
    return t->gathered.strikes;
}

/* Ends a batch. false: out of memory */
static bool end_batch(struct mill_tally *t, const struct mill_account *account)
{
    struct mill_gathered *gathered = &t->gathered;
    uint64_t count[MILL_SPECTRUM_SLOTS];
    for (int i = 0; i < MILL_SPECTRUM_SLOTS; i++) {
        uint64_t now = 0;
        for (int kind = 0; kind < t->plan.kinds; kind++)
            now += gathered->impacts[kind].normal.slot[i].count;
        count[i] = now - t->before[i];
        t->before[i] = now;
    }
    mill_precision_close(&t->batches, count, account);
    if (t->batches.at.batches % t->blocks.length == 0) {
        const uint64_t blocks = t->blocks.blocks + 1;
        mill_energies_blocks_close(&t->blocks, gathered->pair, t->batches.at.period);
        mill_charge_join(&t->charge, blocks, t->blocks.blocks);
    }
    if (t->batches.at.batches % t->at.length != 0)
        return true;
    if (t->search && !make_portion(t, t->at.portions))
        return false;
    if (t->search) { /* the statistics since the last portion become a new portion */
        move(&t->portion[t->at.portions], gathered);
        mill_gathered_clear(gathered);
        gathered->last++;
        memset(t->before, 0, sizeof t->before);
        mill_energies_blocks_restart(&t->blocks);
    }
    if (++t->at.portions == (t->asked.starts > 1 ? MILL_TALLY_FEWER : MILL_TALLY_PORTIONS))
        join_portions(t);
    const uint64_t joined = mill_precision_join(&t->batches);
    t->at.length /= joined;
    t->blocks.length /= joined;
    return true;
}

/* ---- impacts ---- */

static void count(const struct mill_tally *tally, struct mill_speeds *speeds,
                  const struct mill_impact *impact, int normal, int tangential)
{
    const int fast = normal >= tally->batches.fast;
    const uint64_t once = !impact->lasting;
    mill_spectrum_add(&speeds->normal, normal, once, impact->normal_speed, impact->dissipation);
    mill_spectrum_add(&speeds->tangential[fast], tangential, once, impact->tangential_speed,
                      impact->dissipation);
}

static enum mill_status count_strike(struct mill_tally *tally, const struct mill_impact *impact,
                                     int normal, int tangential, struct mill_error *error)
{
    struct mill_speeds *speeds = &tally->gathered.strikes[impact->kind];
    struct mill_strike alone, *strike = &alone;
    double since = INFINITY;
    if (tally->pairs.window > 0)
        strike = mill_strikes_meet(&tally->pairs, impact->kind, impact->ball, impact->partner,
                                   impact->time, &since);
    if (!strike)
        return mill_error_set(error, MILL_FAILED, "out of memory for the table of strikes");
    if (isinf(since)) {
        strike->portion = (int32_t)tally->gathered.last;
        strike->normal = tally->at.open ? (int16_t)normal : -1;
        strike->tangential = (int16_t)tangential;
        if (tally->at.open)
            count(tally, speeds, impact, normal, tangential);
    } else if (strike->normal >= 0) {
        if (strike->portion != tally->gathered.last)
            speeds = &strikes_of(tally, strike->portion)[impact->kind];
        const int fast = strike->normal >= tally->batches.fast;
        speeds->normal.slot[strike->normal].dissipation += impact->dissipation;
        speeds->tangential[fast].slot[strike->tangential].dissipation += impact->dissipation;
    }
    return MILL_OK;
}

/* Counts the impact at its place in the container's frame. */
static void map_impact(struct mill_tally *tally, const struct mill_impact *impact)
{
    const struct mill_container *in = &tally->world->container;
    vec3 place = impact->position;
    if (!in->still)
        place = mill_pose_in(&in->frame,
                             mill_motion_in(in->mapped, impact->time - tally->world->base, place));
    mill_maps_impact(&tally->plan.maps, tally->gathered.hits, impact, &place);
}

static enum mill_status on_impact(struct mill_observer *observer, const struct mill_impact *impact,
                                  struct mill_error *error)
{
    struct mill_tally *t = (struct mill_tally *)observer;
    enum mill_status status = MILL_OK;
    if (!t->at.closed && (t->at.open || impact->time >= t->watch)) {
        struct mill_wear_sum *at = mill_wear_facet(&t->plan.wear, t->gathered.wear, impact);
        const int normal = mill_spectrum_find(&t->grid, impact->normal_speed);
        const int tangential = mill_spectrum_find(&t->grid, impact->tangential_speed);
        if (t->at.open) {
            mill_energies_impact(&t->plan.energies, t->gathered.pair, impact);
            count(t, &t->gathered.impacts[impact->kind], impact, normal, tangential);
            map_impact(t, impact);
            if (at)
                mill_wear_impact(&t->plan.wear, at, impact);
            const int bin = mill_wear_facets_bin(&t->plan.wear, impact);
            if (bin >= 0)
                mill_wear_impact(&t->plan.wear, t->gathered.along + bin, impact);
        }
        status = count_strike(t, impact, normal, tangential, error);
    }
    if (t->charge.world)
        mill_charge_impact(&t->charge, t->blocks.blocks, t->at.open && !t->at.closed, impact);
    t->at.collisions += !impact->lasting;
    if (t->at.collisions < t->collisions || status != MILL_OK)
        return status;
    t->at.ended = MILL_TALLY_COLLISIONS;
    return mill_error_set(error, MILL_ENDED, "max_collisions");
}

/* ---- times ---- */

/* End of the batch; the last one ends with the window if it is complete but for rounding. */
static double next_batch(const struct mill_tally *tally)
{
    const double next = mill_precision_next(&tally->batches);
    return next < tally->end + 1e-9 * tally->batches.at.batch ? fmin(next, tally->end) : next;
}

static void plan(struct mill_tally *tally)
{
    const struct mill_world *world = tally->world;
    double next = tally->at.open ? fmin(tally->end, next_batch(tally)) : tally->begin;
    /* balls that are all asleep never move again: one sample at the end of a batch is enough */
    if (tally->at.open && !(world->counts.asleep == world->balls && world->container.still))
        next = fmin(mill_tally_snapshot(tally, 0), next);
    tally->observer.next = tally->at.closed ? (double)INFINITY : next;
}

static void open_window(struct mill_tally *tally, const struct mill_account *account)
{
    tally->at.open = true;
    tally->at.at_begin = *account;
    tally->batches.accounts[0] = *account;
}

static enum mill_status on_sample(struct mill_observer *observer, const struct mill_world *world,
                                  double t, struct mill_error *error)
{
    struct mill_tally *tally = (struct mill_tally *)observer;
    struct mill_tally_progress *at = &tally->at;
    const double now = observer->next;
    if (!at->open && tally->begin <= now)
        open_window(tally, &world->account);
    unsigned snapshots = 0;
    while (at->open && mill_tally_snapshot(tally, snapshots) <= now)
        snapshots++;
    if (snapshots > 0) {
        const struct mill_energy energy = mill_world_energy(world, t);
        mill_maps_sample(&tally->plan.maps, tally->gathered.flow, world, t, snapshots);
        mill_charge_sample(&tally->charge, tally->blocks.blocks, t, at->snapshots,
                           at->snapshots + snapshots);
        tally->gathered.counts->samples += snapshots;
        tally->gathered.counts->kinetic += snapshots * energy.kinetic;
        tally->gathered.counts->rotational += snapshots * energy.rotational;
    }
    at->snapshots += snapshots;
    if (at->open && next_batch(tally) <= now && !end_batch(tally, &world->account))
        return mill_error_set(error, MILL_FAILED, "out of memory for the statistics");
    if (tally->end <= now) {
        at->at_end = world->account;
        at->over = tally->end;
        at->closed = true;
    }
    plan(tally);
    return MILL_OK;
}

/* ---- state: only what gathering changes; everything else is made again from the deck ---- */

static void tell_strikes(struct mill_strikes *pairs, struct mill_state *state)
{
    double bits = pairs->bits;
    mill_state_field(state, "pair_bits", MILL_FIELD_F64, 1, &bits);
    if (state->loads && state->status == MILL_OK &&
        !(bits >= 0 && bits <= 40 && mill_strikes_resize(pairs, (int)bits, INFINITY)))
        mill_state_refuse(state, "out of memory for the table of strikes");
    const size_t room = mill_strikes_room(pairs);
    mill_state_structs(state, "pairs", sizeof *pairs->entry, room, pairs->entry);
    /* a damaged file must not bring in wrong slots of spectra */
    for (size_t i = 0; state->loads && state->status == MILL_OK && i < room; i++) {
        const struct mill_strike *strike = &pairs->entry[i];
        if (strike->normal < -1 || strike->normal >= MILL_SPECTRUM_SLOTS ||
            strike->tangential < 0 || strike->tangential >= MILL_SPECTRUM_SLOTS)
            mill_state_refuse(state, "the saved statistics are damaged");
    }
}

static void tell_state(struct mill_observer *observer, struct mill_state *state)
{
    struct mill_tally *t = (struct mill_tally *)observer;
    struct mill_precision *b = &t->batches;
    mill_state_field(state, "next", MILL_FIELD_F64, 1, &observer->next);
    mill_state_structs(state, "progress", sizeof t->at, 1, &t->at);
    mill_state_structs(state, "batches", sizeof b->at, 1, &b->at);
    /* these numbers give the lengths of what follows and indices into it */
    const bool sane =
        b->at.batches < b->most && t->at.length > 0 && t->at.portions < MILL_TALLY_PORTIONS;
    if (state->loads && !sane)
        mill_state_refuse(state, "the saved statistics are damaged");
    if (state->status != MILL_OK)
        return;
    tell_strikes(&t->pairs, state);
    mill_gathered_state(&t->gathered, "now", state);
    for (uint64_t i = 0; t->search && i < t->at.portions && state->status == MILL_OK; i++) {
        char prefix[24];
        snprintf(prefix, sizeof prefix, "portion_%d", (int)i);
        if (make_portion(t, i))
            mill_gathered_state(&t->portion[i], prefix, state);
        else
            mill_state_refuse(state, "out of memory for the statistics");
    }
    const size_t n = (size_t)b->at.batches;
    mill_energies_blocks_state(&t->blocks, state);
    if (t->charge.world) {
        mill_sums_state(&t->charge.blocks, "blocks", state);
        mill_state_field(state, "met", MILL_FIELD_F64, (size_t)t->world->balls, t->charge.met);
    }
    mill_state_structs(state, "before", sizeof *t->before, MILL_SPECTRUM_SLOTS, t->before);
    mill_state_structs(state, "accounts", sizeof *b->accounts, n + 1, b->accounts);
    mill_state_field(state, "batch_counts", MILL_FIELD_I32, n * MILL_SPECTRUM_SLOTS, *b->counts);
}

/* ---- creation ---- */

double mill_tally_contact(const struct mill_world *world)
{
    double mass = 0, radius = 0;
    for (int32_t i = 0; i < world->balls; i++) {
        mass += world->species[world->ball[i].species].mass / world->balls;
        radius += world->species[world->ball[i].species].radius / world->balls;
    }
    return mill_impact_duration(0.5 * mass, 0.5 * radius, MILL_IMPACT_SLOW);
}

static void free_tally(struct mill_observer *observer)
{
    struct mill_tally *tally = (struct mill_tally *)observer;
    for (int i = 0; i < MILL_TALLY_PORTIONS; i++)
        mill_gathered_free(&tally->portion[i]);
    mill_gathered_free(&tally->gathered);
    mill_gathered_free_plan(&tally->plan);
    mill_energies_blocks_free(&tally->blocks);
    mill_strikes_free(&tally->pairs);
    mill_sums_free(&tally->charge.blocks);
    free(tally->charge.met);
    mill_precision_free(&tally->batches);
}

static enum mill_status create(struct mill_observer *observer, const struct mill_observe *asked,
                               const struct mill_world *world, struct mill_error *error)
{
    struct mill_tally *tally = (struct mill_tally *)observer;
    const double duration = fmax(0, asked->end - asked->sample_from);
    tally->asked = *asked;
    tally->begin = asked->sample_from; /* 0 if it is to be found */
    tally->end = fmax(asked->end, asked->sample_from);
    tally->interval = duration > 0 ? fmin(1e-3, duration / 100) : (double)INFINITY;
    mill_spectrum_grid_init(&tally->grid);
    tally->world = world;
    tally->starts = 1;
    tally->start[0] = tally;
    const double window =
        isnan(asked->strike_window) ? mill_tally_contact(world) : asked->strike_window;
    tally->watch = asked->sample_from - 2 * window; /* twice, because of rounding */
    tally->collisions = asked->max_collisions > 0 ? (uint64_t)asked->max_collisions : UINT64_MAX;
    tally->search = asked->sample_found;
    tally->at.length = 1;
    if (!mill_gathered_plan(&tally->plan, world) ||
        !mill_gathered_make(&tally->gathered, &tally->plan, tally->plan.kinds) ||
        !mill_energies_blocks_init(&tally->blocks, tally->plan.energies.pairs) ||
        !mill_charge_init(&tally->charge, world, tally->interval))
        return mill_error_set(error, MILL_FAILED, "out of memory for maps, spectra and energies");
    if (!mill_strikes_init(&tally->pairs, window) ||
        !mill_precision_init(&tally->batches, tally->begin, world, &tally->grid))
        return mill_error_set(error, MILL_FAILED, "out of memory for the statistics");
    tally->batches.most = asked->starts > 1 ? MILL_PRECISION_FEWER : MILL_PRECISION_BATCHES;
    if (tally->begin <= 0 && duration > 0)
        open_window(tally, &world->account);
    plan(tally);
    return MILL_OK;
}

const struct mill_observing mill_tally_type = {.type = {"statistics", on_impact, on_sample, NULL},
                                               .size = sizeof(struct mill_tally),
                                               .create = create,
                                               .state = tell_state,
                                               .free = free_tally};
