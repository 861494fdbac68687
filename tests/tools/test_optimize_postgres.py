"""mill optimize on a real PostgreSQL: it keeps the search, survives a restart, and two drivers share it."""

import concurrent.futures
import os
import pathlib
import re
import shutil
import socket
import subprocess

import pandas
import pytest

BIN = max(pathlib.Path("/usr/lib/postgresql").glob("*/bin/initdb"), default=None)
STUDY = """\
[study]
deck = deck.ini
maximise = impacts/all/normal_speed/median_above_floor
[set]
run.time = 20 ms
[vary]
rotor.speed = 300..900 rpm
balls.count = 12..20
"""


def as_postgres(*words):
    """The command as a user who may run a server: it refuses root."""
    return ["runuser", "-u", "postgres", "--", *words] if os.geteuid() == 0 else [*words]


@pytest.fixture(scope="module")
def database(tmp_path_factory):
    """URL of a private server on loopback, gone after the tests."""
    if BIN is None:
        pytest.skip("no PostgreSQL server here (Debian: postgresql)")
    if os.geteuid() == 0 and not shutil.which("runuser"):
        pytest.skip("root cannot run a PostgreSQL server without runuser")
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    folder = pathlib.Path(
        subprocess.run(as_postgres("mktemp", "-d"), capture_output=True, text=True, check=True).stdout.strip()
    )
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "cwd": "/"}
    try:
        subprocess.run(
            as_postgres(str(BIN), "-D", f"{folder}/data", "-A", "trust", "--no-sync", "-U", "mill"),
            check=True, **quiet,
        )  # fmt: skip
        pg_ctl = [str(BIN.with_name("pg_ctl")), "-D", f"{folder}/data", "-w"]
        options = f"-p {port} -c listen_addresses=127.0.0.1 -c unix_socket_directories={folder} -c fsync=off"
        subprocess.run(
            as_postgres(*pg_ctl, "-l", f"{folder}/log", "-o", options, "start"), check=True, timeout=120, **quiet
        )
        try:
            yield f"postgresql://mill@127.0.0.1:{port}/postgres"
        finally:
            subprocess.run(as_postgres(*pg_ctl, "-m", "immediate", "stop"), **quiet)
    finally:
        shutil.rmtree(folder, ignore_errors=True)


@pytest.mark.slow
def test_a_search_is_kept_and_shared(database, mill, write_study, tmp_path):
    write_study(STUDY)

    def optimize(runs, output):
        done = mill("optimize", "a.study", "--runs", runs, "--workers", "1", "--storage", database, "-o", output)
        assert done.returncode == 0, done.stderr
        return pandas.read_parquet(tmp_path / output), done

    first, _ = optimize(2, "a.parquet")
    assert len(first) == 2
    assert not (tmp_path / "a.optuna.journal").exists()
    with concurrent.futures.ThreadPoolExecutor() as both:  # two drivers at once, a table each
        one, two = (both.submit(optimize, 4, name) for name in ("a.parquet", "b.parquet"))
        one.result()
        second, done = two.result()
    # two, and what the other driver has added before this one looks
    assert re.search(r"[2-4] runs are there already \(postgresql://mill@127\.0\.0\.1", done.stderr)
    (tmp_path / "a.parquet").unlink()
    whole, _ = optimize(4, "a.parquet")  # the storage alone is enough
    assert set(first["id"]) | set(second["id"]) <= set(whole["id"])
    assert 4 <= len(whole) <= 5  # both may have asked for the last one
    same = whole[["id", "rotor.speed", "balls.count"]].merge(second, on="id")
    assert len(same) == len(second)
    assert (same["rotor.speed_x"] == same["rotor.speed_y"]).all()  # to the bit
