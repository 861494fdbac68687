/* A start state as a start file: what mill_deck_start_read makes the same balls of, to the last
 * bit. The order is that of the world's rows, which is all that a random start leaves behind: its
 * balls were numbered by place within each kind, and a start file's are taken as they come. */
#include "app/record.h"
#include "store/draft.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

/* 0 or an errno. 17 digits bring every double back. */
static int write_rows(const struct mill_world *world, const char *deck, FILE *out)
{
    bool spins = false;
    for (int32_t i = 0; i < world->balls && !spins; i++) {
        const vec3 w = world->spin[i];
        spins =
            w.x != 0.0 || w.y != 0.0 || w.z != 0.0 || signbit(w.x) || signbit(w.y) || signbit(w.z);
    }
    errno = 0;
    fprintf(out, "# x y z [m] vx vy vz [m/s]%s, one ball a line: start of ",
            spins ? " wx wy wz [rad/s]" : "");
    for (const char *p = deck; *p; p++) /* its name may hold anything, and this is one line */
        putc((unsigned char)*p < 32 || *p == 127 ? '?' : *p, out);
    putc('\n', out);
    for (int32_t i = 0; i < world->balls && !ferror(out); i++) {
        const vec3 r = world->ball[i].r, v = world->ball[i].v, w = world->spin[i];
        fprintf(out, "%.17g %.17g %.17g %.17g %.17g %.17g", r.x, r.y, r.z, v.x, v.y, v.z);
        if (spins)
            fprintf(out, " %.17g %.17g %.17g", w.x, w.y, w.z);
        putc('\n', out);
    }
    if (fflush(out) == 0 && !ferror(out))
        return 0;
    return errno ? errno : EIO;
}

/* 0 or an errno: into the open draft, which is published. */
static int write_draft(const struct mill_world *world, const char *deck, struct mill_draft *draft)
{
    const int fd = dup(mill_draft_descriptor(draft));
    FILE *out = fd < 0 ? NULL : fdopen(fd, "w");
    int failed = out ? write_rows(world, deck, out) : errno;
    if (out && fclose(out) != 0 && !failed)
        failed = errno;
    if (!out && fd >= 0)
        close(fd);
    return failed ? failed : mill_draft_publish(draft, true);
}

enum mill_status mill_record_export(const struct mill_world *world, const char *deck,
                                    const char *path, bool over, struct mill_error *error)
{
    struct mill_draft *draft = mill_draft_create(path, NULL);
    if (!draft)
        return mill_error_set(error, MILL_FAILED, "%s: out of memory", path);
    enum mill_status status = MILL_OK;
    int failed = mill_draft_open(draft, over ? MILL_DRAFT_FORCE : MILL_DRAFT_EMPTY);
    if (!failed && !over && access(path, F_OK) == 0)
        status =
            mill_error_set(error, MILL_BAD_DECK, "%s: exists already; --force overwrites it", path);
    else if (!failed)
        failed = write_draft(world, deck, draft);
    if (failed)
        status = mill_draft_tell(draft, path, "write", failed, error);
    mill_draft_free(draft);
    return status;
}
