/* Random motions of every kind, each on the one before it, for the tests of motions and bodies. */
#ifndef MOTION_FIXTURE_H
#define MOTION_FIXTURE_H

#include "draws.h"
#include "millsim/motion.h"

enum { CHAIN = 3, ROWS = 9 };
enum { TURN, SWING, SHIFT, TABLE, MOTION_KINDS };

struct link {
    int kind;
    struct mill_turn turn;
    struct mill_swing swing;
    struct mill_shift shift;
    struct mill_table table;
    double row[ROWS][7];
};

/* Up to three motions, each on the one before it */
struct chain {
    struct link is[CHAIN];
    struct mill_motion *link[CHAIN];
    int count;
    const struct mill_motion *top;
};

static inline void chain_open(struct chain *c)
{
    for (int k = 0; k < c->count; k++) {
        struct link *is = &c->is[k];
        is->table = (struct mill_table){ROWS, (const double(*)[7])is->row};
        c->link[k] = is->kind == TURN    ? mill_turn_type.create(&is->turn)
                     : is->kind == SWING ? mill_swing_type.create(&is->swing)
                     : is->kind == SHIFT ? mill_shift_type.create(&is->shift)
                                         : mill_table_type.create(&is->table);
        ck_assert_ptr_nonnull(c->link[k]);
        c->link[k]->on = k > 0 ? c->link[k - 1] : NULL;
    }
    c->top = c->count > 0 ? c->link[c->count - 1] : NULL;
}

static inline void chain_close(struct chain *c)
{
    for (int k = 0; k < c->count; k++)
        free(c->link[k]);
}

static inline vec3 random_centre(uint64_t *seed)
{
    return below(seed, 4) ? vec3_scale(direction(seed), uniform(seed, 0.0, 0.3)) : nought;
}

/* A period of smooth changes, at uneven times; the last row is the first */
static inline void random_rows(uint64_t *seed, double row[ROWS][7])
{
    const double period = log_uniform(seed, 0.03, 1.0);
    double phase[6], size[6];
    for (int i = 0; i < 6; i++) {
        phase[i] = uniform(seed, -PI, PI);
        size[i] = i < 3 ? uniform(seed, 0.0, 0.03) : uniform(seed, 0.0, 1.5);
    }
    for (int k = 0; k < ROWS; k++) {
        const double at =
            (k + (k > 0 && k < ROWS - 1 ? uniform(seed, -0.2, 0.2) : 0.0)) / (ROWS - 1.0);
        row[k][0] = 0.7 + period * at;
        for (int i = 0; i < 6; i++)
            row[k][i + 1] = size[i] * sin(2.0 * PI * at + phase[i]);
    }
    for (int i = 0; i < 6; i++)
        row[ROWS - 1][i + 1] = row[0][i + 1];
}

static inline void random_link(uint64_t *seed, struct link *is, int kind)
{
    is->kind = kind;
    is->turn = (struct mill_turn){.centre = random_centre(seed),
                                  .axis = vec3_scale(direction(seed), log_uniform(seed, 0.1, 10.0)),
                                  .speed = below(seed, 5) ? uniform(seed, -100.0, 100.0) : 0.0,
                                  .angle = uniform(seed, -10.0, 10.0)};
    is->swing =
        (struct mill_swing){.centre = random_centre(seed),
                            .axis = vec3_scale(direction(seed), log_uniform(seed, 0.1, 10.0)),
                            .amplitude = uniform(seed, -0.6, 0.6),
                            .frequency = below(seed, 5) ? log_uniform(seed, 1.0, 40.0) : 0.0,
                            .phase = uniform(seed, -10.0, 10.0)};
    is->shift =
        (struct mill_shift){.amplitude = vec3_scale(direction(seed), log_uniform(seed, 1e-4, 0.03)),
                            .phase = vec3_scale(direction(seed), 4.0),
                            .frequency = below(seed, 5) ? log_uniform(seed, 1.0, 40.0) : 0.0};
    random_rows(seed, is->row);
}

/* which 0: a rotor. 1 to MOTION_KINDS: that kind alone. Others: of any kinds, some turns about one
 * axis, as those of a planetary mill */
static inline struct chain random_chain(uint64_t *seed, int which)
{
    struct chain c = {.count = which <= MOTION_KINDS ? 1 : 1 + below(seed, CHAIN)};
    const bool parallel = below(seed, 3) == 0;
    for (int k = 0; k < c.count; k++) {
        const bool any = which > MOTION_KINDS;
        random_link(seed, &c.is[k],
                    any         ? (parallel ? below(seed, 2) : below(seed, MOTION_KINDS))
                    : which > 0 ? which - 1
                                : TURN);
        if (which == 0) {
            c.is[k].turn.axis = vec3_make(2.0, 0.0, 0.0);
            c.is[k].turn.centre = nought;
        }
        if (any && parallel && k > 0)
            c.is[k].turn.axis = c.is[k].swing.axis = vec3_scale(c.is[0].turn.axis, -2.0);
        else if (parallel)
            c.is[k].swing.axis = c.is[k].turn.axis;
    }
    return c;
}

/* Rodrigues' formula, on its own */
static inline vec3 turned(vec3 a, vec3 axis, double angle)
{
    const double length = vec3_norm(axis);
    const vec3 e = length > 0.0 ? vec3_scale(axis, 1.0 / length) : axis;
    const vec3 along = vec3_scale(e, vec3_dot(e, a));
    if (length <= 0.0)
        return a;
    return vec3_axpy(vec3_axpy(along, cos(angle), vec3_sub(a, along)), sin(angle),
                     vec3_cross(e, a));
}

#endif
