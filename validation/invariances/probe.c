/* Runs a deck on the engine itself and prints every state in full double precision, so that runs
 * may be compared bit by bit. It can change what no deck can, because it must not matter: the
 * clock's origin, the width of a day in the event list, the size of the cells; and it can lift the
 * limit of friction and turn all velocities round. Output, binary doubles: for each of SLICES + 1
 * equidistant times (with
 * --reverse as many again on the way back) one row of figures (time, contacts, rotor work,
 * dissipation, 0...) and then one row a ball: position, velocity, spin. */
#include "deck/deck.h"
#include "engine/sim_private.h"
#include "millsim/sim.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { ROW = 9 };

struct probe {
    double clock; /* [s] simulated time at which the run starts */
    double width; /* [s] of a day of the event list, forced again and again; 0: as it comes */
    double cells; /* side of the cells over the one the engine would take; a power of two */
    bool reverse;
    bool stick; /* no Coulomb limit: contacts with friction never slide */
    const char *deck;
    double time; /* [s] */
    long slices;
    struct mill_world *world;
    struct mill_sim *sim;
    struct mill_error error;
};

static bool read_arguments(struct probe *p, int argc, char **argv, int *used)
{
    int k = 1;
    for (; k < argc && strncmp(argv[k], "--", 2) == 0; k++) {
        double *value = strcmp(argv[k], "--clock") == 0   ? &p->clock
                        : strcmp(argv[k], "--width") == 0 ? &p->width
                        : strcmp(argv[k], "--cells") == 0 ? &p->cells
                                                          : NULL;
        if (strcmp(argv[k], "--reverse") == 0)
            p->reverse = true;
        else if (strcmp(argv[k], "--stick") == 0)
            p->stick = true;
        else if (value && k + 1 < argc)
            *value = atof(argv[++k]);
        else
            return false;
    }
    if (argc - k < 3)
        return false;
    p->deck = argv[k];
    p->time = atof(argv[k + 1]);
    p->slices = atol(argv[k + 2]);
    *used = k + 3;
    return p->slices > 0 && p->time > 0.0 && p->cells >= 1.0;
}

/* Cells are as large as the largest ball. Larger ones come of balls that are larger while the grid
 * is laid; the plans made then are thrown away. Surfaces listed for larger balls are a few more
 * than needed, never fewer. */
static bool create_sim(struct probe *p)
{
    struct mill_world *w = p->world;
    for (int k = 0; k < w->species_count; k++)
        w->species[k].radius *= p->cells;
    const enum mill_status status = mill_sim_create(w, &p->sim, &p->error);
    for (int k = 0; k < w->species_count; k++)
        w->species[k].radius /= p->cells;
    if (status != MILL_OK)
        return false;
    for (int k = 0; k < w->species_count; k++)
        p->sim->schedule->radius[k] = w->species[k].radius;
    for (int32_t i = 0; p->cells > 1.0 && i < w->balls; i++)
        mill_schedule_ball(p->sim->schedule, i, 0.0, MILL_NOBODY);
    return true;
}

static bool print_state(const struct probe *p, double time, double sign)
{
    const struct mill_world *w = p->world;
    const double t = mill_sim_local_time(p->sim);
    double row[ROW] = {time, 0.0, w->account.work};
    for (int k = 0; k < MILL_KINDS; k++) {
        row[1] += (double)w->account.collisions[k];
        row[3] += w->account.dissipation[k];
    }
    bool good = fwrite(row, sizeof row, 1, stdout) == 1;
    for (int32_t i = 0; i < w->balls && good; i++) {
        const vec3 r = mill_world_position(w, i, t);
        const vec3 v = vec3_scale(mill_world_velocity(w, i, t), sign);
        const vec3 s = vec3_scale(w->spin[i], sign);
        const double ball[ROW] = {r.x, r.y, r.z, v.x, v.y, v.z, s.x, s.y, s.z};
        good = fwrite(ball, sizeof ball, 1, stdout) == 1;
    }
    return good;
}

/* From simulated time `from` on; sign -1: the balls run backwards, print them as if forwards. */
static bool run(struct probe *p, double from, double sign)
{
    const double step = p->time / (double)p->slices;
    for (long k = 1; k <= p->slices; k++) {
        const double until = from + (double)k * step;
        enum mill_status status = MILL_OK;
        while (p->width > 0.0 && status == MILL_OK && mill_sim_time(p->sim) < until) {
            mill_calendar_set_width(p->sim->schedule->calendar, p->width);
            status = mill_sim_run(p->sim, until, 100, NULL, &p->error);
        }
        if (status == MILL_OK)
            status = mill_sim_run(p->sim, until, UINT64_MAX, NULL, &p->error);
        const double shown = sign > 0.0 ? (double)k * step : (double)(p->slices - k) * step;
        if (status != MILL_OK || !print_state(p, shown, sign))
            return false;
    }
    return true;
}

/* All balls stop where they are and fly back. */
static bool turn_round(struct probe *p)
{
    struct mill_world *w = p->world;
    const double t = mill_sim_local_time(p->sim);
    for (int32_t i = 0; i < w->balls; i++) {
        struct mill_ball *b = &w->ball[i];
        const vec3 r = mill_world_position(w, i, t);
        b->v = vec3_scale(mill_world_velocity(w, i, t), -1.0);
        b->r = r;
        b->t = 0.0;
        w->spin[i] = vec3_scale(w->spin[i], -1.0);
    }
    mill_sim_free(p->sim);
    p->sim = NULL;
    w->base = p->clock;
    return create_sim(p) && print_state(p, p->time, -1.0);
}

int main(int argc, char **argv)
{
    struct probe p = {.cells = 1.0};
    struct mill_deck *deck = NULL;
    int used = 0;
    if (!read_arguments(&p, argc, argv, &used)) {
        fprintf(stderr,
                "usage: probe [--clock S] [--width S] [--cells FACTOR] [--stick] [--reverse] "
                "DECK TIME SLICES [SECTION.KEY=VALUE ...]\n");
        return 2;
    }
    bool good = mill_deck_read(p.deck, argc - used, (const char *const *)(argv + used), NULL, NULL,
                               NULL, &deck, &p.error) == MILL_OK &&
                mill_deck_setup_world(deck, NULL, &p.world, &p.error) == MILL_OK;
    if (good) {
        p.world->base = p.clock;
        for (int k = 0; p.stick && k < MILL_KINDS; k++) {
            if (p.world->law[k].friction > 0.0)
                p.world->law[k].friction = HUGE_VAL;
        }
        good = create_sim(&p) && print_state(&p, 0.0, 1.0) && run(&p, p.clock, 1.0);
    }
    if (good && p.reverse)
        good = turn_round(&p) && run(&p, p.clock, -1.0);
    if (!good)
        fprintf(stderr, "probe: %s\n", p.error.text);
    mill_sim_free(p.sim);
    mill_world_free(p.world);
    mill_deck_free(deck);
    return good && fflush(stdout) == 0 ? 0 : 1;
}
