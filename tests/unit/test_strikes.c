/* Claims about the merging of re-contacts, against a plain list of all pairs ever seen. */
#include "draws.h"
#include "observe/strikes.h"

static bool fresh_at(struct mill_strikes *strikes, enum mill_kind kind, int ball, int partner,
                     double time)
{
    double since = 0;
    if (!mill_strikes_meet(strikes, kind, ball, partner, time, &since))
        ck_abort_msg("out of memory");
    return isinf(since);
}

/* Random contacts among few pairs, `contacts` of them, about `alive` pairs a window. The
 * dictionary: time and first contact of each pair, indexed by [kind][ball][partner + 1]. */
static void compare_with_a_dictionary(uint64_t seed, int balls, int contacts, double alive)
{
    struct mill_strikes strikes;
    const double window = 1e-5;
    const size_t pairs = (size_t)MILL_KINDS * (size_t)balls * (size_t)(balls + 1);
    double *last = calloc(pairs, sizeof *last);
    int *first = calloc(pairs, sizeof *first);
    double time = 0;
    int merged = 0, wrong = 0;
    ck_assert(mill_strikes_init(&strikes, window));
    for (size_t i = 0; i < pairs; i++)
        last[i] = -INFINITY;
    for (int i = 0; i < contacts; i++) {
        const int kind = (int)(random_bits(&seed) % MILL_KINDS);
        const int ball = (int)(random_bits(&seed) % (uint64_t)balls);
        const int partner = (int)(random_bits(&seed) % (uint64_t)(balls + 1)) - 1;
        const size_t pair = ((size_t)kind * (size_t)balls + (size_t)ball) * (size_t)(balls + 1) +
                            (size_t)(partner + 1);
        double since;
        time += window / alive * 2 * (double)(random_bits(&seed) % 1000) / 1000;
        struct mill_strike *strike =
            mill_strikes_meet(&strikes, (enum mill_kind)kind, ball, partner, time, &since);
        const bool fresh = time - last[pair] >= window;
        wrong += since != (fresh ? (double)INFINITY : time - last[pair]);
        if (fresh) {
            first[pair] = i % 30000;
            strike->normal = (int16_t)(i % 30000);
        }
        wrong += strike->normal != first[pair];
        last[pair] = time;
        merged += !fresh;
    }
    ck_assert_int_eq(wrong, 0);
    ck_assert_int_gt(merged, contacts / 100); /* the trace has both */
    ck_assert_int_lt(merged, contacts * 99 / 100);
    mill_strikes_free(&strikes);
    free(last);
    free(first);
}

TEST(a_sparse_trace_agrees_with_a_dictionary)
{
    compare_with_a_dictionary(1, 6, 300000, 30);
}

TEST(a_crowded_trace_that_makes_the_table_grow_agrees_with_a_dictionary)
{
    compare_with_a_dictionary(2, 60, 1000000, 9000);
}

TEST(a_chain_of_contacts_is_one_strike_however_long_it_lasts)
{
    struct mill_strikes strikes;
    ck_assert(mill_strikes_init(&strikes, 1e-5));
    ck_assert(fresh_at(&strikes, MILL_BALL_BALL, 3, 7, 0.1));
    for (int i = 1; i <= 1000; i++)
        ck_assert(!fresh_at(&strikes, MILL_BALL_BALL, 3, 7, 0.1 + i * 9e-6));
    ck_assert(fresh_at(&strikes, MILL_BALL_BALL, 3, 7, 0.1 + 1000 * 9e-6 + 1.1e-5));
    mill_strikes_free(&strikes);
}

TEST(pairs_that_differ_in_kind_ball_or_partner_are_kept_apart)
{
    struct mill_strikes strikes;
    ck_assert(mill_strikes_init(&strikes, 1));
    ck_assert(fresh_at(&strikes, MILL_BALL_BALL, 3, 7, 0));
    ck_assert(fresh_at(&strikes, MILL_BALL_BALL, 3, 8, 0));
    ck_assert(fresh_at(&strikes, MILL_BALL_BALL, 4, 7, 0));
    ck_assert(fresh_at(&strikes, MILL_BALL_BLADE, 3, 7, 0));
    ck_assert(fresh_at(&strikes, MILL_BALL_DRUM, 3, -1, 0));
    ck_assert(fresh_at(&strikes, MILL_BALL_SHAFT, 3, -1, 0));
    ck_assert(!fresh_at(&strikes, MILL_BALL_SHAFT, 3, -1, 0));
    ck_assert(!fresh_at(&strikes, MILL_BALL_BALL, 3, 7, 0));
    mill_strikes_free(&strikes);
}

TEST(contacts_exactly_one_window_apart_are_two_strikes)
{
    struct mill_strikes strikes;
    ck_assert(mill_strikes_init(&strikes, 0.25));
    ck_assert(fresh_at(&strikes, MILL_BALL_WALL, 1, 0, 1));
    ck_assert(fresh_at(&strikes, MILL_BALL_WALL, 1, 0, 1.25));
    ck_assert(!fresh_at(&strikes, MILL_BALL_WALL, 1, 0, nextafter(1.5, 0)));
    mill_strikes_free(&strikes);
}

TEST(without_a_window_every_contact_is_a_strike)
{
    struct mill_strikes strikes;
    ck_assert(mill_strikes_init(&strikes, 0));
    for (int i = 0; i < 10; i++)
        ck_assert(fresh_at(&strikes, MILL_BALL_BALL, 1, 2, 0.5));
    mill_strikes_free(&strikes);
}

TEST(a_million_pairs_one_after_the_other_need_no_more_room_than_a_few)
{
    struct mill_strikes strikes;
    uint64_t seed = 3;
    ck_assert(mill_strikes_init(&strikes, 1e-5));
    for (int i = 0; i < 1000000; i++) /* about ten alive at a time */
        fresh_at(&strikes, MILL_BALL_BALL, (int)(random_bits(&seed) >> 35),
                 (int)(random_bits(&seed) >> 35), i * 1e-6);
    ck_assert_uint_le(mill_strikes_room(&strikes), 4096);
    mill_strikes_free(&strikes);
}

TEST(neighbouring_numbers_do_not_crowd_into_the_same_buckets)
{
    struct mill_strikes strikes;
    ck_assert(mill_strikes_init(&strikes, 1));
    for (int ball = 0; ball < 100; ball++)
        for (int partner = 0; partner < 100; partner++)
            ck_assert(fresh_at(&strikes, MILL_BALL_BALL, ball, ball + partner, 0));
    ck_assert_uint_le(mill_strikes_room(&strikes), 40 * 100 * 100);
    mill_strikes_free(&strikes);
}

int main(void)
{
    return unit_run("strikes");
}
