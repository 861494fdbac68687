"""Tables of studies that are damaged or hostile: no value changes unseen, nothing crashes or runs away."""

import json
import os
import random

import pyarrow
import pyarrow.parquet
import pytest
from test_table import META, PATH, fill, row

from milltools.base.errors import UserError
from milltools.study.plan import sealed
from milltools.study.plan.table import METADATA, Table, Writer, journal_of, schema

ROWS = 6


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """(a table's bytes, those of an empty one, of a journal with the same rows, the rows by id)"""
    folder = tmp_path_factory.mktemp("made")
    fill(folder / "full.parquet", *map(row, range(ROWS)))
    with Writer.begin(folder / "a.parquet", META) as table:
        empty = table.path.read_bytes()
        table._folded = float("inf")
        for number in range(ROWS):
            table.add(row(number))
        journal = journal_of(table.path).read_bytes()
    return (folder / "full.parquet").read_bytes(), empty, journal, by_id(Table.open(folder / "full.parquet"))


def by_id(table):
    """{id: all that the row says, as text, so that NaN is NaN}"""
    return {one["id"]: repr(one) for one in table.rows()}


def flipped(content: bytes, seed: int) -> bytes:
    """With one to three bits the other way round."""
    generator, changed = random.Random(seed), bytearray(content)
    for _ in range(generator.randint(1, 3)):
        changed[generator.randrange(len(changed))] ^= 1 << generator.randrange(8)
    return bytes(changed)


def old(values) -> bytes:
    """A line of a journal as earlier versions wrote it."""
    return json.dumps({k: None if v != v else v for k, v in values.items()}).encode() + b"\n"


@pytest.mark.slow
def test_no_flipped_bit_of_a_journal_changes_a_value_unseen(made, tmp_path):
    _, empty, journal, rows = made
    path, dropped = tmp_path / "a.parquet", 0
    path.write_bytes(empty)
    for seed in range(100):
        journal_of(path).write_bytes(flipped(journal, seed))
        table = Table.open(path)
        found = by_id(table)
        assert found.items() <= rows.items(), seed
        lost = ROWS - len(found)
        # a line end that is none joins two lines; the last line may look torn
        assert lost <= 2 * table.damaged + 1, seed
        dropped += lost
    assert 100 <= dropped <= 100 * 3


def test_no_flipped_bit_of_a_parquet_file_changes_a_value_unseen(made, tmp_path):
    full, _, _, rows = made
    path, refused = tmp_path / "a.parquet", 0
    for seed in range(250, 350):
        path.write_bytes(flipped(full, seed))
        try:
            table = Table.open(path)
        except UserError as fault:
            assert fault.status == 2 and str(fault).startswith(f"{path}: ")
            refused += 1
        else:
            assert by_id(table) == rows and table.meta == META, seed
    assert refused > 60


HOSTILE = [
    b"{}", b"null", b"[]", b"7", b"[" * 100000, b'{"a":' * 100000, b'{"id":5}', b'{"id":null}', b"\xff\xfe",
    b'{"id":"zz","design":"x"}', b"NaN", b"9" * 100000,
    *(
        old(row(1) | change).strip()
        for change in (
            {"id": "zz"}, {"id": 5}, {"id": None}, {"design": "x"}, {"design": -1}, {"design": 2**64}, {"design": 1.5},
            {"status": "well"}, {"status": None}, {"cpu": None}, {"drum.buckle_height": None}, {"drum.profile": 3},
            {PATH: "fast"}, {PATH: [1]}, {"message": "\ud800"}, {"more": 1},
        )
    ),
    old(row(1) | {PATH: 1}).strip().replace(b': 1,', b": 1e400,"),
    old(row(1)).strip().replace(b'"design": 1', b'"design": 1e400'),
    old(row(1)).strip().replace(b'"time": 0.3', b'"time": Infinity'),
]  # fmt: skip


@pytest.mark.parametrize("line", HOSTILE, ids=range(len(HOSTILE)))
def test_a_line_of_another_kind_is_left_out_and_counted_with_or_without_a_checksum(tmp_path, line):
    path = tmp_path / "a.parquet"
    fill(path, row(0))
    head = line.strip()[:-1]
    for changed in (line, head + f', "sum": "{sealed._sum(head)}"}}'.encode()):
        journal_of(path).write_bytes(old(row(2)) + changed + b"\n" + old(row(3)))
        table = Table.open(path)
        assert [one["design"] for one in table.rows()] == [0, 2, 3] and table.damaged == 1
    fill(path, row(1))
    table = Table.open(path)
    assert [one["design"] for one in table.rows()] == [0, 1, 2, 3] and table.damaged == 0


def test_mill_study_says_what_is_left_out(mill, tmp_path):
    path = tmp_path / "a.parquet"
    fill(path, row(0))
    journal_of(path).write_bytes(HOSTILE[0] + b"\n" + old(row(2)))
    done = mill("study", "a.parquet")
    assert done.returncode == 0
    assert done.stderr.startswith("mill study: a.parquet.journal: 1 damaged line left out; ")


def test_a_journal_without_checksums_is_still_read_and_gets_them(tmp_path):
    path = tmp_path / "a.parquet"
    pyarrow.parquet.write_table(pyarrow.Table.from_pylist([row(0)], schema(META)), path)
    journal_of(path).write_bytes(old(row(1)))
    assert [one["design"] for one in Table.open(path).rows()] == [0, 1]
    fill(path, row(2))
    assert [one["design"] for one in Table.open(path).rows()] == [0, 1, 2]
    text = pyarrow.parquet.read_schema(path).metadata[METADATA]
    assert sealed.unseal(text)[1] and json.loads(text)["fingerprint"] == META["fingerprint"]


