/* The check uses conservative advancement (B. Mirtich, PhD thesis, Berkeley 1996, 2.3.2). No point
 * of two bodies moves faster than a known bound, so the bodies cannot meet before the distance
 * between them is used up. The next step ("march") goes to that time and measures the distance
 * again. A motion that carries both bodies does not change their distance, so it is left out: in
 * the frame of a planetary jar, its agitator only turns.
 *
 * Most pairs need no march: bodies that never come near each other; bodies that only turn about one
 * direction and are apart along it; and a round body that lies on the turning axis of the other. */
#include "start/clash.h"

#include "geometry/body.h"
#include "start/clash_gap.h"
#include "start/clash_side.h"

#include <stdlib.h>

/* Relative to the size: bodies nearer than this touch */
#define TOUCH 1e-6
/* [s] checked where the motions have no common period and the setup gives no horizon */
#define HORIZON 1.0
/* A check that takes long becomes coarser. After PATIENCE distances ("looks") no march goes on
 * beyond the horizon, if there is one, and no step is shorter than COARSE of the size times the
 * number of looks so far. An overlap missed that way is shallower than half a step. After
 * MOST_LOOKS, about 10 s, the check ends. */
enum { PATIENCE = 1000000, MOST_LOOKS = 20000000 };
#define COARSE 1e-10

struct check {
    const struct mill_setup *setup;
    struct mill_motion *const *motion;
    struct mill_fault *fault;
    int solids;
    struct mill_clash_solid *solid;
    struct mill_clash_solid around; /* the container, if it is not one of the solids */
    struct mill_body drum;          /* the drum as a body */
    const struct mill_clash_solid *container;
    int walls;
    struct mill_wall wall[MILL_WALLS];
    struct mill_clash_side *side[2]; /* the solids on each of the two motions */
    int sides[2];
    double end; /* [s] */
    long looks;
};

/* ---- marches ---- */

/* Two solids, or a solid and some of the container's walls */
struct march {
    const struct mill_clash_side *a, *b;
    unsigned walls;
    double near, speed;
};

static double gap_at(struct check *c, const struct march *m, double t)
{
    const struct mill_pose a = mill_motion_pose(m->a->motion, t),
                           b = mill_motion_pose(m->b->motion, t);
    struct mill_pose in = mill_clash_side_relative(&a, &b);
    if (m->walls == 0) {
        const struct mill_clash_gap gap = mill_clash_gap_solids(m->a->is, m->b->is, &in, m->near);
        c->looks += gap.looks;
        return gap.least;
    }
    const struct mill_body *is = c->container->body;
    const struct mill_pose own = {.place = is->centre, .x = is->x, .y = is->y, .z = is->z};
    double least = INFINITY;
    in = mill_clash_side_relative(&in, &own);
    for (int k = 0; k < c->walls; k++)
        if (m->walls >> k & 1) {
            const struct mill_clash_gap gap =
                mill_clash_gap_wall(&c->wall[k], m->a->is, &in, m->near);
            c->looks += gap.looks;
            least = fmin(least, gap.least);
        }
    return least;
}

static struct mill_passing passing_of(const struct check *c, const struct march *m, double gap,
                                      double t)
{
    const int other = m->b->is == &c->around ? -1 : m->b->is->surface;
    return (struct mill_passing){m->a->is->surface, other, gap, t};
}

/* Notes the first touch before `end`, if no earlier one is known. */
static void march(struct check *c, const struct march *m, double end, enum mill_fault_code code)
{
    const double horizon = c->setup->horizon;
    double t = 0.0, gap;
    for (;;) {
        const double first = c->fault->code == MILL_FAULT_NONE ? (double)INFINITY : c->fault->when;
        const bool late = c->looks > PATIENCE;
        if (t > end || t >= first || (late && horizon > 0.0 && t > horizon))
            return;
        if (c->looks > MOST_LOOKS && t > 0.0) { /* the start is always checked */
            if (t < c->fault->unchecked.when)
                c->fault->unchecked = passing_of(c, m, 0.0, t);
            return;
        }
        gap = gap_at(c, m, t);
        if (gap <= m->near)
            break;
        if (gap < c->fault->narrowest.gap)
            c->fault->narrowest = passing_of(c, m, gap, t);
        if (m->speed == 0.0)
            return;
        t += fmax(gap, late ? COARSE * (double)c->looks * m->near / TOUCH : 0.0) / m->speed;
    }
    *c->fault = (struct mill_fault){.code = code,
                                    .other = m->b->is->surface,
                                    .amount = m->walls && gap < 0.0 ? -gap : 0.0,
                                    .when = t};
    if (code == MILL_FAULT_OUTSIDE)
        c->fault->other = m->a->is->surface;
    else
        c->fault->ball = m->a->is->surface;
}

