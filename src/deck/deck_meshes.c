/* The meshes of bodies: reads the file, and leaves of its facets those that balls can meet. */
#include "deck/deck_private.h"
#include "deck/stl.h"
#include "mesh/facets_unite.h"

/* Who hears of a mesh */
struct hearing {
    struct mill_deck *deck;
    const struct mill_deck_section *section;
};

static void hear(void *self, const char *text)
{
    const struct hearing *h = self;
    mill_deck_wrong(&h->deck->text, h->section->title, "file",
                    "%s; mend it with 'mill mesh %s -o OUT.stl'", text,
                    ((struct mill_deck_body *)h->section->form)->file);
}

static void pass_on(void *self, const char *what, int32_t done, int32_t all)
{
    const struct mill_start_watch *watch = ((struct hearing *)self)->deck->text.reading->watch;
    watch->tell(watch->self, what, done, all);
}

bool mill_deck_meshes_read(struct mill_deck *deck, const struct mill_deck_section *section,
                           struct mill_body *is)
{
    const struct mill_deck_text *text = &deck->text;
    struct mill_deck_body *given = section->form;
    struct hearing h = {deck, section};
    struct mill_facets_report found = {.unit = given->unit,
                                       .fault = hear,
                                       .tell = text->reading->watch ? pass_on : NULL,
                                       .self = &h};
    struct mill_error why;
    vec3(*facet)[3] = NULL;
    if (!mill_deck_files_find(&deck->text, section->title, "file", &given->file))
        return false;
    const enum mill_status status =
        mill_stl_read(given->file, given->unit, &facet, &is->facets, &why);
    if (status == MILL_BAD_DECK)
        return mill_deck_wrong(text, section->title, "file", "%s", why.text);
    if (status != MILL_OK)
        return mill_deck_failed(text, "%s", why.text);
    is->facet = (const vec3(*)[3])mill_deck_keep(text, facet);
    if (!is->facet)
        return false;
    if (!mill_facets_unite(is, facet, &found))
        return mill_deck_failed(text, "out of memory for the %zu facets of '%s'", is->facets,
                                given->file);
    if (found.faults > MILL_FACETS_TOLD)
        text->reading->more += found.faults - MILL_FACETS_TOLD;
    if (found.faults == 0 && found.hollow)
        mill_deck_faults_warn(deck, section->title, "file",
                              "it is a solid with a room in it, and the balls are in this room, "
                              "which is larger than the solid");
    if (found.faults == 0 && found.closed > 0.0)
        mill_deck_faults_warn(
            deck, section->title, "file",
            "it encloses %.4g cm3 that no ball can reach, and that are not filled",
            1e6 * found.closed);
    return found.faults == 0;
}
