/* The drum's inner cross-section, measured on the shape itself: how far it reaches, and how much of
 * a map's cell lies inside. */
#ifndef MILL_SECTION_H
#define MILL_SECTION_H

#include "millsim/world.h"

/* The farthest that the inner surface gets from the axis [m]: the drum's radius, more for a wavy
 * one. */
double mill_section_radius(const struct mill_world *world);

/* area[n * n] [m^2]: what lies inside the drum of each of the n x n equal cells over [-radius,
 * radius]^2, index y * n + z. n is even. Exact for the circle, else sampled to about 0.1 % of a
 * cell. */
void mill_section_cells(const struct mill_world *world, double radius, int n, double *area);

/* area[n] [m^2]: what lies inside the drum of each of the n equal rings of r over [0, radius]. */
void mill_section_rings(const struct mill_world *world, double radius, int n, double *area);

#endif
