/* Computes the results of the window from what the tally has gathered, which is not changed: a run
 * continues after a checkpoint's results. tally_results_tell.c writes them. */
#include "observe/tally.h"

const double mill_tally_level[MILL_TALLY_LEVELS] = {0.01, 0.05, 0.1,  0.25, 0.5,
                                                    0.75, 0.9,  0.95, 0.99, 0.999};
enum { MEDIAN = 4 };

/* all: of all; fast: of the fast ones, in the slots from `slot` up */
static void set_speed(struct mill_tally_speed *to, const struct mill_spectrum_grid *grid,
                      const struct mill_spectrum *all, const struct mill_spectrum *fast, int slot)
{
    to->mean = mill_spectrum_mean(all);
    struct mill_spectrum_place at = mill_spectrum_place(all, 0, 0.0);
    struct mill_spectrum_place above = mill_spectrum_place(fast, slot, 0.0);
    for (int i = 0; i < MILL_TALLY_LEVELS; i++) { /* ascending */
        mill_spectrum_raise(all, mill_tally_level[i], &at);
        mill_spectrum_raise(fast, mill_tally_level[i], &above);
        to->quantile[i] = mill_spectrum_speed(grid, &at);
        to->quantile_fast[i] = mill_spectrum_speed(grid, &above);
    }
    to->median = to->quantile[MEDIAN];
    to->median_fast = to->quantile_fast[MEDIAN];
}

/* Adds up the speeds of all kinds, and the tangential speeds; sets the rows. */
static void set_rows(struct mill_tally_results *r, struct mill_speeds *s,
                     struct mill_tally_row *rows)
{
    const struct mill_spectrum_grid *grid = &r->tally->grid;
    for (int kind = 0; kind < r->all; kind++)
        mill_sums_add_records(&mill_spectrum_sums, MILL_GATHERED_SPECTRA, &s[r->all], &s[kind]);
    for (int n = 0; n <= r->kinds.count; n++) {
        struct mill_speeds *of = &s[r->kinds.kind[n]];
        struct mill_tally_row *row = &rows[r->kinds.kind[n]];
        const struct mill_spectrum_slot all = mill_spectrum_total(&of->normal, 0);
        mill_sums_add_records(&mill_spectrum_sums, 1, &of->tangential[0], &of->tangential[1]);
        row->count = all.count;
        row->rate = mill_tally_per_second(r, (double)all.count);
        row->power = mill_tally_per_second(r, all.dissipation);
        set_speed(&row->normal, grid, &of->normal, &of->normal, r->tally->batches.fast);
        set_speed(&row->tangential, grid, &of->tangential[0], &of->tangential[1], 0);
    }
}

/* Computes what follows from accounts, and medians, over the window. No axis: no torque. */
static void sum_account(struct mill_tally_results *r)
{
    const struct mill_account *from = &r->at.at_begin, *to = &r->at.at_end;
    struct mill_precision_known *known = &r->at.known;
    uint64_t floored = 0, impacts = 0;
    mill_precision_whole(known, &r->tally->batches, from, to, r->duration);
    for (int row = 0; row <= r->all; row++) {
        const bool all = row == r->all;
        const uint64_t low = all ? floored : to->floored[row] - from->floored[row];
        const uint64_t met = all ? impacts : to->collisions[row] - from->collisions[row];
        r->floor_share[row] = met > 0 ? (double)low / (double)met : (double)NAN;
        floored += low;
        impacts += met;
    }
    r->pinch_power =
        (to->pinch_work - from->pinch_work) / (r->duration > 0 ? r->duration : (double)NAN);
    for (int k = 0; k < r->world->motions; k++) {
        if (!r->world->motion[k]->axial)
            known->motion_torque[k] = (struct mill_spread_mean){NAN, NAN, 0};
    }
    known->median.value = r->impacts[r->all].normal.median;
    known->median_fast.value = r->impacts[r->all].normal.median_fast;
}

/* Rate of hard impacts, and their number per work of the drive. The errors come from blocks (of
 * several starts: from the starts), the values from the window. In the mean, drives do what impacts
 * lose: the relative error of the quotient is that of hard impacts over losses, and smaller. */
