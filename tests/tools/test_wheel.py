"""The wheel, and make install: what is in them and that it works where it was put."""

import email
import os
import re
import runpy
import shutil
import subprocess
import sys
import venv
import zipfile

import pytest
from conftest import PROGRAM, ROOT, run_mill
from packaging.licenses import canonicalize_license_expression
from packaging.version import Version

from milltools.__main__ import COMMANDS

DECKS = {path.name for path in (ROOT / "input").iterdir() if not path.name.startswith(".")}


def run(*words, status=0, **options):
    """What a program without any environment says."""
    done = subprocess.run([str(word) for word in words], env={}, capture_output=True, text=True, timeout=120, **options)
    assert done.returncode == status, done.stderr
    return done.stdout + done.stderr


def build(folder):
    words = [sys.executable, ROOT / "tools/wheel", "--program", PROGRAM, "--output", folder]
    subprocess.run(words, check=True, capture_output=True)
    (path,) = folder.glob("*.whl")
    return path


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    """A wheel of the program that is tested."""
    return build(tmp_path_factory.mktemp("wheel"))


@pytest.fixture(scope="module")
def place(wheel, tmp_path_factory):
    """A fresh environment with this wheel and nothing else."""
    folder = tmp_path_factory.mktemp("environment")
    venv.create(folder, with_pip=False, symlinks=True)
    words = [sys.executable, "-m", "pip", "--python", folder / "bin/python", "install", "-q", "--no-deps", "--no-index"]
    subprocess.run([*words, wheel], check=True, capture_output=True)
    return folder


def texts(wheel, pattern):
    """{name: bytes} of the files of a wheel whose names match."""
    with zipfile.ZipFile(wheel) as file:
        return {name: file.read(name) for name in file.namelist() if re.search(pattern, name)}


def test_what_takes_minutes_tells_how_far_it_is_and_why_it_failed(tmp_path, capfd):
    follow = runpy.run_path(str(ROOT / "tools/wheel"))["follow"]
    follow.__globals__["PAUSE"] = 0.05
    follow(tmp_path / "log", "sh", "-c", "echo one; sleep 0.6; echo two; sleep 0.6")
    assert capfd.readouterr().err == "  wheel   one\n  wheel   two\n"
    with pytest.raises(Exception, match=f"three; all of it: {tmp_path}/log"):
        follow(tmp_path / "log", "sh", "-c", "echo three; false")


def test_its_metadata_name_product_version_and_extras(wheel):
    (text,) = texts(wheel, r"\.dist-info/METADATA$").values()
    found = email.message_from_bytes(text)
    assert found["Name"] == "millsim"
    assert Version(found["Version"]) == Version((ROOT / "VERSION").read_text().strip())
    assert set(found.get_all("Provides-Extra")) >= {"study", "render", "export", "all"}
    assert 'optuna >=5.0; extra == "study"' in found.get_all("Requires-Dist")


def test_it_says_that_the_program_is_under_gpl_and_brings_every_licence(wheel):
    (text,) = texts(wheel, r"\.dist-info/METADATA$").values()
    found = email.message_from_bytes(text)
    expression = found["License-Expression"]
    assert expression == canonicalize_license_expression(expression)
    assert "GPL-3.0-or-later" in expression.split(" AND ")
    brought = {name.split("/licenses/")[1]: text for name, text in texts(wheel, "/licenses/").items()}
    assert brought.keys() == set(found.get_all("License-File"))
    assert b"GNU GENERAL PUBLIC LICENSE" in brought["GPL-3.txt"]
    assert brought.keys() >= {
        "LICENSE",
        "THIRD_PARTY.md",
        "HDF5.txt",
        "GSL.txt",
        "UDUNITS-2.txt",
        "zlib.txt",
    }
    # a program with a shared UDUNITS-2 does without this package
    assert ("expat.txt" in brought) == os.path.exists("/usr/share/doc/libexpat1-dev/copyright")


def test_a_program_that_loads_other_libraries_is_not_called_portable(wheel):
    said = subprocess.run(["readelf", "-d", PROGRAM], capture_output=True, text=True, check=True).stdout
    shared = re.findall(r"\(NEEDED\).*\[(\w+)", said)
    portable = {*shared} <= {"libc", "libm", "libdl", "libpthread", "ld"}
    assert ("manylinux" in wheel.name) == portable


