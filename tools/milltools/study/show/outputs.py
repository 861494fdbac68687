"""A study as files: pictures, one page, CSV."""

import functools
import math
import pathlib

from milltools.base.errors import UserError
from milltools.base.files import whole, write_csv, write_text
from milltools.base.progress import say
from milltools.base.text import plain, spoken_unit
from milltools.contour import picture
from milltools.figures import style
from milltools.geometry import contour as walls
from milltools.study.show import contour, optimum, pair, slices, summary, tradeoff, tumbling
from milltools.study.show.data import Scale, StudyView, deck_of

DOTS = 200  # an inch of a picture


def figures(view, objective, sensitivities=(), beside=None, wanted=None, **options):
    """(kind, title, description for readers who cannot see it, drawing function) of all pictures of a study, the main
    picture first: contours, or lines if only one key is a number. `beside`: another study, with the designs `wanted`
    as the reference."""
    what, part = objective.words, functools.partial
    options["sensitivities"] = sensitivities
    if sum(axis.numeric for axis in view.axes) > 1:
        words = (
            f"{what} as filled contours over two varied keys, the best design, the designs at most "
            f"{100 * optimum.ALIKE:g} % worse and those that cannot be distinguished from it; the relative standard "
            "errors beside it"
        )
        yield "contour", "Over two keys", words, part(contour.draw, view, objective, **options)
    if deck := _shaped(view, objective):
        words = "the cross-section of the drum in the best design, and the reach of the blades"
        yield "wall", "The wall of the best design", words, part(_wall, view, objective, deck)
    words = f"{what} along each varied key through the best design, with 95 % error bars"
    yield "slices", "Along each key", words, part(slices.draw, view, objective)
    if found := tumbling.mills(view, objective):
        words = f"{what} over the share of the critical speed, with the curves of Morrell and of Hogg & Fuerstenau"
        yield "tumbling", "Over the critical speed", words, part(tumbling.draw, view, objective, found)
    if found := tradeoff.pairs(view, objective):
        what = " and ".join(dict.fromkeys(f"{pair.y.words} over {pair.x.words}" for pair in found))
        words = f"{what} of every design, the designs that no other beats in both, and their 95 % error bars"
        yield "pareto", "Trade-off", words, part(tradeoff.draw, view, objective)
    if sensitivities:
        words = "share of the variance that each varied key explains, alone and in all"
        yield "sensitivity", "Which key matters", words, part(slices.draw_sensitivity, view, sensitivities)
    if beside is not None:
        both = [view, beside]
        words = " ".join(pair.sentences(both, objective, wanted))
        make = part(pair.draw, both, objective, wanted=wanted, **options)
        yield "beside", f"Beside {plain(beside.name)}", words, make


def best_deck(view, objective, number=None):
    """The Deck of the best design, or of the one with this number in the table; UserError if there is none, or if its
    deck names a file."""
    if number is not None:
        own = view.design_of[(view.rows["design"] == number).to_numpy()]
        if not len(own):
            raise UserError(f"--design {number}: {view.name} has no run of a design with this number")
        return deck_of(view, int(own[0]))
    best = optimum.find(view, objective)
    if best is None:
        raise UserError(f"{view.name}: there is no best design yet", status=1)
    return deck_of(view, best.design)


def _shaped(view, objective):
    """The Deck of the best design, if keys of its drum are varied and it is no circle; a note where it has none."""
    if not any(axis.key.startswith("drum.") for axis in view.axes) or optimum.find(view, objective) is None:
        return None
    try:
        deck = best_deck(view, objective)
        return deck if "drum" in deck.contours else None
    except UserError as fault:
        say("mill study", f"note: no picture of the wall of the best design: {fault}")
        return None


def _wall(view, objective, deck):
    """The contour of the best design."""
    title, ball = view.tell(optimum.find(view, objective).design), max(one.diameter for one in deck.species)
    reach = max((math.hypot(one.tip_radius, one.thickness / 2) for one in deck.blades), default=0.0)
    return picture.draw(walls.of(deck), title, ball, reach)


def draw(table, path):
    """The main picture of a table.Table into a file (.png, .svg, .pdf)."""
    view = StudyView.of(table)
    objective = view.objectives[0]
    sensitivities = optimum.indices(table, view, objective) if len(view.axes) > 2 else ()
    *_, make = next(figures(view, objective, sensitivities))
    style.save(make(), path, DOTS)


def write(asked, view, *more, design=None, **options) -> list[str]:
    """Writes the requested files, {kind: path}; returns the names of the page and of the pictures: one PDF for all, or
    one file each. `design`: the number of the one whose deck is asked for, None: the best."""
    kinds = functools.cache(lambda: list(figures(view, *more, **options)))
    if "csv" in asked:
        csv(view, asked["csv"], *more[:1])
    if "html" in asked:
        write_text(asked["html"], _page(view, more[0], kinds(), options))
    if "deck" in asked:
        which = f"Best design of the study {plain(view.name)}, by {more[0].words}"
        which = which if design is None else f"Design {design} of the study {plain(view.name)}"
        write_text(asked["deck"], f"# {which}\n{best_deck(view, more[0], design).text}")
    names = [asked["html"]] if "html" in asked else []
    for path in (pathlib.Path(asked[kind]) for kind in ("png", "svg") if kind in asked):
        for name, _, _, make in kinds():
            names.append(str(path.with_name(f"{path.stem}-{name}{path.suffix}")))
            style.save(make(), names[-1], DOTS)
    if "pdf" in asked:
        from matplotlib.backends.backend_pdf import PdfPages  # with 130 modules of fontTools

        names.append(asked["pdf"])
        with whole(names[-1]) as draft, PdfPages(draft, metadata={"CreationDate": None}) as sheets:
            for *_, make in kinds():
                sheets.savefig(make())
    return names


def csv(view, path, objective=None):
    """All runs as comma-separated values, the unit of each column in its head: "drum.buckle_height [mm]", keys in the
    unit of the study deck, all else in SI. After the columns of the table come those of the `objective` that was asked
    for and of what is required."""
    aims = [*view.objectives, *([objective] if objective else []), *(aim for aim, _ in summary.limits_of(view))]
    scales = {one.key: one.said or Scale(unit=one.unit) for one in view.axes if one.numeric}
    scales |= {key: Scale(unit=spoken_unit(one["unit"])) for key, one in view.formulas.derived.items()}
    scales |= {one.path: one.scale for one in [*map(view.aim, view.meta["record"]), *aims]}
    scales |= dict.fromkeys(("time", "sample_from", "cpu", "wall"), Scale(unit="s"))
    heads = []
    shown = view.rows.drop(columns="results", errors="ignore")  # packed, for programs
    for one in aims:
        if one.path not in shown:
            value, error = view.column(one.path)
            shown = shown.assign(**{one.path: value, f"{one.path}:error": error})
    for column in shown.columns:
        name = column.removesuffix(":error")
        scale = scales.get(name, Scale())
        if scale.size != 1:
            shown[column] = [float(f"{value / scale.size:.12g}") for value in shown[column]]
        heads.append(f"standard error of {name}" * (name != column) or name)
        heads[-1] += scale.bracket * bool(scale.unit)
    rows = shown.astype(object).where(shown.notna(), None)
    write_csv(path, heads, rows.itertuples(index=False))


def _page(view, objective, kinds, options) -> str:
    from milltools.study.show import page  # with the player, which the other files do not need

    return page.render(view, objective, kinds, options.get("beside"), options.get("wanted"), quiet=False)
