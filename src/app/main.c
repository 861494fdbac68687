/* The command `millsim`: arguments, signals, messages and exit status. Nothing else in the program
 * prints or exits. Everything that can be refused is refused before the run begins: wrong usage, a
 * wrong deck, an output that exists or cannot be written. */
#include "app/command.h"
#include "app/record.h"
#include "app/run.h"
#include "deck/deck_setup.h"
#include "millsim/world.h"
#include "store/draft.h"

#include <errno.h>
#include <fcntl.h>
#include <gsl/gsl_errno.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>
#ifdef __linux__
#include <malloc.h>
#endif

#define IMPATIENCE 2 /* [s] between two signals that mean one */

/* The signal that asked for an end; 0: none */
static volatile sig_atomic_t stop;

/* Results exist that a signal must not lose */
static volatile sig_atomic_t begun;

/* The first signal ends the run in good order, or at once when there is nothing to save yet. An
 * impatient second one within seconds changes nothing, nor does SIGXCPU, which comes again with
 * each second of processor time; a later one ends it at once. */
static void take_signal(int number)
{
    static volatile time_t first;
    if (!begun || (stop && number != SIGXCPU && time(NULL) - first > IMPATIENCE))
        _exit(128 + number);
    if (stop)
        return;
    first = time(NULL);
    stop = number;
}

static void catch_signals(void)
{
    static const int asking[] = {SIGINT, SIGTERM, SIGHUP, SIGXCPU};
    struct sigaction action = {.sa_handler = take_signal, .sa_flags = SA_RESTART}, hangup;
    sigemptyset(&action.sa_mask);
    sigaction(SIGHUP, NULL, &hangup);
    for (int i = 0; i < 4; i++)
        if (asking[i] != SIGHUP || hangup.sa_handler != SIG_IGN) /* not nohup */
            sigaction(asking[i], &action, NULL);
    /* neither a reader that goes away nor a file that gets too large ends the run by itself */
    action.sa_handler = SIG_IGN;
    sigaction(SIGPIPE, &action, NULL);
    sigaction(SIGXFSZ, &action, NULL);
}

/* Without this the output file could become descriptor 1 and get the summary written into it. A
 * closed stream is opened so that writing to it fails. */
static void occupy_standard_streams(void)
{
    for (int fd = 0; fd < 3; fd++)
        if (fcntl(fd, F_GETFD) < 0 && open("/dev/null", O_RDONLY) < 0)
            _exit(MILL_FAILED);
}

static void set_up_libraries(void)
{
    gsl_set_error_handler_off(); /* its own handler would abort */
#ifdef M_MMAP_THRESHOLD
    /* else glibc keeps what the start's packing needed for good: half the memory of a large run */
    mallopt(M_MMAP_THRESHOLD, 1 << 20);
#endif
}

static void say(const char *line)
{
    fprintf(stderr, "millsim: %s\n", line);
}

static void warn(const char *line)
{
    fprintf(stderr, "millsim: warning: %s\n", line);
}

static bool same_file(const char *one, const char *other)
{
    struct stat a, b;
    return stat(one, &a) == 0 && stat(other, &b) == 0 && a.st_dev == b.st_dev &&
           a.st_ino == b.st_ino;
}

/* By whatever name: neither the output nor what stands beside it while it is written is an input.
 */
static enum mill_status check_inputs(const struct mill_command *a, const struct mill_deck *deck,
                                     const char *mend, struct mill_error *error)
{
    const char *const input[] = {a->deck, deck->start};
    struct mill_draft *draft = mill_draft_create(a->output, NULL);
    enum mill_status status = draft ? MILL_OK : mill_error_set(error, MILL_FAILED, "out of memory");
    for (int i = 0; i < 2 && input[i] && status == MILL_OK; i++) {
        const bool beside = mill_draft_replaces(draft, input[i]);
        if (beside || same_file(a->output, input[i]))
            status = mill_error_set(error, MILL_BAD_DECK, "%s: %s the deck%s; %s another name",
                                    a->output, beside ? "its draft or lock file is" : "is",
                                    i == 0 ? " itself" : "'s start file", mend);
    }
    mill_draft_free(draft);
    return status;
}

/* Results are written beside the output file and take its place. */
static enum mill_status check_folder(const char *output, struct mill_error *error)
{
    const char *slash = strrchr(output, '/');
    char *folder = slash ? strndup(output, (size_t)(slash - output) + 1) : strdup(".");
    enum mill_status status = MILL_OK;
    if (!folder)
        status = mill_error_set(error, MILL_FAILED, "out of memory");
    else if (slash && !slash[1])
        status = mill_error_set(error, MILL_BAD_DECK, "%s: is not the name of a file", output);
    else if (access(folder, W_OK | X_OK) != 0)
        status = mill_error_set(error, MILL_BAD_DECK, "%s: cannot be made: its folder: %s", output,
                                strerror(errno));
    free(folder);
    return status;
}

