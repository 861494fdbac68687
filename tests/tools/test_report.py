"""mill report: one page that holds the run's numbers and needs nothing but itself, whatever the run holds."""

import base64
import csv
import dataclasses
import html
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import h5py
import numpy as np
import pytest
from conftest import ROOT, SMALL, run_mill, some
from report_page import Reader, report

from milltools import __main__
from milltools.base.errors import UserError
from milltools.base.processes import cores
from milltools.base.text import size
from milltools.compare.agreement import Estimate
from milltools.compare.rows import ZERO, Row
from milltools.read.runfile import Run
from milltools.report import facts, pdf

pytest_plugins = ["browser", "reported"]

SECTIONS = [
    "verdict", "energy", "spectra", "wear", "summary", "maps", "time", "anomalies", "notes", "how", "deck", "cite",
]  # fmt: skip
EVIL = "<script>alert(1)</script>"
IMAGE = '"><img src=x onerror=alert(2)>'


@pytest.fixture
def changed(folder, tmp_path):
    """changed(change, name, source) copies a run, lets `change` work on the open file, and returns (page's text,
    Reader) of its report."""

    def make(change, name="copy.h5", source="nothing.h5"):
        shutil.copy(folder / source, tmp_path / name)
        with h5py.File(tmp_path / name, "r+") as file:
            change(file)
        done = report(tmp_path, name, "-o", "page.html")
        assert done.returncode == 0, done.stderr
        text = (tmp_path / "page.html").read_text("utf-8")
        return text, Reader(text)

    return make


# ---- what is on the page


def test_it_has_every_section_in_the_order_a_reader_wants(page):
    assert page[2].ids("section") == SECTIONS


def test_it_is_small_enough_to_be_mailed(page):
    assert page[0].stat().st_size < 10e6


def test_every_number_of_the_contact_table_is_the_files(page, folder):
    with h5py.File(folder / "small.h5") as file:
        statistics = file["statistics"]
        total = statistics["impacts/all/dissipated_power"][()]
        for kind, head in {"ball_ball": "ball-ball", "ball_drum": "ball-drum", "all": "all"}.items():  # fmt: skip
            row, normal = statistics[f"impacts/{kind}"], statistics[f"impacts/{kind}/normal_speed"]
            power = row["dissipated_power"][()]
            assert page[2].rows[head] == [
                row["count"][()],
                row["rate"][()],
                normal["median"][()],
                normal["median_above_floor"][()],
                normal["mean"][()],
                statistics[f"floor_share/{kind}"][()],
                power,
                power / total,
            ]


def test_rotor_power_and_its_error_are_the_files_on_one_scale(page, folder):
    with h5py.File(folder / "small.h5") as file:
        power, error = (file[f"statistics/rotor/power{e}"][()] for e in ("", "_error"))
    assert page[2].rows["rotor power"] == [power]
    found = re.search(r"rotor power ([\d.]+).±.([\d.]+).mW", page[2].text)
    assert float(found[1]) == pytest.approx(1e3 * power, rel=1e-3)
    assert float(found[2]) == pytest.approx(1e3 * error, abs=2e-1)


def losses(folder):
    """(power of the rotor [W], its error, share of sliding in the lost power, share of impacts of balls and drum along
    the normal) of the small mill."""
    with h5py.File(folder / "small.h5") as file:
        known = file["statistics/precision"]
        power, error = (known[f"rotor_power/{e}"][()] for e in ("value", "standard_error"))
        lost = known["dissipated_power/all/value"][()]
        normal = {kind: known[f"dissipated_power_normal/{kind}/value"][()] for kind in ("all", "ball_drum")}
    return power, error, 1 - normal["all"] / lost, normal["ball_drum"] / lost


