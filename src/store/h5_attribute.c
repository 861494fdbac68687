/* Attributes of groups and datasets: numbers, texts, arrays of both, and the two labels that every
 * dataset carries. Texts are of variable length in UTF-8, because h5py turns only those into str
 * and MDAnalysis compares the unit with a str. */
#include "store/h5_internal.h"

#include <string.h>

static bool put(hid_t object, const char *name, hid_t type, hid_t memory_type, hid_t space,
                const void *values)
{
    hid_t attribute = -1;
    bool done = false;
    if (type < 0 || space < 0)
        return false;
    if (H5Aexists(object, name) > 0 && H5Adelete(object, name) < 0)
        return false;
    attribute = H5Acreate2(object, name, type, space, H5P_DEFAULT, H5P_DEFAULT);
    if (attribute < 0)
        return false;
    done = H5Awrite(attribute, memory_type, values) >= 0;
    if (done)
        done = H5Aclose(attribute) >= 0;
    return done;
}

bool mill_h5_label(hid_t object, const char *unit, const char *description)
{
    const hid_t type = mill_h5_text_type();
    const hid_t space = H5Screate(H5S_SCALAR);
    const bool done = put(object, "unit", type, type, space, &unit) &&
                      put(object, "description", type, type, space, &description);
    if (done) { /* else the error stack must live on until it is read */
        H5Sclose(space);
        H5Tclose(type);
    }
    return done;
}

/* count 0: a scalar */
static hid_t make_space(size_t count)
{
    const hsize_t extent = count;
    return count == 0 ? H5Screate(H5S_SCALAR) : H5Screate_simple(1, &extent, NULL);
}

static enum mill_status attach(struct mill_h5 *file, const char *object, const char *name,
                               hid_t type, hid_t memory_type, size_t count, const void *values,
                               struct mill_error *error)
{
    enum mill_status status = mill_h5_check(file, error);
    hid_t owner, space;
    if (status != MILL_OK)
        return status;
    space = make_space(count);
    owner = H5Oopen(file->id, object, H5P_DEFAULT);
    if (owner < 0 || !put(owner, name, type, memory_type, space, values))
        status = mill_h5_fail(file, error, "write the attributes of", object);
    H5Oclose(owner);
    H5Sclose(space);
    return status;
}

enum mill_status mill_h5_attribute(struct mill_h5 *file, const char *object, const char *name,
                                   enum mill_h5_type type, size_t count, const void *values,
                                   struct mill_error *error)
{
    return attach(file, object, name, mill_h5_file_type(type), mill_h5_memory_type(type), count,
                  values, error);
}

static enum mill_status attach_texts(struct mill_h5 *file, const char *object, const char *name,
                                     size_t count, const char *const *texts,
                                     struct mill_error *error)
{
    const hid_t type = mill_h5_text_type();
    const enum mill_status status = attach(file, object, name, type, type, count, texts, error);
    H5Tclose(type);
    return status;
}

enum mill_status mill_h5_attribute_text(struct mill_h5 *file, const char *object, const char *name,
                                        const char *text, struct mill_error *error)
{
    return attach_texts(file, object, name, 0, &text, error);
}

enum mill_status mill_h5_attribute_texts(struct mill_h5 *file, const char *object, const char *name,
                                         size_t count, const char *const *texts,
                                         struct mill_error *error)
{
    return attach_texts(file, object, name, count, texts, error);
}

enum mill_status mill_h5_attribute_ascii(struct mill_h5 *file, const char *object, const char *name,
                                         const char *text, struct mill_error *error)
{
    const hid_t type = H5Tcopy(H5T_C_S1);
    enum mill_status status;
    H5Tset_size(type, strlen(text));
    H5Tset_strpad(type, H5T_STR_NULLPAD);
    status = attach(file, object, name, type, type, 0, text, error);
    H5Tclose(type);
    return status;
}
