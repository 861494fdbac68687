/* Claims about the marks in the blocks of slabs, against brute force over blocks and times: which
 * events must wait, and which came too early. */
#include "slabs_fixture.h"

/* The blocks where ball i's event changes balls: its own, and that of its partner or of the cell
 * that it enters */
static int places_of(const struct sliced *c, int32_t i, int32_t place[2])
{
    const struct mill_plan *plan = &c->p->plan[i];
    double shift;
    place[0] = place[1] = block_of_ball(c, i);
    if (plan->next == MILL_NEXT_PAIR)
        place[1] = block_of_ball(c, plan->partner);
    if (plan->next == MILL_NEXT_EXIT)
        place[1] =
            mill_grids_block(&c->p->grids, mill_grids_across(&c->p->grids, c->p->cells->cell[i],
                                                             plan->face, &shift));
    return plan->next == MILL_NEXT_PAIR || plan->next == MILL_NEXT_EXIT ? 2 : 1;
}

/* Are two blocks the same or next to each other? images: also across the ends of a periodic mill */
static bool are_close(const struct sliced *c, int32_t a, int32_t b, bool images)
{
    int32_t i[3], j[3];
    mill_cells_index(c->blocks, a, i);
    mill_cells_index(c->blocks, b, j);
    int32_t along = abs(i[0] - j[0]);
    if (images && c->p->grids.period > 0.0 && layers_of(c) - along < along)
        along = layers_of(c) - along;
    return along <= 1 && abs(i[1] - j[1]) <= 1 && abs(i[2] - j[2]) <= 1;
}

enum { CLAIMS = 3000 };

/* What has been claimed in a window, in order */
struct claims {
    int count, put_off, near; /* near: put off only because another one was */
    struct {
        int32_t place[2];
        int slab;
        double t;
        bool may;
    } claim[CLAIMS];
};

/* By brute force: may this slab's thread carry out an event in these places? */
static bool may_go(const struct sliced *c, const struct claims *all, int slab, const int32_t *place,
                   bool *inner)
{
    const struct mill_slab *own = &c->s->slab[slab];
    bool may = true;
    for (int a = 0; a < 2; a++)
        may = may && place[a] >= own->inner_lo && place[a] < own->inner_hi;
    *inner = may;
    for (int n = 0; n < all->count; n++)
        for (int k = 0; k < 4 && may && !all->claim[n].may && all->claim[n].slab == slab; k++)
            may = !are_close(c, all->claim[n].place[k / 2], place[k % 2], false);
    return may;
}

/* Threads of all slabs claim events, which come from `begin` on in steps of 1 us and change
 * nothing. Each slab has a few balls put off. */
static struct claims *claim_many(struct sliced *c, double begin, int most, uint64_t *seed)
{
    struct claims *all = calloc(1, sizeof *all);
    const int32_t balls = c->b.world->balls;
    mill_slabs_open(c->s, begin);
    for (int n = 0; n < most; n++) {
        const int32_t i = below(seed, balls);
        const int slab = c->s->home[i];
        if (mill_calendar_time(c->s->late, i) == HUGE_VAL)
            continue; /* it has been put off */
        bool inner;
        const double t = begin + 1e-6 * (all->count + 0.5);
        const int at = all->count;
        places_of(c, i, all->claim[at].place);
        const bool expected = may_go(c, all, slab, all->claim[at].place, &inner);
        const bool may = mill_slabs_claim(c->s, &c->s->slab[slab], i, t);
        ck_assert_msg(may == expected, "claim %d, of ball %d: %d", at, i, may);
        ck_assert_msg((mill_calendar_time(c->s->late, i) == HUGE_VAL) == !may, "ball %d: calendar",
                      i);
        all->claim[at].slab = slab;
        all->claim[at].t = t;
        all->claim[at].may = may;
        all->put_off += !may;
        all->near += inner && !may;
        all->count++;
    }
    return all;
}

/* The balls are few, and those that were put off hinder more and more: a window is short. */
LOOP_TEST(events_near_other_slabs_or_near_an_event_that_was_put_off_must_wait_and_no_others,
          LONG_MILLS)
{
    struct sliced c;
    uint64_t seed = 3;
    int count = 0, put_off = 0, near = 0;
    open_sliced(&c, _i, 2 + _i % 3);
    for (int window = 0; window < 50; window++) {
        struct claims *all = claim_many(&c, 0.1 * window, 60, &seed);
        count += all->count;
        put_off += all->put_off;
        near += all->near;
        free(all);
        mill_slabs_begin(c.s);
        for (int32_t i = 0; i < c.b.world->balls; i++)
            mill_slabs_enter(c.s, i, mill_plan_time(&c.p->plan[i]));
    }
    ck_assert_int_gt(put_off, 100);
    ck_assert_int_gt(near, 20);
    ck_assert_int_gt(count - put_off, 100);
    close_sliced(&c);
}

/* A ball whose event changes balls only in a block next to `from` (close), or two away from it; -1:
 * none */
