"""`make bench` and `make bench-peers`: what they write, and what they refuse. How fast anything is, no test asks."""

import json
import os
import subprocess
import sys
import time

import numpy as np
import pytest
from conftest import PROGRAM, ROOT

sys.path.insert(0, str(ROOT / "tests/bench"))
from bench import record, remarks
from bench_cases import CASES

ENGINE = "tests/bench/bench_engine"
# beside the program under test, where that stands in a build folder
BUILD = PROGRAM.parent if (PROGRAM.parent / ENGINE).exists() else ROOT / "build/release"
NAMES = (
    "simoloyer frictionless start short wavy wavy-frictionless wavy-cost planetary planetary-bed rest cores attritor "
    "attritor-mesh pins pins-mesh gas4k-0.05 gas4k-0.30 gas4k-0.45 gravity4k-0.30 gas256k-0.30 gas256k-0.45 "
    "gas1m-0.30 scaling memory quartic"
).split()


@pytest.fixture
def bench(tmp_path):
    """bench(*arguments) runs the driver, or the named one; its JSON goes to bench.json in tmp_path."""

    def run(*arguments, driver="bench.py"):
        return subprocess.run(
            [
                sys.executable,
                ROOT / "tests/bench" / driver,
                f"--build={BUILD}",
                f"--json={tmp_path / 'bench.json'}",
                *arguments,
            ],
            capture_output=True,
            text=True,
            timeout=300,
        )

    return run


@pytest.fixture
def engine():
    """engine(*arguments) runs bench_engine and returns the samples it prints."""
    if not (BUILD / ENGINE).exists():
        pytest.fail(f"{BUILD / ENGINE} is not built; make test does it")

    def run(*arguments):
        done = subprocess.run(
            [BUILD / ENGINE, *map(str, arguments)],
            cwd=ROOT,
            capture_output=True,
            text=True,
            check=True,
        )
        return [json.loads(line) for line in done.stdout.splitlines()]

    return run


@pytest.mark.slow
@pytest.mark.parametrize("target", ["bench", "bench-peers"])
def test_make_measures_in_full_unless_it_is_asked_to_try(target):
    def quick(*words):
        said = subprocess.run(["make", "-n", "-C", ROOT, target, *words], capture_output=True, text=True, check=True)
        return "--quick" in said.stdout

    assert not quick() and quick("QUICK=1")


def assert_full(report, names):
    """It is the record of a quick run of these cases."""
    assert report["quick"] is True and report["repeats"] == 1
    assert report["machine"]["processor"] and report["machine"]["cores"] >= 1
    assert report["build"]["version"].startswith("millsim ")
    assert "-std=c99" in report["build"]["flags"] and report["build"]["compiler"]
    assert report["load_before"] >= 0 and report["load_after"] >= 0 and report["date"]
    assert [case["name"] for case in report["cases"]] == names
    for case in report["cases"]:
        assert 0 < case["minimum"] <= case["median"] <= case["maximum"], case["name"]
        assert case["at_least"] > 0 and case["aim"] > 0 and case["unit"], case["name"]
        assert case["better"] in ("higher", "lower") and case["samples"], case["name"]
        if case["contacts"] is not None:
            assert case["contacts"] > 50, case["name"]
            assert case["events_per_contact"] >= 1, case["name"]
            assert case["cpu_per_simulated_second"] > 0, case["name"]
        # the figures of so little work are not judged
        assert case["at_least_met"] is None and case["aim_met"] is None, case["name"]


@pytest.mark.thorough
def test_quick_bench_measures_every_case_and_writes_a_full_record(bench, tmp_path):
    done = bench("--quick")
    assert done.returncode == 0, done.stderr
    assert_full(json.loads((tmp_path / "bench.json").read_text()), NAMES)
    assert all(name in done.stdout for name in NAMES)


@pytest.mark.slow
def test_rates_are_contacts_over_processor_time_and_their_median_decides(bench, tmp_path):
    done = bench("--quick", "--repeats=3", "gas4k-0.30")
    assert done.returncode == 0, done.stderr
    (case,) = json.loads((tmp_path / "bench.json").read_text())["cases"]
    rates = sorted(sample["contacts"] / sample["cpu"] for sample in case["samples"])
    assert len(rates) == 3
    assert [case["minimum"], case["median"], case["maximum"]] == pytest.approx(rates, rel=1e-12)


def test_verdict_compares_the_median_with_what_is_asked():
    (case,) = (case for case in CASES if case.name == "quartic")  # fewer nanoseconds are better
    for median, verdict in ((60, (True, True)), (100, (True, False)), (200, (False, False))):
        entry = record(case, [{"nanoseconds": value} for value in (10, median, 1000)], quick=False)
        assert (entry["at_least_met"], entry["aim_met"]) == verdict
        report = {"quick": False, "cases": [entry], "load_before": 0, "load_after": 0}
        assert ("quartic" in "".join(remarks(report)).partition("Below what")[2]) is not verdict[0]