def test_the_title_is_the_finding_in_the_files_numbers(page, folder):
    power, error, sliding, drum = losses(folder)
    title = re.search("<title>(.*?)</title>", page[1], re.S)[1].replace("\xa0", " ")
    found = re.fullmatch(
        r"(\d+) % of (\d+) ± (\d+) mW is lost by sliding, (\d+) % goes into ball-drum hits, (\d+) % is the rest", title
    )
    numbers = [100 * sliding, 1e3 * power, 1e3 * error, 100 * drum, 100 * (1 - sliding - drum)]
    shown = [float(text) for text in found.groups()]
    assert shown[:4] == pytest.approx(numbers[:4], abs=0.5) and shown[4] == pytest.approx(numbers[4], abs=1)
    assert shown[0] + shown[3] + shown[4] == 100
    assert page[2].text.startswith(title)
    assert re.search("<h1>(.*?)</h1>", page[1])[1].replace("\xa0", " ") == title


def test_the_card_has_three_numbers_with_the_files_errors(page, folder):
    power, error, sliding, _ = losses(folder)
    with h5py.File(folder / "small.h5") as file:
        hard = file["statistics/precision/hard_rate"]
        rate, of_rate = hard["value"][()], hard["standard_error"][()]
    tiles = re.findall(r"<dd><data value=\"([^\"]+)\">(.*?)</data>", page[1])
    assert [float(value) for value, _ in tiles] == pytest.approx([power, rate, sliding], rel=1e-12)
    shown = [[float(word) for word in re.findall(r"[\d.]+", text)] for _, text in tiles]
    assert shown[0] == pytest.approx([1e3 * power, 1e3 * error], abs=0.5)
    assert shown[1] == pytest.approx([rate, of_rate], abs=0.5)
    assert shown[2][0] == pytest.approx(100 * sliding, abs=0.05) and 0 < shown[2][1] < 10


def test_one_line_says_how_far_the_numbers_can_be_trusted(page, folder):
    power, error, *_ = losses(folder)
    found = re.search(r"Checks: energy balance (\S+) .*no anomalies, 400 ms sampled \(4 revolutions\), "
                      r"power known to ([\d.]+).%", page[2].text)  # fmt: skip
    assert float(found[2]) == pytest.approx(100 * error / power, rel=0.05)


def test_the_share_of_sliding_has_the_error_of_its_blocks_of_time(folder):
    with Run(folder / "small.h5") as run:
        share, error = facts.rubbed(run)
        time = run.series("dissipation/ball_ball")[0]
        count = int(run.duration / float(run.read("statistics/energies/blocks/duration")) + 1e-9)
        edges = np.linspace(run.window[0], run.window[1], count + 1)
        every, normal = (
            sum(np.diff(np.interp(edges, time, run.series(f"{part}/{kind}")[1])) for kind in run.kinds)
            for part in ("dissipation", "dissipation_normal")
        )
    halves = [1 - normal[k::2].sum() / every[k::2].sum() for k in (0, 1)]
    assert share == pytest.approx(1 - normal.sum() / every.sum(), rel=1e-6)
    assert abs(halves[0] - halves[1]) / 2 < 3 * error < 0.3 * share


def test_a_column_of_a_table_has_one_unit(page):
    heads = re.findall(r"<th scope=\"col\" class=\"number\">(.*?)</th>", page[1])
    rows = re.findall(r"<tr[^>]*><th scope=\"row\">[^<]*</th>((?:<td class=\"number\"><data.*?</td>){8})", page[1])
    cells = [re.findall(r">([^<>]+)</data>", row) for row in rows]
    assert heads and len(cells) >= 3
    for k in (1, 2, 3, 4, 6):
        assert len({row[k].split("\xa0")[-1] for row in cells}) == 1


def test_what_is_folded_says_how_much_it_is(page):
    assert re.findall(r"<summary>(\d+ more \w+)</summary>", page[1])[:1] == ["8 more figures"]
    assert "0 more" not in page[2].text


def test_lengths_are_in_millimetres(page):
    assert "[mm]" in page[2].text and "[m]" not in page[2].text


