/* The tally's state as one run of bytes, so that an interrupted run ends with the statistics of an
 * uninterrupted one. Only what gathering changes is saved; the rest is made again from the deck. */
#include "base/parts.h"
#include "observe/tally.h"

#include <string.h>

static struct mill_tally_header header_of(const struct mill_tally *tally)
{
    const struct mill_map *cross = &tally->maps->cross, *axial = &tally->maps->axial;
    return (struct mill_tally_header){.tally = sizeof *tally,
                                      .cross = (uint64_t)(cross->n[0] * cross->n[1]),
                                      .axial = (uint64_t)(axial->n[0] * axial->n[1]),
                                      .planned = tally->rotor.planned,
                                      .bits = (uint64_t)tally->pairs.bits,
                                      .batches = tally->batches.at.batches,
                                      .stretches = tally->search ? tally->at.stretches : 0};
}

static size_t add_maps(struct mill_part *part, struct mill_maps *maps)
{
    struct mill_map *cross = &maps->cross, *axial = &maps->axial;
    const size_t crosses = (size_t)(cross->n[0] * cross->n[1]);
    const size_t axials = (size_t)(axial->n[0] * axial->n[1]);
    const struct mill_part list[] = {
        {&maps->samples, sizeof maps->samples},       {cross->hits, crosses * sizeof *cross->hits},
        {cross->flow, crosses * sizeof *cross->flow}, {axial->hits, axials * sizeof *axial->hits},
        {axial->flow, axials * sizeof *axial->flow},
    };
    memcpy(part, list, sizeof list);
    return sizeof list / sizeof *list;
}

/* What a window that is to be found is made of; empty where it is not. */
static size_t add_batches(struct mill_part *part, struct mill_tally *t)
{
    const struct mill_tally_header *n = &t->header;
    struct mill_precision *batches = &t->batches;
    const struct mill_part list[] = {
        {&batches->at, sizeof batches->at},
        {t->before, sizeof t->before},
        {batches->books, batches->books ? ((size_t)n->batches + 1) * sizeof *batches->books : 0},
        {batches->counts, (size_t)n->batches * MILL_PRECISION_SLOTS * sizeof *batches->counts},
    };
    size_t parts = sizeof list / sizeof *list;
    memcpy(part, list, sizeof list);
    for (size_t i = 0; i < n->stretches; i++) {
        struct mill_tally_stretch *stretch = &t->stretch[i];
        part[parts++] = (struct mill_part){stretch->impacts, sizeof stretch->impacts};
        part[parts++] = (struct mill_part){stretch->strikes, sizeof stretch->strikes};
        part[parts++] = (struct mill_part){&stretch->last, sizeof stretch->last};
        parts += add_maps(part + parts, stretch->maps);
    }
    return parts;
}

size_t mill_tally_parts(struct mill_tally *t, struct mill_part *part)
{
    const struct mill_tally_header n = t->header = header_of(t);
    const struct mill_part list[] = {
        {&t->header, sizeof t->header},
        {&t->at, sizeof t->at},
        {t->impacts, sizeof t->impacts},
        {t->strikes, sizeof t->strikes},
        {t->pairs.entry, mill_strikes_room(&t->pairs) * sizeof *t->pairs.entry},
        {&t->rotor.blocks, sizeof t->rotor.blocks},
        {t->rotor.power, (size_t)n.planned * sizeof *t->rotor.power},
        {t->rotor.torque, (size_t)n.planned * sizeof *t->rotor.torque},
        {&t->rotor.work, sizeof t->rotor.work},
        {&t->rotor.impulse, sizeof t->rotor.impulse},
    };
    size_t parts = sizeof list / sizeof *list;
    memcpy(part, list, sizeof list);
    parts += add_maps(part + parts, t->maps);
    if (t->tick > 0)
        parts += add_batches(part + parts, t);
    return parts;
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
    const struct mill_tally_progress *at = &tally->at;
    if (tally->tick > 0 && (tally->batches.at.batches != tally->header.batches || at->length == 0 ||
                            at->stretches >= MILL_TALLY_STRETCHES ||
                            (tally->search && at->stretches != tally->header.stretches)))
        return false;
    return tally->rotor.blocks <= tally->rotor.planned;
}

enum mill_status mill_tally_load(struct mill_tally *tally, struct mill_source *source,
                                 struct mill_error *error)
{
    struct mill_tally_header header;
    struct mill_part part[MILL_TALLY_PARTS];
    const struct mill_tally_header own = header_of(tally);
    if (source->left < sizeof header)
        return mill_error_set(error, MILL_FAILED, "the saved statistics are cut short");
    enum mill_status status = mill_parts_read(source, &header, sizeof header, error);
    if (status != MILL_OK)
        return status;
    if (header.tally != own.tally || header.cross != own.cross || header.axial != own.axial ||
        header.planned != own.planned)
        return mill_error_set(error, MILL_FAILED,
                              "the saved statistics are of another deck or program");
    if (header.bits > 40 || !mill_strikes_resize(&tally->pairs, (int)header.bits))
        return mill_error_set(error, MILL_FAILED, "out of memory for the table of strikes");
    if (header.batches >= MILL_PRECISION_BATCHES || header.stretches >= MILL_TALLY_STRETCHES ||
        (!tally->search && header.stretches > 0))
        return mill_error_set(error, MILL_FAILED, "the saved statistics are damaged");
    tally->batches.at.batches = header.batches;
    tally->at.stretches = header.stretches;
    const size_t parts = mill_tally_parts(tally, part);
    if (source->left != mill_parts_size(part + 1, parts - 1))
        return mill_error_set(error, MILL_FAILED, "the saved statistics are cut short");
    status = mill_parts_read_all(source, part + 1, parts - 1, error);
    if (status == MILL_OK && !sane(tally))
        status = mill_error_set(error, MILL_FAILED, "the saved statistics are damaged");
    tally->observer.next = tally->at.next;
    return status;
}
