/* A start state as a start file: what mill_start_read makes the same balls of, to the last bit. The
 * order is that of the world's rows, which is all that a random start leaves behind: its balls were
 * numbered by place within each kind, and a start file's are taken as they come. */
#include "app/start_write.h"

#include "store/draft.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

/* A deck's name may hold anything, and the comment is one line. */
static void write_head(FILE *out, const char *deck, bool spins)
{
    fprintf(out, "# x y z [m] vx vy vz [m/s]%s, one ball a line: start of ",
            spins ? " wx wy wz [rad/s]" : "");
    for (const char *p = deck; *p; p++)
        putc((unsigned char)*p < 32 || *p == 127 ? '?' : *p, out);
    putc('\n', out);
}

static bool plain_zero(vec3 a)
{
    return a.x == 0.0 && a.y == 0.0 && a.z == 0.0 && !signbit(a.x) && !signbit(a.y) &&
           !signbit(a.z);
}

/* 0 or an errno. 17 digits bring every double back. */
static int write_rows(const struct mill_world *world, const char *deck, FILE *out)
{
    bool spins = false;
    for (int32_t i = 0; i < world->balls && !spins; i++)
        spins = !plain_zero(world->spin[i]);
    errno = 0;
    write_head(out, deck, spins);
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

/* 0 or an errno: into the open draft, which is not closed. */
static int write_draft(const struct mill_world *world, const char *deck,
                       const struct mill_draft *draft)
{
    const int fd = dup(draft->fd);
    FILE *out = fd < 0 ? NULL : fdopen(fd, "w");
    if (!out) {
        const int why = errno;
        if (fd >= 0)
            close(fd);
        return why;
    }
    const int failed = write_rows(world, deck, out);
    return fclose(out) != 0 && !failed ? errno : failed;
}

enum mill_status mill_start_write(const struct mill_world *world, const char *deck,
                                  const char *path, bool over, struct mill_error *error)
{
    enum mill_status status = MILL_OK;
    struct mill_draft draft;
    mill_draft_init(&draft, path, NULL);
    int failed = mill_draft_open(&draft, over ? MILL_DRAFT_FORCE : MILL_DRAFT_EMPTY);
    if (!failed && !over && access(path, F_OK) == 0)
        status =
            mill_error_set(error, MILL_BAD_DECK, "%s: exists already; --force overwrites it", path);
    if (!failed && status == MILL_OK)
        failed = write_draft(world, deck, &draft);
    if (!failed && status == MILL_OK)
        failed = mill_draft_publish(&draft, true);
    if (failed)
        status = mill_draft_tell(&draft, path, "write", failed, error);
    mill_draft_end(&draft);
    return status;
}
