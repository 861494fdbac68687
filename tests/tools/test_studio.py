"""mill studio: the page opens with a deck in its link, or is written with the deck and the files that it names."""

import base64
import json
import os
import pathlib
import re
import webbrowser
import zlib

import pytest
from conftest import ROOT, SMALL, SMALL_START

from milltools import __main__
from milltools.studio import build, command


@pytest.fixture
def built(tmp_path, monkeypatch):
    """A built page."""
    file = tmp_path / "studio.html"
    file.write_text(f"<p>{command.OWN}</p>")
    monkeypatch.setattr(command, "built", lambda: file)
    monkeypatch.chdir(tmp_path)
    return file


@pytest.fixture
def opened(monkeypatch):
    """Addresses that the browser was given."""
    found = []
    monkeypatch.setattr(webbrowser, "open", lambda address: found.append(address) or True)
    return found


def test_the_browser_gets_the_page_with_the_deck_in_its_link(built, opened, tmp_path):
    (tmp_path / "deck.ini").write_text(SMALL)
    assert __main__.dispatch(["studio", "deck.ini"]) == 0
    [address] = opened
    place, _, packed = address.partition("#design=")
    assert place == built.as_uri()
    text = zlib.decompress(base64.urlsafe_b64decode(packed + "=" * (-len(packed) % 4)), -15)
    assert json.loads(text) == {"deck": SMALL}


def test_without_a_browser_it_prints_the_address(built, monkeypatch, capsys):
    monkeypatch.setattr(webbrowser, "open", lambda address: False)
    assert __main__.dispatch(["studio"]) == 0
    assert capsys.readouterr().out == f"{built.as_uri()}\n"


@pytest.fixture
def beside(tmp_path, the_program):
    """beside(name) writes a deck that names a file with the start of its balls, in a folder with all kinds of files."""
    folder, out = tmp_path / "mill", tmp_path / "private"
    for place in (folder / "a <", out):
        place.mkdir(parents=True)
    for path in (*(folder / one for one in ("a </script>", "random", "50 ms", "text\u00a0")), out / "start"):
        path.write_text(SMALL_START)
    (folder / "text").write_text("no numbers")
    (folder / "out").symlink_to(out)
    (folder / "link").symlink_to(out / "start")
    (folder / "inner").symlink_to("a </script>")
    (folder / "hard").hardlink_to(out / "start")
    (folder / "loop").symlink_to("loop")
    os.mkfifo(folder / "pipe")
    with open(folder / "huge", "w") as file:
        file.truncate(3_000_000_000)
    deck = folder / "deck.ini"
    return lambda name: deck.write_text(SMALL.replace("[drum]", f"start = {name}\n[drum]")) and deck


@pytest.mark.parametrize(
    "name", ["a </script>", "./inner", "a </../hard", "text\u00a0", "random  # a\u2028start = text"]
)
def test_a_copy_has_the_deck_and_the_files_of_its_folder_that_it_names_and_says_so(built, opened, beside, capsys, name):
    """No file: what another key has, a word that stands for none, what only others than millsim take for a line."""
    deck, names = beside(name), [] if "random" in name else [name]
    assert __main__.dispatch(["studio", str(deck), "-o", "copy.html", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["holds"] == dict.fromkeys(names, len(SMALL_START))
    own = json.loads(re.search(r'id="own">(.*?)</script>', pathlib.Path("copy.html").read_text())[1])
    assert own == {
        "text": deck.read_text(),
        "files": dict.fromkeys(names, base64.b64encode(SMALL_START.encode()).decode()),
    }
    assert opened == []


def test_a_copy_takes_no_file_for_a_law_that_millsim_knows(built, beside, capsys):
    deck = beside("random")
    (deck.parent / "steel").write_text("private")
    deck.write_text(SMALL.replace("restitution = 0.8", "restitution_table = steel"))
    assert __main__.dispatch(["studio", str(deck), "-o", "copy.html", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["holds"] == {}


@pytest.mark.parametrize(
    "name, line",
    [
        ("link", "'link' is not in the deck's folder"),
        ("out/start", "'out/start' is not in the deck's folder"),
        ("../private/start", "'../private/start' is not in the deck's folder"),
        ("/etc/hostname", "'/etc/hostname' is not in the deck's folder"),
        ("loop", "loop: cannot be read: Too many levels of symbolic links"),
        ("pipe", "pipe: is not an ordinary file"),
        ("a <", "a <: is a folder"),
        ("none", "none: no such file"),
        ("huge", "'huge': the files of a page have 16 MB at most"),
        ("text", "text:1: expected 3, 6 or 9 numbers"),
    ],
)
def test_a_copy_takes_in_no_other_file(built, beside, capsys, monkeypatch, name, line):
    deck = beside(name)
    monkeypatch.setattr("sys.argv", ["mill", "studio", str(deck), "-o", "copy.html"])
    assert __main__.main() == 2
    said = capsys.readouterr().err
    assert said.startswith(f"mill studio: {deck.parent}/") and line in said and said.count("\n") == 1
    assert not pathlib.Path("copy.html").exists()


@pytest.mark.parametrize(
    "words, line",
    [
        (["-o", "old.html"], "old.html: exists; give another name, or remove it"),
        (["none.ini"], "none.ini: no such file"),
        (["mill/deck.ini"], "mill/deck.ini: needs inner: write a page that has both with -o FILE.html"),
        (["a.study"], "a.study:1: [study]: unknown section"),
        (["nul.ini"], "nul.ini: holds the control character 0x00: a deck is plain text"),
    ],
)
def test_what_cannot_be_done_is_one_line(built, opened, beside, tmp_path, words, line):
    (tmp_path / "old.html").write_text("old")
    (tmp_path / "nul.ini").write_text(f"{SMALL}\0")
    (tmp_path / "a.study").write_text("[study]\ndeck = old.html\n")
    beside("inner")
    with pytest.raises(command.UserError, match=re.escape(line)):
        __main__.dispatch(["studio", *words])
    assert (tmp_path / "old.html").read_text() == "old" and opened == []


def test_a_page_that_is_not_built_names_make_studio(tmp_path, monkeypatch):
    monkeypatch.setattr(command, "__file__", str(tmp_path / "command.py"))
    with pytest.raises(command.UserError, match="is missing: run 'make studio'"):
        command.built()


def test_the_page_loads_nothing_and_runs_only_its_own_scripts():
    text = build.page({"engine": "", "worker": "</x>"}, "null")
    policy = re.search(r'http-equiv="Content-Security-Policy" content="(.*?)"', text)[1].replace("&#39;", "'")
    assert policy.startswith("default-src 'none'; script-src 'sha256-") and "'wasm-unsafe-eval'" in policy
    assert "unsafe-inline" not in re.search(r"script-src ([^;]*)", policy)[1]
    assert not re.search(r'(src|href)="(?!#)', text)
    assert len(text.encode()) < build.MOST


def test_the_page_has_the_licences_of_what_is_in_it(tmp_path):
    (tmp_path / "engine").write_bytes(b"")
    (tmp_path / "copyright").write_text("Copyright <somebody>")
    build.main(str(tmp_path / "engine"), str(tmp_path / "page.html"), str(tmp_path / "copyright"))
    shown = re.search(r"<pre>(.*?)</pre>", (tmp_path / "page.html").read_text(), re.DOTALL)[1]
    assert shown.startswith("MIT License") and shown.endswith("Copyright &lt;somebody&gt;")


def test_the_decks_to_begin_with_are_those_of_input():
    for one in build.presets():
        assert one["text"] == (ROOT / "input" / f"{one['name']}.ini").read_text()
