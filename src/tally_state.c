/* The tally's state as one run of bytes, so that an interrupted run ends with the statistics of an
 * uninterrupted one. Only what gathering changes is saved; the rest is made again from the deck. */
#include "parts.h"
#include "tally.h"

#include <string.h>

enum { PARTS = 14 };

/* What stands in front: lengths that must agree, and the one that sets the length of the table. */
struct header {
    uint64_t tally, cross, axial, planned, bits;
};

static struct header header_of(const struct mill_tally *tally)
{
    const struct mill_map *cross = &tally->maps->cross, *axial = &tally->maps->axial;
    return (struct header){.tally = sizeof *tally,
                           .cross = (uint64_t)(cross->n[0] * cross->n[1]),
                           .axial = (uint64_t)(axial->n[0] * axial->n[1]),
                           .planned = tally->rotor.planned,
                           .bits = (uint64_t)tally->pairs.bits};
}

static void list_parts(const struct mill_tally *tally, struct mill_part part[PARTS])
{
    struct mill_tally *t = (struct mill_tally *)tally; /* written to only by mill_tally_load */
    const struct header n = header_of(tally);
    struct mill_map *cross = &t->maps->cross, *axial = &t->maps->axial;
    const struct mill_part parts[PARTS] = {
        {&t->at, sizeof t->at},
        {t->impacts, sizeof t->impacts},
        {t->strikes, sizeof t->strikes},
        {t->pairs.entry, mill_strikes_room(&t->pairs) * sizeof *t->pairs.entry},
        {&t->rotor.blocks, sizeof t->rotor.blocks},
        {t->rotor.power, (size_t)n.planned * sizeof *t->rotor.power},
        {t->rotor.torque, (size_t)n.planned * sizeof *t->rotor.torque},
        {&t->rotor.work, sizeof t->rotor.work},
        {&t->rotor.impulse, sizeof t->rotor.impulse},
        {&t->maps->samples, sizeof t->maps->samples},
        {cross->hits, (size_t)n.cross * sizeof *cross->hits},
        {cross->flow, (size_t)n.cross * sizeof *cross->flow},
        {axial->hits, (size_t)n.axial * sizeof *axial->hits},
        {axial->flow, (size_t)n.axial * sizeof *axial->flow},
    };
    memcpy(part, parts, sizeof parts);
}

size_t mill_tally_state_size(const struct mill_tally *tally)
{
    struct mill_part part[PARTS];
    list_parts(tally, part);
    return sizeof(struct header) + mill_parts_size(part, PARTS);
}

void mill_tally_save(const struct mill_tally *tally, unsigned char *state)
{
    struct mill_part part[PARTS];
    list_parts(tally, part);
    const struct header header = header_of(tally);
    memcpy(state, &header, sizeof header);
    mill_parts_pack(part, PARTS, state + sizeof header);
}

/* Indices that a damaged file must not smuggle in */
static bool sane(const struct mill_tally *tally)
{
    const size_t room = mill_strikes_room(&tally->pairs);
    for (size_t i = 0; i < room; i++) {
        const struct mill_strike *strike = &tally->pairs.entry[i];
        if (strike->normal < -1 || strike->normal >= MILL_SPECTRUM_SLOTS ||
            strike->tangential < 0 || strike->tangential >= MILL_SPECTRUM_SLOTS)
            return false;
    }
    return tally->rotor.blocks <= tally->rotor.planned;
}

enum mill_status mill_tally_load(struct mill_tally *tally, const unsigned char *state, size_t size,
                                 struct mill_error *error)
{
    struct header header;
    const struct header own = header_of(tally);
    if (size < sizeof header)
        return mill_error_set(error, MILL_FAILED, "the saved statistics are cut short");
    memcpy(&header, state, sizeof header);
    if (header.tally != own.tally || header.cross != own.cross || header.axial != own.axial ||
        header.planned != own.planned)
        return mill_error_set(error, MILL_FAILED,
                              "the saved statistics are of another deck or program");
    if (header.bits > 40 || !mill_strikes_resize(&tally->pairs, (int)header.bits))
        return mill_error_set(error, MILL_FAILED, "out of memory for the table of strikes");
    if (size != mill_tally_state_size(tally))
        return mill_error_set(error, MILL_FAILED, "the saved statistics are cut short");
    struct mill_part part[PARTS];
    list_parts(tally, part);
    mill_parts_unpack(part, PARTS, state + sizeof header);
    if (!sane(tally))
        return mill_error_set(error, MILL_FAILED, "the saved statistics are damaged");
    tally->observer.next = tally->at.next;
    return MILL_OK;
}
