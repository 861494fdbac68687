/* The checks of a paranoid run that look at one moment: calendar, cells and energy account. */
#include "proof/paranoid_state.h"

#include <stdarg.h>
#include <stdio.h>

#define ACCOUNT_ERROR 1e-9 /* of the energy turned over */

bool mill_paranoid_fault(struct mill_sim *sim, double t, const char *format, ...)
{
    char text[sizeof sim->error->text], when[64] = "";
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    if (!isnan(t))
        snprintf(when, sizeof when, " at t = %.17g s", sim->world->base + t);
    sim->status = mill_error_set(sim->error, MILL_FAILED, "paranoid: %s%s", text, when);
    return false;
}

double mill_paranoid_size(const struct mill_world *w)
{
    const struct mill_container *c = &w->container;
    return c->still ? w->drum_radius + 0.5 * w->drum_length
                    : fmax(vec3_norm(c->places.lo), vec3_norm(c->places.hi));
}

bool mill_paranoid_calendar(struct mill_sim *sim, int32_t *first)
{
    const struct mill_schedule *q = sim->schedule;
    *first = 0;
    for (int32_t k = 0; k < sim->world->balls; k++) {
        const double planned = mill_plan_time(&q->plan[k]);
        const double entered = mill_calendar_time(q->calendar, k);
        if (!(planned == entered))
            return mill_paranoid_fault(
                sim, NAN, "the calendar has ball %d at t = %.17g s, but its plan has %.17g s", k,
                sim->world->base + entered, sim->world->base + planned);
        if (planned < mill_plan_time(&q->plan[*first]))
            *first = k;
        mill_paranoid_of(sim)->checks.entries++;
    }
    return true;
}

bool mill_paranoid_place(struct mill_sim *sim, int32_t i, double t)
{
    const struct mill_world *w = sim->world;
    const bool asleep = mill_world_asleep(w, i);
    const struct mill_grids *grids = asleep ? &sim->schedule->rest.grids : &sim->schedule->grids;
    const struct mill_cells *c = sim->schedule->cells;
    const vec3 r = mill_world_position(w, i, t);
    const double travel = vec3_norm(mill_world_velocity(w, i, t)) * sim->schedule->horizon;
    const double rounding = MILL_SIM_ROUNDINGS * (mill_paranoid_size(w) + travel);
    const double x[3] = {r.x - c->lo.x, r.y - c->lo.y, r.z - c->lo.z};
    const struct mill_cells *own = &grids->own[grids->class_of[w->ball[i].species]];
    const int32_t cell = c->cell[i], held = mill_cells_held(own, own->cell[i]);
    int32_t at = 0, index[3];
    mill_paranoid_of(sim)->checks.places++;
    while (at < held && mill_cells_ball(own, own->cell[i], at) != i)
        at++;
    if (at == held)
        return mill_paranoid_fault(sim, t, "ball %d is not in the list of its cell %d", i,
                                   own->cell[i]);
    mill_cells_index(c, cell, index);
    bool inside = true; /* the outermost cells are open outwards, except at periodic ends */
    for (int k = 0; k < 3; k++) {
        const int32_t first = c->margin, last = c->n[k] - c->margin - 1;
        const double lo = (index[k] - first) * c->side[k] - rounding;
        const double hi = lo + c->side[k] + 2.0 * rounding;
        const bool open = k > 0 || grids->period == 0.0;
        inside = inside && index[k] >= first && index[k] <= last && isfinite(x[k]) &&
                 ((open && index[k] == first) || x[k] >= lo) &&
                 ((open && index[k] == last) || x[k] <= hi);
    }
    return inside ||
           mill_paranoid_fault(sim, t, "ball %d at (%.9g, %.9g, %.9g) m is outside its cell %d", i,
                               r.x, r.y, r.z, cell);
}

bool mill_paranoid_account(struct mill_sim *sim)
{
    const struct mill_world *w = sim->world;
    const struct mill_energy e = mill_world_energy(w, sim->now);
    double imbalance, turnover, mass = 0.0;
    mill_world_balance(w, sim->now, &imbalance, &turnover);
    for (int32_t i = 0; i < w->balls; i++)
        mass += w->species[w->ball[i].species].mass;
    /* at first, rounding of the energies exceeds the error of the little energy turned over */
    const double held = e.kinetic + e.rotational + mass * vec3_norm(w->g) * mill_paranoid_size(w);
    mill_paranoid_of(sim)->checks.accounts++;
    return imbalance <= ACCOUNT_ERROR * turnover + MILL_SIM_ROUNDINGS * held ||
           mill_paranoid_fault(sim, sim->now,
                               "the energy account has an error of %.3g J, of %.3g J turned over",
                               imbalance, turnover);
}