/* ---- pairs ---- */

static bool is_in_mesh(const struct mill_clash_side *a, const struct mill_clash_side *mesh)
{
    const struct mill_clash_part *p = a->is->part;
    const vec3 at = a->is->mesh ? vec3_add(p->centre, p->x) : p->centre;
    return mill_clash_solid_holds(mesh->is,
                                  mill_pose_in(&mesh->begin, mill_pose_out(&a->begin, at)));
}

static void check_pair(struct check *c, const struct mill_clash_side *a,
                       const struct mill_clash_side *b)
{
    const bool holds = b->is == c->container;
    const enum mill_fault_code code = holds ? MILL_FAULT_OUTSIDE : MILL_FAULT_CLASH;
    const double near = TOUCH * (a->size + b->size);
    if (a->keeps && b->keeps)
        return;
    if (!holds && mill_clash_side_are_apart(a, b, near))
        return;
    /* a body inside a mesh, far from its facets */
    const struct march hidden = {a, b, 0, INFINITY, 0.0};
    if (b->is->mesh && is_in_mesh(a, b) != holds)
        march(c, &hidden, 0.0, code);
    else if (a->is->mesh && !holds && is_in_mesh(b, a))
        march(c, &hidden, 0.0, code);
    const bool steady = mill_clash_side_are_steady(a, b);
    const struct march open = {a, b, 0, near, steady ? 0.0 : a->speed + b->speed};
    march(c, &open, c->end, code);
}

/* A body may pierce a wall if both never change the space that they occupy. For other walls the
 * distance may be constant. */
static void check_walls(struct check *c, const struct mill_clash_side *a,
                        const struct mill_clash_side *b)
{
    const struct mill_body *is = c->container->body;
    const bool axial =
        is == &c->drum && c->setup->drum.rides == 0 && mill_motion_pose(a->is->motion, 0.0).about_x;
    if (!a->is->body && (a->is->turned || axial))
        return;
    struct march steady = {a, b, 0, TOUCH * (a->size + b->size), 0.0}, changing = steady;
    for (int k = 0; k < c->walls; k++) {
        const struct mill_wall *w = &c->wall[k];
        const vec3 normal = mill_pose_turn_out(&b->begin, mill_body_turn_out(is, w->normal));
        const bool kept = b->keeps || (w->flat && mill_clash_side_is_level(b, normal));
        /* a drum with buckles that turns is not round */
        const bool buckles =
            is == &c->drum && k == 0 && c->setup->drum.buckles > 0 && b->bounds.turning > 0.0;
        if (kept && a->keeps && !buckles)
            continue;
        const bool same =
            a->speed + b->speed == 0.0 || (kept && (w->flat ? mill_clash_side_is_level(a, normal)
                                                            : mill_clash_side_turns_about(a, b)));
        if (same) {
            steady.walls |= 1U << k;
        } else {
            changing.walls |= 1U << k;
            changing.speed = fmax(changing.speed, a->speed + (kept ? 0.0 : b->speed));
        }
    }
    if (steady.walls)
        march(c, &steady, 0.0, MILL_FAULT_OUTSIDE);
    if (changing.walls)
        march(c, &changing, c->end, MILL_FAULT_OUTSIDE);
}

static void check_two(struct check *c, const struct mill_clash_side *a,
                      const struct mill_clash_side *b)
{
    if (a->is == c->container || (b->is != c->container && a->is->surface > b->is->surface)) {
        const struct mill_clash_side *swap = a;
        a = b;
        b = swap;
    }
    if (b->is == c->container && c->walls > 0)
        check_walls(c, a, b);
    else
        check_pair(c, a, b);
}

/* ---- motions ---- */

/* The innermost motion that carries both; NULL: only the laboratory */
static const struct mill_motion *common(const struct mill_motion *a, const struct mill_motion *b)
{
    for (const struct mill_motion *m = a; m; m = m->on)
        for (const struct mill_motion *n = b; n; n = n->on)
            if (m == n)
                return m;
    return NULL;
}

/* The motion in the chain of `top` that `under` carries directly; NULL: there is none */
static struct mill_motion *next_to(const struct check *c, const struct mill_motion *top,
                                   const struct mill_motion *under)
{
    const struct mill_motion *m = top == under ? NULL : top;
    while (m && m->on != under)
        m = m->on;
    return m ? c->motion[m->number] : NULL;
}

/* Collects the solids of one motion. `own`: the part of that motion that moves them relative to
 * `other` */
