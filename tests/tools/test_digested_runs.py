"""Runs of other programs in millsim's schema: millsim's own runs, handed to `millsim --digest`, give millsim's own
file.

What the stream may hold, and what is refused, is in tests/cli/test_digest.py.
"""

import foreign
import h5py
import numpy as np
import pytest
from foreign import DECKS, RUN

from milltools.base.errors import UserError
from milltools.foreign.digest import Digest, impacts_of, snapshot_times

ALIKE = ("falling balls", "no rotor, no gravity")  # parts of them are in the others


@pytest.fixture(
    scope="module",
    params=[pytest.param(name, marks=[pytest.mark.thorough] * (name in ALIKE)) for name in DECKS],
    ids=lambda name: name.replace(",", ""),
)
def pair(request, tmp_path_factory):
    """(file by the digest, millsim's own file) of the same run."""
    folder = tmp_path_factory.mktemp("digest")
    deck, path = foreign.simulate(folder, DECKS[request.param])
    with h5py.File(foreign.digested(folder, deck, path)) as ours, h5py.File(path) as theirs:
        yield ours, theirs


def tree(group, prefix=""):
    """Everything but /run by every name that it has, soft links by their targets."""
    found = {}
    for name in group:
        link, path = group.get(name, getlink=True), prefix + name
        if path == "run" or path.split("/")[-1] == "wear":  # which surface a ball met is not known
            continue
        found[path] = link.path if isinstance(link, h5py.SoftLink) else group[name]
        if isinstance(found[path], h5py.Group):
            found.update(tree(group[name], f"{path}/"))
    return found


def values(item):
    return item.asstr()[()] if h5py.check_string_dtype(item.dtype) else item[()]


@pytest.mark.slow
def test_names_types_shapes_and_labels_are_those_of_millsim(pair):
    ours, theirs = (tree(file) for file in pair)
    assert ours.keys() == theirs.keys() and len(ours) > 500
    for name, mine in ours.items():
        other = theirs[name]
        assert type(mine) is type(other), name
        if isinstance(mine, str):
            assert mine == other
            continue
        attributes = {key: value for key, value in mine.attrs.items() if key != "part"}
        assert attributes.keys() == other.attrs.keys(), name
        for key, value in attributes.items():
            if isinstance(value, str):
                assert value == other.attrs[key] or name in ("impacts/dissipation", "h5md/creator"), (name, key)
            else:
                assert np.asarray(value).dtype == np.asarray(other.attrs[key]).dtype, (name, key)
        if isinstance(mine, h5py.Dataset):
            layouts = [(d.dtype, d.shape, d.maxshape, d.chunks, d.compression, d.is_virtual) for d in (mine, other)]
            assert layouts[0] == layouts[1], name


# What is not the same to the bit: frames and points are stored in single precision, and works come from rows.
ENERGIES = tuple(f"observables/{name}_energy/value" for name in ("kinetic", "rotational", "potential"))
ERRORS = ("standard_error", "degrees_of_freedom", "power_error", "torque_error")
UNKNOWN = ("statistics/floor_share/", "statistics/rotor/pinch_power", "statistics/drive/pinch_power")
MAPPED = ("statistics/maps/cross_section/", "statistics/maps/axial/")


def from_rows(name):
    """Powers, torques and their errors."""
    return name.startswith((
        "statistics/rotor/", "statistics/motions/", "statistics/drive/", "observables/rotor_torque/",
        "statistics/precision/dissipated_power", "statistics/precision/hard_", "statistics/hard_energy",
        "statistics/precision/rotor_power/", "statistics/precision/rotor_torque/", "statistics/precision/drive_power/",
    )) or (name.startswith("statistics/impacts/") and name.endswith("/dissipated_power"))  # fmt: skip


def pressed(theirs):
    """Were balls pinched? What their contacts lose is in the statistics, but in no row of the log."""
    return theirs["statistics/drive/pinch_power"][()] != 0