@pytest.mark.slow
def test_the_same_sources_give_the_same_bytes(wheel, tmp_path):
    assert build(tmp_path).read_bytes() == wheel.read_bytes()


def test_both_commands_work_without_an_environment(place):
    version = run(PROGRAM, "--version").split()[1]
    assert run(place / "bin/millsim", "--version") == f"millsim {version}\n"
    assert run(place / "bin/mill", "--version", cwd="/") == f"mill {version}\n"
    assert (place / "bin/millsim").read_bytes()[:4] == b"\x7fELF"


def test_mill_finds_the_program_of_its_own_environment_before_the_path(place, tmp_path):
    (tmp_path / "millsim").write_text("#!/bin/sh\n")
    (tmp_path / "millsim").chmod(0o755)
    ask = "from milltools.base import engine; print(engine.program())"
    done = subprocess.run(
        [place / "bin/python", "-c", ask], env={"PATH": str(tmp_path)}, capture_output=True, text=True
    )
    assert done.stdout == f"{place / 'bin/millsim'}\n"


def test_the_decks_are_found_through_a_link(place, tmp_path):
    (tmp_path / "millsim").symlink_to(place / "bin/millsim")
    run(tmp_path / "millsim", "--examples", tmp_path / "decks")
    assert {path.name for path in (tmp_path / "decks").iterdir()} == DECKS


def test_the_units_are_those_beside_the_program_unless_told_otherwise(place, tmp_path):
    own = place / "share/millsim/udunits"
    unit = "<unit><def>2 m</def><name><singular>wheelfoot</singular></name></unit></unit-system>"
    shutil.copytree(own, tmp_path / "units")
    common = own / "udunits2-common.xml"
    plain = common.read_text()
    common.write_text(plain.replace("</unit-system>", unit))
    (tmp_path / "millsim").symlink_to(place / "bin/millsim")
    try:
        words = [tmp_path / "millsim", "--value", "balls.diameter=1 wheelfoot"]
        assert run(*words).split("\t")[2] == "2"
        told = {"UDUNITS2_XML_PATH": str(tmp_path / "units/udunits2.xml")}
        assert subprocess.run(words, env=told, capture_output=True).returncode == 2
    finally:
        common.write_text(plain)


def options(said):
    """The options that a --help lists: what begins its lines, not what stands in their text."""
    heads = re.findall(r"^ {2,6}(-.*?)(?:  |$)", said, re.M)
    return {name for head in heads for name in re.findall(r"(?<!\S)--?\w[\w-]*", head)}


def helps(place):
    """{program: options that its --help names}, of mill with every command."""
    said = {"millsim": options(run(place / "bin/millsim", "--help")), "mill": set()}
    for command in COMMANDS:
        said["mill"] |= options(run_mill(place, command.name, "--help").stdout)
    return said


@pytest.mark.slow
def test_man_page_and_completion_name_every_option_of_help(place):
    for program, wanted in helps(place).items():
        assert len(wanted) > 10
        page = (place / f"share/man/man1/{program}.1").read_text().replace("\\-", "-")
        assert wanted <= set(re.findall(r"\\fB(-[\w-]+)\\fR", page))
        for name in (f"bash-completion/completions/{program}", f"zsh/site-functions/_{program}"):
            assert wanted <= set(re.findall(r"(?<![\w-])--?\w[\w-]*", (place / "share" / name).read_text())), name


def test_a_man_page_has_no_faults(place):
    if not shutil.which("man"):
        pytest.skip("needs man")
    for program in ("millsim", "mill"):
        words = ["man", "-l", "--warnings", "-E", "UTF-8", place / f"share/man/man1/{program}.1"]
        done = subprocess.run(words, capture_output=True, text=True, env={**os.environ, "MANWIDTH": "80"})
        assert (done.returncode, done.stderr) == (0, "")
        assert f"{program} - " in done.stdout


