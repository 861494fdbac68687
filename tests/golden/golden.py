"""Same deck, same bits: what a run stores, as one SHA-256 a group of its output file.

    golden.py PROGRAM...              runs the golden decks with each program: all must store the same
                                      values, on the reference platform those of hashes.json
    golden.py --freeze PROGRAM...     the same, and writes hashes.json
    golden.py --tell FILE.h5          the hashes of a file

README.md beside this file says what is hashed and when a frozen hash may change.
"""

import argparse
import concurrent.futures
import hashlib
import json
import os
import pathlib
import platform
import subprocess
import sys
import tempfile

import h5py

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[1]
FROZEN = HERE / "hashes.json"

# name: deck and overrides. Each covers another part of the program.
DECKS = {
    "single": ("input/single.ini", []),
    "simoloyer": ("input/simoloyer.ini", ["run.time=30 ms", "run.sample_from=10 ms"]),
    "wavy": (
        "input/simoloyer.ini",
        [
            "run.time=20 ms",
            "run.sample_from=5 ms",
            "drum.profile=wavy",
            "drum.buckles=9",
            "drum.buckle_height=8 mm",
            "drum.buckle_angle=7 deg",
            "blades.tip_radius=60 mm",
        ],
    ),  # fmt: skip
    "gas": ("input/gas.ini", ["run.time=50 ms", "run.sample_from=10 ms", "output.frames=10 ms"]),
    "mixture": (
        "input/mixture.ini",
        [
            "run.precision=0",
            "run.time=20 ms",
            "run.sample_from=5 ms",
            "balls.small.diameter=1.5 mm",
            "balls.small.mass=21 g",
            "balls.large.diameter=6 mm",
            "balls.large.mass=18 g",
            "drum.radius=25 mm",
            "drum.length=38 mm",
            "rotor.shaft_radius=6 mm",
            "blades.count=2",
            "blades.tip_radius=18 mm",
            "blades.width=6 mm",
            "blades.thickness=4 mm",
        ],
    ),
    "planetary": ("input/planetary.ini", ["run.time=300 ms", "run.sample_from=50 ms"]),
    "emax": ("input/emax.ini", ["run.time=80 ms", "run.sample_from=10 ms"]),
    "mixer": ("input/mixer.ini", ["run.time=300 ms", "run.sample_from=50 ms"]),
    "shaker": ("input/shaker.ini", ["run.time=300 ms", "run.sample_from=50 ms"]),
    "attritor": ("input/attritor.ini", ["run.time=80 ms", "run.sample_from=40 ms"]),
    "tumbling": ("input/tumbling.ini", ["run.time=300 ms", "run.sample_from=50 ms"]),
    "stl": ("input/stl.ini", ["run.time=60 ms", "run.sample_from=20 ms"]),
}

# In these groups all values are hashed, but for what depends on the machine or on where the deck lies
GROUPS = ("particles", "VTKHDF", "observables", "statistics", "impacts", "deck", "run")
APART = {
    *(f"/run/{name}" for name in ("version", "compiler", "flags", "hdf5", "gsl", "command")),
    *(f"/run/{name}" for name in ("started", "wall_time", "cpu_time", "peak_memory", "threads")),
    *("/run/checkpoints", "/run/checkpoint_time"),
    "/deck/balls/start",
    "/deck/body.rotor/file",
    "/deck/text",
}


def is_reference():
    """Is this the platform of the frozen hashes: Debian 12, x86-64?"""
    try:
        system = platform.freedesktop_os_release()
    except OSError:
        return False
    version = (system.get("ID"), system.get("VERSION_ID"))
    return version == ("debian", "12") and platform.machine() == "x86_64"


def fingerprint(path):
    """{group: SHA-256 over name, type, shape and raw bytes of its datasets, in the order of names}"""
    digests = {}

    def add(name, item):
        if isinstance(item, h5py.Dataset) and f"/{name}" not in APART:
            values = item[()]
            text = values if isinstance(values, bytes) else values.tobytes()
            head = f"{name} {item.dtype.str} {item.shape} {len(text)}\n"
            inner = "energies" if name.startswith("statistics/energies/") else name.split("/")[0]
            digests.setdefault(inner, hashlib.sha256()).update(head.encode() + text)

    with h5py.File(path) as file:
        for group in GROUPS:
            if group in file:
                file[group].visititems(lambda name, item, group=group: add(f"{group}/{name}", item))
    return {group: digest.hexdigest() for group, digest in digests.items()}


def run(program, name, folder):
    """The fingerprint of a golden deck as this program runs it."""
    deck, orders = DECKS[name]
    output = pathlib.Path(folder) / f"{name}.h5"
    sets = [word for order in orders for word in ("--set", order)]
    subprocess.run(
        [program, "--quiet", "--force", "--output", output, *sets, ROOT / deck],
        check=True,
        stdout=subprocess.DEVNULL,
    )
    return fingerprint(output)


def differing(one, other):
    """The groups in which two fingerprints differ."""
    return sorted(group for group in one.keys() | other.keys() if one.get(group) != other.get(group))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--freeze", action="store_true", help="write hashes.json")
    parser.add_argument("--tell", action="store_true", help="print the hashes of output files")
    parser.add_argument("path", nargs="+", type=pathlib.Path, help="programs, or files with --tell")
    order = parser.parse_args()
    if order.tell:
        print(json.dumps({str(path): fingerprint(path) for path in order.path}, indent=2))
        return 0
    wrong = 0
    found = {}
    with tempfile.TemporaryDirectory() as folder:
        runs = [(program, name) for name in DECKS for program in order.path]
        folders = [tempfile.mkdtemp(dir=folder) for _ in runs]
        with concurrent.futures.ThreadPoolExecutor(len(os.sched_getaffinity(0))) as pool:
            made = pool.map(lambda one, place: run(one[0].resolve(), one[1], place), runs, folders)
            for (program, name), marks in zip(runs, made):
                differ = differing(marks, found.setdefault(name, marks))
                wrong += bool(differ)
                said = f"differs from {order.path[0]} in {', '.join(differ)}" if differ else "same bits"
                print(f"golden: {name:<10} {program}: {said}", flush=True)
    if order.freeze and not wrong:
        FROZEN.write_text(json.dumps(found, indent=2) + "\n")
    elif is_reference():
        frozen = json.loads(FROZEN.read_text())
        for name, marks in found.items():
            if differ := differing(marks, frozen.get(name, {})):
                wrong += 1
                print(f"golden: {name:<10} is not as frozen: {', '.join(differ)}; see {HERE.name}/README.md")
    else:
        print("golden: hashes.json is not compared: it was frozen on Debian 12, x86-64")
    return wrong > 0


if __name__ == "__main__":
    sys.exit(main())
