/* A single observer, of any type */
#include "observe/observers.h"

struct mill_observer *mill_observers_one(const struct mill_observing *type,
                                         const struct mill_observe *asked,
                                         const struct mill_world *world, struct mill_error *error)
{
    struct mill_observer *one = calloc(1, type->size);
    if (!one) {
        mill_error_set(error, MILL_FAILED, "out of memory for %s", type->type.name);
        return NULL;
    }
    *one = (struct mill_observer){&type->type, INFINITY};
    if (!type->create || type->create(one, asked, world, error) == MILL_OK)
        return one;
    mill_observers_free_one(one);
    return NULL;
}

void mill_observers_free_one(struct mill_observer *observer)
{
    const struct mill_observing *type = mill_observe_type(observer);
    if (type->free)
        type->free(observer);
    free(observer);
}
