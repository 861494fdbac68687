"""The liner of a tumbling mill: what impacts do along the developed length of its contour, and to it at angles around
the axis of the mill (docs/tumbling.md#liner)."""

import functools
import math

import numpy as np

from milltools.base.errors import UserError
from milltools.base.text import number
from milltools.geometry import contour
from milltools.geometry.contour import Contour
from milltools.geometry.worn import along, worn
from milltools.read import motions
from milltools.read.runfile import Run
from milltools.read.wear import Wear

ALONG, TURN = "statistics/wear/along", "statistics/charge/liner"
SLOPE = 0.3  # tangential component of the normal of a face; more is a leading or trailing face
SET = 0.25  # of the height: what stands higher is a lifter, perhaps of a lower set; less is a worn plate
FINE = 2000  # places along the contour
SHARE = 0.99
STEP = 0.05  # of the height: the largest depth after which the motion of the balls is computed again


def why_not(run: Run) -> str | None:
    """Why nothing is known along the contour of a run; None if it is."""
    if run.unsampled:
        return run.unsampled
    if not run.has(f"{ALONG}/count"):
        return "only for a container that is a contour (drum.profile other than circle), and not for older files"
    return None


class Liner:
    """The contour of a run, what impacts do along it, and its equal parts.

    contour         Contour, in the container's own y and z
    width           [m] of the mill, along its axis
    parts, period   number of equal parts, and developed length of one [m]
    lifters         number of tips
    height          [m] from the tips to the plate, which is the median of what lies low: grooves are deeper
    front           [rad] mean angle of the leading faces, without foot and edge, from the radius in the middle of their
                    lifter, as drum.lifter_front has it; NaN: there are none
    turning         1: the mill turns anticlockwise in the contour's plane; -1; 0: not
    s, face         middles of the bins of a period [m], and what is there: one of FACES
    """

    FACES = ("leading face", "top", "trailing face", "plate")

    def __init__(self, run: Run):
        if why := why_not(run):
            raise UserError(f"{run.path}: nothing is known along a contour: {why}")
        place = f"body.{run.vessel}" if run.vessel else "drum"
        self.run, self.contour = run, contour.of(run.as_deck, place)
        self.width = run.quantity(f"{place}/length")
        axis = run.vector(f"motion.{run.carrier}/axis") if run.has(f"deck/motion.{run.carrier}/axis") else np.zeros(3)
        self.turning = int(np.sign(motions.rate(run, run.carrier) * (axis @ run.vessel_frame()[:, 0])))
        self._measure()

    def _measure(self):
        length = self.contour.length
        s = (np.arange(FINE) + 0.5) / FINE * length
        points = self.contour.points(*self.contour.at(s))
        away = np.hypot(*points.T)
        middle = (away.max() + away.min()) / 2
        plate = float(np.median(away[away >= middle]))
        self.height = plate - float(away.min())
        self.parts = equal_parts(self.contour)
        self.period = length / self.parts
        tips = away < plate - max(SET * self.height, 1e-6 * plate)
        starts = tips & ~np.roll(tips, 1)
        self.lifters = int(starts.sum())
        of = (np.cumsum(starts) - 1) % max(self.lifters, 1)
        way = points @ [1, 1j] / away
        middles = np.array([way[tips & (of == k)].sum() for k in range(self.lifters)])
        self.bins = max(20, round(FINE / self.parts))
        self.s = (np.arange(self.bins) + 0.5) / self.bins * self.period
        where = self.contour.at(self.s)
        points, normals = self.contour.points(*where), self.contour.normals(*where)
        self.away = np.hypot(*points.T)
        ahead = (points[:, 0] * normals[:, 1] - points[:, 1] * normals[:, 0]) / self.away * (self.turning or 1)
        leads = ahead > SLOPE
        body = leads & (abs(self.away - middle) < self.height / 4)
        told = body if body.any() else leads
        beside = abs(np.angle((points[told] @ [1, 1j])[:, None] / middles)).min(axis=1, initial=math.pi)
        self.front = float((np.arccos(np.minimum(ahead[told], 1)) + beside).mean()) if told.any() else math.nan
        level = np.where(self.away < middle, "top", "plate")
        self.face = np.where(leads, "leading face", np.where(ahead < -SLOPE, "trailing face", level))
        self.raised = away.max() - self.away  # [m] above the outermost points

    def sums(self, name: str) -> np.ndarray:
        """(bins,) a column of the file summed over all equal parts: counts, or J."""
        value = self.run.read(f"{ALONG}/{name}").astype(float)
        total = np.concatenate([[0], np.cumsum(value)])
        edges = np.linspace(0, len(value), self.parts * self.bins + 1)
        return np.diff(np.interp(edges, np.arange(len(value) + 1), total)).reshape(self.parts, -1).sum(0)

    def density(self, name: str) -> np.ndarray:
        """(bins,) the same per area and time: W/m^2 or 1/(m^2 s)."""
        return self.sums(name) / (self.contour.length / self.bins * self.width * self.run.duration)

    def shares(self, name: str) -> dict[str, float]:
        """Shares of the faces in a column, and "areas", in their order in FACES."""
        value = np.ones(self.bins) if name == "areas" else self.sums(name)
        return {face: float(value[self.face == face].sum() / (value.sum() or 1)) for face in self.FACES}

    @functools.cached_property
    def smooth(self) -> float:
        """[m] the length over which depths are averaged: the radius of the largest ball."""
        return min(max(kind.diameter for kind in self.run.as_deck.species) / 2, self.period / 2)

    def _tiled(self, depth):
        return (np.arange(self.parts * self.bins) + 0.5) / self.bins * self.period, np.tile(depth, self.parts)

    def smoothed(self, depth) -> np.ndarray:
        """Depths [m] (bins,) averaged over `smooth`."""
        return along(self.contour, *self._tiled(depth))[1](self.s, self.smooth)

    def worn(self, depth) -> Contour:
        """The contour that has lost these depths [m] (bins,), smoothed twice: without kinks; UserError if none is."""
        try:
            return worn(self.contour, *self._tiled(self.smoothed(depth)), self.smooth)
        except ValueError as fault:
            raise UserError(f"{self.run.path}: the worn contour: {fault}") from None

    def loose(self, depth, left: Contour) -> str:
        """What has come loose, if these depths (bins,) have left this contour: "; 3 mm² of it came loose", or ""."""
        area = left.area - self.contour.area - float(self.smoothed(depth).mean()) * self.contour.length
        return f"; {number(1e6 * area)} mm² of it came loose" if area > 1e-6 * left.area else ""

    def lost(self, depth) -> float:
        """[m] what the tops lose with these depths (bins,), on average; all of a contour without tops."""
        top = self.face == "top"
        return float(self.smoothed(depth)[top if top.any() else slice(None)].mean())

    def scaled(self, depth, lost: float) -> np.ndarray:
        """Depths (bins,) in proportion, with which the tops lose this length [m]."""
        now = self.lost(depth)
        if not now > 0:
            raise UserError(f"{self.run.path}: no impacts slide on the tops of the liner: simulate longer")
        return depth * lost / now

    def worst(self) -> tuple[int, float]:
        """Where sliding wears the liner most, and how many times its mean: the bin, and 0 if nothing slides."""
        wears, mean = self.smoothed(self.density("slid")), self.density("slid").mean()
        k = int(wears.argmax())
        return k, float(wears[k] / mean) if mean > 0 else 0.0

    def finding(self) -> str:
        """A sentence: where sliding wears the liner, and its faces."""
        k, times = self.worst()
        if not times > 0:
            return "no impacts slide on the liner"
        each = ", ".join(f"{face} {100 * share:.0f} %" for face, share in self.shares("slid").items() if share > 0)
        place = f"{self.face[k]}" + (f" {number(1e3 * self.raised[k])} mm above the lowest place" * (self.height > 0))
        return f"sliding wears the liner most on the {place}, {number(times)} times its mean; its shares: {each}"


