"""Output files as a stranger may send them: damaged, or made to harm; and what every command does with them.

    python tests/tools/hostile.py [FILES [SEED]]

crafts so many files from a small run (all of them without a number), opens each with every command, and prints what
ended neither well nor in one line. Commands run in forks of one process whose memory is bounded.
"""

import contextlib
import os
import pathlib
import random
import re
import resource
import shutil
import signal
import sys
import tempfile
import traceback
import zlib

import h5py
import numpy as np

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parents[1] / "tools"), str(HERE), str(HERE.parent)]

MEMORY = 3 << 30  # [bytes]
SECONDS = 60
SECRET = "kept-out-of-every-page"
HUGE = 1 << 40  # rows: 8 TiB of float64

DATASETS = (
    "deck/balls.steel/diameter", "deck/balls.steel/count", "deck/run/sample_from", "deck/output/frames",
    "deck/drum/radius", "deck/drum/length", "deck/drum/profile", "deck/rotor/speed", "deck/rotor/shaft_radius",
    "deck/blades/count", "deck/blades/tip_radius", "deck/gravity/acceleration", "deck/text", "run/version",
    "run/status", "run/time", "run/notes", "run/command", "run/cpu_time", "run/events/collisions/ball_ball",
    "run/energy_balance_error", "run/reach/ring/value", "observables/kinetic_energy/value",
    "observables/kinetic_energy/time", "observables/rotor_work/value", "observables/dissipation/ball_drum/value",
    "observables/fast_collisions/ball_ball/value", "observables/pose/rotor/rotation/value",
    "observables/pose/rotor/centre/value", "particles/trajectory/id", "particles/trajectory/species",
    "particles/trajectory/mass", "particles/trajectory/diameter", "particles/trajectory/position/value",
    "particles/trajectory/velocity/value", "particles/trajectory/position/time", "particles/trajectory/position/step",
    "impacts/time", "impacts/kind", "impacts/ball", "impacts/partner", "impacts/position", "impacts/normal_speed",
    "statistics/duration", "statistics/impacts/all/count", "statistics/impacts/ball_ball/rate",
    "statistics/impacts/ball_ball/normal_speed/histogram/edges",
    "statistics/impacts/ball_ball/normal_speed/histogram/count", "statistics/impacts/all/normal_speed/quantiles",
    "statistics/impacts/all/normal_speed/median_above_floor", "statistics/maps/samples",
    "statistics/maps/cross_section/solid_fraction", "statistics/maps/cross_section/y_edges",
    "statistics/maps/axial/dissipation", "statistics/energies/edges", "statistics/energies/ball_ball/normal",
    "statistics/rotor/power", "statistics/precision/rate/all/standard_error", "VTKHDF/drum/Points",
    "VTKHDF/drum/Polygons/Connectivity", "VTKHDF/rotor/CellData/kind", "VTKHDF/rotor/NumberOfPoints",
    "VTKHDF/rotor/Steps/PointOffsets", "statistics/energies/ball_drum/total",
    "statistics/energies/blocks/ball_ball/normal",
    "statistics/energies/blocks/period", "statistics/wear/part", "statistics/wear/face", "statistics/wear/area",
    "statistics/wear/cells", "statistics/wear/lattices", "statistics/wear/parts/kind", "statistics/wear/parts/motion",
    "statistics/wear/parts/axes", "statistics/wear/mesh/facet", "statistics/wear/mesh/points",
)  # fmt: skip
GROUPS = (
    "deck/drum", "deck/rotor", "deck/blades", "observables", "observables/kinetic_energy", "observables/pose/rotor",
    "particles", "particles/trajectory", "particles/trajectory/position", "impacts", "statistics",
    "statistics/impacts/ball_ball", "statistics/maps", "statistics/maps/axial", "statistics/energies",
    "statistics/rotor", "statistics/precision", "run/events", "VTKHDF", "VTKHDF/drum",
)  # fmt: skip


