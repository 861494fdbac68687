/* Claims about the sums of all statistics: what the lists of their numbers do. */
#include "mill_fixture.h"
#include "observe/sink.h"

static struct fixture f;

static void setup(void)
{
    fixture_init(&f);
    f.asked.sample_from = 0;
}

static void teardown(void)
{
    fixture_free(&f);
}

struct record {
    uint64_t count;
    double row[3][2]; /* only the first of each two is in the list */
};
static const struct mill_sum of[] = {
    {"count", "1", "how many", MILL_H5_U64, offsetof(struct record, count), 0, 0},
    {"row", "J", "three", MILL_H5_F64, offsetof(struct record, row), 3, 2 * sizeof(double)}};
static const struct mill_sums_list list = {"records", sizeof(struct record), 2, of};

TEST(adding_adds_the_numbers_of_the_list)
{
    struct mill_sums one, other;
    ck_assert(mill_sums_make(&one, &list, 2) && mill_sums_make(&other, &list, 2));
    struct record *a = one.record, *b = other.record;
    a[1] = (struct record){1, {{0.5, 7}, {1, 7}, {2, 7}}};
    b[1] = (struct record){2, {{4, 9}, {8, 9}, {16, 9}}};
    mill_sums_add(&one, &other);
    ck_assert_uint_eq(a[1].count, 3);
    ck_assert(a[1].row[0][0] == 4.5 && a[1].row[1][0] == 9 && a[1].row[2][0] == 18);
    ck_assert(a[1].row[2][1] == 7 && a[0].count == 0);
    mill_sums_clear(&one);
    ck_assert(a[1].count == 0 && a[1].row[2][0] == 0 && b[1].count == 2);
    mill_sums_free(&one);
    mill_sums_free(&other);
}

/* ---- what a sink gets ---- */

static double got[16];
static size_t many;

static void keep(struct mill_sink *sink, const char *name, enum mill_h5_type type, int rank,
                 const size_t *dims, const void *values, const char *unit, const char *meaning)
{
    (void)sink, (void)meaning;
    ck_assert_str_eq(name, "row");
    ck_assert_str_eq(unit, "J");
    ck_assert_int_eq(type, MILL_H5_F64);
    ck_assert_int_eq(rank, 2);
    many = dims[0] * dims[1];
    memcpy(got, values, many * sizeof *got);
}

TEST(a_view_chooses_records_and_numbers)
{
    static const int32_t which[] = {1, -1, 0};
    struct mill_sums sums;
    struct mill_sink sink = {.values = keep};
    ck_assert(mill_sums_make(&sums, &list, 2));
    ((struct record *)sums.record)[0] = (struct record){0, {{1}, {2}, {3}}};
    ((struct record *)sums.record)[1] = (struct record){0, {{4}, {5}, {6}}};
    const struct mill_sums_view view = {1, {3}, which, 1, 2};
    mill_sums_tell(&sums, 1, &view, &sink);
    static const double expected[] = {5, 6, 0, 0, 2, 3};
    ck_assert_uint_eq(many, 6);
    for (int i = 0; i < 6; i++)
        ck_assert(got[i] == expected[i]);
    mill_sums_free(&sums);
}

/* ---- statistics of two stretches ---- */

/* Impacts number `first` to `end` - 1, of all kinds, at times, places and speeds by chance */
static void play(long first, long end)
{
    for (long k = first; k < end; k++) {
        const double x = (double)(k * 7919 % 1000) / 1000;
        const enum mill_kind kind = (enum mill_kind)(k % MILL_KINDS);
        struct mill_impact impact =
            impact_of(1e-3 * (double)k, kind, (int)(k % 40), (int)(k % 7), 0.01 + x, 1e-3 * x * x);
        impact.position = vec3_make(0.1 * x - 0.05, 0.06 * x, -0.05 * x);
        impact.lasting = k % 11 == 0;
        fixture_play(&f, impact);
    }
}

/* Are these numbers of two records equal: counts exactly, sums to rounding? */
static void assert_same(const struct mill_sum *sum, const char *a, const char *b)
{
    for (size_t i = 0; i < (sum->n > 0 ? sum->n : 1); i++) {
        uint64_t count[2];
        double value[2];
        memcpy(&count[0], a + sum->at + i * sum->step, sizeof *count);
        memcpy(&count[1], b + sum->at + i * sum->step, sizeof *count);
        memcpy(value, count, sizeof value);
        if (sum->type == MILL_H5_U64)
            ck_assert_uint_eq(count[0], count[1]);
        else
            ck_assert_double_le(fabs(value[0] - value[1]), 1e-12 * (1 + fabs(value[0])));
    }
}

