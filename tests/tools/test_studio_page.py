"""The page of the studio in a browser: with a source that only pretends (fake_source.js), so that what comes from it is
shown, and every field, button and key does its work; with its engine; and with a run that is watched. tests/web has the
tests of what its scripts compute."""

import json

import numpy as np
import players
import pytest
from conftest import ROOT

from milltools import __main__
from milltools.read.runfile import Run
from milltools.studio import build, command
from milltools.watch import page as watched
from milltools.watch.follow import Follower
from milltools.watch.server import Server

pytestmark = pytest.mark.browser

pytest_plugins = ["browser", "watched"]

FAKE = ROOT / "tests/tools/fake_source.js"
MODULE = ROOT / "build/wasm/millsim.wasm"
WITHOUT_WEBGL = (
    "HTMLCanvasElement.prototype.getContext = ((get) => function (kind, ...more) {"
    " return kind === '2d' ? get.call(this, kind, ...more) : null; })(HTMLCanvasElement.prototype.getContext)"
)
WORDS = "document.getElementById('{}').innerText"


@pytest.fixture(scope="module")
def pages(tmp_path_factory):
    """Files of the page: with a source that is live, and with one that is watched."""
    folder, found = tmp_path_factory.mktemp("studio"), {}
    for name, live in (("live", "true"), ("watch", "false")):
        start = f"new FakeSource(data.bytes('colours'), {live})"
        found[name] = folder / f"{name}.html"
        text = build.page({"colours": build.palette()}, start, [FAKE.read_text()], build.presets())
        found[name].write_text(text, "utf-8")
    return found


@pytest.fixture
def studio(open_page, pages):
    """studio(deck=None, **options of open_page): the page, its mill built, paused."""

    def opened(deck=None, width=1000, height=800, **options):
        page = open_page(pages["live"], width=width, height=height, **options)
        page.evaluate("millStudio.ready")
        if deck:
            page.evaluate("(text) => { millStudio.open(text); }", deck)
            page.until("millStudio.deck === " + json.dumps(deck))
        return page

    return opened


def field(page, label):
    return page.page.get_by_label(label, exact=True).first


def learned(page, seconds=1.5):
    """Lets a mill go on for some simulated time, and the numbers come to the page."""
    page.evaluate(f"fake.advance({seconds})")
    page.evaluate("millStudio.refresh()")


DECK = """\
# a mill
[balls]
count = 30        # how many
diameter = 5 mm
[rotor]
speed = 100 rpm   ; slow
[contact]
restitution = 0.8
friction = 0.3
"""


def test_it_opens_from_disk_with_the_reference_mill(studio):
    page = studio()
    page.until("millStudio.stage.draws > 0")
    assert page.evaluate("millStudio.deck") == (ROOT / "input/simoloyer.ini").read_text()
    assert players.coloured(page.picture(".mp-stage")).mean() > 0.01
    page.check()


def test_a_slider_builds_a_new_mill_and_keeps_comments_and_units(studio):
    page = studio(DECK)
    both = [field(page, name).element_handle() for name in ("Balls", "Speed of the rotor")]
    page.evaluate(  # at once, however busy the machine is
        """([balls, speed]) => [[balls, 40], [speed, 120.5]].forEach(([field, value]) => {
          field.value = value;
          field.dispatchEvent(new Event('input', {bubbles: true}));
        })""",
        both,
    )
    page.until("millStudio.record.mill.deck.includes('120.5')")
    wanted = DECK.replace("30        #", "40        #").replace("100 rpm   ;", "120.5 rpm ;")
    assert page.evaluate("millStudio.deck") == wanted
    assert page.evaluate("fake.loads.length") == 3  # both changes together: one mill
    assert [field(page, "Ball diameter").get_attribute(name) for name in ("min", "max")] == [
        "1",
        "7.7",
    ]  # of the source
    page.check()


def test_a_change_while_a_mill_is_built_is_not_lost(studio):
    page = studio(DECK)
    page.evaluate(
        """() => {
          millStudio.change((text) => text.replace('100 rpm', '150 rpm'), 'rotor.speed');
          millStudio.build(millStudio.deck, {});
        }"""
    )
    page.until("/150 rpm/.test(millStudio.deck)")
    assert field(page, "Speed of the rotor").input_value() == "150"
    page.check()


def test_a_wrong_value_shows_the_message_beside_the_field_and_the_old_mill_goes_on(studio):
    page = studio(DECK)
    page.evaluate("millStudio.play()")
    field(page, "Restitution").fill("1.3")
    fault = page.page.locator(".control", has=field(page, "Restitution")).locator(".fault")
    fault.wait_for()
    assert fault.inner_text() == "expected a number from 0 to 1, got '1.3'"
    assert field(page, "Restitution").get_attribute("aria-invalid") == "true"
    assert page.evaluate("millStudio.deck") == DECK
    before = page.evaluate("millStudio.record.state.time")
    page.until(f"millStudio.record.state.time > {before}")
    page.page.get_by_role("button", name="Undo changes").click()
    fault.wait_for(state="hidden")
    assert field(page, "Restitution").input_value() == "0.8"
    page.check()


