"""Do the tests see a wrong number? `make mutants` breaks one line of a source that decides numbers, in a copy of the
repository, and runs the nearest tests until one fails: the mutant is killed. It draws MUTANTS of them in C and as many
in Python, from SEED; a change of other lines does not change the draw. What does not compile, or compiles to the same
code, is drawn again. Those in C run under sanitizers, which see what leaves an array.

Ends with 1 if less than 90 % are killed in C or in Python, or if a mutant survives that tests/survivors.md does not
explain. There, `file` heads a list whose items are the line, the line of the mutant, and a reason.
"""

import argparse
import collections
import concurrent.futures
import contextlib
import functools
import hashlib
import importlib
import itertools
import multiprocessing
import os
import pathlib
import re
import resource
import select
import shutil
import signal
import sys
import tempfile
import types

ROOT = pathlib.Path(__file__).resolve().parents[1]
LEAST = 90  # percent that are killed in either half
MARKS = "not thorough and not browser and not slurm and not dem and not render"
# The sources by folder, and the tests in C and files of pytest that are nearest to them. "+": also what is slow there
NEAREST = {
    "src/engine/ sim_account": "sim sim_slabs cli/test_statistics planetary",
    "src/observe/ energies spectrum strikes": "spectrum strikes tally cli/test_statistics cli/test_precision "
    "tools/test_dose",
    "src/observe/ precision tally tally_results": "precision tally notes cli/test_statistics "
    "cli/test_precision+ cli/test_resume cli/test_pinch tools/test_dose planetary",
    "src/observe/ tally_results_tell": "tally cli/test_statistics cli/test_precision cli/test_output cli/test_digest "
    "cli/test_pinch",
    "src/observe/ wear": "wear tally tools/test_dose",
    "tools/milltools/compare/ agreement finding load map_deviation rows": "tools/test_compare_errors "
    "tools/test_compare+ tools/test_moving_mills+",
    "tools/milltools/dose/ dose laws wear": "tools/test_dose+ tools/test_figures",
    "tools/milltools/power/ drum models": "tools/test_power",
    "tools/milltools/read/ expression histogram results sums": "tools/test_expression tools/test_dose+ tools/test_api "
    "tools/test_compare+ tools/test_figures",
    "tools/milltools/study/search/ acquisition gp sensitivity space": "tools/test_gp+ tools/test_acquisition+ "
    "tools/test_sensitivity+ tools/test_study_questions",
}
TESTS = {
    f"{folder}{name}{'.c' if folder.startswith('src') else '.py'}": tests.split()
    for (folder, *names), tests in ((row.split(), tests) for row, tests in NEAREST.items())
    for name in names
}
OTHER = {
    "<": ("<=", ">"), "<=": ("<", ">"), ">": (">=", "<"), ">=": (">", "<"), "==": ("!=",), "!=": ("==",),
    "+": ("-",), "-": ("+",), "*": ("/",), "/": ("*",), "**": ("*",), "//": ("/",), "&&": ("||",), "||": ("&&",),
    "and": ("or",), "or": ("and",), "in": ("not in",), "not in": ("in",), "is": ("is not",), "is not": ("is",),
    "min": ("max",), "max": ("min",), "minimum": ("maximum",), "maximum": ("minimum",),
    "fmin": ("fmax",), "fmax": ("fmin",), "True": ("False",), "False": ("True",), "0": ("1",), "1": ("0", "2"),
}  # fmt: skip
OPERATOR = r"(?<=\s)([<>]=?|[=!]=|&&|\|\||(?<!\" )(?:[-+*/]|//)(?! \")|and|or|in|not in|is|is not)(?==?\s)"
OPERATOR += r"|(?<=[\w)\]])\*\*|\b(f?min|f?max|minimum|maximum)(?=\()"
NUMBER = r"(?<![\w.])(0x[\da-f.]+p[-+]?\d+|\d+\.?\d*(?:e[-+]?\d+)?|True|False)(?![\w.])"
LEFT_OUT = r"\b(?:np\.|math\.)?(?:sqrt|fabs|abs|round|floor|ceil)(?=\()|!(?=[\w(])|\bnot (?!in\b)"
# what decides no number: texts, comments, errors, the preprocessor, memory, arrays' sizes, alignment
UNSEEN = {
    ".c": r'"(?:\\.|[^"\\\n])*"|/\*[\s\S]*?\*/|^#(?:.*\\\n)*.*$|\b(?:assert|mill_error_set|mill_memory_get|\w*alloc|'
    r"\w*free)\([^;]*;|good = good && .*|^ *(?:static |const )*(?:struct |enum )?\w+ (?:\**\w+(?:\[[^]=]*\])+(?:, )?)+"
    r"(?= = |;|\w)",
    ".py": r'"""[\s\S]*?"""|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])*\'|#.*|^ *(?:@|def ).*|\braise .*|\bleft=\(.*?\)',
}
MEMORY = 8 << 30  # [bytes] of a process
LARGEST = 1 << 32  # [bytes] of a file
ROUNDING = 1e-9  # a number as small as this only guards against rounding: another one would do as well
Mutant = collections.namedtuple("Mutant", "path line before after start end new")  # lines without indentation


