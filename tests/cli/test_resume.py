"""Interrupted runs: --resume goes on to the same bits, and the output file is whole at every moment."""

import os
import random
import re
import shutil
import signal
import subprocess
import time

import h5py
import pytest
from conftest import PROGRAM, SMALL, some
from results import OWN, differences, status

# Two kinds of balls, blades, friction, everything recorded; a quarter of a second of processor time, so that a signal
# sent after the first checkpoint finds it running
SHORT = """\
[run]
time = 0.45 s
sample_from = 50 ms
seed = 3
[balls.steel]
count = 250
diameter = 5 mm
density = 7800 kg/m^3
[balls.glass]
count = 120
diameter = 4 mm
density = 2500 kg/m^3
[drum]
radius = 50 mm
length = 70 mm
[rotor]
speed = 1000 rpm
shaft_radius = 12 mm
[blades]
count = 3
tip_radius = 43 mm
width = 10 mm
thickness = 6 mm
pitch = 20 deg
[contact]
restitution = 0.8
friction = 0.3
tangential_restitution = 0.4
[output]
frames = 5 ms
series = 1 ms
impacts = all
checkpoint = 10 ms
"""
# One that nobody waits for
ENDLESS = SHORT.replace("time = 0.45 s", "time = 1000 s").replace("impacts = all\n", "")

# Where two runs differ that had checkpoints at different intervals
INTERVAL = ("/deck/output/checkpoint", "/deck/text")
GROWING = ("/observables/rotor_work/value", "/particles/trajectory/position/value", "/impacts/time")


class Folder:
    """A folder with a deck, mill.ini, in which runs are started."""

    def __init__(self, path, deck):
        self.path = path
        self.file = path / "mill.h5"
        (path / "mill.ini").write_text(deck)

    def start(self, *arguments):
        return subprocess.Popen(
            [PROGRAM, *map(str, arguments), "mill.ini"],
            cwd=self.path,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
        )

    def run(self, *arguments):
        """Status, and what was said on standard error."""
        process = self.start(*arguments)
        said = process.communicate(timeout=120)[1]
        return process.returncode, said

    def finish(self, *arguments):
        done = self.run("-q", *arguments)
        assert done == (0, ""), done

    def stop(self, *arguments, number=signal.SIGINT, after=0.0, times=1):
        """Starts a run and sends it a signal `after` seconds after its first checkpoint, and soon again if `times`."""
        process = self.start(*arguments)
        self.await_checkpoint(process)
        time.sleep(after)
        for _ in range(times):
            process.send_signal(number)
            time.sleep(0.001)
        said = process.communicate(timeout=60)[1]
        return process.returncode, said

    def await_checkpoint(self, process):
        """A checkpoint of this run, at t > 0."""
        before = self.file.stat().st_ino if self.file.exists() else None
        for _ in range(3000):
            assert process.poll() is None, process.communicate()[1]
            if self.file.exists() and self.file.stat().st_ino != before and status(self.file)[1]:
                return
            time.sleep(0.01)
        pytest.fail("no checkpoint within 30 s")

    def names(self):
        return {entry.name for entry in self.path.iterdir()}


@pytest.fixture
def folder(tmp_path):
    """folder(deck) is a Folder with this deck, SHORT by default."""
    return lambda deck=SHORT: Folder(tmp_path, deck)


def undisturbed(tmp_path_factory, deck, *arguments):
    """The output of a run without any checkpoint."""
    whole = Folder(tmp_path_factory.mktemp("whole"), deck)
    whole.finish("-s", "output.checkpoint=1 h", *arguments)
    return whole.file


def assert_same(path, whole, apart_from=()):
    assert differences(path, whole, (*OWN, *INTERVAL, *apart_from)) == []


@pytest.fixture(scope="module")
def short(tmp_path_factory):
    """The output of the undisturbed run of SHORT."""
    return undisturbed(tmp_path_factory, SHORT)


@pytest.fixture(scope="module")
def stopped(tmp_path_factory):
    """The output of a stopped run of SHORT."""
    mill = Folder(tmp_path_factory.mktemp("stopped"), SHORT)
    assert mill.stop("-q")[0] == 130
    return mill.file