def test_the_wear_of_the_parts_is_a_table(page, folder):
    done = run_mill(folder, "wear", "small.h5", "--json")
    first = json.loads(done.stdout)["parts"][0]
    section = page[1][page[1].index('id="wear"') : page[1].index('id="summary"')]
    numbers = f"<td[^>]*>{first['normal']:.3g}\\d*</td><td[^>]*>{first['sliding']:.3g}\\d*</td>"
    assert re.search(rf"<td[^>]*>{first['part']}</td>{numbers}", section), section[:1500]


@pytest.mark.slow
def test_the_power_on_pressed_balls_stands_below_the_rotors(page, folder, tmp_path, undrawn):
    shutil.copy(folder / "small.h5", tmp_path / "copy.h5")
    with h5py.File(tmp_path / "copy.h5", "r+") as file:
        file["statistics/rotor/pinch_power"][()] = 1.25
    assert "pinches" not in page[2].rows
    assert undrawn(tmp_path / "copy.h5")[1].rows["pinches"] == [1.25]


def test_the_page_says_what_was_run_in_numbers(page):
    words = page[2].text
    assert "20 balls of 5 mm and 7800 kg/m³ in a round drum, 60 mm in diameter and 40 mm long inside" in words
    assert "with a rotor of 2 blades at 600 rpm" in words
    assert "simulated for 400.0 ms and sampled for 400.0 ms, from 0 s to 400.0 ms" in words
    assert "no anomalies" in words


def test_the_deck_stands_there_and_can_be_saved(page, folder):
    with h5py.File(folder / "small.h5") as file:
        deck = file["deck/text"].asstr()[()]
    assert html.escape(deck, quote=True).replace("&#x27;", "&#39;") in page[1]
    link = next(a for t, a in page[2].tags if t == "a" and "download" in a)
    import base64

    assert base64.b64decode(link["href"].split("base64,")[1]).decode() == deck
    assert link["download"] == "small.ini"


def test_spectra_maps_account_and_time_are_drawings_in_the_page(page):
    text, names = page[1], page[2].ids("figure")
    for name in ("speeds", "slip", "energies", "flow", "axial-rate", "section-power", "power"):
        assert f"figure-{name}" in names
    assert text.count("<svg") >= 20


def test_ids_are_given_once(page):
    ids = [a["id"] for _, a in page[2].tags if "id" in a]
    assert sorted(set(ids)) == sorted(ids)


def test_links_within_the_page_lead_somewhere(page):
    ids = {a["id"] for _, a in page[2].tags if "id" in a}
    for tag, attributes in page[2].tags:
        address = attributes.get("href", attributes.get("xlink:href", ""))
        assert not address.startswith("#") or address[1:] in ids, (tag, address)


def test_it_loads_nothing(page):
    for tag, attributes in page[2].tags:
        for name in ("src", "href", "xlink:href", "srcset", "action", "data"):
            assert re.match(r"#|data:|$", attributes.get(name) or ""), (tag, attributes)
    assert not re.search(r"url\(\s*['\"]?(?!#|data:)", page[1].split("</head>")[0])
    assert "@import" not in page[1].split("</head>")[0]
    policy = next(a["content"] for t, a in page[2].tags if a.get("http-equiv"))
    assert policy.startswith("default-src 'none'; script-src 'sha256-")


@pytest.mark.slow
def test_it_is_the_same_every_time(folder, nothing):
    assert report(folder, "nothing.h5", "-o", "again.html").returncode == 0
    assert (folder / "again.html").read_text("utf-8") == nothing[0]


def test_it_knows_its_landmarks_headings_and_pictures(page):
    tags = [t for t, _ in page[2].tags]
    assert [tags.count(t) for t in ("main", "h1", "header", "nav")] == [1, 1, 1, 1]
    levels = [int(t[1]) for t in tags if re.fullmatch("h[1-6]", t)]
    assert all(b - a <= 1 for a, b in zip(levels, levels[1:], strict=False))
    assert all(a.get("alt") for t, a in page[2].tags if t == "img")
    assert all(a.get("aria-label") for t, a in page[2].tags if t == "svg")
    assert next(a for t, a in page[2].tags if t == "html")["lang"] == "en"


