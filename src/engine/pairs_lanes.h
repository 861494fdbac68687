/* The pair search for one width of vectors. pairs.c includes this file once for each variant and
 * defines: SEARCH, its name, and LOOK, that of its part; TARGET, the instructions that the compiler
 * may use; LANES, the number of lanes; LANES_T and FLAGS_T, vectors of doubles and of 64-bit words;
 * SPLAT, TRANSPOSE and KEEP. There is no include guard. */

/* sideways: gravity has a part along x or y. If not, leaving out what is 0 saves time. */
TARGET INLINE int32_t LOOK(const struct mill_pairs *pairs, int32_t i, double now,
                           const struct mill_grids_look *look, int looks, struct mill_pair *found,
                           const bool sideways)
{
    int32_t *restrict near = pairs->near;
    double *restrict terms = pairs->terms;
    int32_t *restrict kept = pairs->kept;
    /* d and u are the relative position and velocity at `now`, s is the sum of the radii: b = d.u
     * (< 0: closing), c = d.d - s^2 (< 0: overlapping), square = b^2 - (u.u) c (> 0: the paths lead
     * to a contact). */
    const struct mill_ball *me = &pairs->ball[i];
    const double *base = (const double *)pairs->ball;
    const double *radius = pairs->radius, mine = radius[me->species];
    const LANES_T my = SPLAT(me->r.y), mz = SPLAT(me->r.z);
    const LANES_T mvx = SPLAT(me->v.x), mvy = SPLAT(me->v.y), mvz = SPLAT(me->v.z);
    const LANES_T gx = SPLAT(pairs->g.x), gy = SPLAT(pairs->g.y), gz = SPLAT(pairs->g.z);
    const LANES_T t_now = SPLAT(now), window = SPLAT(-2.0 * found->dt);
    int64_t survivors = 0;
    int32_t examined = 0, k = 0;
    for (const struct mill_grids_look *l = look; l < look + looks; l++) {
        /* offsets of the candidates' records, counted in doubles */
        const int32_t held =
            l->threes
                ? mill_cells_gather_threes(l->cells, l->cell, l->offset, l->count, RECORD, near + k)
                : mill_cells_gather(l->cells, l->cell, l->offset, l->count, RECORD, near + k);
        const int32_t n = k + held;
        for (int32_t m = n; m < n + LANES - 1; m++)
            near[m] = i * RECORD; /* fills the last group; a ball never closes on itself */
        const bool mixture = l->sum == 0.0;
        LANES_T square_sum = SPLAT(l->sum * l->sum);
        const LANES_T mx = SPLAT(me->r.x + l->shift);
        examined += held;
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
            const LANES_T dx = (sideways ? x + vx * dt + gx * half : x + vx * dt) - mx;
            const LANES_T dy = (sideways ? y + vy * dt + gy * half : y + vy * dt) - my;
            const LANES_T dz = z + vz * dt + gz * half - mz;
            const LANES_T ux = (sideways ? vx + gx * dt : vx) - mvx;
            const LANES_T uy = (sideways ? vy + gy * dt : vy) - mvy;
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
    }
    choose(pairs, LANES, survivors, found);
    return examined;
}

TARGET static int32_t SEARCH(const struct mill_pairs *pairs, int32_t i, double now,
                             const struct mill_grids_look *look, int looks, struct mill_pair *found)
{
    return pairs->g.x == 0.0 && pairs->g.y == 0.0 ? LOOK(pairs, i, now, look, looks, found, false)
                                                  : LOOK(pairs, i, now, look, looks, found, true);
}

#undef SEARCH
#undef LOOK
#undef TARGET
#undef LANES
#undef LANES_T
#undef FLAGS_T
#undef SPLAT
#undef TRANSPOSE
#undef KEEP