static int32_t ball_in_reach(const struct sliced *c, int32_t from, bool close)
{
    const struct mill_slab *own = &c->s->slab[0];
    for (int32_t i = 0; i < c->b.world->balls; i++) {
        int32_t place[2], a[3], b[3];
        places_of(c, i, place);
        mill_cells_index(c->blocks, place[0], a);
        mill_cells_index(c->blocks, from, b);
        const bool in = place[0] == place[1] && place[0] >= own->inner_lo &&
                        place[0] < own->inner_hi && place[0] != from;
        const int32_t far =
            (int32_t)fmax(fmax(abs(a[0] - b[0]), abs(a[1] - b[1])), abs(a[2] - b[2]));
        if (in && far == (close ? 1 : 2))
            return i;
    }
    return -1;
}

LOOP_TEST(after_an_event_was_put_off_the_next_block_waits_and_the_one_after_it_does_not, 4)
{
    const int dense[] = {0, MIXED, PERIODIC, NARROW};
    struct sliced c;
    open_sliced(&c, dense[_i], 2);
    const struct mill_slab *own = &c.s->slab[0];
    int tried = 0;
    for (int32_t i = 0; i < c.b.world->balls; i++) {
        int32_t place[2];
        places_of(&c, i, place);
        /* just outside of the part where the thread works */
        if (place[0] != place[1] || place[0] < own->inner_hi || place[0] >= own->hi)
            continue;
        const int32_t next = ball_in_reach(&c, place[0], true),
                      after = ball_in_reach(&c, place[0], false);
        mill_slabs_open(c.s, 0.0);
        ck_assert(!mill_slabs_claim(c.s, own, i, 1e-6));
        tried += next >= 0 && after >= 0;
        ck_assert(after < 0 || mill_slabs_claim(c.s, own, after, 1e-6));
        ck_assert(next < 0 || !mill_slabs_claim(c.s, own, next, 1e-6));
        mill_slabs_open(c.s, 0.0); /* in the next window it need not wait */
        ck_assert(next < 0 || mill_slabs_claim(c.s, own, next, 1e-6));
    }
    ck_assert_int_gt(tried, 0);
    close_sliced(&c);
}

LOOP_TEST(an_event_came_too_early_exactly_if_a_later_one_was_done_next_to_it, LONG_MILLS)
{
    struct sliced c;
    uint64_t seed = 4;
    int passed = 0;
    open_sliced(&c, _i, 2);
    struct claims *all = claim_many(&c, 0.05, 400, &seed);
    for (int n = 0; n < 4000; n++) {
        const int32_t i = below(&seed, c.b.world->balls);
        const double t = 0.05 + 1e-6 * below(&seed, all->count + 1);
        int32_t place[2];
        places_of(&c, i, place);
        bool expected = false;
        for (int k = 0; k < all->count; k++)
            for (int a = 0; a < 4 && all->claim[k].may && all->claim[k].t > t; a++)
                expected =
                    expected || are_close(&c, all->claim[k].place[a / 2], place[a % 2], true);
        ck_assert_msg(mill_slabs_passed(c.s, i, t) == expected, "ball %d at %g s", i, t);
        passed += expected;
    }
    ck_assert_int_gt(passed, 200);
    ck_assert_int_lt(passed, 3800);
    mill_slabs_open(c.s, 0.05); /* what was done in another window does not matter */
    for (int32_t i = 0; i < c.b.world->balls; i++)
        ck_assert_msg(!mill_slabs_passed(c.s, i, 0.05), "ball %d", i);
    free(all);
    close_sliced(&c);
}

/* Their tags come round again. */
TEST(marks_of_a_window_long_ago_are_forgotten)
{
    struct sliced c;
    uint64_t seed = 6;
    open_sliced(&c, 0, 2);
    free(claim_many(&c, 0.0, 60, &seed));
    const uint16_t tag = c.s->tag;
    for (int n = 0; n < UINT16_MAX; n++) {
        mill_slabs_open(c.s, 0.0);
        ck_assert_msg(c.s->tag != 0, "a window without a tag");
    }
    ck_assert_int_eq(c.s->tag, tag);
    for (int32_t i = 0; i < c.b.world->balls; i++)
        ck_assert_msg(!mill_slabs_passed(c.s, i, 0.0), "ball %d", i);
    close_sliced(&c);
}

/* Images: an event at one end of a periodic mill, and one at the other end */
TEST(it_also_came_too_early_if_that_was_across_the_ends_of_a_periodic_mill)
{
    struct sliced c;
    int tried = 0;
    open_sliced(&c, PERIODIC, 2);
    const int32_t end = layers_of(&c) - 1;
    mill_slabs_open(c.s, 0.0);
    for (int32_t i = 0; i < c.b.world->balls; i++) {
        int32_t place[2];
        places_of(&c, i, place);
        const int32_t layer = layer_of(&c, place[0]);
        if (place[0] != place[1] || (layer != 0 && layer != end))
            continue;
        const int32_t image = place[0] + (layer ? -end : end) * c.s->layer;
        ck_assert_msg(!mill_slabs_passed(c.s, i, 1e-3), "ball %d", i);
        c.s->mark[image] = (struct mill_slab_mark){2e-3f, c.s->tag, 0};
        ck_assert_msg(mill_slabs_passed(c.s, i, 1e-3), "ball %d", i);
        ck_assert_msg(!mill_slabs_passed(c.s, i, 3e-3), "ball %d", i);
        c.s->mark[image].window = 0;
        tried++;
    }
    ck_assert_int_gt(tried, 5);
    close_sliced(&c);
}

int main(void)
{
    return unit_run("slabs_marks");
}
