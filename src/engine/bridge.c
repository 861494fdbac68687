/* When do bridges give way? bridge.h gives the rules; docs/physics.md tells how they were found. */
#include "engine/bridge.h"

#include "geometry/shape.h"

/* A bridge bears at most so many impacts of its balls at the surfaces' speed in one duration. */
#define IMPACTS 40.0

/* The fraction of the force at the top that is lost by a pair that passes alone, which gives the
 * rest back, and by one that another ball touched on the way. For steel (validation/referee) */
#define LOST 0.008
#define CROWDED 0.5

bool mill_bridges_create(struct mill_bridges *p, const struct mill_world *w,
                         struct mill_memory_pool *memory)
{
    bool two = false; /* motions */
    const struct mill_shape *first = NULL;
    for (int k = 0; k < w->shapes; k++) {
        const struct mill_shape *s = w->shape[k];
        if (s->pinches)
            continue;
        first = first ? first : s;
        two = two || s->motion != first->motion;
        if (s->motion)
            p->speed =
                mill_greatest(p->speed, mill_motion_fastest(s->motion, &w->container.places));
    }
    if (!two || p->speed <= 0.0)
        return true;
    p->duration = mill_memory_take(memory, (size_t)w->species_count, sizeof *p->duration);
    p->ball = mill_memory_take(memory, (size_t)w->balls, sizeof *p->ball);
    if (memory->failed)
        return false;
    for (int k = 0; k < w->species_count; k++)
        p->duration[k] = mill_impact_duration(w->species[k].mass, w->species[k].radius, p->speed);
    for (int32_t i = 0; i < w->balls; i++)
        p->ball[i] = (struct mill_bridge){
            .touched = -1.0, .met = -1.0, .last = -1.0, .other = -1.0, .shape = -1, .partner = -1};
    return true;
}

void mill_bridges_touch(struct mill_bridges *p, int32_t i, int32_t shape, vec3 normal, double t)
{
    if (!p->ball)
        return;
    struct mill_bridge *b = &p->ball[i];
    b->touched = t;
    b->normal = normal;
    b->shape = shape;
}

/* The ball has met another one. */
static void meet(struct mill_bridge *b, int32_t partner, double t)
{
    if (b->partner != partner)
        b->other = b->last;
    b->partner = partner;
    b->last = t;
}

/* The impulse of a contact between surfaces is added to that of the last duration. */
static void gather(struct mill_bridge *b, double impulse, double t, double duration)
{
    const double passed = t - b->met;
    b->impulse = passed < duration ? b->impulse * (1.0 - passed / duration) : 0.0;
    b->impulse += impulse;
    b->met = t;
}

/* [m/s] of the surface that the ball has touched last, there */
static vec3 velocity(const struct mill_world *w, const struct mill_bridge *b, int32_t i, double t)
{
    const struct mill_pose pose = mill_shape_pose(w->shape[b->shape], t);
    const double radius = mill_world_species(w, i)->radius;
    return mill_pose_velocity(&pose, vec3_axpy(w->ball[i].r, -radius, b->normal));
}

/* Two balls between their surfaces */
struct wedge {
    double mass, radius; /* [kg] reduced, [m] mean */
    double least, mean;  /* cosines of the angles between line of centres and normals */
    double held;         /* a larger cosine locks */
    double slide;        /* [m/s] of one surface past the other */
    double duration;     /* [s] */
};

/* [N s] above which the pair gives way */
static double bearing(const struct mill_bridges *p, const struct wedge *w, bool crowded)
{
    const double grip = fmax(w->radius * (w->held - w->least) / (1.0 + 0.5 * w->least), 0.0);
    const double room = 2.0 / 3.0 * w->radius * (1.0 - w->mean);
    /* of two equal balls the reduced radius is half of theirs */
    const double most = IMPACTS * w->mass * p->speed / w->duration;
    const double unlock = mill_least(mill_impact_force(0.5 * w->radius, grip), most);
    const double passing = (crowded ? CROWDED : LOST) * mill_impact_force(0.5 * w->radius, room);
    return 2.0 * w->mass * w->slide + w->duration * (unlock + passing);
}

double mill_bridges_push(struct mill_bridges *p, const struct mill_world *w, int32_t i, int32_t j,
                         vec3 n, double impulse, double t, bool *gives)
{
    *gives = false;
    if (!p->ball)
        return 0.0;
    struct mill_bridge *a = &p->ball[i], *b = &p->ball[j];
    const struct mill_species *sa = mill_world_species(w, i), *sb = mill_world_species(w, j);
    const double ta = p->duration[w->ball[i].species], tb = p->duration[w->ball[j].species];
    meet(a, j, t);
    meet(b, i, t);
    if (t - a->touched > ta || t - b->touched > tb)
        return 0.0;
    const struct mill_shape *one = w->shape[a->shape], *other = w->shape[b->shape];
    const double cos_a = vec3_dot(a->normal, n), cos_b = -vec3_dot(b->normal, n);
    if (one->motion == other->motion || cos_a <= 0.0 || cos_b <= 0.0)
        return 0.0;
    const double f = w->law[MILL_BALL_BALL].friction,
                 g = mill_greatest(w->law[one->kind].friction, w->law[other->kind].friction);
    const vec3 slide = vec3_sub(velocity(w, a, i, t), velocity(w, b, j, t));
    const struct wedge wedge = {
        .mass = sa->mass * sb->mass / (sa->mass + sb->mass),
        .radius = 0.5 * (sa->radius + sb->radius),
        .least = mill_least(cos_a, cos_b),
        .mean = 0.5 * (cos_a + cos_b),
        .held = (1.0 - f * g) / sqrt((1.0 + f * f) * (1.0 + g * g)),
        .slide = vec3_norm(vec3_axpy(slide, -vec3_dot(slide, a->normal), a->normal)),
        .duration = mill_greatest(ta, tb)};
    const double sine = sqrt(mill_greatest(1.0 - wedge.mean * wedge.mean, 0.0));
    const double passage = 2.0 * wedge.radius * sine * (1.0 + wedge.mean) / wedge.slide;
    const bool crowded = t - a->other < passage || t - b->other < passage;
    gather(a, impulse, t, ta);
    gather(b, impulse, t, tb);
    const double most = mill_greatest(a->impulse, b->impulse);
    if (most < (double)INFINITY && most > bearing(p, &wedge, crowded)) {
        a->impulse = b->impulse = INFINITY;
        *gives = true;
    }
    return most < (double)INFINITY ? g * impulse * wedge.slide : 0.0;
}

void mill_bridges_restart(struct mill_bridges *p, const struct mill_world *w, double by)
{
    for (int32_t i = 0; p->ball && i < w->balls; i++) {
        p->ball[i].touched -= by;
        p->ball[i].met -= by;
        p->ball[i].last -= by;
        p->ball[i].other -= by;
    }
}
