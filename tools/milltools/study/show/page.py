"""A study as one page: the finding, linked pictures (study.js), the mills of the best designs turning, pictures with
errors, tables. It opens from disk and loads nothing.

A table has no frames, so the page runs a few designs again, the best ones first, as many as take half a minute.
"""

import math
import pathlib
import shlex

import matplotlib
import numpy as np

from milltools import pages
from milltools.base import engine
from milltools.base.errors import UserError
from milltools.base.progress import Progress, say
from milltools.base.text import duration, plain, plural
from milltools.figures import style
from milltools.player import parts, player
from milltools.read import values
from milltools.read.runfile import Run
from milltools.study.show import contour, optimum, pair, summary, tradeoff
from milltools.study.show.data import base_of, deck_entries, settings

FOLDER = pathlib.Path(__file__).parent
MOST_MILLS = 6
CHEAP = 32.0  # [s] for running designs again
TWICE = 2.2  # the price of frames: the run, the same again with close frames, the pictures
DRAWN = 2.0  # [s] for the player of a run, however short the run is
BYTES = 8_000_000, 3_000_000  # of all mills in the page, and of one


def render(view, objective, figures, beside=None, wanted=None, quiet=True) -> str:
    """`figures` as outputs.figures gives them; all text from the study is escaped."""
    kinds = sorted(figures, key=lambda entry: entry[0] != "beside")  # that one first
    aims = [objective] + [o for o in view.objectives if o is not objective]
    tables = [(f"The best designs, by {objective.words}", summary.best_table(view, objective))]
    if len(view.objectives) > 1:
        front, count = summary.front_table(view, 100)
        tables.append((f"Pareto front: {count} designs", front))
    chosen, cost = to_run(view, objective)
    if chosen and not quiet:
        what = "the best design" + (f" and {plural(len(chosen) - 1, 'other')}" if len(chosen) > 1 else "")
        say("mill study", f"runs {what} once more for the page: about {duration(cost)}")
    with Progress("mill study", len(chosen) + len(kinds) + 1, quiet) as watch:
        mills, watch.due = [], watch.due - cost  # at once, if these runs take long
        for design in chosen:
            with watch.step(f"running {view.label(design)} again"):
                mills.append((design, view.tell(design), _mill(view, design, min(BYTES[1], BYTES[0] // len(chosen)))))
        pictures = []
        for _, title, words, make in kinds:
            with watch.step("pictures"):
                pictures.append((title, words, style.embedded(make())))
    script, theme = ((path).read_text("utf-8") for path in (FOLDER / "study.js", pages.FOLDER / "theme.js"))
    found = pages.environment(FOLDER)
    found.policies["json.dumps_kwargs"] = {"separators": (",", ":"), "allow_nan": False}
    return found.get_template("study_page.html").render(
        policy=player.policy(theme, script),
        maker=pages.maker(),
        style=pages.style(pages.FOLDER / "report.css"),
        scripts=player.scripts() if mills else "",
        script=script,
        theme=theme,
        title=plain(_signs(summary.finding(view, objective)) or f"Study {view.name}"),
        kicker=plain(f"Study {view.name}"),
        data=data(view, objective, [design for design, *_ in mills]),
        head=summary.head_lines(view) + summary.progress_lines(view),
        doubts=summary.doubt_lines(view),
        optima=[[_signs(line) for line in summary.optimum_lines(view, aim)] for aim in aims],
        beside=pair.sentences([view, beside], objective, wanted) if beside is not None else [],
        tables=tables,
        pictures=pictures,
        mills=mills,
        meta=view.meta,
    )


# ---- the data of the linked pictures


def data(view, objective, mills) -> dict:
    """JSON-able: axes and numbers of the designs, as they are shown."""
    shown = tradeoff.pairs(view, objective)
    aims = {a.path: a for a in [objective, *view.objectives, *(a for p in shown for a in (p.y, p.x)),
                                *(aim for aim, _ in summary.limits_of(view))]}  # fmt: skip
    found = {path: view.estimate(path) for path in aims}
    best = optimum.find(view, objective)
    state = np.where(view.usable & ~view.feasible, "not allowed", view.designs["state"])
    designs, words, base = [], spoken(view), any(one.section == "set" for one in deck_entries(view.meta, "study"))
    for k in range(len(view.designs)):
        line = view.designs.iloc[k]
        designs.append({
            "name": view.tell(k), "state": str(state[k]),
            "set": _command(view, k) if base else
                   " ".join(f"-s {shlex.quote(text)}" for text in settings(view, k, words)),
            "keys": [float(line[a.key]) / a.scale.size if a.numeric else a.choices.index(line[a.key])
                     for a in view.axes],
            "aims": [_number(found[path].mean[k]) for path in aims],
            "told": [summary.scale_of(view, aim).pair(found[path].mean[k], found[path].half[k])
                     for path, aim in aims.items()],
        })  # fmt: skip
    pairs = [{"x": [*aims].index(p.x.path), "y": [*aims].index(p.y.path),
              "slope": p.slope} for p in shown]  # fmt: skip
    table = matplotlib.colormaps["viridis"](np.linspace(0, 1, 32), bytes=True)[:, :3]
    return {
        "keys": [{"name": a.words, "unit": a.scale.unit if a.numeric else "", "words": [] if a.numeric else
                  list(map(str, a.choices)), "log": a.log} for a in view.axes],
        "aims": [{"name": summary.head_of(a), "unit": a.unit, "goal": a.goal} for a in aims.values()],
        "limits": [{"aim": [*aims].index(one.expression.text), "sign": one.sign, "limit": one.limit,
                    "text": _signs(one.text)} for one in view.require],
        "designs": designs, "pairs": pairs, "plane": _plane(view, objective), "colours": table.ravel().tolist(),
        "best": best.design if best else None, "front": _front(view, shown), "mills": mills,
    }  # fmt: skip


def _command(view, k) -> str:
    """What writes the deck of a design: options for the base deck would leave out [set] of the study."""
    number = view.rows["design"].to_numpy()[view.design_of == k][0]
    table = shlex.quote(f"{view.name}.parquet")
    return f"mill study {table} --design {number} --deck {shlex.quote(f'{view.name}-{number}.ini')}"


def _signs(text: str) -> str:
    return text.replace("<=", "\N{LESS-THAN OR EQUAL TO}").replace(">=", "\N{GREATER-THAN OR EQUAL TO}")


def _number(value):
    return float(value) if math.isfinite(value) else None


def _front(view, shown) -> list[int]:
    return optimum.front(view, (shown[0].y, shown[0].x)).tolist() if shown else []


def _plane(view, objective):
    """The field of the contours over two keys: places in the units of the keys, None where it is not known."""
    if sum(axis.numeric for axis in view.axes) < 2:
        return None
    x, y = contour.main_keys(view)
    found = contour.plane(view, objective, x, y)
    step = [max(1, size // 48) for size in found.value.shape]
    value = found.value[:: step[0], :: step[1]]
    sizes = [axis.drawn.size / axis.scale.size for axis in (x, y)]
    return {
        "x": view.axes.index(x), "y": view.axes.index(y), "others": found.others,
        "xs": (found.xs[:: step[1]] * sizes[0]).tolist(), "ys": (found.ys[:: step[0]] * sizes[1]).tolist(),
        "value": [[_number(one) for one in row] for row in value],
    }  # fmt: skip


# ---- the mills


def spoken(view) -> dict:
    """{(key, value [SI]): "800 rpm"} of the varied numbers, in the unit of the study, where millsim reads this as the
    same number to the last bit."""
    asked = []
    for axis in view.axes:
        if axis.numeric and axis.said:
            for value in dict.fromkeys(map(float, view.designs[axis.key].dropna())):
                asked.append((axis.key, value, f"{value / axis.said.size:.12g} {axis.said.unit}"))
    try:
        told = values.tell(f"{key}={text}" for key, _, text in asked)
    except UserError:  # no engine, or one that does not know the key
        return {}
    return {(key, value): text for (key, value, text), read in zip(asked, told) if read.value == value}


def to_run(view, objective) -> tuple[list[int], float]:
    """The designs to run again for their frames: the best, the knee, the front, then others by the objective; and the
    time that this takes [s]."""
    given = view.meta.get("common") or {}
    best = optimum.find(view, objective)
    if best is None or not given or "the start file" in given:
        return [], 0.0
    shown = tradeoff.pairs(view, objective)
    aims = (shown[0].y, shown[0].x) if shown else ()
    front = optimum.front(view, aims) if aims else np.array([], int)
    knee = optimum.knee(view, aims, front) if aims else None
    good = objective.sign * np.where(view.usable, view.estimate(objective.path).mean, np.nan)
    order = [best.design, *([] if knee is None else [knee]), *front[[0, -1]] * bool(len(front)), *front] if len(front) \
        else [best.design]  # fmt: skip
    order = dict.fromkeys(int(k) for k in [*order, *np.argsort(-good)] if view.usable[k])
    chosen, cost = [], 0.0
    for design in order:
        more = TWICE * float(_row(view, design)["cpu"]) + DRAWN
        if cost + more > CHEAP or len(chosen) == MOST_MILLS:
            break
        chosen, cost = [*chosen, design], cost + more
    return chosen, cost


def _row(view, design):
    """The first good run of a design."""
    rows = view.rows[(view.design_of == design) & (view.rows["status"] == "done").to_numpy()]
    return rows.iloc[0]


def _mill(view, design, most_bytes) -> str:
    """The player of a design, or a sentence why there is none."""
    row = _row(view, design)
    orders = [*settings(view, design), f"run.seed={row['seed']}"]
    orders.append(f"output.frames={max(0.01, float(row['time']) / 50)!r} s")
    try:
        with base_of(view, *orders) as file:
            sets = [word for order in orders for word in ("--set", order)]
            engine.ask("--quiet", *sets, "-o", file.with_suffix(".h5"), "--", file)
            with Run(file.with_suffix(".h5")) as run:
                return parts.balls([run], "auto", lambda line: None, lambda line: None, most_bytes)[0]
    except UserError as fault:
        return f'<p class="missing">not run again for the page: {plain(fault).replace("<", "&lt;")}</p>'
