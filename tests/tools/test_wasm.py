"""The engine of the studio, in a browser: the same mill, with the same bits, as the program on this computer."""

import base64
import json

import pytest
from conftest import ROOT, SMALL

pytest_plugins = ["browser"]
pytestmark = pytest.mark.browser
MODULE = ROOT / "build/wasm/millsim.wasm"
INPUT = ROOT / "input"
# A deck with what its mill needs of the folder, and a run of it
RUN = """async ({bytes, deck, set, files, until, slices}) => {
  const array = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  window.engine ??= await MillEngine.start(array(bytes));
  const given = new Map(Object.entries(files).map(([name, text]) => [name, array(text)]));
  try {
    const mill = engine.load(deck, set, given);
    for (let k = 0; k < slices; k++) engine.run(until, 1000 + 777 * k);
    const begin = performance.now(), before = engine.state().contacts;
    engine.run(until, 1e15);
    const took = (performance.now() - begin) / 1000, {time, contacts, work, energy, collisions} = engine.state();
    const {statistics, notes} = engine.results();
    const rate = (contacts - before) / took, memory = engine.memory;
    return {mill, time, contacts, work, energy, collisions: [...collisions], statistics, notes, rate, memory};
  } catch (fault) {
    return {lines: fault.lines ?? [String(fault.stack)]};
  }
}"""


def text_of(data: bytes) -> str:
    return base64.b64encode(data).decode()


@pytest.fixture
def engine(open_page, tmp_path):
    """run(deck text, set, files, until, slices): what RUN returns"""
    assert MODULE.exists(), "build/wasm/millsim.wasm is missing: make wasm"
    page = tmp_path / "engine.html"
    script = (ROOT / "tools/milltools/studio/engine.js").read_text("utf-8")
    page.write_text(f"<!doctype html><meta charset=utf-8><title>engine</title><script>{script}</script>", "utf-8")
    opened = open_page(page)
    bytes_ = text_of(MODULE.read_bytes())

    def run(deck, until, set=(), files=(), slices=0):
        given = {path.name: text_of(path.read_bytes()) for path in files}
        order = {"bytes": bytes_, "deck": deck, "set": list(set), "files": given, "until": until, "slices": slices}
        return opened.evaluate(RUN, order)

    run.page = opened
    yield run
    opened.check()


def native(millsim, deck, set, tmp_path):
    words = [word for one in set for word in ("-s", one)]
    done = millsim(*words, "-j", "-q", "-f", "-o", tmp_path / "native.h5", deck)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def same_bits(found, expected):
    """Every number of the statistics, and the sums since the start"""
    assert "lines" not in found, found["lines"]
    assert found["statistics"] == expected["statistics"]
    assert found["contacts"] == sum(expected["run"]["collisions"].values())
    assert found["work"] == expected["run"]["drive_work"]


@pytest.mark.slow
def test_after_two_million_contacts_the_reference_mill_has_the_bits_of_the_program(engine, millsim, tmp_path):
    deck = INPUT / "simoloyer.ini"
    expected = native(millsim, deck, [], tmp_path)
    found = engine(deck.read_text("utf-8"), 0.3)
    same_bits(found, expected)
    assert found["contacts"] > 2e6


@pytest.mark.slow
@pytest.mark.parametrize(
    "name, time, more",
    [
        ("planetary", 1, ["balls.count=50", "balls.diameter=8 mm"]),
        ("mixer", 1, []),
        ("attritor", 0.1, ["run.sample_from=0.05 s"]),
        ("tumbling", 1, ["run.sample_from=0.5 s"]),
        ("stl", 0.05, ["run.sample_from=0 s"]),
        ("wavy", 0.05, ["run.precision=0", "run.sample_from=0.02 s"]),
        ("shaker", 0.5, ["run.sample_from=0.1 s"]),
        ("emax", 0.2, ["run.sample_from=0.05 s"]),
        ("discs", 0.01, ["run.sample_from=0 s"]),
        ("mixture", 0.02, ["run.sample_from=0 s"]),
    ],
)
def test_mills_of_every_kind_have_the_bits_of_the_program(engine, millsim, tmp_path, name, time, more):
    deck, set = INPUT / f"{name}.ini", [f"run.time={time} s", *more]
    expected = native(millsim, deck, set, tmp_path)
    files = [INPUT / "rotor.stl"] if name == "stl" else []
    found = engine(deck.read_text("utf-8"), time, set, files)
    same_bits(found, expected)


def test_the_notes_are_those_of_the_summary(engine, millsim, tmp_path, write_deck):
    soft = ["contact.restitution=0.4"]
    expected = native(millsim, write_deck(), soft, tmp_path)
    assert any("hard spheres are valid" in note for note in expected["notes"])
    assert engine(SMALL, 0.05, soft)["notes"] == expected["notes"]


def test_pauses_change_nothing(engine):
    whole, paused = (engine(SMALL, 0.05, slices=slices) for slices in (0, 40))
    assert whole["statistics"] == paused["statistics"]
    assert whole["work"] == paused["work"]


def test_a_wrong_deck_gets_the_programs_own_message(engine, millsim, tmp_path):
    wrong = SMALL.replace("radius = 30 mm", "radius = 30 s").replace("count = 20", "count = many")
    (tmp_path / "deck.ini").write_text(wrong)
    said = millsim("--check", "deck.ini").stderr.splitlines()
    found = engine(wrong, 0.01)
    assert found["lines"] == [line.replace("millsim: deck.ini", "deck") for line in said]


def test_a_fault_of_the_start_is_told(engine):
    found = engine(SMALL, 0.01, ["balls.count=20000"])
    assert len(found["lines"]) == 1
    assert "do not fit" in found["lines"][0]


def test_a_missing_file_is_told_with_its_key(engine):
    found = engine((INPUT / "stl.ini").read_text("utf-8"), 0.01)
    assert any("file" in line and "rotor.stl" in line for line in found["lines"]), found


def test_an_unknown_unit_is_told_with_the_known_ones(engine):
    found = engine(SMALL.replace("radius = 30 mm", "radius = 0.02 fathom"), 0.01)
    assert "(unknown unit 'fathom'; the studio knows m, mm, cm, inch" in found["lines"][0]


def test_a_failed_load_leaves_the_mill_before_it(engine):
    before = engine(SMALL, 0.02)
    engine(SMALL, 0.01, ["balls.count=20000"])
    assert engine(SMALL, 0.02)["work"] == before["work"]


def test_the_memory_of_a_design_is_given_back(engine):
    engine(SMALL, 0.001)
    sizes = engine.page.evaluate(
        """(deck) => Array.from({length: 300}, (_, k) => {
          engine.load(deck, [`balls.count=${10 + k % 10}`], new Map());
          engine.run(0.001, 1e15);
          engine.results();
          return engine.memory;
        })""",
        SMALL,
    )
    # the allocator may split its memory a little differently; 15 kB left behind by each design would be too much
    assert sizes[299] - sizes[99] < 200 * 15_000


def test_keys_have_the_bounds_of_the_decks_table(engine):
    keys = {f"{key['section']}.{key['key']}": key for key in engine(SMALL, 0.001)["mill"]["keys"]}
    restitution, radius = keys["contact.restitution"], keys["drum.radius"]
    assert (restitution["lo"], restitution["hi"], restitution["above"]) == (0, 1, 0)
    assert (radius["unit"], radius["lo"], radius["above"], radius["value"]) == ("m", 0, 1, "0.03 m")
    assert keys["drum.profile"]["words"] == "circle|wavy"
    assert keys["balls.fill"]["instead"] == "count"
    assert all(key["meaning"] for key in keys.values())
