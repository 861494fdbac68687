/* The contours of drum and bodies: corners from the keys of a profile or from a file. */
#include "base/elementary.h"
#include "deck/deck_private.h"
#include "geometry/contour.h"
#include "millsim/lining.h"

#define MOST_PLACE 1e4 /* [m] */

static const char *const form_key[] = {"radius", "buckle_height", "lifters", "repeats", "file"};

/* Tells what is wrong with a contour. */
static bool check(const struct mill_deck *deck, const char *section, const char *key,
                  const struct mill_corner *corner, size_t n)
{
    size_t at[2];
    const struct mill_deck_text *text = &deck->text;
    if (n < 2)
        return mill_deck_wrong(text, section, key, "a contour needs two corners or more");
    for (size_t k = 0; k < n; k++) {
        const struct mill_corner *a = &corner[k], *b = &corner[(k + 1) % n];
        if (!(fabs(a->x) <= MOST_PLACE && fabs(a->y) <= MOST_PLACE &&
              fabs(a->bulge) < MILL_LINING_BULGE))
            return mill_deck_wrong(text, section, key,
                                   "corner %zu of the contour, %g %g %g: expected x and y up to %g "
                                   "m, and a bulge below %g",
                                   k + 1, a->x, a->y, a->bulge, MOST_PLACE, MILL_LINING_BULGE);
        if (!mill_solid_is_length(hypot(b->x - a->x, b->y - a->y), false))
            return mill_deck_wrong(text, section, key,
                                   "corners %zu and %zu of the contour are nearer to each other "
                                   "than %g m: leave one of them out",
                                   k + 1, (k + 1) % n + 1, MILL_SOLID_LEAST);
    }
    if (mill_lining_crosses(corner, n, at))
        return mill_deck_wrong(text, section, key,
                               "the contour crosses or touches itself: its sides after the corners "
                               "(%.4g, %.4g) and (%.4g, %.4g) m",
                               corner[at[0]].x, corner[at[0]].y, corner[at[1]].x, corner[at[1]].y);
    if (mill_lining_area(corner, n) < 0.0)
        return mill_deck_wrong(text, section, key,
                               "the contour is clockwise: list its corners in the other order, "
                               "each with the negative bulge of the one before it");
    return true;
}

bool mill_deck_lining_read(struct mill_deck *deck, const char *section, const char **file,
                           struct mill_body *is)
{
    if (!mill_deck_files_find(&deck->text, section, "file", file))
        return false;
    struct mill_deck_rows rows = {&deck->text,
                                  section,
                                  "file",
                                  *file,
                                  "3 numbers 'x y bulge' in SI units, as 'mill contour' writes",
                                  1u << 3,
                                  .most = MILL_LINING_CORNERS};
    const bool good = mill_deck_files_read(&rows);
    is->corners = rows.row.count;
    is->corner = rows.row.item;
    return good && check(deck, section, "file", is->corner, is->corners);
}

/* [m] The smallest radius with which a contour curves around balls; *at: where this arc begins */
static double find_least(const struct mill_corner *corner, size_t n, size_t *at)
{
    double least = INFINITY;
    for (size_t k = 0; k < n; k++) {
        const struct mill_corner *a = &corner[k], *b = &corner[(k + 1) % n];
        const double radius =
            0.25 * hypot(b->x - a->x, b->y - a->y) * (1.0 + a->bulge * a->bulge) / a->bulge;
        if (a->bulge > 0.0 && radius < least) {
            least = radius;
            *at = k;
        }
    }
    return least;
}

