/* The HDF5 door: what is written is read back by HDF5 itself, and failures are told in one line. */
#include "h5_fixture.h"

TEST(an_array_comes_back_with_shape_unit_and_description)
{
    const size_t dims[2] = {2, 3};
    const double values[6] = {1, 2, 3, 4, 5, 6e-300};
    hsize_t shape[2];
    double *read;
    mill_h5_write(file, "/a/b/c", MILL_H5_F64, 2, dims, values, "m s-1", "v\xc3\xa9lo");
    close_file();
    read = look(path, "/a/b/c", 2, shape);
    ck_assert_uint_eq(shape[0], 2);
    ck_assert_uint_eq(shape[1], 3);
    ck_assert_mem_eq(read, values, sizeof values);
    assert_text(path, "/a/b/c", "unit", "m s-1");
    assert_text(path, "/a/b/c", "description", "v\xc3\xa9lo");
    free(read);
}

TEST(scalars_and_texts_come_back)
{
    write_double("/x", 0.1, "J");
    write_count("/n", 1u << 31);
    mill_h5_write_text(file, "/t", "[a]\nb = 1\n", "a text");
    mill_h5_write_text(file, "/empty", "", "no text");
    close_file();
    ck_assert(look_at(path, "/x", 0, 0) == 0.1);
    ck_assert(look_at(path, "/n", 0, 0) == 2147483648.0);
    assert_text(path, "/n", "unit", "1");
    assert_text(path, "/t", NULL, "[a]\nb = 1\n");
    assert_text(path, "/t", "unit", "");
    assert_text(path, "/empty", NULL, "");
}

TEST(an_array_may_have_no_elements)
{
    const size_t none = 0;
    const int64_t untold = 7;
    mill_h5_write(file, "/none", MILL_H5_I64, 1, &none, NULL, "1", "-");
    mill_h5_write(file, "/no", MILL_H5_I64, 1, &none, &untold, "1", "-");
    close_file();
    ck_assert_uint_eq(look_rows(path, "/none", 1), 0);
    ck_assert_uint_eq(look_rows(path, "/no", 1), 0);
}

TEST(writing_again_replaces)
{
    mill_h5_write_text(file, "/run/status", "running", "-");
    mill_h5_write_text(file, "/run/status", "complete", "-");
    close_file();
    assert_text(path, "/run/status", NULL, "complete");
}

TEST(a_file_that_exists_is_refused_and_left_alone)
{
    struct mill_error error;
    write_double("/x", 7, "1");
    close_file();
    ck_assert_int_eq(mill_h5_create(path, MILL_H5_NEW, &file, &error), MILL_FAILED);
    ck_assert_ptr_null(file);
    ck_assert_msg(strstr(error.text, "exists already") && strstr(error.text, "--force"), "%s",
                  error.text);
    ck_assert(look_at(path, "/x", 0, 0) == 7);
}

TEST(overwriting_starts_from_an_empty_file)
{
    write_double("/x", 7, "1");
    close_file();
    open_file(MILL_H5_OVERWRITE);
    ck_assert(!mill_h5_exists(file, "/x"));
    close_file();
}

TEST(a_missing_folder_is_named_with_the_reason)
{
    struct mill_error error;
    abandon_file();
    ck_assert_int_eq(mill_h5_create("/nowhere/at/all.h5", MILL_H5_NEW, &file, &error), MILL_FAILED);
    ck_assert_str_eq(error.text, "/nowhere/at/all.h5: cannot create: No such file or directory");
}

LOOP_TEST(a_file_that_is_no_hdf5_is_not_opened, 2)
{
    struct mill_error error;
    char said[200];
    abandon_file();
    FILE *text = fopen(path, "w");
    fputs("[run]\ntime = 1 s\n", text);
    fclose(text);
    ck_assert_int_eq(mill_h5_create(path, _i ? MILL_H5_UPDATE : MILL_H5_READ, &file, &error),
                     MILL_FAILED);
    snprintf(said, sizeof said,
             "%s: cannot open: it is not an HDF5 file, or it is damaged or cut off", path);
    ck_assert_str_eq(error.text, said);
}

TEST(links_are_second_names_of_one_dataset)
{
    write_double("/a/time", 3, "s");
    mill_h5_link(file, "/a/time", "/b/c/time");
    mill_h5_soft_link(file, "/a", "/soft");
    close_file();
    ck_assert(look_same(path, "/a/time", "/b/c/time"));
    ck_assert(look_at(path, "/soft/time", 0, 0) == 3);
}

