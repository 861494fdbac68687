/* Who may touch whom. Balls get slots by the place of their cells once in an epoch: neighbours are
 * near each other in memory. Lists of neighbours hold all pairs with a gap below the skin, and are
 * made again when a ball may have gone half of it. Only slots decide how forces are ordered. */
#include "engine/soft.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Of the largest diameter. Wider lists hold more pairs that do not touch (measured). */
#define SKIN 0.22
/* Balls of a part, for small and for large mills: fewer have more neighbours in other parts */
enum { SMALL = 22, SMALL_PARTS = 16, LARGE = 1000 };

bool mill_soft_lists_create(struct mill_soft *s)
{
    const struct mill_world *w = s->world;
    const size_t n = (size_t)w->balls;
    const int many = w->balls / SMALL, most = many < SMALL_PARTS ? many : SMALL_PARTS;
    s->thinnest = INFINITY;
    for (int k = 0; k < w->species_count; k++) {
        s->thickest = mill_greatest(s->thickest, w->species[k].radius);
        s->thinnest = mill_least(s->thinnest, w->species[k].radius);
    }
    const double widest = 2.0 * s->thickest;
    s->skin = SKIN * widest;
    if (w->container.period > 0.0) /* a slice must stay longer than three of the wider balls */
        s->skin = mill_least(s->skin, 0.9 * (w->container.period / 3.0 - widest));
    s->skin = mill_greatest(s->skin, 1e-3 * widest);
    s->parts = w->balls / LARGE > most ? w->balls / LARGE : most;
    s->parts = s->parts < 1 ? 1 : s->parts > MILL_SOFT_PARTS ? MILL_SOFT_PARTS : s->parts;
    s->share[1] = s->parts;
    s->wide = *w;
    s->wide.species =
        mill_memory_take(&s->memory, (size_t)w->species_count, sizeof *s->wide.species);
    s->begin = mill_memory_take(&s->memory, n + 1, sizeof *s->begin);
    s->slot = mill_memory_take(&s->memory, n, sizeof *s->slot);
    s->order = mill_memory_take(&s->memory, n, sizeof *s->order);
    if (s->memory.failed)
        return false;
    for (int k = 0; k < w->species_count; k++) {
        s->wide.species[k] = w->species[k];
        s->wide.species[k].radius += 0.5 * s->skin;
    }
    for (int k = 0; k < s->parts; k++) {
        struct mill_soft_part *p = &s->part[k];
        p->number = k;
        p->first = (int32_t)((int64_t)w->balls * k / s->parts);
        p->last = (int32_t)((int64_t)w->balls * (k + 1) / s->parts);
        p->near.size = sizeof(struct mill_soft_near);
        p->touch.size = sizeof(struct mill_soft_touch);
        p->told.size = sizeof(struct mill_sim_entry);
        p->unused = -1;
        p->around = malloc((n + MILL_CELL_ROW) * sizeof *p->around);
        p->sent = mill_memory_take(&s->memory, 2 * (size_t)s->parts, sizeof *p->sent);
        if (!p->around || !p->sent)
            return false;
        p->kick = p->sent + s->parts;
        for (int to = 0; to < 2 * s->parts; to++)
            p->sent[to].size = sizeof(struct mill_soft_sent);
    }
    return mill_grids_init(&s->grids, &s->wide, 1.0);
}

void mill_soft_lists_free(struct mill_soft *s)
{
    for (int k = 0; k < s->parts; k++) {
        struct mill_soft_part *p = &s->part[k];
        for (int to = 0; p->sent && to < 2 * s->parts; to++)
            free(p->sent[to].item);
        free(p->near.item);
        free(p->touch.item);
        free(p->told.item);
        free(p->around);
    }
    mill_grids_release(&s->grids);
}

/* ---- contacts and their places ---- */

int32_t mill_soft_touch_get(struct mill_soft_part *p)
{
    const int32_t touch = p->unused;
    if (touch < 0)
        return mill_memory_add(&p->touch) ? (int32_t)p->touch.count - 1 : -1;
    p->unused = mill_soft_touch(p, touch)->next;
    return touch;
}

void mill_soft_touch_put(struct mill_soft_part *p, int32_t touch)
{
    struct mill_soft_touch *t = mill_soft_touch(p, touch);
    t->a = MILL_NOBODY;
    t->next = p->unused;
    p->unused = touch;
}

void mill_soft_touch_link(struct mill_soft_part *p, struct mill_soft_ball *ball, int32_t touch)
{
    struct mill_soft_touch *t = mill_soft_touch(p, touch);
    int32_t *link = &ball->walls;
    while (*link >= 0) {
        struct mill_soft_touch *other = mill_soft_touch(p, *link);
        if (other->shape > t->shape || (other->shape == t->shape && other->begin > t->begin))
            break;
        link = &other->next;
    }
    t->next = *link;
    *link = touch;
}

void mill_soft_forget(struct mill_soft *s)
{
    for (int k = 0; k < s->parts; k++) {
        s->part[k].touch.count = 0;
        s->part[k].unused = -1;
    }
    for (int32_t i = 0; i < s->world->balls; i++)
        s->ball[i].walls = -1;
    s->listed = -INFINITY; /* the lists have the old contacts */
}

