"""A fuzz target for the Python reader of output files: bytes become an output file; all that the reader offers is asked
of it. What is claimed: every answer is a value or a UserError, soon, in little memory.

    python tests/fuzz/fuzz_reader.py SECONDS [SEED [CORPUS [FINDS]]]    mutates files of the corpus
    python tests/fuzz/fuzz_reader.py FILE ...                           replays files

Inputs are compressed (zlib): a whole output file is some 10 kB so. A mutant changes bits, bytes and numbers of a
file, and joins pieces of two.
"""

import contextlib
import os
import pathlib
import random
import resource
import signal
import sys
import tempfile
import time
import traceback
import zlib

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[1]
sys.path.insert(0, str(ROOT / "tools"))

MEMORY = 2 << 30  # [bytes]
SECONDS = 20  # for one input
BATCH = 50  # inputs in one process


def ask(path):
    """Asks the reader for everything; what UserError refuses is refused."""
    from milltools.base.errors import UserError
    from milltools.geometry import contour
    from milltools.geometry.bodies import read
    from milltools.geometry.trajectory import stored
    from milltools.read import motions, runfile

    try:
        run = runfile.Run(path)
    except UserError:
        return
    names = (
        "program", "version", "status", "notes", "time", "cost", "has_rotor", "rotor_speed", "kinds", "absent",
        "contacts", "motions", "driven", "period", "vessel", "vessel_kinds", "carrier", "window", "duration",
        "has_statistics",
    )  # fmt: skip
    asked = [lambda name=name: getattr(run, name) for name in names]
    asked += [
        run.deck, lambda: run.as_deck.sections, run.deck_text, lambda: run.as_deck.blades, run.series_names,
        run.species_names, run.frame_times, run.drive_work, run.vessel_frame, run.need_statistics,
        lambda: read(run), lambda: stored(run, 0), lambda: run.poses(0), lambda: run.frame_axis(run.first_poses()),
        lambda: motions.speeds(run), lambda: [motions.words(run, name) for name in run.motions],
        lambda: run.mapped, lambda: contour.of(run.as_deck),
    ]  # fmt: skip
    asked += [lambda name=name: run.balls(name) for name in ("id", "species", "mass", "diameter")]
    for view in ("cross_section", "axial"):
        asked += [lambda view=view: run.edges(view)]
        asked += [
            lambda view=view, name=name: run.map(name, view)
            for name in ("solid_fraction", "dissipation", "impact_count")
        ]
    for row in ("all", "ball_ball", "ball_drum"):
        for speed in ("normal_speed", "tangential_speed", "normal_energy", "dissipated_energy"):
            asked += [lambda row=row, speed=speed: run.histogram(row, speed=speed).above(0.5)]
    asked += [lambda name=name: run.known(name) for name in runfile.estimates(("ball_ball",))]
    with run:
        for call in asked:
            with contextlib.suppress(UserError):
                call()
        groups = []
        for group in ("run", "deck", "observables", "statistics", "particles", "impacts", "VTKHDF"):
            with contextlib.suppress(UserError):
                groups += run.datasets(group)
        for path, *_ in groups:
            for index in ((), 0):
                with contextlib.suppress(UserError):
                    run.read(path, index)
        with contextlib.suppress(UserError):
            for name in run.series_names():
                run.series(name)


def mutant(chance, inputs):
    """New bytes from those of the corpus."""
    content = bytearray(chance.choice(inputs))
    if chance.random() < 0.2:
        other = chance.choice(inputs)
        start, length = chance.randrange(len(content)), chance.randrange(1, 4096)
        content[start : start + length] = other[start : start + length]
    for _ in range(2 ** chance.randrange(6)):
        at = chance.randrange(len(content))
        way = chance.randrange(4)
        if way == 0:
            content[at] ^= 1 << chance.randrange(8)
        elif way == 1:
            content[at] = chance.choice((0, 1, 0x7F, 0x80, 0xFF, chance.randrange(256)))
        elif way == 2:
            width = chance.choice((2, 4, 8))
            number = chance.choice((0, 1, -1, 1 << 31, 1 << 40, 1 << 62, chance.getrandbits(63)))
            content[at : at + width] = (number % (1 << 8 * width)).to_bytes(width, "little")
        elif len(content) > 2048:
            length = chance.randrange(1, 64)
            start = chance.randrange(len(content) - length)
            content[at : at + length] = content[start : start + length]
    return bytes(content)


def bounded(call):
    """A call in a fork whose memory and time are bounded; its status."""
    pid = os.fork()
    if pid == 0:
        status = 1
        try:
            resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
            call()
            status = 0
        except BaseException:
            traceback.print_exc()
        os._exit(status)
    return os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])


def try_all(contents, path, told):
    """Asks for one content after the other; how far it is goes into the file `told`."""
    for number, content in enumerate(contents):
        told.write_text(str(number))
        path.write_bytes(content)
        signal.alarm(SECONDS)
        ask(path)
    signal.alarm(0)


def fuzz(seconds, seed, corpus, finds):
    """Exit status: 1 if something was found."""
    import milltools.geometry.bodies
    import milltools.geometry.trajectory  # noqa: F401 - once, before processes are forked

    inputs = [zlib.decompress(path.read_bytes()) for path in sorted(corpus.iterdir())]
    chance, end, tried = random.Random(seed), time.monotonic() + seconds, 0
    with tempfile.TemporaryDirectory(prefix="mill-") as name:
        path, told = (pathlib.Path(name) / file for file in ("input.h5", "told"))
        while time.monotonic() < end:
            batch = [mutant(chance, inputs) for _ in range(BATCH)]
            status = bounded(lambda: try_all(batch, path, told))  # noqa: B023
            if status:
                content = batch[int(told.read_text())]
                finds.mkdir(parents=True, exist_ok=True)
                find = finds / f"reader-{zlib.crc32(content):08x}"
                find.write_bytes(zlib.compress(content, 9))
                print(
                    f"fuzz reader: found something (status {status}, seed {seed}); the input: {find}", file=sys.stderr
                )
                return 1
            tried += BATCH
    print(f"fuzz reader: {tried} inputs in {seconds} s, nothing found")
    return 0


def main(words):
    if words and words[0].isdigit():
        seconds, seed, corpus, finds, *_ = [*words, *[None] * 4][:4]
        seed = int(seed) if seed else random.randrange(1 << 30)
        return fuzz(
            int(seconds),
            seed,
            pathlib.Path(corpus or HERE / "corpus/reader"),
            pathlib.Path(finds or ROOT / "build/fuzz/finds"),
        )
    for word in words:
        with tempfile.TemporaryDirectory(prefix="mill-") as name:
            path = pathlib.Path(name) / "input.h5"
            path.write_bytes(zlib.decompress(pathlib.Path(word).read_bytes()))
            if bounded(lambda: (signal.alarm(SECONDS), ask(path))):  # noqa: B023
                print(f"fuzz reader: {word}", file=sys.stderr)
                return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
