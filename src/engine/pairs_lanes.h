/* The pair search for one width of vectors. pairs.c includes this file once for each and defines
 * OF(name), which adds the width to a name: LANES, the number of lanes; lanes and flags, vectors of
 * doubles and of 64-bit words; TARGET, the instructions to use; SPLAT, TRANSPOSE, RADII, keep. */

/* Examines the candidates k to n - 1 of one look; returns the number of survivors so far. plain:
 * all balls are equal, and gravity has no part along x and y: leaving out what is 0 saves time. */
OF(TARGET)
INLINE int64_t OF(examine)(const struct mill_pairs *pairs, const struct mill_pairs_search *search,
                           const struct mill_grids_look *look, int32_t k, int32_t n,
                           int64_t survivors, double now, const bool plain)
{
    const int32_t *restrict near = pairs->near;
    double *restrict terms = pairs->terms;
    int32_t *restrict kept = pairs->kept;
    /* d, u: relative position and velocity at `now`, s: sum of the radii; b = d.u (< 0: closing), c
     * = d.d - s^2 (< 0: overlapping), square = b^2 - (u.u) c (> 0: the paths lead to a contact) */
    const struct mill_ball *me = &pairs->ball[search->ball];
    const double *base = (const double *)pairs->ball;
    const double *radius = pairs->radius, mine = radius[me->species];
    const OF(lanes) mx = OF(SPLAT)(me->r.x + look->shift);
    const OF(lanes) my = OF(SPLAT)(me->r.y), mz = OF(SPLAT)(me->r.z);
    const OF(lanes) mvx = OF(SPLAT)(me->v.x), mvy = OF(SPLAT)(me->v.y), mvz = OF(SPLAT)(me->v.z);
    const OF(lanes) gx = OF(SPLAT)(pairs->g.x), gy = OF(SPLAT)(pairs->g.y),
                    gz = OF(SPLAT)(pairs->g.z);
    const OF(lanes) t_now = OF(SPLAT)(now), window = OF(SPLAT)(-2.0 * search->best.dt);
    const bool mixture = !plain && look->sum == 0.0;
    OF(lanes) square_sum = OF(SPLAT)(look->sum * look->sum);
    for (; k < n; k += OF(LANES)) {
        OF(lanes) x, y, z, vx, vy, vz, t, rest;
        OF(TRANSPOSE)();
        if (mixture) {
            const OF(lanes) sum = mine + OF(RADII)(radius, SPECIES_OF(OF(flags), rest));
            square_sum = sum * sum;
        }
        const OF(lanes) dt = t_now - t;
        const OF(lanes) half = 0.5 * dt * dt;
        const OF(lanes) dx = (plain ? x + vx * dt : x + vx * dt + gx * half) - mx;
        const OF(lanes) dy = (plain ? y + vy * dt : y + vy * dt + gy * half) - my;
        const OF(lanes) dz = z + vz * dt + gz * half - mz;
        const OF(lanes) ux = (plain ? vx : vx + gx * dt) - mvx;
        const OF(lanes) uy = (plain ? vy : vy + gy * dt) - mvy;
        const OF(lanes) uz = vz + gz * dt - mvz;
        const OF(lanes) b = dx * ux + dy * uy + dz * uz;
        const OF(lanes) c = dx * dx + dy * dy + dz * dz - square_sum;
        const OF(lanes) square = b * b - (ux * ux + uy * uy + uz * uz) * c;
        STORE(&terms[3 * k], b);
        STORE(&terms[3 * k + OF(LANES)], c);
        STORE(&terms[3 * k + 2 * OF(LANES)], square);
        /* no contact is earlier than c / -2b: keep those that may be before the best so far */
        const OF(flags) flag = (b < 0.0) & (square > 0.0) & (c < b * window);
        survivors += OF(keep)(&flag, k, kept + survivors);
    }
    return survivors;
}

/* The same step of all searches, then the next step: the processor works on one search while it
 * waits for another. plain: see EXAMINE; and each search has one look. */
OF(TARGET)
INLINE int32_t OF(together)(const struct mill_pairs *pairs, struct mill_pairs_search *search,
                            const int together, double now, const bool plain)
{
    int64_t survivors[MILL_PAIRS_TOGETHER] = {0};
    int32_t begin[MILL_PAIRS_TOGETHER] = {0}, end[MILL_PAIRS_TOGETHER], examined = 0;
    const int looks = plain ? 1 : search->looks;
    for (int l = 0; l < looks; l++) {
        for (int s = 0; s < together; s++)
            end[s] = begin[s] + list(&pairs[s], &search[s], &search[s].look[l], begin[s]);
        for (int s = 0; s < together; s++) {
            survivors[s] = OF(examine)(&pairs[s], &search[s], &search[s].look[l], begin[s], end[s],
                                       survivors[s], now, plain);
            examined += end[s] - begin[s];
            begin[s] += (end[s] - begin[s] + OF(LANES) - 1) / OF(LANES) * OF(LANES);
        }
    }
    for (int s = 0; s < together; s++)
        choose(&pairs[s], OF(LANES), survivors[s], &search[s].best);
    return examined;
}

OF(TARGET)
static int32_t OF(search)(const struct mill_pairs *pairs, struct mill_pairs_search *search,
                          int together, double now)
{
    bool plain = pairs->g.x == 0.0 && pairs->g.y == 0.0;
    int32_t examined = 0;
    for (int s = 0; s < together; s++)
        plain = plain && search[s].looks == 1 && search[s].look->sum > 0.0;
    if (plain)
        return together == 1 ? OF(together)(pairs, search, 1, now, true)
                             : OF(together)(pairs, search, MILL_PAIRS_TOGETHER, now, true);
    for (int s = 0; s < together; s++)
        examined += OF(together)(pairs + s, search + s, 1, now, false);
    return examined;
}

#undef OF
