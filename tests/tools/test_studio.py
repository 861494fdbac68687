"""mill studio: the page opens with a deck in its link, or is written with the deck and the files that it names."""

import base64
import json
import re
import webbrowser
import zlib

import pytest
from conftest import ROOT, SMALL

from milltools import __main__
from milltools.studio import build, command


@pytest.fixture
def page(tmp_path, monkeypatch):
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


def test_the_browser_gets_the_page_with_the_deck_in_its_link(page, opened, tmp_path):
    (tmp_path / "deck.ini").write_text(SMALL)
    assert __main__.dispatch(["studio", "deck.ini"]) == 0
    [address] = opened
    place, _, packed = address.partition("#design=")
    assert place == page.as_uri()
    text = zlib.decompress(base64.urlsafe_b64decode(packed + "=" * (-len(packed) % 4)), -15)
    assert json.loads(text) == {"deck": SMALL}


def test_without_a_browser_it_prints_the_address(page, monkeypatch, capsys):
    monkeypatch.setattr(webbrowser, "open", lambda address: False)
    assert __main__.dispatch(["studio"]) == 0
    assert capsys.readouterr().out == f"{page.as_uri()}\n"


def test_a_copy_has_the_deck_and_the_files_that_it_names(page, opened, tmp_path):
    (tmp_path / "deck.ini").write_text(SMALL + "[body.x]\nfile = a </script>.stl\n")
    (tmp_path / "a <").mkdir()
    (tmp_path / "a <" / "script>.stl").write_bytes(b"solid")
    assert __main__.dispatch(["studio", "deck.ini", "-o", "copy.html"]) == 0
    text = (tmp_path / "copy.html").read_text()
    own = json.loads(re.search(r'id="own">(.*?)</script>', text)[1])
    assert own["text"].startswith(SMALL)
    assert own["files"] == {"a </script>.stl": base64.b64encode(b"solid").decode()}
    assert opened == []


@pytest.mark.parametrize(
    "words, line",
    [
        (["-o", "old.html"], "old.html: exists; give another name, or remove it"),
        (["none.ini"], "none.ini: no such file"),
        (["mesh.ini"], "mesh.ini: needs rotor.stl: write a page that has both with -o FILE.html"),
    ],
)
def test_what_cannot_be_done_is_one_line(page, opened, tmp_path, words, line):
    (tmp_path / "old.html").write_text("old")
    (tmp_path / "mesh.ini").write_text("[body.x]\nfile = rotor.stl\n")
    (tmp_path / "rotor.stl").write_text("solid")
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