@pytest.mark.slow
def test_void_figures_do_not_take_the_place_of_measured_ones_and_a_case_is_chosen_by_the_beginning_of_its_name():
    measured = ROOT / "build/bench.json"
    before = measured.read_bytes() if measured.exists() else None
    driver = [sys.executable, ROOT / "tests/bench/bench.py", f"--build={BUILD}"]
    done = subprocess.run([*driver, "--quick", "gas4k", "rest"], capture_output=True, text=True, check=True)
    assert done.stdout.endswith(f"Written: {ROOT / 'build/bench-quick.json'}\n")
    assert before == (measured.read_bytes() if measured.exists() else None)
    report = json.loads((ROOT / "build/bench-quick.json").read_text())
    assert_full(report, ["rest", "gas4k-0.05", "gas4k-0.30", "gas4k-0.45"])


def test_an_unknown_case_is_refused_in_one_line_that_names_the_cases(bench, tmp_path):
    done = bench("--quick", "gas4k", "warp")
    assert done.returncode == 2 and done.stdout == ""
    assert done.stderr.count("\n") == 1
    assert "no case 'warp'" in done.stderr
    assert all(name in done.stderr for name in NAMES)
    assert not (tmp_path / "bench.json").exists()


@pytest.mark.slow
def test_programs_that_are_not_built_are_named_in_one_line(bench):
    done = bench("--build=/nowhere", "--quick", "quartic")
    assert done.returncode == 1
    assert done.stderr.count("\n") == 1 and "/nowhere/millsim" in done.stderr


@pytest.mark.parametrize("packing", [0.30, 0.45])
def test_the_drum_of_the_gas_has_the_bulk_packing_that_was_asked_for(engine, packing):
    # two per cent: what the theory of flat walls may be off in a drum of 18 diameters
    (sample,) = engine("--repeats", 1, "--contacts", 60000, 4000, packing)
    assert sample["bulk_packing"] == pytest.approx(packing, rel=0.02)
    assert sample["contacts"] >= 60000
    assert sample["events"] > sample["contacts"]


