"""The page of the studio with its engine, as users get it: from a file on disk, in a browser."""

import pytest
from conftest import ROOT

from milltools import __main__
from milltools.studio import build, command

pytestmark = [pytest.mark.browser, pytest.mark.slow]

pytest_plugins = ["browser"]

MODULE = ROOT / "build/wasm/millsim.wasm"
NOTICE = "document.getElementById('notice').innerText"


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    assert MODULE.exists(), "build/wasm/millsim.wasm is missing: make wasm"
    path = tmp_path_factory.mktemp("studio") / "studio.html"
    build.main(str(MODULE), str(path))
    return path


@pytest.fixture(scope="module")
def page(keep_page, built):
    page = keep_page(built, width=1000, height=800)
    assert page.evaluate("millStudio.ready") is True
    return page


def opened(page, name):
    page.evaluate(f"void millStudio.preset('{name}')")
    page.until(f"millStudio.opened === '{name}' && !millStudio.asked && !millStudio.next")


@pytest.mark.parametrize("name", build.PRESETS)
def test_every_mill_turns_and_its_books_close(page, name):
    opened(page, name)
    page.page.select_option("#speed", "fast")
    page.evaluate("millStudio.play()")
    page.until("millStudio.record.state?.contacts > 300")
    page.evaluate("millStudio.pause()")
    assert page.evaluate(NOTICE) == ""
    assert page.evaluate("millStudio.record.balance().relative") < 1e-12
    assert page.page.locator(".control").count() >= 5
    page.check()


def test_the_power_of_a_planetary_mill_is_that_of_millsim(page):
    opened(page, "planetary")
    page.page.select_option("#speed", "fast")
    page.evaluate("millStudio.play()")
    page.until("millStudio.record.power().error < 0.3 && millStudio.record.power().error > 0")
    page.evaluate("millStudio.pause()")
    power = page.evaluate("millStudio.record.power()")
    assert abs(power["value"] - 15.70) < 4 * power["error"]  # [W] of `millsim input/planetary.ini`: 15.70 +- 0.05
    share = page.evaluate(
        "(({ins, outs}) => outs.reduce((s, r) => s + r.value, 0) / ins.reduce((s, r) => s + r.value, 0))"
        "(millStudio.record.flows())"
    )
    assert share == pytest.approx(1, abs=0.01)
    page.check()


def test_hard_impacts_of_the_spectrum_are_those_of_the_engine(page):
    opened(page, "planetary")
    page.page.select_option("#speed", "fast")
    page.evaluate("millStudio.play()")
    page.until("millStudio.record.statistics?.precision.rate_above_1mJ.value > 0")
    page.evaluate("millStudio.pause()")
    page.page.wait_for_timeout(200)
    counted = "MillResults.above(millStudio.record.spectrum, 1e-3) / millStudio.record.statistics.duration"
    told = "millStudio.record.statistics.precision.rate_above_1mJ.value"
    assert page.evaluate(counted) == pytest.approx(page.evaluate(told))
    kinds = "millStudio.record.mill.kinds.map((k) => millStudio.record.spectrum.count[k].reduce((a, b) => a + b))"
    of_engine = "millStudio.record.mill.kinds.map((k) => millStudio.record.statistics.impacts[k].count)"
    assert page.evaluate(kinds) == page.evaluate(of_engine)


def test_the_engines_message_stands_beside_the_field(page):
    opened(page, "simoloyer")
    page.page.get_by_label("Balls", exact=True).first.fill("1000000")
    fault = page.page.locator(".control", has=page.page.locator("#c-balls-count")).locator(".fault")
    fault.wait_for()
    assert "fit" in fault.inner_text() or "fill" in fault.inner_text()
    page.page.get_by_role("button", name="Undo changes").click()
    fault.wait_for(state="hidden")
    page.check()


def test_a_copy_with_a_mesh_simulates_it(built, open_page, monkeypatch, tmp_path):
    monkeypatch.setattr(command, "built", lambda: built)
    copy = tmp_path / "stl.html"
    assert __main__.dispatch(["studio", str(ROOT / "input/stl.ini"), "-o", str(copy)]) == 0
    page = open_page(copy)
    page.evaluate("millStudio.ready")
    page.until("millStudio.stage.draws > 0")
    assert page.evaluate(NOTICE) == ""
    assert page.evaluate("millStudio.record.mill.kinds").count("ball_rotor") == 1
    page.check()
