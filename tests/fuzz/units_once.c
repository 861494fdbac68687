/* Reading the unit database takes a hundred times longer than reading a deck. The fuzz targets are
 * linked with --wrap, so that it is read once for all inputs. */
#include "deck/units.h"

#include <stddef.h>

enum mill_status __real_mill_units_create(struct mill_units **units, struct mill_error *error);
enum mill_status __wrap_mill_units_create(struct mill_units **units, struct mill_error *error);
void __wrap_mill_units_free(struct mill_units *units);

enum mill_status __wrap_mill_units_create(struct mill_units **units, struct mill_error *error)
{
    static struct mill_units *once;
    const enum mill_status status = once ? MILL_OK : __real_mill_units_create(&once, error);
    *units = once;
    return status;
}

void __wrap_mill_units_free(struct mill_units *units)
{
    (void)units;
}
