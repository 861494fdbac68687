/* How far is the run, how fast, and how long will it take? On a terminal the line is rewritten in
 * place and fitted to its width; in a log file a line comes after 2 s and then at growing gaps of
 * 10 s and more, so a week's run does not fill it. Rates are those of the last 5 to 10 s, since a
 * mill slows down as it fills. */
#include "app/progress.h"

#include <math.h>
#include <string.h>
#include <sys/ioctl.h>

static const double window = 5.0; /* [s] wall */

void mill_progress_init(struct mill_progress_display *display, FILE *out, bool terminal)
{
    *display = (struct mill_progress_display){0};
    display->out = out;
    display->terminal = terminal;
    display->due = 2.0;
    display->gap = 10.0;
}

static int terminal_width(FILE *out)
{
    enum { USUAL = 80 };
    struct winsize size;
    if (ioctl(fileno(out), TIOCGWINSZ, &size) != 0 || size.ws_col == 0)
        return USUAL;
    return size.ws_col;
}

static void format_left(double seconds, char *out, size_t size)
{
    if (!(seconds < 8.64e6)) /* 100 days: nobody waits for it, and it is only a guess */
        snprintf(out, size, "more than 100 d left");
    else if (seconds >= 86400.0)
        snprintf(out, size, "%.0f d %.0f h left", floor(seconds / 86400.0),
                 floor(fmod(seconds, 86400.0) / 3600.0));
    else if (seconds >= 3600.0)
        snprintf(out, size, "%.0f h %02.0f min left", floor(seconds / 3600.0),
                 floor(fmod(seconds, 3600.0) / 60.0));
    else if (seconds >= 60.0)
        snprintf(out, size, "%.0f min %02.0f s left", floor(seconds / 60.0),
                 floor(fmod(seconds, 60.0)));
    else
        snprintf(out, size, "%.0f s left", ceil(seconds));
}

void mill_progress_format(const struct mill_progress *then, const struct mill_progress *now,
                          int width, char line[MILL_PROGRESS_LINE])
{
    enum { FIELDS = 6, FIELD = 64 };
    /* the order in which fields are given up when the line is too long */
    static const int given_up[FIELDS - 1] = {3, 2, 0, 4, 5};
    char field[FIELDS][FIELD] = {""};
    const double wall = now->stage ? 0.0 : now->wall - then->wall;
    const double speed = wall > 0.0 ? (now->time - then->time) / wall : 0.0;
    const double share = now->end > 0.0 ? 100.0 * now->time / now->end : 0.0;
    const int room = width < MILL_PROGRESS_LINE - 1 ? width : MILL_PROGRESS_LINE - 1;
    if (now->stage)
        snprintf(field[0], FIELD, "%s", now->stage);
    else
        snprintf(field[0], FIELD, "%.4g s of %.4g s", now->time, now->end);
    snprintf(field[1], FIELD, "%.0f %%", now->time < now->end ? fmin(floor(share), 99.0) : 100.0);
    if (wall > 0.0) {
        snprintf(field[2], FIELD, "%.3g collisions/s",
                 (double)(now->collisions - then->collisions) / wall);
        snprintf(field[3], FIELD, "%.3g s/s", speed);
        format_left(speed > 0.0 ? (now->end - now->time) / speed : HUGE_VAL, field[4], FIELD);
    }
    if (now->known)
        snprintf(field[5], FIELD, "%s", now->known);
    for (int dropped = 0; dropped < FIELDS; dropped++) {
        line[0] = '\0';
        for (int i = 0; i < FIELDS; i++) {
            if (!field[i][0])
                continue;
            strcat(line, line[0] ? "   " : "");
            strcat(line, field[i]);
        }
        if ((int)strlen(line) <= room || dropped == FIELDS - 1)
            break;
        field[given_up[dropped]][0] = '\0';
    }
    if (room >= 0 && (int)strlen(line) > room)
        line[room] = '\0';
}

/* Moves the older states on, so that then[0] stays 5 to 10 s behind. */
static void remember(struct mill_progress_display *display, const struct mill_progress *now)
{
    if (now->wall - display->then[1].wall < window)
        return;
    display->then[0] = display->then[1];
    display->then[1] = *now;
}

void mill_progress_show(void *self, const struct mill_progress *now)
{
    struct mill_progress_display *display = self;
    char line[MILL_PROGRESS_LINE];
    if (now->begins) {
        display->then[0] = display->then[1] = *now;
        return;
    }
    if (display->terminal) {
        /* the last column stays free: many terminals wrap as soon as it is written */
        mill_progress_format(&display->then[0], now, terminal_width(display->out) - 1, line);
        const int length = (int)strlen(line);
        const int blanks = display->shown > length ? display->shown - length : 0;
        fprintf(display->out, "\r%s%*s", line, blanks, "");
        display->shown = length;
        fflush(display->out);
    } else if (now->wall >= display->due) {
        enum { LONGEST_GAP = 600 };
        mill_progress_format(&display->then[0], now, MILL_PROGRESS_LINE, line);
        fprintf(display->out, "millsim: %s\n", line);
        fflush(display->out);
        display->due = now->wall + display->gap;
        display->gap = fmin(2.0 * display->gap, LONGEST_GAP);
    }
    if (!now->stage)
        remember(display, now);
}

void mill_progress_end(struct mill_progress_display *display)
{
    if (display->shown > 0) {
        fputc('\n', display->out);
        fflush(display->out);
    }
    display->shown = 0;
}
