/* Claims about random numbers: those of the GNU Scientific Library, to the bit. */
#include "base/random.h"
#include "unit.h"

#include <gsl/gsl_randist.h>

TEST(numbers_are_those_of_the_gnu_scientific_library)
{
    static const unsigned long seeds[] = {0, 1, 4357, 123456789, 4294967295UL};
    gsl_rng *gsl = gsl_rng_alloc(gsl_rng_mt19937);
    for (size_t k = 0; k < sizeof seeds / sizeof *seeds; k++) {
        struct mill_random random;
        mill_random_seed(&random, seeds[k]);
        gsl_rng_set(gsl, seeds[k]);
        for (int i = 0; i < 3000; i++)
            ck_assert(mill_random_uniform(&random) == gsl_rng_uniform(gsl));
        for (int i = 0; i < 3000; i++) {
            vec3 theirs;
            gsl_ran_dir_3d(gsl, &theirs.x, &theirs.y, &theirs.z);
            const vec3 ours = mill_random_direction(&random);
            ck_assert(ours.x == theirs.x && ours.y == theirs.y && ours.z == theirs.z);
        }
    }
    gsl_rng_free(gsl);
}

int main(void)
{
    return unit_run("random");
}
