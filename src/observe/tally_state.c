/* The tally's state, so that an interrupted run ends with the statistics of an uninterrupted one.
 * Only what gathering changes is saved; the rest is made again from what is asked for. */
#include "millsim/state.h"
#include "observe/tally.h"

#include <stdio.h>

/* Names of fields of stretch `number`, or of what is gathered since the last one (-1) */
static const char *field_name(char name[32], const char *what, int number)
{
    if (number < 0)
        return what;
    snprintf(name, 32, "stretch_%d_%s", number, what);
    return name;
}

static void tell_map(struct mill_map *map, const char *hits, const char *flow, int number,
                     struct mill_state *state)
{
    const size_t cells = (size_t)(map->n[0] * map->n[1]);
    char name[32];
    mill_state_structs(state, field_name(name, hits, number), sizeof *map->hits, cells, map->hits);
    mill_state_structs(state, field_name(name, flow, number), sizeof *map->flow, cells, map->flow);
}

static void tell_gathered(struct mill_speeds *impacts, struct mill_speeds *strikes,
                          struct mill_maps *maps, int number, struct mill_state *state)
{
    char name[32];
    mill_state_structs(state, field_name(name, "impacts", number), sizeof *impacts, MILL_KINDS,
                       impacts);
    mill_state_structs(state, field_name(name, "strikes", number), sizeof *strikes, MILL_KINDS,
                       strikes);
    mill_state_structs(state, field_name(name, "samples", number), sizeof maps->samples, 1,
                       &maps->samples);
    tell_map(&maps->cross, "cross_hits", "cross_flow", number, state);
    tell_map(&maps->axial, "axial_hits", "axial_flow", number, state);
}

/* Counts that the lengths of what follows, and indices into it, are taken from */
static bool sane(const struct mill_tally *t)
{
    const struct mill_tally_progress *at = &t->at;
    const bool batches = t->tick == 0 || (t->batches.at.batches < MILL_PRECISION_BATCHES &&
                                          at->length > 0 && at->stretches < MILL_TALLY_STRETCHES);
    return batches && t->rotor.blocks <= t->rotor.planned;
}

/* Slots of spectra that a damaged file must not smuggle in */
static bool sane_strikes(const struct mill_strikes *pairs)
{
    const size_t room = mill_strikes_room(pairs);
    for (size_t i = 0; i < room; i++) {
        const struct mill_strike *strike = &pairs->entry[i];
        if (strike->normal < -1 || strike->normal >= MILL_SPECTRUM_SLOTS ||
            strike->tangential < 0 || strike->tangential >= MILL_SPECTRUM_SLOTS)
            return false;
    }
    return true;
}

static void tell_strikes(struct mill_strikes *pairs, struct mill_state *state)
{
    double bits = pairs->bits;
    mill_state_field(state, "pair_bits", MILL_FIELD_F64, 1, &bits);
    if (state->loads && state->status == MILL_OK &&
        !(bits >= 0 && bits <= 40 && mill_strikes_resize(pairs, (int)bits)))
        mill_state_refuse(state, "out of memory for the table of strikes");
    mill_state_structs(state, "pairs", sizeof *pairs->entry, mill_strikes_room(pairs),
                       pairs->entry);
    if (state->loads && state->status == MILL_OK && !sane_strikes(pairs))
        mill_state_refuse(state, "the saved statistics are damaged");
}

static void tell_batches(struct mill_tally *t, struct mill_state *state)
{
    struct mill_precision *batches = &t->batches;
    const size_t n = (size_t)batches->at.batches;
    mill_state_structs(state, "before", sizeof *t->before, MILL_PRECISION_SLOTS, t->before);
    mill_state_structs(state, "books", sizeof *batches->books, n + 1, batches->books);
    mill_state_field(state, "batch_counts", MILL_FIELD_I32, n * MILL_PRECISION_SLOTS,
                     batches->counts);
    for (int i = 0; t->search && i < (int)t->at.stretches; i++) {
        struct mill_tally_stretch *stretch = &t->stretch[i];
        char name[32];
        mill_state_field(state, field_name(name, "last", i), MILL_FIELD_I32, 1, &stretch->last);
        tell_gathered(stretch->impacts, stretch->strikes, stretch->maps, i, state);
    }
}

void mill_tally_state(struct mill_observer *observer, struct mill_state *state)
{
    struct mill_tally *t = (struct mill_tally *)observer;
    struct mill_rotorstat *rotor = &t->rotor;
    mill_state_structs(state, "progress", sizeof t->at, 1, &t->at);
    mill_state_structs(state, "batches", sizeof t->batches.at, 1, &t->batches.at);
    mill_state_structs(state, "blocks", sizeof rotor->blocks, 1, &rotor->blocks);
    if (state->loads && state->status == MILL_OK && !sane(t))
        mill_state_refuse(state, "the saved statistics are damaged");
    if (state->status != MILL_OK)
        return;
    mill_state_field(state, "block_power", MILL_FIELD_F64, rotor->blocks, rotor->power);
    mill_state_field(state, "block_torque", MILL_FIELD_F64, rotor->blocks, rotor->torque);
    mill_state_field(state, "block_work", MILL_FIELD_F64, 1, &rotor->work);
    mill_state_field(state, "block_impulse", MILL_FIELD_F64, 1, &rotor->impulse);
    tell_strikes(&t->pairs, state);
    tell_gathered(t->impacts, t->strikes, t->maps, -1, state);
    if (t->tick > 0)
        tell_batches(t, state);
    t->observer.next = t->at.next;
}