# ---- nothing from a run is more than text


@pytest.mark.slow
def test_whatever_a_run_says_stays_text(changed):
    def spoil(file):
        for name in ("command", "version", "compiler", "status"):
            del file[f"run/{name}"]
        file["run/command"] = f"millsim '{EVIL}.ini' -s {IMAGE}"
        file["run/version"], file["run/compiler"] = EVIL, IMAGE
        file["run/status"] = EVIL
        file["run/notes"][()] = f"{EVIL}\n\x1b[31m{IMAGE}"
        text = file["deck/text"].asstr()[()]
        del file["deck/text"]
        file["deck/text"] = text + f"# {EVIL}</pre>{IMAGE}\n"
        section = file["deck"].create_group(f"balls.{IMAGE}")
        for key in file["deck/balls"]:
            section[key] = file[f"deck/balls/{key}"][()]
        file["particles/trajectory/species"].attrs["names"] = [f"{EVIL}{IMAGE}"]
        file["run"][IMAGE] = 1.0

    text, reader = changed(spoil, "x<b>&amp;.h5", "frames.h5")
    assert EVIL not in text and IMAGE not in text and "onerror=alert(2)>" not in text
    assert "\x1b" not in text
    assert reader.text.count(EVIL) >= 4 and IMAGE in reader.text
    assert not [a for t, a in reader.tags if t == "img" and a.get("src") == "x"]
    scripts = [a for t, a in reader.tags if t == "script"]
    assert len(scripts) == 6  # three of the player, its two pieces of data, the switch of colours
    assert "x<b>&amp;.h5" in reader.text


@pytest.mark.slow
def test_only_scripts_of_the_page_itself_may_run(changed, nothing):
    """What stands in a deck is in no hash of the policy."""

    def spoil(file):
        del file["deck/text"]
        file["deck/text"] = "<script>document.title = 'taken'</script>"

    policies = [
        next(a["content"] for t, a in reader.tags if a.get("http-equiv")) for reader in (changed(spoil)[1], nothing[1])
    ]
    assert policies[0] == policies[1]


# ---- runs that hold less, or more


def test_without_samples_it_says_so_and_shows_the_rest(nothing):
    words = nothing[1].text
    assert nothing[1].ids("section") == SECTIONS
    assert words.startswith("No results: nothing sampled: the run ended")
    assert "Nothing was sampled: the run ended before run.sample_from = 0.19 s." in words
    assert "Not drawn: nothing sampled" in words
    assert "kinetic energy" in nothing[1].rows


def test_without_frames_it_says_why_there_are_no_balls(nothing):
    assert "No ball states are stored in this run: output.frames is 0 s." in nothing[1].text
    assert "canvas" not in [t for t, _ in nothing[1].tags]
    assert [a["alt"] for t, a in nothing[1].tags if t == "img"] == ["The mill, balls coloured by their speed"]


@pytest.mark.slow
def test_a_run_at_work_is_told_of_as_far_as_it_is(start_millsim, write_deck, tmp_path):
    write_deck()
    process = start_millsim("deck.ini", "-q", "-s", "run.time=1000 s", "-o", "young.h5")
    end = time.monotonic() + 30
    while not (tmp_path / "young.h5").exists():
        assert time.monotonic() < end
        time.sleep(0.01)
    process.send_signal(signal.SIGKILL)
    process.wait()
    done = report(tmp_path, "young.h5")
    assert done.returncode == 0, done.stderr
    reader = Reader((tmp_path / "young.html").read_text("utf-8"))
    assert "has not reached its first checkpoint" in reader.text
    assert "[drum]" in reader.text


