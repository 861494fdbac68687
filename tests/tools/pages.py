"""A page's commands, run as its reader would: the fenced blocks marked sh and python, in order, in one folder.

    environment = workplace(folder, root, program)
    for block in blocks(root / "docs/export.md", "sh", "python"):
        print(run(block, folder, environment))

Blocks of another mark (text, console, ini, none) are only shown. A python block is a script of its own.
"""

import dataclasses
import os
import pathlib
import re
import subprocess
import sys

FENCE = re.compile(r"^```(\w*)\n(.*?)^```$", re.DOTALL | re.MULTILINE)


@dataclasses.dataclass(frozen=True)
class Block:
    """A fenced block: its mark, its text, and the place of its first line as "page.md:12"."""

    mark: str
    text: str
    place: str


def blocks(path, *marks) -> list[Block]:
    """The blocks of a page with one of these marks (all of them without), in order."""
    text, path = pathlib.Path(path).read_text(), pathlib.Path(path)
    found = []
    for fence in FENCE.finditer(text):
        line = text.count("\n", 0, fence.start()) + 2
        if not marks or fence[1] in marks:
            found.append(Block(fence[1], fence[2], f"{path.name}:{line}"))
    return found


def workplace(folder, root, program):
    """Makes a folder look like a built checkout: ./mill, ./millsim, input/, docs/; returns the environment to run
    in."""
    tools = root / "tools"
    mill = folder / "mill"
    mill.write_text(f'#!/bin/sh\nPYTHONPATH="{tools}" MILLSIM="{program}" exec "{sys.executable}" -m milltools "$@"\n')
    mill.chmod(0o755)
    (folder / "millsim").symlink_to(program)
    for name in ("input", "docs"):
        (folder / name).symlink_to(root / name)
    path = f"{pathlib.Path(sys.executable).parent}{os.pathsep}{os.environ.get('PATH', '')}"
    return {**os.environ, "PATH": path, "PYTHONPATH": str(tools), "MILLSIM": str(program)}


def run(block, folder, environment, timeout=120) -> str:
    """Runs a block; what it printed on standard output. A block that fails is an AssertionError with its place."""
    words = [sys.executable, "-c"] if block.mark == "python" else ["sh", "-euc"]
    done = subprocess.run(
        [*words, block.text],
        cwd=folder,
        env=environment,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=timeout,
    )
    assert done.returncode == 0, f"{block.place}: status {done.returncode}\n{done.stderr}"
    return done.stdout
