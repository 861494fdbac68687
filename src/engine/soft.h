/* Declarations shared by the parts of the soft spheres (soft*.c) */
#ifndef MILL_ENGINE_SOFT_H
#define MILL_ENGINE_SOFT_H

#include "engine/crew.h"
#include "engine/grids.h"
#include "engine/sim_private.h"
#include "geometry/shape.h"

/* ---- the law (soft_law.c) ---- */

/* Without a dimension: forces are these times the spring, or the root of spring and reduced mass */
struct mill_soft_damping {
    double normal;     /* dashpot */
    double spring;     /* tangential spring, as a share of the normal one */
    double tangential; /* tangential dashpot */
    double duration;   /* of an impact, in units of sqrt(mass / spring) */
};

enum { MILL_SOFT_ROWS = 33 };

/* Contacts of one kind of two species */
struct mill_soft_spring {
    double mass;     /* [kg] reduced */
    double stiff;    /* [N/m]; of Hertz' law [N/m^1.5] */
    double root;     /* sqrt(mass * stiff) */
    double friction; /* Coulomb's coefficient */
    struct mill_soft_damping damping;
    const struct mill_fall *fall;           /* restitution that falls with the speed; NULL: none */
    const struct mill_soft_damping *damped; /* [MILL_SOFT_ROWS] for e = MILL_SOFT_LEAST to 1 */
};

/* a smaller restitution is taken as this one */
#define MILL_SOFT_LEAST 0.05

/* The damping of a contact that begins with this normal speed [m/s] */
struct mill_soft_damping mill_soft_damping_at(const struct mill_soft_spring *spring, double speed);

/* Springs of all kinds and species: of balls a and b [a * species + b], then of other kinds [kind *
 * species * species + a]. Sets step and duration of the world's facts. NULL: no memory */
struct mill_soft_spring *mill_soft_springs(struct mill_world *w, struct mill_memory_pool *memory);

/* ---- contacts ---- */

/* A contact that lasts. It is directed from ball a, with the smaller number, to its partner. */
struct mill_soft_touch {
    int32_t a, b;        /* balls; b: MILL_NOBODY for a surface */
    int32_t shape, next; /* a surface's number; the ball's next contact with surfaces, or -1 */
    double begin;        /* [s] local */
    vec3 spring;         /* [m] tangential */
    vec3 creep;          /* [m/s] tangential velocity at the last step */
    vec3 normal;         /* from a, at the last step */
    struct mill_soft_damping damping;
    double rest;     /* [s] for which the force of the last step acts after it, falling to zero */
    double pressing; /* [N] along the normal at the last step */
    vec3 drag;       /* [N] and across it */
    double power, power_normal;   /* [W] into the contact at the last step */
    double energy, energy_normal; /* [J] in its springs at the last step */
    double lost, lost_normal;     /* [J] so far */
    /* at the beginning: */
    double speed;             /* [m/s] normal */
    vec3 slip, point, facing; /* as in struct mill_impact: slip, position, normal */
    vec3 place, inward;       /* place and facing */
    vec3 impulse;             /* [N s] given to a so far */
    int64_t flags; /* 1: it slides; 2: seen in this step; 4: one ball had another contact */
};
enum { MILL_SOFT_SLIDES = 1, MILL_SOFT_SEEN = 2, MILL_SOFT_CROWDED = 4 };

enum { MILL_SOFT_PLACES = 8 }; /* of one ball at one shape */

/* ---- balls, in the order of their slots: balls near each other have slots near each other ---- */

struct mill_soft_place {
    vec3 r; /* [m] */
    double radius;
};

/* Forces and torques, or impulses and angular impulses, of contacts */
struct mill_soft_load {
    vec3 force, torque; /* [N], [N m]; or times s */
};

/* What contacts need of a ball besides its place: a line of the cache, because those of other parts
 * come from other cores. Velocities are predicted: at the step's end, without changes of forces. */
struct mill_soft_course {
    vec3 v, w;               /* [m/s], [rad/s] */
    int32_t number, species; /* of the ball */
    int64_t touched;         /* 1: it had a contact in the last step */
};

struct mill_soft_ball {
    vec3 v, w;       /* [m/s], [rad/s] */
    vec3 gain, turn; /* [m/s^2], [rad/s^2] accelerations */
    double per_mass, per_inertia;
    int32_t walls;   /* its first contact with a surface in the pool of its part; -1: none */
    int32_t touched; /* as in its course */
};

/* A neighbour of a ball: one with a higher slot */
struct mill_soft_near {
    int32_t slot, touch; /* the contact in the pool of the part; -1: they do not touch */
};

/* For a ball of another part */
struct mill_soft_sent {
    int64_t slot;
    struct mill_soft_load load;
};

