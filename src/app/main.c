/* The command `millsim`: arguments, signals, messages and exit status. Nothing else in the program
 * prints or exits. Everything that can be refused is refused before the run begins: wrong usage, a
 * wrong deck, an output that exists or cannot be written. */
#include "app/command.h"
#include "app/progress.h"
#include "app/run.h"
#include "deck/deck_setup.h"
#include "millsim/world.h"

#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#define IMPATIENCE 2 /* [s] between two signals that mean one */

/* The signal that asked for an end; 0: none */
static volatile sig_atomic_t stop;

/* Results exist that a signal must not lose */
static volatile sig_atomic_t begun;

/* The first signal ends the run in good order, or at once when there is nothing to save yet. An
 * impatient second one within seconds changes nothing; a later one ends it at once. */
static void take_signal(int number)
{
    static volatile time_t first;
    if (!begun || (stop && time(NULL) - first > IMPATIENCE))
        _exit(128 + number);
    if (!stop)
        first = time(NULL);
    stop = number;
}

static void catch_signals(void)
{
    struct sigaction action;
    memset(&action, 0, sizeof action);
    sigemptyset(&action.sa_mask);
    action.sa_handler = take_signal;
    action.sa_flags = SA_RESTART;
    sigaction(SIGINT, &action, NULL);
    sigaction(SIGTERM, &action, NULL);
    struct sigaction hangup;
    if (sigaction(SIGHUP, NULL, &hangup) == 0 && hangup.sa_handler != SIG_IGN) /* not nohup */
        sigaction(SIGHUP, &action, NULL);
    /* a reader that goes away must not end the run */
    action.sa_handler = SIG_IGN;
    sigaction(SIGPIPE, &action, NULL);
}

/* Without this the output file could become descriptor 1 and get the summary written into it. A
 * closed stream is opened so that writing to it fails. */
static void occupy_standard_streams(void)
{
    for (int fd = 0; fd < 3; fd++)
        if (fcntl(fd, F_GETFD) < 0 && open("/dev/null", O_RDONLY) < 0)
            _exit(MILL_FAILED);
}

static int complain(const struct mill_error *error, enum mill_status status)
{
    fprintf(stderr, "millsim: %s\n", error->text);
    return (int)status;
}

static void say(const char *line)
{
    fprintf(stderr, "millsim: %s\n", line);
}

static void warn(const char *line)
{
    fprintf(stderr, "millsim: warning: %s\n", line);
}

static bool same_file(const struct stat *a, const char *path)
{
    struct stat b;
    return path && stat(path, &b) == 0 && a->st_dev == b.st_dev && a->st_ino == b.st_ino;
}

/* An output file that exists: may it be overwritten? */
static enum mill_status check_existing(const struct mill_command *a, const struct mill_deck *deck,
                                       const char *output, const struct stat *found,
                                       struct mill_error *error)
{
    const char *mend = a->export_start ? "give it" : "use -o for";
    if (S_ISDIR(found->st_mode))
        return mill_error_set(error, MILL_BAD_DECK, "%s: is a folder; %s the name of a file",
                              output, a->export_start ? "give" : "use -o with");
    if (same_file(found, a->deck))
        return mill_error_set(error, MILL_BAD_DECK, "%s: is the deck itself; %s another name",
                              output, mend);
    if (same_file(found, deck->start))
        return mill_error_set(error, MILL_BAD_DECK, "%s: is the deck's start file; %s another name",
                              output, mend);
    if (!S_ISREG(found->st_mode))
        return mill_error_set(error, MILL_BAD_DECK, "%s: is not a regular file; %s another name",
                              output, mend);
    if (!a->force && a->export_start)
        return mill_error_set(error, MILL_BAD_DECK, "%s: exists already; --force overwrites it",
                              output);
    if (!a->force && !a->resume)
        return mill_error_set(error, MILL_BAD_DECK,
                              "%s: exists already; --resume goes on with an interrupted run, "
                              "--force overwrites it, -o gives another name",
                              output);
    if (access(output, W_OK) != 0)
        return mill_error_set(error, MILL_BAD_DECK, "%s: cannot be overwritten: %s", output,
                              strerror(errno));
    return MILL_OK;
}

/* Results are written beside the output file and take its place. */
static enum mill_status check_folder(const char *output, struct mill_error *error)
{
    const char *slash = strrchr(output, '/');
    const size_t length = slash ? (size_t)(slash - output) + 1 : 0;
    char *folder = malloc(length + sizeof ".");
    if (!folder)
        return mill_error_set(error, MILL_FAILED, "out of memory");
    sprintf(folder, "%.*s.", (int)length, output);
    enum mill_status status = MILL_OK;
    if (slash && !slash[1])
        status = mill_error_set(error, MILL_BAD_DECK, "%s: is not the name of a file", output);
    else if (access(folder, W_OK | X_OK) != 0)
        status = mill_error_set(error, MILL_BAD_DECK, "%s: cannot be made: its folder: %s", output,
                                strerror(errno));
    free(folder);
    return status;
}

