#include "web/web.h"

#include "deck/deck.h"
#include "deck/textfile.h"
#include "millsim/sim.h"
#include "observe/notes.h"
#include "observe/observers.h"
#include "observe/outline.h"
#include "observe/sink_json.h"
#include "observe/tally.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#ifdef __wasm__
#define DOOR(name) __attribute__((export_name(#name)))
#else /* for tests */
#define DOOR(name)
#endif

enum { MOST_SET = 64, LONGEST_SET = 1 << 16, HEAD = 9, POSE = 12 };
static const char deck_file[] = "/deck.ini";

struct mill {
    struct mill_deck *deck;
    struct mill_world *world;
    struct mill_sim *sim;
    struct mill_observer *tally;
    char *set;  /* /set: the deck points into it */
    bool known; /* as well as run.precision asks, when results were last told */
};
static struct mill now; /* the present one */

/* What the last call returned */
static char *text;
static size_t length;
static FILE *out;
static double *number;
static struct {
    struct mill_web_outline shape;
    float *point;
    uint32_t *corner;
    struct mill_outline from;
} drawn;
static float *ball;

/* ---- texts ---- */

static void begin_text(void)
{
    free(text);
    text = NULL;
    length = 0;
    out = open_memstream(&text, &length);
}

static void say(const char *line)
{
    if (out)
        fprintf(out, "%s\n", line);
}

/* Ends the text; a fault without memory for its text has none */
static enum mill_status end_text(enum mill_status status)
{
    if (out)
        fclose(out);
    out = NULL;
    return text ? status : MILL_FAILED;
}

DOOR(mill_web_text) const char *mill_web_text(void)
{
    return text ? text : "out of memory";
}

/* ---- the mill ---- */

static void end_mill(const struct mill *mill)
{
    if (mill->tally)
        mill_observers_free_one(mill->tally);
    mill_sim_free(mill->sim);
    mill_world_free(mill->world);
    mill_deck_free(mill->deck);
    free(mill->set);
}

static FILE *warnings;

/* Keeps warnings until the deck is read, a line each */
static void warn(const char *line)
{
    if (warnings)
        fprintf(warnings, "%s\n", line);
}

/* Splits the lines of /set in place; returns their number */
static int split(char *lines, const char **line)
{
    int count = 0;
    for (char *end; *lines && count < MOST_SET; lines = end) {
        end = lines + strcspn(lines, "\n");
        end += *end ? (*end = '\0', 1) : 0;
        if (*lines)
            line[count++] = lines;
    }
    return count;
}

static enum mill_status build(struct mill_error *error)
{
    const char *wrong, *line[MOST_SET];
    size_t size = 0;
    char *set = now.set = mill_textfile_read("/set", LONGEST_SET, &size, &wrong);
    if (set)
        set[size] = '\0';
    enum mill_status status = mill_deck_read(deck_file, set ? split(set, line) : 0, line, warn, say,
                                             NULL, &now.deck, error);
    if (status == MILL_OK)
        status = mill_deck_setup_world(now.deck, NULL, &now.world, error);
    if (status == MILL_OK)
        status = mill_sim_create(now.world, &now.sim, error);
    if (status != MILL_OK)
        return status;
    now.deck->observe.starts = 1; /* a page shows one mill */
    now.tally = mill_observers_one(&mill_tally_type, &now.deck->observe, now.world, error);
    return now.tally ? mill_sim_observe(now.sim, now.tally) : MILL_FAILED;
}

/* Builds the mill of the deck and tells of it; a fault leaves the present mill */
DOOR(mill_web_load) enum mill_status mill_web_load(void)
{
    const struct mill before = now;
    struct mill_error error = {""};
    char *warned = NULL;
    size_t size;
    memset(&now, 0, sizeof now);
    begin_text();
    if (!out)
        return MILL_FAILED;
    warnings = open_memstream(&warned, &size);
    const enum mill_status status = build(&error);
    if (warnings)
        fclose(warnings);
    if (status == MILL_OK)
        mill_web_tell(out, now.deck, now.world, warned ? warned : "");
    else
        say(error.text);
    end_mill(status == MILL_OK ? &before : &now);
    now = status == MILL_OK ? now : before;
    free(warned);
    return end_text(status);
}

/* ---- the run ---- */

DOOR(mill_web_run) enum mill_status mill_web_run(double until, double events)
{
    struct mill_error error = {""};
    const double end = fmin(until, now.deck->observe.end);
    const enum mill_status status =
        now.known ? MILL_OK : mill_sim_run(now.sim, end, (uint64_t)events, NULL, &error);
    begin_text();
    say(error.text);
    end_text(status);
    const bool there = now.known || mill_sim_time(now.sim) >= now.deck->observe.end;
    const bool over = status == MILL_OK && there;
    return over ? MILL_ENDED : status;
}

DOOR(mill_web_time) double mill_web_time(void)
{
    return mill_sim_time(now.sim);
}

/* Room for so many numbers; NULL: out of memory */
static double *room(size_t count)
{
    double *more = realloc(number, count * sizeof *more);
    number = more ? more : number;
    return more;
}

