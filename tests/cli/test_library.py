"""libmillsim: the engine as other programs use it."""

import os
import pathlib
import re
import shutil
import subprocess

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
MAKEFILES = (ROOT / "Makefile", *(ROOT / "tools/make").glob("*.mk"))
FOREIGN = re.compile(r"\b(H5\w+|gsl_\w+|ut_\w+|ini_\w+|cv_\w+)")


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    """What `make install` puts into an empty prefix."""
    prefix = tmp_path_factory.mktemp("prefix")
    command = [
        "make",
        "-C",
        ROOT,
        "--no-print-directory",
        "install",
        "MODE=release",
        "MILL=no",
        f"PREFIX={prefix}",
    ]
    subprocess.run(command, check=True, capture_output=True)
    return prefix


def flags(prefix):
    """What pkg-config says of the installed library."""
    environment = {**os.environ, "PKG_CONFIG_PATH": str(prefix / "lib" / "pkgconfig")}
    command = ["pkg-config", "--cflags", "--libs", "millsim"]
    return subprocess.run(command, check=True, capture_output=True, text=True, env=environment).stdout.split()


def test_the_example_builds_from_what_is_installed_and_counts_impacts(installed, tmp_path):
    program = tmp_path / "impacts"
    source = shutil.copy(ROOT / "examples" / "impacts.c", tmp_path)
    warnings = ["-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror"]
    subprocess.run(["cc", *warnings, source, *flags(installed), "-o", program], check=True)
    said = subprocess.run([program], check=True, capture_output=True, text=True).stdout
    found = re.fullmatch(
        r"0\.5 s: (\d+) impacts, (\d+) of them at 1 m/s or more; the rotor has done ([\d.]+) J\n",
        said,
    )
    assert found, said
    impacts, hard, work = int(found[1]), int(found[2]), float(found[3])
    assert 10_000 < impacts < 1_000_000
    assert 0 < hard < impacts
    assert work > 0


def test_its_version_is_a_number_that_pkg_config_can_compare(installed):
    environment = {**os.environ, "PKG_CONFIG_PATH": str(installed / "lib" / "pkgconfig")}
    said = subprocess.run(
        ["pkg-config", "--modversion", "millsim"], capture_output=True, text=True, env=environment
    ).stdout
    assert said.strip() == (ROOT / "VERSION").read_text().strip()
    command = ["pkg-config", "--atleast-version=0.1", "millsim"]
    assert subprocess.run(command, env=environment).returncode == 0


def test_every_public_header_compiles_alone(installed, tmp_path):
    headers = sorted((installed / "include" / "millsim").glob("*.h"))
    assert len(headers) > 8
    for header in headers:
        source = tmp_path / "alone.c"
        source.write_text(f"#include <millsim/{header.name}>\nint nothing;\n")
        command = ["cc", "-std=c99", "-pedantic", "-Wall", "-Werror", "-fsyntax-only"]
        subprocess.run([*command, f"-I{installed}/include", source], check=True)


def test_the_library_needs_no_library_of_files_units_or_statistics(installed):
    archive = installed / "lib" / "libmillsim.a"
    symbols = subprocess.run(["nm", "--undefined-only", archive], check=True, capture_output=True, text=True).stdout
    assert "malloc" in symbols  # it needs the C library alone
    assert not FOREIGN.findall(symbols)


def test_another_mode_knows_how_the_release_program_is_built(tmp_path):
    for name in ("Makefile", "VERSION", "src", "include", "tools", "tests"):
        (tmp_path / name).symlink_to(ROOT / name)
    command = ["make", "--dry-run", "MODE=asan", "millsim"]
    asked = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert asked.returncode == 0, asked.stderr
    assert "build/release/millsim" in asked.stdout and not (tmp_path / "build/release").exists()


def test_make_check_builds_each_program_that_its_tests_start():
    rule = re.search(r"^check:.*\n((?:\t.*\n)+)", (ROOT / "Makefile").read_text(), re.M)[1]
    assert "$(BUILD)/tests/bench/bench_engine $(BUILD)/millsim millsim" in rule  # test_bench.py; all others


def test_every_target_that_is_no_file_has_a_rule():
    """make says "Nothing to be done" for one that has lost its rule, and succeeds."""
    text = "".join(path.read_text() for path in MAKEFILES).replace("\\\n", " ")
    phony = {name for line in re.findall(r"^\.PHONY:(.*)", text, re.M) for name in line.split()}
    rules = {name for line in re.findall(r"^([a-z][\w -]*):(?!=)", text, re.M) for name in line.split()}
    assert {"js", "wheel"} <= phony and phony - rules == {"always"}  # which is there to be asked for


def test_make_help_tells_every_target_that_the_pages_name():
    pages = [*ROOT.glob("*.md"), *ROOT.glob("docs/*.md"), *ROOT.glob("tests/*/README.md")]
    text = "".join(path.read_text() for path in pages if path.name != "CHANGELOG.md")
    named = set(re.findall(r"`make ([a-z][a-z-]*)", text)) | set(re.findall(r"^    make ([a-z][a-z-]*)", text, re.M))
    run = subprocess.run(["make", "-s", "-C", ROOT, "help"], check=True, capture_output=True, text=True)
    told = set(re.findall(r"^make ([a-z-]+) +\w", run.stdout, re.M))
    assert {"all", "check", "wheel", "validate-dem"} <= told and named <= told, named - told


def test_the_makefile_is_read_in_two_minutes():
    """What builds, checks and installs; all else is in tools/make."""
    assert len((ROOT / "Makefile").read_text().splitlines()) <= 150