@pytest.mark.parametrize("program, words, found", [
    ("millsim", ["--ex"], {"--export-start", "--examples"}),
    ("mill", ["comp"], {"compare"}),
    ("mill", ["compare", "--ht"], {"--html"}),
])  # fmt: skip
def test_bash_completes_options_and_commands(place, program, words, found):
    script = f"""
        source {place}/share/bash-completion/completions/{program}
        COMP_WORDS=({program} {" ".join(words)}); COMP_CWORD={len(words)}
        COMP_LINE="${{COMP_WORDS[*]}}"; COMP_POINT=${{#COMP_LINE}}
        function=$(complete -p {program} | sed 's/.*-F \\([^ ]*\\).*/\\1/')
        $function {program} "${{COMP_WORDS[-1]}}" "${{COMP_WORDS[-2]}}"
        printf '%s\\n' "${{COMPREPLY[@]}}"
    """
    done = subprocess.run(["bash", "--norc", "-c", script], capture_output=True, text=True)
    assert set(done.stdout.split()) == found, done.stderr


# ---- make install ----


def make(*words):
    command = ["make", "-C", ROOT, "--no-print-directory", "MODE=release", *words]
    return subprocess.run(command, capture_output=True, text=True)


@pytest.mark.thorough
def test_what_make_install_puts_there_works_and_make_uninstall_leaves_nothing(tmp_path):
    where = (f"DESTDIR={tmp_path}", "PREFIX=/there")
    there = tmp_path / "there"
    assert make("install", *where).returncode == 0
    assert run(there / "bin/mill", "--version", cwd="/").startswith("mill ")
    run(there / "bin/millsim", "--examples", tmp_path / "decks")
    (tmp_path / "link").symlink_to(there / "bin/mill")
    picture = tmp_path / "gas.png"
    run(
        there / "bin/millsim",
        "-q",
        "-o",
        tmp_path / "gas.h5",
        "-s",
        "run.sample_from=0 s",
        "-s",
        "run.time=20 ms",
        tmp_path / "decks/gas.ini",
    )
    run(tmp_path / "link", "plot", tmp_path / "gas.h5", picture, cwd=tmp_path)
    assert picture.stat().st_size > 10_000
    for name in ("man/man1/mill.1", "bash-completion/completions/millsim", "doc/millsim/LICENSE"):
        assert (there / "share" / name).stat().st_size > 500
    assert make("uninstall", *where).returncode == 0
    assert not there.exists()
    again = make("uninstall", *where)
    assert again.returncode != 0 and "make uninstall: nothing is installed in " in again.stderr


@pytest.mark.slow
def test_uninstalling_keeps_what_others_put_there(tmp_path):
    (tmp_path / "bin").mkdir()
    (tmp_path / "bin/other").touch()
    where = (f"PREFIX={tmp_path}", "MILL=no")
    for _ in range(2):  # the second time over the first
        assert make("install", *where).returncode == 0
    (tmp_path / "share/kept").touch()
    assert make("uninstall", *where).returncode == 0
    left = {str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*")}
    assert left == {"bin", "bin/other", "share", "share/kept"}


@pytest.mark.slow
def test_the_source_archive_knows_its_commit(tmp_path):
    if not (ROOT / ".git").exists():
        pytest.skip("not a checkout")
    archive = tmp_path / "source.tar"
    subprocess.run(["git", "-C", ROOT, "archive", "-o", archive, "HEAD"], check=True)
    (tmp_path / "source").mkdir()
    subprocess.run(["tar", "-xf", archive, "-C", tmp_path / "source"], check=True)
    head = subprocess.run(["git", "-C", ROOT, "rev-parse", "HEAD"], capture_output=True, text=True).stdout.strip()
    words = ["make", "-s", "-C", tmp_path / "source", "--no-print-directory", "tell-version"]
    version, commit = subprocess.run(words, capture_output=True, text=True).stdout.strip().split("+g")
    assert version == (tmp_path / "source/VERSION").read_text().strip()
    assert len(commit) >= 7 and head.startswith(commit)


@pytest.mark.slow
@pytest.mark.thorough
@pytest.mark.skipif(os.geteuid() != 0 or not shutil.which("debootstrap"), reason="needs root and debootstrap")
def test_a_wheel_serves_a_bare_machine(tmp_path):
    words = [sys.executable, ROOT / "tools/wheel", "--output", tmp_path]
    subprocess.run(words, check=True, capture_output=True)
    (path,) = tmp_path.glob("*.whl")
    done = subprocess.run([ROOT / "tools/try-wheel", path], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