def numbers(word):
    """Other numbers in place of one."""
    if word in OTHER or word.isdecimal():
        return OTHER.get(word) or (str(int(word) + 1),)
    value = float.fromhex(word) if word.startswith("0x") else float(word)
    return ("1.0",) if value == 0 else (f"{1.1 * value:.8g}",) if value > ROUNDING else ()


def close(code, at, stop):
    """Where the bracket closes that is open at a place, or where `stop` is found outside of other brackets."""
    depth = 0
    for m in re.compile(rf"[(\[{{]|[)\]}}]|{stop}", re.M).finditer(code, at):
        depth += 1 if m[0] in "([{" else -1 if m[0] in ")]}" else 0
        if depth < 0 or (not depth and m[0] not in ")]}"):
            return m.start()
    return at


def edits(text, ending):
    """(start, end, new text) of all that can be broken in a source."""
    unseen = lambda found: re.sub(r"\S", '"' if found[0][0] in "\"'" else " ", found[0])  # noqa: E731
    code = re.sub(UNSEEN[ending], unseen, text, flags=re.M)
    c = ending == ".c"
    for m in re.finditer(OPERATOR, code):
        yield from ((*m.span(), new) for new in OTHER[m[0]])
    for m in re.finditer(NUMBER, code):
        yield from ((*m.span(), new) for new in numbers(m[0]))
    for m in re.finditer(LEFT_OUT, code):
        yield *m.span(), ""
    for m in re.finditer(r"\b(?:if|while) \(" if c else r"\b(?:if|elif|while) ", code):
        end = close(code, m.end(), r"\Z" if c else r":$| else ")
        yield m.end(), end, f"!({text[m.end() : end]})" if c else f"not ({text[m.end() : end]})"
    for m in re.finditer(r"(?<=\w\()([^\s,()=*]+), ([^\s,()=*]+)(?=[,)])", code):
        yield *m.span(), f"{text[slice(*m.span(2))]}, {text[slice(*m.span(1))]}"
    for m in re.finditer(r"(?<=\[)[^][\d][^][]*(?=\])", code if c else ""):
        yield from ((*m.span(), f"{m[0]} {sign} 1") for sign in "+-")
    for m in re.finditer(r"^ +(?!return|sizeof)([*(]*(\w[^\s=(]*)(?: ([-+*/|^]?)= .*|\(.*\)|\+\+|--));?$", code, re.M):
        inside = code[max(code.rfind("\ndef ", 0, m.start()), code.rfind("    def ", 0, m.start()), 0) : m.start()]
        if c or m[3] != "" or not m[2].isidentifier() or re.search(rf"\b{m[2]}\b", inside):  # the name has a value
            yield *m.span(1), "" if c else "pass"


def mutants(path, seed):
    """All mutants of a source by their places in the draw, which other lines do not change."""
    text, seen = (ROOT / path).read_text(), collections.Counter()
    for start, end, new in sorted({*edits(text, pathlib.Path(path).suffix)}):
        first, last = text.rfind("\n", 0, start) + 1, text.find("\n", end)
        lines = text[first:last], text[first:start] + new + text[end:last]
        before, after = (line.split("\n")[0].strip() for line in lines)
        seen[before, after] += 1
        place = hashlib.sha256(repr((seed, path, before, after, seen[before, after])).encode()).digest()
        yield place, Mutant(path, text.count("\n", 0, start) + 1, before, after, start, end, new)


