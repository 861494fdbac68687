/* Builds the surfaces of a mill. */
#include "geometry/shapes.h"

#include <assert.h>
#include <stdlib.h>

const struct mill_shape_type *const mill_shapes_named[] = {&mill_blade_type, NULL};

struct mill_chamber mill_shapes_chamber(const struct mill_setup_drum *drum)
{
    assert(drum->radius > 0.0 && drum->length > 0.0);
    /* a circle is a profile with buckles of height 0 */
    const bool wavy = drum->buckles > 0;
    const double half = 0.5 * drum->length;
    const double far = drum->radius + (wavy ? drum->buckle_height : 0.0);
    return (struct mill_chamber){
        .drum =
            mill_profile_make(wavy ? drum->buckles : 2, drum->radius,
                              wavy ? drum->buckle_height : 0.0, wavy ? drum->buckle_angle : 0.0),
        .half_length = half,
        .places = {{-half, -far, -far}, {half, far, far}, far},
    };
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

/* Is the surface a body with the balls inside? */
static bool holds(const struct mill_setup_surface *surface)
{
    return surface->type->hull && ((const struct mill_body *)surface->form)->inside;
}

const struct mill_setup_surface *mill_shapes_container(const struct mill_setup *setup)
{
    for (int k = 0; k < setup->surfaces; k++)
        if (holds(&setup->surface[k]))
            return &setup->surface[k];
    return NULL;
}

/* The surfaces that are made, and the data for them */
struct making {
    const struct mill_setup *setup;
    const struct mill_chamber *chamber;
    struct mill_motion *const *motion;
    const struct mill_motion *carries; /* the motion that moves the container */
    struct mill_shape **shape;
    int count, room;
};

/* A body that moves with the container, or that only turns about its own axis, cannot press a ball
 * against anything. */
static bool can_pinch(const struct making *m, const struct mill_setup_surface *s,
                      const struct mill_shape *shape)
{
    return s->type && s->type->hull ? !holds(s) && !shape->fixed && shape->motion != m->carries
                                    : shape->type->pinches;
}

/* Makes one surface of the world; type and form may be those of one wall of it */
static bool make(struct making *m, const struct mill_setup_surface *s,
                 const struct mill_shape_type *type, const void *form)
{
    struct mill_shape *shape = m->count < m->room ? calloc(1, type->size) : NULL;
    if (!shape)
        return false;
    assert(s->motion == MILL_STILL || (s->motion >= 0 && s->motion < m->setup->motions));
    m->shape[m->count++] = shape;
    shape->type = type;
    shape->kind = s->kind > 0 ? s->kind : (int)type->kind;
    shape->motion = s->motion == MILL_STILL ? NULL : m->motion[s->motion];
    shape->number = s->number;
    shape->fixed = shape->motion == NULL;
    const bool good = type->create(shape, form, m->chamber);
    shape->pinches = can_pinch(m, s, shape);
    return good;
}

/* Makes each wall of a container; any other surface is made as one. */
static bool make_walls(struct making *m, const struct mill_setup_surface *s)
{
    const struct mill_body *body = s->form;
    if (!holds(s) || !s->type->walls)
        return make(m, s, s->type, s->form);
    struct mill_wall wall[MILL_WALLS];
    const int walls = s->type->walls(body, wall);
    bool good = true;
    for (int k = 0; good && k < walls; k++) {
        const struct mill_wall_of of = {body, s->type->hull(body), wall[k], k ? NULL : s->type};
        good = make(m, s, &mill_wall_type, &of);
    }
    return good;
}

/* Makes a round or wavy drum with its end walls, if it has any. If it does not only turn about its
 * own axis, its walls are those of a body. */
static bool make_drum(struct making *m)
{
    const struct mill_setup_drum *drum = &m->setup->drum;
    const bool wavy = m->chamber->drum.height > 0.0;
    const int motion = drum->rides - 1;
    const bool moves = motion >= 0 && !mill_motion_pose(m->motion[motion], 0.0).about_x;
    const struct mill_body body = {.inside = true,
                                   .x = {0.0, 1.0, 0.0},
                                   .y = {0.0, 0.0, 1.0},
                                   .z = {1.0, 0.0, 0.0},
                                   .radius = drum->radius,
                                   .length = drum->length};
    struct mill_wall wall[MILL_WALLS];
    bool good = true;
    mill_round_cylinder_type.walls(&body, wall);
    for (int k = 0; good && k < (drum->periodic ? 1 : 3); k++) {
        const struct mill_setup_surface s = {
            .number = k - 1, .motion = motion, .kind = k ? MILL_BALL_WALL : MILL_BALL_DRUM};
        const struct mill_wall_of of = {&body, mill_round_cylinder_type.hull(&body), wall[k],
                                        k ? NULL : &mill_round_cylinder_type};
        if (k == 0 && wavy)
            good = make(m, &s, &mill_wavy_type, NULL);
        else if (moves)
            good = make(m, &s, &mill_wall_type, &of);
        else
            good = make(m, &s, k ? &mill_plate_type : &mill_cylinder_drum_type, NULL);
    }
    return good;
}

bool mill_shapes_create(const struct mill_setup *setup, const struct mill_chamber *chamber,
                        struct mill_motion *const *motion, struct mill_shape ***shapes, int *count)
{
    const struct mill_setup_surface *container = mill_shapes_container(setup);
    const int carries = container ? container->motion : setup->drum.rides - 1;
    struct making m = {.setup = setup, .chamber = chamber, .motion = motion};
    m.carries = carries >= 0 ? motion[carries] : NULL;
    m.room = 3 + setup->surfaces + MILL_WALLS;
    m.shape = *shapes = calloc((size_t)m.room, sizeof **shapes);
    bool good = *shapes && (setup->drum.radius <= 0.0 || make_drum(&m));
    for (int k = 0; good && k < setup->surfaces; k++)
        good = make_walls(&m, &setup->surface[k]);
    *count = m.count;
    return good;
}
