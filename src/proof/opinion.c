/* What does GSL say of a contact time? Its roots are eigenvalues of the companion matrix (QR
 * algorithm) in y = 1/t: early times are large, accurate roots. Multiple roots are ill-conditioned,
 * but not the polynomial with these roots: it is asked for signs. docs/design.md has its error. */
#include "proof/paranoid.h"

#include <complex.h>
#include <gsl/gsl_poly.h>
#include <math.h>

struct roots {
    double complex y[4];
    double size; /* in this unit of y, no coefficient of the monic polynomial is above 1 */
    size_t n;
};

static bool solve(const double *c, struct roots *r)
{
    double monic[5] = {0};
    for (size_t k = 0; k <= r->n; k++) {
        monic[r->n - k] = c[k] / c[0];
        r->size = k > 0 ? fmax(r->size, pow(fabs(c[k] / c[0]), 1.0 / (double)k)) : 0;
    }
    gsl_poly_complex_workspace *room = gsl_poly_complex_workspace_alloc(r->n + 1);
    const bool solved = room && !gsl_poly_complex_solve(monic, r->n + 1, room, (double *)r->y);
    gsl_poly_complex_workspace_free(room);
    return solved;
}

/* (y - y1)...(y - yn) in units of its error */
static double value_at(const struct roots *r, double y)
{
    double complex value = 1;
    for (size_t k = 0; k < r->n; k++)
        value *= (y - r->y[k]) / (r->size + y);
    return creal(value) * 0x1p43; /* over 1024 roundings */
}

bool mill_opinion_agrees(const double c[5], double t_end, bool at_root, double t)
{
    const size_t zero = at_root || c[0] == 0; /* a root at t = 0 is divided out */
    const double y = 1 / fmin(t, t_end);
    struct roots r = {.n = 4 - zero};
    bool open = true, solved = solve(c + zero, &r);
    for (size_t k = 0; k <= r.n; k++) { /* from the end, or a root, to the next larger root */
        const double from = k < r.n ? creal(r.y[k]) : y;
        double to = HUGE_VAL;
        for (size_t i = 0; i < r.n; i++)
            to = creal(r.y[i]) > from ? fmin(to, creal(r.y[i])) : to;
        open = open && (from < y || to == HUGE_VAL || value_at(&r, 0.5 * (from + to)) >= -1);
    }
    return !solved || (open && (!(t <= t_end) || fabs(value_at(&r, y)) <= 1));
}