def one_line(said, *words):
    """It is one message, and holds these words; a slow machine shows its progress besides."""
    said = re.sub(r"^millsim: [\d.]+ s of .* left\n", "", said, flags=re.MULTILINE)
    assert said.startswith("millsim: ") and said.count("\n") == 1, said
    for word in words:
        assert word in said, said
    return True


# ---- kill -9 ----


def rows(path):
    with h5py.File(path, "r") as file:
        return [len(file[name]) for name in GROWING]


def assert_beginning_of(part, whole):
    """The growing data of the one file are those with which the other begins, to the bit."""
    with h5py.File(part, "r") as a, h5py.File(whole, "r") as b:
        for name in GROWING:
            held = a[name][:]
            assert held.tobytes() == b[name][: len(held)].tobytes(), name


def kill_after(folder, seconds, *arguments):
    """Kills a run after so long; whether it was still running, and what it had said."""
    process = folder.start(*arguments)
    try:
        process.wait(timeout=seconds)
    except subprocess.TimeoutExpired:
        process.kill()
    said = process.communicate()[1]
    assert process.returncode in (0, -signal.SIGKILL), said
    return process.returncode != 0, said


@pytest.mark.slow
@pytest.mark.parametrize("times", [6, pytest.param(50, marks=pytest.mark.thorough)])
def test_a_run_killed_many_times_ends_with_the_same_bits(folder, short, times):
    chance = random.Random(20070315)
    mill = folder()
    mill.stop("-q", number=signal.SIGKILL)
    began = time.monotonic()
    mill.stop("-q", "--resume", number=signal.SIGKILL)
    # how long a resumed run takes to a checkpoint, here and now; it changes with what else runs
    patience = time.monotonic() - began
    held, kills, resumed_at = rows(mill.file), 2, set()
    while kills < times:
        interval = f"output.checkpoint={chance.uniform(1, 40):.2f} ms"
        after = chance.uniform(0.0, 3.0 * patience)
        hit, said = kill_after(mill, after, "--resume", "-s", interval)
        kills += hit  # some come too late: the run was over
        if "resuming at t = " in said:
            at = float(said.split("resuming at t = ")[1].split()[0])
            patience *= 1.15 if at in resumed_at else 1.0  # the kill before came too early
            resumed_at.add(at)
        assert_beginning_of(mill.file, short)
        now = rows(mill.file)
        assert all(b >= a for a, b in zip(held, now)), (held, now)
        held = now
        if not hit:  # it came to its end: once more from the beginning
            patience *= 0.8
            assert_same(mill.file, short)
            mill.file.unlink()
            mill.stop("-q", number=signal.SIGKILL)
            held = rows(mill.file)
    print(f"{kills} kills, resumed at {len(resumed_at)} different times up to {max(resumed_at)} s")
    mill.run("-q", "--resume")
    assert_same(mill.file, short)
    assert mill.names() == {"mill.ini", "mill.h5"}
    assert min(resumed_at) > 0 and len(resumed_at) >= max(2, times // 5), resumed_at


@pytest.mark.slow
@pytest.mark.long
def test_a_run_killed_with_no_frames_before_its_statistics_begin_ends_with_the_same_bits(folder, tmp_path_factory):
    deck = SHORT.replace("frames = 5 ms", "frames = 0 s").replace("time = 0.45 s", "time = 1.5 s")
    deck = deck.replace("sample_from = 50 ms", "sample_from = 1.45 s")  # late: this test may come to kill late
    mill = folder(deck)
    for k in range(3):
        mill.stop("-q", *["--resume"][:k], number=signal.SIGKILL, after=0.01 * k)
        assert 0 < status(mill.file)[1] < 1.45
        with h5py.File(mill.file) as file:
            assert file["/statistics/duration"][()] == 0
    mill.finish("--resume")
    assert_same(mill.file, undisturbed(tmp_path_factory, deck))


@pytest.mark.slow
def test_without_a_file_or_its_first_checkpoint_a_resumed_run_starts_from_the_beginning(folder, short):
    mill = folder()
    process = mill.start("--resume", "-s", "output.checkpoint=1 h")
    while not mill.file.exists():
        assert process.poll() is None
        time.sleep(0.002)
    process.kill()
    assert one_line(process.communicate()[1], "mill.h5: does not exist yet: starting from the beginning")
    assert status(mill.file) == ("running", 0.0)
    code, said = mill.run("--resume")
    assert code == 0
    assert one_line(said, "mill.h5: ended before its first checkpoint: starting from the beginning")
    assert_same(mill.file, short)


@pytest.mark.slow
def test_what_a_killed_run_leaves_beside_its_file_is_cleared_up(folder, short):
    mill = folder()
    mill.stop("-q", number=signal.SIGKILL)
    assert "mill.h5.lock" in mill.names()
    mill.finish("--force")
    assert mill.names() == {"mill.ini", "mill.h5"}
    assert_same(mill.file, short)


# ---- signals ----


@pytest.mark.slow
@pytest.mark.parametrize(  # the second and third signals of the impatient change nothing
    "number, times", some([(signal.SIGINT, 3), (signal.SIGTERM, 1), (signal.SIGXCPU, 1), (signal.SIGHUP, 1)], 3)
)
def test_a_stopped_run_says_how_to_go_on_and_goes_on_to_the_same_bits(folder, short, number, times):
    mill = folder()
    code, said = mill.stop("-q", number=number, times=times)
    assert code == 128 + number
    assert one_line(said, "mill.h5 holds everything up to then", "--resume goes on")
    ended, reached = status(mill.file)
    assert ended == "stopped" and 0 < reached < 0.45
    assert_beginning_of(mill.file, short)
    assert mill.names() == {"mill.ini", "mill.h5"}
    code, said = mill.run("--resume")
    assert code == 0
    assert one_line(said, f"mill.h5: resuming at t = {reached:.6g} s")
    assert_same(mill.file, short)


@pytest.mark.slow
def test_a_forced_run_killed_before_its_first_checkpoint_leaves_the_old_file(folder, stopped):
    mill = folder(ENDLESS.replace("checkpoint = 10 ms", "checkpoint = 60 s"))
    shutil.copy(stopped, mill.file)
    process = mill.start("-q", "--force")
    part = mill.path / "mill.h5.part"
    while not part.exists() and process.poll() is None:
        time.sleep(0.01)
    time.sleep(0.2)
    process.kill()
    process.communicate()
    assert mill.file.read_bytes() == stopped.read_bytes()


@pytest.mark.slow
def test_stopped_and_resumed_again_and_again_ends_with_the_same_bits(folder, short):
    mill = folder()
    times = [0.0]
    for k in range(6):
        process = mill.start("-q", *["--resume"][:k])
        time.sleep(0.05)
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=60)
        if process.returncode == 0:
            break
        # on a busy machine the signal can come before the program's first instruction: then it is a shell's 130
        assert process.returncode in (130, -signal.SIGINT)
        if mill.file.exists():
            times.append(status(mill.file)[1])
    assert times == sorted(times)
    mill.run("-q", "--resume")
    assert_same(mill.file, short)