static void sum_hard(struct mill_tally_results *r)
{
    const struct mill_precision_rate *loss = &mill_precision_rates[MILL_PRECISION_LOSS];
    const double lost = r->at.known.loss[r->all].value, drive = r->at.known.drive.value;
    const struct mill_energies_blocks *blocks = &r->tally->blocks;
    const uint64_t first = mill_energies_blocks_first(blocks, r->from), length = blocks->length;
    const size_t many = blocks->blocks > first ? blocks->blocks - first : 0;
    const bool apart = r->tally->starts >= MILL_SPREAD_SEVERAL && many > 0;
    const struct mill_spread_of of = {
        (size_t)r->tally->starts, apart ? 1 : many,
        mill_energies_blocks_period(blocks, r->tally->batches.at.period)};
    const uint64_t each = apart ? many * length : length; /* batches of a value */
    double hard[MILL_SPREAD_MOST] = {0}, rest[MILL_SPREAD_MOST], part[MILL_ENERGIES_BLOCKS];
    r->is_hard = mill_energies_find_hard(r->sums.pair, r->tally->plan.energies.pairs,
                                         r->tally->asked.hard, r->tally->asked.hard_by);
    const double count = r->is_hard.count, rate = mill_tally_per_second(r, count);
    for (size_t s = 0; s < of.starts; s++) {
        const struct mill_tally *t = r->tally->start[s];
        const struct mill_precision *batches = &t->batches;
        mill_energies_blocks_weigh(&t->blocks, first, r->is_hard.sort, r->is_hard.weight, part);
        double *to = &hard[s * of.each];
        for (size_t k = 0; k < many; k++)
            to[apart ? 0 : k] += part[k] / ((double)each * batches->at.batch);
        for (size_t k = 0; k < of.each; k++) {
            const uint64_t from = first * length + k * each;
            const double lost_now = mill_precision_one(batches, from, from + each, loss, r->all, 0);
            to[k] += r->is_hard.of_loss * lost_now;
            rest[s * of.each + k] = to[k] - rate / lost * lost_now;
        }
    }
    r->hard = mill_spread_counted(hard, of, r->duration);
    r->hard_per_joule = mill_spread_mean(rest, of);
    r->hard.value = rate;
    r->hard_per_joule.value = drive > 0 ? rate / drive : (double)NAN;
    /* a found energy varies with losses, not in proportion: no better than the rate */
    const double least = isnan(r->tally->asked.hard) && apart ? r->hard.error / rate : 0;
    r->hard_per_joule.error = fmax(r->hard_per_joule.error / drive,
                                   r->hard_per_joule.value * fmax(least, 1 / sqrt(count)));
    if (r->hard.freedom == 0 || !(drive > 0))
        r->hard_per_joule = (struct mill_spread_mean){r->hard_per_joule.value, NAN, 0};
}

uint64_t mill_tally_window(const struct mill_tally *t, struct mill_tally_progress *at)
{
    const uint64_t n = t->batches.at.batches, period = t->batches.at.period, length = t->at.length;
    struct mill_precision_set set = {.count = t->starts};
    uint64_t from = 0;
    for (int s = 0; s < t->starts; s++)
        set.of[s] = &t->start[s]->batches;
    const bool found =
        t->search && (t->asked.precision > 0 || (period > 0 && n >= MILL_TALLY_TURNS * period));
    at->settled = true;
    if (found)
        from = (mill_precision_cut(&set, &at->settled) + length - 1) / length * length;
    const uint64_t turns = period > 0 && n > from ? (n - from) / period : 0;
    const uint64_t start = n - turns * period;
    if (found && turns >= 2 && start % length == 0)
        from = start;
    at->known = mill_precision_tell(&set, from);
    at->settled = at->settled && !at->known.drifts;
    return from;
}

/* Adds what the starts have gathered in the window that begins with batch `from`. */
static void add_starts(struct mill_tally_results *r)
{
    const struct mill_tally *first = r->tally;
    const uint64_t n = first->batches.at.batches;
    r->at.at_begin = r->at.at_end = r->late = (struct mill_account){0};
    for (int s = 0; s < first->starts; s++) {
        const struct mill_tally *t = first->start[s];
        const struct mill_account *at = t->batches.accounts;
        const struct mill_account *now = t->at.closed ? &t->at.at_end : &t->world->account;
        const struct mill_account *then = !t->at.open ? now
                                          : t->search ? &at[r->from]
                                                      : &t->at.at_begin;
        mill_world_add_account(&r->at.at_begin, then);
        mill_world_add_account(&r->at.at_end, now);
        mill_world_add_account(&r->late, t->at.open ? &at[r->from + 9 * (n - r->from) / 10] : now);
        const uint64_t portions = t->search ? t->at.portions : 0;
        mill_gathered_add(&r->sums, &t->gathered);
        for (uint64_t i = portions > 0 ? r->from / t->at.length : 0; i < portions; i++)
            mill_gathered_add(&r->sums, &t->portion[i]);
    }
}

