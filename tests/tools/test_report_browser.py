"""The report in a real browser: no errors, no requests, light and dark, on a phone, on paper, by keys alone."""

import re

import matplotlib.image
import numpy as np
import pytest

pytestmark = pytest.mark.browser

pytest_plugins = ["browser", "reported"]


def test_it_opens_from_disk_without_errors_or_requests(page, open_page):
    opened = open_page(page[0], width=1000, height=800)
    opened.until("document.querySelector('.mp-live') !== null")
    assert "is lost by sliding" in opened.evaluate("document.title")
    opened.check()


def ground(opened):
    """Lightness of the page's ground and of its ink, 0 to 1."""
    return [
        sum(int(v) for v in re.findall(r"\d+", opened.evaluate(f"getComputedStyle(document.body).{what}"))[:3]) / 765
        for what in ("backgroundColor", "color")
    ]  # fmt: skip


def test_dark_is_dark_with_its_drawings_and_the_switch_turns_it(page, open_page):
    opened, light = open_page(page[0], dark=True), open_page(page[0])
    assert ground(light)[0] > 0.95 and ground(light)[1] < 0.2
    assert ground(opened)[0] < 0.15 and ground(opened)[1] > 0.8
    ink = opened.evaluate(
        "getComputedStyle(document.querySelector('#figure-flow svg text')).fill.match(/\\d+/g).slice(0, 3).map(Number)"
    )
    assert min(ink) > 200
    for theme, page_ground in (("light", 0.97), ("dark", 0.1)):
        opened.page.select_option("#theme", theme)
        assert ground(opened)[0] == pytest.approx(page_ground, abs=0.06)
    opened.check()


def test_keys_alone_reach_the_controls_and_unfold_what_is_folded(page, open_page):
    opened = open_page(page[0], width=1000, height=800)
    opened.until("document.querySelector('.mp-live') !== null")
    reached = []
    for _ in range(60):
        opened.page.keyboard.press("Tab")
        what = (
            "document.activeElement.id || document.activeElement.className "
            "|| document.activeElement.getAttribute('href') || document.activeElement.textContent"
        )
        reached.append(opened.evaluate(what))
        if reached[-1] == "8 more figures":
            break
    assert {"skip", "theme", "#deck", "mp-play", "mp-slider", "save screen"} <= set(reached)
    shown = "document.getElementById('figure-slip').checkVisibility()"
    assert not opened.evaluate(shown)
    opened.page.keyboard.press("Enter")
    assert opened.evaluate(shown)


LETTERS = """(open) => {
  if (open) document.querySelectorAll('details').forEach((d) => { d.open = true; });
  return [...document.querySelectorAll('.drawing svg text')].filter((t) => t.checkVisibility())
    .map((t) => parseFloat(getComputedStyle(t).fontSize) * Math.hypot(t.getScreenCTM().a, t.getScreenCTM().b));
}"""


@pytest.mark.parametrize("width", [1200, 360])
def test_letters_of_figures_have_eleven_pixels_at_least_and_nothing_but_tables_scrolls_sideways(page, open_page, width):
    opened = open_page(page[0], width=width, height=800)
    letters = opened.evaluate(LETTERS, True)
    assert len(letters) > 200 and min(letters) >= 11
    assert opened.evaluate("document.documentElement.scrollWidth") == width
    texts = "[...document.querySelectorAll('p, h1, h2, dl, figcaption, nav, pre')]"
    assert opened.evaluate(f"Math.max(...{texts}.map((e) => e.getBoundingClientRect().right))") <= width


def test_what_matters_is_seen_and_the_rest_is_folded(page, open_page):
    opened = open_page(page[0], width=1200, height=800)
    figures = "[...document.querySelectorAll('figure[id]')].filter((f) => f.checkVisibility()).map((f) => f.id)"
    assert opened.evaluate(figures) == ["figure-flow", "figure-energies-power", "figure-wear"]
    assert opened.evaluate("document.querySelector('.card').getBoundingClientRect().top") < 250


def test_paper_is_white_and_shows_what_is_folded_in_letters_of_eight_points_without_controls(page, open_page):
    opened = open_page(page[0], width=680, height=900, dark=True)  # [px] between the margins of A4
    opened.page.emulate_media(media="print")
    assert ground(opened)[0] == 1.0
    letters = opened.evaluate(LETTERS, False)
    assert len(letters) > 400 and min(letters) * 0.75 >= 8
    seen = "[...document.querySelectorAll('{}')].filter((e) => {}e.checkVisibility()).length"
    assert opened.evaluate(seen.format("figure[id], table, pre", "!")) == 0
    assert opened.evaluate(seen.format(".theme, nav, .mp-controls, .save", "")) == 0
    opened.evaluate("dispatchEvent(new Event('beforeprint'))")  # browsers whose style sheets cannot unfold
    assert opened.evaluate("document.querySelectorAll('details:not([open])').length") == 0
    opened.evaluate("dispatchEvent(new Event('afterprint'))")
    assert opened.evaluate("document.querySelectorAll('details[open]').length") == 0


def test_a_link_unfolds_what_it_leads_to(page, open_page):
    opened = open_page(page[0], width=1200, height=800)
    opened.page.click("a[href='#notes']")
    opened.until("document.querySelector('#notes').checkVisibility()")


@pytest.mark.parametrize("webgl", [True, False])
def test_the_card_is_saved_as_a_picture_with_the_mill_in_it(page, open_page, tmp_path, webgl):
    without = (
        "HTMLCanvasElement.prototype.getContext = ((get) => function (kind, ...more) {"
        " return kind === '2d' ? get.call(this, kind, ...more) : null; })(HTMLCanvasElement.prototype.getContext)"
    )
    opened = open_page(page[0], width=1200, height=800, before="" if webgl else without)
    opened.until(f"document.querySelector('.mp-live') {'!==' if webgl else '==='} null")
    with opened.page.expect_download() as download:
        opened.page.click(".save")
    download.value.save_as(tmp_path / "card.png")
    assert download.value.suggested_filename == "small.png"
    picture = matplotlib.image.imread(tmp_path / "card.png")[..., :3]
    assert picture.shape == (1260, 2400, 3)
    mill, title = picture[500:950, 400:1200], picture[80:220, 80:1800]
    colourful = np.ptp(mill, axis=2) > 0.2  # the balls
    assert colourful.mean() > 0.005 and title.min() < 0.2 and picture.max() == 1
