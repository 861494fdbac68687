/* Reads the command line with getopt_long and says in one line what is wrong with it. */
#include "app/command.h"

#include "base/version.h"

#include <getopt.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { PARANOID = 256, EXPORT_START, VALUE }; /* options without a letter */

static const char help[] =
    "Usage: millsim [options] DECK\n"
    "Simulates the balls of a high-energy ball mill, contact by contact.\n"
    "\n"
    "  -o, --output FILE    where results go; default: the deck's name with .h5, in this folder\n"
    "  -s, --set SECTION.KEY=VALUE\n"
    "                       override one value of the deck, such as -s 'rotor.speed=800 rpm';\n"
    "                       may be repeated\n"
    "  -c, --check          check the deck and print it with all defaults; do not run\n"
    "  -r, --resume         continue an interrupted run of this output file, to the\n"
    "                       same results as if it had never been interrupted\n"
    "  -f, --force          overwrite an existing output file\n"
    "  -j, --json           print the summary as one JSON object\n"
    "  -q, --quiet          no progress\n"
    "      --export-start FILE\n"
    "                       write the balls as they start to FILE, which balls.start reads back\n"
    "                       to the same bits; do not run\n"
    "      --value SECTION.KEY=VALUE\n"
    "                       print what this value is: key, kind, SI value, SI unit, meaning, with\n"
    "                       tabs between; without a deck; may be repeated\n"
    "      --paranoid       check every step against brute force (slow)\n"
    "  -h, --help           print this and end\n"
    "  -V, --version        print the version and end\n"
    "\n"
    "Exit status: 0 done; 1 the run failed; 2 wrong usage or a wrong deck; 128+N stopped by\n"
    "signal N (INT, TERM or HUP), with everything up to then in the output file, for --resume.\n";

/* What getopt_long refused, as a usage error. */
static enum mill_status refuse_option(int result, char *const *argv, struct mill_error *error)
{
    const char *word = argv[optind - 1];
    const bool is_long = strncmp(word, "--", 2) == 0;
    char letter[3] = {'-', (char)optopt, '\0'};
    if (result == ':')
        return mill_error_set(error, MILL_BAD_DECK, "option '%s' needs a value; see millsim --help",
                              is_long ? word : letter);
    if (is_long && optopt)
        return mill_error_set(error, MILL_BAD_DECK,
                              "option '%.*s' takes no value; see millsim --help",
                              (int)strcspn(word, "="), word);
    return mill_error_set(error, MILL_BAD_DECK, "unknown option '%s'; see millsim --help",
                          is_long ? word : letter);
}

static void take_option(struct mill_command *a, int option)
{
    switch (option) {
    case 'o':
        a->output = optarg;
        break;
    case 's':
        a->set[a->sets++] = optarg;
        break;
    case 'c':
        a->check = true;
        break;
    case 'r':
        a->resume = true;
        break;
    case 'f':
        a->force = true;
        break;
    case 'j':
        a->json = true;
        break;
    case 'q':
        a->quiet = true;
        break;
    case EXPORT_START:
        a->export_start = optarg;
        break;
    case VALUE:
        a->value[a->values++] = optarg;
        break;
    case PARANOID:
        a->paranoid = true;
        break;
    case 'h':
        a->text = help;
        break;
    case 'V':
        a->text = mill_version_line;
        break;
    }
}

/* Options that say how to run, where nothing is to be run */
static enum mill_status check_export(const struct mill_command *a, struct mill_error *error)
{
    if (!a->export_start[0])
        return mill_error_set(error, MILL_BAD_DECK,
                              "option '--export-start' needs the name of a file");
    const char *other = a->resume     ? "--resume"
                        : a->check    ? "--check"
                        : a->output   ? "--output"
                        : a->json     ? "--json"
                        : a->paranoid ? "--paranoid"
                                      : NULL;
    if (other)
        return mill_error_set(error, MILL_BAD_DECK,
                              "options '--export-start' and '%s' exclude each other: the start is "
                              "written and nothing is run",
                              other);
    return MILL_OK;
}

