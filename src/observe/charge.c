/* The charge seen along the axis of a tumbling mill. Toe and shoulder are where the layer at the
 * wall is half as full as at its fullest place. The centre of circulation is where the stream
 * function is largest: the flow around the axis, summed from the wall inwards, despite noise. */
#include "observe/charge.h"

#include "base/elementary.h"
#include "geometry/body.h"

enum { ANGLES = MILL_CHARGE_ANGLES, SECTORS = MILL_CHARGE_SECTORS, RINGS = MILL_CHARGE_RINGS };
/* Bins to each side: an edge is smoothed over 10 degrees, the fullest place is 30 degrees wide */
enum { FINE = 2, BROAD = 7 };

const char *const mill_charge_words[MILL_CHARGE_NUMBERS][3] = {
    {"toe", "rad", "angle of the toe, from the lowest place to the side where the wall rises"},
    {"shoulder", "rad", "the same of the shoulder"},
    {"repose", "rad", "dynamic angle of repose: the same of the centre of mass"},
    {"in_flight", "1", "share of balls in flights longer than the fall by a diameter"},
    {"mass_across", "m", "centre of mass, from the axis to the side where the wall rises"},
    {"mass_up", "m", "the same upwards"},
    {"circulation_across", "m", "centre of circulation, as mass_across"},
    {"circulation_up", "m", "the same upwards"},
    {"above_toe", "1",
     "share, of what is lost along the normal on the liner, above the toe up to the highest "
     "place"}};

#define HIT(member) MILL_H5_F64, offsetof(struct mill_charge_hits, member), 0, 0
static const struct mill_sum hit_of[] = {
    {"count", "1", "impacts on the liner", HIT(count)},
    {"normal", "J", "lost in them along the normal", HIT(normal)},
    {"sliding", "J", "lost in them in the surface", HIT(sliding)},
    {"outward", "N s", "impulse on the liner, from the axis", HIT(outward)},
    {"forward", "N s", "impulse on the liner, with the turning", HIT(forward)},
    {"lifter_outward", "N s", "part of outward on lifters", HIT(lifter_outward)},
    {"lifter_forward", "N s", "part of forward on lifters", HIT(lifter_forward)}};
const struct mill_sums_list mill_charge_hits = {"hits", sizeof(struct mill_charge_hits), 7, hit_of};

static const struct mill_sum all_of = {
    "", "", "", MILL_H5_F64, 0, sizeof(struct mill_charge_sum) / 8, 8};
static const struct mill_sums_list list = {"charge", sizeof(struct mill_charge_sum), 1, &all_of};

bool mill_charge_init(struct mill_charge *c, const struct mill_world *world, double interval)
{
    const struct mill_container *in = &world->container;
    const struct mill_motion *m = in->motion;
    const struct mill_pose frame = mill_world_frame(world, 0);
    const vec3 w = mill_motion_pose(m, 0).angular_velocity;
    const double g = vec3_norm(world->g), speed = vec3_norm(w), radius = world->drum_radius;
    double largest = 0, heaviest = 0, reach = radius, plate = radius;
    /* only a constant turn about its own, horizontal axis */
    if (!(g > 0 && speed > 0) || m->on || mill_motion_bounds(m, in->frame.place).spin_up > 0 ||
        vec3_norm(vec3_cross(w, frame.x)) > 1e-9 * speed ||
        vec3_norm(frame.velocity) > 1e-9 * speed * radius ||
        fabs(vec3_dot(world->g, frame.x)) > 1e-6 * g)
        return true;
    for (int k = 0; k < world->species_count; k++) {
        largest = fmax(largest, 2 * world->species[k].radius);
        heaviest = fmax(heaviest, world->species[k].mass);
    }
    for (int k = 0; k < world->shapes; k++) {
        const struct mill_shape *shape = world->shape[k];
        const bool end = mill_body_is(shape)->inside && shape->wall > 0;
        const double gap = mill_shape_gap(shape, in->frame.place, 0, &mill_pose_still);
        if (shape->motion == m && !end && gap > 0.5 * radius) /* a lifter, not a shaft */
            reach = fmin(reach, gap);
        if (shape->wall == 0)
            plate = mill_body_is(shape)->radius; /* of the new liner: a worn one has grooves */
    }
    plate = plate > reach && plate < radius ? plate : radius;
    *c = (struct mill_charge){.world = world,
                              .interval = interval,
                              .every = (uint64_t)fmax(1, 2 * MILL_PI / (speed * ANGLES * interval)),
                              .centre = frame.place,
                              .down = vec3_scale(world->g, 1 / g),
                              .inner = reach - largest,
                              .tip = plate - fmax(0.05 * (plate - reach), 1e-6 * plate),
                              .unit = heaviest * 1e-4,
                              .met = calloc((size_t)world->balls + 1, sizeof *c->met)};
    c->rising = vec3_scale(vec3_cross(w, c->down), 1 / speed);
    const bool good = mill_sums_make(&c->blocks, &list, MILL_ENERGIES_BLOCKS) && c->met;
    c->block = c->blocks.record;
    return good;
}

