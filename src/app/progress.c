/* How far is the run, how fast, and how long will it take? On a terminal the line is rewritten in
 * place and cut to its width. In a log file there is a line after 2 s, then after 10 s to 10 min.
 * For programs there is a JSON object per line, at a constant rate. Rates are over the last fifth
 * of the time, or 10 s, because they change while the mill sweeps up its charge. */
#include "app/progress.h"

#include "app/record.h"

#include <assert.h>
#include <string.h>
#include <sys/ioctl.h>

/* number of fields in the line; characters of a field, and between two fields */
enum { FIELDS = 6, FIELD = 64, GAP = 3 };

void mill_progress_init(struct mill_progress_display *display, FILE *out,
                        enum mill_progress_form form)
{
    const double now = mill_record_clock(CLOCK_MONOTONIC);
    *display = (struct mill_progress_display){out, form, .began = now, .due = 2.0, .gap = 10.0};
}

/* [s] wall time until the end; infinite if there is no progress */
static double left(const struct mill_progress *then, const struct mill_progress *now)
{
    const double done = now->time - then->time;
    return done > 0.0 ? (now->end - now->time) * (now->wall - then->wall) / done : HUGE_VAL;
}

/* early: the run becomes slower while the mill sweeps up its charge */
static void format_left(double seconds, bool early, char *out, size_t size)
{
    const int whole = (int)fmax(0.0, fmin(seconds, 1e9));
    const char *least = early ? "at least " : "";
    if (!(seconds < 8.64e6)) /* 100 days; such an estimate would be useless */
        snprintf(out, size, "%smore than 100 d left", least);
    else if (whole >= 86400)
        snprintf(out, size, "%s%d d %d h left", least, whole / 86400, whole % 86400 / 3600);
    else if (whole >= 3600)
        snprintf(out, size, "%s%d h %02d min left", least, whole / 3600, whole % 3600 / 60);
    else if (whole >= 60)
        snprintf(out, size, "%s%d min %02d s left", least, whole / 60, whole % 60);
    else
        snprintf(out, size, "%s%.0f s left", least, ceil(seconds));
}

void mill_progress_format(const struct mill_progress *then, const struct mill_progress *now,
                          int width, char line[MILL_PROGRESS_LINE])
{
    /* the order in which fields are left out when the line is too long */
    static const int given_up[FIELDS] = {3, 2, 0, 4, 5, 1};
    char field[FIELDS][FIELD] = {""}, whole[FIELDS * (FIELD + GAP)];
    const double wall = now->stage ? 0.0 : now->wall - then->wall;
    const double speed = wall > 0.0 ? (now->time - then->time) / wall : 0.0;
    const double share = now->end > 0.0 ? 100.0 * now->time / now->end : 0.0;
    const size_t room = width < MILL_PROGRESS_LINE ? (size_t)width : MILL_PROGRESS_LINE - 1;
    assert(width >= 0);
    if (now->stage)
        snprintf(field[0], FIELD, "%s", now->stage);
    else
        snprintf(field[0], FIELD, "%.4g s of %.4g s", now->time, now->end);
    snprintf(field[1], FIELD, "%.0f %%", now->time < now->end ? fmin(floor(share), 99.0) : 100.0);
    if (wall > 0.0) {
        snprintf(field[2], FIELD, "%.3g contacts/s",
                 (double)(now->collisions - then->collisions) / wall);
        snprintf(field[3], FIELD, "%.3g simulated s per s", speed);
        format_left(left(then, now), now->time < now->early, field[4], FIELD);
    }
    snprintf(field[5], FIELD, "%s", now->known ? now->known : "");
    for (int given = 0; given == 0 || (given < FIELDS && strlen(whole) > room); given++) {
        whole[0] = '\0';
        for (int i = 0; i < FIELDS; i++)
            if (field[i][0])
                strcat(strcat(whole, whole[0] ? "   " : ""), field[i]);
        field[given_up[given]][0] = '\0';
    }
    snprintf(line, room + 1, "%s", whole);
}

