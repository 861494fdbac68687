"""The pages: links lead somewhere, lines are short, the README is, and the site's reference has every public name."""

import importlib.machinery
import importlib.util
import os
import re
import shlex
import subprocess
import sys

import pytest
from conftest import PROGRAM, ROOT

import milltools

PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))]


@pytest.fixture(scope="module")
def checker():
    """tools/check-links as a module."""
    loader = importlib.machinery.SourceFileLoader("check_links", str(ROOT / "tools/check-links"))
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader("check_links", loader))
    bytecode, sys.dont_write_bytecode = sys.dont_write_bytecode, True
    loader.exec_module(module)
    sys.dont_write_bytecode = bytecode
    return module


@pytest.mark.slow
def test_every_link_between_pages_leads_somewhere():
    done = subprocess.run([ROOT / "tools/check-links"], capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize(
    "link, fault",
    [
        ("[there](docs/there.md)", None),
        ("[there](docs/there.md#a-heading--twice)", None),
        ("[there](docs/there.md#a-heading--twice-1)", None),
        ("`[code](nowhere.md)`", None),
        ("[out](https://example.org/nowhere)", None),
        ("[gone](docs/gone.md)", "no such file"),
        ("[gone](docs/there.md#gone)", "no such heading"),
        ("[folder](docs)", "is a folder"),
        ("[up](../README.md)", "leads out of the repository"),
        ('<img src="docs/gone.png">', "no such file"),
        ("[![picture](docs/gone.png)](docs/there.md)", "no such file"),
    ],
)
def test_a_link_that_leads_nowhere_is_found(tmp_path, checker, link, fault):
    (tmp_path / "docs").mkdir()
    (tmp_path / "docs/there.md").write_text(
        "# There\n\n## A `heading` (!) twice\n\n## A heading & twice\n\n## A heading & twice\n"
    )
    (tmp_path / "README.md").write_text(f"# Page\n\n{link}\n")
    found = list(checker.faults(tmp_path))
    assert len(found) == (fault is not None)
    assert not fault or (fault in found[0] and found[0].startswith("README.md:3: "))


def test_the_site_is_made_of_what_the_readme_leads_to(tmp_path, checker):
    (tmp_path / "docs").mkdir()
    (tmp_path / "README.md").write_text("[first](docs/first.md)\n")
    (tmp_path / "docs/first.md").write_text("[deck](../input/a.ini)\n")
    (tmp_path / "input").mkdir()
    for name in ("input/a.ini", "input/b.ini"):
        (tmp_path / name).write_text("")
    checker.stage(tmp_path, tmp_path / "site")
    staged = {str(path.relative_to(tmp_path / "site")) for path in (tmp_path / "site").rglob("*") if path.is_file()}
    assert staged == {"README.md", "docs/first.md", "input/a.ini"}


def test_the_readme_fits_on_two_screens():
    assert len((ROOT / "README.md").read_text().splitlines()) <= 120


def test_no_page_or_message_tells_to_install_a_package_that_is_on_no_index():
    """Whoever registers the name there would serve code to every reader."""
    names = ("CHANGELOG.md", "packaging/*/*", "docs/*.ipynb", "tools/milltools/**/*.py", "tools/wheel")
    for path in [*PAGES, *(path for name in names for path in ROOT.glob(name))]:
        told = re.search(
            r"(?<!-m )\b(pipx?|uv tool|uv pip) install\b[^\n`&')]*?['\"]?(?<![\w./-])millsim(?!-)", path.read_text()
        )
        assert not told, f"{path}: {told[0]}"


@pytest.mark.parametrize("path", PAGES, ids=lambda path: path.name)
def test_lines_of_prose_are_short_and_lists_begin_after_a_blank_line(path, checker):
    """Python-Markdown, which makes the site, takes a list or table right below a paragraph for text."""
    text = checker.without_code(path.read_text())
    lines = ["", *text.splitlines()]
    long = [line for line in lines if len(line) > 120 and not re.match(r"\||!\[|\[!\[|<img|    ", line)]
    assert not long
    for before, line in zip(lines, lines[1:], strict=False):
        begins = re.match(r"[-*] |\d+\. |\|", line)
        goes_on = not before or re.match(r"\s|[-*] |\d+\. |\|", before)
        assert not begins or goes_on, line


def test_the_reference_has_every_public_name():
    names = re.findall(r"^::: milltools\.(\w+)$", (ROOT / "docs/api.md").read_text(), re.MULTILINE)
    assert sorted(names) == sorted(milltools.__all__)


def test_lock_files_agree():
    """The packages of the tests and of the site share a .venv with those of ./mill."""
    pinned = {}
    for name in ("tools/requirements.lock", "tests/requirements.lock"):
        for package, version in re.findall(r"^([\w.-]+)==(\S+)$", (ROOT / name).read_text(), re.MULTILINE):
            assert pinned.setdefault(package.lower(), version) == version, f"{name}: {package}"


def test_what_the_page_of_soft_spheres_measures_its_costs_with_is_accepted():
    text = " ".join((ROOT / "docs/soft.md").read_text().split())
    (words,) = re.findall(r"`millsim (--check --soft [^`]*input/[a-z]+\.ini)`", text)
    words = [*shlex.split(words), "-s", "run.time=1 ms"]  # this shortens the trial
    done = subprocess.run([PROGRAM, *words], capture_output=True, text=True, cwd=ROOT)
    assert done.returncode == 0, done.stderr


def test_every_unit_on_the_pages_is_known_without_the_database_that_the_studio_lacks():
    value = re.compile(r"""\b([a-z_]\w*(?:\.\w+)+ ?= ?(?:[-+\d.e]+ )+([^\s'"`,;:|)]+))""")
    orders = {unit: order for page in PAGES for order, unit in value.findall(page.read_text())}
    assert {"mm", "rpm", "GPa"} <= orders.keys()
    none = {**os.environ, "UDUNITS2_XML_PATH": "/none"}
    told = [
        subprocess.run([PROGRAM, "--value", one], env=none, capture_output=True, text=True) for one in orders.values()
    ]
    assert not [one.stderr for one in told if "database" in one.stderr]
