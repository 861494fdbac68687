"""What study/ and paper/ share: studies by the mill command, kept in build/study from one call to the next, and
single designs measured closely."""

import concurrent.futures
import json
import os
import pathlib
import shutil
import subprocess
import time

import h5py
import numpy as np
import pandas
from parts import Part, say

from milltools.base.engine import program, version
from milltools.study.plan.study_deck import Study
from milltools.study.show import optimum
from milltools.study.show.data import opened

ROOT = pathlib.Path(__file__).resolve().parents[1]
KEPT = ROOT / "build" / "study"
FIGURE7 = ROOT / "input" / "figure7.study"
MEDIAN = "impacts/all/normal_speed/median_above_floor"
N, H = "drum.buckles", "drum.buckle_height"
MADE = set()  # names of the tables of this call
FRICTION = ("contact.friction=0.3", "contact.tangential_restitution=0.484")  # the reference mill's


class StudyCase(Part):
    """A part, with studies that are kept."""

    def __init__(self, folder, scratch, keep=False):
        super().__init__(folder, scratch)
        self.program = program()
        self.keep = keep  # kept tables are taken, whatever version made them
        KEPT.mkdir(parents=True, exist_ok=True)

    def mill(self, *words):
        """Runs the mill command; what it printed."""
        done = subprocess.run(
            [ROOT / "mill", *map(str, words)],
            capture_output=True,
            text=True,
            cwd=self.scratch,
            check=False,
        )
        if done.returncode != 0:
            said = done.stderr.strip().splitlines()
            raise RuntimeError(f"mill {words[0]}: {said[-1] if said else done.returncode}")
        return done.stdout

    def study(self, name, command, *options, file=FIGURE7):
        """Table of `mill COMMAND FILE OPTIONS`, and the wall time it took [s]."""
        path = KEPT / f"{name}.parquet"
        note = path.with_suffix(".json")
        # made by this call, or by an earlier one and asked for
        if not (note.exists() and (self.keep or name in MADE)):
            note.unlink(missing_ok=True)
            for old in KEPT.glob(f"{name}.parquet*"):
                old.unlink()
            say(f"    {name}: mill {command} ...")
            begin = time.monotonic()
            self.mill(command, file, "-o", path, *options)
            note.write_text(json.dumps({"wall": time.monotonic() - begin, "millsim": version()}) + "\n")
        MADE.add(name)
        made = json.loads(note.read_text())
        if made["millsim"] != version():
            say(f"    {name}: the kept table of version {made['millsim']} is used; this is version {version()}")
        return pandas.read_parquet(path), made["wall"]

    def picture(self, name, kind, figure, *options):
        """One of the pictures (contour, slices, beside, ...) that `mill study` draws of a kept table, in this folder
        as `figure`."""
        drawn = self.scratch / "drawn.png"
        self.mill("study", KEPT / f"{name}.parquet", "--png", drawn, *options)
        shutil.copyfile(self.scratch / f"drawn-{kind}.png", self.folder / figure)
        self.figures.add(figure)

    def alike(self, name):
        """The designs of a kept table expected within 2 % of the best, by the surface through all runs: list of (n,
        h [m])."""
        _, view = opened(str(KEPT / f"{name}.parquet"))
        objective = next(o for o in view.objectives if o.path == MEDIAN)
        found = optimum.find(view, objective)
        chosen = view.designs[found.alike]
        return list(zip(chosen[N].astype(int), chosen[H].astype(float)))

    def measure(self, designs, seeds, precision, *sets):
        """Designs (n, h [m]) measured anew, with seeds that no study used: the medians, shape (designs, seeds)."""
        study = Study(FIGURE7, [f"study.precision={precision}", *sets])
        orders = [value.order for value in study.fixed]

        def one(job):
            design, seed = job
            n, h = designs[design]
            path = self.scratch / f"measured-{design}-{seed}.h5"
            words = [
                *orders,
                f"{N}={n}",
                f"{H}={h!r} m",
                f"run.seed={seed}",
                f"run.precision={precision}",
                "output.frames=0 s",
            ]
            options = [word for order in words for word in ("-s", order)]
            done = subprocess.run(
                [self.program, "-q", "-f", "-o", path, *options, study.deck],
                capture_output=True,
                text=True,
                check=False,
            )
            if done.returncode != 0:
                raise RuntimeError(done.stderr.strip())
            with h5py.File(path) as file:
                value = float(file["statistics"][MEDIAN][()])
            path.unlink()
            return value

        jobs = [(design, seed) for design in range(len(designs)) for seed in seeds]
        with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
            return np.array(list(pool.map(one, jobs))).reshape(len(designs), len(seeds))


def best(table):
    """(n, h [m]) of the design with the largest median among those that are done."""
    done = table[table.status == "done"]
    row = done.loc[done[MEDIAN].idxmax()]
    return int(row[N]), float(row[H])


def named(design):
    """A design in words."""
    return f"n = {design[0]}, h = {1e3 * design[1]:g} mm"
