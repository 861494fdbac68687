"""docs/export.md and docs/file-format.md do what they say: their commands are run as they stand."""

import importlib.util
import re

import h5py
import pages
import pytest
from conftest import PROGRAM, ROOT
from export_run import make

MDANALYSIS = {
    block.place for block in pages.blocks(ROOT / "docs" / "file-format.md", "python") if "MDAnalysis" in block.text
}


def can(text):
    """Whether the packages are there that a block of Python imports."""
    wanted = re.findall(r"^(?:import|from) (\w+)", text, re.MULTILINE)
    return all(importlib.util.find_spec(name) for name in wanted)


def play(folder, page):
    """Runs all blocks of a page; {place: (mark, what it printed)}."""
    environment = pages.workplace(folder, ROOT, PROGRAM)
    return {
        block.place: (block.mark, pages.run(block, folder, environment))
        for block in pages.blocks(ROOT / "docs" / page, "sh", "python")
        if block.mark == "sh" or can(block.text)
    }


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    folder = tmp_path_factory.mktemp("page")
    make(folder, "reference.h5")
    return folder


@pytest.mark.slow
@pytest.mark.thorough
def test_every_command_of_the_page_does_what_it_says(place):
    said = play(place, "export.md")
    lines = [line for mark, out in said.values() for line in out.splitlines() if mark == "sh"]
    lines = [line for line in lines if re.match(r"\S+\.\w+: ", line)]  # not the summary of a run
    commands = [
        line
        for block in pages.blocks(ROOT / "docs" / "export.md", "sh")
        for line in block.text.splitlines()
        if line.startswith("./mill export")
    ]
    assert len(lines) == len(commands)  # each says what it wrote
    for line, command in zip(lines, commands, strict=True):
        name = command.split()[3]
        assert line.startswith(f"{name}: ") and (place / name).exists()
    shown = [out for mark, out in said.values() if mark == "python"]
    assert all(out.strip() for out in shown)
    assert (place / "reference.vtkhdf").resolve() == (place / "reference.h5")


def test_every_option_of_the_page_is_there_and_the_other_way_round(mill):
    text = (ROOT / "docs" / "export.md").read_text()
    done = mill("export", "--help")
    assert done.returncode == 0
    shown = set(re.findall(r"--[a-z]+", text)) - {"--set"}
    known = set(re.findall(r"--[a-z]+", done.stdout)) - {"--set", "--help"}
    assert shown == known


@pytest.mark.slow
def test_every_recipe_of_the_file_format_runs(tmp_path):
    make(tmp_path, "simoloyer.h5", "-s", "run.time=150 ms")
    make(tmp_path, "single.h5")
    said = play(tmp_path, "file-format.md")
    text = (ROOT / "docs" / "file-format.md").read_text()
    assert len(said) >= text.count("```python") - 1  # at most one package is missing
    with h5py.File(tmp_path / "simoloyer.h5") as file:
        times = file["particles/trajectory/position/time"][:]
    if can("import MDAnalysis"):
        (out,) = (out for place, (_, out) in said.items() if place in MDANALYSIS)
        found = [float(line.split()[0]) for line in out.splitlines()]
        assert found == list(times)


def test_a_block_that_fails_is_named_by_its_place(tmp_path):
    page = tmp_path / "page.md"
    page.write_text("# Page\n\n```text\nno command\n```\n\n```sh\ntrue\nfalse\ntrue\n```\n")
    found = pages.blocks(page)
    assert [(block.mark, block.place) for block in found] == [
        ("text", "page.md:4"),
        ("sh", "page.md:8"),
    ]
    with pytest.raises(AssertionError, match="page.md:8: status 1"):
        pages.run(found[1], tmp_path, None)
