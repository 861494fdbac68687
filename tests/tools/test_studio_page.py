"""The page of the studio in a browser, with a source that only pretends (fake_source.js): what comes from the source is
shown, and every field, button and key does its work."""

import json

import numpy as np
import players
import pytest
from conftest import ROOT

from milltools.studio import build

pytestmark = pytest.mark.browser

pytest_plugins = ["browser"]

FAKE = ROOT / "tests/tools/fake_source.js"
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


def test_sliders_take_bounds_units_and_meanings_from_the_keys(studio):
    page = studio(DECK)
    diameter = field(page, "Ball diameter")
    assert [diameter.get_attribute(name) for name in ("min", "max")] == ["1", "7.7"]  # as only the source says
    assert field(page, "Balls").get_attribute("max") == "123456"
    assert "the meaning of diameter" in page.page.locator(".control", has=diameter).get_attribute("title")
    slider = page.evaluate("[...document.querySelectorAll('.control input[type=range]')].map((r) => [r.min, r.max])[2]")
    assert slider == ["2.5", "7.7"]  # half to twice the present value, but not beyond the bounds
    units = page.evaluate("[...document.querySelectorAll('.control .unit')].map((u) => u.textContent)")
    assert units == ["rpm", "", "mm", "", ""]
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


def test_the_ratio_of_a_jar_is_kept_when_the_speed_of_its_disk_is_changed(studio):
    page = studio((ROOT / "input/planetary.ini").read_text())
    assert field(page, "Speed ratio jar : sun").input_value() == "-2"
    field(page, "Speed of sun").fill("500")
    page.until("/speed = 500 rpm/.test(millStudio.deck)")
    assert "speed = -1000 rpm" in page.evaluate("millStudio.deck")
    field(page, "Speed ratio jar : sun").fill("-1.5")
    page.until("/speed = -750 rpm/.test(millStudio.deck)")
    assert "speed = 500 rpm" in page.evaluate("millStudio.deck")
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


def test_a_deck_as_text_keeps_all_but_the_value(studio):
    page = studio()
    text = '[a.b]\nx = 75 mm   # the radius\nfile = "a #b.stl" ; hm\n[c]\ny=3\n'
    set_ = "([text, ...words]) => MillDeck.set(text, ...words)"
    assert page.evaluate(set_, [text, "a.b", "x", "100 mm"]) == text.replace("75 mm   #", "100 mm  #")
    assert page.evaluate(set_, [text, "a.b", "file", "c.stl"]) == text.replace('"a #b.stl" ;', "c.stl      ;")
    assert page.evaluate(set_, [text, "a.b", "z", "1"]) == text.replace("[c]", "z = 1\n[c]")
    assert page.evaluate(set_, [text, "d", "z", "1"]) == text + "\n[d]\nz = 1\n"
    fill = "[balls]\nfill = 20 %  # much\n"
    assert page.evaluate(set_, [fill, "balls", "count", "7", ["fill"]]) == "[balls]\ncount = 7     # much\n"
    assert page.evaluate("(text) => MillDeck.get(text, 'a.b', 'file')", text) == '"a #b.stl"'


@pytest.mark.parametrize("own", [False, True])
def test_a_link_holds_the_design(studio, open_page, pages, own):
    page = studio(DECK if own else None)
    field(page, "Balls").fill("55")
    page.until("millStudio.deck.includes('count = 55 ')")
    link = page.evaluate("millStudio.link()")
    assert len(link.partition("#")[2]) < (400 if own else 120)
    other = open_page(pages["live"])
    other.page.goto("about:blank")
    other.page.goto(link)
    other.evaluate("millStudio.ready")
    assert other.evaluate("millStudio.deck") == page.evaluate("millStudio.deck")
    assert other.evaluate("document.getElementById('preset').value") == ("" if own else "simoloyer")
    other.check()


