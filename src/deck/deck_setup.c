/* The deck as a setup. What names, lines and files are stays here; the world is built from numbers,
 * and its faults come back as codes. */
#include "deck/deck_setup.h"

#include "geometry/shapes.h"

#include <assert.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* The parts of a setup that are lists */
struct lists {
    struct mill_turn rotor;
    struct mill_setup_motion motion;
    struct mill_shaft shaft;
    struct mill_setup_surface *surface;
    struct mill_setup_balls *balls;
    struct mill_deck_start start;
};

static void free_lists(struct lists *lists)
{
    free(lists->surface);
    free(lists->balls);
    free(lists->start.ball);
    free(lists->start.line);
}

static void add_rotor(const struct mill_deck *deck, struct lists *lists, struct mill_setup *setup)
{
    lists->rotor = (struct mill_turn){
        .axis = {1.0, 0.0, 0.0}, .speed = deck->rotor_speed, .angle = deck->rotor_angle};
    lists->motion = (struct mill_setup_motion){
        .type = &mill_turn_type, .form = &lists->rotor, .on = MILL_STILL};
    setup->motion = &lists->motion;
    setup->motions = 1;
    if (deck->shaft_radius == 0.0)
        return;
    lists->shaft.radius = deck->shaft_radius;
    lists->surface[setup->surfaces++] = (struct mill_setup_surface){
        .type = &mill_cylinder_shaft_type, .form = &lists->shaft, .number = -1, .motion = 0};
}

static void add_shapes(const struct mill_deck *deck, struct lists *lists, struct mill_setup *setup)
{
    for (int k = 0; k < deck->shapes; k++) {
        const struct mill_deck_shape *s = &deck->shape[k];
        assert(deck->rotor || !s->type->on_rotor);
        lists->surface[setup->surfaces++] = (struct mill_setup_surface){
            .type = s->type,
            .form = s->form,
            .number = s->number,
            .motion = s->type->on_rotor ? 0 : MILL_STILL,
        };
    }
    setup->surface = lists->surface;
}

static enum mill_status make_setup(const struct mill_deck *deck,
                                   const struct mill_start_watch *watch, struct lists *lists,
                                   struct mill_setup *setup, struct mill_error *error)
{
    *setup = (struct mill_setup){
        .gravity = deck->gravity,
        .drum = mill_deck_drum(deck),
        .species = deck->kinds,
        .speed = deck->speed,
        .seed = (unsigned long)deck->seed,
        .rebound_floor = deck->rebound_floor,
    };
    memcpy(setup->law, deck->law, sizeof setup->law);
    lists->surface = calloc((size_t)deck->shapes + 1, sizeof *lists->surface);
    lists->balls = calloc((size_t)deck->kinds, sizeof *lists->balls);
    if (!lists->surface || !lists->balls)
        return mill_error_set(error, MILL_FAILED, "out of memory for the mill's surfaces");
    for (int k = 0; k < deck->kinds; k++) {
        const struct mill_deck_balls *b = &deck->balls[k];
        lists->balls[k] = (struct mill_setup_balls){
            .name = b->name,
            .diameter = b->diameter,
            .density = b->density,
            .count = (int32_t)b->count,
        };
    }
    setup->balls = lists->balls;
    if (deck->rotor)
        add_rotor(deck, lists, setup);
    add_shapes(deck, lists, setup);
    if (!deck->start)
        return MILL_OK;
    const enum mill_status status =
        mill_deck_start_read(deck, (int32_t)deck->all, watch, &lists->start, error);
    setup->start = lists->start.ball;
    return status;
}

/* ---- faults ---- */

/* "384 big, 3072 small", or the number alone of one kind */
static void name_counts(const struct mill_deck *deck, const int32_t *count, char *text, size_t size)
{
    size_t used = 0;
    if (deck->kinds == 1)
        snprintf(text, size, "%ld", (long)count[0]);
    for (int k = 0; deck->kinds > 1 && k < deck->kinds && k < MILL_FAULT_SPECIES && used < size;
         k++)
        used += (size_t)snprintf(text + used, size - used, "%s%ld %s", k ? ", " : "",
                                 (long)count[k], deck->balls[k].name);
}

static enum mill_status tell_no_room(const struct mill_deck *deck, const struct mill_fault *fault,
                                     struct mill_error *error)
{
    const char *section = deck->balls[0].section;
    char counts[512];
    const bool mixture = deck->kinds > 1;
    if (fault->fits[0] == 0)
        return mill_deck_fault(deck, error, section, "count",
                               "not a single ball%s fits: make balls or rotor smaller",
                               mixture ? " of each kind" : "");
    name_counts(deck, fault->fits, counts, sizeof counts);
    return mill_deck_fault(deck, error, section, "count",
                           "%ld balls do not fit (solid fraction %.3f of the free volume); %s do",
                           (long)deck->all, fault->amount, counts);
}

static enum mill_status tell(const struct mill_deck *deck, const struct lists *lists,
                             const struct mill_fault *fault, struct mill_error *error)
{
    const long *line = lists->start.line;
    switch (fault->code) {
    case MILL_FAULT_NONE:
        return MILL_OK;
    case MILL_FAULT_MEMORY:
        return mill_error_set(error, MILL_FAILED, "out of memory for the mill and its balls");
    case MILL_FAULT_NUMBER:
        return mill_error_set(error, MILL_FAILED, "a number of the deck is out of range");
    case MILL_FAULT_SPEED:
        return mill_error_set(error, MILL_BAD_DECK,
                              "%s:%ld: a speed beyond that of light: give m/s and rad/s",
                              deck->start, line[fault->ball]);
    case MILL_FAULT_BALL_IN_SHAPE:
        return mill_error_set(error, MILL_BAD_DECK, "%s:%ld: ball overlaps %s by %.4g m: move it",
                              deck->start, line[fault->ball], mill_kinds_partner[fault->kind],
                              fault->amount);
    case MILL_FAULT_BALL_IN_BALL:
        return mill_error_set(
            error, MILL_BAD_DECK,
            "%s:%ld: ball overlaps the one of line %ld by %.4g m: move one of them", deck->start,
            line[fault->ball], line[fault->other], fault->amount);
    case MILL_FAULT_NO_ROOM:
        break;
    }
    return tell_no_room(deck, fault, error);
}

enum mill_status mill_deck_setup_world(const struct mill_deck *deck,
                                       const struct mill_start_watch *watch,
                                       struct mill_world **world, struct mill_error *error)
{
    struct lists lists = {.surface = NULL};
    struct mill_setup setup;
    struct mill_fault fault;
    *world = NULL;
    enum mill_status status = make_setup(deck, watch, &lists, &setup, error);
    if (status == MILL_OK) {
        mill_start_world(&setup, watch, world, &fault);
        status = tell(deck, &lists, &fault, error);
    }
    free_lists(&lists);
    return status;
}
