/* The check uses conservative advancement (B. Mirtich, PhD thesis, Berkeley 1996, 2.3.2). No point
 * of two bodies moves faster than a known bound, so the bodies cannot meet before the distance
 * between them is used up. The next step ("march") goes to that time and measures the distance
 * again. A motion that carries both bodies does not change their distance, so it is left out: in
 * the frame of a planetary jar, its agitator only turns.
 *
 * Most pairs need no march: bodies that never come near each other; bodies that only turn about one
 * direction and are apart along it; and a round body that lies on the turning axis of the other. */
#include "start/clash.h"

#include "start/clash_solid.h"

#include <stdlib.h>
#include <string.h>

/* Relative to the size: bodies nearer than this touch */
#define TOUCH 1e-6
/* [s] checked where the motions have no common period and the setup gives no horizon */
#define HORIZON 1.0
/* A check that takes long becomes coarser. After PATIENCE distances ("looks") no march goes on
 * beyond a horizon, and no step is shorter than COARSE of the size times the looks so far: a missed
 * overlap is shallower than half a step. After MOST_LOOKS, about 10 s, the check ends. */
enum { PATIENCE = 1000000, MOST_LOOKS = 20000000 };
#define COARSE 1e-10
/* Directions and places that differ by no more than this are equal but for rounding */
#define ROUNDING 1e-12
#define PASSING 0.1 /* of a ball: steps of two solids that pass each other */

/* A line at rest, about which a motion turns */
struct line {
    bool is; /* there is such a line */
    vec3 through, direction;
};

struct side {
    const struct mill_clash_solid *is;
    const struct mill_motion *motion;
    struct mill_motion_bounds bounds; /* of the centre of the sphere around it */
    double size;                      /* [m] of that sphere */
    double speed;           /* [m/s] no point moves faster, where the solid changes its place */
    struct mill_pose begin; /* at t = 0 */
    vec3 centre, axis;      /* at t = 0 */
    bool keeps;             /* the solid always occupies the same points of space */
    struct line ring;       /* the solid never leaves the ring around this line, */
    double inner, outer;    /* [m] between these distances from the line */
};

struct check {
    const struct mill_setup *setup;
    const struct mill_start_watch *watch;
    struct mill_motion *const *motion;
    struct mill_fault *fault;
    int solids;
    struct mill_clash_solid *solid;
    const struct mill_clash_solid *container;
    int walls;
    struct mill_wall wall[MILL_WALLS];
    struct side *side[2]; /* the solids on each of the two motions */
    int sides[2];
    double end;  /* [s] */
    double ball; /* [m] largest diameter */
    long looks;
};

/* ---- sides: bounds of speeds, and pairs that stay apart or at a constant distance ---- */

/* [m] The largest distance of a point from the line through the centre, along the turning axis: a
 * motion that turns about an axis of fixed direction moves points by this distance times the
 * angular speed at most. 0 for a body that is round about that line. */
static double turning_size(const struct side *s)
{
    const vec3 axis = s->bounds.axis;
    if (s->is->solid->ball || s->bounds.turning == 0.0)
        return 0.0;
    if (!(vec3_norm(axis) > 0.0))
        return s->size;
    if (s->is->solid->round && vec3_norm(vec3_cross(s->axis, axis)) < ROUNDING)
        return 0.0;
    const struct mill_wall line = {.half = INFINITY};
    const struct mill_pose frame = mill_part_frame(s->centre, axis);
    const struct mill_pose in = mill_pose_relative(&s->begin, &frame);
    return fmin(-mill_clash_gap_wall(&line, s->is, &in, 1e-3 * s->size).least, s->size);
}

/* The line about which `own` turns (NULL: at rest; then `other`). Two lines must be parallel. */
static struct line line_of(const struct mill_motion *own, const struct mill_motion *other)
{
    const struct mill_motion *m = own ? own : other;
    if (!m || m->on || !m->axial)
        return (struct line){.is = false};
    const bool alike = !other || (!other->on && other->axial &&
                                  vec3_norm(vec3_cross(other->axis, m->axis)) < ROUNDING);
    return (struct line){.is = alike, .through = m->through, .direction = m->axis};
}

