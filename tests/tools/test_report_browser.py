"""The report in a real browser: no errors, no requests, light and dark, on a phone, on paper, by keys alone."""

import re

import pytest

pytestmark = pytest.mark.browser

pytest_plugins = ["browser", "reported"]


def test_it_opens_from_disk_without_errors_or_requests(page, open_page):
    opened = open_page(page[0], width=1000, height=800)
    opened.until("document.querySelector('.mp-live') !== null")
    assert opened.evaluate("document.title") == "small.ini"
    opened.check()


def test_on_a_phone_nothing_but_tables_scrolls_sideways(page, open_page):
    opened = open_page(page[0], width=360, height=640)
    assert opened.evaluate("document.documentElement.scrollWidth") <= 360
    reach = (
        "Math.max(...[...document.querySelectorAll('p, h1, h2, dl, figcaption, nav, pre')]"
        ".map(e => e.getBoundingClientRect().right))"
    )
    assert opened.evaluate(reach) <= 360


def ground(opened):
    """Lightness of the page's ground and of its ink, 0 to 1."""
    return [
        sum(int(v) for v in re.findall(r"\d+", opened.evaluate(f"getComputedStyle(document.body).{what}"))[:3]) / 765
        for what in ("backgroundColor", "color")
    ]  # fmt: skip


def test_dark_is_dark_and_light_is_light(page, open_page):
    dark, light = (ground(open_page(page[0], dark=dark)) for dark in (True, False))
    assert dark[0] < 0.15 and dark[1] > 0.8
    assert light[0] > 0.95 and light[1] < 0.2


def test_drawings_take_the_ink_of_the_page(page, open_page):
    opened = open_page(page[0], dark=True)
    ink = opened.evaluate(
        "getComputedStyle(document.querySelector('#figure-speeds svg text'))"
        ".fill.match(/\\d+/g).slice(0, 3).map(Number)"
    )
    assert min(ink) > 200


def test_the_switch_turns_the_page_dark_and_back(page, open_page):
    opened = open_page(page[0])
    opened.page.select_option("#theme", "dark")
    assert ground(opened)[0] < 0.15
    opened.page.select_option("#theme", "light")
    assert ground(opened)[0] > 0.95
    opened.check()


def test_keys_alone_reach_the_controls_and_change_the_spectra(page, open_page):
    opened = open_page(page[0], width=1000, height=800)
    opened.until("document.querySelector('.mp-live') !== null")
    reached = []
    for _ in range(60):
        opened.page.keyboard.press("Tab")
        what = (
            "document.activeElement.id || document.activeElement.className "
            "|| document.activeElement.getAttribute('href')"
        )
        reached.append(opened.evaluate(what))
        if reached[-1] == "spectra-1":
            break
    assert {"skip", "theme", "#deck", "mp-play", "mp-slider"} <= set(reached)
    shown = "getComputedStyle(document.getElementById('figure-slip').closest('.panel')).display"
    assert opened.evaluate(shown) == "none"
    opened.page.keyboard.press("ArrowRight")
    assert opened.evaluate(shown) == "block"


def test_paper_is_white_and_shows_all_spectra_without_controls(page, open_page):
    opened = open_page(page[0], width=700, height=900, dark=True)
    opened.page.emulate_media(media="print")
    assert ground(opened)[0] == 1.0
    hidden = "getComputedStyle(document.querySelector('{}')).display"
    for what in (".theme", "nav", ".choice", ".mp-controls"):
        assert opened.evaluate(hidden.format(what)) == "none"
    assert opened.evaluate("document.getElementById('figure-slip').getBoundingClientRect().height") > 50


def test_without_scripts_the_still_picture_stands_there(page, open_page):
    opened = open_page(page[0], scripts=False)
    picture = opened.picture(".mp-stage")
    assert picture.std() > 10