def test_a_damaged_link_is_said_and_the_reference_mill_opens(open_page, pages):
    page = open_page(pages["live"])
    page.page.goto("about:blank")
    page.page.goto(pages["live"].as_uri() + "#design=abcdef")
    page.evaluate("millStudio.ready")
    assert "The design in the link is damaged" in page.evaluate(WORDS.format("notice"))
    assert page.evaluate("document.getElementById('preset').value") == "simoloyer"


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


def test_numbers_come_with_their_errors_or_are_not_yet_known(studio):
    page = studio(DECK)
    learned(page, 0.25)
    assert page.evaluate(WORDS.format("power")) == "100\u00a0W"
    assert "not yet known" in page.evaluate(WORDS.format("power-more"))
    learned(page, 3.75)
    assert page.evaluate(WORDS.format("power-more")) == "± 1.0\u00a0W, 1\u00a0%"
    finding = page.evaluate(WORDS.format("finding")).replace("\u00a0", " ").replace("\u2011", "-")
    assert finding == "The balls take 100.0 ± 1.0 W: 70 % goes into ball-ball contacts, 30 % into ball-drum contacts"
    assert page.evaluate(WORDS.format("contacts")) == "400\u202f000"
    balance = page.evaluate("[...document.getElementById('balance-rows').rows].map((r) => r.innerText)")
    assert balance[0] == "Work of the drive\t400\u00a0J"
    assert balance[-1].startswith("Left over\t4.0")
    titles = page.evaluate("[...document.querySelectorAll('.chart strong')].map((t) => t.textContent)")
    assert titles[0] == "The drive gives 100.0\u00a0±\u00a01.0\u00a0W"
    assert titles[1] == "70\u00a0% of 100\u00a0W is lost in ball-ball contacts"
    page.check()


def test_every_picture_has_axes_with_units_and_a_text(studio):
    page = studio(DECK)
    for _ in range(4):
        learned(page)
    page.until("document.querySelectorAll('.drawing svg').length === 3")
    labels = page.evaluate("[...document.querySelectorAll('.drawing .label')].map((t) => t.textContent)")
    assert labels == [
        "simulated time [s]",
        "power of the drive [W]",
        "normal energy of an impact [J]",
        "impacts [1/(s decade)]",
    ]
    described = "(d) => document.getElementById(d.getAttribute('aria-describedby')).textContent"
    texts = page.evaluate(f"[...document.querySelectorAll('.drawing')].map({described})")
    assert all(len(text) > 40 for text in texts)
    letters = "[...document.querySelectorAll('.drawing text')].map((t) => parseFloat(getComputedStyle(t).fontSize))"
    assert min(page.evaluate(letters)) >= 11


def test_a_frozen_design_is_compared(studio):
    page = studio(DECK)
    learned(page, 4)
    page.page.get_by_role("button", name="Freeze this design").click()
    rows = "[...document.getElementById('compare-rows').rows].map((r) => [...r.cells].map((c) => c.textContent))"
    assert {row[4] for row in page.evaluate(rows)} == {"cannot be told apart"}
    assert page.page.locator("#same-deck").is_visible()
    field(page, "Speed of the rotor").fill("150")
    page.until("millStudio.deck.includes('150 rpm')")
    learned(page, 4)
    found = {row[0]: row[1:] for row in page.evaluate(rows)}
    assert found["Power of the drive"] == [
        "150.0\u00a0±\u00a01.5\u00a0W",
        "100.0\u00a0±\u00a01.0\u00a0W",
        "50.0\u00a0±\u00a01.8\u00a0W",
        "more",
    ]
    assert found["Impacts of 1 mJ or more"][3] == "better"
    assert found["Median impact speed above 50 mm/s"][3] == "cannot be told apart"
    differ = page.evaluate("[...document.getElementById('differ-rows').rows].map((r) => r.innerText)")
    assert differ == ["rotor.speed\t150 rpm\t100 rpm"]
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