/* groups stay open between two calls */
TEST(a_dataset_lies_in_the_group_of_its_path_whatever_was_written_before)
{
    write_double("/a/b/x", 1, "1");
    write_double("/a/bc/x", 2, "1");
    write_double("/a/x", 3, "1");
    write_double("/x", 4, "1");
    write_double("/a/b/c/x", 5, "1");
    mill_h5_remove(file, "/a/b");
    write_double("/a/b/c/y", 6, "1");
    ck_assert(!mill_h5_exists(file, "/a/b/c/x"));
    close_file();
    ck_assert(look_at(path, "/a/bc/x", 0, 0) == 2);
    ck_assert(look_at(path, "/a/x", 0, 0) == 3);
    ck_assert(look_at(path, "/x", 0, 0) == 4);
    ck_assert(look_at(path, "/a/b/c/y", 0, 0) == 6);
}

TEST(a_view_shows_the_same_numbers_under_another_shape)
{
    const size_t from[3] = {2, 2, 3}, to[2] = {4, 3};
    const float values[12] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11};
    hsize_t shape[2];
    double *read;
    int i;
    mill_h5_write(file, "/x", MILL_H5_F32, 3, from, values, "m", "-");
    mill_h5_view(file, "/v", MILL_H5_F32, 2, to, "/x", 3, from, "m", "-");
    close_file();
    read = look(path, "/v", 2, shape);
    ck_assert_uint_eq(shape[0], 4);
    for (i = 0; i < 12; i++)
        ck_assert(read[i] == i);
    free(read);
}

TEST(attributes_are_numbers_texts_and_arrays)
{
    const int32_t version[2] = {1, 1};
    const char *const names[2] = {"ball_ball", "ball_drum"}, *const system[2] = {"US", "SI"};
    int32_t read[2] = {0, 0};
    char ascii[8] = "", *texts[2];
    hid_t at, id, type;
    mill_h5_group(file, "/g", false);
    mill_h5_attribute(file, "/g", "version", MILL_H5_I32, 2, version);
    mill_h5_attribute(file, "/g", "names", MILL_H5_TEXT, 2, names);
    mill_h5_attribute_ascii(file, "/g", "Type", "PolyData");
    mill_h5_attribute(file, "/g", "system", MILL_H5_TEXT, 0, &system[0]);
    mill_h5_attribute(file, "/g", "system", MILL_H5_TEXT, 0, &system[1]);
    close_file();
    assert_text(path, "/g", "system", "SI");
    id = look_open(path);
    at = H5Aopen_by_name(id, "/g", "version", H5P_DEFAULT, H5P_DEFAULT);
    H5Aread(at, H5T_NATIVE_INT32, read);
    ck_assert(read[0] == 1 && read[1] == 1);
    at = H5Aopen_by_name(id, "/g", "names", H5P_DEFAULT, H5P_DEFAULT);
    type = H5Aget_type(at);
    H5Aread(at, type, texts);
    ck_assert_str_eq(texts[1], "ball_drum");
    H5free_memory(texts[0]);
    H5free_memory(texts[1]);
    at = H5Aopen_by_name(id, "/g", "Type", H5P_DEFAULT, H5P_DEFAULT);
    type = H5Aget_type(at);
    ck_assert_uint_eq(H5Tget_size(type), 8);
    H5Aread(at, type, ascii);
    ck_assert_mem_eq(ascii, "PolyData", 8);
    H5Fclose(id);
}

TEST(a_column_holds_its_rows_in_order_however_they_came)
{
    struct mill_h5_column *column;
    column = open_rows("/g/c", 5, 0);
    append_range(column, 0, 23, false);
    append_range(column, 23, 60, true);
    append_range(column, 60, 62, false);
    close_file();
    assert_counts_up("/g/c", 62);
    assert_text(path, "/g/c", "unit", "1");
}

/* How many filters what the file holds under that name passed through */
static int filters_of(const char *name)
{
    const hid_t id = look_open(path);
    const hid_t set = H5Dopen2(id, name, H5P_DEFAULT), list = H5Dget_create_plist(set);
    const int filters = H5Pget_nfilters(list);
    H5Pclose(list);
    H5Dclose(set);
    H5Fclose(id);
    return filters;
}

LOOP_TEST(a_packed_or_plain_column_of_vectors_keeps_its_shape, 2)
{
    const bool plain = _i;
    const struct mill_h5_layout layout = {MILL_H5_F32, 2, {2, 3}, 0, "m", "frames", plain};
    const float frame[2][6] = {{0, 1, 2, 3, 4, 5}, {6, 7, 8, 9, 10, 11}};
    hsize_t shape[3];
    struct mill_h5_column *column = mill_h5_column_create(file, "/v", &layout, 0);
    for (int k = 0; k < 2; k++)
        mill_h5_column_append(column, 1, frame[k]);
    close_file();
    double *read = look(path, "/v", 3, shape);
    ck_assert(shape[0] == 2 && shape[1] == 2 && shape[2] == 3 && read[11] == 11);
    ck_assert_int_eq(filters_of("/v"), plain ? 0 : 2);
    free(read);
}

