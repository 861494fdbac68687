"""millsim from Python, the `mill` command, and the one reader of its output file.

    import milltools

    result = milltools.run("input/simoloyer.ini", rotor__speed="1500 rpm")
    print(result.power, result.median_impact_speed)
    result.plot_spectrum()

`run` simulates a deck, `load` opens what a run wrote, `read_deck` and `write_deck` are decks as dictionaries: docs/python.md.
What a user has to mend is a `UserError`. Sub-commands of `mill` are modules (`__main__.py` lists them); `runfile.Run` reads a run.
"""

import importlib

from milltools.base.errors import UserError

# where each name lives: imported when it is first asked for, so that `mill --help` needs no package
_HOMES = {
    "run": "milltools.api.launch",
    "load": "milltools.api.result",
    "Result": "milltools.api.result",
    "Measurement": "milltools.api.measurement",
    "read_deck": "milltools.api.decks",
    "write_deck": "milltools.api.decks",
}
__all__ = ["UserError", *_HOMES]


def __getattr__(name):
    if name not in _HOMES:
        raise AttributeError(f"module 'milltools' has no attribute {name!r}")
    return getattr(importlib.import_module(_HOMES[name]), name)


def __dir__():
    return sorted({*globals(), *_HOMES})