@pytest.mark.slow
def test_a_mill_without_a_rotor_has_no_rotor_power(millsim, write_deck, tmp_path, undrawn):
    gas = re.sub(r"\[rotor\].*?(?=\[contact\])", "", SMALL, flags=re.S)
    write_deck(gas)
    sets = ["balls.speed=1 m/s", "contact.restitution=1", "contact.friction=0"]
    sets += ["run.sample_from=0.04 s", "output.series=1 s"]
    done = millsim("deck.ini", "-q", *(word for s in sets for word in ("-s", s)))
    assert done.returncode == 0, done.stderr
    reader = undrawn(tmp_path / "deck.h5")[1]
    assert "in which nothing moves" in reader.text and "rotor power" not in reader.rows
    assert re.match(r"[\d.]+ (thousand )?impacts each second lose no energy", reader.text)


@pytest.mark.parametrize(
    "change, title",
    [
        (lambda file: None, "N % of N ± N mW is lost by sliding, N % goes into ball-drum hits, N % is the rest"),
        (lambda file: file.__delitem__("statistics/precision"),
         "N % of N mW is lost in ball-drum impacts, N % is lost in ball-blade impacts, N % is the rest"),
        (lambda file: file["statistics/precision/dissipated_power/all/standard_error"].__setitem__((), np.nan),
         "N % of N mW is lost by sliding, N % goes into ball-drum hits, N % is the rest"),
        (lambda file: file["run/status"].__setitem__((), "running"),
         "So far: N % of N ± N mW is lost by sliding, N % goes into ball-drum hits, N % is the rest"),
        (lambda file: file["statistics/impacts/all/count"].__setitem__((), 0), "The balls hit nothing in N ms"),
        (lambda file: file["statistics/impacts/all/dissipated_power"].__setitem__((), 0.0),
         "N thousand impacts each second lose no energy"),
    ],
)  # fmt: skip
def test_the_finding_claims_no_more_than_the_file_has(folder, tmp_path, change, title):
    shutil.copy(folder / "small.h5", tmp_path / "a.h5")
    with h5py.File(tmp_path / "a.h5", "r+") as file:
        change(file)
    with Run(tmp_path / "a.h5") as run:
        assert re.sub(r"[\d.]+", "N", facts.finding(run).replace("\xa0", " ")) == title
        assert all("nan" not in f"{number}{words}" for _, number, words in facts.tiles(run))


def test_a_powder_gets_its_dose_on_the_card_and_a_table(millsim, write_deck, tmp_path, undrawn):
    write_deck(SMALL + "[powder]\nmass = 2 g\ndensity = 4000 kg/m^3\n")
    assert millsim("deck.ini", "-q", "-s", "run.time=0.4 s", "-s", "output.frames=0 s").returncode == 0
    text, _ = undrawn(tmp_path / "deck.h5")
    with h5py.File(tmp_path / "deck.h5") as file:
        power = file["statistics/impacts/all/dissipated_power"][()]
    tile = re.search(r"<dt>dose of the powder</dt><dd><data value=\"([^\"]+)\">", text)
    assert float(tile[1]) == pytest.approx(power / 2, rel=1e-12)  # W/g
    assert "dose rate" in Reader(text[text.index('<section id="dose">') : text.index('<details class="fold"')]).text


def test_contact_laws_that_are_assumed_are_named_with_the_mill(millsim, write_deck, tmp_path):
    deck = SMALL.replace("density = 7800 kg/m^3", "material = steel").replace(
        "length = 40 mm", "length = 40 mm\nmaterial = glass"
    )
    write_deck(deck.replace("restitution = 0.8\nfriction = 0.3\n", ""))
    assert millsim("-q", "-o", "run.h5", "deck.ini").returncode == 0
    laws = "Contact laws are assumed: steel on steel (e computed by Thornton 1997; others estimated) and steel"
    with Run(tmp_path / "run.h5") as run:
        assert laws in facts.subject(run)


@pytest.mark.slow
def test_anomalies_are_named_counted_and_explained(changed):
    def pinch(file):
        file["run/reliefs"][()] = 7
        file["run/overlaps"][()] = 2
        file["run/largest_overlap"][()] = 3e-8

    _, reader = changed(pinch)
    assert reader.rows["pinched balls released"] == [7] and reader.rows["overlaps"] == [2]
    assert "The deepest: 30.00 nm" in reader.text


