"""The runs that the comparison stands on: millsim with many seeds, and LIGGGHTS by `mill dem`, kept from one call to
the next.

A run of LIGGGHTS takes minutes, so its file stays in build/dem, with a note of what made it. It is used again only
by the same deck (as text, defaults filled in), the same millsim and the same options of `mill dem`; the terminal
says so.
"""

import concurrent.futures
import hashlib
import json
import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import time

import ladder
from parts import Part, say

from milltools.base.engine import program, version
from milltools.dem.model import STEEL, Model
from milltools.read.deck import Deck

ROOT = ladder.ROOT
KEPT = ROOT / "build" / "dem"
STIFFNESSES = {"1e9": 1e9, "1e10": 1e10, "steel": STEEL}
LABELS = {"1e9": "1e9 Pa", "1e10": "1e10 Pa", "steel": "steel"}
GRACE = 60.0  # [s] for mill dem to write what it has when it is stopped


def sets(settings):
    """Overrides of a deck from keyword arguments, with `__` for the dot: run__time="1 s"."""
    return [f"{key.replace('__', '.')}={value}" for key, value in settings.items()]


def contact_duration(deck, modulus):
    """[s] how long two balls of a deck (path, overrides) touch at a Young's modulus [Pa]."""
    return Model(Deck.check(*deck), modulus).pair[0][0].duration


class DemCase(Part):
    """A part of the comparison: the ladder's case, with runs of LIGGGHTS and sentences for the results."""

    def __init__(self, folder, scratch, stale=False):
        super().__init__(folder, scratch)
        self.program = program()
        self.stale = stale  # kept runs are taken whatever version made them

    def dem(self, name, deck, modulus, warm_up=None, **settings):
        """Runs a deck in LIGGGHTS, if no such run is kept, and returns its file.

        modulus, warm_up: keys of STIFFNESSES.
        """
        overrides = sets(settings)
        options = ["--modulus", modulus, *(["--warm-up", warm_up] if warm_up else [])]
        checked = Deck.check(deck, overrides)
        start = checked.value("balls.start")
        key = {
            "deck": checked.text,
            "start": start if start == "random" else digest(pathlib.Path(start).read_bytes()),
            "millsim": version(),
            "options": options,
        }
        path, note = KEPT / f"{name}.h5", KEPT / f"{name}.json"
        if self._good(note, path, key):
            return path
        KEPT.mkdir(parents=True, exist_ok=True)
        note.unlink(missing_ok=True)
        say(f"    {name}: LIGGGHTS at {LABELS[modulus]} ...")
        words = [word for override in overrides for word in ("--set", override)]
        quiet = [] if sys.stderr.isatty() else ["--quiet"]
        begin = time.monotonic()
        call(
            [ROOT / "mill", "dem", *quiet, "--force", "-o", path, *options, *words, deck],
            f"mill dem {name}",
        )
        say(f"    {name}: {time.monotonic() - begin:.0f} s")
        note.write_text(json.dumps(key, indent=1))
        return path

    def _good(self, note, path, key):
        if not (note.exists() and path.exists()):
            return False
        made = json.loads(note.read_text())
        if any(made.get(name) != key[name] for name in ("deck", "start", "options")):
            return False
        name = note.stem
        if made["millsim"] == key["millsim"]:
            say(f"    {name}: the run in {KEPT.relative_to(ROOT)} from an earlier call is used again")
            return True
        if self.stale:
            say(f"    {name}: the kept run of version {made['millsim']} is used; this is version {key['millsim']}")
        return self.stale

    def seeds(self, count, deck, **settings):
        """Files of `count` runs of millsim with seeds from 1, as many at a time as there are cores."""
        text = json.dumps([str(deck), sets(settings)])
        group = digest(text.encode())

        def one(seed):
            name = f"{group}-{seed}.h5"
            return self.run(deck, output=name, **settings, run__seed=seed, output__frames="0 s")

        with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
            return list(pool.map(one, range(1, count + 1)))


def digest(content):
    """A short name for bytes."""
    return hashlib.sha1(content).hexdigest()[:12]


def call(words, what):
    """Runs a program to its end; if this one is stopped, so is that one, first of all and in order."""
    with tempfile.TemporaryFile("w+") as said:
        process = subprocess.Popen([str(word) for word in words], stdout=said)
        before = signal.signal(signal.SIGTERM, signal.default_int_handler)
        try:
            status = process.wait()
        except KeyboardInterrupt:
            process.terminate()
            process.wait(GRACE)
            raise
        finally:
            signal.signal(signal.SIGTERM, before)
            if process.poll() is None:
                process.kill()
        if status != 0:
            raise RuntimeError(f"{what} ended with status {status}")


def folder():
    """Of this comparison: its README, decks and figures."""
    return pathlib.Path(__file__).resolve().parent
