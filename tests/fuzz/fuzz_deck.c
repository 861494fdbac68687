/* The deck from any bytes: read without harm, refused with one line, and what is accepted reads
 * back from its own print to the same. Behind each 0x1e stands one --set value. */
#include "fuzz.h"

#include "deck/deck.h"
#include "geometry/shapes.h"

enum { MOST_ORDERS = 8 };

static struct fuzz_file deck_file;

static void check_warning(const char *line)
{
    fuzz_require_message(line);
}

static struct mill_deck *read_deck(const void *data, size_t size, int count,
                                   const char *const *orders)
{
    struct mill_error error = {""};
    struct mill_deck *deck = NULL;
    const char *path = fuzz_file_write(&deck_file, data, size);
    const enum mill_status status =
        mill_deck_read(path, count, orders, check_warning, check_warning, NULL, &deck, &error);
    fuzz_require((status == MILL_OK) == (deck != NULL), "status %d and deck disagree", (int)status);
    if (status != MILL_OK) {
        fuzz_require(status == MILL_BAD_DECK, "status %d: %s", (int)status, error.text);
        fuzz_require_message(error.text);
        if (fuzz_shown())
            fprintf(stderr, "%s\n", error.text);
    }
    return deck;
}

static char *printed(const struct mill_deck *deck, size_t *size)
{
    char *text = NULL;
    FILE *out = open_memstream(&text, size);
    fuzz_require(out != NULL, "out of memory");
    mill_deck_print(deck, out);
    fclose(out);
    return text;
}

static void check_surfaces(const struct mill_deck *d)
{
    for (int k = 0; k < d->setup.surfaces; k++) {
        const struct mill_setup_surface *s = &d->setup.surface[k];
        fuzz_require(s->motion < d->setup.motions && s->kind > MILL_BALL_BALL &&
                         s->kind < d->mill.contacts.count && mill_solid_is_sound(s->solid, s->body),
                     "surface %d", k);
    }
}

static void check_numbers(const struct mill_deck *d)
{
    fuzz_require(d->setup.species > 0, "%d kinds", d->setup.species);
    fuzz_require(d->observe.end > 0.0 && d->observe.series > 0.0 && d->observe.sample_from >= 0.0 &&
                     d->observe.sample_from < d->observe.end && isfinite(d->observe.end),
                 "times %g %g %g", d->observe.end, d->observe.sample_from, d->observe.series);
    fuzz_require(isfinite(vec3_norm(d->setup.gravity)) && isfinite(d->given.rotor.speed) &&
                     isfinite(d->given.rotor.angle),
                 "gravity or rotor is not a number");
    for (int k = 0; k < d->setup.species; k++)
        fuzz_require(
            d->mill.balls[k].count > 0 && d->mill.balls[k].diameter > 0.0 &&
                (!d->mill.drum || (d->mill.balls[k].diameter < 2.0 * d->setup.drum.radius &&
                                   d->mill.balls[k].diameter < d->setup.drum.length)) &&
                d->mill.balls[k].density > 0.0,
            "kind %d", k);
    fuzz_require(d->mill.drum == !d->mill.container, "one container");
    for (int k = 0; k < d->setup.motions; k++)
        fuzz_require(d->mill.motion[k].on < k &&
                         d->mill.motion[k].type->is_sound(d->mill.motion[k].form),
                     "motion %d", k);
    check_surfaces(d);
    for (int k = 0; k < d->mill.contacts.count; k++) {
        const struct mill_deck_law *law = &d->mill.contact[k].law;
        fuzz_require((law->rows || (law->restitution >= 0.0 && law->restitution <= 1.0)) &&
                         law->friction >= 0.0 && fabs(law->tangential) <= 1.0,
                     "law %d", k);
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    char *order[MOST_ORDERS] = {NULL};
    int orders = 0;
    const uint8_t *end = memchr(data, 0x1e, size);
    const size_t length = end ? (size_t)(end - data) : size;
    size_t at = length;
    while (at < size && orders < MOST_ORDERS) {
        const uint8_t *next = memchr(data + at + 1, 0x1e, size - at - 1);
        const size_t stop = next ? (size_t)(next - data) : size;
        order[orders] = malloc(stop - at);
        fuzz_require(order[orders] != NULL, "out of memory");
        memcpy(order[orders], data + at + 1, stop - at - 1);
        order[orders++][stop - at - 1] = '\0';
        at = stop;
    }
    struct mill_deck *deck = read_deck(data, length, orders, (const char *const *)order);
    if (deck) {
        size_t first_size, second_size;
        check_numbers(deck);
        char *first = printed(deck, &first_size);
        if (fuzz_shown())
            fputs(first, stderr);
        struct mill_deck *again = read_deck(first, first_size, 0, NULL);
        fuzz_require(again != NULL, "the printed deck is refused:\n%s", first);
        char *second = printed(again, &second_size);
        fuzz_require(first_size == second_size && memcmp(first, second, first_size) == 0,
                     "printed, read and printed again:\n%s\nbecomes\n%s", first, second);
        mill_deck_free(again);
        free(first);
        free(second);
    }
    mill_deck_free(deck);
    for (int i = 0; i < orders; i++)
        free(order[i]);
    return 0;
}
