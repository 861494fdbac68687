"""What docs/python.md and the notebook show is what happens: all their code runs, and the stored outputs are its
outputs."""

import base64
import io
import json
import os
import re
import subprocess
import sys

import matplotlib.image
import pages
import pytest
from conftest import PROGRAM, ROOT

notebooks = pytest.importorskip("notebooks", exc_type=ImportError)

NOTEBOOK = ROOT / "docs/first-steps.ipynb"
ENVIRONMENT = {
    "PYTHONPATH": str(ROOT / "tools"),
    "MILLSIM": str(PROGRAM),
    "MPLBACKEND": "module://matplotlib_inline.backend_inline",
    "OMP_NUM_THREADS": "1",
}


@pytest.fixture(scope="module")
def stored():
    return notebooks.read(NOTEBOOK)


@pytest.fixture(scope="module")
def executed(tmp_path_factory):
    """The notebook, run anew; what Jupyter keeps of it stays in a folder of its own."""
    folder = tmp_path_factory.mktemp("jupyter")
    homes = {name: str(folder) for name in ("JUPYTER_RUNTIME_DIR", "IPYTHONDIR")}
    with pytest.MonkeyPatch.context() as patch:
        for name, value in homes.items():
            patch.setenv(name, value)
        return notebooks.execute(NOTEBOOK, **ENVIRONMENT)


@pytest.mark.slow
@pytest.mark.thorough
def test_the_notebook_runs_and_shows_its_figures(executed):
    kinds = [output.output_type for cell in executed.cells for output in cell.get("outputs", ())]
    assert "error" not in kinds
    drawn = [picture for cell in executed.cells for picture in notebooks.figures(cell)]
    assert len(drawn) == 5
    for picture in drawn:
        pixels = matplotlib.image.imread(io.BytesIO(base64.b64decode(picture)))[..., :3]
        assert pixels.shape[0] > 200 and pixels.shape[1] > 300
        assert pixels.std() > 0.05 and len({tuple(p) for p in pixels.reshape(-1, 3)}) > 8


@pytest.mark.thorough
def test_it_says_nothing_but_results(executed):
    said = [output for cell in executed.cells for output in cell.get("outputs", ())]
    assert not [output for output in said if output.get("name") == "stderr"]  # no warning


def test_it_goes_from_a_deck_to_a_figure_in_ten_lines(stored):
    code = 0
    for cell in stored.cells:
        if cell.cell_type == "code":
            code += len([line for line in cell.source.splitlines() if line.strip()])
            if notebooks.figures(cell):
                break
    assert code <= 10


@pytest.mark.thorough
def test_its_stored_outputs_are_those_it_gives(stored, executed):
    """If they differ for a reason: tests/tools/notebooks.py says how to store them anew."""
    assert notebooks.texts(stored) == notebooks.texts(executed)
    assert [len(notebooks.figures(cell)) for cell in stored.cells] == [
        len(notebooks.figures(cell)) for cell in executed.cells
    ]


def test_what_is_stored_is_small_and_says_nothing_of_a_machine(stored):
    text = NOTEBOOK.read_text()
    assert len(text) < 300_000
    words = re.sub(r'"image/png": "[^"]*"', "", text)
    assert not re.search(r"/(tmp|home|root|Users|work|usr|var)/|ipykernel|timestamp|iopub", words)
    assert stored.metadata == notebooks.KEPT
    assert all(not cell.metadata for cell in stored.cells)
    assert json.loads(text)["nbformat"] == 4


@pytest.mark.thorough
@pytest.mark.slow
def test_all_code_of_the_page_runs(tmp_path):
    (tmp_path / "input").symlink_to(ROOT / "input")
    code = pages.blocks(ROOT / "docs/python.md", "python")
    assert len(code) == 13
    script = "\n".join(f"# {block.place}\n{block.text}" for block in code)  # each goes on from the last
    done = subprocess.run(
        [sys.executable, "-W", "ignore:not steady:UserWarning", "-W", "error", "-c", script],
        cwd=tmp_path,
        env={**os.environ, **ENVIRONMENT, "MPLBACKEND": "Agg"},
        capture_output=True,
        text=True,
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert "unknown key; did you mean 'speed'?" in done.stdout
    for name in ("mill.h5", "mine.ini", "spectrum.png", "power.svg", "both.png", "balls.html", "speeds.parquet"):
        assert (tmp_path / name).stat().st_size > 500
