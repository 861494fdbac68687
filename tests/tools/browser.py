"""Pages in a real browser, as they open from disk: `pytest_plugins = ["browser"]` at the top of a test module.

    def test_it_opens(open_page):
        page = open_page(file)
        assert page.evaluate("document.title") == "mill"
        page.check()  # no error in its console, nothing asked of a network

The browser is the system's chromium, without a window and with WebGL in software; without one the tests are skipped.
It lives as long as a module's tests, not a session's: as long as playwright lives, no other test may run an event
loop of its own.
"""

import io
import pathlib
import shutil
import time

import matplotlib.image
import numpy as np
import pytest

FLAGS = (
    "--no-sandbox",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-gpu-compositing",  # a quarter of the processor time in software
    "--disable-background-networking",
)
PATIENCE = 180_000  # [ms] software WebGL on a busy machine


class Page:
    """A page of playwright (`.page`), with what went wrong in it (`.errors`) and what it asked for (`.requests`)."""

    def __init__(self, context, file, scripts=True):
        self.scripts = scripts
        self.page = context.new_page()
        self.page.set_default_timeout(PATIENCE)
        self.address = file if str(file).startswith("http:") else pathlib.Path(file).resolve().as_uri()
        self.errors, self.requests = [], []
        self.page.on("console", self._console)
        self.page.on("pageerror", lambda fault: self.errors.append(f"page: {fault}"))
        self.page.on("request", self._request)
        self.page.goto(self.address)

    def _console(self, message):
        stall = "GPU stall due to ReadPixels" in message.text  # of a compositor in software, nothing of the page
        if message.type in ("error", "warning", "assert") and not stall:
            self.errors.append(f"{message.type}: {message.text}")

    def _request(self, request):
        if not request.url.startswith(self.address) and not request.url.startswith(("data:", "blob:")):
            self.requests.append(request.url)

    def check(self):
        """Nothing went wrong, and nothing was asked for but the page itself."""
        assert (self.errors, self.requests) == ([], [])

    def evaluate(self, script, argument=None):
        """The value of a piece of JavaScript; a promise's when it is kept."""
        return self.page.evaluate(script, argument)

    def until(self, script):
        """Waits until a piece of JavaScript is true (playwright's own way is against a strict page's policy)."""
        end = time.monotonic() + PATIENCE / 1000
        while not self.page.evaluate(script):
            assert time.monotonic() < end, f"never came true: {script}"
            self.page.wait_for_timeout(20)

    def swipe(self, x, y, right, down):
        """A finger put down at (x, y) [px], moved by (right, down) in eight steps and lifted; on a page with
        touch=True."""
        chromium = self.page.context.new_cdp_session(self.page)
        for k in range(9):
            finger = {"x": x + right * k / 8, "y": y + down * k / 8}
            event = {"type": "touchMove" if k else "touchStart", "touchPoints": [finger]}
            chromium.send("Input.dispatchTouchEvent", event)
            self.page.wait_for_timeout(20)
        chromium.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})

    def picture(self, selector=None) -> np.ndarray:
        """What is seen, of the window or of one element: (h, w, 3) uint8, top row first."""
        seen = self.page.locator(selector).first if selector else self.page
        if self.scripts:  # what was asked for is drawn at the browser's next picture
            self.page.evaluate("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
        picture = matplotlib.image.imread(io.BytesIO(seen.screenshot(timeout=PATIENCE)))
        return np.rint(picture[..., :3] * 255).astype(np.uint8)


@pytest.fixture(scope="module")
def chromium():
    """The browser; skipped where there is none."""
    program = shutil.which("chromium")
    if program is None:
        pytest.skip("no chromium (tools/setup browser)")
    api = pytest.importorskip("playwright.sync_api", reason="no playwright (tools/setup test)")
    with api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=program, args=list(FLAGS))
        yield browser
        browser.close()


def _opener(chromium):
    contexts = []

    def open_it(file, width=640, height=480, dark=False, motion=False, before="", scripts=True, touch=False):
        context = chromium.new_context(
            viewport={"width": width, "height": height},
            color_scheme="dark" if dark else "light",
            reduced_motion="no-preference" if motion else "reduce",
            java_script_enabled=scripts,
            has_touch=touch,
            is_mobile=touch,
        )
        contexts.append(context)
        if before:
            context.add_init_script(before)
        return Page(context, file, scripts)

    yield open_it
    for context in contexts:
        context.close()


@pytest.fixture
def open_page(chromium):
    """open_page(file, width=640, height=480, dark=False, motion=False, before="", scripts=True, touch=False) opens an
    HTML file from disk, or the address of a server, in a window of that size [px]: dark or light, `motion` False as for
    people who prefer none, `before`: JavaScript that is run before the page's own, scripts=False: JavaScript is off,
    touch=True: a phone. Returns a Page; it is closed after the test."""
    yield from _opener(chromium)


@pytest.fixture(scope="module")
def keep_page(chromium):
    """As open_page, for a page that all tests of a module share."""
    yield from _opener(chromium)