int32_t mill_soft_owner(const struct mill_soft *s, const struct mill_soft_touch *t)
{
    const int32_t a = s->slot[t->a], b = t->b < 0 ? a : s->slot[t->b];
    return a < b ? a : b;
}

/* ---- slots ---- */

static int by_cell(const void *one, const void *other)
{
    const struct mill_soft_order *a = one, *b = other;
    return a->cell != b->cell ? (a->cell > b->cell) - (a->cell < b->cell)
                              : (a->ball > b->ball) - (a->ball < b->ball);
}

/* The charge is cut across its longest side: so few neighbours as possible are in other parts. */
void mill_soft_sort(struct mill_soft *s)
{
    const struct mill_world *w = s->world;
    const struct mill_cells *c = &s->grids.own[0];
    int32_t index[3], low[3] = {INT32_MAX, INT32_MAX, INT32_MAX}, high[3] = {0, 0, 0};
    double length[3];
    int axis[3] = {0, 1, 2};
    for (int32_t i = 0; i < w->balls; i++) {
        s->order[i] = (struct mill_soft_order){mill_cells_at(c, w->ball[i].r), i};
        mill_cells_index(c, s->order[i].cell, index);
        for (int k = 0; k < 3; k++) {
            low[k] = index[k] < low[k] ? index[k] : low[k];
            high[k] = index[k] > high[k] ? index[k] : high[k];
        }
    }
    for (int k = 0; k < 3; k++)
        length[k] = (double)(high[k] - low[k]) * c->side[k];
    for (int k = 0; k < 3; k++) { /* axis[0]: the longest */
        int *const two = axis + k % 2, swap = two[0];
        if (length[two[1]] > length[two[0]]) {
            two[0] = two[1];
            two[1] = swap;
        }
    }
    for (int32_t i = 0; i < w->balls; i++) {
        mill_cells_index(c, s->order[i].cell, index);
        const int32_t row = index[axis[0]] * c->n[axis[1]] + index[axis[1]];
        s->order[i].cell = row * c->n[axis[2]] + index[axis[2]];
    }
    qsort(s->order, (size_t)w->balls, sizeof *s->order, by_cell);
    for (int32_t k = 0; k < w->balls; k++)
        s->slot[s->order[k].ball] = k;
}

/* ---- lists ---- */

/* Puts a slot into its place among `count` slots. */
static void put_in_order(int32_t *slot, int32_t count, int32_t one)
{
    for (; count > 0 && slot[count - 1] > one; count--)
        slot[count] = slot[count - 1];
    slot[count] = one;
}

/* Puts the contacts of a part's balls into their lists. */
static void join_part(struct mill_soft *s, struct mill_soft_part *p)
{
    struct mill_soft_near *near = p->near.item;
    for (int32_t n = 0; n < (int32_t)p->touch.count; n++) {
        const struct mill_soft_touch *t = mill_soft_touch(p, n);
        if (t->a < 0 || t->b < 0)
            continue;
        const int32_t slot = mill_soft_owner(s, t), other = s->slot[t->a] + s->slot[t->b] - slot;
        const int32_t end = mill_soft_near_end(s, p, slot);
        int32_t at = s->begin[slot];
        while (at < end && near[at].slot != other)
            at++;
        assert(s->watch || at < end);
        if (at < end)
            near[at].touch = n;
        else /* balls of another program can jump */
            mill_soft_touch_put(p, n);
    }
}

/* Lists the neighbours of a part's balls. */
static void list_part(struct mill_soft *s, struct mill_soft_part *p)
{
    const struct mill_world *w = s->world;
    p->near.count = 0;
    for (int32_t i = p->first; i < p->last; i++) {
        const struct mill_soft_place *own = &s->place[i];
        const int32_t cell = s->grids.own[0].cell[i];
        const int32_t n = mill_grids_gather(&s->grids, s->course[i].species, cell, p->around);
        int32_t kept = 0;
        s->begin[i] = (int32_t)p->near.count;
        for (int32_t k = 0; k < n; k++) {
            const int32_t j = p->around[k];
            const struct mill_soft_place *other = &s->place[j];
            const double sum = own->radius + other->radius + s->skin;
            vec3 d = vec3_sub(other->r, own->r);
            d.x = mill_world_image(w, d.x);
            if (j > i && vec3_dot(d, d) < sum * sum)
                put_in_order(p->around, kept++, j);
        }
        for (int32_t k = 0; k < kept; k++) {
            struct mill_soft_near *near = mill_memory_add(&p->near);
            if (!near) {
                p->failed = true;
                return;
            }
            *near = (struct mill_soft_near){p->around[k], -1};
        }
    }
    join_part(s, p);
}

bool mill_soft_list(struct mill_soft *s)
{
    const struct mill_world *w = s->world;
    const bool anew = isinf(s->listed);
    bool good = true;
    for (int k = 0; k < s->grids.classes && anew; k++)
        mill_cells_clear(&s->grids.own[k]);
    for (int32_t i = 0; i < w->balls && good; i++) {
        const int32_t cell = mill_cells_at(&s->grids.own[0], s->place[i].r);
        if (!anew && cell == s->grids.own[0].cell[i])
            continue;
        if (!anew)
            mill_grids_remove(&s->grids, i, s->course[i].species);
        good = mill_grids_insert(&s->grids, i, s->course[i].species, cell);
    }
    s->listed = s->path;
    return good && mill_soft_do(s, list_part);
}
