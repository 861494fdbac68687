"""The Python interface of millsim, the `mill` command, and the reader of the output file.

    import milltools

    result = milltools.run("input/simoloyer.ini", rotor__speed="1500 rpm")
    print(result.power, result.median_impact_speed)
    result.plot_spectrum()

`run` simulates a deck, `load` opens the output file of a run, `read_deck` and `write_deck` convert decks from and to
dictionaries, `sweep` and `optimize` run studies, `load_study` opens one (docs/python.md). Errors that users can correct
are `MillsimError`s. Sub-commands of `mill` are modules (see `__main__.py`); `read.runfile.Run` reads a run.
"""

from typing import TYPE_CHECKING as _TYPE_CHECKING

from milltools.base.errors import InputError, MillsimError, MissingFileError
from milltools.base.errors import UserError as UserError  # the name of MillsimError in earlier versions

if _TYPE_CHECKING:
    from milltools.api.decks import read_deck, write_deck
    from milltools.api.launch import run
    from milltools.api.measurement import Measurement
    from milltools.api.result import Result, load
    from milltools.api.studies import StudyResult, load_study, optimize, sweep

    __version__: str

__all__ = [
    "InputError", "Measurement", "MillsimError", "MissingFileError", "Result", "StudyResult", "load", "load_study",
    "optimize", "read_deck", "run", "sweep", "write_deck",
]  # fmt: skip

# the module of each name, imported when the name is first used: so `mill --help` needs no package
_HOMES = {
    "run": "launch", "load": "result", "Result": "result", "Measurement": "measurement", "read_deck": "decks",
    "write_deck": "decks", "sweep": "studies", "optimize": "studies", "load_study": "studies", "StudyResult": "studies",
}  # fmt: skip


def __getattr__(name: str) -> object:
    if name == "__version__":
        from milltools.base.engine import package_version

        return package_version()
    if name not in _HOMES:
        raise AttributeError(f"module 'milltools' has no attribute {name!r}")
    import importlib

    return getattr(importlib.import_module(f"milltools.api.{_HOMES[name]}"), name)


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