@pytest.mark.slow
def test_another_programs_run_says_what_it_is(changed):
    def soft(file):
        file["run/program"] = "LIGGGHTS"
        file["run/notes"][()] = "Soft spheres."
        for name in ("not_closing", "reliefs", "smoothed", "overlaps"):
            del file[f"run/{name}"]

    _, reader = changed(soft)
    assert "LIGGGHTS does not count them." in reader.text and "Soft spheres." in reader.text
    assert "which made this run" in reader.text


# ---- the command


def test_the_default_name_is_the_runs(page):
    assert page[0].name == "small.html"


@pytest.mark.parametrize(
    "words, status, line",
    [
        (["missing.h5"], 2, "missing.h5: no such file"),
        (["small.ini"], 2, "small.ini: not a readable HDF5 file: if it is a deck, './millsim DECK' runs it"),
        (["small.h5", "nothing.h5"], 2, "a report shows one run; --compare puts several on one page"),
        (["--compare", "small.h5"], 2, "one run cannot be compared; give two or more"),
        (["small.h5", "-o", "nowhere/x.html"], 2, "nowhere/x.html: there is no folder nowhere"),
        (["small.h5", "-o", "small.h5"], 2, "small.h5: is the input file small.h5 itself; give another name"),
        (["small.h5", "-o", "."], 2, ".: is a folder"),
        (["small.h5", "--pdf", "-o", "a.html"], 2, "a.html: the name of a PDF ends with .pdf"),
    ],
)  # fmt: skip
def test_wrong_usage_is_one_line_and_nothing_is_written(folder, words, status, line):
    before = sorted(p.name for p in folder.iterdir())
    done = report(folder, *words)
    assert (done.returncode, done.stdout) == (status, "")
    assert done.stderr.startswith(f"mill report: {line}") and done.stderr.count("\n") == 1
    assert sorted(p.name for p in folder.iterdir()) == before


@pytest.mark.slow
@pytest.mark.unmeasured
def test_a_full_disk_is_one_line_and_leaves_the_old_page(folder, tmp_path):
    shutil.copy(folder / "nothing.h5", tmp_path / "a.h5")
    (tmp_path / "a.html").write_text("old")
    done = report(tmp_path, "a.h5", room=1000)
    assert (done.returncode, done.stderr) == (1, "mill report: a.html: File too large\n")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.h5", "a.html"]
    assert (tmp_path / "a.html").read_text() == "old"


# ---- PDF


@pytest.mark.slow
@pytest.mark.browser
@pytest.mark.parametrize("words", some([(["--pdf"],), (["-o", "small.pdf"],)], 2))
def test_a_pdf_is_a_document_of_a4_pages(folder, chromium, words):
    done = report(folder, "small.h5", *words)
    assert done.returncode == 0, done.stderr
    data = (folder / "small.pdf").read_bytes()
    (folder / "small.pdf").unlink()
    boxes = re.findall(rb"/Type /Page\n.*?/MediaBox \[0 0 ([\d.]+) ([\d.]+)\]", data, re.S)
    assert data.startswith(b"%PDF-") and 5 < len(boxes) < 30
    assert np.allclose(np.array(boxes, float), (210 / 25.4 * 72, 297 / 25.4 * 72), atol=1)


@pytest.mark.slow
@pytest.mark.thorough
@pytest.mark.browser
def test_several_runs_make_a_pdf_too(folder, chromium):
    assert report(folder, "--compare", "quick1.h5", "slow1.h5", "-o", "two.pdf").returncode == 0
    assert (folder / "two.pdf").read_bytes().startswith(b"%PDF-")


def test_without_a_browser_one_line_says_what_to_install(folder, monkeypatch):
    monkeypatch.setattr(pdf, "BROWSERS", ("no-such-browser",))
    with pytest.raises(UserError, match="^a PDF needs Chromium or Chrome; on Debian: sudo apt-get install chromium$"):
        pdf.browser()


