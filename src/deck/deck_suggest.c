/* For a wrong name (of a section, of a key, or of anything else that a deck names), finds what it
 * is called here, or the most similar right name. */
#include "deck/deck_private.h"

static char lower(char c)
{
    return c >= 'A' && c <= 'Z' ? (char)(c - 'A' + 'a') : c;
}

/* Do at most `edits` edits turn a into b? An edit adds, removes or changes a letter, or swaps two.
 * Upper and lower case are equal. */
static bool is_near(const char *a, const char *b, int edits)
{
    for (; *a && lower(*a) == lower(*b); a++)
        b++;
    if (!*a && !*b)
        return true;
    const bool both = *a && *b;
    const bool swapped = both && lower(a[0]) == lower(b[1]) && lower(a[1]) == lower(b[0]);
    return edits > 0 &&
           ((both && is_near(a + 1, b + 1, edits - 1)) || (*a && is_near(a + 1, b, edits - 1)) ||
            (*b && is_near(a, b + 1, edits - 1)) || (swapped && is_near(a + 2, b + 2, edits - 1)));
}

int mill_deck_suggest_edits(const char *word, const char *text)
{
    const int third = (int)strlen(word) / 3, most = third > 1 ? third : 1;
    for (int n = 0; n <= most && n < MILL_DECK_MOST_EDITS; n++)
        if (is_near(text, word, n))
            return n;
    return MILL_DECK_MOST_EDITS;
}

/* ---- other words for the same thing ---- */