/* What the contacts of a part have done so far */
struct mill_soft_tally {
    struct mill_account account;
    double deepest, force; /* [m], [N] the greatest */
    uint64_t contacts, crowded;
};

/* Some of the slots. Each part does its steps alone; how many there are depends on the balls only.
 * So all sums have the same order on any number of threads. */
struct mill_soft_part {
    int32_t number, first, last;   /* its slots, without `last` */
    double fastest;                /* [m/s] square of the greatest speed in this step */
    struct mill_memory_list near;  /* struct mill_soft_near, of all its balls */
    struct mill_memory_list touch; /* struct mill_soft_touch */
    int32_t unused;                /* the first free place of `touch`; -1: none */
    /* [parts] struct mill_soft_sent, for balls of each part: loads; and impulses more than that, of
     * contacts that begin or end in this step, for balls of this part too */
    struct mill_memory_list *sent, *kick;
    struct mill_memory_list told; /* struct mill_sim_entry: contacts that have ended */
    int32_t *around;              /* buffer for a search */
    bool failed;                  /* out of memory */
    struct mill_soft_tally tally;
};

enum { MILL_SOFT_PARTS = 64 };

/* What the parts of a thread have shown. Other threads write into other lines of the cache. */
struct mill_soft_gist {
    double fastest;  /* [m/s] square of the greatest speed in this step */
    uint64_t told;   /* its parts that have contacts to tell, one bit each */
    uint64_t failed; /* parts */
    char apart[104];
};

struct mill_soft_order {
    int32_t cell, ball;
};

/* Two that overlap now */
struct mill_soft_meeting {
    const struct mill_soft_spring *spring;
    vec3 normal, point; /* from ball a into its partner; [m] where the contact is */
    vec3 rate;          /* [m/s] of the surface of a relative to that of its partner */
    double depth;       /* [m] */
    bool begins;
};

struct mill_soft;

/* Another program's run: see soft_watch.c */
struct mill_soft_watch {
    /* a contact in a sample */
    void (*touch)(struct mill_soft *, struct mill_soft_part *, const struct mill_soft_meeting *,
                  struct mill_soft_touch *);
    double interval;   /* [s] between two samples */
    double now, last;  /* [s] time of this sample, and of the one before; NAN: there was none */
    vec3 velocity;     /* [m/s] of the samples' frame */
    vec3 (*before)[2]; /* [slots] velocity and spin at the sample before */
    uint64_t *seen;    /* [slots] number of the last sample that has the ball */
    uint64_t samples;
    double elastic; /* [J] in the springs now */
    double deepest; /* [m] greatest overlap since the springs were given */
    /* of all samples so far: */
    double normal[MILL_KINDS_MOST];   /* [J] lost in the dashpots */
    double rubbed[MILL_KINDS_MOST];   /* [J] lost to friction, only of surfaces */
    double isolated[MILL_KINDS_MOST]; /* [J] would be lost if every impact happened alone */
    double work[MILL_MOTIONS_MOST];   /* [J] of the motions that move the container */
    vec3 momentum, middle, whirl;     /* sums over the balls: m v, m r, angular momentum */
};

struct mill_soft {
    struct mill_memory_pool memory; /* of the arrays */
    struct mill_world *world;
    struct mill_soft_watch *watch; /* NULL: this program computes the run */
    struct mill_soft_spring *spring;
    double dt;                 /* [s] */
    int64_t steps;             /* in an epoch */
    int64_t step;              /* in this epoch, so far */
    double skin;               /* [m] lists hold pairs with smaller gaps */
    double thinnest, thickest; /* [m] smallest and largest radius */
    double path;               /* [m] no ball has gone farther since t = 0 */
    double listed;             /* [m] the path when the lists were made */
    double passed;             /* [s] since t = 0 */
    double swiftest;           /* [m/s] no surface is faster, where balls can be */
    struct mill_world wide;    /* as the world, with balls that are larger by the skin */
    struct mill_grids grids;
    struct mill_soft_place *place;
    struct mill_soft_load *load;
    struct mill_soft_course *course;
    struct mill_soft_ball *ball;
    int32_t *begin;                /* [balls + 1] of a slot's neighbours in the list of its part */
    int32_t *slot;                 /* of each ball */
    struct mill_soft_order *order; /* buffer to sort */
    struct mill_soft_ball *spare;  /* buffer, as `ball` */
    /* [slots * shapes] on the shape's clock: the ball cannot touch it before; [slots] of all */
    double *due, *look;
    double *speed;          /* [m/s] of each shape, at most */
    struct mill_pose *pose; /* of each shape's motion at the end of the step */
    int parts;
    struct mill_soft_part part[MILL_SOFT_PARTS];
    struct mill_crew *crew; /* NULL: one thread */
    int threads;
    int share[MILL_CREW_MOST + 1]; /* the first part of each thread */
    struct mill_soft_gist gist[MILL_CREW_MOST];
    double fastest; /* of all parts, and their contacts to tell */
    uint64_t told;
    void (*phase)(struct mill_soft *, struct mill_soft_part *);
    struct mill_sim *teller; /* its ended contacts are told beside the phase; NULL: none */
    uint64_t tells;          /* so far */
};