/* Finds the ring about the line that the solid never leaves */
static void find_ring(struct side *s, const struct line *line)
{
    const vec3 off = vec3_sub(s->centre, line->through);
    const vec3 foot = vec3_axpy(line->through, vec3_dot(off, line->direction), line->direction);
    const struct mill_pose frame = mill_part_frame(foot, line->direction);
    const struct mill_pose in = mill_pose_relative(&s->begin, &frame);
    const double near = 1e-6 * s->size,
                 half = 2.0 * (s->size + vec3_norm(vec3_sub(foot, s->centre)));
    const vec3 low = {0.0, 0.0, -half}, high = {0.0, 0.0, half};
    struct mill_part axis = mill_part_facet(low, high, high, 0.0);
    const struct mill_clash_solid around = {
        .parts = 1, .part = &axis, .all = {axis.centre, axis.around, 0, -1}};
    const struct mill_wall wall = {.half = INFINITY};
    s->ring = *line;
    s->inner = mill_clash_gap_solids(s->is, &around, &in, near).least;
    s->outer = -mill_clash_gap_wall(&wall, s->is, &in, near).least;
}

static struct side side_of(const struct mill_clash_solid *is, const struct mill_motion *motion,
                           const struct line *line)
{
    const struct mill_clash_ball *all = &is->all;
    struct side s = {.is = is, .motion = motion, .size = all->radius};
    s.bounds = mill_motion_bounds(motion, all->centre);
    s.begin = mill_motion_pose(motion, 0.0);
    s.centre = mill_pose_out(&s.begin, all->centre);
    s.axis = mill_pose_turn_out(&s.begin, is->axis);
    const double turning = s.bounds.turning * turning_size(&s);
    s.keeps = turning == 0.0 && (s.bounds.speed == 0.0 ||
                                 s.bounds.far <= ROUNDING * (s.size + vec3_norm(all->centre)));
    s.speed = s.keeps ? 0.0 : s.bounds.speed + turning;
    if (line->is)
        find_ring(&s, line);
    return s;
}

/* Does `s` only turn, and about the axis of `round`; of a ball, about any through its centre? */
static bool turns_about(const struct side *s, const struct side *round)
{
    const struct mill_motion *m = s->motion;
    if (!m)
        return true;
    const vec3 off = vec3_sub(round->centre, m->through);
    return !m->on && m->axial &&
           vec3_norm(vec3_cross(off, m->axis)) <= ROUNDING * (s->size + round->size) &&
           (round->is->solid->ball || vec3_norm(vec3_cross(round->axis, m->axis)) < ROUNDING);
}

/* Is the distance of the two solids always the same? */
static bool are_steady(const struct side *a, const struct side *b)
{
    return a->speed + b->speed == 0.0 || (b->keeps && b->is->solid->round && turns_about(a, b)) ||
           (a->keeps && a->is->solid->round && turns_about(b, a));
}

/* Does no point of the solid ever move along this direction of the laboratory? */
static bool is_level(const struct side *s, vec3 direction)
{
    return mill_motion_keeps(s->motion, mill_pose_turn_in(&s->begin, direction));
}

/* [m] coordinate of the solid's extreme point in a direction of the laboratory, at t = 0 */
static double end_of(const struct side *s, vec3 way)
{
    const vec3 in = mill_pose_turn_in(&s->begin, way);
    double most = -INFINITY;
    for (int32_t k = 0; k < s->is->parts; k++) {
        const struct mill_part *p = &s->is->part[k];
        most = fmax(most, mill_part_extent(p, in));
    }
    return most + vec3_dot(way, s->begin.place);
}

/* Do they never come nearer than `near`? Three tests: the spheres that contain each solid at all
 * times do not meet; nor do the rings; or the solids turn about one axis and are apart along it. */
static bool are_apart(const struct side *a, const struct side *b, double near)
{
    const double apart = vec3_norm(vec3_sub(a->bounds.home, b->bounds.home));
    if (apart - a->bounds.far - b->bounds.far - a->size - b->size > near)
        return true;
    if (a->ring.is && b->ring.is) { /* their lines are parallel or the same */
        const vec3 off = vec3_sub(a->ring.through, b->ring.through);
        const double between = vec3_norm(vec3_cross(off, a->ring.direction)) + near;
        if (a->inner - b->outer > between || b->inner - a->outer > between)
            return true;
    }
    const vec3 axis = a->bounds.turning > 0.0 ? a->bounds.axis : b->bounds.axis;
    const vec3 back = vec3_scale(axis, -1.0);
    if (!(vec3_norm(axis) > 0.0) || !is_level(a, axis) || !is_level(b, axis))
        return false;
    return -end_of(a, axis) - end_of(b, back) > near || -end_of(b, axis) - end_of(a, back) > near;
}

/* ---- marches ---- */

/* Two solids, or a solid and one of the container's walls */
struct march {
    const struct side *a, *b;
    int wall;           /* -1: none */
    double near, speed; /* [m] at which they touch, [m/s] */
    bool slides;        /* along the wall, which it may touch */
    double least;       /* [m] no step is shorter; above 0 for solids that certainly never touch */
};

