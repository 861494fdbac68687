"""Measures the studio in headless Chromium: `make bench-studio`, after docs/performance.md.

Contacts per second of the engine in the page and of the program, in turn; pictures per second of the reference mill at
a fiftieth of real time; how fast fifty balls in a planetary jar are simulated; size of the page and time to its first
picture. The page has no graphics card here: the processor draws.
"""

import argparse
import json
import pathlib
import shutil
import statistics
import subprocess
import sys
import tempfile
import time

from playwright.sync_api import sync_playwright

ROOT = pathlib.Path(__file__).resolve().parents[2]
PAGE = ROOT / "tools/milltools/studio/studio.html"
DECK = ROOT / "input/simoloyer.ini"
JAR = ["balls.count=50", "balls.diameter=8 mm"]  # of planetary.ini
FIRST = """window.firstPicture = null;
const look = () => {
  if (window.millStudio?.stage?.draws > 0) firstPicture = performance.now();
  else setTimeout(look, 5);
};
look();"""
# the page's engine in a worker as the page's, with nothing drawn
TASK = """
tasks.bench = ({deck, set, time}) => {
  engine.load(deck, set);
  const begin = performance.now();
  engine.run(time, 1e15);
  const took = (performance.now() - begin) / 1000;
  tell({type: 'bench', rate: engine.state().contacts / took, factor: time / took});
};"""
ENGINE = """async ([task, deck, set, time]) => {
  const data = (name) => document.getElementById(name).textContent;
  const packed = Uint8Array.from(atob(data('engine').trim()), (c) => c.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream('gzip'));
  const bytes = await new Response(stream).arrayBuffer();
  const worker = new Worker(URL.createObjectURL(new Blob([data('worker') + task], {type: 'text/javascript'})));
  const told = new Promise((done) => { worker.onmessage = ({data}) => { if (data.type !== 'ready') done(data); }; });
  worker.postMessage({task: 'start', bytes});
  worker.postMessage({task: 'bench', deck, set, time});
  return told.finally(() => worker.terminate());
}"""
PACE = "[millStudio.stage.draws, performance.now(), millStudio.stage.shown.time]"


def native(program, folder) -> float:
    """Contacts per second of processor time, of the program."""
    words = [program, "-q", "-j", "-f", "-o", folder / "native.h5", DECK]
    run = json.loads(subprocess.run(words, capture_output=True, text=True, check=True).stdout)["run"]
    return run["contacts_per_cpu_second"]


def opened(browser):
    page = browser.new_context(viewport={"width": 1280, "height": 800}, reduced_motion="no-preference").new_page()
    page.add_init_script(FIRST)
    page.goto(PAGE.as_uri())
    while page.evaluate("firstPicture") is None:
        time.sleep(0.05)
    return page


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", type=pathlib.Path, default=ROOT / "millsim")
    parser.add_argument("--repeats", type=int, default=5)
    asked = parser.parse_args()
    ratios, factors, first = [], [], []
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox"])
        for _ in range(asked.repeats):
            page = opened(browser)
            first.append(page.evaluate("firstPicture"))
            page.evaluate("millStudio.source.pause()")
            here = page.evaluate(ENGINE, [TASK, DECK.read_text(), [], 0.3])["rate"]
            ratios.append(here / native(asked.program, pathlib.Path(folder)))
            planetary = (ROOT / "input/planetary.ini").read_text()
            factors.append(page.evaluate(ENGINE, [TASK, planetary, JAR, 2])["factor"])
            page.context.close()
        page = opened(browser)
        page.locator("#speed").select_option(label="1/50 of real time")
        time.sleep(5)
        before = page.evaluate(PACE)
        time.sleep(10)
        after = page.evaluate(PACE)
        browser.close()
    seconds = (after[1] - before[1]) / 1000

    def of(values):
        return f"{statistics.median(values):.3g} ({min(values):.3g} .. {max(values):.3g})"

    print(f"size of the page [MB]                       {PAGE.stat().st_size / 1e6:.2f}")
    print(f"first picture after [s]                     {of([ms / 1000 for ms in first])}")
    print(f"contacts per second, of the program's       {of(ratios)}")
    print(f"planetary jar of 50 balls, of real time     {of(factors)}")
    print(f"reference mill at 1/50: pictures a second   {(after[0] - before[0]) / seconds:.1f}")
    print(f"                        reached, of 1/50    {50 * (after[2] - before[2]) / seconds:.2f}")


if __name__ == "__main__":
    sys.exit(main())
