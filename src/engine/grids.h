/* The cell grids of a mill: one for each class of sizes, so that small balls do not gather in the
 * wide cells of large ones. A cell of a coarser grid consists of whole cells of the finest grid.
 * All balls leave and enter cells of the finest grid; from these follow their cells in the other
 * grids. A ball is in the rows of its own class's grid only.
 *
 * Balls of two classes are near each other if the grid of the smaller class has them in cells
 * closer than the sum of their largest radii. Until one of them leaves its cell, only balls that
 * are near each other can touch. Balls of one class: in neighbouring cells. */
#ifndef MILLSIM_GRIDS_H
#define MILLSIM_GRIDS_H

#include "engine/cells.h"
#include "millsim/world.h"

enum { MILL_GRIDS_MOST = 6, MILL_GRIDS_LOOKS = 2 * MILL_GRIDS_MOST };

/* Cells of one grid in which to look for balls. offset: in words of its rows, from `cell` */
struct mill_grids_look {
    const struct mill_cells *cells;
    const int64_t *offset;
    double sum;   /* [m] of the radii of the ball and of all balls in this grid; 0: they differ */
    double shift; /* [m] to add to x of the ball: these cells are at the other end of the box */
    int32_t cell, count;
    bool threes; /* see mill_cells_gather */
};

/* What balls of one class see in the grid of a class: [0] the cells within reach, and [1 + face]
 * those that may hold balls newly near them after they have crossed a face */
struct mill_grids_view {
    double sum;    /* see mill_grids_look */
    double widest; /* [m] maximum sum of the radii */
    int32_t reach; /* [cells] of that grid, to each side */
    int32_t count[7];
    int64_t *offset[7]; /* one array */
};

struct mill_grids {
    int classes;            /* from the smallest balls to the largest */
    struct mill_cells *own; /* [classes] of each class; own[0].cell: the finest cell of each ball */
    int8_t *class_of;       /* of each species */
    /* Cell i of the finest grid is, along each axis, in cell (i + before) / factor - its margin */
    int32_t before[MILL_GRIDS_MOST];
    double per_factor[MILL_GRIDS_MOST];
    struct mill_grids_view view[MILL_GRIDS_MOST][MILL_GRIDS_MOST]; /* of a class, in a grid */
    /* [m] length of a periodic box along x; the cells of each grid divide it evenly. 0: none */
    double period;
    bool plain; /* one class and no periodic box */
};

/* Makes the grids of a mill, without balls. widening: how much wider than necessary the finest
 * cells are. False when out of memory; mill_grids_release frees what init allocated. */
bool mill_grids_init(struct mill_grids *grids, const struct mill_world *world, double widening);
void mill_grids_release(struct mill_grids *grids);

/* insert puts a ball into a cell of the finest grid in which it is not; remove takes it out; cross
 * moves it across a face of its cell. False when out of memory. *shift [m]: to add to x of the
 * ball, where it leaves a periodic box and enters it at the other end */
bool mill_grids_insert(struct mill_grids *grids, int32_t ball, int32_t species, int32_t cell);
void mill_grids_remove(struct mill_grids *grids, int32_t ball, int32_t species);
bool mill_grids_cross(struct mill_grids *g, int32_t ball, int32_t species, int face, double *shift);

/* The cell of the coarsest grid around a cell of the finest grid. Balls are near each other only if
 * these cells are the same or next to each other. */
int32_t mill_grids_block(const struct mill_grids *grids, int32_t cell);

/* Can a ball be inserted without more memory? */
bool mill_grids_has_room(const struct mill_grids *grids, int32_t species, int32_t cell);

/* The cell of the finest grid across a face of a cell; *shift as above */
int32_t mill_grids_across(const struct mill_grids *g, int32_t cell, int32_t face, double *shift);

/* mill_grids_look for several classes, and for periodic boxes */
int mill_grids_look_all(const struct mill_grids *grids, int32_t species, int32_t cell, int32_t face,
                        struct mill_grids_look *look);

/* Where to look for the balls near a ball of this species in this cell of the finest grid. face -1:
 * for all of them; else only for those newly near it after it has crossed this face into the cell.
 * Returns the number of looks; there must be room for MILL_GRIDS_LOOKS. */
static inline int mill_grids_look(const struct mill_grids *g, int32_t species, int32_t cell,
                                  int32_t face, struct mill_grids_look *look)
{
    const struct mill_cells *c = g->own;
    if (!g->plain)
        return mill_grids_look_all(g, species, cell, face, look);
    look->cells = c;
    look->offset = g->view[0][0].offset[1 + face];
    look->sum = g->view[0][0].sum;
    look->cell = cell;
    look->count = face < 0 ? 27 : 9;
    look->threes = face < 4 && mill_cells_shortest(c);
    look->shift = 0.0;
    return 1;
}

/* Lists the balls in the rows of these grids that are near a ball of this species in this cell, and
 * returns how many. `near` must have room for all balls and MILL_CELL_ROW more. */
int32_t mill_grids_gather(const struct mill_grids *g, int32_t species, int32_t cell, int32_t *near);

/* Are balls of these species in these cells near each other? image: periods of the other along x */
bool mill_grids_near(const struct mill_grids *grids, int32_t species, int32_t cell, int32_t other,
                     int32_t other_cell, int image);

#endif
