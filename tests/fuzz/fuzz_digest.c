/* A stream of another program's run from any bytes, for a mill of four balls: the records that all
 * streams begin with, and then the bytes. Refused or broken off with one line, or made a file; no
 * draft is left, whatever happens. */
#include "fuzz.h"

#include "app/run.h"

#include <fcntl.h>

static const char text[] = "[run]\ntime = 50 ms\nsample_from = 10 ms\n"
                           "[drum]\nradius = 30 mm\nlength = 40 mm\n"
                           "[contact]\nrestitution = 0.8\n"
                           "[rotor]\nspeed = 1000 rpm\nshaft_radius = 5 mm\n"
                           "[balls]\ncount = 4\ndiameter = 5 mm\ndensity = 7800 kg/m^3\n"
                           "[output]\nseries = 10 ms\nframes = 10 ms\nimpacts = all\n";

static struct mill_deck *read_deck(void)
{
    static struct fuzz_file file;
    struct mill_error error = {""};
    struct mill_deck *deck = NULL;
    const char *path = fuzz_file_write(&file, text, strlen(text));
    const enum mill_status status = mill_deck_read(path, 0, NULL, NULL, NULL, NULL, &deck, &error);
    fuzz_require(status == MILL_OK, "%s", error.text);
    return deck;
}

static char *put(char *to, const char *type, const void *bytes, uint64_t length)
{
    memcpy(to, type, 8);
    memcpy(to + 8, &length, sizeof length);
    memcpy(to + 16, bytes, length);
    return to + 16 + length;
}

/* A fact of this name: the text "x", or 1.0 */
static char *put_fact(char *to, const char *name, bool number)
{
    const double one = 1.0;
    char bytes[64];
    int length =
        snprintf(bytes, 40, "%s%c%c%s%c%s%c", name, 0, 0, "said", 0, number ? "f8" : "text", 0);
    memcpy(bytes + length, number ? (const void *)&one : "x", number ? sizeof one : 1);
    length += number ? (int)sizeof one : 1;
    return put(to, "fact    ", bytes, (uint64_t)length);
}

/* What all streams of this mill begin with */
static char *put_head(char *to)
{
    const struct {
        uint64_t balls, kinds, motions;
        double apart;
        uint64_t springs;
    } begin = {4, 5, 1, 0.1, 0};
    memcpy(to, "millsim stream 1\n", 17);
    to = put(to + 17, "begin   ", &begin, sizeof begin);
    to = put_fact(to, "program", false);
    to = put_fact(to, "version", false);
    to = put_fact(to, "command", false);
    to = put_fact(to, "started", false);
    to = put_fact(to, "wall_time", true);
    return put_fact(to, "cpu_time", true);
}

static int run(const char *stream, size_t size, struct mill_command *asked)
{
    static struct mill_deck *deck;
    static struct fuzz_file file;
    const volatile sig_atomic_t stop = 0;
    volatile sig_atomic_t begun = 0;
    struct mill_error error = {""};
    struct mill_run_order order = {asked, .stop = &stop, .begun = &begun,
                                   .watch = {mill_progress_stage, &order.display}, .error = &error};
    if (!deck)
        deck = read_deck();
    order.deck = deck;
    const int input = open(fuzz_file_write(&file, stream, size), O_RDONLY);
    fuzz_require(input >= 0 && dup2(input, STDIN_FILENO) == STDIN_FILENO, "no standard input");
    close(input);
    const enum mill_status status = mill_digest(&order);
    if (fuzz_shown())
        fprintf(stderr, "status %d: %s\n", (int)status, error.text);
    if (status != MILL_OK)
        fuzz_require_message(error.text);
    return (int)status;
}

/* Bytes that begin with "raw" are a stream by themselves. */
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static const char *const beside[] = {".part", ".new", ".lock"};
    const size_t raw = size >= 3 && memcmp(data, "raw", 3) == 0 ? 3 : 0;
    struct mill_command asked = {.deck = "deck.ini"};
    asked.given[MILL_QUIET] = asked.given[MILL_FORCE] = "";
    snprintf(asked.output, sizeof asked.output, "/tmp/millsim_fuzz_%ld.h5", (long)getpid());
    char *stream = malloc(1024 + size);
    fuzz_require(stream != NULL, "out of memory");
    char *end = raw ? stream : put_head(stream);
    memcpy(end, data + raw, size - raw);
    const int status = run(stream, (size_t)(end - stream) + size - raw, &asked);
    free(stream);
    const bool made = access(asked.output, F_OK) == 0;
    fuzz_require(status == MILL_OK || status == MILL_FAILED || status == MILL_BAD_DECK, "status %d",
                 status);
    fuzz_require(status == MILL_FAILED || made == (status == MILL_OK), "a file: %d", (int)made);
    for (size_t i = 0; i < sizeof beside / sizeof *beside; i++) {
        char path[sizeof asked.output + 8];
        snprintf(path, sizeof path, "%s%s", asked.output, beside[i]);
        fuzz_require(access(path, F_OK) != 0, "%s is left", path);
    }
    unlink(asked.output);
    return 0;
}