void mill_deck_lining_warn(const struct mill_deck *deck)
{
    const struct mill_lining *is = &deck->given.lining;
    const struct mill_setup_drum *drum = &deck->setup.drum;
    const double widest = deck->mill.widest;
    double apart = INFINITY;
    size_t at = 0;
    if (drum->corners == 0)
        return;
    if (is->form == MILL_LINING_LIFTERS && is->count > 1) {
        const double half = mill_elementary_heading(MILL_PI / (double)is->count).sin;
        apart = 2.0 * half * (is->radius - fmax(is->height, is->second)) - is->width;
    } else if (is->form == MILL_LINING_WAVY) {
        const struct mill_profile p =
            mill_lining_profile((int)is->count, is->radius, is->height, 0.0);
        if (p.half_outer > 0.5 * MILL_PI && widest < 2.0 * p.arc)
            apart = 2.0 * (p.inner * mill_elementary_heading(MILL_PI / p.buckles).sin - p.arc);
    }
    if (widest > apart)
        mill_deck_faults_warn(deck, "drum", form_key[is->form],
                              "the openings of its wall are only %.3g mm wide, less than a ball's "
                              "diameter of %.3g mm: balls that start there stay there, others do "
                              "not come in",
                              1e3 * apart, 1e3 * widest);
    const double least = find_least(drum->corner, drum->corners, &at);
    if (is->form != MILL_LINING_WAVY && 2.0 * least < widest)
        mill_deck_faults_warn(deck, "drum", form_key[is->form],
                              "no ball of %.3g mm fits into the arc of radius %.3g mm that begins "
                              "at y %.4g mm, z %.4g mm: it touches what is beside it",
                              1e3 * widest, 1e3 * least, 1e3 * drum->corner[at].x,
                              1e3 * drum->corner[at].y);
}

double mill_deck_lining_highest(int buckles, double radius)
{
    enum { HALVINGS = 60 }; /* of an interval, down to about the last bit of a double */
    double sound = 0.0, unsound = radius;
    for (int i = 0; i < HALVINGS; i++) {
        const double h = sound + 0.5 * (unsound - sound);
        const bool good = mill_lining_profile(buckles, radius, h, 0.0).sound;
        sound = good ? h : sound;
        unsound = good ? unsound : h;
    }
    return sound;
}

/* Tells which numbers of a profile give no contour. The message about buckles names their height,
 * because users more often need a certain number of them. */
static bool check_form(const struct mill_deck *deck)
{
    const struct mill_deck_text *text = &deck->text;
    const struct mill_lining *is = &deck->given.lining;
    const double highest = is->form == MILL_LINING_WAVY
                               ? mill_deck_lining_highest((int)is->count, is->radius)
                               : (double)INFINITY;
    if (is->height > highest)
        return mill_deck_wrong(text, "drum", "buckle_height",
                               "%ld buckles on a radius of %g m must be lower than %.4g m, or "
                               "neighbouring ones run into each other; got %g m",
                               is->count, is->radius, highest, is->height);
    if (is->form == MILL_LINING_LIFTERS && is->second != is->height && is->count % 2 != 0)
        return mill_deck_wrong(text, "drum", "lifter_second_height",
                               "needs an even number of lifters, got %ld: give another number, or "
                               "leave it out",
                               is->count);
    return mill_lining_most(is) <= MILL_LINING_CORNERS ||
           mill_deck_wrong(text, "drum", form_key[is->form],
                           "the line needs more than %d corners: give fewer waves",
                           MILL_LINING_CORNERS);
}

/* The contour of a profile */
static bool draw(const struct mill_deck *deck, struct mill_body *drum)
{
    const struct mill_lining *is = &deck->given.lining;
    size_t at;
    if (!check_form(deck))
        return false;
    struct mill_corner *corner =
        mill_deck_keep(&deck->text, calloc(mill_lining_most(is), sizeof *corner));
    if (!corner)
        return false;
    drum->corner = corner;
    drum->corners = mill_lining_corners(is, corner);
    if (drum->corners == 0)
        return mill_deck_wrong(&deck->text, "drum", "lifters",
                               "%ld lifters of these sizes touch each other, are higher than the "
                               "drum, or are smaller than the rounding of their edges: change "
                               "number, height, width, angles of the faces or rounding",
                               is->count);
    if (!check(deck, "drum", form_key[is->form], corner, drum->corners))
        return false;
    const double least = find_least(corner, drum->corners, &at);
    if (least < deck->given.tool)
        mill_deck_wrong(&deck->text, "drum", "tool_radius",
                        "the line curves around the balls with a radius of %.4g m: make its waves "
                        "lower or fewer",
                        least);
    return true;
}

