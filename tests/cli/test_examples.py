"""millsim --examples: the decks of input/ for those who have no checkout."""

import shutil
import subprocess

import pytest
from conftest import PROGRAM, ROOT

ALONE = "exclude each other: --examples only copies decks"


def files(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir() if not path.name.startswith(".")}


def test_examples_are_the_files_of_input(millsim, tmp_path):
    done = millsim("--examples", "decks")
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.endswith("the reference mill runs with: millsim decks/simoloyer.ini\n")
    assert files(tmp_path / "decks") == files(ROOT / "input")


def test_a_copied_deck_is_read_with_its_files(millsim):
    millsim("--examples", "decks")
    assert millsim("-q", "--check", "decks/stl.ini").returncode == 0


def test_examples_may_join_other_files(millsim, tmp_path):
    (tmp_path / "own.ini").write_text("own")
    assert millsim("--examples", ".").returncode == 0
    assert (tmp_path / "own.ini").read_text() == "own" and (tmp_path / "gas.ini").exists()


def test_examples_replace_no_file_and_then_copy_none(millsim, tmp_path):
    (tmp_path / "decks").mkdir()
    (tmp_path / "decks/wavy.ini").write_text("mine")
    done = millsim("--examples", "decks")
    assert done.returncode == 2
    assert done.stderr == "millsim: decks/wavy.ini exists, and --examples replaces no file; name another folder\n"
    assert files(tmp_path / "decks") == {"wavy.ini": b"mine"}


@pytest.mark.parametrize(
    "arguments, complaint",
    [
        (["--examples"], "option '--examples' needs a value; see millsim --help"),
        (["--examples", ""], "option '--examples' needs the name of a folder"),
        (["--examples", "a", "b.ini"], f"option '--examples' and 'b.ini' {ALONE}"),
        (["--examples", "a", "-f"], f"options '--examples' and '--force' {ALONE}"),
        (["--examples", "file"], "file: is a file, not a folder"),
        (["--examples", "no/such"], "no/such: No such file or directory"),
    ],
)  # fmt: skip
def test_wrong_usage_of_examples_is_one_line_and_status_2(millsim, tmp_path, arguments, complaint):
    (tmp_path / "file").touch()
    done = millsim(*arguments)
    assert (done.returncode, done.stdout, done.stderr) == (2, "", f"millsim: {complaint}\n")
    assert not (tmp_path / "a").exists()


def test_a_program_without_its_decks_says_so(tmp_path):
    (tmp_path / "far/from/home").mkdir(parents=True)
    alone = shutil.copy(PROGRAM, tmp_path / "far/from/home/millsim")
    done = subprocess.run([alone, "--examples", tmp_path / "decks"], capture_output=True, text=True)
    said = "no example decks beside this program; they are the folder input of its source"
    assert (done.returncode, done.stderr) == (1, f"millsim: {said}\n")