void mill_charge_sample(const struct mill_charge *c, uint64_t block, double t, uint64_t done,
                        uint64_t until)
{
    const struct mill_world *w = c->world;
    if (!w || until / c->every == done / c->every)
        return;
    struct mill_charge_sum *s = &c->block[block];
    const double due = (double)(until / c->every - done / c->every);
    s->samples += due;
    for (int32_t i = 0; i < w->balls; i++) {
        const vec3 r = vec3_sub(mill_world_position(w, i, t), c->centre);
        const vec3 v = mill_world_velocity(w, i, t);
        const double x = vec3_dot(r, c->rising), y = -vec3_dot(r, c->down);
        const double radius = sqrt(x * x + y * y);
        const double mass = due * w->species[w->ball[i].species].mass;
        const double turn = 0.5 + mill_elementary_atan2(x, -y) / (2 * MILL_PI);
        const int ring = (int)fmin(radius / w->drum_radius * RINGS, RINGS - 1);
        s->mass += mass;
        s->across += mass * x;
        s->up += mass * y;
        s->layer[(int)(turn * ANGLES) % ANGLES] += radius > c->inner ? mass : 0;
        s->flow[(int)(turn * SECTORS) % SECTORS][ring] -=
            mass * (vec3_dot(v, c->rising) * y + vec3_dot(v, c->down) * x) / (radius + 1e-300);
    }
}

/* Adds an impact on the liner. */
static void add_hit(const struct mill_charge *c, struct mill_charge_sum *s,
                    const struct mill_impact *impact)
{
    const struct mill_shape *shape = c->world->shape[impact->surface];
    const vec3 q = vec3_sub(impact->position, c->centre);
    const double x = vec3_dot(q, c->rising), y = -vec3_dot(q, c->down), r = sqrt(x * x + y * y);
    if (shape->motion != c->world->container.motion || !(r > 0) ||
        (mill_body_is(shape)->inside && shape->wall > 0))
        return;
    const double turn = 0.5 + mill_elementary_atan2(x, -y) / (2 * MILL_PI);
    const double jx = -vec3_dot(impact->impulse, c->rising),
                 jy = vec3_dot(impact->impulse, c->down);
    const double outward = (x * jx + y * jy) / r, forward = (x * jy - y * jx) / r;
    struct mill_charge_hits *hit = &s->hit[(int)(turn * ANGLES) % ANGLES];
    hit->count += !impact->lasting;
    hit->normal += impact->dissipation_normal;
    hit->sliding += impact->dissipation - impact->dissipation_normal;
    hit->outward += outward;
    hit->forward += forward;
    if (r > c->tip)
        return;
    const double size = vec3_norm(impact->impulse);
    int octave;
    const int half = frexp(size / c->unit, &octave) > sqrt(0.5);
    const int bin = (int)fmin(fmax(2 * octave - 2 + half, 0), MILL_CHARGE_SIZES - 1);
    hit->lifter_outward += outward;
    hit->lifter_forward += forward;
    s->sizes[(int)(turn * MILL_CHARGE_WIDE) % MILL_CHARGE_WIDE][bin] += size;
}

void mill_charge_impact(const struct mill_charge *c, uint64_t block, bool open,
                        const struct mill_impact *impact)
{
    const int32_t ball[2] = {impact->ball, impact->partner};
    const int16_t species[2] = {impact->species, impact->partner_species};
    if (open && impact->surface >= 0)
        add_hit(c, &c->block[block], impact);
    for (int k = 0; k < 2 && species[k] >= 0; k++) {
        const double flight = impact->time - c->met[ball[k]];
        const double diameter = 2 * c->world->species[species[k]].radius;
        if (open && flight * flight * vec3_norm(c->world->g) > 2 * diameter)
            c->block[block].flight += flight;
        c->met[ball[k]] = impact->time;
    }
}

void mill_charge_join(const struct mill_charge *c, uint64_t before, uint64_t after)
{
    for (uint64_t k = 1, many = before / after; c->world && many > 1 && k < before; k++) {
        if (k % many == 0)
            memset(&c->block[k / many], 0, sizeof *c->block);
        mill_sums_add_records(&list, 1, &c->block[k / many], &c->block[k]);
        memset(&c->block[k], 0, sizeof *c->block);
    }
}

/* ---- results ---- */

/* Mean of the bins around bin k */
static double smooth(const double *bin, int k, int reach)
{
    double sum = 0;
    for (int i = k - reach; i <= k + reach; i++)
        sum += bin[(i + 2 * ANGLES) % ANGLES] / (2 * reach + 1);
    return sum;
}

