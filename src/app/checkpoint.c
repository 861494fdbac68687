/* A state can be read only by the build that wrote it: its structs are stored as they are, as words
 * of 8 bytes. A hash of sources, flags and compiler identifies the build. */
#include "app/starts.h"
#include "store/version.h"

#define PATH "/checkpoint"

/* Carries fields to the file, or from it */
struct carrier {
    struct mill_state state; /* first */
    struct mill_h5 *file;
    int start;      /* its number, from 0 */
    char owner[40]; /* of the fields */
};

static void carry(struct mill_state *s, const char *name, enum mill_field type, size_t n, void *at)
{
    static const enum mill_h5_type type_of[] = {[MILL_FIELD_F64] = MILL_H5_F64,
                                                [MILL_FIELD_I32] = MILL_H5_I32,
                                                [MILL_FIELD_WORD] = MILL_H5_U64};
    struct carrier *carrier = (struct carrier *)s;
    char path[128];
    snprintf(path, sizeof path, PATH "/%s/%s", carrier->owner, name);
    if (s->loads)
        s->status = mill_h5_read(carrier->file, path, type_of[type], n, at, s->error);
    else
        mill_h5_write_checked(carrier->file, path, type_of[type], n, at,
                              "part of the state of an unfinished run");
}

static void set_owner(struct mill_state *state, const char *name)
{
    struct carrier *carrier = (struct carrier *)state;
    if (carrier->start > 0)
        snprintf(carrier->owner, sizeof carrier->owner, "start_%d_%s", carrier->start + 1, name);
    else
        snprintf(carrier->owner, sizeof carrier->owner, "%s", name);
}

static enum mill_status carry_all(struct mill_starts *starts, struct mill_record_cost *cost,
                                  struct mill_h5 *file, bool loads, struct mill_error *error)
{
    struct carrier carrier = {{carry, loads, MILL_OK, error}, file, 0, "run"};
    struct mill_state *state = &carrier.state;
    mill_state_structs(state, "cost", sizeof *cost, 1, cost);
    struct mill_starts_plan *plan = &starts->plan;
    mill_state_structs(state, "plan", sizeof *plan, 1, plan);
    if (state->loads &&
        !(plan->count > 0 && plan->count <= MILL_PRECISION_STARTS && plan->until >= 0))
        mill_state_refuse(state, "the saved plan is damaged");
    if (state->loads && state->status == MILL_OK)
        state->status = mill_starts_grow(starts, state->error);
    for (; carrier.start < starts->count && state->status == MILL_OK; carrier.start++) {
        const struct mill_starts_one *one = &starts->one[carrier.start];
        set_owner(state, "loop");
        mill_sim_state(one->sim, state);
        mill_observers_state(&one->observers, state, set_owner);
    }
    return state->status;
}

void mill_checkpoint_write(struct mill_starts *starts, struct mill_record_cost *cost,
                           struct mill_h5 *file)
{
    mill_checkpoint_remove(file);
    mill_h5_write_text(file, PATH "/build", mill_version_build,
                       "sources, flags and compiler of the program that wrote this state: what "
                       "millsim --resume goes on from");
    carry_all(starts, cost, file, false, NULL);
}

void mill_checkpoint_remove(struct mill_h5 *file)
{
    mill_h5_remove(file, PATH);
}

enum mill_status mill_checkpoint_find(struct mill_h5 *file, const char *name, bool *found,
                                      struct mill_error *error)
{
    char *build = NULL;
    *found = mill_h5_exists(file, PATH);
    if (!*found)
        return mill_h5_status(file, error);
    enum mill_status status = mill_h5_read_text(file, PATH "/build", &build, NULL);
    if (status != MILL_OK)
        mill_error_set(
            error, status,
            "%s: its checkpoint was not written by this program; start again with --force", name);
    else if (strcmp(build, mill_version_build) != 0)
        status = mill_error_set(error, MILL_FAILED,
                                "%s: its checkpoint was written by another build of millsim "
                                "(%.16s, and this is %s); resume it with that one, or start again "
                                "with --force",
                                name, build, mill_version_build);
    free(build);
    return status;
}

enum mill_status mill_checkpoint_load(struct mill_starts *starts, struct mill_record_cost *cost,
                                      struct mill_h5 *file, const char *name,
                                      struct mill_error *error)
{
    struct mill_error why = {""};
    const enum mill_status status = carry_all(starts, cost, file, true, &why);
    const bool placed = strstr(why.text, PATH) != NULL; /* the text names file and dataset */
    if (status == MILL_OK)
        return MILL_OK;
    return mill_error_set(error, status, "%s%s%s; start again with --force", placed ? "" : name,
                          placed ? "" : ": its checkpoint: ", why.text);
}