def test_a_browser_that_prints_nothing_is_one_line_and_leaves_the_old_file(tmp_path, monkeypatch):
    (tmp_path / "old.pdf").write_text("old")
    monkeypatch.setattr(pdf, "BROWSERS", ("true",))
    with pytest.raises(UserError, match="true did not print the page: no reason given"):
        pdf.write(tmp_path / "old.pdf", "<p>page</p>")
    assert [(p.name, p.read_text()) for p in tmp_path.iterdir()] == [("old.pdf", "old")]


# ---- several runs


ROW = Row("", "", "", "", Estimate(0.0), Estimate(0.0))


def test_a_comparison_has_the_rows_of_its_table(compared):
    page, _, read, _ = compared
    with open(page.parent / "table.csv") as file:
        for row in csv.DictReader(file):
            shown = dataclasses.replace(ROW, key=row["quantity"], label=row["label"]).name
            assert row["label"] in read.text or shown in read.text
            said = "Zero within their errors" if row["verdict"] == ZERO else row["verdict"]
            assert said in read.text


@pytest.mark.slow
def test_a_report_of_several_runs_is_the_comparison_named_after_the_first(folder, undrawn, monkeypatch, capsys):
    monkeypatch.chdir(folder)
    assert __main__.dispatch(["report", "--compare", "quick1.h5", "slow1.h5", "--rerun", "never"]) == 0
    said = capsys.readouterr().out
    text = Path("quick1-compared.html").read_text("utf-8")
    assert said == f"quick1-compared.html: {size(len(text.encode()))}\n"
    assert Reader(text).text.startswith("slow1 ")


@pytest.mark.slow
@pytest.mark.browser
def test_a_comparison_opens_without_errors_or_requests(compared, open_page):
    opened = open_page(compared[0], width=1000, height=800)
    for k in (0, 1):  # they begin when they are seen
        opened.evaluate(f"document.querySelectorAll('.mill-player')[{k}].scrollIntoView()")
        opened.until(f"document.querySelectorAll('.mill-player')[{k}].classList.contains('mp-live')")
    opened.check()


@pytest.mark.slow
@pytest.mark.browser
def test_players_side_by_side_have_one_clock_one_camera_and_one_scale(compared, open_page):
    opened = open_page(compared[0], width=1000, height=800)
    opened.evaluate("document.querySelector('.mill-player').scrollIntoView()")
    assert opened.evaluate("Promise.all(millPlayers.map((p) => p.ready))") == [True, True]
    limits = opened.evaluate("millPlayers.map((p) => p.head.values.map((v) => v.limit))")
    assert limits[0] == limits[1]
    opened.evaluate("millPlayers[0].show(150)")
    one, two = opened.evaluate("millPlayers.map((p) => p.head.turns[p.frame] % 1)")
    frames = opened.evaluate("millPlayers.map((p) => p.frame)")
    assert frames[0] != frames[1] and abs(one - two) < 0.02  # a frame is 1/120 of a turn
    for script in ("millPlayers[1].view.turn(0.4, 0.2); millPlayers[1].view.controls.update()",
                   "document.querySelector('.mp-shared [data-view=end]').click()"):  # fmt: skip
        before = opened.evaluate("millPlayers[0].view.stand()")
        opened.evaluate(script)
        first, second = opened.evaluate("millPlayers.map((p) => p.view.stand())")
        assert first == second != before
    opened.evaluate("millPlayers[0].colourBy('spin')")
    assert opened.evaluate("millPlayers.map((p) => p.by.name)") == ["spin", "spin"]
    shown = "[...document.querySelectorAll('.mp-play')].filter((b) => b.checkVisibility()).length"
    assert opened.evaluate(shown) == 1
    opened.check()