/* Can the run write there? Asked before it begins, not hours later. */
static enum mill_status check_output(const struct mill_command *a, const struct mill_deck *deck,
                                     const char *output, struct mill_error *error)
{
    struct stat found;
    enum mill_status status = MILL_OK;
    if (stat(output, &found) == 0)
        status = check_existing(a, deck, output, &found, error);
    return status == MILL_OK ? check_folder(output, error) : status;
}

/* Hands text to standard output; a full disk or a closed pipe is a failure like any other. */
static int put(const char *text, int status)
{
    errno = 0;
    if (fputs(text, stdout) != EOF && fflush(stdout) == 0)
        return status;
    struct mill_error error;
    mill_error_set(&error, MILL_FAILED, "cannot write to standard output: %s", strerror(errno));
    complain(&error, MILL_FAILED);
    return status ? status : (int)MILL_FAILED;
}

/* --check means all of it: balls that do not fit or overlap show only when the mill is built. */
static int print_deck(const struct mill_deck *deck)
{
    struct mill_error error = {""};
    struct mill_world *world;
    const enum mill_status status = mill_deck_setup_world(deck, NULL, &world, &error);
    if (status != MILL_OK)
        return complain(&error, status);
    mill_world_free(world);
    errno = 0;
    mill_deck_print(deck, stdout);
    return ferror(stdout) ? put("", MILL_FAILED) : put("", MILL_OK);
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

/* Runs (or makes the start only), then ends the progress line, then prints: the summary waits in
 * memory meanwhile. */
static int run(const struct mill_deck *deck, struct mill_run_options options, bool start_only)
{
    struct mill_error error = {""};
    struct mill_progress_display display;
    char *summary = NULL;
    size_t size = 0;
    mill_progress_init(&display, stderr, isatty(STDERR_FILENO));
    if (!options.quiet) {
        options.progress = mill_progress_show;
        options.self = &display;
    }
    options.say = options.quiet ? NULL : say;
    options.stop = &stop;
    options.begun = &begun;
    options.summary = open_memstream(&summary, &size);
    if (!options.summary)
        return complain(&(struct mill_error){"out of memory"}, MILL_FAILED);
    const enum mill_status status =
        start_only ? mill_run_export(deck, &options, &error) : mill_run(deck, &options, &error);
    fclose(options.summary);
    mill_progress_end(&display);
    if (options.paranoid && options.paranoid->predictions &&
        (status == MILL_OK || status == MILL_STOPPED))
        tell_checks(options.paranoid);
    int result = status == MILL_STOPPED ? 128 + (int)stop : (int)status;
    if (summary && summary[0])
        result = put(summary, result);
    free(summary);
    if (status == MILL_STOPPED && !error.text[0])
        mill_error_set(&error, status,
                       "stopped by signal %d; %s holds everything up to then, and --resume goes on",
                       (int)stop, options.output);
    return status == MILL_OK ? result : (complain(&error, status), result);
}

/* All of them or none */
static int tell_values(const struct mill_command *a)
{
    struct mill_error error = {""};
    char *text = NULL;
    size_t size = 0;
    FILE *page = open_memstream(&text, &size);
    if (!page)
        return complain(&(struct mill_error){"out of memory"}, MILL_FAILED);
    const enum mill_status status = mill_deck_tell(a->values, a->value, page, &error);
    fclose(page);
    const int result = status == MILL_OK ? put(text, MILL_OK) : complain(&error, status);
    free(text);
    return result;
}

static int run_deck(const struct mill_command *a, const char *command)
{
    struct mill_deck *deck = NULL;
    struct mill_error error = {""};
    enum mill_status status = mill_deck_read(a->deck, a->sets, a->set, warn, &deck, &error);
    if (status != MILL_OK)
        return complain(&error, status);
    int result;
    struct mill_sim_checks checks = {0};
    char *output = mill_command_output(a);
    if (!output)
        status = mill_error_set(&error, MILL_FAILED, "out of memory");
    else if (!a->check)
        status = check_output(a, deck, output, &error);
    if (status != MILL_OK) {
        result = complain(&error, status);
    } else if (a->check) {
        result = print_deck(deck);
    } else {
        const struct mill_run_options options = {
            .output = output,
            .force = a->force,
            .resume = a->resume,
            .quiet = a->quiet,
            .command = command,
            .json = a->json,
            .paranoid = a->paranoid ? &checks : NULL,
        };
        result = run(deck, options, a->export_start != NULL);
    }
    free(output);
    mill_deck_free(deck);
    return result;
}

int main(int argc, char **argv)
{
    struct mill_command a = {0};
    struct mill_error error = {""};
    occupy_standard_streams();
    catch_signals();
    a.set = calloc((size_t)argc + 1, sizeof *a.set);
    char *command = mill_command_quote(argc, argv);
    int result;
    enum mill_status status = MILL_OK;
    a.value = calloc((size_t)argc + 1, sizeof *a.value);
    if (!a.set || !a.value || !command)
        status = mill_error_set(&error, MILL_FAILED, "out of memory");
    if (status == MILL_OK)
        status = mill_command_read(argc, argv, &a, &error);
    if (status != MILL_OK)
        result = complain(&error, status);
    else if (a.text)
        result = put(a.text, MILL_OK);
    else if (a.values)
        result = tell_values(&a);
    else
        result = run_deck(&a, command);
    free(command);
    free(a.set);
    free(a.value);
    return result;
}