/* The words need no escapes. Tasks before and after the run count balls or frames, not time. */
static void show_object(struct mill_progress_display *display, const struct mill_progress *now)
{
    const struct mill_progress *then = &display->then[0];
    const char *state = now->stage ? display->begun ? "writing" : "starting" : now->state;
    const double wall = now->wall - then->wall, unknown = (double)NAN;
    const bool run = !now->stage, rates = run && wall > 0.0;
    const struct {
        const char *name;
        double value; /* null where it is not known */
    } numbers[] = {
        {"time", run ? now->time : unknown},
        {"end", run ? now->end : unknown},
        {"share", now->end > 0.0 ? fmin(now->time / now->end, 1.0) : 0.0},
        {"left", rates && now->time >= now->early ? left(then, now) : unknown},
        {"contacts", run ? (double)now->collisions : unknown},
        {"contacts_per_second",
         rates ? (double)(now->collisions - then->collisions) / wall : unknown},
        {"wall", now->wall},
    };
    if (display->state && !strcmp(state, display->state) && now->wall < display->due)
        return;
    display->state = state;
    display->due = now->wall + MILL_PROGRESS_JSON;
    fprintf(display->out, "{\"state\": \"%s\"", state);
    for (size_t k = 0; k < sizeof numbers / sizeof *numbers; k++)
        fprintf(display->out, isfinite(numbers[k].value) ? ", \"%s\": %.9g" : ", \"%s\": null",
                numbers[k].name, numbers[k].value);
    const char *what = now->stage ? now->stage : now->known ? now->known : "";
    fprintf(display->out, ", \"what\": \"%s\"}\n", what);
}

void mill_progress_show(struct mill_progress_display *display, const struct mill_progress *now)
{
    struct winsize size;
    char line[MILL_PROGRESS_LINE];
    if (now->begins) {
        display->run = now->wall;
        display->then[0] = display->then[1] = *now;
        display->begun = true;
    }
    if (!display->out || (now->begins && display->form != MILL_PROGRESS_OBJECTS))
        return;
    if (display->form == MILL_PROGRESS_OBJECTS) {
        show_object(display, now);
    } else if (display->form == MILL_PROGRESS_TERMINAL) {
        const bool told = ioctl(fileno(display->out), TIOCGWINSZ, &size) == 0 && size.ws_col > 0;
        /* the last column stays empty, because many terminals wrap after it */
        mill_progress_format(&display->then[0], now, (told ? size.ws_col : 80) - 1, line);
        fprintf(display->out, "\r%-*s", display->shown, line);
        display->shown = (int)strlen(line);
    } else if (now->wall >= display->due) {
        mill_progress_format(&display->then[0], now, MILL_PROGRESS_LINE, line);
        fprintf(display->out, "millsim: %s\n", line);
        display->due = now->wall + display->gap;
        display->gap = fmin(2.0 * display->gap, 600.0);
    }
    fflush(display->out);
    if (now->stage ||
        now->wall - display->then[1].wall < fmin(5.0, 0.2 * (now->wall - display->run)))
        return;
    display->then[0] = display->then[1];
    display->then[1] = *now;
}

void mill_progress_stage(void *self, const char *what, int32_t done, int32_t all)
{
    struct mill_progress_display *display = self;
    const double wall = mill_record_clock(CLOCK_MONOTONIC) - display->began;
    if (wall < display->stage + MILL_PROGRESS_EVERY)
        return;
    display->stage = wall;
    mill_progress_show(display, &(struct mill_progress){done, all, .wall = wall, .stage = what});
}

void mill_progress_end(struct mill_progress_display *display)
{
    if (display->shown > 0) {
        fputc('\n', display->out);
        fflush(display->out);
    }
    display->shown = 0;
}