static void take_sides(struct check *c, int which, const struct mill_motion *motion,
                       const struct mill_motion *own, const struct mill_motion *other)
{
    const struct mill_clash_line line = mill_clash_side_line(own, other);
    c->sides[which] = 0;
    for (int k = 0; k < c->solids; k++)
        if (c->solid[k].motion == motion)
            c->side[which][c->sides[which]++] = mill_clash_side_of(&c->solid[k], own, &line);
    if (c->container == &c->around && c->around.motion == motion)
        c->side[which][c->sides[which]++] = mill_clash_side_of(&c->around, own, &line);
}

static bool carries(const struct check *c, const struct mill_motion *motion)
{
    bool any = c->container == &c->around && c->around.motion == motion;
    for (int k = 0; k < c->solids && !any; k++)
        any = c->solid[k].motion == motion;
    return any;
}

static void check_motions(struct check *c, const struct mill_motion *a, const struct mill_motion *b)
{
    if (!carries(c, a) || !carries(c, b))
        return;
    const struct mill_motion *under = common(a, b);
    struct mill_motion *cut[2] = {next_to(c, a, under), next_to(c, b, under)};
    for (int k = 0; k < 2; k++)
        if (cut[k])
            cut[k]->on = NULL;
    struct mill_motion *both[2] = {a && a != under ? c->motion[a->number] : NULL,
                                   b && b != under ? c->motion[b->number] : NULL};
    const struct mill_motion_cycle cycle = mill_motion_cycle(both, 2);
    const double horizon = c->setup->horizon > 0.0 ? c->setup->horizon : HORIZON;
    c->end = cycle.singles > 0 ? cycle.period : horizon;
    take_sides(c, 0, a, both[0], both[1]);
    take_sides(c, 1, b, both[1], both[0]);
    for (int i = 0; i < c->sides[0]; i++)
        for (int k = 0; k < c->sides[1]; k++)
            check_two(c, &c->side[0][i], &c->side[1][k]);
    for (int k = 0; k < 2; k++)
        if (cut[k])
            cut[k]->on = under;
}

/* ---- all ---- */

/* The drum as a body; of a wavy drum the cylinder inside its buckles */
static bool make_drum(struct check *c)
{
    const struct mill_setup_drum *drum = &c->setup->drum;
    c->drum =
        (struct mill_body){.inside = true,
                           .x = {0.0, 1.0, 0.0},
                           .y = {0.0, 0.0, 1.0},
                           .z = {1.0, 0.0, 0.0},
                           .radius = drum->radius - (drum->buckles > 0 ? drum->buckle_height : 0.0),
                           .length = drum->length};
    const struct mill_setup_surface surface = {
        .type = &mill_round_cylinder_type, .form = &c->drum, .motion = drum->rides - 1};
    const struct mill_setup setup = {.surface = &surface};
    c->container = &c->around;
    c->walls = mill_round_cylinder_type.walls(&c->drum, c->wall);
    if (drum->periodic)
        c->walls = 1; /* only the round one */
    return mill_clash_solid_init(&c->around, &setup, 0, c->motion);
}

static bool make_solids(struct check *c)
{
    const struct mill_setup *s = c->setup;
    bool good = s->drum.radius <= 0.0 || make_drum(c);
    for (int k = 0; good && k < s->surfaces; k++) {
        const struct mill_setup_surface *surface = &s->surface[k];
        if (!mill_clash_solid_is(surface))
            continue;
        struct mill_clash_solid *solid = &c->solid[c->solids++];
        good = mill_clash_solid_init(solid, s, k, c->motion);
        if (!solid->body || !solid->body->inside)
            continue;
        c->container = solid;
        c->walls = surface->type->walls ? surface->type->walls(solid->body, c->wall) : 0;
    }
    return good;
}

bool mill_clash_find(const struct mill_setup *setup, struct mill_motion *const *motion,
                     struct mill_fault *fault)
{
    const size_t room = (size_t)setup->surfaces + 1;
    struct check c = {.setup = setup, .motion = motion, .fault = fault};
    c.solid = calloc(room, sizeof *c.solid);
    c.side[0] = malloc(room * sizeof **c.side);
    c.side[1] = malloc(room * sizeof **c.side);
    const bool good = c.solid && c.side[0] && c.side[1] && make_solids(&c);
    for (int p = -1; good && p < setup->motions; p++)
        for (int q = p + 1; q < setup->motions; q++)
            check_motions(&c, p < 0 ? NULL : motion[p], motion[q]);
    for (int k = 0; k < c.solids; k++)
        mill_clash_solid_free(&c.solid[k]);
    mill_clash_solid_free(&c.around);
    free(c.solid);
    free(c.side[0]);
    free(c.side[1]);
    return good;
}
