/* Chains of motions: poses relative to the carrier, and bounds for the whole chain. */
#include "millsim/motion.h"

#include <assert.h>

/* Relative tolerance for equal periods and for whole multiples of periods */
#define ALIKE 1e-9
enum { MOST_PERIODS = 1000 }; /* in a common period */

/* Converts the pose `inner`, relative to the frame of `outer`, to the frame of the pose `outer`. */
static struct mill_pose within(const struct mill_pose *outer, const struct mill_pose *inner)
{
    const vec3 place = mill_pose_out(outer, inner->place);
    const vec3 velocity = mill_pose_turn_out(outer, inner->velocity);
    const vec3 turn = mill_pose_turn_out(outer, inner->angular_velocity);
    return (struct mill_pose){.place = place,
                              .x = mill_pose_turn_out(outer, inner->x),
                              .y = mill_pose_turn_out(outer, inner->y),
                              .z = mill_pose_turn_out(outer, inner->z),
                              .velocity = vec3_add(mill_pose_velocity(outer, place), velocity),
                              .angular_velocity = vec3_add(outer->angular_velocity, turn)};
}

struct mill_pose mill_motion_pose(const struct mill_motion *motion, double t)
{
    assert(t == t);
    if (!motion)
        return mill_pose_still;
    if (!motion->on)
        return motion->type->pose(motion, t);
    struct mill_pose pose = motion->type->pose(motion, t);
    for (const struct mill_motion *m = motion->on; m; m = m->on) {
        const struct mill_pose outer = m->type->pose(m, t);
        pose = within(&outer, &pose);
    }
    return pose;
}

vec3 mill_motion_point(const struct mill_motion *motion, double t, vec3 point, vec3 *velocity)
{
    *velocity = vec3_make(0.0, 0.0, 0.0);
    for (const struct mill_motion *m = motion; m; m = m->on) {
        if (m->type->carry) {
            m->type->carry(m, t, &point, velocity);
            continue;
        }
        const struct mill_pose pose = m->type->pose(m, t);
        point = mill_pose_out(&pose, point);
        *velocity =
            vec3_add(mill_pose_velocity(&pose, point), mill_pose_turn_out(&pose, *velocity));
    }
    return point;
}

/* Bounds for a point of a frame (bounds i) on a carrier (bounds o, for the place from which the
 * point never moves far). They are sums of the effect of each motion, and of the outer motion on
 * the inner one (centrifugal, Coriolis and Euler terms). */
static struct mill_motion_bounds bounds_within(const struct mill_motion_bounds *o,
                                               const struct mill_motion_bounds *i)
{
    const double turning = o->turning;
    const bool parallel = vec3_norm(o->axis) > 0.0 && vec3_norm(i->axis) > 0.0 &&
                          vec3_norm(vec3_cross(o->axis, i->axis)) < 1e-15;
    struct mill_motion_bounds all = {o->home, o->far + i->far, .turning = turning + i->turning};
    all.speed = o->speed + turning * i->far + i->speed;
    all.acceleration = o->acceleration + (o->spin_up + turning * turning) * i->far +
                       2.0 * turning * i->speed + i->acceleration;
    all.spin_up = o->spin_up + i->spin_up + (parallel ? 0.0 : turning * i->turning);
    if (turning == 0.0 || i->turning == 0.0 || parallel)
        all.axis = turning == 0.0 ? i->axis : o->axis;
    return all;
}

struct mill_motion_bounds mill_motion_bounds(const struct mill_motion *motion, vec3 point)
{
    if (!motion)
        return (struct mill_motion_bounds){.home = point};
    struct mill_motion_bounds bounds = motion->type->bounds(motion, point);
    for (const struct mill_motion *m = motion->on; m; m = m->on) {
        const struct mill_motion_bounds outer = m->type->bounds(m, bounds.home);
        if (outer.turning == 0.0) { /* a carrier that does not turn may have a constant rotation */
            const struct mill_pose pose = m->type->pose(m, 0.0);
            bounds.axis = mill_pose_turn_out(&pose, bounds.axis);
        }
        bounds = bounds_within(&outer, &bounds);
    }
    return bounds;
}

