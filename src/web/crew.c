/* A crew without threads, which the module does not have */
#include "engine/crew.h"

#include <stdlib.h>

struct mill_crew {
    int parts;
};

struct mill_crew *mill_crew_create(int parts)
{
    struct mill_crew *crew = malloc(sizeof *crew);
    if (crew)
        crew->parts = parts;
    return crew;
}

void mill_crew_free(struct mill_crew *crew)
{
    free(crew);
}

int mill_crew_begin(struct mill_crew *crew)
{
    (void)crew;
    return 1;
}

void mill_crew_end(struct mill_crew *crew)
{
    (void)crew;
}

void mill_crew_do(struct mill_crew *crew, mill_crew_fn *part, void *work)
{
    for (int k = 0; k < crew->parts; k++)
        part(work, k);
}
