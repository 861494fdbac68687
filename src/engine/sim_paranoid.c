/* A paranoid run: what an event changed is held against brute force. Any pair's contact depends on
 * the two balls' courses and plans alone, and those change only at events of one of them; so
 * checking each ball of each event against all others keeps "no contact comes before the next event
 * of either" true of all pairs at all times. The calendar is compared with a linear scan, the place
 * of a ball with its cell's box, the books with the energies (sim_paranoid_contact.c: contacts). */
#include "engine/sim_paranoid.h"

#include "engine/sim_private.h"

#include <stdlib.h>

#define ACCOUNT_EVERY 1000 /* events: the account takes all balls' energies */
#define ACCOUNT_ERROR 1e-9 /* of the energy turned over */

/* ---- the calendar ---- */

static enum mill_status check_calendar(struct mill_sim_paranoid *p, double *first, int32_t *item,
                                       struct mill_error *error)
{
    const struct mill_schedule *q = p->schedule;
    *first = INFINITY;
    *item = MILL_NOBODY;
    for (int32_t k = 0; k < q->world->balls; k++) {
        const double planned = mill_plan_time(&q->plan[k]);
        const double entered = mill_calendar_time(q->calendar, k);
        if (!(planned == entered))
            return mill_error_set(
                error, MILL_FAILED,
                "paranoid: the calendar has ball %ld at t = %.17g s, its plan says %.17g s",
                (long)k, q->world->base + entered, q->world->base + planned);
        if (planned < *first) {
            *first = planned;
            *item = k;
        }
        p->checks.entries++;
    }
    return MILL_OK;
}

static enum mill_status check_order(struct mill_sim_paranoid *p, int32_t i, double t, double now,
                                    struct mill_error *error)
{
    const struct mill_schedule *q = p->schedule;
    const double base = q->world->base;
    double first;
    int32_t item;
    if (!(t >= now - MILL_SIM_ROUNDINGS * q->horizon))
        return mill_error_set(error, MILL_FAILED,
                              "paranoid: the event of ball %ld at t = %.17g s comes %.3g s too "
                              "late",
                              (long)i, base + t, now - t);
    const enum mill_status status = check_calendar(p, &first, &item, error);
    if (status == MILL_OK && !(item == i && first == t))
        return mill_error_set(error, MILL_FAILED,
                              "paranoid: the calendar takes ball %ld at t = %.17g s, but ball %ld "
                              "is due at %.17g s",
                              (long)i, base + t, (long)item, base + first);
    return status;
}

/* ---- the cell grid ---- */

/* The ball is in its cell's list, and within its box along one axis: the outermost cells are open
 * outwards. */
static bool is_inside(const struct mill_cells *c, int axis, int32_t index, double x,
                      double rounding)
{
    const double lo = (double)(index - 1) * c->side[axis];
    const bool above = index == 1 || x >= lo - rounding;
    const bool below = index == c->n[axis] - 2 || x <= lo + c->side[axis] + rounding;
    return index >= 1 && index <= c->n[axis] - 2 && above && below && isfinite(x);
}

static enum mill_status check_place(struct mill_sim_paranoid *p, int32_t i, double now,
                                    struct mill_error *error)
{
    const struct mill_schedule *q = p->schedule;
    const struct mill_cells *c = &q->cells;
    const vec3 r = mill_world_position(q->world, i, now);
    const double travel = vec3_norm(mill_world_velocity(q->world, i, now)) * q->horizon;
    const double rounding = MILL_SIM_ROUNDINGS * (mill_sim_paranoid_size(q->world) + travel);
    const int32_t cell = c->cell[i], plane = c->n[1] * c->n[2];
    p->checks.places++;
    const int32_t held = mill_cells_held(c, cell);
    int32_t at = 0;
    while (at < held && mill_cells_ball(c, cell, at) != i)
        at++;
    if (at == held)
        return mill_error_set(
            error, MILL_FAILED,
            "paranoid: ball %ld is not in the list of its cell %ld at t = %.17g s", (long)i,
            (long)cell, q->world->base + now);
    if (!is_inside(c, 0, cell / plane, r.x - c->lo.x, rounding) ||
        !is_inside(c, 1, cell % plane / c->n[2], r.y - c->lo.y, rounding) ||
        !is_inside(c, 2, cell % c->n[2], r.z - c->lo.z, rounding))
        return mill_error_set(error, MILL_FAILED,
                              "paranoid: ball %ld at (%.9g, %.9g, %.9g) m is outside its cell %ld "
                              "at t = %.17g s",
                              (long)i, r.x, r.y, r.z, (long)cell, q->world->base + now);
    return MILL_OK;
}

