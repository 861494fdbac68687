/* The records of samples. What to find in them is engine/soft_watch.c. */
#include "app/samples.h"

#include <errno.h>
#include <float.h>
#include <string.h>

enum { TIME, KEEP, FRAME, ROWS = 17, ROW = 10 }; /* where they are in a sample */
enum { INTERVAL, SHEAR, SPRINGS = 3 };           /* where they are in springs */
#define SKEW 1e-6                                /* of a frame's directions, at most */

void mill_samples_free(struct mill_samples *s)
{
    mill_soft_free(s->soft);
    free(s->impacts.item);
    free(s->answer);
}

uint64_t mill_samples_length(const struct mill_world *w)
{
    return ROWS + ROW * (uint64_t)w->balls;
}

uint64_t mill_samples_springs_length(const struct mill_world *w)
{
    const uint64_t species = (uint64_t)w->species_count;
    return SPRINGS + 2 * species * species * (uint64_t)w->kinds.count;
}

/* Numbers of the answer; the last nine of each ball are its state */
static size_t answer_length(const struct mill_world *w)
{
    return 2 + (size_t)w->motions + 3 * (size_t)w->kinds.count + 9 * (size_t)w->balls;
}

static enum mill_status out_of_memory(struct mill_error *error)
{
    return mill_error_set(error, MILL_FAILED, "out of memory for the contacts");
}

enum mill_status mill_samples_springs(struct mill_samples *s, struct mill_world *w,
                                      const double *values, struct mill_error *error)
{
    const uint64_t count = mill_samples_springs_length(w);
    bool good = values[SHEAR + 1] == 0.0 || values[SHEAR + 1] == 1.0;
    for (uint64_t i = 0; i < count; i++) { /* 0 is possible for shares and dashpots */
        const bool zero = i == SHEAR || (i > 0 && i % 2 == 0);
        good = good && isfinite(values[i]) && values[i] >= (zero ? 0.0 : DBL_MIN);
    }
    if (!good)
        return mill_error_set(
            error, MILL_FAILED,
            "expected an interval and springs above 0, dashpots of 0 or more, and damped 0 or 1");
    if (!s->soft) {
        s->soft = mill_soft_watch_create(w);
        s->answer = calloc(answer_length(w), sizeof *s->answer);
        s->impacts.size = sizeof(struct mill_replay_impact);
        if (!s->soft || !s->answer)
            return out_of_memory(error);
    }
    mill_soft_watch_springs(s->soft, values[INTERVAL], values + SHEAR,
                            (const double(*)[2])(values + SPRINGS));
    return MILL_OK;
}

/* Adds an impact in the order of time. `known`: the time [s] of the last account, or less; an
 * impact is not before it but for rounding. false: out of memory */
static bool add_impact(struct mill_samples *s, const struct mill_impact *i, double known)
{
    const struct mill_replay_impact one = {
        .time = fmax(i->time, known),
        .normal_speed = i->normal_speed,
        .tangential_speed = i->tangential_speed,
        .dissipation = i->dissipation_normal,
        .position = {i->position.x, i->position.y, i->position.z},
        .normal = {i->normal.x, i->normal.y, i->normal.z},
        .kind = i->kind,
        .ball = i->ball,
        .partner = i->partner};
    if (!mill_memory_add(&s->impacts))
        return false;
    struct mill_replay_impact *all = s->impacts.item;
    size_t at = s->impacts.count - 1;
    for (; at > 0 && all[at - 1].time > one.time; at--)
        all[at] = all[at - 1];
    all[at] = one;
    return true;
}

enum mill_status mill_samples_take(struct mill_samples *s, struct mill_replay *replay,
                                   const double *values, struct mill_error *error)
{
    struct mill_soft_frame frame;
    if (!s->soft)
        return mill_error_set(error, MILL_FAILED, "expected the record 'springs' before");
    for (int i = 0; i < ROWS; i++)
        if (!isfinite(values[i]))
            return mill_error_set(error, MILL_FAILED, "expected numbers");
    memcpy(&frame, values + FRAME, sizeof frame);
    const vec3 skew = vec3_sub(vec3_cross(frame.x, frame.y), frame.z);
    if (!(fabs(vec3_norm(frame.x) - 1.0) + fabs(vec3_norm(frame.y) - 1.0) + vec3_norm(skew) < SKEW))
        return mill_error_set(error, MILL_FAILED,
                              "expected directions x, y, z of the frame with length 1, at right "
                              "angles, z = x cross y");
    enum mill_status status = mill_soft_watch_sample(s->soft, values[TIME], &frame,
                                                     (const double(*)[ROW])(values + ROWS), error);
    const double known = replay->accounts > 0 ? replay->now : -(double)INFINITY;
    s->impacts.count = 0;
    for (int k = 0; k < s->soft->parts && status == MILL_OK; k++) {
        struct mill_memory_list *told = &s->soft->part[k].told;
        const struct mill_sim_entry *entry = told->item;
        for (size_t n = 0; n < told->count && status == MILL_OK; n++)
            status = add_impact(s, &entry[n].impact, known) ? MILL_OK : out_of_memory(error);
        told->count = 0;
    }
    if (status == MILL_OK)
        status = mill_replay_impacts(replay, s->impacts.count, s->impacts.item, error);
    if (status != MILL_OK || values[KEEP] == 0.0)
        return status;
    mill_soft_watch_state(s->soft, s->answer);
    return mill_replay_state(replay, values[TIME], s->answer, error);
}

enum mill_status mill_samples_part(struct mill_samples *s, struct mill_error *error)
{
    if (!s->soft)
        return mill_error_set(error, MILL_FAILED, "expected samples before");
    const double left = mill_soft_watch_part(s->soft);
    return left == 0.0 ? MILL_OK
                       : mill_error_set(error, MILL_FAILED,
                                        "overlaps of %.2g m that cannot be removed", left);
}

enum mill_status mill_samples_answer(struct mill_samples *s, FILE *to, struct mill_error *error)
{
    if (!s->soft)
        return mill_error_set(error, MILL_FAILED, "expected samples before");
    const struct mill_world *w = s->soft->world;
    const struct mill_soft_watch *watch = s->soft->watch;
    double *next = s->answer;
    *next++ = watch->elastic;
    *next++ = watch->deepest;
    for (int k = 0; k < w->motions; k++)
        *next++ = watch->work[k];
    for (int k = 0; k < w->kinds.count; k++) {
        *next++ = watch->normal[k];
        *next++ = watch->rubbed[k];
        *next++ = watch->isolated[k];
    }
    mill_soft_watch_state(s->soft, next);
    const size_t count = answer_length(w);
    if (fwrite(s->answer, sizeof *s->answer, count, to) != count || fflush(to) != 0)
        return mill_error_set(error, MILL_FAILED, "standard output: cannot write: %s",
                              strerror(errno));
    return MILL_OK;
}
