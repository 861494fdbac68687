"""docs/tutorial.md: every command of it runs, in order, on smaller mills and for shorter times, and leaves what the
text goes on with."""

import os
import re
import shutil
import subprocess
import sys

import pages
import pytest
from conftest import PROGRAM, ROOT, some

from milltools.__main__ import COMMANDS

PAGE = ROOT / "docs/tutorial.md"
DECKS = {  # what makes them short
    "simoloyer.ini": {"time = 0.3 s": "time = 0.2 s", "count = 4000": "count = 300"},
    "wavy.ini": {"time = 2 s": "time = 0.1 s", "count = 4000": "count = 300", "precision = 1 %": "precision = 50 %"},
}  # fmt: skip
BLOCKS = {
    "run.precision=2 %": "run.precision=50 %",
    "precision = 2 %": "precision = 50 %",
    "replicates = 2": "replicates = 1",
    "600, 800, 1000, 1200 rpm": "800, 1000 rpm",
    "0, 1.5, 2.5, 4 mm": "0, 2.5 mm",
    "--size 720p": "--size 320x180 --quality draft",
}
MADE = {  # by the block of this number
    0: ["reference.h5", "reference.html"],
    1: ["mill.png"],
    2: ["smooth.h5", "wavy.h5", "compared.html"],
    3: ["walls.study", "walls.parquet", "walls.html"],
    4: ["choice.h5"],
}
# in place of make: what `make run` runs once all is built
MAKE = """#!/bin/sh
test "$*" = run || exit 2
{make} --no-print-directory -C {root} -n run | grep -E '^\\./(millsim|mill) ' > commands
exec sh -e ./commands
"""
MILL = '#!/bin/sh\nexec {python} -m milltools "$@"\n'


def shortened(text, words):
    for long, short in words.items():
        assert long in text, f"'{long}' is no longer there: what makes the tutorial short now?"
        text = text.replace(long, short)
    return text


def program(path, text):
    path.parent.mkdir(exist_ok=True)
    path.write_text(text)
    path.chmod(0o755)


@pytest.fixture(scope="module")
def checkout(tmp_path_factory):
    """A folder like the repository's after `make`, whose decks are of small mills."""
    folder = tmp_path_factory.mktemp("tutorial")
    (folder / "input").mkdir()
    for name, words in DECKS.items():
        text = (ROOT / "input" / name).read_text()
        # keys stand in columns
        (folder / "input" / name).write_text(shortened(re.sub(r" +=", " =", text), words))
    (folder / "millsim").symlink_to(PROGRAM)
    program(folder / "mill", MILL.format(python=sys.executable))
    program(folder / "bin/make", MAKE.format(make=shutil.which("make"), root=ROOT))
    return folder


@pytest.fixture(scope="module")
def blocks():
    code = [block.text for block in pages.blocks(PAGE, "sh")]
    shortened("\n".join(code), BLOCKS)
    for long, short in BLOCKS.items():
        code = [block.replace(long, short) for block in code]
    return code


@pytest.fixture(scope="module")
def told(checkout, blocks):
    """told(number): what the blocks printed, up to this one. They run one after the other, each when the first test
    asks for it, until one fails."""
    environment = {
        **os.environ,
        "PATH": f"{checkout / 'bin'}:{os.environ['PATH']}",
        "PYTHONPATH": str(ROOT / "tools"),
        "MILLSIM": str(PROGRAM),
        "OMP_NUM_THREADS": "1",
    }
    found = []

    def until(number):
        for block in blocks[len(found) : number + 1]:
            if any(done.returncode for done in found):
                break
            done = subprocess.run(
                ["sh", "-e", "-c", block],
                cwd=checkout,
                env=environment,
                stdin=subprocess.DEVNULL,
                capture_output=True,
                text=True,
            )
            found.append(done)
        return found[: number + 1]

    return until


def check_what_it_says_is_printed(printed, _):
    """Not the numbers, which are of the whole mills, but every line of a table that is shown."""
    printed = "".join(done.stdout for done in printed)
    shown = re.findall(
        r"^    (rotor power|ball-ball above 1 m/s|median v_n above the floor|kind) ", PAGE.read_text(), re.M
    )
    assert set(shown) == {
        "rotor power",
        "ball-ball above 1 m/s",
        "median v_n above the floor",
        "kind",
    }
    for words in shown:
        assert re.search(rf"^{re.escape(words)} ", printed, re.M)
    assert "Pareto front" in printed


def check_the_headings_that_it_names(_, checkout):
    named = re.findall(r"\*([A-Z][a-z ]+)\*", PAGE.read_text())
    page = (checkout / "reference.html").read_text()
    assert len(named) == 3
    for heading in named:
        assert re.search(rf"<h2[^>]*>\s*{heading}\s*</h2>", page)


MORE = {0: check_the_headings_that_it_names, max(MADE): check_what_it_says_is_printed}


@pytest.mark.slow
@pytest.mark.parametrize("number", some(MADE, len(MADE)))
def test_every_command_runs_and_leaves_what_the_text_goes_on_with(told, checkout, blocks, number):
    assert len(blocks) == len(MADE)
    printed = told(number)
    assert len(printed) > number, "a block before this one failed"
    assert printed[number].returncode == 0, printed[number].stderr
    for name in MADE[number]:
        assert (checkout / name).stat().st_size > 100
    if number in MORE:
        MORE[number](printed, checkout)


def test_it_uses_no_command_that_is_not_there():
    used = set(re.findall(r"\./mill (\w+)", PAGE.read_text()))
    assert used <= {command.name for command in COMMANDS}


def test_its_links_lead_somewhere():
    text = PAGE.read_text()
    heads = {
        re.sub(r"[^\w -]", "", head).strip().lower().replace(" ", "-") for head in re.findall(r"^#+ (.*)$", text, re.M)
    }
    for target in re.findall(r"\]\(([^)]+)\)", text):
        path, _, anchor = target.partition("#")
        assert not path or (PAGE.parent / path).resolve().exists(), target
        assert path or anchor in heads, target