TEST(a_column_taken_up_again_drops_what_came_after)
{
    struct mill_h5_column *column;
    column = open_rows("/c", 5, 0);
    append_range(column, 0, 12, false);
    append_range(column, 99, 105, false);
    close_file();
    open_file(MILL_H5_UPDATE);
    column = open_rows("/c", 5, 12);
    append_range(column, 12, 31, false);
    close_file();
    assert_counts_up("/c", 31);
}

TEST(columns_may_be_closed_before_their_file)
{
    struct mill_h5_column *column[3];
    column[0] = open_rows("/a", 5, 0);
    column[1] = open_rows("/b", 5, 0);
    column[2] = open_rows("/c", 5, 0);
    append_range(column[0], 0, 12, false);
    mill_h5_column_close(column[1]);
    append_range(column[2], 0, 7, false);
    mill_h5_column_close(column[2]);
    mill_h5_column_close(NULL);
    close_file();
    assert_counts_up("/c", 7);
    assert_counts_up("/a", 12);
}

SLOW_TEST(two_files_of_the_same_content_have_the_same_bytes, 1)
{
    char *bytes[2];
    size_t size[2];
    for (int i = 0; i < 2; i++) {
        write_double("/g/x", 3, "m");
        mill_h5_write_text(file, "/g/t", "abc", "-");
        close_file();
        FILE *in = fopen(path, "rb");
        bytes[i] = calloc(1, 100000);
        size[i] = fread(bytes[i], 1, 100000, in);
        fclose(in);
        sleep(i == 0 ? 2 : 0); /* HDF5 notes times in whole seconds, where it does */
        open_new();
    }
    ck_assert_uint_eq(size[0], size[1]);
    ck_assert_mem_eq(bytes[0], bytes[1], size[0]);
    free(bytes[0]);
    free(bytes[1]);
}

/* Long ones are cut into chunks. */
LOOP_TEST(a_long_row_is_the_row, 7)
{
    const size_t length = (const size_t[]){1, 5, 2731, 21845, 21846, 50000, 100001}[_i];
    const struct mill_h5_layout layout = {MILL_H5_F32, 2, {length, 3}, 0, "m", "-", false};
    struct mill_h5_column *column = mill_h5_column_create(file, "/long", &layout, 0);
    float *row = malloc(length * 3 * sizeof *row);
    hsize_t shape[3];
    for (size_t n = 0; n < 3; n++) {
        for (size_t i = 0; i < 3 * length; i++)
            row[i] = (float)(i + 1000000 * n);
        mill_h5_column_append(column, 1, row);
    }
    close_file();
    double *read = look(path, "/long", 3, shape);
    ck_assert(shape[0] == 3 && shape[1] == length && shape[2] == 3);
    for (size_t i = 0; i < 9 * length; i++)
        ck_assert(read[i] == (double)(float)(i % (3 * length) + 1000000 * (i / (3 * length))));
    free(row);
    free(read);
}

TEST(what_is_no_text_does_not_pass_for_one)
{
    const unsigned char bytes[5] = {0, 255, 1, 128, 7};
    char *text = NULL;
    const size_t count = 5;
    mill_h5_write(file, "/b", MILL_H5_U8, 1, &count, bytes, "byte", "-");
    write_double("/x", 7, "1");
    close_file();
    const char *const no_text[] = {"/b", "/x", "/none"};
    for (int k = 0; k < 3; k++) {
        struct mill_error error = {""};
        mill_h5_create(path, MILL_H5_READ, &file, NULL);
        ck_assert_int_eq(mill_h5_read_text(file, no_text[k], &text, &error), MILL_FAILED);
        ck_assert_msg(strstr(error.text, no_text[k]), "%s", error.text);
        abandon_file();
    }
}

/* Three times so many doubles under /x, with a checksum; they count up. Owner: the caller. */
static double *write_checked(size_t count)
{
    double *values = malloc((3 * count + 1) * sizeof *values);
    for (size_t i = 0; i < 3 * count; i++)
        values[i] = (double)i;
    mill_h5_write_checked(file, "/g/x", MILL_H5_F64, 3 * count, values, "-");
    close_file();
    return values;
}