/* Can the run write there? Asked before it begins, not hours later. */
static enum mill_status check_output(const struct mill_command *a, const struct mill_deck *deck,
                                     struct mill_error *error)
{
    const bool start = a->given[MILL_EXPORT_START] != NULL;
    const char *mend = start ? "give it" : "use -o for";
    struct stat found;
    const enum mill_status status = check_inputs(a, deck, mend, error);
    if (status != MILL_OK)
        return status;
    if (stat(a->output, &found) != 0)
        return check_folder(a->output, error);
    if (S_ISDIR(found.st_mode))
        return mill_error_set(error, MILL_BAD_DECK, "%s: is a folder; %s the name of a file",
                              a->output, start ? "give" : "use -o with");
    if (!S_ISREG(found.st_mode))
        return mill_error_set(error, MILL_BAD_DECK, "%s: is not a regular file; %s another name",
                              a->output, mend);
    if (!a->given[MILL_FORCE] && !a->given[MILL_RESUME])
        return mill_error_set(error, MILL_BAD_DECK, "%s: exists already; %s--force overwrites it%s",
                              a->output, start ? "" : "--resume goes on with an interrupted run, ",
                              start ? "" : ", -o gives another name");
    if (access(a->output, W_OK) != 0)
        return mill_error_set(error, MILL_BAD_DECK, "%s: cannot be overwritten: %s", a->output,
                              strerror(errno));
    return check_folder(a->output, error);
}

static void tell_checks(const struct mill_sim_checks *c)
{
    fprintf(stderr,
            "paranoid: %llu events, %llu predictions, %llu pairs, %llu surfaces (%llu gaps), %llu "
            "calendar entries, %llu cells, %llu balances: all held\n",
            (unsigned long long)c->events, (unsigned long long)c->predictions,
            (unsigned long long)c->pairs, (unsigned long long)c->surfaces,
            (unsigned long long)c->samples, (unsigned long long)c->entries,
            (unsigned long long)c->places, (unsigned long long)c->accounts);
}

/* Runs the deck; the progress line is ended when it returns. */
static enum mill_status run(const struct mill_command *a, const struct mill_deck *deck,
                            struct mill_progress_display *display, FILE *page,
                            struct mill_error *error)
{
    struct mill_run_options options = {a, &stop, &begun, display, say, page, .checks = {0}};
    const enum mill_status status = mill_run(deck, &options, error);
    mill_progress_end(display);
    if (options.checks.predictions && (status == MILL_OK || status == MILL_STOPPED))
        tell_checks(&options.checks);
    if (status == MILL_STOPPED && !error->text[0])
        mill_error_set(error, status,
                       "stopped by signal %d; %s holds everything up to then, and --resume goes on",
                       (int)stop, a->output);
    return status;
}

/* Builds the mill, and prints the deck or writes the start. --check means all of it: balls that do
 * not fit or overlap show only now. */
static enum mill_status build(const struct mill_command *a, const struct mill_deck *deck,
                              struct mill_progress_display *display, FILE *page,
                              struct mill_error *error)
{
    const bool check = a->given[MILL_CHECK] != NULL;
    const struct mill_start_watch watch = {mill_progress_stage, display};
    struct mill_world *world = NULL;
    enum mill_status status = mill_deck_setup_world(deck, check ? NULL : &watch, &world, error);
    if (status == MILL_OK && check) {
        mill_deck_print(deck, page);
    } else if (status == MILL_OK) {
        begun = 1; /* a signal waits: writing takes a moment, and would leave its draft */
        status = mill_record_export(world, a->deck, a->output, a->given[MILL_FORCE], error);
    }
    mill_progress_end(display);
    mill_world_free(world);
    return status;
}

/* What is to be printed goes to the page. */
static enum mill_status act(const struct mill_command *a, FILE *page, struct mill_error *error)
{
    struct mill_progress_display display;
    struct mill_deck *deck = NULL;
    if (mill_command_answer(a, page))
        return MILL_OK;
    if (a->values)
        return mill_deck_tell(a->values, a->value, page, error);
    enum mill_status status = mill_deck_read(a->deck, a->sets, a->set, warn, &deck, error);
    if (status == MILL_OK && !a->given[MILL_CHECK])
        status = check_output(a, deck, error);
    mill_progress_init(&display, a->given[MILL_QUIET] ? NULL : stderr, isatty(STDERR_FILENO));
    if (status == MILL_OK)
        status = a->given[MILL_CHECK] || a->given[MILL_EXPORT_START]
                     ? build(a, deck, &display, page, error)
                     : run(a, deck, &display, page, error);
    mill_deck_free(deck);
    return status;
}

/* Control characters, as names of files may hold them, cannot drive the terminal. false: a full
 * disk or a closed pipe is a failure like any other. */
static bool put(const char *text)
{
    errno = 0;
    for (const char *p = text; *p; p++)
        putchar(((unsigned char)*p < 32 && *p != '\n' && *p != '\t') || *p == 127 ? '?' : *p);
    return fflush(stdout) == 0 && !ferror(stdout);
}

int main(int argc, char **argv)
{
    struct mill_command a = {0};
    struct mill_error error = {""};
    char *text = NULL;
    size_t size = 0;
    occupy_standard_streams();
    catch_signals();
    set_up_libraries();
    FILE *page = open_memstream(&text, &size);
    enum mill_status status = mill_command_read(argc, argv, &a, &error);
    if (status == MILL_OK && page)
        status = act(&a, page, &error);
    bool whole = page && !ferror(page);
    whole = page && fclose(page) == 0 && whole;
    if (!whole)
        status = mill_error_set(&error, MILL_FAILED, "out of memory");
    int result = status == MILL_STOPPED ? 128 + (int)stop : (int)status;
    /* all of it or nothing: what failed prints only why */
    if ((status == MILL_OK || status == MILL_STOPPED) && !put(text)) {
        fprintf(stderr, "millsim: cannot write to standard output: %s\n", strerror(errno));
        result = result ? result : (int)MILL_FAILED;
    }
    if (status != MILL_OK)
        say(error.text);
    free(text);
    mill_command_free(&a);
    return result;
}
