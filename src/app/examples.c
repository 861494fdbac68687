/* `millsim --examples DIR`: the decks of input/ for those who have no checkout. No file is
 * replaced: all names are looked at before the first file is copied. */
#include "app/command.h"

#include "deck/share.h"
#include "deck/textfile.h"

#include <dirent.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

enum { LARGEST = 64 << 20 /* [B] */, LONGEST = MILL_SHARE_PATH + 300 };
static const char first[] = "simoloyer.ini"; /* a deck that is among them */

static enum mill_status fail(struct mill_error *error, const char *path)
{
    return mill_error_set(error, errno == ENOENT ? MILL_BAD_DECK : MILL_FAILED, "%s: %s", path,
                          strerror(errno));
}

static enum mill_status look(const char *to, struct mill_error *error)
{
    struct stat there;
    if (lstat(to, &there) == 0)
        return mill_error_set(error, MILL_BAD_DECK,
                              "%s exists, and --examples replaces no file; name another folder",
                              to);
    return errno == ENOENT ? MILL_OK : fail(error, to);
}

static enum mill_status copy(const char *from, const char *to, struct mill_error *error)
{
    size_t size = 0;
    const char *why = NULL;
    char *text = mill_textfile_read(from, LARGEST, &size, &why);
    if (!text)
        return why ? mill_error_set(error, MILL_FAILED, "%s: %s", from, why) : fail(error, from);
    const int made = open(to, O_WRONLY | O_CREAT | O_EXCL, 0666);
    FILE *file = made >= 0 ? fdopen(made, "w") : NULL;
    bool good = file && fwrite(text, 1, size, file) == size;
    if (file)
        good = fclose(file) == 0 && good;
    free(text);
    return good ? MILL_OK : fail(error, to);
}

static int is_visible(const struct dirent *entry)
{
    return entry->d_name[0] != '.';
}

enum mill_status mill_examples_copy(const char *folder, FILE *out, struct mill_error *error)
{
    char from[MILL_SHARE_PATH], name[64];
    struct stat there;
    if (stat(folder, &there) == 0 && !S_ISDIR(there.st_mode))
        return mill_error_set(error, MILL_BAD_DECK, "%s: is a file, not a folder", folder);
    snprintf(name, sizeof name, "input/%s", first);
    if (!mill_share_find(name, from))
        return mill_error_set(error, MILL_FAILED,
                              "no example decks beside this program; they are the folder input of "
                              "its source");
    *strrchr(from, '/') = '\0';
    struct dirent **list = NULL;
    const int files = scandir(from, &list, is_visible, alphasort);
    enum mill_status status = files < 0 ? fail(error, from) : MILL_OK;
    for (int k = 0; k < 2 * files && status == MILL_OK; k++) {
        char source[LONGEST], to[LONGEST];
        snprintf(source, sizeof source, "%s/%s", from, list[k % files]->d_name);
        snprintf(to, sizeof to, "%.*s/%s", MILL_SHARE_PATH, folder, list[k % files]->d_name);
        if (k == files && mkdir(folder, 0777) != 0 && errno != EEXIST)
            status = fail(error, folder);
        else
            status = k < files ? look(to, error) : copy(source, to, error);
    }
    if (status == MILL_OK)
        fprintf(out, "%s: %d files; the reference mill runs with: millsim %s/%s\n", folder, files,
                folder, first);
    for (int k = 0; k < files; k++)
        free(list[k]);
    free(list);
    return status;
}
