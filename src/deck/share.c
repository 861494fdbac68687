/* Where are the files that come with the program? Beside its executable: nobody knows where a wheel
 * will be installed. The system names it, also if a link led to it. */
#include "deck/share.h"

#include <stdio.h>
#include <string.h>
#include <unistd.h>

bool mill_share_find(const char *name, char *path)
{
    /* from the folder of the executable: installed, ./millsim and build/release/millsim */
    static const char *const places[] = {"../share/millsim", ".", "../.."};
    char self[4096];
    const ssize_t length = readlink("/proc/self/exe", self, sizeof self - 1);
    if (length <= 0)
        return false;
    self[length] = '\0';
    char *slash = strrchr(self, '/');
    if (!slash)
        return false;
    *slash = '\0';
    for (size_t k = 0; k < sizeof places / sizeof *places; k++) {
        const int size = snprintf(path, MILL_SHARE_PATH, "%s/%s/%s", self, places[k], name);
        if (size < MILL_SHARE_PATH && access(path, R_OK) == 0)
            return true;
    }
    return false;
}