def put(file, path, values, **how):
    """A dataset instead of the one that is there, with its attributes."""
    attributes = dict(file[path].attrs) if path in file else {}
    if path in file:
        del file[path]
    thing = file.create_dataset(path, data=values, **how)
    thing.attrs.update(attributes)
    return thing


def changed(change):
    """A way to damage by what becomes of the values."""

    def craft(file, path):
        values = file[path][()]
        if isinstance(values, bytes):
            number, _, unit = values.decode().partition(" ")
            try:
                values = f"{np.ravel(change(np.array(float(number))))[0]:g} {unit}"
            except (ValueError, IndexError):
                values = ""
        else:
            values = change(np.asarray(values))
        put(file, path, values)

    return craft


def huge(file, path):
    shape = file[path].shape or (1,)
    attributes = dict(file[path].attrs)
    del file[path]
    file.create_dataset(path, (HUGE, *shape[1:]), "f8", chunks=(1024, *shape[1:]), compression="gzip").attrs.update(
        attributes
    )


def bomb(file, path):
    """2 MB that unpack to 2 GB, as many small pieces."""
    shape, kind = file[path].shape, file[path].dtype
    kind = kind if kind.kind in "iuf" else np.dtype("f8")
    attributes = dict(file[path].attrs)
    del file[path]
    row = int(np.prod(shape[1:])) * kind.itemsize
    rows = max((1 << 22) // row, 1)
    size = rows * 500
    thing = file.create_dataset(path, (size, *shape[1:]), kind, chunks=(rows, *shape[1:]), compression="gzip")
    packed = zlib.compress(bytes(rows * row), 9)
    for start in range(0, size, rows):
        thing.id.write_direct_chunk((start, *[0] * (len(shape[1:]))), packed)
    thing.attrs.update(attributes)


def bomb_in_a_piece(file, path):
    """One piece that unpacks to far more than it should be."""
    shape, kind = file[path].shape, file[path].dtype
    if not shape or kind.kind == "O":
        return changed(lambda v: np.full((3, 3), 7.0))(file, path)
    thing = put(file, path, file[path][()], chunks=shape, compression="gzip")
    packer, size = zlib.compressobj(9), 1 << 24
    first, again = (packer.compress(bytes(size)) + packer.flush(zlib.Z_FULL_FLUSH) for _ in range(2))
    total = ((64 * size % 65521) << 16 | 1).to_bytes(4, "big")  # Adler-32 of so many zeros
    packed = first + 63 * again + b"\3\0" + total
    thing.id.write_direct_chunk((0,) * len(shape), packed)


def elsewhere(file, path):
    secret = pathlib.Path(file.filename).with_name("secret.txt")
    attributes = dict(file[path].attrs)
    del file[path]
    thing = file.create_dataset(path, (1,), "S40", external=[(str(secret), 0, 40)])
    thing.attrs.update(attributes)


def virtual(file, path):
    shape, kind = file[path].shape, file[path].dtype
    layout = h5py.VirtualLayout(shape or (1,), kind if kind.kind in "iuf" else "f8")
    layout[...] = h5py.VirtualSource(str(pathlib.Path(file.filename).with_name("other.h5")), "x", shape or (1,))
    del file[path]
    file.create_virtual_dataset(path, layout)


def linked(link):
    def craft(file, path):
        del file[path]
        file[path] = link(file, path)

    return craft


def reference(file, path):
    put(file, path, file["run"].ref, dtype=h5py.ref_dtype)


def fixed_text(file, path):
    values = file[path][()]
    put(file, path, np.bytes_(values) if isinstance(values, bytes) else np.bytes_(b"12 caf\xe9"))


def compound(file, path):
    put(file, path, np.zeros(file[path].shape, [("a", "f8"), ("b", "i4")]))


def attributes(change):
    def craft(file, path):
        thing = file[path]
        for name in list(thing.attrs):
            value = change(file, thing.attrs[name])
            del thing.attrs[name]
            if value is not None:
                thing.attrs[name] = value

    return craft


WAYS = {
    "missing": lambda file, path: file.__delitem__(path),
    "nan": changed(lambda v: np.full(v.shape, np.nan)),
    "inf": changed(lambda v: np.full(v.shape, np.inf)),
    "zero": changed(np.zeros_like),
    "negative": changed(lambda v: -np.abs(v.astype("f8")) - 1),
    "1e300": changed(lambda v: np.full(v.shape, 1e300)),
    "1e9": changed(lambda v: np.full(v.shape, 1e9)),
    "2^62": changed(lambda v: np.full(v.shape, 1 << 62)),
    "noise": changed(lambda v: np.random.default_rng(1).normal(size=v.shape)),
    "turned": changed(lambda v: v[::-1] if v.ndim else v + 1),
    "one-nan": changed(lambda v: np.where(np.arange(v.size).reshape(v.shape) == v.size // 2, np.nan, v)),
    "longer": changed(lambda v: np.concatenate([v, v[-1:]]) if v.ndim else np.array([v, v])),
    "shorter": changed(lambda v: v[:-1] if v.ndim else np.zeros(0)),
    "none": changed(lambda v: v[:0] if v.ndim else np.zeros((0, 3))),
    "flat": changed(np.ravel),
    "deep": changed(lambda v: v[..., None]),
    "text": lambda file, path: put(file, path, "=HYPERLINK(\x1b[31m\u202e)"),
    "empty-text": lambda file, path: put(file, path, ""),
    "fixed-text": fixed_text,
    "reference": reference,
    "compound": compound,
    "complex": changed(lambda v: v.astype(complex)),
    "empty": lambda file, path: put(file, path, h5py.Empty("f8")),
    "huge": huge,
    "bomb": bomb,
    "piece": bomb_in_a_piece,
    "elsewhere": elsewhere,
    "virtual": virtual,
    "soft-loop": linked(lambda file, path: h5py.SoftLink("/" + path)),
    "soft-nowhere": linked(lambda file, path: h5py.SoftLink("/nowhere")),
    "external": linked(lambda file, path: h5py.ExternalLink("other.h5", "/x")),
    "external-text": linked(lambda file, path: h5py.ExternalLink("secret.txt", "/x")),
    "group": lambda file, path: (file.__delitem__(path), file.create_group(path)),
    "no-attributes": attributes(lambda file, value: None),
    "number-attributes": attributes(lambda file, value: np.arange(3.0)),
    "text-attributes": attributes(lambda file, value: "x\x1b[2J\u202e"),
    "reference-attributes": attributes(lambda file, value: file["run"].ref),
    "many-attributes": attributes(lambda file, value: np.array(["n" * 9] * 3000, object)),
}
GROUP_WAYS = {
    "missing": WAYS["missing"],
    "hard-loop": lambda file, path: file[path].__setitem__("loop", file[path]),
    "loop-to-the-top": lambda file, path: file[path].__setitem__("up", file["/"]),
    "soft-loop": WAYS["soft-loop"],
    "external": WAYS["external"],
    "dataset": lambda file, path: (file.__delitem__(path), file.create_dataset(path, data=np.arange(5.0))),
    "empty": WAYS["group"],
    "evil-name": lambda file, path: file.copy(file[path], f"{path}/=cmd|' \x1b]0;x\x07\u202e"),
}


def species_of(names):
    def craft(path):
        with h5py.File(path, "r+") as file:
            thing = file["particles/trajectory/species"]
            del thing.attrs["names"]
            thing.attrs["names"] = names

    return craft


def no_balls(path):
    with h5py.File(path, "r+") as file:
        for name in ("id", "species", "mass", "diameter"):
            put(file, f"particles/trajectory/{name}", file[f"particles/trajectory/{name}"][:0])
        for name in ("position", "velocity", "angular_velocity"):
            put(file, f"particles/trajectory/{name}/value", file[f"particles/trajectory/{name}/value"][:, :0])


def all_nan(path):
    with h5py.File(path, "r+") as file:
        names = []
        file.visititems(
            lambda name, thing: (
                names.append(name) if isinstance(thing, h5py.Dataset) and thing.dtype.kind == "f" else None
            )
        )
        for name in names:
            if not name.startswith("VTKHDF/balls"):
                file[name][...] = np.nan


def cut(share):
    def craft(path):
        os.truncate(path, int(share * path.stat().st_size))

    return craft


def flipped(seed, bits):
    def craft(path):
        content, chance = bytearray(path.read_bytes()), random.Random(seed)
        for _ in range(bits):
            content[chance.randrange(len(content))] ^= 1 << chance.randrange(8)
        path.write_bytes(content)

    return craft


def crafted(seed=1):
    """{name: function(path of a copy)}: what can be wrong, in an order by chance."""

    def inside(way, where):
        def craft(path):
            with h5py.File(path, "r+") as file:
                way(file, where)

        return craft

    found = {f"{w}:{p}": inside(way, p) for p in DATASETS for w, way in WAYS.items()}
    found |= {f"{w}:{p}/": inside(way, p) for p in GROUPS for w, way in GROUP_WAYS.items()}
    found |= {f"flip{k}": flipped(k, (1, 8, 50)[k % 3]) for k in range(60)}
    found |= {f"cut{share}": cut(share) for share in (0.001, 0.1, 0.5, 0.9, 0.999)}
    found |= {"no-balls": no_balls, "all-nan": all_nan}
    found["species-text"] = species_of(np.array(["=1+1", "\x1b[31m\u202eb"], object))
    found["species-fixed"] = species_of(np.array([b"steel", b"glass"]))
    found["species-one"] = species_of(np.array(["steel"], object))
    names = list(found)
    random.Random(seed).shuffle(names)
    found["as-is"] = lambda path: None
    names.insert(0, "as-is")
    return {name: found[name] for name in names}


FIGURES = ("speeds", "energies", "section-power", "axial-velocity", "power", "energy", "collisions", "wear")


def commands(path, base, out):
    """What is called with a file: {what: words}."""
    found = {
        "plot": ["plot", path, out / "o.png"],
        "compare": ["compare", base, path, "--csv", out / "c.csv", "--html", out / "c.html"],
        "report": ["report", path, "-o", out / "r.html", "--rerun", "never"],
        "gsd": ["export", path, out / "b.gsd"],
        "vtp": ["export", path, out / "b.vtp"],
        "pvd": ["export", path, out / "b.pvd"],
        "vtp mill": ["export", path, out / "m.vtp", "--what", "mill"],
        "pvd mill": ["export", path, out / "m.pvd", "--what", "mill"],
        "stl": ["export", path, out / "m.stl", "--time", "30 ms"],
        "wear": ["wear", path],
        "dose": ["dose", path],
        "render": ["render", path, out / "s.png", "--size", "64x64"],
        "pov": ["render", path, out / "s.pov", "--size", "64x64", "--pov"],
    }
    found |= {
        f"csv {w}": ["export", path, out / f"{w}.csv", "--what", w]
        for w in ("balls", "series", "impacts", "spectra", "summary")
    }
    found |= {f"figure {f}": ["plot", "--figure", f, path, out / "f.png"] for f in FIGURES}
    return {name: [*map(str, words)] for name, words in found.items()}


def bounded(call, log):
    """A call in a fork with its output in a file; its exit status, or what ended it."""
    pid = os.fork()
    if pid == 0:
        status = 99
        with contextlib.suppress(BaseException):
            handle = os.open(log, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
            os.dup2(handle, 1)
            os.dup2(handle, 2)
            sys.stdout = sys.stderr = open(handle, "w", encoding="utf-8", errors="replace")
            resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
            resource.setrlimit(resource.RLIMIT_CPU, (SECONDS, SECONDS))
            signal.alarm(4 * SECONDS)
            try:
                status = call()
            except BaseException:
                traceback.print_exc()
                status = 98
            sys.stdout.flush()
            sys.stderr.flush()
        os._exit(status)
    return os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])


def main(words):
    from milltools import __main__ as mill

    sys.argv = ["mill", *words]
    return mill.main()


def wrong(status, said):
    """What is wrong with a command's end, "" if nothing."""
    if SECRET in said:
        return "another file's content"
    if status not in (0, 1, 2) or "Traceback" in said:
        return f"status {status}: {said.strip().splitlines()[-1] if said.strip() else 'nothing said'}"
    lines = [
        line
        for line in said.splitlines()
        if line.startswith("mill ") and ": note: " not in line and not re.search(r" s left|, \d+ %$", line)
    ]
    if status == 2 and len(lines) != 1:
        return f"{len(lines)} lines: {said[:300]}"
    return ""


def finds(base, files, some=lambda name, what: True):
    """(file, command, what is wrong) of all that ends as it must not; prints nothing."""
    import matplotlib  # what commands import, once

    matplotlib.use("agg")
    import milltools.compare.command, milltools.export.command, milltools.figures, milltools.figures.command, milltools.report.command  # noqa

    with tempfile.TemporaryDirectory(prefix="mill-") as name:
        folder = pathlib.Path(name)
        (folder / "secret.txt").write_text(SECRET.ljust(40))
        with h5py.File(folder / "other.h5", "w") as file:
            file["x"] = SECRET
        for name, craft in files.items():
            path = folder / "hostile.h5"
            calls = {w: words for w, words in commands(path, base, folder / "out").items() if some(name, w)}
            if not calls:
                continue
            shutil.copyfile(base, path)
            craft(path)
            for what, words in calls.items():
                out = folder / "out"
                out.mkdir()
                status = bounded(lambda: main(words), folder / "log")  # noqa: B023
                said = (folder / "log").read_text(errors="replace")
                fault = wrong(status, said)
                if name == "as-is" and status:
                    fault = f"status {status} of the run as it is: {said}"
                if any(SECRET.encode() in p.read_bytes() for p in out.rglob("*") if p.is_file()):
                    fault = "another file's content is in the output"
                if status and list(out.iterdir()):
                    fault = fault or f"status {status}, but there is {next(out.iterdir()).name}"
                yield name, what, fault, said
                shutil.rmtree(out)
            path.unlink()


if __name__ == "__main__":
    from export_run import make

    number = int(sys.argv[1]) if len(sys.argv) > 1 else None
    seed = int(sys.argv[2]) if len(sys.argv) > 2 else 1
    only = sys.argv[3:]
    with tempfile.TemporaryDirectory(prefix="mill-") as name:
        base, seen, tried, found = make(pathlib.Path(name)), set(), 0, 0
        files = dict(list(crafted(seed).items())[:number])
        every = [(file, what) for file in files for what in commands(base, base, base.parent)]
        pairs = int(os.environ.get("PAIRS", len(every)))  # so many of all, and so many on the run as it is
        good = [pair for pair in every if pair[0] == "as-is"]
        chosen = {pair for group in (every, good) for pair in random.Random(seed).sample(group, min(pairs, len(group)))}
        with contextlib.suppress(KeyboardInterrupt):  # enough
            for file, what, fault, said in finds(
                base, files, lambda *pair: pair in chosen and (not only or pair[1] in only)
            ):
                seen.add(file)
                tried += 1
                if fault:
                    found += 1
                    print(f"{file} | {what} | {fault[:250]}", flush=True)
                    if os.environ.get("SHOW"):
                        print(said)
        print(f"{len(seen)} files, {tried} commands, {found} ended as they must not")
