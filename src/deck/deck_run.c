/* [run], [gravity] and [output]: their keys, and whether they agree */
#include "deck/deck_keys.h"

#include <math.h>
#include <string.h>

enum { MOST_THREADS = 1024 };
#define SEED_MAX 4294967295.0 /* the random generator distinguishes as many seeds */
#define MOST_COLLISIONS 1e15  /* a double holds counts up to here exactly */
#define MOST_SAMPLES 1e8
#define MOST_FRAMES 1e7

/* The run finds sample_from. */
static bool sample_found(const void *deck)
{
    return ((const struct mill_deck *)deck)->mill.sample_found;
}

/* The program chooses the number of threads. */
static bool threads_chosen(const void *deck)
{
    return ((const struct mill_deck *)deck)->given.threads == 0;
}

/* clang-format off */
const struct mill_key mill_deck_run_key[] = {
    {"time", "end of the run", .unit = "s", POSITIVE, DECK(time)},
    {"sample_from", "statistics are gathered from here to the end", .unit = "s", NOT_NEGATIVE,
     .preset = "0 s", DECK(sample_from), .hidden = sample_found},
    {"precision", "the run ends when median speed and rotor power are known to this relative "
     "error; 0: at run.time", .unit = "1", .lo = 0, .hi = 1, .preset = "0", DECK(precision),
     .zero_is_off = true},
    {"max_collisions", "the run ends after this number of impacts; 0: at run.time", .lo = 0,
     .hi = MOST_COLLISIONS, .preset = "0", DECK(max_collisions), .zero_is_off = true},
    {"seed", "seed of every random choice", .type = MILL_KEY_WHOLE, .lo = 0, .hi = SEED_MAX,
     .preset = "1", DECK(seed)},
    {"threads", "threads of the run at most; 0: 1 below 20 000 balls, else one for each core",
     .type = MILL_KEY_WHOLE, .lo = 0, .hi = MOST_THREADS, .preset = "0", DECK(threads),
     .hidden = threads_chosen},
    {.name = NULL},
};

const struct mill_key mill_deck_run_gravity[] = {
    {"acceleration", "acceleration of gravity along x, y and z", .type = MILL_KEY_VECTOR,
     .unit = "m/s^2", ANY, .preset = "0 0 -9.81 m/s^2", DECK(gravity)},
    {.name = NULL},
};

const struct mill_key mill_deck_run_output[] = {
    {"frames", "interval of stored ball states; 0 s: none", .unit = "s", NOT_NEGATIVE,
     .preset = "10 ms", DECK(frames)},
    {"series", "interval of the time series", .unit = "s", POSITIVE, .preset = "1 ms",
     DECK(series)},
    {"impacts", "statistics, or all to log every impact", .type = MILL_KEY_CHOICE,
     .preset = "statistics", DECK(log_impacts), .words = "statistics|all"},
    {"strike_window", "contacts of a pair closer in time than this are one strike", .unit = "s",
     NOT_NEGATIVE, .preset = "10 us", DECK(strike_window)},
    {"checkpoint", "wall-clock interval of checkpoints", .unit = "s", POSITIVE, .preset = "60 s",
     DECK(checkpoint)},
    {.name = NULL},
};

void mill_deck_run_checks(const struct mill_deck *deck, struct mill_deck_check *list)
{
    const struct mill_deck_given *is = &deck->given;
    const struct mill_deck_check all[] = {
        {.wrong = is->sample_from >= is->time, "run", "sample_from",
         "must be before the end of the run, %g s", {is->time}},
        {.wrong = is->max_collisions != floor(is->max_collisions), "run", "max_collisions",
         "must be a whole number, got %.15g", {is->max_collisions}},
        {.wrong = is->time / is->series > MOST_SAMPLES, "output", "series",
         "too short: more than 1e8 samples until %g s", {is->time}},
    };
    memcpy(list, all, sizeof all);
}

void mill_deck_run_frames(const struct mill_deck *deck, struct mill_deck_check *list)
{
    const double frames = mill_deck_run_count(deck);
    *list = (struct mill_deck_check){
        .wrong = frames > MOST_FRAMES, "output", "frames",
        "too short: more than 1e7 frames until %g s (%.3g GB of ball states)",
        {deck->given.time, mill_deck_run_size(deck)}};
}
/* clang-format on */

double mill_deck_run_count(const struct mill_deck *deck)
{
    return deck->given.frames > 0.0 ? deck->given.time / deck->given.frames : 0.0;
}

double mill_deck_run_size(const struct mill_deck *deck)
{
    enum { BALL = 36 /* [B] nine numbers of four bytes */ };
    return 1e-9 * mill_deck_run_count(deck) * (double)deck->mill.all * BALL;
}