@pytest.mark.slow
def test_everything_is_the_same_to_the_bit_or_to_rounding(pair):
    ours, theirs = (tree(file) for file in pair)
    rows = theirs["statistics/precision/batch"][()] / 1e-3
    rows_end_batches = abs(rows - round(rows)) < 1e-9
    exact = 0
    for name, mine in ours.items():
        if not isinstance(mine, h5py.Dataset) or name.startswith(MAPPED):
            continue
        mine, other = values(mine), values(theirs[name])
        if name.startswith(UNKNOWN):
            assert np.isnan(mine), name
        elif "/hard_" in name and pressed(theirs):
            continue  # their energy follows from the losses
        elif name in ENERGIES:
            assert np.allclose(mine, other, rtol=1e-7, atol=1e-7 * np.abs(other).max(initial=0)), name
        elif from_rows(name):
            if rows_end_batches or not name.endswith(ERRORS):
                scale = np.abs(theirs["statistics/drive/power"][()]) if name.endswith("power") else 1e-2
                assert np.allclose(mine, other, rtol=1e-8, atol=1e-8 * scale, equal_nan=True), name
        elif not (pressed(theirs) and name.endswith(("dissipation", "dissipated_power"))):
            assert np.array_equal(mine, other) or np.asarray(mine).tobytes() == np.asarray(other).tobytes(), name
            exact += 1
    assert exact > 250


def test_there_are_enough_impacts_and_strikes_to_tell(pair):
    _, theirs = pair
    counts = [int(theirs[f"statistics/{family}/all/count"][()]) for family in ("impacts", "strikes")]
    assert counts[0] > 1500
    if "rotor" in theirs["deck"]:
        assert counts[1] < 0.95 * counts[0]
        assert all(row["count"][()] > 20 for row in theirs["statistics/impacts"].values())


@pytest.mark.parametrize("name", ["cross_section", "axial"])
def test_the_maps_are_millsims_to_single_precision(pair, name):
    ours, theirs = (file[f"statistics/maps/{name}"] for file in pair)
    assert all(np.array_equal(ours[key], theirs[key]) for key in theirs if key.endswith("_edges"))
    for key in ("impact_count", "normal_speed_sum", "dissipation"):
        if key == "dissipation" and pressed(pair[1]):
            continue
        mine, other = ours[key][:].astype(float), theirs[key][:].astype(float)
        # at edges of cells; a ball that rests on one meets the wall there again and again
        assert np.abs(mine - other).sum() <= 2e-3 * np.abs(other).sum(), key
        assert mine.sum() == pytest.approx(other.sum(), rel=1e-12)
    solid = [group["solid_fraction"][:] for group in (ours, theirs)]
    assert np.array_equal(*np.isnan(solid))
    assert np.nansum(np.abs(solid[0] - solid[1])) <= 1e-4 * np.nansum(solid[1])
    full = solid[1] > np.nanmean(solid[1])
    assert full.mean() > 0.1
    for key in (key for key in theirs if key.startswith("velocity")):
        assert np.array_equal(np.isnan(ours[key][:]), np.isnan(theirs[key][:])), key
        off = np.abs(ours[key][:][full] - theirs[key][:][full])
        assert np.mean(off < 1e-5) > 0.98 and off.max() < 0.02, key


def test_what_holds_only_the_normal_part_says_so(pair):
    ours, rows = tree(pair[0]), len(pair[0]["statistics/impacts"])
    marked = {name for name, item in ours.items() if not isinstance(item, str) and item.attrs.get("part") == "normal"}
    named = {
        name
        for name in ours
        if name == "impacts/dissipation"
        or (name.startswith("statistics/") and name.endswith(("/dissipation", "/dissipated")))
        or (name.startswith("statistics/strikes/") and name.endswith("/dissipated_power"))
    }
    assert marked == named and len(named) == 1 + 4 * rows + 3 * (rows - 1) + 2 + rows


