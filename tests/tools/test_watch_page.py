"""The page of `mill watch` in a browser."""

import contextlib

import numpy as np
import pytest
from watching import until

from milltools import pages
from milltools.read.runfile import Run
from milltools.watch import page
from milltools.watch.follow import Follower
from milltools.watch.server import Server

pytest_plugins = ["browser", "watched"]
pytestmark = pytest.mark.browser


HARNESS = """
window.heard = []; window.times = [];
const source = new WatchSource(window.MILL_WATCH);
source.on = (m) => { window.heard.push(m); window.times.push(performance.now()); };
window.source = source;
source.run();
"""


@contextlib.contextmanager
def tab_of(chromium, path, more=""):
    """A page of playwright with the source of a served run, which keeps what it hears."""
    with Server(Follower(path), lambda place: "") as server:
        texts = [*page.scripts(f"/{server.token}/"), HARNESS, more]
        scripts = "".join(f"<script>{text}</script>" for text in texts)
        policy = pages.policy(texts) + "; connect-src 'self'"
        server.page = f'<!doctype html><meta http-equiv="Content-Security-Policy" content="{policy}">{scripts}'
        tab = chromium.new_context().new_page()
        tab.goto(server.address)
        tab.server = server
        yield tab
        tab.context.close()


@pytest.fixture
def tab(chromium, whole):
    with tab_of(chromium, whole[0]) as found:
        yield found


@pytest.fixture(scope="module")
def played(chromium, whole):
    """The page of a finished run after its last state."""
    with tab_of(chromium, whole[0]) as found:
        until(lambda: found.evaluate("heard.some((m) => m.ended)"))
        yield found


def heard(tab, kind):
    return tab.evaluate(f"heard.filter((m) => m.type === '{kind}').length")


def test_the_page_needs_no_checkout(monkeypatch, tmp_path):
    from milltools.studio import build

    monkeypatch.setattr(build, "ROOT", tmp_path)
    assert "new WatchSource" in page.text("/token/")


def test_the_page_hears_the_mill_and_then_every_state_in_order(played, whole):
    with Run(whole[0]) as run:
        times = played.evaluate("heard.filter((m) => m.type === 'state').map((m) => m.time)")
        assert times == run.frame_times().tolist()
        last = played.evaluate("[...heard.findLast((m) => m.type === 'state').positions]")
        assert np.array_equal(np.array(last, "<f4").reshape(-1, 3), run.frame(-1, "position"))
    order = played.evaluate("heard.map((m) => m.type)")
    assert order.index("mill") < order.index("state") and order.count("mill") == 1 and order.count("results") == 1
    assert played.evaluate("heard.find((m) => m.type === 'mill').head.colours instanceof Uint8Array")
    assert played.evaluate("heard.find((m) => m.type === 'results').spectrum.count.all instanceof Float64Array")
    assert played.evaluate("source.live") is False


def test_states_are_shown_evenly(played):
    gaps = np.diff(played.evaluate("times.filter((_, k) => heard[k].type === 'state')"))
    assert 30 < np.median(gaps) < 150


def test_a_pause_holds_the_states_and_the_end_can_be_played_again(tab):
    until(lambda: heard(tab, "state") > 3)
    tab.evaluate("source.pause()")
    before = heard(tab, "state")
    tab.wait_for_timeout(300)
    assert heard(tab, "state") == before
    tab.evaluate("source.run()")
    until(lambda: tab.evaluate("heard.some((m) => m.ended)"))
    until(lambda: tab.evaluate("source.run(), heard.filter((m) => m.ended).length") > 1)


def test_without_play_the_first_state_is_shown(chromium, whole):
    with tab_of(chromium, whole[0], "source.pause();") as tab:
        until(lambda: heard(tab, "state"))
        tab.wait_for_timeout(300)
        assert heard(tab, "state") == 1


def test_the_page_of_the_studio_shows_the_run(chromium, whole):
    """In a browser that obeys the page's policy: balls, results and the end of the run, and no complaint."""
    with Server(Follower(whole[0]), page.text) as server:
        context, complaints = chromium.new_context(reduced_motion="no-preference"), []
        tab = context.new_page()
        tab.on("console", lambda message: complaints.append(message.text))
        tab.on("pageerror", lambda fault: complaints.append(str(fault)))
        tab.goto(server.address)
        assert until(lambda: tab.evaluate("window.millStudio?.ready"))
        until(
            lambda: tab.evaluate(
                "millStudio.stage.draws > 0 && millStudio.stage.shown.time >= 0.1 && !millStudio.playing"
            )
        )
        with Run(whole[0]) as run:
            assert np.array_equal(
                tab.evaluate("[...millStudio.stage.shown.positions]"), run.frame(-1, "position").ravel()
            )
            assert tab.evaluate("millStudio.record.statistics.drive.power") == float(run.statistic("drive/power"))
            assert tab.evaluate("millStudio.deck") == run.deck_text()
        fields = tab.locator(".control .field")
        shown = [(one.locator("input").input_value(), one.inner_text().strip()) for one in fields.all()]
        assert shown == [("600", "rpm"), ("20", ""), ("5", "mm"), ("0.8", ""), ("0.3", "")]
        assert tab.evaluate("document.getElementById('left').textContent") == "100 %, complete at 0.1 s"
        assert tab.evaluate("document.getElementById('notice').hidden")
        assert tab.evaluate("[...document.querySelectorAll('.engine')].every((one) => one.offsetParent === null)")
        assert not complaints
        context.close()


def test_the_page_says_when_the_command_has_gone(tab):
    until(lambda: heard(tab, "mill"))
    tab.server.shutdown()
    tab.server.server_close()
    until(lambda: tab.evaluate("heard.at(-1).note ?? ''").startswith("no news: mill watch has ended"))
