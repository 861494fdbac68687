/* STL files, whole and broken ones. */
#include "deck/stl.h"
#include "unit.h"

#include <stdio.h>
#include <unistd.h>

static char folder[] = "/tmp/mill-stl-XXXXXX";
static struct mill_error error;
static vec3 (*facet)[3];
static size_t facets;

static void enter_folder(void)
{
    strcpy(strrchr(folder, '-'), "-XXXXXX");
    ck_assert_ptr_nonnull(mkdtemp(folder));
    ck_assert_int_eq(chdir(folder), 0);
}

static void leave_folder(void)
{
    unlink("a.stl");
    ck_assert_int_eq(rmdir(folder), 0);
}

static enum mill_status read_bytes(const void *bytes, size_t size)
{
    FILE *file = fopen("a.stl", "wb");
    ck_assert_ptr_nonnull(file);
    ck_assert_uint_eq(fwrite(bytes, 1, size, file), size);
    fclose(file);
    error.text[0] = '\0';
    const enum mill_status status = mill_stl_read("a.stl", 1e-3, &facet, &facets, &error);
    ck_assert((status == MILL_OK) == (facet != NULL));
    ck_assert((status == MILL_OK) == (error.text[0] == '\0'));
    return status;
}

static void refuse(const char *text, const char *words)
{
    ck_assert_int_eq(read_bytes(text, strlen(text)), MILL_BAD_DECK);
    ck_assert_msg(strstr(error.text, words), "'%s', not '%s'", error.text, words);
}

enum { HEAD = 84, EACH = 50 };

/* Corner i of facet k is at (k, i, 0.1). */
static size_t make_binary(unsigned char *bytes, const char *head, uint32_t count)
{
    memset(bytes, 0, HEAD + EACH * count);
    memcpy(bytes, head, strlen(head));
    for (int i = 0; i < 4; i++)
        bytes[HEAD - 4 + i] = (unsigned char)(count >> 8 * i);
    for (uint32_t k = 0; k < count; k++)
        for (int i = 0; i < 9; i++) {
            const float x = i % 3 == 0 ? (float)k : i % 3 == 1 ? (float)(i / 3) : 0.1F;
            uint32_t bits;
            memcpy(&bits, &x, sizeof bits);
            for (int b = 0; b < 4; b++)
                bytes[HEAD + EACH * k + 12 + 4 * (uint32_t)i + (uint32_t)b] =
                    (unsigned char)(bits >> 8 * b);
        }
    return HEAD + EACH * count;
}

#define FACET                                                                                      \
    "facet normal 0 0 1\n outer loop\n vertex 0 0 0.1\n vertex 0 1 0.1\n vertex 0 2 0.1\n"         \
    " endloop\nendfacet\n"

static void check_corners(size_t count)
{
    ck_assert_uint_eq(facets, count);
    for (size_t k = 0; k < count; k++)
        for (int i = 0; i < 3; i++) {
            ck_assert_double_eq(facet[k][i].x, (double)k * 1e-3);
            ck_assert_double_eq(facet[k][i].y, i * 1e-3);
            ck_assert_double_eq(facet[k][i].z, (double)0.1F * 1e-3);
        }
    free(facet);
}

TEST(binary_files_are_read_whatever_they_begin_with)
{
    unsigned char bytes[HEAD + 7 * EACH];
    const char *const heads[] = {"", "made by hand", "solid cube", "solid\nfacet normal 0 0 1"};
    for (size_t k = 0; k < sizeof heads / sizeof *heads; k++) {
        ck_assert_int_eq(read_bytes(bytes, make_binary(bytes, heads[k], 7)), MILL_OK);
        check_corners(7);
    }
}

