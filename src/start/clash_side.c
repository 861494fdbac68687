/* Upper bounds of the speeds of solids, and pairs that stay apart or at a constant distance */
#include "start/clash_solid.h"

/* Directions and places that differ by no more than this are equal but for rounding */
#define ROUNDING 1e-12

/* [m] The largest distance of a point from the line through the centre, along the turning axis: a
 * motion that turns about an axis of fixed direction moves points by this distance times the
 * angular speed at most. 0 for a body that is round about that line. */
static double turning_size(const struct mill_clash_side *s)
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

struct mill_clash_line mill_clash_side_line(const struct mill_motion *own,
                                            const struct mill_motion *other)
{
    const struct mill_motion *m = own ? own : other;
    if (!m || m->on || !m->axial)
        return (struct mill_clash_line){.is = false};
    const bool alike = !other || (!other->on && other->axial &&
                                  vec3_norm(vec3_cross(other->axis, m->axis)) < ROUNDING);
    return (struct mill_clash_line){.is = alike, .through = m->through, .direction = m->axis};
}

/* Finds the ring about the line that the solid never leaves */
static void find_ring(struct mill_clash_side *s, const struct mill_clash_line *line)
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

struct mill_clash_side mill_clash_side_of(const struct mill_clash_solid *is,
                                          const struct mill_motion *motion,
                                          const struct mill_clash_line *line)
{
    const struct mill_clash_ball *all = &is->all;
    struct mill_clash_side s = {.is = is, .motion = motion, .size = all->radius};
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

bool mill_clash_side_turns_about(const struct mill_clash_side *s,
                                 const struct mill_clash_side *round)
{
    const struct mill_motion *m = s->motion;
    if (!m)
        return true;
    const vec3 off = vec3_sub(round->centre, m->through);
    return !m->on && m->axial &&
           vec3_norm(vec3_cross(off, m->axis)) <= ROUNDING * (s->size + round->size) &&
           (round->is->solid->ball || vec3_norm(vec3_cross(round->axis, m->axis)) < ROUNDING);
}

bool mill_clash_side_are_steady(const struct mill_clash_side *a, const struct mill_clash_side *b)
{
    return a->speed + b->speed == 0.0 ||
           (b->keeps && b->is->solid->round && mill_clash_side_turns_about(a, b)) ||
           (a->keeps && a->is->solid->round && mill_clash_side_turns_about(b, a));
}

bool mill_clash_side_is_level(const struct mill_clash_side *s, vec3 direction)
{
    return mill_motion_keeps(s->motion, mill_pose_turn_in(&s->begin, direction));
}

/* [m] coordinate of the solid's extreme point in a direction of the laboratory, at t = 0 */
static double end_of(const struct mill_clash_side *s, vec3 way)
{
    const vec3 in = mill_pose_turn_in(&s->begin, way);
    double most = -INFINITY;
    for (int32_t k = 0; k < s->is->parts; k++) {
        const struct mill_part *p = &s->is->part[k];
        most = fmax(most, mill_part_extent(p, in));
    }
    return most + vec3_dot(way, s->begin.place);
}

/* Three tests: the spheres that contain each solid at all times do not meet; nor do the rings; or
 * the solids turn about one axis and are apart along it. */
bool mill_clash_side_are_apart(const struct mill_clash_side *a, const struct mill_clash_side *b,
                               double near)
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
    if (!(vec3_norm(axis) > 0.0) || !mill_clash_side_is_level(a, axis) ||
        !mill_clash_side_is_level(b, axis))
        return false;
    return -end_of(a, axis) - end_of(b, back) > near || -end_of(b, axis) - end_of(a, back) > near;
}
