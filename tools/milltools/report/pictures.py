"""The figures of a report, as SVG that is part of the page."""

import dataclasses
import io
import re

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

from milltools import plot
from milltools.profile import Profile


@dataclasses.dataclass(frozen=True)
class Picture:
    """`svg` is empty where it cannot be drawn; then `why` says so."""

    name: str
    title: str
    caption: str
    svg: str
    why: str = ""


def _svg(figure, prefix):
    store = io.StringIO()
    with matplotlib.rc_context({"svg.fonttype": "none", "svg.hashsalt": prefix}):
        figure.savefig(store, format="svg", metadata={"Date": None}, transparent=True)
    plt.close(figure)
    text = store.getvalue()
    return re.sub(r"xmlns:xlink", "xmlns:xlink", text[text.index("<svg") :])


def spectra(run) -> list[Picture]:
    figure, ax = plt.subplots(figsize=(9, 5), layout="constrained")
    plot.draw_spectra(ax, run)
    return [Picture("spectra", "Impact speeds", "Impacts per second and decade.", _svg(figure, "s"))]


def maps(run) -> list[Picture]:
    figure, ax = plt.subplots(figsize=(7, 6), layout="constrained")
    profile = Profile.of(run.deck().get)
    rim = ax.add_patch(plot.drum_rim(profile))
    plot.draw_power(ax, run, rim)
    return [Picture("map", "Dissipated power", "Cross-section.", _svg(figure, "m"))]
