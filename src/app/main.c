/* The command `millsim`: arguments, signals, messages and exit status. Nothing else prints or
 * exits. Errors that can be found early are reported before the run: wrong usage, deck, output. */
#include "app/forecast.h"
#include "app/record.h"
#include "app/run.h"
#include "app/summary.h"
#include "deck/deck.h"
#include "store/draft.h"

#include <errno.h>
#include <fcntl.h>
#include <gsl/gsl_errno.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>
#ifdef __linux__
#include <malloc.h>
#endif

#define IMPATIENCE 2 /* [s] signals closer in time than this count as one */

static volatile sig_atomic_t stop;  /* the signal that asked the run to stop; 0: none */
static volatile sig_atomic_t begun; /* there are results that a signal must not lose */

/* The first signal stops the run properly, or ends the program if there is nothing to save. One
 * within IMPATIENCE is ignored; a later one ends it at once, but SIGXCPU is sent every second. */
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
        /* do not catch SIGHUP under nohup */
        if (asking[i] != SIGHUP || hangup.sa_handler != SIG_IGN)
            sigaction(asking[i], &action, NULL);
    /* a closed pipe or a file that is too large must not kill the process */
    action.sa_handler = SIG_IGN;
    sigaction(SIGPIPE, &action, NULL);
    sigaction(SIGXFSZ, &action, NULL);
}

/* Opens standard streams that are closed. Otherwise the output file could become descriptor 1 and
 * receive the summary. They are opened so that writing to them fails. */
static void occupy_standard_streams(void)
{
    for (int fd = 0; fd < 3; fd++)
        if (fcntl(fd, F_GETFD) < 0 && open("/dev/null", O_RDONLY) < 0)
            _exit(MILL_FAILED);
}

static struct mill_run_order order; /* the line of its display ends before other output */

static void say(const char *line)
{
    mill_progress_end(&order.display);
    fprintf(stderr, "millsim: %s\n", line);
}

static void warn(const char *line)
{
    mill_progress_end(&order.display);
    fprintf(stderr, "millsim: warning: %s\n", line);
}

/* Checks that neither the output nor its temporary files are an input, also by another name. */
static enum mill_status check_inputs(const struct mill_run_order *o, const char *mend)
{
    const struct mill_deck *deck = o->deck;
    const char *output = o->asked->output;
    struct mill_draft draft;
    mill_draft_init(&draft, output, NULL);
    for (int i = -1; i < (int)deck->text.files.count; i++) {
        const char *input = i < 0 ? o->asked->deck : ((const char **)deck->text.files.item)[i];
        const char *met = mill_draft_meets(&draft, input);
        if (met)
            return mill_error_set(o->error, MILL_BAD_DECK, "%s: %s the deck%s; %s another name",
                                  output, met == draft.path ? "is" : "its draft or lock file is",
                                  i < 0                        ? " itself"
                                  : input == deck->given.start ? "'s start file"
                                                               : "'s file of a body or motion",
                                  mend);
    }
    return MILL_OK;
}

/* Checks that the run can write to the output, before the run and not hours later. */
static enum mill_status check_output(const struct mill_run_order *o)
{
    const char *const *given = o->asked->given, *output = o->asked->output;
    const bool start = given[MILL_EXPORT_START] != NULL, whole = start || given[MILL_DIGEST];
    const char *mend = start ? "give it" : "use -o for", *slash = strrchr(output, '/');
    struct stat found;
    const enum mill_status status = check_inputs(o, mend);
    if (status != MILL_OK)
        return status;
    if (stat(output, &found) == 0) {
        if (S_ISDIR(found.st_mode))
            return mill_error_set(o->error, MILL_BAD_DECK, "%s: is a folder; %s the name of a file",
                                  output, start ? "give" : "use -o with");
        if (!S_ISREG(found.st_mode))
            return mill_error_set(o->error, MILL_BAD_DECK,
                                  "%s: is not a regular file; %s another name", output, mend);
        if (!given[MILL_FORCE] && !given[MILL_RESUME])
            return mill_error_set(o->error, MILL_BAD_DECK,
                                  "%s: exists already; %s--force overwrites it%s", output,
                                  whole ? "" : "--resume goes on with an interrupted run, ",
                                  start ? "" : ", -o gives another name");
        if (access(output, W_OK) != 0)
            return mill_error_set(o->error, MILL_BAD_DECK, "%s: cannot be overwritten: %s", output,
                                  strerror(errno));
    }
    /* results are written next to the output file, which they then replace */
    char in[sizeof o->asked->output];
    snprintf(in, sizeof in, "%.*s", slash ? (int)(slash - output) + 1 : 1, slash ? output : ".");
    if (slash && !slash[1])
        return mill_error_set(o->error, MILL_BAD_DECK, "%s: is not the name of a file", output);
    if (access(in, W_OK | X_OK) != 0)
        return mill_error_set(o->error, MILL_BAD_DECK, "%s: cannot be written: its folder: %s",
                              output, strerror(errno));
    return MILL_OK;
}