class Bench:
    """A copy of the repository, where tests run in forks of this process, which has loaded the libraries."""

    def __init__(self, folder):
        self.tree = pathlib.Path(tempfile.mkdtemp(dir=folder))
        unused = shutil.ignore_patterns(".git", ".venv", "__pycache__", "build")
        shutil.copytree(ROOT, self.tree, dirs_exist_ok=True, symlinks=True, ignore=unused)
        if (ROOT / "build/asan").exists():  # sources in Python do without
            shutil.copytree(ROOT / "build/asan", self.tree / "build/asan")
        (self.tree / "build").mkdir(exist_ok=True)
        os.environ.update(
            TMPDIR=str(self.tree / "build"), CK_EXCLUDE_TAGS="slow", ASAN_OPTIONS=f"hard_rss_limit_mb={MEMORY >> 20}"
        )
        tempfile.tempdir = None  # from now on in the copy, which is removed
        sys.path.insert(0, str(self.tree / "tests"))
        warm = importlib.import_module("warm")
        for name in (*warm.LIBRARIES, "pytest"):
            with contextlib.suppress(ImportError):
                importlib.import_module(name)
        self.mill = warm.Warm.open(self.tree / "tools")
        warm.Warm.open = lambda path: self.mill  # of the forks as well
        self.log, self.times = self.tree / "build/log", itertools.count(10**9)

    def run(self, act, most=600.0):
        """(status, CPU time [s]) of act() in a fork; it ends after that much CPU time, or some more time."""
        pid = os.fork()
        if not pid:
            with contextlib.suppress(BaseException):
                os.setsid()
                os.chdir(self.tree)
                resource.setrlimit(resource.RLIMIT_CPU, (int(most), int(most)))
                resource.setrlimit(resource.RLIMIT_FSIZE, (LARGEST, LARGEST))  # a loop that writes fills no disk
                os.dup2(os.open(self.log, os.O_WRONLY | os.O_CREAT | os.O_TRUNC), 1)
                os.dup2(1, 2)
                os._exit(act())
            os._exit(99)
        with os.fdopen(os.pidfd_open(pid)) as file:
            select.select([file], [], [], 60 + 3 * most)
        with contextlib.suppress(ProcessLookupError):
            os.killpg(pid, signal.SIGKILL)
        _, status, used = os.wait4(pid, 0)
        left = f"/proc/{self.mill.pid}/task/{self.mill.pid}/children"
        for child in pathlib.Path(left).read_text().split():  # commands of `mill` that a test has not waited for
            os.kill(int(child), signal.SIGKILL)
        return os.waitstatus_to_exitcode(status), used.ru_utime + used.ru_stime

    def make(self, mode, target):
        words = ["make", "-s", f"MODE={mode}", f"build/{mode}/{target}"]
        return self.run(lambda: os.execvp(words[0], words))[0] == 0

    def pytest(self, file, marks, in_c):
        if in_c:
            os.environ["MILLSIM"] = str(self.tree / "build/asan/millsim")
        else:  # sanitizers reserve more
            resource.setrlimit(resource.RLIMIT_DATA, (MEMORY, MEMORY))
        words = ["-qx", "-p", "no:cacheprovider", "--basetemp", "build/pytest", f"tests/{file}.py", "-m", marks]
        status = importlib.import_module("pytest").main(words)
        sys.stdout.flush()
        return status % 5  # 5: no test has these marks

    def test(self, name, in_c, most=600.0):
        """(what fails, or "", CPU time [s]) of a test of a source in C or in Python."""
        file, _, slow = name.partition(" ")
        target = "millsim" if "/" in file else f"tests/unit/test_{file}"
        if in_c and not self.make("asan", target):
            return "make", 0.0
        if "/" in file:
            marks = f"{slow or 'not slow'} and {MARKS}{' and not long' * in_c}"
            status, took = self.run(lambda: self.pytest(file, marks, in_c), most)
        else:
            status, took = self.run(lambda: os.execv(f"build/asan/{target}", [target]), most)
        if "/" in file and status in (3, 4):  # of pytest itself
            raise RuntimeError(self.log.read_text())
        said = re.search(r"^(?:FAILED|ERROR) tests/(\S+)|:[EF]:\w+:(\w+):", self.log.read_text(errors="replace"), re.M)
        return (f"{name}: {(said[1] or said[2]) if said else status}" if status else ""), took

    def code(self, path):
        """What a source compiles to, without places of lines; None if it does not compile."""
        if path.endswith(".c"):
            made = path.removesuffix("c") + "o"
            return (self.tree / "build/mutants" / made).read_bytes() if self.make("mutants", made) else None
        with contextlib.suppress(SyntaxError):
            return parts(compile((self.tree / path).read_text(), path, "exec"))

    def write(self, path, text):
        (self.tree / path).write_text(text)
        if path.endswith(".py"):  # Python would take sources of one time and size for the same
            os.utime(self.tree / path, (next(self.times),) * 2)

    def attempt(self, mutant, most):
        """None: the mutant does not compile, or is the same program. Else what kills it, or ""."""
        path = mutant.path
        text, code = (self.tree / path).read_text(), self.code(path)
        self.write(path, text[: mutant.start] + mutant.new + text[mutant.end :])
        try:
            if self.code(path) in (None, code):
                return None
            tests = ((name, path.endswith(".c")) for name in in_order(path))
            return next(filter(None, (self.test(*one, most[one])[0] for one in tests)), "")
        finally:
            self.write(path, text)


