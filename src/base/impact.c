/* The contact law of Walton's rough spheres (O. R. Walton, in Particulate Two-Phase Flow, 1993):
 * normal restitution; tangential restitution where it sticks, Coulomb's bound where it slides. mu =
 * 0: the smooth inelastic law of Reichardt & Wiechert 2007, (3). Derived in docs/physics.md */
#include "millsim/impact.h"

#include "base/elementary.h"

#include <assert.h>

#define STEEL (2.1e11 / (2.0 * (1.0 - 0.3 * 0.3))) /* [Pa] reduced modulus of steel on steel */

struct mill_rebound mill_impact_resolve(const struct mill_law *law, double rebound_floor,
                                        double reduced_mass, vec3 n, vec3 slip)
{
    assert(reduced_mass > 0.0 && rebound_floor >= 0.0 && fabs(vec3_dot(n, n) - 1.0) < 1e-9);
    struct mill_rebound rebound;
    const double closing = vec3_dot(slip, n); /* rounding errors may make it negative */
    const double g_n = mill_greatest(closing, 0.0);
    const vec3 g_t = vec3_axpy(slip, -closing, n);
    const double s_t = vec3_norm(g_t);
    rebound.floored = law->restitution * g_n < rebound_floor;
    const double leaving = rebound.floored ? rebound_floor : law->restitution * g_n;
    const double j_n = reduced_mass * (g_n + leaving);
    rebound.impulse = vec3_scale(n, j_n);
    rebound.normal_speed = g_n;
    rebound.tangential_speed = s_t;
    /* loss = impulse . (slip before + slip after) / 2, exact for any impulse and any slip */
    rebound.dissipation_normal = 0.5 * j_n * (g_n - leaving) + j_n * (closing - g_n);
    rebound.dissipation = rebound.dissipation_normal;
    rebound.slid = false;
    if (law->friction > 0.0 && s_t > 0.0) {
        /* uniform spheres: the tangential reduced mass is 2/7 of the normal one */
        const double sticking = (2.0 / 7.0) * reduced_mass * (1.0 + law->tangential) * s_t;
        const double j_t = mill_least(sticking, law->friction * j_n);
        rebound.slid = j_t < sticking;
        const double after = s_t - 3.5 * j_t / reduced_mass;
        rebound.impulse = vec3_axpy(rebound.impulse, j_t / s_t, g_t);
        rebound.dissipation += 0.5 * j_t * (s_t + after);
    }
    return rebound;
}

/* The restitution of viscoelastic spheres that part when their force is zero, in Pade form: within
 * 0.005 (Muller & Poschel, Phys. Rev. E 84 (2011) 021302). loss: root of the damping times v^0.1 */
static double viscoelastic(double loss)
{
    return (1.0 + 0.501086 * loss) /
           (1.0 + loss * (0.501086 + loss * (1.15345 + loss * (0.577977 + loss * 0.532178))));
}

double mill_impact_loss(double restitution)
{
    double low = 0.0, high = 1e6; /* the restitution falls from 1 to 0 */
    while (0.5 * (low + high) > low && 0.5 * (low + high) < high) {
        const double middle = 0.5 * (low + high);
        if (viscoelastic(middle) > restitution)
            low = middle;
        else
            high = middle;
    }
    return low > 0.0 ? low : 1e-300;
}

double mill_impact_restitution(const struct mill_fall *fall, double normal_speed)
{
    assert(fall->points > 0 && fall->points <= MILL_FALL_POINTS);
    const double v = mill_greatest(normal_speed, 0.0), *at = fall->speed, *e = fall->restitution;
    int k = 0;
    if (fall->points == 1) {
        const double loss = fall->loss > 0.0 ? fall->loss : mill_impact_loss(e[0]);
        return v > 0.0 ? viscoelastic(loss * sqrt(mill_elementary_root5(v / at[0]))) : 1.0;
    }
    while (k < fall->points && at[k] <= v)
        k++;
    if (k == 0 || k == fall->points)
        return e[k > 0 ? k - 1 : 0];
    return e[k - 1] + (e[k] - e[k - 1]) * ((v - at[k - 1]) / (at[k] - at[k - 1]));
}

double mill_impact_duration(double reduced_mass, double reduced_radius, double normal_speed)
{
    assert(reduced_mass > 0.0 && reduced_radius > 0.0 && normal_speed > 0.0);
    const double inertia = reduced_mass / STEEL;
    return 2.868 * mill_elementary_root5(inertia * inertia / (reduced_radius * normal_speed));
}

double mill_impact_force(double radius, double depth)
{
    assert(radius > 0.0 && depth >= 0.0);
    return 4.0 / 3.0 * STEEL * sqrt(radius * depth) * depth;
}