@pytest.mark.slow
def test_the_summary_of_a_resumed_run_is_that_of_an_undisturbed_one(folder, tmp_path):
    mill = folder()

    def table(*arguments):
        done = subprocess.run(
            [PROGRAM, "-q", *arguments, "mill.ini"],
            cwd=tmp_path, capture_output=True, text=True, check=True,
        )  # fmt: skip
        own = ("speed", "cost", "output", "millsim")
        return [line for line in done.stdout.splitlines() if not line.startswith(own)]

    whole = table("-o", "whole.h5")
    mill.stop("-q")
    assert table("--resume") == whole


@pytest.mark.slow
def test_wall_and_processor_time_are_those_of_all_legs(folder):
    mill = folder(ENDLESS)
    spent = []
    for k in range(3):
        mill.stop("-q", *["--resume"][:k], after=0.2)
        with h5py.File(mill.file) as file:
            spent.append(file["/run/wall_time"][()])
    assert spent[0] > 0.2 and spent[1] > spent[0] + 0.2 and spent[2] > spent[1] + 0.2, spent


# ---- what there is to resume ----


def test_a_complete_run_is_left_as_it_is(folder, short):
    mill = folder()
    shutil.copy(short, mill.file)
    bytes_, about = mill.file.read_bytes(), mill.file.stat()
    code, said = mill.run("--resume")
    assert code == 0
    assert one_line(said, "mill.h5: is complete: nothing to resume")
    assert mill.file.read_bytes() == bytes_
    after = mill.file.stat()
    assert (after.st_ino, after.st_mtime_ns) == (about.st_ino, about.st_mtime_ns)


