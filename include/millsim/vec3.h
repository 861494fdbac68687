/* Vectors, inline because the most frequent loops use them. Frame: x along the drum's axis */
#ifndef MILLSIM_VEC3_H
#define MILLSIM_VEC3_H

#include <math.h>

#define MILL_PI 3.14159265358979323846

typedef struct {
    double x, y, z;
} vec3;

/* fmin and fmax of the C library handle NaN and are calls; these are one instruction each. */
static inline double mill_least(double a, double b)
{
    return a < b ? a : b;
}

static inline double mill_greatest(double a, double b)
{
    return a > b ? a : b;
}

static inline vec3 vec3_make(double x, double y, double z)
{
    return (vec3){x, y, z};
}

static inline vec3 vec3_add(vec3 a, vec3 b)
{
    return vec3_make(a.x + b.x, a.y + b.y, a.z + b.z);
}

static inline vec3 vec3_sub(vec3 a, vec3 b)
{
    return vec3_make(a.x - b.x, a.y - b.y, a.z - b.z);
}

static inline vec3 vec3_scale(vec3 a, double s)
{
    return vec3_make(a.x * s, a.y * s, a.z * s);
}

/* a + s b */
static inline vec3 vec3_axpy(vec3 a, double s, vec3 b)
{
    return vec3_make(a.x + s * b.x, a.y + s * b.y, a.z + s * b.z);
}

static inline double vec3_dot(vec3 a, vec3 b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

static inline vec3 vec3_cross(vec3 a, vec3 b)
{
    return vec3_make(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
}

static inline double vec3_norm(vec3 a)
{
    return sqrt(vec3_dot(a, a));
}

/* a turned about a unit vector by an angle (Rodrigues) */
static inline vec3 vec3_turned(vec3 a, vec3 axis, double cosine, double sine)
{
    const vec3 along = vec3_scale(axis, vec3_dot(axis, a));
    return vec3_axpy(vec3_axpy(along, cosine, vec3_sub(a, along)), sine, vec3_cross(axis, a));
}

/* r + v t + g t^2 / 2: where a ball is after t seconds of free flight */
static inline vec3 vec3_fly(vec3 r, vec3 v, vec3 g, double t)
{
    const double h = 0.5 * t * t;
    return vec3_make(r.x + v.x * t + g.x * h, r.y + v.y * t + g.y * h, r.z + v.z * t + g.z * h);
}

#endif