#define HOLDS "; a jar that moves is a [body.NAME] with 'side = inside' and a 'motion'"
#define RIDES "a part of the rotor is a [body.NAME] with 'motion = rotor'"
#define HARD "balls are hard spheres: leave it out"
/* clang-format off */
const struct mill_deck_synonym mill_deck_suggest_synonyms[] = {
    {"", "jar vial bowl beaker cup pot vessel container chamber tank mill geometry cylinder barrel", "drum", HOLDS},
    {"", "media medium beads bead grinding_media charge particles particle grains spheres sphere", "balls", NULL},
    {"", "stirrer agitator impeller shaft drive motor", "rotor", NULL},
    {"", "arms paddles paddle arm", "blades", NULL},
    {"", "pins pin discs disc disks disk lifter lifters baffle baffles", "body.NAME", "; " RIDES},
    {"", "stl mesh geometry_file parts part wall walls lid", "body.NAME", NULL},
    {"", "sun planet sun_wheel rotation revolution movement vibration shaker", "motion.NAME", NULL},
    {"", "simulation sim general settings global time control solver", "run", NULL},
    {"", "material materials", "material.NAME", NULL},
    {"", "collision collisions interaction friction restitution", "contact", NULL},
    {"", "dump dumps save results result files write log logging", "output", NULL},
    {"", "slurry fluid liquid suspension feed", NULL,
     "; a liquid is not simulated: [contact] restitution and friction stand for it"},
    {"run", "duration t_end tend end end_time endtime stop_time total_time simulation_time time_end t", "run.time", NULL},
    {"run", "timestep time_step dt delta_t step steps nsteps time_steps", NULL,
     "; millsim has no time step: leave it out"},
    {"run", "start_up startup warmup warm_up transient skip average_from settling_time", "run.sample_from", NULL},
    {"run", "random_seed rng rng_seed", "run.seed", NULL},
    {"run", "accuracy tolerance relative_error", "run.precision", NULL},
    {"run", "cores cpus processors np n_threads omp_num_threads", "run.threads", NULL},
    {"run", "gravity g", "gravity.acceleration", NULL},
    {"gravity", "g value gravity vector", "gravity.acceleration", NULL},
    {"balls", "number n num quantity amount no number_of_balls ball_count n_balls", "balls.count", NULL},
    {"balls", "size d dia ball_diameter ball_size bead_size particle_size", "balls.diameter", NULL},
    {"balls", "distribution size_distribution psd grading", "balls.sizes", NULL},
    {"balls", "radius r", "balls.diameter", ", twice the radius"},
    {"balls", "weight total_mass mass_total m load ball_load charge charge_mass", "balls.mass", NULL},
    {"balls", "filling fill_level filling_degree filling_ratio fill_ratio degree_of_filling bulk bulk_filling bulk_volume j",
     "balls.bulk_fill", " (with the voids between the balls; 'fill' is without them)"},
    {"balls", "solid_fraction volume_fraction packing_fraction phi", "balls.fill", NULL},
    {"balls", "rho material_density true_density bulk_density specific_gravity", "balls.density",
     ", that of the material"},
    {"*", "materials substance", "balls.material", NULL},
    {"balls", "file positions start_file init", "balls.start", NULL},
    {"drum", "inner_diameter internal_diameter inside_diameter d di id bore dia inner_dia", "drum.diameter", NULL},
    {"drum", "inner_radius internal_radius r ri", "drum.radius", NULL},
    {"drum", "height inner_height inner_length internal_length depth width l h inner_width", "drum.length", NULL},
    {"drum", "volume capacity", "drum.length", ", together with 'radius' or 'diameter'"},
    {"drum", "speed rpm n rotation rotational_speed omega critical_speed", "drum.motion",
     ", the name of a [motion.NAME] that turns it"},
    {"drum", "tilt inclination orientation vertical axis", "gravity.acceleration", ": turn gravity instead"},
    {"drum", "shape wall form", "drum.profile", NULL},
    {"drum", "waves number_of_buckles n_buckles bumps", "drum.buckles", NULL},
    {"drum", "wave_height amplitude buckle_amplitude h_buckle", "drum.buckle_height", NULL},
    {"rotor", "rpm n rotational_speed rotation_speed rotor_speed angular_velocity angular_speed omega frequency velocity",
     "rotor.speed", NULL},
    {"rotor", "v_tip vtip tip_velocity peripheral_speed circumferential_speed stirrer_tip_speed", "rotor.tip_speed", NULL},
    {"rotor", "diameter d shaft_dia d_shaft shaft hub_diameter", "rotor.shaft_diameter", NULL},
    {"rotor", "radius r r_shaft hub_radius", "rotor.shaft_radius", NULL},
    {"rotor", "blades arms number_of_blades n_blades paddles", "blades.count", NULL},
    {"blades", "number n num arms number_of_blades blade_count n_blades", "blades.count", NULL},
    {"blades", "radius r height length tip reach rotor_radius", "blades.tip_radius", NULL},
    {"blades", "diameter d tip_diameter rotor_diameter", "blades.tip_radius", ", half the diameter"},
    {"blades", "depth t thick", "blades.thickness", NULL},
    {"blades", "b axial_length breadth", "blades.width", NULL},
    {"blades", "inclination tilt pitch_angle blade_angle twist", "blades.pitch", NULL},
    {"blades", "angle step offset stagger phase", "blades.angle_step", NULL},
    {"blade", "radius r height length tip", "blade.NAME.tip_radius", NULL},
    {"blade", "diameter d tip_diameter", "blade.NAME.tip_radius", ", half the diameter"},
    {"blade", "x centre center axial_position place", "blade.NAME.position", NULL},
    {"blade", "depth t thick", "blade.NAME.thickness", NULL},
    {"blade", "inclination tilt pitch_angle", "blade.NAME.pitch", NULL},
    {"contact", "e e_n en cor cr coefficient_of_restitution restitution_coefficient normal_restitution elasticity",
     "contact.restitution", NULL},
    {"contact", "mu mu_s mus cof friction_coefficient coefficient_of_friction sliding_friction static_friction",
     "contact.friction", NULL},
    {"contact", "beta beta0 beta_0 e_t et tangential", "contact.tangential_restitution", NULL},
    {"contact", "rolling_friction mu_r mur rolling_resistance", NULL, "; rolling friction is not simulated: leave it out"},
    {"contact", "cohesion adhesion", NULL, "; balls do not stick together: leave it out"},
    {"output", "dump dumps dump_interval frame_interval save_interval interval snapshots dt every write_interval",
     "output.frames", NULL},
    {"output", "history time_series sampling sample_interval thermo log_interval", "output.series", NULL},
    {"output", "log collisions contacts impact_log", "output.impacts", NULL},
    {"output", "checkpoint_interval restart backup", "output.checkpoint", NULL},
    {"output", "file name filename file_name folder directory path", NULL, "; the option -o names the output file"},
    {"output", "vtk csv format", NULL, "; leave it out: 'mill export' converts the output file"},
    {"motion", "rpm n rotational_speed rotation_speed angular_velocity angular_speed omega", "motion.NAME.speed", NULL},
    {"motion", "critical critical_speed percent_critical phi", "motion.NAME.speed", ", such as '70 % critical'"},
    {"motion", "ratio speed_ratio transmission_ratio transmission k", "motion.NAME.speed",
     ", relative to the motion that carries it"},
    {"motion", "parent carrier carried_by base", "motion.NAME.on", NULL},
    {"motion", "type", "motion.NAME.kind", NULL},
    {"motion", "origin position place pivot point", "motion.NAME.centre", NULL},
    {"motion", "direction orientation", "motion.NAME.axis", NULL},
    {"motion", "f freq cpm", "motion.NAME.frequency", NULL},
    {"motion", "stroke throw travel", "motion.NAME.amplitude", ", half of the whole stroke"},
    {"body", "type geometry form", "body.NAME.shape", NULL},
    {"body", "position origin place location offset", "body.NAME.centre", NULL},
    {"body", "direction orientation", "body.NAME.axis", NULL},
    {"body", "height inner_height thickness", "body.NAME.length", NULL},
    {"body", "inner_diameter d dia", "body.NAME.diameter", NULL},
    {"body", "r inner_radius", "body.NAME.radius", NULL},
    {"body", "dimensions sizes width extent", "body.NAME.size", NULL},
    {"body", "on carrier carried_by parent moves", "body.NAME.motion", NULL},
    {"body", "number count n", "body.NAME.copies", NULL},
    {"body", "stl mesh path filename mesh_file", "body.NAME.file", NULL},
    {"body", "scale units", "body.NAME.unit", NULL},
    {"body", "fillet edge_radius chamfer", "body.NAME.rounding", NULL},
    {"*", "young youngs_modulus young_modulus elastic_modulus poisson poissons_ratio poisson_ratio stiffness kn k_n damping",
     NULL, "; " HARD},
    {"*", "timestep time_step dt", NULL, "; millsim has no time step: leave it out"},
    {.of = NULL}};
