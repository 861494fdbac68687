/* The meshes of bodies: reads the file, and leaves of its facets those that balls can meet. */
#include "deck/deck_private.h"
#include "deck/stl.h"
#include "mesh/facets_unite.h"

/* Who hears of the faults of a mesh */
struct hearing {
    struct mill_deck *deck;
    const struct mill_deck_section *section;
    enum mill_status status; /* of the last fault, which is not kept yet */
};

static void hear(void *self, const char *text)
{
    struct hearing *h = self;
    const struct mill_deck_body *given = h->section->form;
    if (h->status == MILL_OK || mill_deck_faults_keep(&h->deck->text, h->status) == MILL_OK)
        h->status =
            mill_deck_wrong(&h->deck->text, h->section->title, "file",
                            "%s; mend it with 'mill mesh %s -o OUT.stl'", text, given->file);
}

static void pass_on(void *self, const char *what, int32_t done, int32_t all)
{
    const struct mill_start_watch *watch = ((struct hearing *)self)->deck->text.reading->watch;
    watch->tell(watch->self, what, done, all);
}

static void warn_of(const struct hearing *h, const struct mill_facets_report *found)
{
    if (found->hollow)
        mill_deck_faults_warn(h->deck, h->section->title, "file",
                              "it is a solid with a room in it, and the balls are in this room, "
                              "which is larger than the solid");
    if (found->closed > 0.0)
        mill_deck_faults_warn(
            h->deck, h->section->title, "file",
            "it encloses %.4g cm3 that no ball can reach, and that are not filled",
            1e6 * found->closed);
}

enum mill_status mill_deck_meshes_read(struct mill_deck *deck,
                                       const struct mill_deck_section *section,
                                       struct mill_body *is)
{
    struct mill_deck_body *given = section->form;
    struct hearing h = {deck, section, MILL_OK};
    struct mill_facets_report found = {.unit = given->unit,
                                       .fault = hear,
                                       .tell = deck->text.reading->watch ? pass_on : NULL,
                                       .self = &h};
    vec3(*facet)[3] = NULL;
    enum mill_status status =
        mill_deck_files_find(&deck->text, section->title, "file", &given->file);
    if (status == MILL_OK)
        status = mill_deck_files_told(&deck->text, section->title, "file",
                                      mill_stl_read(given->file, given->unit, &facet, &is->facets,
                                                    deck->text.reading->error));
    mill_deck_files_keep(&deck->text, facet);
    is->facet = (const vec3(*)[3])facet;
    if (status != MILL_OK)
        return status;
    if (!mill_facets_unite(is, facet, &found))
        return mill_error_set(deck->text.reading->error, MILL_FAILED,
                              "out of memory for the %zu facets of '%s'", is->facets, given->file);
    if (found.faults > MILL_FACETS_TOLD)
        mill_deck_faults_more(&deck->text, found.faults - MILL_FACETS_TOLD);
    if (h.status == MILL_OK)
        warn_of(&h, &found);
    return h.status;
}