DOOR(mill_web_state) const double *mill_web_state(void)
{
    const struct mill_world *w = now.world;
    const double t = mill_sim_local_time(now.sim);
    const struct mill_energy energy = mill_world_energy(w, t);
    const struct mill_listed kinds = mill_kinds_listed(w);
    double *to = room(HEAD + 2 * (size_t)kinds.count + (1 + POSE) * (size_t)w->motions);
    double error, turnover, impacts = 0;
    if (!to)
        return NULL;
    for (int k = 0; k < w->kinds.count; k++)
        impacts += (double)w->account.collisions[k];
    mill_world_balance(w, t, &error, &turnover);
    const double time = mill_sim_time(now.sim), work = w->account.work;
    const double start = w->start.kinetic + w->start.rotational + w->start.potential;
    const double head[HEAD] = {time,  impacts, energy.kinetic, energy.rotational, energy.potential,
                               start, work,    error,          turnover};
    memcpy(to, head, sizeof head);
    to += HEAD;
    for (int k = 0; k < kinds.count; k++)
        *to++ = w->account.dissipation[kinds.kind[k]];
    for (int k = 0; k < kinds.count; k++)
        *to++ = (double)w->account.collisions[kinds.kind[k]];
    for (int k = 0; k < w->motions; k++)
        *to++ = w->account.motion[k].work;
    for (int k = 0; k < w->motions; k++, to += POSE) {
        const struct mill_pose pose = mill_motion_pose(w->motion[k], t);
        mill_outline_rows(&pose, to);
    }
    return number;
}

DOOR(mill_web_balls) const float *mill_web_balls(void)
{
    const struct mill_world *w = now.world;
    const double t = mill_sim_local_time(now.sim);
    float *more = realloc(ball, 4 * (size_t)w->balls * sizeof *more);
    if (!more)
        return NULL;
    ball = more;
    const struct mill_pose frame = mill_world_steady_frame(w, t);
    for (int32_t i = 0; i < w->balls; i++) {
        const vec3 r = mill_world_position(w, i, t);
        const vec3 v = vec3_sub(mill_world_velocity(w, i, t), mill_pose_velocity(&frame, r));
        const float state[4] = {(float)r.x, (float)r.y, (float)r.z, (float)sqrt(vec3_dot(v, v))};
        memcpy(ball + 4 * (size_t)i, state, sizeof state);
    }
    return ball;
}

/* ---- results ---- */

/* Adds up the pairs of each kind of contact. false: out of memory */
static bool add_spectrum(const struct mill_energies *e, const struct mill_energies_pair *pairs)
{
    const struct mill_listed kinds = mill_kinds_listed(now.world);
    double *to = room(2 * (size_t)kinds.count * MILL_ENERGIES_BINS);
    if (!to)
        return false;
    memset(to, 0, 2 * (size_t)kinds.count * MILL_ENERGIES_BINS * sizeof *to);
    for (int k = 0; k < kinds.count; k++, to += 2 * MILL_ENERGIES_BINS) {
        const int kind = kinds.kind[k];
        const size_t classes = e->classes, all = kind > 0 ? classes : classes * (classes + 1) / 2;
        const struct mill_energies_pair *pair = pairs + e->first[kind];
        for (const struct mill_energies_pair *end = pair + all; pair < end; pair++)
            for (int i = 0; i < MILL_ENERGIES_BINS; i++) {
                to[i] += (double)pair->normal[i].count;
                to[MILL_ENERGIES_BINS + i] += pair->normal[i].dissipation;
            }
    }
    return true;
}

DOOR(mill_web_results) enum mill_status mill_web_results(void)
{
    const double t = mill_sim_local_time(now.sim);
    const struct mill_tally *tally = (const struct mill_tally *)now.tally;
    struct mill_tally_results *results;
    struct mill_sink_json json;
    struct mill_error error;
    begin_text();
    enum mill_status status =
        out ? mill_tally_results_make(tally, now.world, t, &results, &error) : MILL_FAILED;
    if (status != MILL_OK)
        return end_text(status);
    now.known = results->reached;
    mill_sink_json_begin(&json, out);
    mill_tell_number(&json.sink, "sample_from", results->begin, "s", "");
    mill_tell_count(&json.sink, "settled", results->at.settled, "");
    mill_tally_results_tell(results, &json.sink);
    struct mill_notes notes;
    mill_notes_take(&notes, now.world, results, t, false, false);
    mill_notes_write(&notes, &json.sink);
    mill_sink_json_end(&json);
    if (json.sink.failed || !add_spectrum(&tally->plan.energies, results->sums.pair))
        status = MILL_FAILED;
    mill_tally_results_free(results);
    return end_text(status);
}

DOOR(mill_web_spectrum) const double *mill_web_spectrum(void)
{
    return number;
}

DOOR(mill_web_edges) const double *mill_web_edges(void)
{
    double *to = room(MILL_ENERGIES_BINS + 1);
    for (int i = 0; to && i <= MILL_ENERGIES_BINS; i++)
        to[i] = mill_energies_edge(i);
    return to;
}

/* ---- the shape ---- */

DOOR(mill_web_outline) const struct mill_web_outline *mill_web_outline(int k)
{
    const struct mill_mesh *mesh = &drawn.from.mesh;
    mill_outline_free(&drawn.from);
    if (!mill_outline_make(now.world, k < 0 ? NULL : now.world->motion[k], &drawn.from))
        return NULL;
    float *point = realloc(drawn.point, (3 * mesh->points + 1) * sizeof *point);
    drawn.point = point ? point : drawn.point;
    uint32_t *corner = realloc(drawn.corner, (3 * mesh->triangles + 1) * sizeof *corner);
    drawn.corner = corner ? corner : drawn.corner;
    if (!point || !corner)
        return NULL;
    for (size_t i = 0; i < mesh->points; i++) {
        point[3 * i] = (float)mesh->point[i].x;
        point[3 * i + 1] = (float)mesh->point[i].y;
        point[3 * i + 2] = (float)mesh->point[i].z;
    }
    for (size_t i = 0; i < 3 * mesh->triangles; i++)
        corner[i] = (uint32_t)mesh->corner[i / 3][i % 3];
    drawn.shape = (struct mill_web_outline){(uint32_t)mesh->points, (uint32_t)mesh->triangles,
                                            point, corner, drawn.from.kind};
    return &drawn.shape;
}
