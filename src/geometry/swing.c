/* The swing about a fixed axis: the jar of a mixer mill on its arm, a rocking vial. The angle is a
 * sine of time, and the frame is rotated by this angle. */
#include "base/elementary.h"
#include "geometry/phase.h"
#include "millsim/motion.h"

#include <assert.h>
#include <stdlib.h>

struct swing {
    struct mill_motion base;
    struct mill_swing is; /* with an axis of length 1 */
    double start, phase;  /* [turns] phase of the sine, at simulated time 0 and at local time 0 */
};

static bool is_sound(const void *form)
{
    const struct mill_swing *is = form;
    return vec3_norm(is->axis) > 0.0 && isfinite(vec3_norm(is->axis)) &&
           isfinite(vec3_norm(is->centre)) && isfinite(is->amplitude) && is->frequency >= 0.0 &&
           isfinite(is->frequency) && isfinite(is->phase);
}

static struct mill_motion *create(const void *form)
{
    struct swing *swing = calloc(1, sizeof *swing);
    if (!swing)
        return NULL;
    swing->is = *(const struct mill_swing *)form;
    assert(vec3_norm(swing->is.axis) > 0.0);
    swing->is.axis = vec3_scale(swing->is.axis, 1.0 / vec3_norm(swing->is.axis));
    swing->base = (struct mill_motion){&mill_swing_type, .axial = true, .through = swing->is.centre,
                                       .axis = swing->is.axis};
    swing->base.period = swing->is.amplitude != 0.0 ? 1.0 / swing->is.frequency : (double)INFINITY;
    swing->start = swing->phase = mill_phase_turns(swing->is.phase / (2.0 * MILL_PI), 0.0, 0.0);
    return &swing->base;
}

static struct mill_pose pose(const struct mill_motion *motion, double t)
{
    const struct swing *swing = (const struct swing *)motion;
    const struct mill_swing *is = &swing->is;
    const struct mill_heading wave =
        mill_elementary_heading(2.0 * MILL_PI * (swing->phase + is->frequency * t));
    const struct mill_heading at = mill_elementary_heading(is->amplitude * wave.sin);
    const double speed = 2.0 * MILL_PI * is->frequency * is->amplitude * wave.cos;
    const vec3 e = is->axis, w = vec3_scale(e, speed);
    const double c = 1.0 - at.cos, s = at.sin;
    struct mill_pose pose = {
        .x = {at.cos + c * e.x * e.x, s * e.z + c * e.x * e.y, c * e.x * e.z - s * e.y},
        .y = {c * e.x * e.y - s * e.z, at.cos + c * e.y * e.y, s * e.x + c * e.y * e.z},
        .z = {s * e.y + c * e.x * e.z, c * e.y * e.z - s * e.x, at.cos + c * e.z * e.z},
        .angular_velocity = w,
    };
    const vec3 origin = mill_pose_turn_out(&pose, vec3_scale(is->centre, -1.0));
    pose.place = vec3_add(is->centre, origin);
    pose.velocity = vec3_cross(w, origin);
    return pose;
}

/* A point stays within the amplitude on both sides. The tangential part of its acceleration is
 * greatest when the radial part is zero. */
static struct mill_motion_bounds bounds(const struct mill_motion *motion, vec3 point)
{
    const struct mill_swing *is = &((const struct swing *)motion)->is;
    const vec3 out = vec3_sub(point, is->centre);
    const double reach = vec3_norm(vec3_axpy(out, -vec3_dot(out, is->axis), is->axis));
    const double omega = 2.0 * MILL_PI * is->frequency, swing = fabs(is->amplitude);
    const double turning = omega * swing, spin_up = omega * turning, speed = turning * reach;
    const double far = reach * fmin(swing, 2.0), most = reach * fmax(spin_up, turning * turning);
    return (struct mill_motion_bounds){point, far, speed, most, turning, spin_up, is->axis};
}

static void restart(struct mill_motion *motion, double base, double by)
{
    struct swing *swing = (struct swing *)motion;
    (void)by;
    swing->phase = mill_phase_turns(swing->start, swing->is.frequency, base);
}

const struct mill_motion_type mill_swing_type = {is_sound, create, pose, bounds,
                                                 .restart = restart};