@pytest.mark.parametrize(
    "change, key",
    [
        (("friction = 0.3", "friction = 0.31"), "friction"),
        (("seed = 3", "seed = 4"), "seed"),
        (("time = 0.45 s", "time = 0.5 s"), "time"),
        (("count = 3\n", "count = 2\n"), "count"),
        (("pitch = 20 deg\n", ""), "pitch"),
        (("impacts = all\n", ""), "impacts"),
        (("[balls.glass]", "[balls.aqua]"), "balls.glass"),
    ],
)
def test_another_deck_is_refused_by_its_key_and_the_file_left_alone(folder, stopped, change, key):
    mill = folder()
    bytes_ = shutil.copy(stopped, mill.file).read_bytes()
    deck = mill.path / "mill.ini"
    deck.write_text(SHORT.replace(*change))
    code, said = mill.run("-q", "--resume")
    assert code == 2
    assert one_line(said, "mill.h5: is of another deck: ", key, "--force")
    assert mill.file.read_bytes() == bytes_


def test_powder_heat_and_wear_may_change_and_the_finished_file_has_the_new_deck(folder, short, tmp_path_factory):
    """These sections do not change the run."""
    deck = SHORT + "[wear]\nhardness = 7 GPa\n[powder]\nmass = 1 g\ndensity = 2 g/cm^3\n"
    mill = folder()
    (mill.path / "mill.ini").write_text(deck)
    assert mill.stop("-q")[0] == 130
    heat = "".join(f"{key} = 1 J/kg/K\n" for key in ("ball_heat_capacity", "jar_heat_capacity"))
    heat += "jar_mass = 1 kg\nball_to_jar = 1 W/K\njar_to_room = 1 W/K\n"
    (mill.path / "mill.ini").write_text(deck.replace("7 GPa", "8 GPa").replace("1 g\n", "2 g\n") + "[heat]\n" + heat)
    mill.finish("--resume")
    assert_same(mill.file, short, apart_from=["/deck"])
    with h5py.File(mill.file) as file:
        said = {key: file["/deck"][key][()].decode() for key in ("powder/mass", "wear/hardness", "heat/jar_mass")}
        text = file["/deck/text"][()].decode()
    assert said == {"powder/mass": "0.002 kg", "wear/hardness": "8000000000 Pa", "heat/jar_mass": "1 kg"}
    assert "\nmass = 0.002 kg" in text and "\n[heat]" in text


def test_a_new_section_of_wear_is_another_deck(folder, stopped):
    mill = folder()
    shutil.copy(stopped, mill.file)
    code, said = mill.run("-q", "--resume", "-s", "wear.hardness=7 GPa")
    assert code == 2
    assert one_line(said, "its deck has no section [wear]")


@pytest.mark.slow
def test_another_setting_is_refused_and_the_same_one_goes_on_to_the_same_bits(folder, tmp_path_factory):
    """Of a slice with periodic ends."""
    setting = ("-s", "drum.ends=periodic")
    mill, whole = folder(), undisturbed(tmp_path_factory, SHORT.replace("[drum]", "[drum]\nends = periodic"))
    assert mill.stop("-q", *setting)[0] == 128 + signal.SIGINT
    bytes_ = mill.file.read_bytes()
    for other in ((), ("-s", "contact.ball_drum.restitution=0.61", *setting)):
        code, said = mill.run("-q", "--resume", *other)
        assert code == 2
        assert one_line(said, "contact.ball_drum" if other else "ends")
        assert mill.file.read_bytes() == bytes_
    mill.finish("--resume", *setting)
    assert_same(mill.file, whole)