TEST(ascii_files_are_read_and_their_numbers_are_of_single_precision)
{
    static const char *const text[] = {
        "solid\n" FACET "endsolid\n",
        "solid a name of facet vertices\r\n" FACET "endsolid a name\r\n\r\n",
        "  \n SOLID x\nFACET NORMAL nan nan -NaN Outer\tLOOP vertex 0 0 1e-1 VERTEX -0 +1. .1\n"
        "vertex 0 2.0e+0 0.10000000001 endLoop endFacet ENDSOLID",
        "solid one\nendsolid one\nsolid two\n" FACET "endsolid",
        "\xef\xbb\xbfsolid of UTF-8\n" FACET "endsolid\n",
        "solid of old\r" FACET "endsolid\r",
    };
    for (size_t k = 0; k < sizeof text / sizeof *text; k++) {
        ck_assert_msg(read_bytes(text[k], strlen(text[k])) == MILL_OK, "%s", error.text);
        check_corners(1);
    }
}

TEST(broken_text_is_refused_with_its_line_and_the_mend)
{
    refuse("", "a.stl: is not an STL file: it has 0 bytes");
    refuse("hello", "does not begin with 'solid'");
    refuse("soliloquy", "a.stl:1: expected 'solid', got 'soliloquy'");
    refuse("solid\nendsolid\n", "has no facets");
    refuse("solid\n" FACET, "a.stl:9: the file ends where 'facet' or 'endsolid' is expected");
    refuse("solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0\n",
           "ends where a number is expected");
    refuse("solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0x1 0\n",
           "a.stl:4: expected a number, got '0x1'");
    refuse("solid\nfacet normal 0 0 1\nouter loop\nvertex 0 nan 0\n", "expected a number");
    refuse("solid\nfacet normal 0 0 1\nouter loop\nvertex 0 1e999 0\n", "expected a number");
    refuse("solid\nfacet normal 0 0 1\nouter loop\nvertex 0 1,5 0\n", "expected a number");
    refuse("solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 0 0 0\nendloop\n",
           "a.stl:6: expected 'vertex', got 'endloop'");
    refuse("solid\n" FACET "garbage\n", "a.stl:9: expected 'facet' or 'endsolid', got 'garbage'");
    refuse("solid\n" FACET "endsolid\nmore\n", "a.stl:10: expected 'solid', got 'more'");
}

TEST(broken_binary_files_are_refused)
{
    unsigned char bytes[HEAD + 3 * EACH];
    const size_t size = make_binary(bytes, "solid", 3);
    for (size_t less = 1; less < size; less++) {
        ck_assert_int_eq(read_bytes(bytes, size - less), MILL_BAD_DECK);
        ck_assert_msg(strstr(error.text, "not an STL file") ||
                          strstr(error.text, "not a complete STL file") || size - less == 5,
                      "%s", error.text);
    }
    memset(bytes + HEAD - 4, 0xff, 4); /* more facets than there are bytes in memory */
    ck_assert_int_eq(read_bytes(bytes, size), MILL_BAD_DECK);
    ck_assert_msg(strstr(error.text, "4294967295 facets"), "%s", error.text);
    make_binary(bytes, "", 3);
    memset(bytes + HEAD + EACH + 12, 0xff, 4); /* a NaN */
    ck_assert_int_eq(read_bytes(bytes, size), MILL_BAD_DECK);
    ck_assert_msg(strstr(error.text, "facet 2 has a corner that is not a number"), "%s",
                  error.text);
    ck_assert_int_eq(read_bytes(bytes, make_binary(bytes, "", 0)), MILL_BAD_DECK);
    ck_assert_msg(strstr(error.text, "has no facets"), "%s", error.text);
}

TEST(a_file_that_is_not_there_or_none_is_refused)
{
    ck_assert_int_eq(mill_stl_read("none.stl", 1.0, &facet, &facets, &error), MILL_BAD_DECK);
    ck_assert_ptr_nonnull(strstr(error.text, "none.stl: cannot be read: No such file"));
    ck_assert_int_eq(mill_stl_read("/", 1.0, &facet, &facets, &error), MILL_BAD_DECK);
    ck_assert_int_eq(mill_stl_read("/dev/zero", 1.0, &facet, &facets, &error), MILL_BAD_DECK);
    ck_assert_ptr_null(facet);
}

int main(void)
{
    return unit_run_in("stl", enter_folder, leave_folder);
}
