/* Gives a fuzz target the files of the folders (or the files) named, one by one: how the normal
 * tests, and whoever has found something, repeat inputs without a fuzzer. */
#include "fuzz.h"

#include <dirent.h>
#include <sys/stat.h>

static int replay_file(const char *path)
{
    uint8_t *data = NULL;
    size_t size = 0, room = 0, got = 0;
    FILE *in = fopen(path, "rb");
    if (!in) {
        fprintf(stderr, "%s: cannot be read\n", path);
        exit(EXIT_FAILURE);
    }
    do {
        size += got;
        if (size == room) {
            room = 2 * room + 4096;
            data = realloc(data, room);
            if (!data)
                abort();
        }
        got = fread(data + size, 1, room - size, in);
    } while (got > 0);
    fclose(in);
    if (fuzz_shown())
        fprintf(stderr, "%s\n", path);
    /* a copy of the exact length, so that sanitizers see a read beyond it */
    uint8_t *exact = malloc(size + !size);
    if (!exact)
        abort();
    memcpy(exact, data, size);
    LLVMFuzzerTestOneInput(exact, size);
    free(exact);
    free(data);
    return 1;
}

static int replay(const char *path)
{
    struct stat is;
    if (stat(path, &is) != 0 || !S_ISDIR(is.st_mode))
        return replay_file(path);
    struct dirent **entry;
    const int n = scandir(path, &entry, NULL, alphasort);
    int files = 0;
    for (int i = 0; i < n; i++) {
        char name[4096];
        if (entry[i]->d_name[0] != '.' &&
            snprintf(name, sizeof name, "%s/%s", path, entry[i]->d_name) < (int)sizeof name)
            files += replay_file(name);
        free(entry[i]);
    }
    if (n >= 0)
        free(entry);
    return files;
}

int main(int count, char **argument)
{
    int files = 0;
    for (int i = 1; i < count; i++)
        files += replay(argument[i]);
    const char *slash = strrchr(argument[0], '/');
    printf("%s: %d inputs hold\n", slash ? slash + 1 : argument[0], files);
    /* an empty folder would let the test pass without a test */
    return files > 0 ? EXIT_SUCCESS : EXIT_FAILURE;
}
