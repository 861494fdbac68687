/* Attributes of groups and datasets: numbers, texts, arrays of both, and the two labels that every
 * dataset carries. Texts are of variable length in UTF-8, because h5py turns only those into str
 * and MDAnalysis compares the unit with a str. */
#include "store/h5_internal.h"

#include <string.h>

static bool put(hid_t object, const char *name, hid_t type, hid_t memory_type, hid_t space,
                const void *values)
{
    if (H5Aexists(object, name) > 0 && H5Adelete(object, name) < 0)
        return false;
    const hid_t attribute = H5Acreate2(object, name, type, space, H5P_DEFAULT, H5P_DEFAULT);
    const bool written = attribute >= 0 && H5Awrite(attribute, memory_type, values) >= 0;
    return mill_h5_release(attribute) && written;
}

bool mill_h5_label(const struct mill_h5 *file, hid_t object, const char *unit,
                   const char *description)
{
    const hid_t space = H5Screate(H5S_SCALAR);
    const bool done = put(object, "unit", file->text, file->text, space, &unit) &&
                      put(object, "description", file->text, file->text, space, &description);
    return mill_h5_release(space) && done;
}

/* count 0: a scalar */
static void attach(struct mill_h5 *file, const char *object, const char *name, hid_t type,
                   hid_t memory_type, size_t count, const void *values)
{
    if (!mill_h5_good(file))
        return;
    const hsize_t extent = count;
    const hid_t space = count ? H5Screate_simple(1, &extent, NULL) : H5Screate(H5S_SCALAR);
    const hid_t owner = H5Oopen(file->id, object, H5P_DEFAULT);
    const bool done = owner >= 0 && put(owner, name, type, memory_type, space, values);
    mill_h5_release(space);
    if (!mill_h5_release(owner) || !done)
        mill_h5_fail(file, "write the attributes of", object);
}

void mill_h5_attribute(struct mill_h5 *file, const char *object, const char *name,
                       enum mill_h5_type type, size_t count, const void *values)
{
    attach(file, object, name, mill_h5_file_type(type), mill_h5_memory_type(type), count, values);
}

void mill_h5_attribute_text(struct mill_h5 *file, const char *object, const char *name,
                            const char *text)
{
    attach(file, object, name, file->text, file->text, 0, &text);
}

void mill_h5_attribute_texts(struct mill_h5 *file, const char *object, const char *name,
                             size_t count, const char *const *texts)
{
    attach(file, object, name, file->text, file->text, count, texts);
}

void mill_h5_attribute_ascii(struct mill_h5 *file, const char *object, const char *name,
                             const char *text)
{
    const hid_t type = H5Tcopy(H5T_C_S1);
    H5Tset_size(type, strlen(text));
    H5Tset_strpad(type, H5T_STR_NULLPAD);
    attach(file, object, name, type, type, 0, text);
    mill_h5_release(type);
}
