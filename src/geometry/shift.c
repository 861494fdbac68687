/* A shift to and fro without rotation: a vibrating tube, or a jar that moves on a circle without
 * turning. Each coordinate is a sine of time. All have the same frequency. */
#include "base/elementary.h"
#include "geometry/phase.h"
#include "millsim/motion.h"

#include <stdlib.h>

struct shift {
    struct mill_motion base;
    struct mill_shift is;
    double start[3], phase[3]; /* [turns] of the sines, at simulated and at local time 0 */
};

static bool is_sound(const void *form)
{
    const struct mill_shift *is = form;
    return isfinite(vec3_norm(is->amplitude)) && isfinite(vec3_norm(is->phase)) &&
           is->frequency >= 0.0 && isfinite(is->frequency);
}

static struct mill_motion *create(const void *form)
{
    struct shift *shift = calloc(1, sizeof *shift);
    if (!shift)
        return NULL;
    shift->base.type = &mill_shift_type;
    shift->is = *(const struct mill_shift *)form;
    shift->base.period =
        vec3_norm(shift->is.amplitude) > 0.0 ? 1.0 / shift->is.frequency : (double)INFINITY;
    const double phase[3] = {shift->is.phase.x, shift->is.phase.y, shift->is.phase.z};
    for (int k = 0; k < 3; k++)
        shift->start[k] = shift->phase[k] = mill_phase_turns(phase[k] / (2.0 * MILL_PI), 0.0, 0.0);
    return &shift->base;
}

static struct mill_pose pose(const struct mill_motion *motion, double t)
{
    const struct shift *shift = (const struct shift *)motion;
    const vec3 a = shift->is.amplitude;
    const double omega = 2.0 * MILL_PI * shift->is.frequency;
    struct mill_heading at[3];
    for (int k = 0; k < 3; k++)
        at[k] =
            mill_elementary_heading(2.0 * MILL_PI * (shift->phase[k] + shift->is.frequency * t));
    struct mill_pose pose = mill_pose_still;
    pose.place = vec3_make(a.x * at[0].sin, a.y * at[1].sin, a.z * at[2].sin);
    pose.velocity = vec3_scale(vec3_make(a.x * at[0].cos, a.y * at[1].cos, a.z * at[2].cos), omega);
    return pose;
}

static void carry(const struct mill_motion *motion, double t, vec3 *point, vec3 *velocity)
{
    const struct mill_pose at = pose(motion, t);
    *point = vec3_add(*point, at.place);
    *velocity = vec3_add(*velocity, at.velocity);
}

/* The maximum distance from the centre: the place moves on an ellipse, and the square of its
 * distance is a constant plus a wave of twice the frequency. */
static double farthest(const struct mill_shift *is)
{
    const double a[3] = {is->amplitude.x, is->amplitude.y, is->amplitude.z};
    const double phase[3] = {is->phase.x, is->phase.y, is->phase.z};
    double mean = 0.0, cosine = 0.0, sine = 0.0;
    for (int k = 0; k < 3; k++) {
        const struct mill_heading twice = mill_elementary_heading(2.0 * phase[k]);
        mean += 0.5 * a[k] * a[k];
        cosine += 0.5 * a[k] * a[k] * twice.cos;
        sine += 0.5 * a[k] * a[k] * twice.sin;
    }
    return sqrt(mean + sqrt(cosine * cosine + sine * sine)) * (1.0 + 1e-15);
}

static struct mill_motion_bounds bounds(const struct mill_motion *motion, vec3 point)
{
    const struct mill_shift *is = &((const struct shift *)motion)->is;
    const double far = farthest(is), omega = 2.0 * MILL_PI * is->frequency;
    return (struct mill_motion_bounds){
        .home = point, .far = far, .speed = omega * far, .acceleration = omega * omega * far};
}

static void restart(struct mill_motion *motion, double base, double by)
{
    struct shift *shift = (struct shift *)motion;
    (void)by;
    for (int k = 0; k < 3; k++)
        shift->phase[k] = mill_phase_turns(shift->start[k], shift->is.frequency, base);
}

const struct mill_motion_type mill_shift_type = {is_sound, create, pose, bounds, restart, carry};