/* The numbers of the charge; a block may begin a little later than the window. */
static void sum_charge(struct mill_tally_results *r)
{
    const struct mill_tally *t = r->tally;
    const struct mill_charge *charge[MILL_PRECISION_STARTS];
    for (int s = 0; s < t->starts; s++)
        charge[s] = &t->start[s]->charge;
    if (t->charge.world)
        mill_charge_results(charge, t->starts, mill_energies_blocks_first(&t->blocks, r->from),
                            t->blocks.blocks + 1, &r->charge_sum, r->charge);
}

/* Part of all impacts at the rebound floor, in a container that moves: then balls rest on its wall
 * and keep their first arrangement, and no error of a single start is right (docs/physics.md) */
#define RESTING 0.4

/* Without an error a number says how it is not known; with a wrong one it misleads. */
static void doubt(struct mill_tally_results *r)
{
    /* where no floor acts (soft spheres, other programs) it does not tell */
    const double share = r->floor_share[r->all];
    const bool rests = r->world->soft.on || !(share > 0) || share > RESTING;
    const bool moves = r->world->container.motion && rests;
    const int starts = r->tally->starts;
    r->doubt = starts < r->tally->asked.starts         ? MILL_TALLY_FIRST_OF_ALL
               : moves && starts == 1                  ? MILL_TALLY_ONE_START
               : moves && starts < MILL_SPREAD_SEVERAL ? MILL_TALLY_FEW_STARTS
               : r->at.known.drifts                    ? MILL_TALLY_DRIFTS
                                                       : MILL_TALLY_KNOWN;
    const bool known = r->doubt == MILL_TALLY_KNOWN && r->at.open;
    for (int i = 0; i < MILL_CHARGE_NUMBERS && !(known && r->at.known.drive.freedom > 0); i++)
        r->charge[i] = (struct mill_spread_mean){r->charge[i].value, NAN, 0};
    if (known)
        return;
    r->hard = (struct mill_spread_mean){r->hard.value, NAN, 0};
    r->hard_per_joule = (struct mill_spread_mean){r->hard_per_joule.value, NAN, 0};
    mill_precision_forget(&r->at.known);
}

enum mill_status mill_tally_results_make(const struct mill_tally *tally,
                                         const struct mill_world *world, double t,
                                         struct mill_tally_results **out, struct mill_error *error)
{
    struct mill_tally_results *r = *out = calloc(1, sizeof *r);
    if (!r)
        return mill_error_set(error, MILL_FAILED, "out of memory for the results");
    r->tally = tally;
    r->world = world;
    r->all = tally->plan.kinds;
    r->kinds = mill_kinds_listed(world);
    r->at = tally->at;
    r->begin = tally->begin;
    r->above_floor = tally->grid.edge[tally->batches.fast - 1];
    if (!r->at.closed)
        r->at.over = world->base + t;
    r->from = r->at.open ? mill_tally_window(tally, &r->at) : 0;
    if (r->at.open && tally->search)
        r->begin = tally->batches.origin + (double)r->from * tally->batches.at.batch;
    r->duration = r->at.open ? tally->starts * fmax(0, r->at.over - r->begin) : 0;
    if (!mill_gathered_make(&r->sums, &tally->plan, r->all + 1)) {
        mill_tally_results_free(r);
        *out = NULL;
        return mill_error_set(error, MILL_FAILED, "out of memory for the results");
    }
    add_starts(r);
    set_rows(r, r->sums.impacts, r->impacts);
    set_rows(r, r->sums.strikes, r->strikes);
    sum_account(r);
    sum_hard(r);
    sum_charge(r);
    doubt(r);
    r->reached = tally->asked.precision > 0 && r->at.settled &&
                 mill_precision_reached(&r->at.known, tally->asked.precision);
    return MILL_OK;
}

void mill_tally_results_free(struct mill_tally_results *results)
{
    if (!results)
        return;
    mill_gathered_free(&results->sums);
    free(results);
}