def parts(code):
    inner = [parts(one) if isinstance(one, types.CodeType) else repr(one) for one in code.co_consts]
    return code.co_code, code.co_names, code.co_varnames, code.co_freevars, inner


def in_order(path):
    """The tests of a source: first those that are quick."""
    return [one.strip("+") for one in TESTS[path]] + [f"{one[:-1]} slow" for one in TESTS[path] if one.endswith("+")]


bench = functools.cache(Bench)  # one in each process


def most_of(folder, test):
    """Limit of CPU time [s] for a test, from what it takes without a mutant."""
    failed, took = bench(folder).test(*test)
    if failed:
        raise RuntimeError(f"without a mutant: {failed}\n{bench(folder).log.read_text()}")
    return 10 + 5 * took


def attempt(folder, most, mutant):
    return bench(folder).attempt(mutant, most)


def reasons():
    """(path, line, line of the mutant) of what tests/survivors.md explains."""
    found, path = set(), None
    for line in (ROOT / "tests/survivors.md").read_text().splitlines():
        if head := re.fullmatch(r"## `(\S+)`", line):
            path = head[1]
        elif item := re.match(r"- `(.+?)` -> `(.*?)`:(?: \S|$)", line):
            found.add((path, *item.groups()))
    return found


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sources", nargs="*", default=[*TESTS], help="sources to break")
    parser.add_argument("--count", type=int, default=200, help="mutants in C, and in Python")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    asked = parser.parse_args()
    if unknown := [path for path in asked.sources if path not in TESTS]:
        parser.error(f"{unknown[0]}: not one of {', '.join(TESTS)}")
    (ROOT / "build").mkdir(exist_ok=True)
    known, table = reasons(), collections.defaultdict(collections.Counter)
    with (
        tempfile.TemporaryDirectory(prefix="mutants-") as folder,
        concurrent.futures.ProcessPoolExecutor(asked.jobs, multiprocessing.get_context("fork")) as pool,
        open(ROOT / "build/mutants.txt", "w") as log,
    ):
        all_ = [*dict.fromkeys((name, path.endswith(".c")) for path in asked.sources for name in in_order(path))]
        most = dict(zip(all_, pool.map(functools.partial(most_of, folder), all_)))
        for half in (".c", ".py"):
            paths = [path for path in asked.sources if path.endswith(half)]
            drawn = [one for _, one in sorted(itertools.chain.from_iterable(mutants(p, asked.seed) for p in paths))]
            found = pool.map(functools.partial(attempt, folder, most), drawn)
            others = ((mutant, killer) for mutant, killer in zip(drawn, found) if killer is not None)
            for mutant, killer in itertools.islice(others, asked.count):
                what = mutant.path, mutant.before, mutant.after
                for counts in (table[mutant.path], table[half]):
                    counts.update(["drawn", "killed" if killer else "explained" if what in known else "open"])
                print(f"{mutant.path}:{mutant.line}", *what[1:], killer, sep="\t", file=log, flush=True)
                if bool(killer) == (what in known):
                    said = "killed: drop it from tests/survivors.md" if killer else "survives"
                    print(f"{said}: {mutant.path}:{mutant.line}\n  - {mutant.before}\n  + {mutant.after}", flush=True)
                if table[half]["drawn"] % 20 == 0:
                    print(f"{half}: {table[half]['drawn']} drawn, {table[half]['killed']} killed", flush=True)
            found.close()  # the others are not tried
    for path, before, _ in sorted(known):
        if before not in map(str.strip, (ROOT / path).read_text().splitlines()):
            print(f"no longer there: drop it from tests/survivors.md: {path}: {before}")
    heads = ("drawn", "killed", "explained", "open")
    print(f"{'':45}", *(f"{head:>9}" for head in heads))
    for name, counts in table.items():
        print(f"{name:45}", *(f"{counts[head]:9}" for head in heads))
    halves = [table[half] for half in (".c", ".py") if half in table]
    return int(any(one["open"] or 100 * one["killed"] < LEAST * one["drawn"] for one in halves))


if __name__ == "__main__":
    sys.exit(main())
