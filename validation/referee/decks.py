"""Every deck of input/ with hard and with soft spheres: writes the table of RESULTS.md.

    python validation/referee/decks.py [--minutes 3] [DECK ...]

It calls `mill check` for each deck, in a folder of its own, and continues where it was interrupted. The rows of other
decks stay.
"""

import argparse
import json
import pathlib
import subprocess
import sys

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[1]
COLUMNS = ("power", "kinetic_energy", "rotational_energy", "impacts_above_0.5", "impacts_above_1", "impacts_above_2")
HEAD = ("deck", "soft spheres", "power", "kinetic energy", "spin", "> 0.5 m/s", "> 1 m/s", "> 2 m/s", "verdict")
MODULUS = {2.1e11: "steel", 1e10: "10 GPa", 1e9: "1 GPa"}
MARK = "<!-- the table of decks.py -->\n"
PAGE = f"""# Hard against soft spheres: every deck of `input/`

    python validation/referee/decks.py

Difference of hard spheres from soft ones, relative to the soft ones, +- one standard error over the starts; what
differs by more than it may (3 % of power and kinetic energy, 10 % of the rest) is in bold type. Impacts are strikes:
re-contacts within the duration of a soft contact are one impact.

{MARK}{MARK}"""


def check(deck, minutes, folder):
    """What `mill check --json` says of a deck."""
    words = [ROOT / "mill", "check", deck, "--minutes", str(minutes), "-o", folder / deck.stem, "--json", "-q"]
    done = subprocess.run(words, capture_output=True, text=True, cwd=folder)
    if done.returncode != 0:
        sys.exit(f"{deck.name}: {done.stderr.strip()}")
    return json.loads(done.stdout)


def cell(one):
    """ "+0.6 +- 1.2 %", in bold type where it differs."""
    if one is None or one["difference"] is None:
        return "-"
    text = f"{100 * one['difference']:+.1f}"
    text += f" +- {100 * one['error']:.1f} %" if one["error"] is not None else " %"
    return f"**{text}**" if one["state"] == "off" else text


def row(name, told):
    how = f"{MODULUS[told['modulus']]}, {told['starts']} x {told['time']:.3g} s"
    return [name, how, *(cell(told["quantities"].get(key)) for key in COLUMNS), told["verdict"]]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("decks", nargs="*", metavar="DECK", help="default: all of input/")
    parser.add_argument("--minutes", type=float, default=3.0)
    parser.add_argument("--folder", type=pathlib.Path, default=pathlib.Path("referee-runs"), help="of the runs")
    arguments = parser.parse_args()
    arguments.folder.mkdir(parents=True, exist_ok=True)
    decks = [pathlib.Path(deck).resolve() for deck in arguments.decks] or sorted((ROOT / "input").glob("*.ini"))
    page = HERE / "RESULTS.md"
    for deck in decks:
        told = check(deck, arguments.minutes, arguments.folder.resolve())
        print(f"{deck.name}: {told['sentence']}", flush=True)
        before, table, after = (page.read_text() if page.exists() else PAGE).split(MARK)
        rows = {line.split(" | ")[0]: line for line in table.splitlines()[2:]}
        line = f"| {' | '.join(row(deck.name, told))} |"
        rows[line.split(" | ")[0]] = line
        head = [f"| {' | '.join(line)} |" for line in (HEAD, ["---"] * len(HEAD))]
        table = "".join(f"{line}\n" for line in [*head, *sorted(rows.values())])
        page.write_text(f"{before}{MARK}{table}{MARK}{after}")


if __name__ == "__main__":
    main()