static double gap_at(struct check *c, const struct march *m, double t)
{
    const struct mill_pose a = mill_motion_pose(m->a->motion, t),
                           b = mill_motion_pose(m->b->motion, t);
    struct mill_pose in = mill_pose_relative(&a, &b);
    struct mill_part_gap gap;
    if (m->wall < 0) {
        gap = mill_clash_gap_solids(m->a->is, m->b->is, &in, m->near);
    } else {
        const struct mill_body *is = c->container->body;
        const struct mill_pose own = {.place = is->centre, .x = is->x, .y = is->y, .z = is->z};
        in = mill_pose_relative(&in, &own);
        gap = mill_clash_gap_wall(&c->wall[m->wall], m->a->is, &in, m->near);
    }
    c->looks += gap.looks;
    return gap.least;
}

static int number_of(const struct check *c, const struct side *side)
{
    return mill_clash_number(c->setup, side->is->surface);
}

static struct mill_passing passing_of(const struct check *c, const struct march *m, double gap,
                                      double t)
{
    const bool flat = m->wall >= 0 && c->wall[m->wall].flat;
    const int ends = flat ? c->setup->surface[m->b->is->surface].ends : 0;
    const int kind = ends > 0 ? ends : m->b->is->kind;
    return (struct mill_passing){
        number_of(c, m->a), number_of(c, m->b), {m->a->is->kind, kind}, gap, t};
}

/* Of each two kinds of contact the narrowest place is kept, in the order of the gaps. */
static void keep_narrowest(struct mill_passing *list, struct mill_passing p)
{
    int k = 0; /* the place of these kinds, or a free one, or the last */
    while (k < MILL_FAULT_PASSINGS - 1 && list[k].gap < (double)INFINITY &&
           memcmp(list[k].kind, p.kind, sizeof p.kind) != 0)
        k++;
    if (p.gap >= list[k].gap)
        return;
    for (; k > 0 && p.gap < list[k - 1].gap; k--)
        list[k] = list[k - 1];
    list[k] = p;
}

/* Notes the first touch before `end`, if no earlier one is known. */
static void march(struct check *c, const struct march *m, double end, enum mill_fault_code code)
{
    const double horizon = c->setup->horizon;
    double t = 0.0, gap;
    for (;;) {
        const double first = c->fault->code == MILL_FAULT_NONE ? (double)INFINITY : c->fault->when;
        const bool late = c->looks > PATIENCE;
        if (t > end || t >= first || (late && horizon > 0.0 && t > horizon) ||
            (late && m->least > 0.0))
            return;
        if (c->looks > MOST_LOOKS && t > 0.0) { /* the start is always checked */
            if (t < c->fault->unchecked.when)
                c->fault->unchecked = passing_of(c, m, 0.0, t);
            return;
        }
        gap = gap_at(c, m, t);
        if (m->least == 0.0 && gap <= (m->slides ? -m->near : m->near))
            break;
        if (gap > m->near)
            keep_narrowest(c->fault->narrowest, passing_of(c, m, gap, t));
        if (m->speed == 0.0)
            return;
        const double coarse = late ? COARSE * (double)c->looks * m->near / TOUCH : m->least;
        t += fmax(gap, coarse) / m->speed;
    }
    const bool out = code == MILL_FAULT_OUTSIDE;
    *c->fault = (struct mill_fault){.code = code,
                                    .ball = out ? 0 : number_of(c, m->a),
                                    .other = number_of(c, out ? m->a : m->b),
                                    .amount = m->wall >= 0 && gap < 0.0 ? -gap : 0.0,
                                    .when = t};
}

/* ---- pairs ---- */

static bool is_in_mesh(const struct side *a, const struct side *mesh)
{
    const struct mill_part *p = a->is->part;
    const vec3 at = a->is->solid->support ? p->centre : vec3_add(p->centre, p->core.corner[0]);
    return mill_clash_solid_holds(mesh->is,
                                  mill_pose_in(&mesh->begin, mill_pose_out(&a->begin, at)));
}

static void check_pair(struct check *c, const struct side *a, const struct side *b)
{
    const bool holds = b->is == c->container;
    const enum mill_fault_code code = holds ? MILL_FAULT_OUTSIDE : MILL_FAULT_CLASH;
    const double near = TOUCH * (a->size + b->size);
    const double ball = fmax(near, c->ball);
    if ((a->keeps && b->keeps) || (!holds && are_apart(a, b, ball)))
        return;
    /* they never touch, but a ball can be pinched between them */
    const bool apart = !holds && are_apart(a, b, near);
    /* a body inside a mesh, far from its facets */
    const struct march hidden = {a, b, -1, INFINITY, 0.0, false, 0.0};
    if (!apart && ((!b->is->solid->support && is_in_mesh(a, b) != holds) ||
                   (!a->is->solid->support && !holds && is_in_mesh(b, a))))
        march(c, &hidden, 0.0, code);
    const double speed = are_steady(a, b) ? 0.0 : a->speed + b->speed;
    const struct march open = {a, b, -1, near, speed, false, apart ? PASSING * ball : 0.0};
    march(c, &open, c->end, code);
}