def test_the_gas_can_be_printed_as_a_deck_that_millsim_reads(engine, millsim, tmp_path):
    done = subprocess.run(
        [BUILD / ENGINE, "--print", "4000", "0.3"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    )
    (tmp_path / "gas.ini").write_text(done.stdout)
    checked = millsim("--check", "-q", "gas.ini")
    assert checked.returncode == 0, checked.stderr
    assert "count = 4000" in checked.stdout and "restitution = 1" in checked.stdout


@pytest.mark.parametrize(
    "arguments", [[], ["4000"], ["4000", "0.7"], ["--settle"], ["0", "0.3"], ["--ratio", "0.5", "4000", "0.3"]]
)
def test_bench_engine_refuses_wrong_arguments_with_its_usage(arguments):
    done = subprocess.run([BUILD / ENGINE, *arguments], capture_output=True, text=True)
    assert done.returncode == 2
    assert done.stderr.startswith("usage: bench_engine")


@pytest.mark.slow
def test_a_mixture_has_the_bulk_packing_that_was_asked_for_and_tells_contacts_of_two_balls_apart(engine):
    # three per cent: one instant of 182 large balls of all sizes' volume, and an estimate at the walls
    (sample,) = engine("--repeats", 1, "--contacts", 20000, "--ratio", 3, 20000, 0.3)
    assert sample["bulk_packing"] == pytest.approx(0.3, rel=0.03)
    assert 0.85 * sample["contacts"] < sample["ball_contacts"] < sample["contacts"]


def has_terminal():
    try:
        for end in os.openpty():
            os.close(end)
    except OSError:
        return False
    return True


terminal = pytest.mark.skipif(not has_terminal(), reason="no pseudo terminal here: mount /dev/pts")

PEER = """\
#!{python}
# Tells contacts as EDMD does: 1000 after each hundredth of a second of processor time, without end.
import pathlib, time
lines = pathlib.Path("init.sph").read_text().splitlines()
assert int(lines[0]) == len(lines) - 2, "balls"
print("Starting")
for k in range({end}):
    print(f"Simtime: {{k}}.000000, Collisions: {{1000 * k}}, Press: 1.0, T: 1.0, Listsizes: (7.4, 4)")
    while time.process_time() < 0.1 + 0.01 * k:
        pass
print("Too many neighbors")
"""


@pytest.fixture
def peer(tmp_path):
    """peer(end) is the path of a program that prints as many lines as EDMD would and says why it ends."""

    def write(end):
        path = tmp_path / f"peer{end}"
        path.write_text(PEER.format(python=sys.executable, end=end))
        path.chmod(0o755)
        return path

    return write


@terminal
@pytest.mark.slow
def test_a_peer_is_read_line_by_line_and_its_rate_is_per_second_of_its_own_processor_time(bench, peer, tmp_path):
    done = bench("--quick", "--case=gas4k-0.30", f"cell={peer(10**9)}", driver="bench_peers.py")
    assert done.returncode == 0, done.stderr
    (case,) = json.loads((tmp_path / "bench.json").read_text())["cases"]
    (turn,) = case["turns"]
    assert turn["cell"]["ball_contacts"] == 10_000
    assert turn["cell"]["ball_contacts"] / turn["cell"]["cpu"] == pytest.approx(1e5, rel=0.5)
    mine = turn["millsim"]["ball_contacts"] / turn["millsim"]["cpu"]
    ratio = case["programs"]["cell"]["millsim_over_it"]["median"]
    assert ratio == pytest.approx(mine * turn["cell"]["cpu"] / turn["cell"]["ball_contacts"])
    assert "gas4k-0.30  cell" in done.stdout


@terminal
@pytest.mark.slow
def test_a_peer_that_tells_no_contacts_ends_with_the_benchmark(tmp_path):
    silent, pid = tmp_path / "silent", tmp_path / "pid"
    silent.write_text(f"#!/bin/sh\necho $$ > {pid}.new; mv {pid}.new {pid}; exec sleep 1000\n")
    silent.chmod(0o755)
    told = [f"--build={BUILD}", f"--json={tmp_path / 'bench.json'}", "--quick", "--case=gas4k-0.05", f"cell={silent}"]
    with subprocess.Popen([sys.executable, ROOT / "tests/bench/bench_peers.py", *told]) as driver:
        while not pid.exists():
            assert driver.poll() is None
            time.sleep(0.02)
        time.sleep(0.5)  # now it waits for the peer's lines
        driver.terminate()
    assert driver.returncode == 143
    with pytest.raises(ProcessLookupError):
        os.kill(int(pid.read_text()), 0)


@pytest.mark.slow
@terminal
def test_a_peer_that_ends_early_is_reported_with_its_last_words_and_the_others_go_on(bench, peer, tmp_path):
    peers = [f"single={peer(5)}", f"cell={peer(10**9)}"]
    done = bench("--quick", "--repeats=2", "--case=gas4k-0.30", *peers, driver="bench_peers.py")
    assert done.returncode == 0, done.stderr
    (case,) = json.loads((tmp_path / "bench.json").read_text())["cases"]
    assert list(case["programs"]) == ["millsim", "cell"]
    assert "gas4k-0.30: single ended before 12000 contacts: Too many neighbors\n" in done.stdout


def test_without_a_pseudo_terminal_a_peer_is_reported_in_one_line(monkeypatch, tmp_path):
    import bench_peers

    def none():
        raise OSError("out of pty devices")

    monkeypatch.setattr(bench_peers.pty, "openpty", none)
    with pytest.raises(bench_peers.BenchError, match=r"^needs a pseudo terminal, mount /dev/pts: out of pty devices$"):
        bench_peers.watched(["true"], tmp_path, bench_peers.PEERS["cell"], 1, 1)


@pytest.mark.parametrize("ratio", [1, 2, 3, 5, 10])
def test_the_balls_given_to_a_peer_fill_the_volume_that_was_asked_for_and_do_not_overlap(ratio):
    from bench_peers import Case, start

    case = Case("", 1000, 0.3, ratio)
    side, large, small = start(case)
    radii = np.repeat([0.5, 0.5 / ratio], [len(large), len(small)])
    assert len(radii) == 1000
    assert 4 / 3 * np.pi * (radii**3).sum() / side**3 == pytest.approx(0.3)
    away = np.concatenate([large, small])
    away = np.abs(away[:, None] - away)
    away = np.minimum(away, side - away)
    gaps = np.sqrt((away**2).sum(axis=2)) - radii[:, None] - radii
    assert gaps[~np.eye(1000, dtype=bool)].min() > 0


@pytest.mark.parametrize(
    ("word", "said"),
    [
        ("warp=/bin/true", "no peer 'warp'; NAME=PROGRAM with one of single, cell"),
        ("cell=/nowhere", "cell=/nowhere: expected the path of a program"),
        ("--case=warp", "no case 'warp'; there are gas4k-0.05"),
    ],
)
@pytest.mark.slow
def test_a_peer_or_a_case_that_is_not_there_is_refused_in_one_line(bench, tmp_path, word, said):
    done = bench(word, driver="bench_peers.py")
    assert done.returncode == 2 and done.stdout == ""
    assert said in done.stderr and done.stderr.count("\n") == 1
    assert not (tmp_path / "bench.json").exists()