/* clang-format on */

/* The row for a wrong section (name: NULL) or key, or NULL */
static const struct mill_deck_synonym *find_synonym(const char *title, const char *name)
{
    const size_t stem = strcspn(title, ".");
    char word[80];
    snprintf(word, sizeof word, "%.*s", name ? 79 : (int)stem, name ? name : title);
    for (char *p = word; *p; p++)
        *p = strchr("- ", *p) ? '_' : lower(*p);
    for (const struct mill_deck_synonym *s = mill_deck_suggest_synonyms; s->of; s++) {
        const bool section = name ? strcmp(s->of, "*") == 0 ||
                                        (strlen(s->of) == stem && !strncmp(s->of, title, stem))
                                  : !*s->of;
        if (section && mill_deck_is_among(s->words, ' ', word))
            return s;
    }
    return NULL;
}

/* Writes "; here it is balls.big.mass": NAME is that of the section, if it is of the same kind.
 * Returns the key if it belongs to the section, or the section. */
static const char *tell_synonym(const struct mill_deck_synonym *s, const char *title,
                                const char *name, char *hint, size_t size)
{
    const size_t stem = strcspn(title, ".");
    const char *key = s->here && name ? strrchr(s->here, '.') + 1 : "";
    const bool same = name && s->here && strncmp(s->here, title, stem) == 0 &&
                      s->here[stem] == '.' && mill_deck_table_key(title, key, 0);
    const char *remark = s->remark ? s->remark : "";
    if (!s->here)
        snprintf(hint, size, "%s", remark);
    else if (!name)
        snprintf(hint, size, "; here it is [%s]%s", s->here, remark);
    else if (same)
        snprintf(hint, size, "; here it is %.63s.%s%s", title, key, remark);
    else
        snprintf(hint, size, "; here it is %s%s", s->here, remark);
    if (!name)
        return s->here && !strchr(s->here, '.') ? s->here : NULL;
    return same ? mill_deck_table_key(title, key, 0)->name : NULL;
}

const char *mill_deck_suggest_key(const char *title, const char *name, char *hint, size_t size)
{
    const int stem_length = (int)strcspn(title, ".") + 1;
    char stem[40], bare[40], word[40];
    const char *meant = NULL;
    const struct mill_deck_synonym *synonym = find_synonym(title, name);
    int edits, best = MILL_DECK_MOST_EDITS;
    if (synonym)
        return tell_synonym(synonym, title, name, hint, size);
    snprintf(stem, sizeof stem, "%.*s", stem_length, title);
    hint[0] = '\0';
    for (const struct mill_deck_block *b = mill_deck_table; b->title; b++) {
        snprintf(bare, sizeof bare, "%s%s", b->title, b->named ? "." : "");
        snprintf(word, sizeof word, "%s%s", b->title, b->named ? ".NAME" : "");
        if (!name && (edits = mill_deck_suggest_edits(bare, stem)) < best) {
            best = edits;
            meant = b->named ? NULL : b->title;
            snprintf(hint, size, "; did you mean [%s]?", word);
        }
        for (const struct mill_key *key = mill_deck_table_keys(b); name && key->name; key++) {
            if (!mill_deck_table_belongs(b, title)) {
                if (!hint[0] && strcmp(key->name, name) == 0)
                    snprintf(hint, size, "; '%s' belongs to [%s]", name, word);
            } else if ((edits = mill_deck_suggest_edits(key->name, name)) < best) {
                best = edits;
                meant = key->name;
                snprintf(hint, size, "; did you mean '%s'?", key->name);
            }
        }
    }
    return meant;
}