LOOP_TEST(what_was_written_checked_is_read_back, 5)
{
    const size_t count = (const size_t[]){0, 1, 43690, 43691, 200000}[_i]; /* chunks: 1 1 1 2 5 */
    double *values = write_checked(count), *read = malloc((3 * count + 1) * sizeof *read);
    open_file(MILL_H5_READ);
    ck_assert_int_eq(mill_h5_read(file, "/g/x", MILL_H5_F64, 3 * count, read, NULL), MILL_OK);
    ck_assert(count == 0 || memcmp(read, values, 3 * count * sizeof *read) == 0);
    close_file();
    ck_assert_int_eq(filters_of("/g/x"), count > 0);
    free(values);
    free(read);
}

TEST(nothing_else_passes_for_what_was_written_checked)
{
    static const struct {
        const char *name, *text;
        enum mill_h5_type type;
        size_t count;
    } asked[] = {{"/none", "damaged: /none is missing", MILL_H5_F64, 6},
                 {"/g", "damaged: /g is missing", MILL_H5_F64, 6},
                 {"/g/x", "damaged: /g/x is of another length", MILL_H5_F64, 5},
                 {"/g/x", "damaged: /g/x is of another type", MILL_H5_I64, 6}};
    free(write_checked(2));
    for (size_t k = 0; k < sizeof asked / sizeof *asked; k++) {
        struct mill_error error = {""};
        double read[6];
        mill_h5_create(path, MILL_H5_READ, &file, NULL);
        ck_assert_int_eq(
            mill_h5_read(file, asked[k].name, asked[k].type, asked[k].count, read, &error),
            MILL_FAILED);
        ck_assert_msg(strncmp(error.text, path, strlen(path)) == 0 &&
                          strstr(error.text, asked[k].text),
                      "%s", error.text);
        abandon_file();
    }
}

TEST(a_flipped_bit_is_found)
{
    struct mill_error error = {""};
    double *values = write_checked(1000), *read = malloc(3000 * sizeof *read), there;
    FILE *bytes = fopen(path, "r+b");
    long at = 0;
    while (fseek(bytes, at, SEEK_SET) == 0 && fread(&there, sizeof there, 1, bytes) == 1 &&
           there != values[1234])
        at++;
    fseek(bytes, at, SEEK_SET);
    fputc(1, bytes);
    fclose(bytes);
    mill_h5_create(path, MILL_H5_READ, &file, NULL);
    ck_assert_int_eq(mill_h5_read(file, "/g/x", MILL_H5_F64, 3000, read, &error), MILL_FAILED);
    ck_assert_msg(strstr(error.text, "damaged: /g/x "), "%s", error.text);
    abandon_file();
    free(values);
    free(read);
}

/* Rows gathered before must not come to lie behind it. */
TEST(the_room_of_a_state_that_was_removed_is_given_back)
{
    const size_t count = 1 << 17;
    double *state = calloc(count, sizeof *state);
    struct mill_h5_column *column = open_rows("/c", 0, 0);
    append_range(column, 0, 1000, false);
    mill_h5_write_checked(file, "/state", MILL_H5_F64, count, state, "-");
    ck_assert_int_eq(mill_h5_flush(file, NULL), MILL_OK);
    mill_h5_remove(file, "/state");
    close_file();
    assert_counts_up("/c", 1000);
    FILE *in = fopen(path, "rb");
    fseek(in, 0, SEEK_END);
    ck_assert_int_lt(ftell(in), 100000);
    fclose(in);
    free(state);
}

TEST(after_a_failure_every_call_does_nothing)
{
    const struct mill_h5_layout layout = {.type = MILL_H5_F64, .unit = "1", .description = "-"};
    struct mill_error error = {""};
    const double value = 1;
    write_double("/x", 1, "1");
    ck_assert_int_eq(mill_h5_flush(file, &error), MILL_OK);
    mill_h5_spend(file, "out of memory for the maps");
    mill_h5_spend(file, "another failure");
    write_double("/x", 2, "1");
    mill_h5_group(file, "/g", false);
    mill_h5_attribute(file, "/x", "more", MILL_H5_F64, 0, &value);
    mill_h5_remove(file, "/x");
    struct mill_h5_column *column = mill_h5_column_create(file, "/c", &layout, 0);
    ck_assert_ptr_null(column);
    mill_h5_column_append(column, 1, &value);
    ck_assert_int_eq(mill_h5_flush(file, NULL), MILL_FAILED);
    ck_assert_int_eq(mill_h5_status(file, &error), MILL_FAILED);
    ck_assert_msg(strstr(error.text, ": out of memory for the maps"), "%s", error.text);
    close_failed(NULL);
    ck_assert(look_at(path, "/x", 0, 0) == 1);
}

int main(void)
{
    return unit_run_in("h5", open_new, remove_file);
}
