"""`result.show()` in a browser: the frame of a notebook draws the balls, and asks nothing of a network."""

import players
import pytest

import milltools
from milltools.api.plots import EmbeddedPage
from milltools.player import player

pytestmark = pytest.mark.browser
pytest_plugins = ["browser"]


def test_the_frame_of_a_notebook_draws_the_balls(open_page, tmp_path):
    with milltools.load(players.simulate(tmp_path, players.MIXED)) as result:
        markup = EmbeddedPage(result.name, player.page(result.file, result.name), 600)._repr_html_()
    (tmp_path / "notebook.html").write_text(f"<!doctype html><meta charset=utf-8><body>{markup}</body>")
    shown = open_page(tmp_path / "notebook.html", 800, 700)
    frame = next(one for one in shown.page.frames if one.parent_frame)
    assert frame.evaluate("millPlayers[0].ready") is True
    assert frame.evaluate("millPlayers[0].positions().length") == 200 * 3
    picture = shown.picture("iframe")
    assert len({tuple(p) for p in picture.reshape(-1, 3)[::50]}) > 20  # not one colour
    shown.check()
