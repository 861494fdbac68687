/* One table defines the command line: the options for getopt_long, the text of --help, and which
 * options exclude each other. Wrong usage gives a message of one line. */
#include "app/command.h"

#include "store/version.h"

#include <getopt.h>
#include <stdlib.h>
#include <string.h>

enum { LONG = 256 }; /* + enum mill_option: getopt_long's code of a long option */

static const struct row {
    const char *name;
    char letter;       /* '\0': none */
    const char *value; /* name of the value in --help; NULL: no value */
    const char *help;  /* starts at column 23 */
} rows[MILL_OPTIONS] = {
    [MILL_OUTPUT] = {"output", 'o', "FILE",
                     "where results go; default: the deck's name with .h5, in this folder"},
    [MILL_SET] = {"set", 's', "SECTION.KEY=VALUE",
                  "\n                       override a value of the deck: -s 'rotor.speed=800 rpm';"
                  "\n                       may be repeated"},
    [MILL_SOFT] = {"soft", 0, NULL,
                   "compute with soft spheres, as a check: springs and dashpots in\n"
                   "                       time steps; as -s run.spheres=soft (docs/soft.md)"},
    [MILL_CHECK] =
        {"check", 'c', NULL,
         "do not run; check the deck, print it with all defaults, forecast\n"
         "                       the cost from a trial that takes 2 s of processor time"},
    [MILL_RESUME] = {"resume", 'r', NULL,
                     "continue an interrupted run of this output file, to the\n"
                     "                       same results as if it had never been interrupted"},
    [MILL_FORCE] = {"force", 'f', NULL, "overwrite an existing output file"},
    [MILL_JSON] = {"json", 'j', NULL, "print the summary as one JSON object"},
    [MILL_QUIET] = {"quiet", 'q', NULL, "no progress, no forecast"},
    [MILL_PROGRESS] = {"progress", 0, "json",
                       "tell progress as JSON on standard error, an object a line,\n"
                       "                       twice a second (docs/running.md)"},
    [MILL_EXPORT_START] =
        {"export-start", 0, "FILE",
         "\n                       write the balls as they start to FILE, which balls.start reads\n"
         "                       back to the same bits; do not run"},
    [MILL_CONTOUR] = {"contour", 0, NULL,
                      "print the contours of drum and bodies, a row 'x y bulge' for\n"
                      "                       each corner, as drum.file reads it; do not run"},
    [MILL_VALUE] =
        {"value", 0, "SECTION.KEY=VALUE",
         "\n                       print how millsim reads a value: key, kind, SI value, SI"
         "\n                       unit, meaning, allowed words, with tabs between; needs"
         "\n                       no deck; may be repeated"},
    [MILL_DIGEST] =
        {"digest", 0, NULL,
         "write the output file of a run that another program made of this\n"
         "                       deck; standard input gives the run: docs/file-format.md"},
    [MILL_EXAMPLES] = {"examples", 0, "DIR",
                       "copy the example decks into the folder DIR; do not run"},
    [MILL_PARANOID] = {"paranoid", 0, NULL, "check every step against brute force (slow)"},
    [MILL_HELP] = {"help", 'h', NULL, "print this and end"},
    [MILL_VERSION_LINE] = {"version", 'V', NULL, "print the version and end"},
};

static const char told[] = "--value needs no deck and runs nothing";
static const char copied[] = "--examples only copies decks";

static const struct {
    enum mill_option one;
    const char *others; /* their names; no name may be a part of another */
    const char *why;
} exclusions[] = {
    {MILL_RESUME, "force", "the first continues the run, the second starts it again"},
    {MILL_PROGRESS, "quiet check", "--quiet and --check show no progress"},
    {MILL_EXPORT_START, "output check resume json progress paranoid",
     "--export-start only writes the start and runs nothing"},
    {MILL_CONTOUR, "output check resume json progress paranoid export-start digest value examples",
     "--contour only prints and runs nothing"},
    {MILL_SOFT, "digest value examples paranoid", "soft spheres have time steps and no events"},
    {MILL_DIGEST, "check resume json progress export-start paranoid",
     "--digest runs nothing; another program has run the deck"},
    {MILL_VALUE, "output check resume json progress paranoid set force export-start digest", told},
    {MILL_EXAMPLES,
     "output check resume json progress paranoid set force export-start digest value quiet",
     copied},
};

bool mill_command_answer(const struct mill_command *a, FILE *out)
{
    if (!a->given[MILL_HELP]) {
        fputs(a->given[MILL_VERSION_LINE] ? mill_version_line : "", out);
        return a->given[MILL_VERSION_LINE];
    }
    fputs("Usage: millsim [options] DECK\n"
          "Simulates the balls of a ball mill, contact by contact. The sources have a deck for\n"
          "each kind of mill in input/: simoloyer.ini, planetary.ini, mixer.ini, attritor.ini\n"
          "and more. --examples DIR copies them.\n\n",
          out);
    for (const struct row *row = rows; row < rows + MILL_OPTIONS; row++) {
        const char letter[] = {'-', row->letter, ',', '\0'};
        char head[64];
        snprintf(head, sizeof head, "  %3s --%s %s", row->letter ? letter : "", row->name,
                 row->value ? row->value : "");
        fprintf(out, "%-23s%s\n", head, row->help);
    }
    fputs("\n"
          "Exit status: 0 done; 1 the run failed; 2 wrong usage or a wrong deck; 128+N stopped by\n"
          "signal N (INT, TERM, HUP or XCPU), with everything up to then in the output file, for\n"
          "--resume.\n",
          out);
    return true;
}