/* Runs the deck. The progress line is ended on return. */
static enum mill_status run(struct mill_run_order *o)
{
    const struct mill_paranoid_checks *c = &o->checks;
    const enum mill_status status = mill_run(o);
    mill_progress_end(&o->display);
    if (c->predictions && (status == MILL_OK || status == MILL_STOPPED))
        fprintf(stderr,
                "paranoid: %llu events, %llu predictions, %llu pairs, %llu surfaces (%llu gaps), "
                "%llu calendar entries, %llu cells, %llu balances, %llu quartics: all held\n",
                (unsigned long long)c->events, (unsigned long long)c->predictions,
                (unsigned long long)c->pairs, (unsigned long long)c->surfaces,
                (unsigned long long)c->samples, (unsigned long long)c->entries,
                (unsigned long long)c->places, (unsigned long long)c->accounts,
                (unsigned long long)c->quartics);
    if (status == MILL_STOPPED && !o->error->text[0])
        mill_error_set(o->error, status,
                       "stopped by signal %d; %s holds everything up to then, and --resume goes on",
                       (int)stop, o->asked->output);
    return status;
}

/* Rounds to two digits */
static double rounded(double x)
{
    char text[32];
    snprintf(text, sizeof text, "%.1e", x);
    return atof(text);
}

/* Prints what the run will take, and where it will leave the range of the model. */
static void tell_forecast(const struct mill_deck *deck, struct mill_world *world, FILE *out)
{
    const bool braked = !deck->mill.rotor || deck->setup.drum.corners > 0 ||
                        deck->mill.contact[MILL_BALL_DRUM].law.friction > 0;
    const bool whole = deck->observe.precision == 0 && deck->observe.max_collisions == 0;
    struct mill_forecast f;
    struct mill_error why;
    char starts[32] = "";
    if (deck->observe.starts > 1)
        snprintf(starts, sizeof starts, " in %ld starts", deck->observe.starts);
    if (mill_forecast_make(deck, world, &f, &why) == MILL_OK)
        fprintf(out,
                "forecast: %s%g contacts%s, %g s of processor time, %g MB of "
                "memory, a file of %g MB; from a trial of %g s of simulated time; %s\n",
                f.bound && !whole    ? "about "
                : f.bound || !braked ? "at least "
                : whole              ? ""
                                     : "at most ",
                rounded(f.contacts), starts, rounded(f.cpu), rounded(1e-6 * f.memory),
                rounded(1e-6 * f.file), rounded(f.trial),
                f.bound ? "not known better, because the rate of contacts has not settled"
                        : "right within a factor of 2");
    else
        fprintf(out, "no forecast, because the trial failed: %s\n", why.text);
    if (world->soft.on)
        fprintf(out, "soft spheres: the shortest contact lasts %.6g s, in steps of %.6g s\n",
                world->soft_facts.duration, world->soft_facts.step);
    for (int i = 0; i < f.notes.count; i++)
        if (f.notes.note[i].text[0])
            fprintf(out, "note: %s\n", f.notes.note[i].text);
}

/* Makes the start, also for --check: it shows whether balls fit; writes it or prints the deck. */
static enum mill_status make_start(struct mill_run_order *o, FILE *aside)
{
    const struct mill_command *a = o->asked;
    struct mill_world *world = NULL;
    enum mill_status status = mill_deck_setup_world(o->deck, &o->watch, &world, o->error);
    if (status == MILL_OK && a->given[MILL_CHECK]) {
        mill_deck_print(o->deck, o->page);
        if (!a->given[MILL_QUIET]) {
            mill_summary_mill(world, o->deck, aside);
            tell_forecast(o->deck, world, aside);
        }
    } else if (status == MILL_OK) {
        /* signals must wait: the writing takes a moment, and they would leave an unfinished file */
        begun = 1;
        status = mill_record_export(world, a->deck, a->output, a->given[MILL_FORCE], o->error);
    }
    mill_progress_end(&o->display);
    mill_world_free(world);
    return status;
}