static struct mill_gathered copy_of(const struct mill_tally *tally)
{
    struct mill_gathered copy;
    ck_assert(mill_gathered_make(&copy, &tally->plan, tally->plan.kinds));
    mill_gathered_add(&copy, &tally->gathered);
    return copy;
}

TEST(statistics_of_two_halves_add_up_to_those_of_the_whole)
{
    enum { IMPACTS = 1200 };
    struct mill_gathered part[2];
    f.asked.strike_window = 0; /* a strike could begin in the one half and end in the other */
    for (int half = 0; half < 2; half++) {
        f.asked.sample_from = half ? 0.6 : 0;
        f.asked.end = half ? 1.2 : 0.6;
        fixture_create(&f);
        play(half ? IMPACTS / 2 : 0, half ? IMPACTS : IMPACTS / 2);
        fixture_wait(&f, f.asked.end);
        part[half] = copy_of(f.tally);
        fixture_free(&f);
    }
    f.asked.sample_from = 0;
    fixture_create(&f);
    play(0, IMPACTS);
    fixture_wait(&f, 1.2);
    mill_gathered_add(&part[0], &part[1]);
    ck_assert_uint_gt(part[0].impacts[MILL_BALL_DRUM].normal.slot[1000].count +
                          mill_spectrum_total(&part[0].impacts[MILL_BALL_DRUM].normal, 0).count,
                      100);
    ck_assert_uint_eq(part[0].counts->samples, 1200);
    for (int i = 0; i < MILL_GATHERED_PARTS; i++) {
        const struct mill_sums *a = &part[0].part[i], *b = &f.tally->gathered.part[i];
        ck_assert_uint_eq(a->count, b->count);
        for (size_t record = 0; record < a->count; record++)
            for (int k = 0; k < a->list->count; k++)
                assert_same(&a->list->sum[k], (const char *)a->record + record * a->list->size,
                            (const char *)b->record + record * b->list->size);
    }
    mill_gathered_free(&part[0]);
    mill_gathered_free(&part[1]);
}

/* Every byte of a record is in its list: else adding would lose it. */
TEST(the_lists_describe_all_of_their_records)
{
    fixture_create(&f);
    for (int i = 0; i < MILL_GATHERED_PARTS; i++) {
        const struct mill_sums_list *l = f.tally->gathered.part[i].list;
        size_t numbers = 0;
        for (int k = 0; k < l->count; k++)
            numbers += l->sum[k].n > 0 ? l->sum[k].n : 1;
        ck_assert_uint_eq(numbers * sizeof(double), l->size);
    }
}

/* ---- many species ---- */

TEST(many_species_are_counted_in_classes_of_about_the_same_mass)
{
    enum { SPECIES = 100 };
    static struct mill_species species[SPECIES];
    for (int k = 0; k < SPECIES; k++) {
        species[k] = f.species;
        species[k].mass = 1e-3 * (1 + k * 37 % SPECIES);
    }
    struct mill_energies few, many_ones;
    ck_assert(mill_energies_init(&few, &f.world));
    f.world.species = species;
    f.world.species_count = SPECIES;
    ck_assert(mill_energies_init(&many_ones, &f.world));
    ck_assert_uint_eq(few.classes, 1);
    ck_assert_uint_eq(many_ones.classes, MILL_ENERGIES_CLASSES);
    ck_assert_uint_eq(many_ones.pairs, MILL_ENERGIES_CLASSES * (MILL_ENERGIES_CLASSES + 1) / 2 +
                                           (MILL_KINDS - 1) * MILL_ENERGIES_CLASSES);
    for (int i = 0; i < SPECIES; i++)
        for (int k = 0; k < SPECIES; k++)
            if (species[i].mass < species[k].mass)
                ck_assert_int_le(many_ones.class_of[i], many_ones.class_of[k]);
    /* the energy is that of the two balls, not of their classes */
    struct mill_sums sums;
    ck_assert(mill_sums_make(&sums, &mill_energies_sums, many_ones.pairs));
    struct mill_impact impact = impact_of(0.1, MILL_BALL_BALL, 1, 2, 2.0, 0.1);
    impact.species = 90;
    impact.partner_species = 3;
    mill_energies_impact(&many_ones, sums.record, &impact);
    const double mass = species[90].mass * species[3].mass / (species[90].mass + species[3].mass);
    const size_t pair =
        mill_energies_balls((size_t)many_ones.class_of[3], (size_t)many_ones.class_of[90]);
    const struct mill_energies_pair *met = (struct mill_energies_pair *)sums.record + pair;
    ck_assert_uint_eq(met->normal[mill_energies_bin(1e3 * 0.5 * mass * 4)].count, 1);
    mill_sums_free(&sums);
    mill_energies_free(&few);
    mill_energies_free(&many_ones);
}

int main(void)
{
    return unit_run_in("sums", setup, teardown);
}
