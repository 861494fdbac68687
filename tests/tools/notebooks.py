"""Notebooks of the documentation: run with this interpreter, stored with what came out.

PYTHONPATH=$PWD/tools .venv/bin/python tests/tools/notebooks.py docs/first-steps.ipynb      # runs it and stores its
outputs
"""

import base64
import copy
import io
import os
import pathlib
import sys

import nbformat
from nbclient import NotebookClient
from PIL import Image

KEPT = {"kernelspec": {"name": "python3", "display_name": "Python 3", "language": "python"}}
COLOURS = 256
TIMEOUT = 120  # [s] a cell


def read(path):
    return nbformat.read(path, as_version=4)


def execute(path, **environment):
    """The notebook after all its cells have run, in its own folder; raises what a cell raises."""
    notebook = copy.deepcopy(read(path))
    place = {"metadata": {"path": str(pathlib.Path(path).parent)}}
    client = NotebookClient(notebook, timeout=TIMEOUT, kernel_name="python3", resources=place, record_timing=False)
    # python3 is the kernel of the interpreter that runs this
    client.execute(env={**os.environ, **environment})
    return strip(notebook)


def strip(notebook):
    """Without what says when, where and by which version it was run."""
    notebook.metadata = nbformat.from_dict(KEPT)
    for number, cell in enumerate(notebook.cells, 1):
        cell.metadata = nbformat.from_dict({})
        if "outputs" in cell:  # the progress of a run that took long comes and goes
            cell.outputs = [one for one in cell.outputs if "\r" not in one.get("text", "")]
        cell.id = f"cell-{number}"
        for output in cell.get("outputs", ()):
            output.metadata = nbformat.from_dict({})
            if "image/png" in output.get("data", {}):
                output.data["image/png"] = smaller(output.data["image/png"])
    return notebook


def smaller(picture: str) -> str:
    """A picture in few colours and without words about its making: a third of the size."""
    made = io.BytesIO()
    with Image.open(io.BytesIO(base64.b64decode(picture))) as image:
        image.convert("RGB").quantize(COLOURS).save(made, "PNG", optimize=True)
    return base64.b64encode(made.getvalue()).decode()


def figures(cell) -> list[str]:
    """The pictures of a cell, PNG in base64."""
    made = (output.get("data", {}).get("image/png") for output in cell.get("outputs", ()))
    return [picture for picture in made if picture]


def texts(notebook) -> list[str]:
    """What its cells say in words, without pictures; one text an output."""
    found = []
    for cell in notebook.cells:
        for output in cell.get("outputs", ()):
            data = output.get("data", {})
            found.append(data.get("text/html") or data.get("text/plain") or output.get("text", ""))
    return found


if __name__ == "__main__":
    for name in sys.argv[1:]:
        nbformat.write(execute(name), name)