/* Carries out the command. Output goes to `page`, remarks that follow it to `aside`. */
static enum mill_status act(const struct mill_command *a, FILE *page, FILE *aside,
                            struct mill_error *error)
{
    const bool check = a->given[MILL_CHECK] != NULL;
    struct mill_deck *deck = NULL;
    if (mill_command_answer(a, page))
        return MILL_OK;
    if (a->values)
        return mill_deck_tell(a->values, a->value, page, error);
    if (a->given[MILL_EXAMPLES])
        return mill_examples_copy(a->given[MILL_EXAMPLES], page, error);
    order = (struct mill_run_order){
        a,          .stop = &stop, .begun = &begun, .watch = {mill_progress_stage, &order.display},
        .say = say, .page = page,  .error = error};
    mill_progress_init(&order.display, check || a->given[MILL_QUIET] ? NULL : stderr,
                       a->given[MILL_PROGRESS] ? MILL_PROGRESS_OBJECTS
                       : isatty(STDERR_FILENO) ? MILL_PROGRESS_TERMINAL
                                               : MILL_PROGRESS_LOG);
    enum mill_status status =
        mill_deck_read(a->deck, a->sets, a->set, warn, say, &order.watch, &deck, error);
    order.deck = deck;
    if (status == MILL_OK && a->given[MILL_PARANOID] && deck->setup.soft.on)
        status = mill_error_set(error, MILL_BAD_DECK,
                                "option '--paranoid' checks the events of hard spheres: omit it, "
                                "or set run.spheres=hard");
    if (status == MILL_OK && !check && !a->given[MILL_CONTOUR])
        status = check_output(&order);
    if (status == MILL_OK && a->given[MILL_CONTOUR])
        mill_deck_lining_print(deck, page);
    else if (status == MILL_OK)
        status = check || a->given[MILL_EXPORT_START] ? make_start(&order, aside)
                 : a->given[MILL_DIGEST]              ? mill_digest(&order)
                                                      : run(&order);
    mill_deck_free(deck);
    mill_progress_end(&order.display);
    return status;
}

/* Prints text without control characters, which names of files may contain. false: it failed. */
static bool put(const char *text)
{
    errno = 0;
    for (const char *p = text; *p; p++)
        putchar(((unsigned char)*p < 32 && *p != '\n' && *p != '\t') || *p == 127 ? '?' : *p);
    return fflush(stdout) == 0 && !ferror(stdout);
}

/* Without room for its stack the program would end without a word. */
static enum mill_status check_stack(struct mill_error *error)
{
    const rlim_t needed = 256 * 1024;
    struct rlimit limit;
    if (getrlimit(RLIMIT_STACK, &limit) != 0 || limit.rlim_cur >= needed)
        return MILL_OK;
    limit.rlim_cur = needed < limit.rlim_max ? needed : limit.rlim_max;
    if (limit.rlim_cur == needed && setrlimit(RLIMIT_STACK, &limit) == 0)
        return MILL_OK;
    return mill_error_set(error, MILL_FAILED,
                          "the stack may take %lu kB only, and 256 kB are needed: 'ulimit -s 256' "
                          "raises the limit",
                          (unsigned long)(limit.rlim_max / 1024));
}

int main(int argc, char **argv)
{
    struct mill_command a = {0};
    struct mill_error error = {""};
    char *text = NULL, *remarks = NULL;
    size_t size = 0, length = 0;
    occupy_standard_streams();
    catch_signals();
    gsl_set_error_handler_off(); /* GSL's own handler would abort the program */
#ifdef M_MMAP_THRESHOLD
    /* else glibc keeps the memory for packing the balls: half the memory of a large run */
    mallopt(M_MMAP_THRESHOLD, 1 << 20);
#endif
    FILE *page = open_memstream(&text, &size), *aside = open_memstream(&remarks, &length);
    enum mill_status status = check_stack(&error);
    if (status == MILL_OK)
        status = mill_command_read(argc, argv, &a, &error);
    if (status == MILL_OK && page && aside)
        status = act(&a, page, aside, &error);
    const bool printed = page && aside && !ferror(page) && fclose(aside) == 0;
    if (!page || fclose(page) != 0 || !printed)
        status = mill_error_set(&error, MILL_FAILED, "out of memory");
    int result = status == MILL_STOPPED ? 128 + (int)stop : (int)status;
    /* all output or none: after a failure only the reason is printed */
    if ((status == MILL_OK || status == MILL_STOPPED) && !put(text)) {
        fprintf(stderr, "millsim: cannot write to standard output: %s\n", strerror(errno));
        result = result ? result : (int)MILL_FAILED;
    } else if (status == MILL_OK) {
        for (char *line = strtok(remarks, "\n"); line; line = strtok(NULL, "\n"))
            say(line);
    }
    if (status != MILL_OK)
        say(error.text);
    free(text);
    free(remarks);
    free(a.set);
    free(a.line);
    return result;
}