def test_a_row_that_cannot_be_of_the_study_is_not_kept(tmp_path):
    path = tmp_path / "a.parquet"
    fill(path, row(0))
    before = path.read_bytes()
    for change in ({"collisions": "many"}, {"more": 1}):
        with pytest.raises(UserError, match="a row that cannot belong to this study"):
            fill(path, row(1, **change))
    assert path.read_bytes() == before and not journal_of(path).exists()


def metadata(*drop, **change):
    return json.dumps({k: v for k, v in (META | change).items() if k not in drop}).encode()


@pytest.mark.parametrize(
    "text",
    [
        b"", b"{", b"\xff", b"[]", b"null", b"[" * 100000, b"{}",
        metadata("vary"), metadata("objectives"), metadata("record"),
        metadata(vary=None), metadata(vary=[]), metadata(vary=[1]), metadata(vary=[{"key": "a"}]), metadata(record=[1]),
        metadata(vary=[{"key": "a", "kind": "number"}]), metadata(vary=[{"key": "a", "kind": "colour", "values": [1]}]),
        metadata(vary=[META["vary"][0] | {"values": ["x"]}, *META["vary"][1:]]),
        metadata(vary=[*META["vary"], META["vary"][0]]),
        metadata(objectives=[]), metadata(objectives=[{"path": PATH}]),
        metadata(objectives=[{"path": PATH, "goal": "win"}]), metadata(planned="3"), metadata(planned=True),
        metadata(fingerprint=1), metadata(common={"a": 1}), metadata(kind="x"),
        metadata(planned=1).replace(b'"planned": 1', b'"planned": 1e400'),
        metadata(vary=[{"key": "a", "kind": "number", "low": 0, "high": 1}]),
        sealed.seal(META), sealed.seal(META | {"content": "0" * 16}),
    ],
)  # fmt: skip
def test_metadata_of_another_kind_are_one_line(tmp_path, text):
    path = tmp_path / "a.parquet"
    stored = pyarrow.Table.from_pylist([row(0)], schema(META)).replace_schema_metadata({METADATA: text})
    pyarrow.parquet.write_table(stored, path)
    for use in (lambda: Table.open(path), lambda: fill(path, row(1))):
        with pytest.raises(UserError, match=r"^\S*a\.parquet: damaged: ") as fault:
            use()
        assert fault.value.status == 2 and "\n" not in str(fault.value)
    assert Table.open(fill(path, row(1), force=True) or path).rows()


def test_columns_of_another_type_and_rows_of_no_run_are_one_line(tmp_path):
    path = tmp_path / "a.parquet"
    good = pyarrow.Table.from_pylist([row(0)], schema(META))
    for name, values in (
        ("design", [0.5]), ("status", [1]), ("status", ["well"]), ("status", [None]), ("id", ["x"]),
        ("cpu", [float("inf")]), ("drum.buckle_height", [float("nan")]), ("collisions", [-1]),
    ):  # fmt: skip
        place = good.schema.get_field_index(name)
        kind = good.schema.field(name).type if values == [None] else None
        changed = good.set_column(place, name, pyarrow.array(values, kind))
        pyarrow.parquet.write_table(changed, path)
        with pytest.raises(UserError, match="damaged: ") as fault:
            Table.open(path)
        assert fault.value.status == 2


@pytest.mark.slow
def test_pages_that_unpack_to_gigabytes_are_refused_unread(tmp_path):
    path = tmp_path / "a.parquet"
    rows = pyarrow.Table.from_pylist([row(0, message="x" * 10**6)], schema(META))
    many = pyarrow.concat_tables([rows] * 2000)
    pyarrow.parquet.write_table(many, path, compression="zstd", use_dictionary=False)
    assert os.path.getsize(path) < 2 * 10**6
    with pytest.raises(UserError, match="not the table of a study"):
        Table.open(path)


def test_neither_pipes_nor_links_stand_for_a_table(tmp_path):
    path = tmp_path / "a.parquet"
    os.mkfifo(path)
    with pytest.raises(UserError, match="not an ordinary file"):
        Table.open(path)
    path.unlink()
    fill(path, row(0))
    (tmp_path / "mine").write_text("mine")
    journal_of(path).symlink_to(tmp_path / "mine")
    with pytest.raises(UserError):
        fill(path, row(1))
    assert (tmp_path / "mine").read_text() == "mine"


@pytest.mark.parametrize(
    "line, shown",
    [
        ("mill optimize a.study --storage postgresql://me:se:c@r/et@host/x", "postgresql://me:***@host/x"),
        ("mill optimize a.study '--storage=postgresql+psycopg://me:s pass@host/x' -q", "psycopg://me:***@host/x"),
        ("mill optimize a.study --storage 'sqlite:///o.db?password=secret&a=b'", "sqlite:///o.db?password=***&a=b"),
        ("mill sweep 'a b.study' -s run.time='1 s'", None),
        ("mill optimize a.study --storage postgresql://me@host/x", None),
    ],
)
def test_a_table_keeps_no_password(tmp_path, line, shown):
    path = tmp_path / "a.parquet"
    fill(path, row(0), meta=META | {"command": line})
    assert not any(word in path.read_bytes() for word in (b"secret", b"pass@", b"se:c"))
    command = Table.open(path).meta["command"]
    assert command == line if shown is None else shown in command


def test_a_password_in_the_table_of_an_earlier_version_is_not_shown(tmp_path):
    path = tmp_path / "a.parquet"
    meta = META | {"command": "mill optimize --storage postgresql://me:secret@host/x"}
    pyarrow.parquet.write_table(pyarrow.Table.from_pylist([row(0)], schema(meta)), path)
    assert Table.open(path).meta["command"] == "mill optimize --storage 'postgresql://me:***@host/x'"