def test_an_emptied_field_asks_for_a_number(studio):
    page = studio(DECK)
    friction = field(page, "Friction")
    fault = page.page.locator(".control", has=friction).locator(".fault")
    friction.fill("")
    assert fault.inner_text() == "a number is expected; the mill has 0.3"
    friction.fill("0.3")
    assert fault.is_hidden() and friction.get_attribute("aria-invalid") == "false"
    page.check()


def test_every_key_can_be_edited_as_text(studio):
    page = studio(DECK)
    page.page.locator("#all-keys summary").click()
    assert page.page.locator("#k-gravity-acceleration").evaluate("(e) => e.classList.contains('default')")
    page.page.locator("#k-balls-diameter").fill("6.5 mm")
    page.page.locator("#k-balls-diameter").press("Enter")
    page.until("millStudio.deck.includes('diameter = 6.5 mm')")
    assert field(page, "Ball diameter").input_value() == "6.5"
    page.check()


def test_a_link_holds_the_design_and_a_damaged_one_is_said(studio, open_page, pages):
    page = studio()
    field(page, "Balls").fill("55")
    page.until("millStudio.deck.includes('count = 55 ')")
    other = open_page(pages["live"])
    other.page.goto("about:blank")
    other.page.goto(page.evaluate("millStudio.link()"))
    other.evaluate("millStudio.ready")
    assert other.evaluate("millStudio.deck") == page.evaluate("millStudio.deck")
    other.page.goto("about:blank")
    other.page.goto(pages["live"].as_uri() + "#design=abcdef")
    other.evaluate("millStudio.ready")
    assert "The design in the link is damaged" in other.evaluate(WORDS.format("notice"))
    assert other.evaluate("document.getElementById('preset').value") == "simoloyer"
    other.check()


def test_a_dropped_deck_comes_with_its_files(studio):
    page = studio()
    drop = """(deck) => { const data = new DataTransfer();
      data.items.add(new File([deck], 'mine.ini')); data.items.add(new File(['solid'], 'rotor.stl'));
      document.dispatchEvent(new DragEvent('drop', { dataTransfer: data, bubbles: true, cancelable: true })); }"""
    page.evaluate(drop, DECK)
    page.until("millStudio.deck.startsWith('# a mill')")
    assert page.evaluate("[...fake.loads.at(-1).files.keys()]") == ["rotor.stl"]
    with page.page.expect_download() as saved:
        page.page.get_by_role("button", name="Download deck").click()
    assert saved.value.suggested_filename == "mine.ini"
    assert saved.value.path().read_text() == DECK
    page.check()


def test_keys_drive_it(studio):
    page = studio()
    page.until("millStudio.stage.draws > 0")
    press = page.page.keyboard.press
    press("Space")
    page.until("millStudio.playing && millStudio.record.state.time > 0")
    press("Space")
    assert not page.evaluate("millStudio.playing")
    page.until("millStudio.stage.drawn === millStudio.stage.shown")
    last = page.evaluate("millStudio.stage.shown.time")
    press("Comma")
    assert page.evaluate("millStudio.stage.shown.time") < last
    press("Period")
    assert page.evaluate("millStudio.stage.shown.time") == last
    press("Period")
    page.until(f"millStudio.stage.shown.time > {last}")
    press("3")
    page.until("millStudio.deck.includes('[motion.sun]')")
    assert page.evaluate("document.getElementById('preset').value") == "planetary"
    press("?")
    assert page.page.get_by_role("dialog").is_visible()
    press("Escape")
    page.page.locator(".mp-canvas").focus()
    eye = "millStudio.stage.view.camera.position.toArray()"
    before = page.evaluate(eye)
    press("ArrowLeft")
    turned = page.evaluate(eye)
    press("+")
    assert before != turned != page.evaluate(eye)
    page.check()


def test_digits_typed_into_a_field_are_no_keys_of_the_page(studio):
    page = studio(DECK)
    field(page, "Balls").fill("")
    field(page, "Balls").press_sequentially("33")
    page.until("millStudio.deck.includes('count = 33 ')")
    assert page.evaluate("document.getElementById('preset').value") == ""