/* Is the axis within the line? The chords that cross a ray from there, and the arcs between whose
 * chord and bow it is. A chord through it passes below it, or to its left. */
static bool is_around(const struct mill_corner *corner, size_t n)
{
    int turns = 0;
    for (size_t k = 0; k < n; k++) {
        const struct mill_corner *a = &corner[k], *b = &corner[(k + 1) % n];
        const double dx = b->x - a->x, dy = b->y - a->y, on = dx != 0.0 ? dx : -dy;
        const double cross = a->x * b->y - a->y * b->x, side = cross != 0.0 ? cross : on;
        turns += a->y <= 0.0 && b->y > 0.0 && side > 0.0;
        turns -= a->y > 0.0 && b->y <= 0.0 && side < 0.0;
        /* of its circle, from the middle of the arc: normal . q - bend q^2, times chord and turn */
        const double u = a->bulge, x = 0.5 * (a->x + b->x + u * dy),
                     y = 0.5 * (a->y + b->y - u * dx);
        const double in = (dy * x - dx * y) * (1.0 + u * u) - 2.0 * u * (x * x + y * y);
        if (side * u < 0.0 && in * u > 0.0)
            turns += u > 0.0 ? 1 : -1;
    }
    return turns > 0;
}

/* A drawing in another unit does not have the drum's radius; a worn one may have lost it. */
static void check_radius(const struct mill_deck *deck, const struct mill_body *drum)
{
    double low, high;
    mill_contour_reach(drum, &low, &high);
    if (!is_around(drum->corner, drum->corners))
        mill_deck_wrong(&deck->text, "drum", "file",
                        "the contour does not go around the axis of the drum, which is its origin: "
                        "move it");
    else if (!(drum->radius >= 0.5 * low && drum->radius <= 2.0 * high))
        mill_deck_wrong(&deck->text, "drum", "radius",
                        "%g m is far from the contour, whose points are from %.4g to %.4g m away "
                        "from the axis: correct it, or the unit of the file",
                        drum->radius, low, high);
    else if (!(drum->radius >= 0.95 * low && drum->radius <= 1.05 * high))
        mill_deck_faults_warn(deck, "drum", "radius",
                              "%g m is not the one of the contour, whose points are from %.4g to "
                              "%.4g m away from the axis: speeds in %% critical are of this radius",
                              drum->radius, low, high);
}

void mill_deck_lining_make(struct mill_deck *deck)
{
    struct mill_lining *is = &deck->given.lining;
    struct mill_setup_drum *drum = &deck->setup.drum;
    const bool file = is->form == MILL_LINING_FILE;
    struct mill_body body = {.corners = 0};
    is->radius = drum->radius;
    is->second = is->second > 0.0 ? is->second : is->height; /* NAN: all are equal */
    if (!deck->mill.drum || is->form == MILL_LINING_CIRCLE ||
        (is->form == MILL_LINING_WAVY && is->height == 0.0))
        return;
    if (!(file ? mill_deck_lining_read(deck, "drum", &deck->given.contour, &body)
               : draw(deck, &body)))
        return;
    drum->corners = body.corners;
    drum->corner = body.corner;
    body = mill_setup_drum_body(drum);
    if (file)
        check_radius(deck, &body);
}

static void print(const char *section, const struct mill_corner *corner, size_t n, FILE *out)
{
    if (n > 0)
        fprintf(out, "# [%s]\n", section);
    for (size_t k = 0; k < n; k++)
        fprintf(out, "%.17g %.17g %.17g\n", corner[k].x, corner[k].y, corner[k].bulge);
}

void mill_deck_lining_print(const struct mill_deck *deck, FILE *out)
{
    print("drum", deck->setup.drum.corner, deck->setup.drum.corners, out);
    for (int k = 0; k < deck->setup.surfaces; k++) {
        const struct mill_setup_surface *s = &deck->setup.surface[k];
        if (s->number <= 0)
            print(mill_deck_section_of(deck, k), s->body->corner, s->body->corners, out);
    }
}
