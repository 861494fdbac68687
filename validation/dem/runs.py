"""The runs that the comparison stands on: LIGGGHTS by `mill dem`, millsim of the same deck, kept from one call to the next.

A run of LIGGGHTS takes minutes, so its file stays in build/dem, with a note of what made it. It is used again only by
the same deck (as text, defaults filled in), the same millsim and the same options of `mill dem`; the terminal says so.
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

from milltools.deck import Deck
from milltools.dem.model import STEEL, Model
from milltools.engine import program, version
from milltools.runfile import Run

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


class DemCase(ladder.Case):
    """A part of the comparison: the ladder's case, with runs of LIGGGHTS and sentences for the results."""

    def __init__(self, folder, scratch, stale=False):
        super().__init__(folder, scratch)
        self.program = program()
        self.stale = stale  # kept runs are taken whatever version made them
        self.told = []
        self.figures = set()

    def tell(self, sentence):
        """A sentence with figures, below the table of claims."""
        self.told.append(sentence)
        say(f"      {sentence}")

    def save(self, figure, name):
        super().save(figure, name)
        self.figures.add(name)

    def dem(self, name, deck, modulus, warm_up=None, **settings):
        """Runs a deck in LIGGGHTS and right after it, alone, in millsim: the paths of the two files.

        modulus, warm_up: keys of STIFFNESSES.
        """
        overrides = sets(settings)
        options = ["--modulus", modulus, *(["--warm-up", warm_up] if warm_up else [])]
        key = {
            "deck": Deck.check(deck, overrides).text,
            "millsim": version(),
            "options": options,
        }
        paths = KEPT / f"{name}.h5", KEPT / f"{name}-millsim.h5"
        note = KEPT / f"{name}.json"
        if self._good(note, paths, key):
            return paths
        KEPT.mkdir(parents=True, exist_ok=True)
        note.unlink(missing_ok=True)
        say(f"    {name}: LIGGGHTS at {LABELS[modulus]} ...")
        words = [word for override in overrides for word in ("--set", override)]
        quiet = [] if sys.stderr.isatty() else ["--quiet"]
        begin = time.monotonic()
        call(
            [ROOT / "mill", "dem", *quiet, "--force", "-o", paths[0], *options, *words, deck],
            f"mill dem {name}",
        )
        self.run(deck, output=paths[1], **settings)
        say(f"    {name}: {time.monotonic() - begin:.0f} s")
        note.write_text(json.dumps(key, indent=1))
        return paths

    def _good(self, note, paths, key):
        if not (note.exists() and all(path.exists() for path in paths)):
            return False
        made = json.loads(note.read_text())
        if any(made[name] != key[name] for name in ("deck", "options")):
            return False
        name = note.stem
        if made["millsim"] == key["millsim"]:
            say(f"    {name}: kept in {KEPT.relative_to(ROOT)} from an earlier call, used again")
            return True
        if self.stale:
            say(f"    {name}: kept, of version {made['millsim']}, used again in {key['millsim']}")
        return self.stale

    def seeds(self, count, deck, **settings):
        """Files of `count` runs of millsim with seeds from 1, as many at a time as there are cores."""
        text = json.dumps([str(deck), sets(settings)])
        group = hashlib.sha1(text.encode()).hexdigest()[:10]

        def one(seed):
            name = f"{group}-{seed}.h5"
            return self.run(deck, output=name, **settings, run__seed=seed, output__frames="0 s")

        with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
            return list(pool.map(one, range(1, count + 1)))

    def price(self, modulus, dem, millsim, least, aim=None, what=""):
        """millsim is `least` times as cheap as LIGGGHTS, in processor seconds for one simulated second."""
        with Run(dem) as run:
            soft = float(run.read("run/price"))
        with Run(millsim) as run:
            hard = run.cost
        wanted = f"at least {least} times cheaper" + (f", aim {aim}" if aim else "")
        self.bound(
            f"processor time of millsim over that of LIGGGHTS, {what}{LABELS[modulus]}: {soft / hard:.0f} times cheaper",
            100 * hard / soft,
            100 / least,
            against=f"{wanted}; {soft:.4g} against {hard:.3g} CPU s for one simulated second",
            unit="%",
            headline=True,
        )


def say(text):
    """A line of progress."""
    print(text, flush=True)


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
