/* When is a ball pressed, and when must it be let go? pinch.h gives the rules. */
#include "engine/pinch.h"

#include "geometry/shape.h"

/* An elastic impact at the bodies' speed v gives a ball 2 m v. The force of ten of them within the
 * duration of one would press a soft sphere in three times as deep as one impact does. Half or
 * twice this number changes the power of a mill with pinches by 2 %; validation/dem confirms it. */
#define IMPACTS 10.0

/* The fraction of the bodies' speed with which a pressed ball leaves other bodies. Three times
 * this, or the rebound floor alone, gives the same power. With less, it only has more contacts. */
#define PARTING 0.01

/* The fraction of the pressing force that is lost in a nip: the ball gives most energy back. With
 * clearances of 0.9 to 1 diameters, 0.03 to 0.05 give the right power (validation/dem). */
#define LOST 0.04

bool mill_pinches_create(struct mill_pinches *p, const struct mill_world *w,
                         struct mill_memory_pool *memory)
{
    double speed = 0.0;
    for (int k = 0; k < w->shapes; k++) {
        const struct mill_shape *s = w->shape[k];
        if (s->pinches)
            speed = fmax(speed, mill_motion_fastest(s->motion, &w->container.places));
    }
    if (speed <= 0.0)
        return true;
    p->parting = fmax(PARTING * speed, w->rebound_floor);
    p->duration = mill_memory_take(memory, (size_t)w->species_count, sizeof *p->duration);
    p->most = mill_memory_take(memory, (size_t)w->species_count, sizeof *p->most);
    p->ball = mill_memory_take(memory, (size_t)w->balls, sizeof *p->ball);
    p->held = mill_memory_take(memory, (size_t)w->balls, 1);
    if (memory->failed)
        return false;
    for (int k = 0; k < w->species_count; k++) {
        const double mass = w->species[k].mass;
        p->duration[k] = mill_impact_duration(mass, w->species[k].radius, speed);
        p->most[k] = IMPACTS * 2.0 * mass * speed;
    }
    for (int32_t i = 0; i < w->balls; i++)
        p->ball[i] = (struct mill_pinch){.since = -1.0, .last = -1.0};
    return true;
}

double mill_pinches_meet(struct mill_pinches *p, const struct mill_world *w, int32_t i, double t)
{
    double pressed = 0.0;
    struct mill_pinch *b = &p->ball[i];
    const double passed = t - b->last, duration = p->duration[w->ball[i].species];
    if (passed < duration) {
        b->impulse *= 1.0 - passed / duration;
        pressed = b->last - b->since > duration ? passed : 0.0;
    } else {
        b->impulse = 0.0;
        b->against = vec3_make(0.0, 0.0, 0.0);
        b->friction = 0.0;
        b->since = t;
    }
    b->last = t;
    mill_pinches_hold(p, w, i);
    return pressed;
}

/* [N] The force that moves a ball of this radius through the nip between an edge and the surface
 * `against`. The ball slips on neither if the angle between them is less than the sum of both
 * angles of friction. Pressed in by d on both sides, it has a cosine of this angle that is d (1 +
 * cos) / r nearer to this limit. Pressed in by r (1 - cos) / 2, it passes through. */
static double passing(const struct mill_pinch *b, vec3 normal, double friction, double radius)
{
    const double f = friction, g = b->friction, cosine = -vec3_dot(normal, b->against);
    const double held = (1.0 - f * g) / sqrt((1.0 + f * f) * (1.0 + g * g));
    const double grip = fmax(0.0, radius * (held - cosine) / (1.0 + cosine));
    const double room = fmax(0.0, 0.5 * radius * (1.0 - cosine));
    return mill_impact_force(radius, grip) + LOST * mill_impact_force(radius, room);
}

bool mill_pinches_push(struct mill_pinches *p, const struct mill_world *w, int32_t i,
                       double impulse, vec3 normal, double friction)
{
    struct mill_pinch *b = &p->ball[i];
    const int32_t species = w->ball[i].species;
    const double passed = passing(b, normal, friction, w->species[species].radius);
    b->impulse += impulse;
    if (b->impulse <= fmin(p->most[species], passed * p->duration[species]))
        return false;
    b->since = b->last;
    b->impulse = 0.0;
    p->held[i] = 0;
    return true;
}

void mill_pinches_restart(struct mill_pinches *p, const struct mill_world *w, double by)
{
    for (int32_t i = 0; p->ball && i < w->balls; i++) {
        p->ball[i].since -= by;
        p->ball[i].last -= by;
        mill_pinches_hold(p, w, i);
    }
}