@pytest.mark.slow
@pytest.mark.long
def test_the_folder_may_move_and_the_same_deck_in_other_words_is_the_same_deck(tmp_path):
    start = "".join(
        f"{x} {y} {z} 0 1 0\n"
        for x in (-0.016, -0.008, 0.0, 0.008, 0.016)
        for y, z in ((0.027, 0), (-0.027, 0), (0, 0.027), (0, -0.027))
    )
    deck = SMALL.replace("time = 50 ms", "time = 2 s").replace("count = 20", "count = 20\nstart = begin.txt")
    deck += "impacts = all\ncheckpoint = 1 ms\n"
    homes = []
    for name in ("here", "there"):
        (tmp_path / name).mkdir()
        homes.append(Folder(tmp_path / name, deck))
        (tmp_path / name / "begin.txt").write_text(start)
    homes[1].finish()
    assert homes[0].stop("-q", "-s", "run.time=2 s")[0] == 130
    moved = homes[0].path.rename(tmp_path / "elsewhere")
    mill = Folder(moved, "# my mill\n" + deck.replace("radius = 30 mm", "radius = 3e-2 m # the drum"))
    code, said = mill.run("--resume")
    assert code == 0 and "resuming at t = " in said
    assert_same(mill.file, homes[1].file, apart_from=["/deck"])


RIDDEN = """\
[run]
time = 1000 s
[motion.path]
kind = table
file = path.txt
[body.jar]
shape = sphere
side = inside
motion = path
radius = 20 mm
[balls]
count = 3
diameter = 5 mm
density = 7800 kg/m^3
[contact]
restitution = 0.8
[output]
checkpoint = 10 ms
"""
ROWS = "0 0 0 0 0 0 0\n0.01 1e-3 0 0 0 0 0\n0.02 0 {} 0 0 0 0\n0.03 0 0 0 0 0 0\n"


@pytest.mark.slow
def test_a_table_that_changed_since_is_refused_and_the_old_one_goes_on(folder):
    mill = folder(RIDDEN)
    table = mill.path / "path.txt"
    table.write_text(ROWS.format("1e-3"))
    mill.stop("-q")
    bytes_ = mill.file.read_bytes()
    table.write_text(ROWS.format("1.1e-3"))
    code, said = mill.run("-q", "--resume")
    assert code == 2
    assert one_line(said, "mill.h5: a table or mesh of its deck has changed since", "--force")
    assert mill.file.read_bytes() == bytes_
    table.write_text("# the same\n" + ROWS.format("0.001"))
    process = mill.start("-q", "--resume")
    with pytest.raises(subprocess.TimeoutExpired):
        process.wait(0.1)
    process.send_signal(signal.SIGINT)
    process.communicate()
    assert process.returncode == 130


# ---- files that cannot be resumed ----


def assert_refused(mill, code, *words):
    bytes_ = mill.file.read_bytes()
    got, said = mill.run("-q", "--resume")
    assert (got, one_line(said, "mill.h5: ", *words)) == (code, True), said
    assert mill.file.read_bytes() == bytes_
    assert mill.names() == {"mill.ini", "mill.h5"}