/* Nothing else is asked for: no deck is read. */
static enum mill_status check_values(const struct mill_command *a, const char *deck,
                                     struct mill_error *error)
{
    const char *other = deck              ? deck
                        : a->sets         ? "--set"
                        : a->resume       ? "--resume"
                        : a->force        ? "--force"
                        : a->check        ? "--check"
                        : a->output       ? "--output"
                        : a->json         ? "--json"
                        : a->paranoid     ? "--paranoid"
                        : a->export_start ? "--export-start"
                                          : NULL;
    if (other)
        return mill_error_set(error, MILL_BAD_DECK,
                              "option '--value' and '%.200s' exclude each other: values are told "
                              "without a deck and nothing is run",
                              other);
    return MILL_OK;
}

enum mill_status mill_command_read(int argc, char **argv, struct mill_command *a,
                                   struct mill_error *error)
{
    static const struct option options[] = {{"output", required_argument, NULL, 'o'},
                                            {"set", required_argument, NULL, 's'},
                                            {"check", no_argument, NULL, 'c'},
                                            {"resume", no_argument, NULL, 'r'},
                                            {"force", no_argument, NULL, 'f'},
                                            {"json", no_argument, NULL, 'j'},
                                            {"quiet", no_argument, NULL, 'q'},
                                            {"help", no_argument, NULL, 'h'},
                                            {"version", no_argument, NULL, 'V'},
                                            {"paranoid", no_argument, NULL, PARANOID},
                                            {"value", required_argument, NULL, VALUE},
                                            {"export-start", required_argument, NULL, EXPORT_START},
                                            {NULL, 0, NULL, 0}};
    int option;
    opterr = 0;
    while ((option = getopt_long(argc, argv, ":o:s:crfjqhV", options, NULL)) != -1) {
        if (option == '?' || option == ':')
            return refuse_option(option, argv, error);
        take_option(a, option);
        if (a->text)
            return MILL_OK;
    }
    if (a->output && !a->output[0])
        return mill_error_set(error, MILL_BAD_DECK, "option '--output' needs the name of a file");
    if (a->resume && a->force)
        return mill_error_set(
            error, MILL_BAD_DECK,
            "options '--resume' and '--force' exclude each other: go on, or start "
            "again");
    if (a->values)
        return check_values(a, argv[optind], error);
    if (a->export_start && check_export(a, error) != MILL_OK)
        return MILL_BAD_DECK;
    if (optind == argc)
        return mill_error_set(error, MILL_BAD_DECK, "no deck given; see millsim --help");
    if (optind + 1 < argc)
        return mill_error_set(error, MILL_BAD_DECK,
                              "one deck at a time, got '%s' and '%s'; see millsim --help",
                              argv[optind], argv[optind + 1]);
    a->deck = argv[optind];
    return MILL_OK;
}

char *mill_command_output(const struct mill_command *a)
{
    const char *slash = strrchr(a->deck, '/');
    const char *given = a->export_start ? a->export_start : a->output;
    const char *base = given ? given : slash ? slash + 1 : a->deck;
    const char *dot = strrchr(base, '.');
    const size_t stem = !given && dot && dot > base ? (size_t)(dot - base) : strlen(base);
    char *name = malloc(stem + sizeof ".h5");
    if (name)
        sprintf(name, "%.*s%s", (int)stem, base, given ? "" : ".h5");
    return name;
}

char *mill_command_quote(int argc, char **argv)
{
    static const char plain[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789"
                                "%+,-./:=@_";
    size_t size = 1;
    for (int i = 0; i < argc; i++)
        size += 4 * strlen(argv[i]) + 3;
    char *line = malloc(size), *at = line;
    for (int i = 0; line && i < argc; i++) {
        const bool bare = argv[i][0] && !argv[i][strspn(argv[i], plain)];
        at += sprintf(at, "%s%s", i ? " " : "", bare ? argv[i] : "'");
        for (const char *p = argv[i]; *p && !bare; p++)
            at += sprintf(at, *p == '\'' ? "'\\''" : "%c", *p);
        at += sprintf(at, "%s", bare ? "" : "'");
    }
    return line;
}
