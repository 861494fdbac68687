/* Builds the surfaces of a mill. */
#include "geometry/shapes.h"

#include <assert.h>
#include <stdlib.h>

const struct mill_solid *mill_shapes_solid(int i)
{
#define TABLE(word, solid) &solid,
    static const struct mill_solid *const list[] = {MILL_SOLID_LIST(TABLE) NULL};
    return list[i];
}

void mill_shapes_free(struct mill_shape **shapes, int count)
{
    for (int k = 0; shapes && k < count && shapes[k]; k++) {
        if (shapes[k]->type->free)
            shapes[k]->type->free(shapes[k]);
        free(shapes[k]);
    }
    free(shapes);
}

const struct mill_setup_surface *mill_shapes_container(const struct mill_setup *setup)
{
    for (int k = 0; k < setup->surfaces; k++)
        if (setup->surface[k].body->inside)
            return &setup->surface[k];
    return NULL;
}

/* The surfaces that are made, and the data for them */
struct making {
    const struct mill_reach *places;
    struct mill_motion *const *motion;
    const struct mill_motion *carries; /* the motion that moves the container */
    struct mill_shape **shape;
    int count, room;
};

/* Makes all of a body, or one of its walls */
static bool make(struct making *m, const struct mill_setup_surface *s,
                 const struct mill_solid *solid, int wall)
{
    const struct mill_wall is = mill_body_wall(solid, s->body, wall);
    const struct mill_shape_type *type = wall < 0 ? solid->surface
                                         : is.own ? is.own
                                                  : &mill_wall_type;
    const bool end = wall >= 0 && is.flat && s->ends > 0;
    struct mill_bodied *body = m->count < m->room ? calloc(1, type->size) : NULL;
    if (!body)
        return false;
    struct mill_shape *shape = m->shape[m->count++] = &body->convex.base;
    *shape = (struct mill_shape){type, solid, wall, .kind = end ? s->ends : s->kind};
    shape->motion = s->motion == MILL_STILL ? NULL : m->motion[s->motion];
    shape->number = end ? wall - 1 : s->number;
    body->is = *s->body;
    const bool good = mill_body_create(body, m->places);
    /* What moves with the container, or only turns about its own axis, presses no ball. */
    shape->pinches = !s->body->inside && !shape->fixed && shape->motion != m->carries;
    return good;
}

/* Makes each wall of a container; any other body is made as one. */
static bool make_walls(struct making *m, const struct mill_setup_surface *s)
{
    const struct mill_solid *solid = s->solid;
    if (solid->moving && s->motion != MILL_STILL &&
        !mill_motion_pose(m->motion[s->motion], 0.0).about_x)
        solid = solid->moving;
    if (!s->body->inside || !solid->walls)
        return make(m, s, solid, MILL_SOLID_WHOLE);
    struct mill_wall wall[MILL_WALLS];
    const int walls = solid->walls(s->body, wall);
    bool good = true;
    for (int k = 0; good && k < walls; k++)
        good = make(m, s, solid, k);
    return good;
}

bool mill_shapes_create(const struct mill_setup *setup, const struct mill_reach *places,
                        struct mill_motion *const *motion, struct mill_shape ***shapes, int *count)
{
    const struct mill_setup_surface *container = mill_shapes_container(setup);
    const int carries = container ? container->motion : MILL_STILL;
    struct making m = {.places = places, .motion = motion};
    m.carries = carries >= 0 ? motion[carries] : NULL;
    m.room = setup->surfaces + MILL_WALLS;
    m.shape = *shapes = calloc((size_t)m.room, sizeof **shapes);
    bool good = *shapes;
    for (int k = 0; good && k < setup->surfaces; k++) {
        assert(setup->surface[k].motion < setup->motions);
        good = make_walls(&m, &setup->surface[k]);
    }
    *count = m.count;
    return good;
}
