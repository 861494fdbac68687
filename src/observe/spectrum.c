/* Histogram of impact speeds: counts and dissipation in logarithmic bins with edges 20^(k/152) m/s,
 * 1.99 % wide, so a quantile is accurate to 1 %. 0.05, 1 and 20 m/s are edges. The leading bits of
 * a double grow like the logarithm: a small table and one comparison find the bin, without it. */
#include "observe/spectrum.h"

#include "base/elementary.h"

/* 20^(1/152) as a sum of two doubles, to 106 bits */
static const double ratio = 0x1.05187226d4515p+0, ratio_rest = 0x1.780f2c237233dp-54;

/* 20^(k/152) [m/s], correctly rounded */
static double edge_speed(int k)
{
    double whole = 1, divisor = 1;
    for (; k >= MILL_SPECTRUM_DECADE; k -= MILL_SPECTRUM_DECADE)
        whole *= 20;
    for (; k < 0; k += MILL_SPECTRUM_DECADE)
        divisor *= 20;
    double part = 1, rest = 0; /* a sum of two doubles, to 106 bits */
    for (; k > 0; k--) {
        const double product = part * ratio, exactly = fma(part, ratio, -product);
        const double below = exactly + (part * ratio_rest + rest * ratio);
        part = product + below;
        rest = below - (part - product);
    }
    return whole * part / divisor;
}

void mill_spectrum_grid_init(struct mill_spectrum_grid *grid)
{
    for (int k = 0; k <= MILL_SPECTRUM_BINS; k++)
        grid->edge[k] = edge_speed(MILL_SPECTRUM_LOWEST + k);
    grid->edge[MILL_SPECTRUM_BINS + 1] = INFINITY;
    int slot = 0;
    for (int cell = 0; cell < MILL_SPECTRUM_CELLS; cell++) {
        const double lowest = ldexp(1 + (cell % 64) / 64.0, cell / 64 - 22);
        while (lowest >= grid->edge[slot])
            slot++;
        grid->first[cell] = (uint16_t)slot;
    }
}

#define SLOTS(member)                                                                              \
    offsetof(struct mill_spectrum, slot[0].member), MILL_SPECTRUM_SLOTS,                           \
        sizeof(struct mill_spectrum_slot)

static const struct mill_sum sums[] = {
    {"sum", "m s-1", "sum of the speeds", MILL_H5_F64, offsetof(struct mill_spectrum, sum), 0, 0},
    {"count", "1",
     "how many fell into each bin; attributes underflow (zero included) and overflow: how many lay "
     "outside",
     MILL_H5_U64, SLOTS(count)},
    {"dissipation", "J",
     "energy dissipated by those of each bin; attributes underflow and overflow: by those outside",
     MILL_H5_F64, SLOTS(dissipation)}};

const struct mill_sums_list mill_spectrum_sums = {"spectra", sizeof(struct mill_spectrum), 3, sums};

struct mill_spectrum_slot mill_spectrum_total(const struct mill_spectrum *spectrum, int slot)
{
    struct mill_spectrum_slot total = {0, 0};
    for (; slot < MILL_SPECTRUM_SLOTS; slot++) {
        total.count += spectrum->slot[slot].count;
        total.dissipation += spectrum->slot[slot].dissipation;
    }
    return total;
}

double mill_spectrum_mean(const struct mill_spectrum *spectrum)
{
    const uint64_t count = mill_spectrum_total(spectrum, 0).count;
    return count > 0 ? spectrum->sum / (double)count : (double)NAN;
}

struct mill_spectrum_place mill_spectrum_place(const struct mill_spectrum *s, int slot, double at)
{
    struct mill_spectrum_place place = {.slot = slot, .bin = slot};
    place.count = (double)mill_spectrum_total(s, slot).count;
    mill_spectrum_raise(s, at, &place);
    return place;
}

void mill_spectrum_raise(const struct mill_spectrum *spectrum, double level,
                         struct mill_spectrum_place *place)
{
    const struct mill_spectrum_slot *slot = &spectrum->slot[place->bin];
    const double rank = level * place->count;
    if (place->count == 0)
        return;
    for (; slot->count == 0 || place->below + (double)slot->count < rank; slot++)
        place->below += (double)slot->count; /* a whole number, not more than all */
    place->bin = (int)(slot - spectrum->slot);
    place->within = (rank - place->below) / (double)slot->count;
}

double mill_spectrum_speed(const struct mill_spectrum_grid *grid,
                           const struct mill_spectrum_place *place)
{
    if (place->count == 0 || place->bin == 0)
        return place->count == 0 ? (double)NAN : 0;
    if (place->bin > MILL_SPECTRUM_BINS)
        return grid->edge[MILL_SPECTRUM_BINS];
    return grid->edge[place->bin - 1] * mill_elementary_exp(place->within * MILL_SPECTRUM_LOG_BIN);
}

int mill_spectrum_from(const struct mill_spectrum_grid *grid, const struct mill_world *world)
{
    const double least = MILL_WORLD_FLOORS * world->rebound_floor * (1 - 1e-9);
    int slot = MILL_SPECTRUM_FAST;
    while (slot < MILL_SPECTRUM_BINS && grid->edge[slot - 1] < least)
        slot++;
    return slot;
}