/* Describes as a usage error what getopt_long refused. */
static enum mill_status refuse_option(int result, char *const *argv, struct mill_error *error)
{
    const char *word = argv[optind - 1];
    const char letter[] = {'-', (char)optopt, '\0'};
    const bool is_long = strncmp(word, "--", 2) == 0, lacks = result == ':';
    const bool excess = !lacks && is_long && optopt;
    const char *name = is_long ? word : letter;
    const char *fault = lacks ? " needs a value" : excess ? " takes no value" : "";
    return mill_error_set(error, MILL_BAD_DECK, "%soption '%.*s'%s; see millsim --help",
                          *fault ? "" : "unknown ", (int)strcspn(name, excess ? "=" : ""), name,
                          fault);
}

/* Reads options until there are no more, or until one ends the program. */
static enum mill_status read_options(int argc, char **argv, struct mill_command *a,
                                     struct mill_error *error)
{
    struct option names[MILL_OPTIONS + 1] = {{0}};
    char letters[2 * MILL_OPTIONS + 2] = ":", *end = letters + 1;
    for (int k = 0; k < MILL_OPTIONS; k++) {
        names[k] = (struct option){rows[k].name, rows[k].value != NULL, NULL, LONG + k};
        if (rows[k].letter)
            end += sprintf(end, "%c%s", rows[k].letter, rows[k].value ? ":" : "");
    }
    int option;
    opterr = 0;
    while (!a->given[MILL_HELP] && !a->given[MILL_VERSION_LINE] &&
           (option = getopt_long(argc, argv, letters, names, NULL)) != -1) {
        if (option == '?' || option == ':')
            return refuse_option(option, argv, error);
        int k = 0;
        while (option != LONG + k && option != rows[k].letter)
            k++;
        a->given[k] = optarg ? optarg : "";
        if (k == MILL_SET || k == MILL_SOFT)
            a->set[a->sets++] = optarg ? optarg : "run.spheres=soft";
        if (k == MILL_VALUE)
            a->value[a->values++] = optarg;
    }
    return MILL_OK;
}

/* `more`: the words that are not options; NULL after the last */
static enum mill_status check(struct mill_command *a, char *const *more, struct mill_error *error)
{
    for (int k = 0; k < MILL_OPTIONS; k++) {
        const bool folder = rows[k].value && !strcmp(rows[k].value, "DIR");
        if ((folder || (rows[k].value && !strcmp(rows[k].value, "FILE"))) && a->given[k] &&
            !a->given[k][0])
            return mill_error_set(error, MILL_BAD_DECK, "option '--%s' needs the name of a %s",
                                  rows[k].name, folder ? "folder" : "file");
    }
    if (a->given[MILL_PROGRESS] && strcmp(a->given[MILL_PROGRESS], "json") != 0)
        return mill_error_set(error, MILL_BAD_DECK, "option '--progress' takes json, got '%.200s'",
                              a->given[MILL_PROGRESS]);
    for (size_t i = 0; i < sizeof exclusions / sizeof *exclusions; i++)
        for (int k = 0; a->given[exclusions[i].one] && k < MILL_OPTIONS; k++)
            if (a->given[k] && strstr(exclusions[i].others, rows[k].name))
                return mill_error_set(
                    error, MILL_BAD_DECK, "options '--%s' and '--%s' exclude each other: %s",
                    rows[exclusions[i].one].name, rows[k].name, exclusions[i].why);
    const bool deckless = a->values || a->given[MILL_EXAMPLES];
    if (deckless && more[0])
        return mill_error_set(
            error, MILL_BAD_DECK, "option '--%s' and '%.200s' exclude each other: %s",
            rows[a->values ? MILL_VALUE : MILL_EXAMPLES].name, more[0], a->values ? told : copied);
    if (!deckless && !more[0])
        return mill_error_set(error, MILL_BAD_DECK, "no deck given; see millsim --help");
    if (more[0] && more[1])
        return mill_error_set(error, MILL_BAD_DECK,
                              "one deck at a time, got '%s' and '%s'; see millsim --help", more[0],
                              more[1]);
    a->deck = more[0];
    return MILL_OK;
}

/* NULL: out of memory */
static char *quote(int argc, char **argv)
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

enum mill_status mill_command_read(int argc, char **argv, struct mill_command *a,
                                   struct mill_error *error)
{
    /* before getopt_long reorders the words */
    *a = (struct mill_command){.line = quote(argc, argv)};
    a->set = calloc(2 * (size_t)argc + 1, sizeof *a->set);
    if (!a->line || !a->set)
        return mill_error_set(error, MILL_FAILED, "out of memory");
    a->value = a->set + argc;
    enum mill_status status = read_options(argc, argv, a, error);
    if (status != MILL_OK || a->given[MILL_HELP] || a->given[MILL_VERSION_LINE])
        return status;
    status = check(a, argv + optind, error);
    if (status != MILL_OK || !a->deck)
        return status;
    const char *start = a->given[MILL_EXPORT_START];
    const char *given = start ? start : a->given[MILL_OUTPUT];
    const char *slash = strrchr(a->deck, '/'), *base = slash ? slash + 1 : a->deck;
    const char *dot = strrchr(base, '.');
    const size_t stem = dot && dot > base ? (size_t)(dot - base) : strlen(base);
    snprintf(a->output, sizeof a->output, "%.*s%s", (int)(given ? strlen(given) : stem),
             given ? given : base, given ? "" : ".h5");
    return MILL_OK;
}