/* ---- the books ---- */

enum mill_status mill_sim_paranoid_account(struct mill_sim_paranoid *p, double now,
                                           struct mill_error *error)
{
    const struct mill_world *w = p->schedule->world;
    const struct mill_energy e = mill_world_energy(w, now);
    double imbalance, turnover, mass = 0.0;
    mill_world_balance(w, now, &imbalance, &turnover);
    for (int32_t i = 0; i < w->balls; i++)
        mass += w->species[w->ball[i].species].mass;
    /* before much was turned over the roundings of the energies themselves are more */
    const double held =
        e.kinetic + e.rotational + mass * vec3_norm(w->g) * mill_sim_paranoid_size(w);
    p->checks.accounts++;
    if (!(imbalance <= ACCOUNT_ERROR * turnover + MILL_SIM_ROUNDINGS * held))
        return mill_error_set(error, MILL_FAILED,
                              "paranoid: the energy account is out by %.3g J of %.3g J turned over "
                              "at t = %.17g s",
                              imbalance, turnover, w->base + now);
    return MILL_OK;
}

/* ---- one event ---- */

enum mill_status mill_sim_paranoid_before(struct mill_sim_paranoid *p, int32_t i, double t,
                                          double now, struct mill_error *error)
{
    const struct mill_schedule *q = p->schedule;
    p->due = q->plan[i];
    p->contacts = q->world->ball[i].contacts;
    enum mill_status status = check_order(p, i, t, now, error);
    if (status == MILL_OK)
        status = check_place(p, i, t, error);
    if (status == MILL_OK)
        status = mill_sim_paranoid_touch(p, i, &p->due, error);
    return status;
}

static enum mill_status check_ball(struct mill_sim_paranoid *p, int32_t i, double now, bool fresh,
                                   int32_t touched, struct mill_error *error)
{
    enum mill_status status = check_place(p, i, now, error);
    p->checks.predictions++;
    if (status == MILL_OK)
        status = mill_sim_paranoid_touch(p, i, &p->schedule->plan[i], error);
    if (status == MILL_OK)
        status = mill_sim_paranoid_ball(p, i, now, fresh, touched, error);
    return status;
}

enum mill_status mill_sim_paranoid_after(struct mill_sim_paranoid *p, int32_t i, double now,
                                         struct mill_error *error)
{
    const struct mill_plan *due = &p->due;
    const bool met = p->schedule->world->ball[i].contacts != p->contacts;
    const bool pair = due->next == MILL_NEXT_PAIR;
    const bool crossed = due->next == MILL_NEXT_EXIT;
    const int32_t touched = met && !pair ? due->shape : MILL_NOBODY;
    enum mill_status status = met ? mill_sim_paranoid_met(p, i, now, error) : MILL_OK;
    if (status == MILL_OK)
        status = check_ball(p, i, now, !crossed, touched, error);
    if (status == MILL_OK && met && pair)
        status = check_ball(p, due->partner, now, true, MILL_NOBODY, error);
    p->checks.events++;
    if (status == MILL_OK && p->checks.events % ACCOUNT_EVERY == 0)
        status = mill_sim_paranoid_account(p, now, error);
    return status;
}

enum mill_status mill_sim_paranoid_all(struct mill_sim_paranoid *p, double now, bool fresh,
                                       struct mill_error *error)
{
    double first;
    int32_t item;
    enum mill_status status = check_calendar(p, &first, &item, error);
    for (int32_t i = 0; i < p->schedule->world->balls && status == MILL_OK; i++)
        status = check_ball(p, i, now, fresh, MILL_NOBODY, error);
    if (status == MILL_OK)
        status = mill_sim_paranoid_account(p, now, error);
    return status;
}

/* ---- switching on ---- */

enum mill_status mill_sim_paranoid(struct mill_sim *sim, bool on, struct mill_error *error)
{
    free(sim->paranoid);
    sim->paranoid = on ? calloc(1, sizeof *sim->paranoid) : NULL;
    if (!on)
        return MILL_OK;
    if (!sim->paranoid)
        return mill_error_set(error, MILL_FAILED, "out of memory for the checks");
    sim->paranoid->schedule = sim->schedule;
    return mill_sim_paranoid_all(sim->paranoid, sim->now, false, error);
}

struct mill_sim_checks mill_sim_checks(const struct mill_sim *sim)
{
    static const struct mill_sim_checks none;
    return sim->paranoid ? sim->paranoid->checks : none;
}