double mill_motion_reach(const struct mill_motion *motion, const struct mill_reach *places)
{
    const vec3 lo = places->lo, hi = places->hi;
    vec3 through = {0.0, 0.0, 0.0}, direction = {0.0, 0.0, 0.0};
    double reach = 0.0, far = 0.0;
    if (places->radius < (double)INFINITY && (!motion || mill_motion_pose(motion, 0.0).about_x))
        return places->radius;
    if (motion && !motion->on && motion->axial) {
        through = motion->through;
        direction = motion->axis;
    } else if (motion) {
        const struct mill_motion_bounds b = mill_motion_bounds(motion, through);
        through = b.home;
        far = b.far;
    }
    for (int corner = 0; motion && corner < 8; corner++) {
        const vec3 at = {corner & 1 ? hi.x : lo.x, corner & 2 ? hi.y : lo.y,
                         corner & 4 ? hi.z : lo.z};
        const vec3 away = vec3_sub(at, through);
        reach = fmax(reach, vec3_norm(vec3_axpy(away, -vec3_dot(away, direction), direction)));
    }
    return reach + far;
}

double mill_motion_fastest(const struct mill_motion *motion, const struct mill_reach *places)
{
    const struct mill_motion_bounds b = mill_motion_bounds(motion, vec3_make(0.0, 0.0, 0.0));
    return b.speed + b.turning * mill_motion_reach(motion, places);
}

bool mill_motion_keeps(const struct mill_motion *motion, vec3 direction)
{
    for (const struct mill_motion *m = motion; m; m = m->on) {
        const struct mill_pose pose = m->type->pose(m, 0.0);
        direction = mill_pose_turn_out(&pose, direction);
        if (!m->axial || vec3_norm(vec3_cross(m->axis, direction)) > 1e-15)
            return false;
    }
    return true;
}

const struct mill_motion *mill_motion_that_moves(const struct mill_motion *motion, vec3 point)
{
    while (motion && motion->axial &&
           vec3_norm(vec3_cross(motion->axis, vec3_sub(point, motion->through))) <=
               1e-15 * vec3_norm(point))
        motion = motion->on;
    return motion;
}

/* Is the time a whole multiple of the periods of the motion and its carriers? */
static bool repeats(const struct mill_motion *motion, double time)
{
    bool all = true;
    for (const struct mill_motion *m = motion; m && all; m = m->on) {
        const double period = m->period, times = time / period;
        all = !(period < (double)INFINITY) || fabs(times - rint(times)) <= ALIKE * times;
    }
    return all;
}

struct mill_motion_cycle mill_motion_cycle(struct mill_motion *const *motion, int count)
{
    struct mill_motion_cycle cycle = {INFINITY, 0.0, 0};
    for (int k = 0; k < count; k++)
        for (const struct mill_motion *m = motion[k]; m; m = m->on)
            if (m->period < (double)INFINITY)
                cycle.single = fmax(cycle.single, m->period);
    if (cycle.single <= 0.0)
        return cycle;
    for (int many = 1; many <= MOST_PERIODS && cycle.singles == 0; many++) {
        bool all = true;
        for (int k = 0; k < count && all; k++)
            all = repeats(motion[k], many * cycle.single);
        cycle.singles = all ? many : 0;
    }
    cycle.period = (cycle.singles > 0 ? cycle.singles : 1) * cycle.single;
    return cycle;
}

vec3 mill_motion_in(const struct mill_motion *motion, double t, vec3 place)
{
    if (!motion)
        return place;
    const struct mill_pose pose = motion->type->pose(motion, t);
    return mill_pose_in(&pose, mill_motion_in(motion->on, t, place));
}