/* From the world at t = 0; if its spheres are not soft, all springs are 0. NULL: out of memory */
struct mill_soft *mill_soft_create(struct mill_world *world);
void mill_soft_free(struct mill_soft *soft);
/* As mill_sim_take_events: all steps that end until `limit` [s]; the world is then at the last. */
void mill_soft_run(struct mill_sim *sim, double limit, uint64_t *budget);

/* A new epoch begins; the world's motions have been restarted. false: out of memory */
bool mill_soft_restart(struct mill_soft *soft);

void mill_soft_state(struct mill_soft *soft, struct mill_state *state);

/* ---- threads (soft_threads.c) ---- */

/* Starts the threads; of 1: ends them. They sleep when there is nothing to do. */
void mill_soft_use_threads(struct mill_soft *soft, int threads);

/* Shares the parts among the threads, by what their steps cost: contacts more than balls */
void mill_soft_share(struct mill_soft *soft);

/* Does the phase for all parts, on all threads. false: one is out of memory */
bool mill_soft_do(struct mill_soft *s, void (*phase)(struct mill_soft *, struct mill_soft_part *));

/* ---- lists (soft_list.c) ---- */

bool mill_soft_lists_create(struct mill_soft *soft);
void mill_soft_lists_free(struct mill_soft *soft);

/* Gives the balls their slots, by place. The contacts must be in no list. */
void mill_soft_sort(struct mill_soft *soft);

/* Makes new lists of neighbours and puts the contacts into them. */
bool mill_soft_list(struct mill_soft *soft);

/* All contacts are over, or are put into the pools and lists again. */
void mill_soft_forget(struct mill_soft *soft);

/* The slot that has a contact: the lower one of two balls */
int32_t mill_soft_owner(const struct mill_soft *soft, const struct mill_soft_touch *touch);

/* A place for a new contact in a part's pool, or -1: out of memory; and back */
int32_t mill_soft_touch_get(struct mill_soft_part *part);
void mill_soft_touch_put(struct mill_soft_part *part, int32_t touch);

/* Adds a contact to those of the ball with surfaces, which are in the order of shapes and times */
void mill_soft_touch_link(struct mill_soft_part *part, struct mill_soft_ball *ball, int32_t touch);

static inline struct mill_soft_touch *mill_soft_touch(const struct mill_soft_part *p, int32_t touch)
{
    return (struct mill_soft_touch *)p->touch.item + touch;
}

/* Where the neighbours of a slot end in the list of its part */
static inline int32_t mill_soft_near_end(const struct mill_soft *s, const struct mill_soft_part *p,
                                         int32_t slot)
{
    return slot + 1 < p->last ? s->begin[slot + 1] : (int32_t)p->near.count;
}

/* ---- forces (soft_force.c) ---- */

/* All forces of a part's contacts at the end of the step; or the contacts of a sample */
void mill_soft_press(struct mill_soft *soft, struct mill_soft_part *part);

/* ---- another program's run (soft_watch.c) ---- */

/* For the run of a program that computes the contacts of the world's balls with linear springs and
 * dashpots, and gives the state of all balls several times in each contact. NULL: out of memory */
struct mill_soft *mill_soft_watch_create(struct mill_world *world);

/* The springs from now on, of all kinds and species in the order of mill_soft_springs: stiffness
 * [N/m], dashpot [kg/s]; shear: their shares along the surface. All contacts are over. */
void mill_soft_watch_springs(struct mill_soft *soft, double interval, const double shear[2],
                             const double (*spring)[2]);

/* The samples' frame, which does not turn: a place p in it is origin + p.x x + p.y y + p.z z */
struct mill_soft_frame {
    vec3 origin, velocity, x, y, z;
};

/* A sample: rows of number, from 1, position, velocity, spin of all balls in any order. Contacts
 * that have begun since the last one are in `told` of the parts. */
enum mill_status mill_soft_watch_sample(struct mill_soft *soft, double time,
                                        const struct mill_soft_frame *frame,
                                        const double (*row)[10], struct mill_error *error);

/* Moves balls of the last sample that overlap apart, and leaves their velocities. Between soft
 * springs and stiffer ones: these would throw the balls apart with much more energy. Returns the
 * greatest overlap [m] that is left, 0: none; NAN: out of memory. */
double mill_soft_watch_part(struct mill_soft *soft);

/* Positions, velocities, spins (balls, 3) in the laboratory */
void mill_soft_watch_state(const struct mill_soft *soft, double *state);

#endif