/* [rad] where the layer is half as full as around bin k, in this direction; NaN: nowhere */
static double edge(const double *layer, int k, int step)
{
    const double half = 0.5 * smooth(layer, k, BROAD);
    for (int i = k; abs(i - k) < ANGLES; i += step) {
        const double now = smooth(layer, i, FINE), next = smooth(layer, i + step, FINE);
        if (now >= half && next < half)
            return 2 * MILL_PI * ((i + 0.5 + step * (now - half) / (now - next)) / ANGLES - 0.5);
    }
    return NAN;
}

/* The middle of where the stream function is above 0.8 of its maximum */
static void find_circulation(const struct mill_charge_sum *s, double radius, double place[2])
{
    double stream[SECTORS][RINGS + 1] = {{0}}, most = 0, sum[3] = {0};
    for (int k = 0; k < SECTORS; k++)
        for (int i = RINGS - 1; i >= 0; i--) {
            stream[k][i] = stream[k][i + 1] + s->flow[k][i] / (i + 0.5);
            most = fmax(most, stream[k][i]);
        }
    for (int k = 0; k < SECTORS; k++) {
        const double angle = 2 * MILL_PI * ((k + 0.5) / SECTORS - 0.5);
        const struct mill_heading to = mill_elementary_heading(angle);
        for (int i = 0; i < RINGS; i++) {
            const double weight = fmax(0, stream[k][i] - 0.8 * most) * i;
            sum[0] += weight;
            sum[1] += weight * i * to.sin;
            sum[2] -= weight * i * to.cos;
        }
    }
    place[0] = sum[1] / sum[0] * radius / RINGS;
    place[1] = sum[2] / sum[0] * radius / RINGS;
}

void mill_charge_estimate(const struct mill_charge *c, uint64_t from, uint64_t to,
                          struct mill_charge_sum *s, double number[MILL_CHARGE_NUMBERS])
{
    for (; from < to; from++)
        mill_sums_add_records(&list, 1, s, &c->block[from]);
    const double time = s->samples * (double)c->every * c->interval;
    int full = 0;
    for (int k = 1; k < ANGLES; k++)
        full = smooth(s->layer, k, BROAD) > smooth(s->layer, full, BROAD) ? k : full;
    number[MILL_CHARGE_TOE] = edge(s->layer, full, -1);
    number[MILL_CHARGE_SHOULDER] = edge(s->layer, full, 1);
    number[MILL_CHARGE_REPOSE] = mill_elementary_atan2(s->across / s->mass, -s->up / s->mass);
    /* contacts of soft spheres take time: between two of them a ball may touch others */
    number[MILL_CHARGE_FLIGHT] =
        s->flight / (c->world->soft.on ? (double)NAN : c->world->balls * time);
    number[MILL_CHARGE_FLIGHT + 1] = s->across / s->mass;
    number[MILL_CHARGE_FLIGHT + 2] = s->up / s->mass;
    find_circulation(s, c->world->drum_radius, &number[MILL_CHARGE_FLIGHT + 3]);
    double all = 0, above = 0;
    const double toe = ANGLES * (0.5 + number[MILL_CHARGE_TOE] / (2 * MILL_PI));
    for (int k = 0; k < ANGLES; k++) {
        all += s->hit[k].normal;
        above += s->hit[k].normal * fmin(fmax(toe - k, 0), 1);
    }
    number[MILL_CHARGE_ABOVE_TOE] = isnan(toe) ? toe : above / all;
}

void mill_charge_results(const struct mill_charge *const *start, int starts, uint64_t from,
                         uint64_t to, struct mill_charge_sum *sum,
                         struct mill_spread_mean number[MILL_CHARGE_NUMBERS])
{
    const uint64_t parts = starts >= MILL_SPREAD_SEVERAL ? 1 : MILL_SPREAD_PIECES, n = to - from;
    double all[MILL_CHARGE_NUMBERS][MILL_PRECISION_STARTS], now[MILL_CHARGE_NUMBERS];
    for (uint64_t s = 0; s < (uint64_t)starts * parts; s++) {
        struct mill_charge_sum own = {0};
        const uint64_t part = s % parts, first = from + part * n / parts;
        mill_charge_estimate(start[s / parts], first, from + (part + 1) * n / parts, &own, now);
        mill_sums_add_records(&list, 1, sum, &own);
        for (int i = 0; i < MILL_CHARGE_NUMBERS; i++)
            all[i][s] = now[i];
    }
    mill_charge_estimate(start[0], 0, 0, sum, now);
    for (int i = 0; i < MILL_CHARGE_NUMBERS; i++) {
        number[i] = mill_spread_mean(all[i], (struct mill_spread_of){(size_t)starts * parts, 1, 0});
        number[i].error = fabs(number[i].value) > 0 ? number[i].error : (double)NAN; /* no flight */
        number[i].value = now[i];
    }
}
