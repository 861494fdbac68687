"""The table of a study: no row that was added is lost, none counts twice, it can be read at any moment."""

import json
import math
import os
import signal
import subprocess
import sys
import time

import pandas
import pytest

from milltools.base.errors import UserError
from milltools.study.plan.table import Table, Writer, journal_of, schema

PATH = "impacts/all/normal_speed/median_above_floor"
META = {
    "study": "[study]\n", "file": "a.study", "deck": "", "fingerprint": "0123456789abcdef",
    "objectives": [{"path": PATH, "goal": "maximise", "unit": "m s-1", "description": "median"}],
    "record": ["rotor/power"],
    "vary": [
        {"key": "drum.buckles", "kind": "whole", "unit": "1", "values": [2, 3]},
        {"key": "drum.buckle_height", "kind": "number", "unit": "m", "values": [0.0]},
        {"key": "drum.profile", "kind": "choice", "unit": "1", "values": ["wavy"]},
    ],
    "planned": 3, "command": "mill sweep a.study", "version": "1",
}  # fmt: skip


def row(number, **changes):
    """A row as job.run gives it."""
    made = {
        "design": number, "replicate": 0, "seed": 1, "id": f"{number:016x}",
        "drum.buckles": 2 + number, "drum.buckle_height": 0.001 * number, "drum.profile": "wavy",
        PATH: 0.5 + number, f"{PATH}:error": math.nan, "rotor/power": 900.0, "rotor/power:error": 9.0,
        "results": "", "status": "done", "message": "", "time": 0.3, "sample_from": 0.1, "collisions": 1000,
        "cpu": 1.5, "wall": 1.6, "version": "1", "worker": "here:1", "finished": "2026-01-01T00:00:00+00:00",
    }  # fmt: skip
    return made | changes


@pytest.fixture
def path(tmp_path):
    return tmp_path / "a.parquet"


def fill(path, *rows, meta=META, **options):
    with Writer.begin(path, meta, **options) as table:
        for one in rows:
            table.add(one)


def test_rows_come_back_as_they_were(path):
    fill(path, row(0), row(1, **{PATH: math.nan}))
    table = Table.open(path)
    assert table.rows()[0] == pytest.approx(row(0), nan_ok=True)
    assert math.isnan(table.rows()[1][PATH])
    assert table.meta == META


def test_pandas_reads_it_without_us(path):
    fill(path, row(0), row(1))
    frame = pandas.read_parquet(path)
    assert list(frame.columns) == schema(META).names
    assert list(frame["drum.buckles"]) == [2, 3] and frame["drum.buckles"].dtype == "int64"
    assert list(frame["drum.profile"]) == ["wavy", "wavy"]


def test_it_can_be_read_while_it_is_written(path):
    with Writer.begin(path, META) as table:
        assert len(Table.open(path)) == 0
        table.add(row(0))
        assert [one["design"] for one in Table.open(path).rows()] == [0]
        assert not Table.open(path).complete
    assert not journal_of(path).exists()


def test_it_is_complete_when_every_planned_run_is_there(path):
    fill(path, row(0), row(1))
    assert not Table.open(path).complete
    fill(path, row(2))
    assert Table.open(path).complete


@pytest.mark.slow
def test_rows_in_the_journal_survive_a_kill(path):
    """A writer of its own, killed after its second row."""
    code = (
        "import sys, time; sys.path.insert(0, sys.argv[1])\n"
        "from test_table import *\n"
        "with Writer.begin(sys.argv[2], META) as table:\n"
        "    table._folded = time.monotonic() + 1e6\n"
        "    table.add(row(0)); table.add(row(1)); print('added', flush=True); time.sleep(60)\n"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", code, os.path.dirname(__file__), path],
        stdout=subprocess.PIPE,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
    )
    assert process.stdout.readline() == b"added\n"
    process.send_signal(signal.SIGKILL)
    process.communicate()
    assert len(pandas.read_parquet(path)) == 0
    assert [one["design"] for one in Table.open(path).rows()] == [0, 1]
    fill(path, row(2))
    assert list(pandas.read_parquet(path)["design"]) == [0, 1, 2]


@pytest.mark.parametrize("torn", [b'{"design": 1, "repl', b"\x00\x00\x00", b"[]", b"7"])
def test_a_torn_line_of_the_journal_is_left_out(path, torn):
    fill(path, row(0))
    good = json.dumps({k: None if v != v else v for k, v in row(5).items()}).encode()
    journal_of(path).write_bytes(good + b"\n" + torn)
    assert [one["design"] for one in Table.open(path).rows()] == [0, 5]
    fill(path, row(6))
    assert [one["design"] for one in Table.open(path).rows()] == [0, 5, 6]