# Of the head, of the balls, of the statistics, of who writes as it goes
@pytest.mark.parametrize(
    "name", ["run/cost", "loop/sizes", "loop/now", "loop/ball", "loop/plan", "loop/cell", "statistics/progress",
             "statistics/now_strikes_spectra", "statistics/now_flow", "frames/rows", "series/rows"]
)  # fmt: skip
def test_a_damaged_checkpoint_is_refused(folder, stopped, name):
    mill = folder()
    shutil.copy(stopped, mill.file)
    with h5py.File(mill.file, "r+") as file:
        data = file["/checkpoint"][name].id
        where = data.get_chunk_info(0).chunk_offset
        filters, chunk = data.read_direct_chunk(where)
        changed = bytearray(chunk)
        changed[len(chunk) // 3] ^= 0x10
        data.write_direct_chunk(where, bytes(changed), filters)
    assert_refused(mill, 1, f"damaged: /checkpoint/{name}", "--force")


@pytest.mark.parametrize("share", [0.0, 0.1, 0.5, 0.9, 0.999])
def test_a_file_cut_short_is_refused(folder, stopped, share):
    mill = folder()
    bytes_ = stopped.read_bytes()
    mill.file.write_bytes(bytes_[: int(share * len(bytes_))])
    assert_refused(mill, 1)


def test_a_checkpoint_that_lacks_something_is_refused(folder, stopped):
    mill = folder()
    for name in ("run", "loop", "loop/spin", "statistics", "series/rotor_impulse"):
        shutil.copy(stopped, mill.file)
        with h5py.File(mill.file, "r+") as file:
            del file["/checkpoint"][name]
        assert_refused(mill, 1, "damaged: /checkpoint/", "--force")


def test_the_checkpoint_of_another_build_is_refused(folder, stopped):
    """The version may be the same, as that of two trees with changes of their own."""
    mill = folder()
    shutil.copy(stopped, mill.file)
    with h5py.File(mill.file, "r+") as file:
        file["/checkpoint/build"][()] = "0123456789abcdef"
    assert_refused(
        mill,
        1,
        "its checkpoint was written by another build of millsim (0123456789abcdef, and",
        "--force",
    )


def test_a_checkpoint_that_is_none_is_refused(folder, stopped):
    mill = folder()
    for thing in ("text", 3.5, [1.0, 2.0]):
        shutil.copy(stopped, mill.file)
        with h5py.File(mill.file, "r+") as file:
            del file["/checkpoint"]
            file["/checkpoint"] = thing
        assert_refused(mill, 1, "checkpoint")


@pytest.mark.parametrize("name", GROWING)
def test_rows_missing_before_the_checkpoint_are_told(folder, stopped, name):
    mill = folder()
    shutil.copy(stopped, mill.file)
    with h5py.File(mill.file, "r+") as file:
        file[name].resize(len(file[name]) // 2, axis=0)
    assert_refused(mill, 1)


def test_a_foreign_file_is_refused(folder):
    mill = folder()
    mill.file.write_text("my thesis")
    assert_refused(mill, 1)
    with h5py.File(mill.file, "w") as file:
        file["measurements"] = [1.0, 2.0]
    assert_refused(mill, 1, "is not an output file of millsim")
    with h5py.File(mill.file, "w") as file:
        file["/deck/text"] = [1.0, 2.0]
    assert_refused(mill, 1)


def test_resume_and_force_exclude_each_other(folder):
    mill = folder()
    code, said = mill.run("--resume", "--force")
    assert code == 2
    assert one_line(said, "'--resume' and '--force' exclude each other")
    assert mill.names() == {"mill.ini"}


@pytest.mark.slow
def test_a_run_that_failed_is_not_tried_again(folder):
    mill = folder(
        "[run]\ntime = 10 s\n[balls]\ncount = 1\ndiameter = 10 mm\ndensity = 7800 kg/m^3\n"
        "start = start.txt\n[drum]\nradius = 100 mm\nlength = 100 mm\n"
        "[contact]\nrestitution = 0\nrebound_floor = 0 m/s\n[output]\ncheckpoint = 1 ms\n"
    )
    (mill.path / "start.txt").write_text("0 0 0\n")
    code, said = mill.run("-q")
    assert code == 1 and one_line(said, "rebound_floor")
    assert status(mill.file)[0] == "failed"
    bytes_ = mill.file.read_bytes()
    code, said = mill.run("-q", "--resume")
    assert code == 1 and one_line(said, "mill.h5: its run failed and would fail again")
    assert mill.file.read_bytes() == bytes_


# ---- others at the same file ----


@pytest.mark.slow
def test_a_second_run_on_the_same_output_is_refused_and_the_first_unharmed(folder, short):
    mill = folder()
    first = mill.start("-q")
    mill.await_checkpoint(first)
    first.send_signal(signal.SIGSTOP)  # so that it lives on meanwhile
    others = {option: mill.run("-q", *option) for option in ((), ("--force",), ("--resume",))}
    first.send_signal(signal.SIGCONT)
    assert first.wait(timeout=60) == 0
    for option, (code, said) in others.items():
        assert one_line(said, "mill.h5: ", "another run is writing it" if option else "exists already")
        assert code == (1 if option else 2)
    assert_same(mill.file, short)
    assert mill.names() == {"mill.ini", "mill.h5"}


@pytest.mark.slow
@pytest.mark.parametrize("victims", some([["mill.h5", "mill.h5.part", "mill.h5.lock"],
                                          ["mill.h5"], ["mill.h5.part"], ["mill.h5.lock"]], 4))  # fmt: skip
def test_files_removed_under_a_run_do_not_hurt_it(folder, short, victims):
    mill = folder()
    process = mill.start("-q")
    mill.await_checkpoint(process)
    process.send_signal(signal.SIGSTOP)
    for name in victims:
        (mill.path / name).unlink(missing_ok=name.endswith("part"))
    process.send_signal(signal.SIGCONT)
    assert process.wait(timeout=60) == 0, process.communicate()[1]
    assert_same(mill.file, short)
    assert mill.names() == {"mill.ini", "mill.h5"}


@pytest.mark.slow
def test_a_removed_folder_ends_the_run_with_one_line(folder, tmp_path):
    mill = folder()
    mill.file = tmp_path / "out" / "mill.h5"
    mill.file.parent.mkdir()
    process = mill.start("-q", "-o", "out/mill.h5")
    mill.await_checkpoint(process)
    shutil.rmtree(mill.file.parent, ignore_errors=True)
    said = process.communicate(timeout=60)[1]
    assert process.returncode == 1
    assert one_line(said, "out/mill.h5: cannot write", "No such file or directory")
    assert mill.names() == {"mill.ini"}


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_a_folder_made_read_only_ends_the_run_with_one_line(folder, tmp_path):
    mill = folder()
    process = mill.start("-q")
    mill.await_checkpoint(process)
    tmp_path.chmod(0o500)
    said = process.communicate(timeout=60)[1]
    tmp_path.chmod(0o700)
    assert process.returncode == 1
    assert one_line(said, "mill.h5: cannot write", "Permission denied")
    mill.finish("--resume")


@pytest.mark.slow
def test_a_reader_sees_a_whole_file_at_any_moment(folder, short):
    mill = folder()
    process = mill.start("-q")
    held, looks = [0] * len(GROWING), 0
    while process.poll() is None:
        if mill.file.exists():
            now = rows(mill.file)
            assert all(b >= a for a, b in zip(held, now)), (held, now)
            assert_beginning_of(mill.file, short)
            held, looks = now, looks + 1
        time.sleep(0.01)
    assert process.returncode == 0, process.communicate()[1]
    assert looks >= 3
    assert_same(mill.file, short)


@pytest.mark.slow
def test_a_linked_output_stays_a_link(folder, tmp_path, short):
    mill = folder()
    (tmp_path / "big").mkdir()
    (tmp_path / "big" / "real.h5").write_text("old")
    mill.file.symlink_to("big/real.h5")
    mill.stop("-q", "--force")
    mill.finish("--resume")
    assert mill.file.is_symlink()
    assert_same(tmp_path / "big" / "real.h5", short)


# ---- full disks ----


@pytest.fixture
def disk(tmp_path):
    """disk(size) is a small disk of its own, or the same with another size; skips where none may be
    mounted."""
    place = tmp_path / "disk"

    def mount(size):
        options = f"size={size}"
        if place.exists():
            options += ",remount"
        place.mkdir(exist_ok=True)
        done = subprocess.run(
            ["mount", "-t", "tmpfs", "-o", options, "tmpfs", str(place)],
            capture_output=True, text=True, check=False,
        )  # fmt: skip
        if done.returncode != 0:
            place.rmdir()
            pytest.skip(f"no disk may be mounted here: {done.stderr.strip()}")
        return place

    if os.geteuid() != 0 or not shutil.which("mount"):
        pytest.skip("only root may mount a small disk")
    yield mount
    if place.exists():
        subprocess.run(["umount", "-l", str(place)], check=False)


def test_a_disk_full_from_the_start_is_told_in_one_line(folder, disk):
    mill = folder()
    mill.file = disk("16k") / "mill.h5"
    code, said = mill.run("-q", "-o", "disk/mill.h5")
    assert code == 1
    assert one_line(said, "disk/mill.h5: cannot ", "No space left on device")
    assert {entry.name for entry in mill.file.parent.iterdir()} <= {"mill.h5"}


def test_a_forced_run_on_a_full_disk_leaves_the_old_file(folder, disk):
    mill = folder()
    mill.file = disk("16k") / "mill.h5"
    mill.file.write_text("my thesis")
    code, said = mill.run("-q", "--force", "-o", "disk/mill.h5")
    assert code == 1
    assert one_line(said, "disk/mill.h5: cannot ", "No space left on device")
    assert mill.file.read_text() == "my thesis"
    assert [entry.name for entry in mill.file.parent.iterdir()] == ["mill.h5"]


@pytest.mark.slow
@pytest.mark.parametrize("size", some(["1m", "2500k", "5m"], 2))
def test_a_disk_that_fills_up_takes_nothing_and_with_space_the_run_goes_on(folder, disk, short, size):
    mill = folder()
    mill.file = disk(size) / "mill.h5"
    code, said = mill.run("-q", "-o", "disk/mill.h5")
    assert code == 1
    assert one_line(said, "disk/mill.h5: cannot ", "No space left on device", "--resume")
    assert {entry.name for entry in mill.file.parent.iterdir()} == {"mill.h5"}
    assert status(mill.file)[0] == "running"
    assert_beginning_of(mill.file, short)
    disk("200m")
    mill.finish("--resume", "-o", "disk/mill.h5")
    assert_same(mill.file, short)
    assert {entry.name for entry in mill.file.parent.iterdir()} == {"mill.h5"}


@pytest.mark.slow
def test_a_disk_too_full_to_resume_leaves_the_file_as_it_was(folder, disk, short):
    mill = folder()
    mill.file = disk("200m") / "mill.h5"
    mill.stop("-q", "-o", "disk/mill.h5")
    bytes_ = mill.file.read_bytes()
    disk(f"{len(bytes_) // 1024 + 64}k")
    code, said = mill.run("-q", "--resume", "-o", "disk/mill.h5")
    assert code == 1
    assert one_line(said, "disk/mill.h5: cannot ", "No space left on device")
    assert mill.file.read_bytes() == bytes_
    disk("200m")
    mill.finish("--resume", "-o", "disk/mill.h5")
    assert_same(mill.file, short)


# ---- the cost ----


def spent(path):
    """Of a run so far: checkpoints taken, their time and that of the run on the wall's clock [s]."""
    with h5py.File(path, "r") as file:
        run = file["/run"]
        if "checkpoints" not in run:
            return 0, 0.0, 0.0
        return tuple(run[name][()] for name in ("checkpoints", "checkpoint_time", "wall_time"))


@pytest.mark.thorough
@pytest.mark.parametrize("kills", [0, 1])
def test_frequent_checkpoints_take_two_percent_of_the_time_at_most(folder, kills):
    """Each is as far from the next as keeps it so: true at every checkpoint, whatever else the machine does."""
    deck = ENDLESS
    for key, value in {"checkpoint": "1 ms", "frames": "0 s", "series": "1 s"}.items():
        deck = re.sub(f"^{key} = .*", f"{key} = {value}", deck, flags=re.M)
    mill = folder(deck)  # its file hardly grows
    for leg in range(kills + 1):
        process = mill.start("-q", *["--resume"][:leg])
        wanted = 1 + leg
        end = time.monotonic() + 300  # disks may be slow, and the gaps are fifty times as long
        while not mill.file.exists() or spent(mill.file)[0] < wanted:
            assert time.monotonic() < end
            assert process.poll() is None, process.communicate()[1]
            time.sleep(0.01)
        process.kill()
        process.communicate()
        taken, took, wall = spent(mill.file)
        assert taken >= wanted
        assert 0 < took <= 0.02 * wall


def test_checkpoints_come_no_more_often_than_asked_for(short):
    assert spent(short)[:2] == (0, 0.0)
