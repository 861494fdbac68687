"""Finds and runs the program millsim; finds its checkout and version."""

import os
import pathlib
import shlex
import shutil
import subprocess
import sys
import sysconfig

from milltools.base.errors import UserError

ROOT = pathlib.Path(__file__).resolve().parents[3]  # of the checkout, if this is not an installed package
IN_CHECKOUT = (ROOT / "src/app/main.c").exists()  # else this is an installed package
WARNING = "warning: "  # begins such a message
MILLSIM = "./millsim" if IN_CHECKOUT else "millsim"  # the word that starts it


def called() -> str:
    """The words that call this command again: "mill" if the shell finds it, else a path such as "./mill"."""
    name = os.environ.get("MILL_CALLED") or sys.argv[0]
    if name.endswith("__main__.py"):
        return "python -m milltools"
    if name == os.path.basename(name):
        return name
    found = shutil.which(os.path.basename(name))
    return os.path.basename(name) if found and os.path.samefile(found, name) else name


def command_line(*words: object, program: str = "") -> str:
    """The command `mill WORDS` as a shell reads it; or `program WORDS`, as for MILLSIM. A pathlib.Path is no option."""
    texts = (f"./{word}" if isinstance(word, pathlib.Path) and str(word)[0] == "-" else str(word) for word in words)
    return f"{program or called()} {shlex.join(texts)}"


def program() -> pathlib.Path:
    """The path of millsim: $MILLSIM, else that of this checkout, of the environment of this Python, or of the PATH."""
    chosen = os.environ.get("MILLSIM")
    if chosen:
        if not os.access(chosen, os.X_OK):
            raise UserError(f"the environment variable MILLSIM is '{chosen}', which is not a program", status=1)
        return pathlib.Path(chosen)
    if os.access(ROOT / "millsim", os.X_OK):
        return ROOT / "millsim"
    # one environment of several may be in use without being on the PATH
    for folder in (sysconfig.get_path("scripts"), os.path.dirname(sys.executable)):
        if os.access(os.path.join(folder, "millsim"), os.X_OK):
            return pathlib.Path(folder, "millsim")
    found = shutil.which("millsim")
    if found:
        return pathlib.Path(found)
    if IN_CHECKOUT:
        raise UserError(f"millsim is not built: run 'make millsim' in {ROOT}", status=1)
    raise UserError(
        "no millsim found: install its wheel ('pip install ./millsim-*.whl'); or build it ('make millsim' in its "
        "checkout), then put it on the PATH ('make install') or set the environment variable MILLSIM to the path of "
        "the program",
        status=1,
    )


def ask(*words: str | pathlib.Path) -> str:
    """The output of millsim; if it fails, a UserError with millsim's own message."""
    done = subprocess.run([program(), *words], capture_output=True, text=True, errors="replace")
    if done.returncode != 0:
        raise UserError(complaints(done.returncode, done.stderr), done.returncode if done.returncode > 0 else 1)
    return done.stdout


def complaints(status: int, said: str) -> list[str]:
    """The messages with which millsim ended: all faults of a wrong deck, otherwise the last line."""
    lines = [own_words(line) for line in said.strip().splitlines()]
    if status == 2:
        lines = [line for line in lines if not line.startswith(WARNING)]
    return (lines if status == 2 else lines[-1:]) or [f"millsim ended with status {status}"]


def own_words(line: str) -> str:
    """A message of millsim without the leading name of the program."""
    return line.strip().removeprefix("millsim: ")


def version() -> str:
    """The version of millsim, from `millsim --version`."""
    path = program()
    try:
        said = subprocess.run([path, "--version"], capture_output=True, text=True, timeout=60)
    except OSError as fault:
        raise UserError(f"{path}: {fault.strerror}", status=1) from None
    if said.returncode != 0:
        raise UserError(f"{path} --version ended with status {said.returncode}", status=1)
    return said.stdout.removeprefix("millsim").strip()


def package_version() -> str:
    """The version of this package: of the checkout, or of what was installed."""
    if IN_CHECKOUT:
        return (ROOT / "VERSION").read_text().strip()
    import importlib.metadata

    return importlib.metadata.version("millsim")