def test_a_run_that_is_in_file_and_journal_counts_once_the_later_one(path):
    fill(path, row(0, status="failed"), row(1))
    line = json.dumps({k: None if v != v else v for k, v in row(0).items()})
    journal_of(path).write_text(line + "\n")
    assert [one["status"] for one in Table.open(path).rows()] == ["done", "done"]


def test_a_second_writer_is_refused_and_readers_are_not(path):
    with Writer.begin(path, META):
        with pytest.raises(UserError, match="another mill command is writing to it now") as fault:
            fill(path)
        assert fault.value.status == 1
        Table.open(path)
    fill(path)


def test_a_table_of_another_study_is_refused_unless_forced(path):
    fill(path, row(0))
    other = META | {"fingerprint": "another", "file": "b.study"}
    with pytest.raises(UserError, match="contains the runs of another study") as fault:
        fill(path, row(1), meta=other)
    assert fault.value.status == 2
    assert [one["design"] for one in Table.open(path).rows()] == [0]
    fill(path, row(1), meta=other, force=True)
    assert [one["design"] for one in Table.open(path).rows()] == [1]


def test_what_makes_it_another_study_is_told_with_both_values(path):
    common = {"drum.buckles": "varied", "rotor.speed": "60 rad/s", "contact.friction": "0.3"}
    fill(path, row(0), meta=META | {"common": common})
    other = common | {"rotor.speed": "80 rad/s", "contact.friction": "0"}
    with pytest.raises(UserError) as fault:
        fill(path, row(1), meta=META | {"fingerprint": "another", "common": other})
    assert (
        "another study: rotor.speed is 60 rad/s in the table and 80 rad/s in the study deck, and 1 more differ;"
        in str(fault.value)
    )
    del other["rotor.speed"]
    with pytest.raises(UserError, match="rotor.speed is 60 rad/s in the table and not given in the study deck, and 1"):
        fill(path, row(1), meta=META | {"fingerprint": "another", "common": other})


def test_the_columns_may_stand_in_another_order_after_a_change_of_the_study(path):
    fill(path, row(0))
    fill(path, row(1), meta=META | {"vary": META["vary"][::-1]})
    assert [one["drum.buckles"] for one in Table.open(path).rows()] == [2, 3]


def test_rows_take_the_numbers_of_a_new_plan_and_others_those_behind(path):
    fill(path, row(0), row(1), row(2))
    with Writer.begin(path, META) as table:
        table.number({f"{2:016x}": 0, f"{7:016x}": 1})
        assert {one["id"]: one["design"] for one in table.rows()} == {
            f"{2:016x}": 0,
            f"{0:016x}": 2,
            f"{1:016x}": 3,
        }


@pytest.mark.parametrize(
    "content, complaint",
    [
        (None, "no such file"),
        (b"", "not a readable Parquet file"),
        (b"PAR1 nonsense PAR1", "not a readable Parquet file"),
    ],
)
def test_what_is_no_table_is_one_line(path, content, complaint):
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(UserError, match=complaint):
        Table.open(path)


def test_any_other_parquet_file_is_refused_and_kept(path):
    pandas.DataFrame({"a": [1]}).to_parquet(path)
    with pytest.raises(UserError, match="not the table of a study"):
        fill(path, row(0))
    assert list(pandas.read_parquet(path)["a"]) == [1]


@pytest.mark.thorough
def test_20000_rows_are_added_and_opened_in_seconds(path, monkeypatch):
    """CPU seconds with a large margin: some 5 s to add them all, 0.02 s to open them."""
    monkeypatch.setattr(os, "fsync", lambda _: None)  # the disk's own time
    begin = time.process_time()
    fill(path, *(row(number) for number in range(20000)))
    assert time.process_time() - begin < 20
    begin = time.process_time()
    assert len(Table.open(path).frame()) == 20000
    assert time.process_time() - begin < 5


def test_a_full_disk_is_one_line_and_what_was_kept_stays_readable(path):
    """A limit on the size of files stands for the disk."""
    import resource

    fill(path, row(0))
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    before = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    try:
        resource.setrlimit(resource.RLIMIT_FSIZE, (path.stat().st_size + 300, hard))
        with pytest.raises(UserError) as fault:
            fill(path, *(row(number, message="x" * 5000) for number in range(1, 10)))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
        signal.signal(signal.SIGXFSZ, before)
    assert fault.value.status == 1 and str(path) in str(fault.value)
    assert 0 in [one["design"] for one in Table.open(path).rows()]
    assert not path.with_name("a.parquet.part").exists()
    fill(path, row(20))
    assert {0, 20} <= {one["design"] for one in Table.open(path).rows()}