def test_slow_motion_and_cameras_are_asked_for(studio):
    page = studio()
    page.page.select_option("#speed", label="1/50 of real time")
    page.page.get_by_role("button", name="Play", exact=True).click()
    assert page.evaluate("fake.runs") == [0.02]
    page.until(WORDS.format("reached") + ".includes('1/50 of real time')")
    options = page.evaluate("[...document.getElementById('camera').options].map((o) => o.text)")
    assert options == ["laboratory", "on rotor", "on jar"]
    page.page.select_option("#camera", "rotor")
    assert page.evaluate("[millStudio.stage.view.riding, millStudio.stage.view.on]") == [True, 0]
    page.check()


def test_by_itself_it_is_fast_until_the_error_is_known_and_slow_then(studio):
    page = studio()
    page.evaluate("millStudio.play()")
    page.until("fake.runs.length > 1")
    assert page.evaluate("fake.runs") == [pytest.approx(np.inf), 0.05]
    assert page.evaluate("millStudio.record.power().error") > 0


def test_numbers_and_figures_come_with_their_errors_and_a_text(studio):
    page = studio(DECK)
    learned(page, 0.25)
    assert "not yet known" in page.evaluate(WORDS.format("power-more"))
    for _ in range(3):
        learned(page, 1.25)
    assert page.evaluate(WORDS.format("power-more")) == "± 1.0\u00a0W, 1\u00a0%"
    finding = page.evaluate(WORDS.format("finding")).replace("\u00a0", " ").replace("\u2011", "-")
    assert finding == "The balls take 100.0 ± 1.0 W: 70 % goes into ball-ball contacts, 30 % into ball-drum contacts"
    assert page.page.locator("#balance-rows tr").first.inner_text() == "Work of the drive\t400\u00a0J"
    titles = page.page.locator(".chart strong").all_text_contents()
    assert titles[1] == "70\u00a0% of 100\u00a0W is lost in ball-ball contacts"
    page.until("document.querySelectorAll('.drawing svg').length === 3")
    described = "(d) => document.getElementById(d.getAttribute('aria-describedby')).textContent"
    assert all(len(text) > 40 for text in page.evaluate(f"[...document.querySelectorAll('.drawing')].map({described})"))
    letters = "[...document.querySelectorAll('.drawing text')].map((t) => parseFloat(getComputedStyle(t).fontSize))"
    assert min(page.evaluate(letters)) >= 11
    page.check()


def test_a_frozen_design_is_compared(studio):
    page = studio(DECK)
    learned(page, 4)
    page.page.get_by_role("button", name="Freeze this design").click()
    assert page.page.locator("#same-deck").is_visible()
    field(page, "Speed of the rotor").fill("150")
    page.until("millStudio.deck.includes('150 rpm')")
    learned(page, 4)
    row = page.page.locator("#compare-rows tr").first.inner_text().replace("\u00a0", " ").split("\t")
    assert row == ["Power of the drive", "150.0 ± 1.5 W", "100.0 ± 1.0 W", "50.0 ± 1.8 W", "more"]
    assert page.page.locator("#differ-rows tr").all_inner_texts() == ["rotor.speed\t150 rpm\t100 rpm"]
    assert page.page.locator(".mean.ghost").count() >= 1
    page.page.get_by_role("button", name="Clear").click()
    assert not page.page.locator("#compare").is_visible()
    page.check()


@pytest.mark.parametrize("width", [390, 1200])
def test_nothing_scrolls_sideways(studio, width):
    page = studio(width=width, height=800)
    learned(page, 4)
    page.page.get_by_role("button", name="Freeze this design").click()
    page.page.locator("#all-keys summary").click()
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    things = "document.querySelectorAll('h1, p, button, select, input, figure, dl')"
    ends = "filter((e) => e.checkVisibility()).map((e) => e.getBoundingClientRect().right)"
    reach = f"Math.max(...[...{things}].{ends})"
    assert page.evaluate(reach) <= width
    page.check()


def test_numbers_do_not_move_what_is_below_them(studio):
    page = studio(width=1200, height=900)
    things = "document.querySelectorAll('.tiles, .chart, .drawing, .control')"
    tops = f"[...{things}].map((e) => Math.round(e.getBoundingClientRect().top))"
    learned(page, 0.25)
    before = page.evaluate(tops)
    for _ in range(4):
        learned(page)
    assert page.evaluate(tops) == before


def test_without_webgl_it_says_so_and_the_processor_draws(studio):
    page = studio(DECK, before=WITHOUT_WEBGL)
    page.until("millStudio.stage.draws > 0")
    assert "WebGL 2" in page.evaluate(WORDS.format("lacking"))
    before = page.picture(".mp-stage")
    assert players.coloured(before).mean() > 0.01
    page.evaluate("fake.advance(0.05)")
    page.until("millStudio.stage.drawn.time > 0")
    assert (page.picture(".mp-stage") != before).any()
    page.check()


def test_without_webassembly_it_says_which_browsers_have_it(open_page, pages):
    page = open_page(pages["live"], before="delete window.WebAssembly")
    assert page.evaluate("millStudio.ready") is False
    assert "needs WebAssembly" in page.evaluate(WORDS.format("notice"))
    page.check()