def test_the_run_says_who_made_it(pair):
    ours, theirs = (file["run"] for file in pair)
    for name, fact in RUN.items():
        value, unit, description = fact if isinstance(fact, tuple) else (fact, None, None)
        item = ours[name]
        assert values(item) == value and item.attrs["description"]
        assert unit is None or (item.attrs["unit"], item.attrs["description"]) == (unit, description)
    assert (ours["status"].asstr()[()], ours["steps"].dtype) == ("complete", "<u8")
    assert ours["time"][()] == theirs["time"][()]
    for kind, count in theirs["events/collisions"].items():
        assert ours[f"events/collisions/{kind}"][()] == count[()]


@pytest.fixture(scope="module")
def mill(tmp_path_factory):
    """(deck, millsim's file, folder) of a small mill."""
    folder = tmp_path_factory.mktemp("mill")
    return *foreign.simulate(folder, DECKS["falling balls"]), folder


def test_batches_change_nothing(mill):
    deck, path, folder = mill
    batches = {"whole.h5": (), "many.h5": range(1, 3000, 7)}
    contents = [foreign.digested(folder, deck, path, name, batches=b).read_bytes() for name, b in batches.items()]
    assert contents[0] == contents[1]


def test_a_program_that_ends_before_its_run_leaves_a_file_that_says_so(mill):
    deck, path, folder = mill
    with h5py.File(path) as theirs, Digest(deck, folder / "cut.h5", apart=1e-9) as digest:
        digest.facts(RUN)
        foreign.feed(digest, deck, theirs, until=0.06)
    with h5py.File(folder / "cut.h5") as ours:
        assert ours["run/status"].asstr()[()] == "failed"
        assert ours["run/time"][()] == ours["statistics/duration"][()] == 0.06
        times = ours["impacts/time"][:]
        assert len(times) > 100 and times[-1] < 0.06


def test_what_the_engine_refuses_is_told(mill):
    deck, _, folder = mill
    with Digest(deck, folder / "refused.h5") as digest:
        digest.facts(RUN)
        with pytest.raises(UserError, match=r"record 10 \(impacts\): impact 0: kind 77, expected 0 to 4$") as raised:
            digest.impacts(impacts_of(time=np.zeros(1), kind=77, ball=1, partner=2))
            digest.end("complete", 0.1)
        assert raised.value.status == 1
    with pytest.raises(UserError, match="mill.h5: exists already") as raised, Digest(deck, path_of(deck)) as digest:
        digest.end("complete", 0.1)
    assert raised.value.status == 2


def path_of(deck):
    return deck.path.parent / "mill.h5"


@pytest.mark.parametrize(
    "call, message",
    [
        (lambda d: d.facts({"dt": 1e-6}), r"run: dt: expected \(value, unit"),
        (lambda d: d.account(0.0, {"rotor_wrok": 1}), "rotor_wrok: an account has no value of this name"),
        (lambda d: d.state(0.0, *[np.zeros((200, 2))] * 3), r"expected an array \(200, 3\), got \(200, 2\)"),
    ],
)
def test_what_cannot_be_is_refused_in_one_line(mill, call, message):
    deck, _, folder = mill
    with Digest(deck, folder / "none.h5") as digest, pytest.raises(ValueError, match=message):
        call(digest)
    assert not (folder / "none.h5").exists()


def test_snapshots_are_those_of_the_maps(pair):
    _, theirs = pair
    deck = foreign.Deck.check(foreign.Path(theirs.filename).with_name("mill.ini"))
    times, begin, end = snapshot_times(deck), deck.number("run.sample_from", 0.0), deck.number("run.time")
    step = min(1e-3, (end - begin) / 100)
    assert len(times) == theirs["statistics/maps/samples"][()]
    assert np.allclose(times, begin + (np.arange(len(times)) + 0.5) * step, atol=1e-12)
