/* Claims about the memory of the large arrays. */
#include "base/memory.h"

#include "draws.h"

TEST(memory_begins_on_a_cache_line)
{
    void *kept[300];
    for (size_t n = 0; n < 300; n++) {
        kept[n] = mill_memory_get(n, 1 + n % 7);
        ck_assert_ptr_nonnull(kept[n]);
        ck_assert_uint_eq((uintptr_t)kept[n] % 64, 0);
    }
    for (size_t n = 0; n < 300; n++)
        free(kept[n]);
}

/* Used memory is given back just before, so that new memory is likely to be the same. */
TEST(memory_is_zero_to_its_last_byte)
{
    static const size_t sizes[] = {1, 63, 64, 65, 1000, 4096, 100000, 3000000};
    for (size_t k = 0; k < sizeof sizes / sizeof *sizes; k++) {
        unsigned char *used = mill_memory_get(sizes[k], 1);
        ck_assert_ptr_nonnull(used);
        memset(used, 0xff, sizes[k]);
        free(used);
        unsigned char *fresh = mill_memory_get(sizes[k], 1);
        ck_assert_ptr_nonnull(fresh);
        size_t dirty = 0;
        for (size_t n = 0; n < sizes[k]; n++)
            dirty += fresh[n] != 0;
        ck_assert_uint_eq(dirty, 0);
        free(fresh);
    }
}

TEST(a_size_beyond_all_memory_is_refused)
{
    static const size_t asked[][2] = {
        {SIZE_MAX, 1},           {1, SIZE_MAX},       {SIZE_MAX / 2 + 1, 2}, /* 0 by overflow */
        {SIZE_MAX / 8 + 2, 8},                                               /* 8 by overflow */
        {SIZE_MAX / 64 + 1, 64}, {SIZE_MAX, SIZE_MAX}};                      /* 1 by overflow */
    for (size_t k = 0; k < sizeof asked / sizeof *asked; k++)
        ck_assert_ptr_null(mill_memory_get(asked[k][0], asked[k][1]));
}

TEST(a_pool_gives_zeros_and_remembers_that_it_had_not_enough)
{
    struct mill_memory_pool pool = {.failed = false};
    for (size_t n = 0; n < 100; n++) {
        const unsigned char *one = mill_memory_take(&pool, n + 1, 3);
        ck_assert_uint_eq((uintptr_t)one % 64, 0);
        ck_assert(one[0] == 0 && one[3 * n + 2] == 0);
    }
    ck_assert(!pool.failed);
    ck_assert_ptr_null(mill_memory_take(&pool, SIZE_MAX, 2));
    ck_assert(pool.failed && pool.block.count == 100);
    mill_memory_drop(&pool);
    ck_assert(!pool.failed && pool.block.count == 0);
    mill_memory_drop(&pool);
}

int main(void)
{
    return unit_run("memory");
}