def test_with_less_motion_asked_for_it_starts_paused(studio):
    assert not studio().evaluate("millStudio.playing || fake.runs.length > 0")
    assert studio(motion=True).evaluate("millStudio.playing && fake.runs.length > 0")


def test_dark_is_dark_and_the_switch_turns_it(studio):
    ground = "getComputedStyle(document.body).backgroundColor.match(/\\d+/g).map(Number)"
    page = studio(dark=True)
    assert max(page.evaluate(ground)[:3]) < 40
    page.page.select_option("#theme", "light")
    assert min(page.evaluate(ground)[:3]) > 240
    page.check()


def test_a_watched_run_is_read_only_and_shows_its_progress(open_page, pages):
    page = open_page(pages["watch"], width=1000, height=800)
    page.evaluate("millStudio.ready")
    page.until(WORDS.format("left") + " !== ''")
    assert page.evaluate(WORDS.format("left")) == "40 %, 5\u00a0min left"
    assert field(page, "Balls").get_attribute("readonly") is not None
    for name in ("Freeze this design", "Open deck", "Copy link", "Restart"):
        assert not page.page.get_by_role("button", name=name).is_visible()
    page.check()


# ---- with its engine, as users get it; with a run


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    assert MODULE.exists(), "build/wasm/millsim.wasm is missing: make wasm"
    path = tmp_path_factory.mktemp("studio") / "studio.html"
    build.main(str(MODULE), str(path))
    return path


@pytest.mark.slow
def test_the_engine_runs_a_mill_and_its_message_stands_beside_the_field(open_page, built):
    page = open_page(built, width=1000, height=800)
    assert page.evaluate("millStudio.ready") is True
    page.until("millStudio.record !== undefined")
    page.page.select_option("#speed", "fast")
    page.evaluate("millStudio.play()")
    page.until("millStudio.record.state?.contacts > 300 && millStudio.record.power().value")
    page.evaluate("millStudio.pause()")
    assert page.evaluate(WORDS.format("notice")) == ""
    assert page.evaluate("millStudio.record.balance().relative") < 1e-12
    field(page, "Balls").fill("1000000")
    fault = page.page.locator(".control", has=page.page.locator("#c-balls-count")).locator(".fault")
    fault.wait_for()
    assert "fit" in fault.inner_text() or "fill" in fault.inner_text()
    page.page.get_by_role("button", name="Undo changes").click()
    fault.wait_for(state="hidden")
    page.check()


@pytest.mark.slow
def test_a_copy_with_a_mesh_simulates_it(built, open_page, monkeypatch, tmp_path, the_program):
    monkeypatch.setattr(command, "built", lambda: built)
    copy = tmp_path / "stl.html"
    assert __main__.dispatch(["studio", str(ROOT / "input/stl.ini"), "-o", str(copy)]) == 0
    page = open_page(copy)
    page.evaluate("millStudio.ready")
    page.until("millStudio.stage.draws > 0")
    assert page.evaluate(WORDS.format("notice")) == ""
    assert page.evaluate("millStudio.record.mill.kinds").count("ball_rotor") == 1
    page.check()


def test_the_page_of_a_run_needs_no_checkout(monkeypatch, tmp_path):
    monkeypatch.setattr(build, "ROOT", tmp_path)
    assert "new WatchSource" in watched.text("/token/")


def test_the_page_of_a_run_shows_it(open_page, whole):
    """In a browser that obeys the page's policy: balls, results and the end of the run, and no complaint."""
    with Server(Follower(whole[0]), watched.text) as server, Run(whole[0]) as run:
        page = open_page(server.address, motion=True)
        assert page.evaluate("millStudio.ready")
        page.until("millStudio.stage.draws > 0 && millStudio.stage.shown.time >= 0.1 && !millStudio.playing")
        positions = page.evaluate("[...millStudio.stage.shown.positions]")
        assert np.array_equal(positions, run.frame(-1, "position").ravel())
        assert page.evaluate("millStudio.record.statistics.drive.power") == float(run.statistic("drive/power"))
        assert page.evaluate("millStudio.deck") == run.deck_text()
        fields = page.page.locator(".control .field")
        shown = [(one.locator("input").input_value(), one.inner_text().strip()) for one in fields.all()]
        assert shown == [("600", "rpm"), ("20", ""), ("5", "mm"), ("0.8", ""), ("0.3", "")]
        assert page.evaluate("document.getElementById('left').textContent") == "100 %, complete at 0.1 s"
        assert page.evaluate("document.getElementById('notice').hidden")
        assert page.evaluate("[...document.querySelectorAll('.engine')].every((one) => one.offsetParent === null)")
        page.check()
