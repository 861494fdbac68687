/* The pair search for one width of vectors. pairs.c includes this file once for each variant and
 * defines: SEARCH, its name, and EXAMINE and TOGETHER, those of its parts; TARGET, the instructions
 * that the compiler may use; LANES, the number of lanes; LANES_T and FLAGS_T, vectors of doubles
 * and of 64-bit words; SPLAT, TRANSPOSE and KEEP. There is no include guard. */

/* Examines the candidates from k to n - 1, of one look, and returns the number of survivors so far.
 * plain: all balls are equal, and gravity has no part along x and y. Leaving out what is 0 saves
 * time. */
TARGET INLINE int64_t EXAMINE(const struct mill_pairs *pairs,
                              const struct mill_pairs_search *search,
                              const struct mill_grids_look *look, int32_t k, int32_t n,
                              int64_t survivors, double now, const bool plain)
{
    const int32_t *restrict near = pairs->near;
    double *restrict terms = pairs->terms;
    int32_t *restrict kept = pairs->kept;
    /* d and u are the relative position and velocity at `now`, s is the sum of the radii: b = d.u
     * (< 0: closing), c = d.d - s^2 (< 0: overlapping), square = b^2 - (u.u) c (> 0: the paths lead
     * to a contact). */
    const struct mill_ball *me = &pairs->ball[search->ball];
    const double *base = (const double *)pairs->ball;
    const double *radius = pairs->radius, mine = radius[me->species];
    const LANES_T mx = SPLAT(me->r.x + look->shift), my = SPLAT(me->r.y), mz = SPLAT(me->r.z);
    const LANES_T mvx = SPLAT(me->v.x), mvy = SPLAT(me->v.y), mvz = SPLAT(me->v.z);
    const LANES_T gx = SPLAT(pairs->g.x), gy = SPLAT(pairs->g.y), gz = SPLAT(pairs->g.z);
    const LANES_T t_now = SPLAT(now), window = SPLAT(-2.0 * search->best.dt);
    const bool mixture = !plain && look->sum == 0.0;
    LANES_T square_sum = SPLAT(look->sum * look->sum);
    for (; k < n; k += LANES) {
        LANES_T x, y, z, vx, vy, vz, t, rest;
        TRANSPOSE();
        (void)rest;
        if (mixture) {
            for (int32_t m = 0; m < LANES; m++)
                square_sum[m] = mine + radius[pairs->ball[near[k + m] / RECORD].species];
            square_sum *= square_sum;
        }
        const LANES_T dt = t_now - t;
        const LANES_T half = SPLAT(0.5) * dt * dt;
        const LANES_T dx = (plain ? x + vx * dt : x + vx * dt + gx * half) - mx;
        const LANES_T dy = (plain ? y + vy * dt : y + vy * dt + gy * half) - my;
        const LANES_T dz = z + vz * dt + gz * half - mz;
        const LANES_T ux = (plain ? vx : vx + gx * dt) - mvx;
        const LANES_T uy = (plain ? vy : vy + gy * dt) - mvy;
        const LANES_T uz = vz + gz * dt - mvz;
        const LANES_T b = dx * ux + dy * uy + dz * uz;
        const LANES_T c = dx * dx + dy * dy + dz * dz - square_sum;
        const LANES_T square = b * b - (ux * ux + uy * uy + uz * uz) * c;
        STORE(&terms[3 * k], b);
        STORE(&terms[3 * k + LANES], c);
        STORE(&terms[3 * k + 2 * LANES], square);
        /* the contact is not earlier than c / -2b: keep those that may be earlier than the best
         * so far */
        const FLAGS_T flag = (b < SPLAT(0.0)) & (square > SPLAT(0.0)) & (c < b * window);
        survivors += KEEP(&flag, k, kept + survivors);
    }
    return survivors;
}

/* The same step of all searches, then the next step: the processor works on one search while it
 * waits for another. plain: see EXAMINE; and each search has one look. */
TARGET INLINE int32_t TOGETHER(const struct mill_pairs *pairs, struct mill_pairs_search *search,
                               const int together, double now, const bool plain)
{
    int64_t survivors[MILL_PAIRS_TOGETHER] = {0};
    int32_t begin[MILL_PAIRS_TOGETHER] = {0}, end[MILL_PAIRS_TOGETHER], examined = 0;
    const int looks = plain ? 1 : search->looks;
    for (int l = 0; l < looks; l++) {
        for (int s = 0; s < together; s++)
            end[s] = begin[s] + list(&pairs[s], &search[s], &search[s].look[l], begin[s]);
        for (int s = 0; s < together; s++) {
            survivors[s] = EXAMINE(&pairs[s], &search[s], &search[s].look[l], begin[s], end[s],
                                   survivors[s], now, plain);
            examined += end[s] - begin[s];
            begin[s] += (end[s] - begin[s] + LANES - 1) / LANES * LANES;
        }
    }
    for (int s = 0; s < together; s++)
        choose(&pairs[s], LANES, survivors[s], &search[s].best);
    return examined;
}

TARGET static int32_t SEARCH(const struct mill_pairs *pairs, struct mill_pairs_search *search,
                             int together, double now)
{
    bool plain = pairs->g.x == 0.0 && pairs->g.y == 0.0;
    int32_t examined = 0;
    for (int s = 0; s < together; s++)
        plain = plain && search[s].looks == 1 && search[s].look->sum > 0.0;
    if (plain)
        return together == 1 ? TOGETHER(pairs, search, 1, now, true)
                             : TOGETHER(pairs, search, MILL_PAIRS_TOGETHER, now, true);
    for (int s = 0; s < together; s++)
        examined += TOGETHER(pairs + s, search + s, 1, now, false);
    return examined;
}

#undef SEARCH
#undef EXAMINE
#undef TOGETHER
#undef TARGET
#undef LANES
#undef LANES_T
#undef FLAGS_T
#undef SPLAT
#undef TRANSPOSE
#undef KEEP