@pytest.mark.slow
@pytest.mark.browser
def test_players_side_by_side_show_one_angle_between_their_frames_and_flash_together(compared, open_page):
    opened = open_page(compared[0], width=1000, height=800)
    opened.evaluate("document.querySelector('.mill-player').scrollIntoView()")
    assert opened.evaluate("Promise.all(millPlayers.map((p) => p.ready))") == [True, True]
    angles = "millPlayers.map((p) => { const m = p.pose('rotor'); return Math.atan2(m[9], m[5]); })"
    times = opened.evaluate("millPlayers[0].head.times")
    for moment in (times[150] + 0.1e-3, times[160] + 0.3e-3):
        opened.evaluate("(t) => millPlayers[0].at(t)", moment)
        one, two = opened.evaluate(angles)
        assert one == pytest.approx(two, abs=1e-4)
    flashes = """millPlayers[0].head.times.slice(140, 180)
        .map((t) => { millPlayers[0].at(t); return millPlayers.map((p) => { p.view.draw(); return p.flashes(); }); })"""
    assert np.max(opened.evaluate(flashes), axis=0).min() > 0
    opened.evaluate("document.querySelector('.mp-shared .mp-flashes').click()")
    assert np.max(opened.evaluate(flashes)) == 0
    opened.check()


def test_players_side_by_side_flash_from_one_energy_on(compared):
    text = compared[1]
    least = re.findall(r"hardest impacts, which dissipate (\S+ \S+) and more", text)
    heads = [json.loads(found) for found in re.findall(r'class="mp-head">(.*?)</script>', text)]
    radii = [np.frombuffer(base64.b64decode(head["flashes"]), "<f4").reshape(-1, 5)[:, 4] for head in heads]
    assert len(least) == 2 and least[0] == least[1]
    # alike are the radii of the weakest: one energy, one scale
    assert radii[0].min() == pytest.approx(radii[1].min(), rel=0.02) and len(radii[0]) > len(radii[1]) > 0


@pytest.mark.slow
def test_a_comparison_runs_decks_again_for_its_players_as_a_report_does(folder, compared, undrawn, the_program):
    text, _ = undrawn(folder / "small.h5", folder / "small.h5", rerun="always")
    again = "They come from running the deck again."
    assert text.count(again) == 2 and "mp-flashes" in text
    assert again not in compared[1]  # --rerun never


@pytest.mark.slow
@pytest.mark.browser
def test_a_phone_shows_the_verdicts_without_scrolling_sideways(compared, open_page):
    opened = open_page(compared[0], width=390, height=844)
    edges = opened.evaluate(
        "[...document.querySelectorAll('.differences td.said')].filter((c) => c.checkVisibility())"
        ".map((c) => c.getBoundingClientRect()).map((r) => [r.left, r.right])"
    )
    assert edges and all(0 <= left < right <= 390 for left, right in edges)
    assert opened.evaluate("document.documentElement.scrollWidth") == 390


@pytest.mark.slow
@pytest.mark.skipif(cores() < 2, reason="on one core a report starts no second process")
def test_ctrl_c_leaves_neither_page_nor_process(folder, tmp_path):
    shutil.copy(folder / "small.h5", tmp_path / "stopped.h5")
    environment = {**os.environ, "PYTHONPATH": str(ROOT / "tools"), "MILL_TEST": str(tmp_path)}
    words = [sys.executable, "-m", "milltools", "report", "stopped.h5"]
    process = subprocess.Popen(words, cwd=tmp_path, env=environment, stderr=subprocess.PIPE, text=True)  # fmt: skip

    def alive(word=b""):
        """Processes of the report, with a word in their command: they have its environment."""
        found = []
        for entry in Path("/proc").glob("[0-9]*"):
            try:
                own = f"MILL_TEST={tmp_path}".encode() in (entry / "environ").read_bytes()
                if own and word in (entry / "cmdline").read_bytes():
                    found.append(int(entry.name))
            except OSError:
                continue
        return found

    end = time.monotonic() + 60
    while not alive(b"milltools.render.team"):
        assert process.poll() is None and time.monotonic() < end
        time.sleep(0.02)
    process.send_signal(signal.SIGINT)
    _, said = process.communicate(timeout=30)
    assert (process.returncode, said) == (130, "mill report: interrupted\n")
    assert alive() == []
    assert sorted(p.name for p in tmp_path.iterdir()) == ["stopped.h5"]