/* A body may pierce a wall if both never change the space that they occupy. It may slide along a
 * flat wall. For other walls the distance may be constant. */
static void check_walls(struct check *c, const struct side *a, const struct side *b)
{
    const struct mill_body *is = c->container->body;
    for (int k = 0; k < c->walls; k++) {
        const struct mill_wall *w = &c->wall[k];
        const vec3 normal = mill_pose_turn_out(&b->begin, mill_body_turn_out(is, w->normal));
        const bool kept = b->keeps || (w->flat && is_level(b, normal));
        /* a contour that turns is not round */
        const bool odd = !w->flat && is->corners > 0 && b->bounds.turning > 0.0;
        if (kept && a->keeps && !odd)
            continue;
        const bool level = kept && w->flat && is_level(a, normal);
        const bool same =
            a->speed + b->speed == 0.0 || level || (kept && !w->flat && turns_about(a, b));
        const double speed = same ? 0.0 : a->speed + (kept ? 0.0 : b->speed);
        const struct march m = {a, b, k, TOUCH * (a->size + b->size), speed, level, 0.0};
        march(c, &m, same ? 0.0 : c->end, MILL_FAULT_OUTSIDE);
    }
}

static void check_two(struct check *c, const struct side *a, const struct side *b)
{
    if (a->is == c->container || (b->is != c->container && a->is->surface > b->is->surface))
        check_two(c, b, a);
    else if (b->is == c->container && c->walls > 0)
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

/* Collects the solids of one motion. `own`: its part that moves them relative to `other` */
static void take_sides(struct check *c, int which, const struct mill_motion *motion,
                       const struct mill_motion *own, const struct mill_motion *other)
{
    const struct line line = line_of(own, other);
    c->sides[which] = 0;
    for (int k = 0; k < c->solids; k++)
        if (c->solid[k].motion == motion)
            c->side[which][c->sides[which]++] = side_of(&c->solid[k], own, &line);
}

static void check_motions(struct check *c, const struct mill_motion *a, const struct mill_motion *b)
{
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
    for (int i = 0; i < c->sides[0]; i++) {
        if (c->watch)
            c->watch->tell(c->watch->self, "checking bodies", i, c->sides[0]);
        for (int k = 0; k < c->sides[1]; k++)
            check_two(c, &c->side[0][i], &c->side[1][k]);
    }
    for (int k = 0; k < 2; k++)
        if (cut[k])
            cut[k]->on = under;
}

/* ---- all ---- */

static bool make_solids(struct check *c)
{
    bool good = true;
    for (int k = 0; good && k < c->setup->surfaces; k++) {
        const struct mill_setup_surface *surface = &c->setup->surface[k];
        struct mill_clash_solid *solid = &c->solid[c->solids++];
        good = mill_clash_solid_init(solid, c->setup, k, c->motion);
        if (!surface->body->inside)
            continue;
        c->container = solid;
        c->walls = surface->solid->walls ? surface->solid->walls(surface->body, c->wall) : 0;
    }
    return good;
}

bool mill_clash_find(const struct mill_setup *setup, const struct mill_start_watch *watch,
                     struct mill_motion *const *motion, struct mill_fault *fault)
{
    const size_t room = (size_t)setup->surfaces + 1;
    struct check c = {.setup = setup, .watch = watch, .motion = motion, .fault = fault};
    for (int k = 0; k < setup->species; k++)
        c.ball = fmax(c.ball, setup->balls[k].diameter);
    c.solid = calloc(room, sizeof *c.solid);
    c.side[0] = malloc(room * sizeof **c.side);
    c.side[1] = malloc(room * sizeof **c.side);
    const bool good = c.solid && c.side[0] && c.side[1] && make_solids(&c);
    for (int p = -1; good && p < setup->motions; p++)
        for (int q = p + 1; q < setup->motions; q++)
            check_motions(&c, p < 0 ? NULL : motion[p], motion[q]);
    for (int k = 0; k < c.solids; k++)
        mill_clash_solid_free(&c.solid[k]);
    free(c.solid);
    free(c.side[0]);
    free(c.side[1]);
    return good;
}