def equal_parts(of: Contour) -> int:
    """The largest number n of a contour that is where it was, within a hundredth of its height, after 1/n of a turn."""
    count = 4 * FINE
    points = of.points(*of.at((np.arange(count) + 0.5) / count * of.length))
    spots = points @ [1, 1j]
    slack = 0.01 * np.ptp(np.abs(spots)) + 1e-6 * of.size
    for n in range(500, 1, -1):
        later = np.arange(count) + count / n
        moved = np.interp(later, np.arange(2 * count), np.tile(spots, 2))
        if np.abs(moved * np.exp(-2j * math.pi / n) - spots).max() < slack:
            return n
    return 1


# ---- around the axis


class Turn:
    """What the liner of a tumbling mill gets at angles [rad] from the lowest place to the rising side, middles of bins:
    `outward` and `forward` (bins,) [N] are the mean force on a lifter at this angle, from the axis and with the
    turning. UserError for another mill."""

    def __init__(self, run: Run, lifters: int):
        if why := why_no_turn(run):
            raise UserError(f"{run.path}: {why}")
        self.run, self.lifters = run, lifters
        self.duration = float(run.read(f"{TURN}/duration"))
        self.count, self.normal, self.sliding = (self[name] for name in ("count", "normal", "sliding"))
        bins = len(self.count)
        self.angle = ((np.arange(bins) + 0.5) / bins - 0.5) * math.tau
        per = bins / (self.duration * lifters) if lifters and self.duration > 0 else math.nan
        self.outward, self.forward = (per * self[f"lifter_{way}"] for way in ("outward", "forward"))

    def __getitem__(self, name: str) -> np.ndarray:
        return self.run.read(f"{TURN}/{name}").astype(float)

    @property
    def above_toe(self) -> float:
        """Share of the impacts on the liner that are above the toe, up to the highest place; NaN without a toe."""
        toe = (self.run.charge["toe"][0] / math.tau + 0.5) * len(self.count)
        share = np.clip(toe - np.arange(len(self.count)), 0, 1)
        return float((share * self.count).sum() / self.count.sum()) if self.count.sum() else math.nan

    @property
    def sizes(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Middles of wider bins [rad], impulses [N s] of single impacts on lifters that SHARE of all that lifters get
        there is below, NaN without impacts; and the same of the whole turn, a number."""
        value, edges = self["sizes"], self["edges"]
        middle = ((np.arange(len(value)) + 0.5) / len(value) - 0.5) * math.tau
        return middle, np.array([_quantile(row, edges) for row in value]), _quantile(value.sum(axis=0), edges)

    def finding(self) -> str:
        """Sentences about the share above the toe, and the forces on a lifter."""
        share, error = self.run.charge["above_toe"]
        said = []
        if math.isfinite(share):
            sure = f" \N{PLUS-MINUS SIGN} {100 * error:.1f}" if math.isfinite(error) else ""
            said.append(
                f"above the toe are {number(100 * self.above_toe)} % of the impacts on the liner, with "
                f"{100 * share:.1f}{sure} % of the energy that its impacts lose along the normal."
            )
        force = np.hypot(self.outward, self.forward)
        if np.nanmax(force, initial=0) > 0:
            k = int(force.argmax())
            said.append(
                f"a lifter gets the largest mean force {math.degrees(self.angle[k]):.0f}\N{DEGREE SIGN} after the "
                f"lowest place: {number(abs(self.outward[k]))} N {'outwards' if self.outward[k] > 0 else 'inwards'}, "
                f"{number(abs(self.forward[k]))} N {'with' if self.forward[k] > 0 else 'against'} the turning; a "
                f"hundredth of what lifters get comes in single impacts of more than {number(self.sizes[2])} N s."
            )
        return " ".join(f"{one[0].upper()}{one[1:]}" for one in said) or "no impacts on the liner."

    def facts(self) -> dict:
        """The numbers of the sentences, and the curves, for programs."""
        curves = {name: getattr(self, name) for name in ("angle", "count", "normal", "sliding", "outward", "forward")}
        return {
            "above_toe": self.run.charge["above_toe"][0], "impacts_above_toe": self.above_toe,
            "large_impact": self.sizes[2], "turn": curves,
        }  # fmt: skip


def bars(run: Run) -> int:
    """The number of bodies that turn with the container, such as lifters."""
    found = [p for p in Wear(run).parts if p.motion == run.carrier and p.kind not in run.vessel_kinds]
    return len(found)


def _quantile(weight, edges) -> float:
    total = np.concatenate([[0], np.cumsum(weight)])
    if not total[-1] > 0:
        return math.nan
    return float(np.exp(np.interp(SHARE * total[-1], total, np.log(edges))))


def why_no_turn(run: Run) -> str | None:
    """Why nothing is known around the axis of a run; None if it is."""
    if run.unsampled:
        return run.unsampled
    if not run.has(f"{TURN}/count"):
        return "only for a container that turns steadily about its own horizontal axis"
    return None
