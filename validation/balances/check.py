"""Balances that hold in any steady mill: power, forces, torques, and an atmosphere of hard spheres.

README.md says what is claimed and where each band comes from.
"""

import json

import h5py
import matplotlib.pyplot as plt
import numpy as np
from scipy.optimize import brentq

GRAVITY = 9.81
SEEDS = range(1, 9)  # of the atmosphere: its standard errors come from independent runs
SLICES = 20  # of the atmosphere, of one ball diameter each
INNER = range(4, 17)  # those of them far enough from floor and lid for the equation of state
ACCELERATION = 45.0  # [m/s^2] of the atmosphere
SOON = 2e-5  # [s] impacts of one ball closer than this: its velocity between them is not used
JAM = 1e-9  # [s] closer than this is a chain of balls being squeezed
CORE = 0.6  # of the drum's radius: the part of the atmosphere away from the curved wall
SURFACES, ROTOR, STILL = [1, 2, 3, 4], [3, 4], [1, 2]  # kinds of contact
LAW = (("contact", "restitution"), ("contact", "rebound_floor"))
SIZE = ("radius", "length")


def steady_error(values, duration):
    """Standard error of the mean rate of change over a window: both ends are draws of one steady state."""
    return np.sqrt(2.0) * np.std(values) / duration


class Mill:
    """One finished run: series, frames and log, and the window of its statistics."""

    def __init__(self, path, margin=0.0):
        """margin: the window ends so much before the run [s]"""
        self.file = h5py.File(path)
        self.summary = json.loads(path.with_suffix(".json").read_text())
        self.begin, self.end = self.summary["sample_from"], self.summary["time"] - margin
        self.duration = self.end - self.begin

    def series(self, name):
        item = self.file["observables"][name]
        return item["time"][:], item["value"][:]

    def total(self, names):
        return sum(self.series(name)[1] for name in names)

    def window(self, time):
        """Rows from the window's begin to its end; times are multiples of an interval."""
        slack = 1e-9 * self.end
        return np.flatnonzero((time >= self.begin - slack) & (time <= self.end + slack))

    def frames(self, *names):
        """Time and the named states of the window's frames."""
        group = self.file["particles/trajectory"]
        rows = self.window(group["position/time"][:])
        first, last = rows[0], rows[-1] + 1
        states = [group[name]["value"][first:last].astype(float) for name in names]
        return group["position/time"][first:last], *states

    def log(self, *names):
        columns = self.file["impacts"]
        return [columns[name][:] for name in names]

    @property
    def kinds(self):
        return list(self.file["impacts"].attrs["kinds"])


# --- power -------------------------------------------------------------------------------------


def power(case, mill):
    time, work = mill.series("rotor_work")
    energy = mill.total(["kinetic_energy", "rotational_energy", "potential_energy"])
    kinds = mill.file["observables/dissipation"]
    loss = mill.total([f"dissipation/{kind}" for kind in kinds])
    rows = mill.window(time)
    imbalance = np.abs(work - work[0] - (energy - energy[0]) - (loss - loss[0]))
    case.bound(
        "energy balance, largest of all rows, over the energy turned over",
        imbalance.max() / mill.summary["run"]["energy_turnover"],
        1e-11,
        against="rotor work = change of energy + losses",
    )
    draw = np.ptp(work[rows]) / mill.duration
    lost = np.ptp(loss[rows]) / mill.duration
    error = steady_error(energy[rows], mill.duration)
    case.claim(
        "power lost in impacts, steady mean",
        lost,
        draw,
        4.0 * error,
        against="power of the rotor",
        error=error,
        unit="W",
        headline=True,
    )
    torque(case, mill, time, work)
    halves(case, mill)
    return time[rows], work[rows], loss[rows], energy[rows]


def torque(case, mill, time, work):
    speed = 1000.0 * 2.0 * np.pi / 60.0
    turned = speed * np.cumsum(mill.series("rotor_torque")[1][1:] * np.diff(time))
    case.bound(
        "rotor torque x speed against power, largest of all rows",
        np.abs(turned - np.diff(work).cumsum()).max() / np.ptp(work),
        1e-12,
        against="power = torque x speed",
    )


def halves(case, mill):
    """Is it steady, and are the blocks' errors right? Both halves draw the same power."""
    blocks = mill.file["statistics/rotor/block_power"][:]
    first, second = np.array_split(blocks, 2)
    error = np.sqrt(sum(half.var(ddof=1) / len(half) for half in (first, second)))
    case.claim(
        "power in the window's second half",
        second.mean(),
        first.mean(),
        4.0 * error,
        against="power in its first half",
        error=error,
        unit="W",
    )


# --- forces and torques of a mill with friction, from the balls' paths -----------------------------


class Paths:
    """Impulses found again from where and when each ball was struck.

    Between two impacts a ball flies on a parabola, so their places and times give its velocity after the one and
    before the other. The log's places are single precision, which spoils velocities over short times: impacts of
    balls that follow one on a surface within SOON are counted with it, on both their balls; their sum is zero.
    """

    def __init__(self, mill, radius, mass):
        time, kind, ball, partner, place, normal = mill.log(
            "time", "kind", "ball", "partner", "position", "normal"
        )
        self.rounding = np.spacing(np.abs(place)).astype(float) / np.sqrt(12.0)
        place, normal = place.astype(float), normal.astype(float)
        pair = np.flatnonzero(kind == 0)
        who = np.concatenate([ball, partner[pair]])
        row = np.concatenate([np.arange(len(time)), pair])
        side = np.concatenate([np.ones(len(time)), -np.ones(len(pair))])[:, None]
        order = np.lexsort((row, who))  # by ball, then by time
        who, row, side = who[order], row[order], side[order]
        centre = place[row] + side * radius * normal[row]
        span = np.maximum(np.diff(time[row])[:, None], 1e-12)
        span[who[1:] != who[:-1]] = np.inf  # another ball: no flight
        fall = np.where(np.isfinite(span), 0.5 * span, 0.0) * np.array([0.0, 0.0, -GRAVITY])
        mean = np.diff(centre, axis=0) / span
        self.impulse = np.zeros((len(row), 3))
        self.impulse[1:-1] = mass * ((mean - fall)[1:] - (mean + fall)[:-1])
        self.time, self.kind, self.place = time[row], kind[row], place[row]
        self.row, self.span, self.mass = row, span, mass

    def clear(self, mill):
        """Narrows the window to its longest stretch in which no ball is struck twice within JAM.

        While a chain of balls is squeezed between blade and drum its impacts follow so closely that the log cannot
        tell who pushed whom. The laws hold in every window, so one without such a chain will do.
        """
        frames = mill.file["particles/trajectory/position/time"][:]
        frames = frames[mill.window(frames)]
        jams = self.time[:-1][self.span[:, 0] < JAM]
        marks = np.unique(np.concatenate([[frames[0], frames[-1]], jams]))
        marks = marks[(marks >= frames[0]) & (marks <= frames[-1])]
        longest = np.argmax(np.diff(marks))
        inside = (frames >= marks[longest]) & (frames <= marks[longest + 1])
        mill.begin, mill.end = frames[inside][[0, -1]]
        mill.duration = mill.end - mill.begin

    def tied(self, wanted):
        """Marks also the impacts between balls that follow a marked one too soon, and so on."""
        soon = self.span[:, 0] < SOON
        pair = self.kind == 0
        while True:
            more = np.zeros(len(wanted), bool)
            more[1:] |= soon & wanted[:-1]
            more[:-1] |= soon & wanted[1:]
            rows = np.unique(self.row[more & pair & ~wanted])
            if len(rows) == 0:
                return wanted
            wanted = wanted | np.isin(self.row, rows)

    def noise(self, weight):
        """Standard error that the rounding of the places gives the sum of weight x impulse."""
        slope = self.mass * (weight[:-1] - weight[1:]) / self.span
        place = np.zeros_like(self.impulse)  # how the sum follows the place of each impact
        place[1:] += slope
        place[:-1] -= slope
        shared = np.zeros_like(self.rounding)
        np.add.at(shared, self.row, place)
        return np.sqrt(((shared * self.rounding) ** 2).sum(axis=0))

    def sum(self, kinds, begin, end, arm=1.0):
        """Sum of the impulses (times `arm`) of some kinds of contact, and its error from rounding."""
        inside = (self.time >= begin) & (self.time < end) & np.isin(self.kind, kinds)
        weight = self.tied(inside)[:, None] * np.broadcast_to(arm, self.impulse.shape)
        return (weight * self.impulse).sum(axis=0), self.noise(weight)

    def reactions(self, begin, end):
        """For each impact of two balls in the window: impulse of the one + that of the other, over its rounding."""
        rows = np.flatnonzero(np.bincount(self.row) == 2)
        total = np.zeros_like(self.rounding)
        np.add.at(total, self.row, self.impulse)
        rate = 1.0 / self.span
        before, after = np.zeros_like(self.impulse), np.zeros_like(self.impulse)
        before[1:] += rate
        after[:-1] += rate
        # the place of the impact itself, the same for both balls, and those before and after
        own, others = np.zeros_like(total), np.zeros_like(total)
        np.add.at(own, self.row, before + after)
        rounding = self.rounding[self.row]
        np.add.at(others, self.row[1:], (rate * rounding[:-1]) ** 2)
        np.add.at(others, self.row[:-1], (rate * rounding[1:]) ** 2)
        noise = self.mass * np.sqrt((own * self.rounding) ** 2 + others)
        time = np.zeros(len(total))
        time[self.row] = self.time
        rows = rows[(time[rows] >= begin) & (time[rows] < end)]
        return total[rows] / noise[rows]


def momentum(mill, mass, inertia):
    """Momentum, its moment about the axis, and the weight's moment about it, in the window's frames."""
    time, r, v, w = mill.frames("position", "velocity", "angular_velocity")
    linear = mass * v.sum(axis=1)
    angular = (mass * (r[..., 1] * v[..., 2] - r[..., 2] * v[..., 1]) + inertia * w[..., 0]).sum(1)
    weight = -mass * GRAVITY * r[..., 1].sum(axis=1)
    return time, linear, angular, np.trapezoid(weight, time) / (time[-1] - time[0])


def properties(mill):
    group = mill.file["particles/trajectory"]
    mass, radius = group["mass"][0], 0.5 * group["diameter"][0]
    return len(group["mass"]), mass, radius, 0.4 * mass * radius**2


def sampling_error(mill, weight):
    """Most that frames at intervals of d can miss of the weight's mean moment: they take the centre of mass to
    move straight between them, and it falls off that by no more than g d^2 / 12 on average."""
    step = mill.file["particles/trajectory/position/time"][1]
    return weight * GRAVITY * step**2 / 12.0


def rotor_torque(mill):
    time, value = mill.series("rotor_torque")
    rows = mill.window(time)[1:]
    return value[rows].mean()


def rough(case, mill):
    """Friction at every surface: forces and torques from the paths."""
    count, mass, radius, inertia = properties(mill)
    weight = np.array([0.0, 0.0, count * mass * GRAVITY])
    paths = Paths(mill, radius, mass)
    paths.clear(mill)
    _, linear, angular, weight_torque = momentum(mill, mass, inertia)
    force, noise = (x / mill.duration for x in paths.sum(SURFACES, mill.begin, mill.end))
    error = np.hypot(noise[2], steady_error(linear[:, 2], mill.duration))
    case.claim(
        "vertical force of all surfaces, with friction, steady mean",
        force[2],
        weight[2],
        4.0 * error,
        against="weight of the balls",
        error=error,
        unit="N",
        headline=True,
    )
    change = (linear[-1] - linear[0]) / mill.duration
    case.bound(
        "force less weight less change of momentum, largest of x, y, z over its rounding",
        np.abs((force - weight - change) / noise).max(),
        4.0,
        against="momentum balance",
    )
    reactions = paths.reactions(mill.begin, mill.end)
    case.claim(
        "impulses of each two balls that meet: mean square of their sum over its rounding",
        (reactions**2).mean(),
        1.0,
        0.1,
        against="action = reaction: only rounding is left",
        error=(reactions**2).std() / np.sqrt(reactions.size),
    )
    rough_torques(case, mill, paths, angular, weight_torque, weight[2])


def rough_torques(case, mill, paths, angular, weight_torque, weight):
    arm = np.stack([0.0 * paths.time, -paths.place[:, 2], paths.place[:, 1]], axis=1)
    (rotor, rotor_noise), (still, still_noise) = (
        (total.sum() / mill.duration, np.hypot(*noise[1:]) / mill.duration)
        for total, noise in (paths.sum(k, mill.begin, mill.end, arm) for k in (ROTOR, STILL))
    )
    booked = rotor_torque(mill)
    case.claim(
        "torque of shaft and blades from the paths",
        rotor,
        booked,
        4.0 * rotor_noise,
        against="rotor_torque of the series",
        error=rotor_noise,
        unit="N m",
    )
    change = (angular[-1] - angular[0]) / mill.duration
    sampling = sampling_error(mill, weight)
    case.claim(
        "torque of drum and end walls from the paths",
        still,
        change - booked - weight_torque,
        4.0 * still_noise + sampling,
        against="change of angular momentum - torque of the rotor - moment of the weight",
        error=still_noise,
        unit="N m",
    )
    error = np.hypot(still_noise, steady_error(angular, mill.duration))
    case.claim(
        "torque of drum and end walls from the paths, steady mean",
        still,
        -booked - weight_torque,
        4.0 * error,
        against="- torque of the rotor - moment of the weight",
        error=error,
        unit="N m",
    )


# --- a mill with smooth surfaces, from the log ---------------------------------------------------------


def smooth(case, mill):
    """Without friction at the surfaces the log has their whole impulses."""
    count, mass, _, inertia = properties(mill)
    weight = np.array([0.0, 0.0, count * mass * GRAVITY])
    kind, place, normal, speed, time = mill.log(
        "kind", "position", "normal", "normal_speed", "time"
    )
    inside = (kind != 0) & (time >= mill.begin) & (time < mill.end)
    law = [float(mill.file["deck"][s][k].asstr()[()].split()[0]) for s, k in LAW]
    impulse = mass * (speed + np.maximum(law[0] * speed, law[1]))
    impulse = (impulse[:, None] * normal.astype(float))[inside]
    kind, place = kind[inside], place[inside].astype(float)
    moments = place[:, 1] * impulse[:, 2] - place[:, 2] * impulse[:, 1]
    force = impulse.sum(axis=0) / mill.duration
    frames, linear, angular, weight_torque = momentum(mill, mass, inertia)
    error = steady_error(linear[:, 2], mill.duration)
    case.claim(
        "vertical force of all surfaces, smooth, steady mean",
        force[2],
        weight[2],
        4.0 * error,
        against="weight of the balls",
        error=error,
        unit="N",
    )
    change = (linear[-1] - linear[0]) / mill.duration
    case.bound(
        "force less weight less change of momentum, over the weight",
        np.abs(force - weight - change).max() / weight[2],
        1e-7,
        against="momentum balance",
    )
    rotor = rotor_torque(mill)
    case.bound(
        "torque of shaft and blades from the log, off that of the series",
        moments[np.isin(kind, ROTOR)].sum() / mill.duration / rotor - 1.0,
        1e-8,
        against="rotor_torque of the series",
    )
    change = (angular[-1] - angular[0]) / mill.duration
    case.claim(
        "torque of the rotor, smooth drum, less change of angular momentum",
        rotor - change,
        -weight_torque,
        sampling_error(mill, weight[2]),
        against="- moment of the weight (from the frames)",
        unit="N m",
        headline=True,
    )
    error = steady_error(angular, mill.duration)
    case.claim(
        "torque of the rotor, smooth drum, steady mean",
        rotor,
        -weight_torque,
        4.0 * error,
        against="- moment of the weight (from the frames)",
        error=error,
        unit="N m",
    )
    bins = np.arange(mill.begin, mill.end + 1e-9, 0.05)
    blocks = [np.histogram(time[inside], bins, weights=impulse[:, 2])[0] / 0.05]
    blocks.append(np.histogram(time[inside], bins, weights=moments)[0] / 0.05)
    return bins[1:], blocks, weight[2], weight_torque


# --- an atmosphere of hard spheres -----------------------------------------------------------------------


def compressibility(phi):
    """Z of Carnahan and Starling."""
    return (1.0 + phi + phi**2 - phi**3) / (1.0 - phi) ** 3


def chemical_potential(phi):
    """mu/T of Carnahan and Starling, up to a constant."""
    return np.log(phi) + (8.0 * phi - 9.0 * phi**2 + 3.0 * phi**3) / (1.0 - phi) ** 3


class Atmosphere:
    """One run: the core's slices (bottom first), and pressures at its floor and its lid."""

    def __init__(self, mill, weight):
        self.count, self.mass, radius, _ = properties(mill)
        drum, length = (float(mill.file["deck/drum"][k].asstr()[()].split()[0]) for k in SIZE)
        self.area = np.pi * (CORE * drum) ** 2
        self.edges = np.linspace(0.0, length, SLICES + 1)
        self.ball = 4.0 / 3.0 * np.pi * radius**3
        self.weight = weight * self.mass  # of one ball [N]
        time, r, v = mill.frames("position", "velocity")
        core = np.hypot(r[..., 1], r[..., 2]) < CORE * drum
        height = r[core][:, 0] + 0.5 * length
        square = (v[core] ** 2).sum(axis=1)
        self.number = np.histogram(height, self.edges)[0] / len(time)
        energy = np.histogram(height, self.edges, weights=square)[0] / len(time)
        self.temperature = self.mass * energy / (3.0 * self.number)  # [J]
        self.mean_temperature = self.mass * (v**2).sum() / (3.0 * len(time) * self.count)
        self.walls(mill, drum)
        momentum = self.mass * v[..., 0].sum(axis=1)
        self.force_less_change = self.force - (momentum[-1] - momentum[0]) / mill.duration

    def walls(self, mill, drum):
        """The outermost cells of the axial map are thinner than a ball's radius: only wall contacts are in them."""
        speeds = mill.file["statistics/maps/axial/normal_speed_sum"][:]
        radii = mill.file["statistics/maps/axial/r_edges"][1:]
        inner = radii < CORE * drum * (1.0 + 1e-9)
        push = 2.0 * self.mass / mill.duration
        self.force = push * (speeds[0].sum() - speeds[-1].sum())
        self.floor = push * speeds[0][inner].sum() / self.area
        self.lid = push * speeds[-1][inner].sum() / self.area

    @property
    def packing(self):
        return self.number * self.ball / (self.area * np.diff(self.edges))

    @property
    def pressure(self):
        """In the middle of each slice: the lid's, and the weight of what is above."""
        above = self.number[::-1].cumsum()[::-1] - 0.5 * self.number
        return self.lid + above * self.weight / self.area

    def theory(self, part):
        """Packing of the slices of `part`: mu(phi) + m g h / T is the same everywhere; as many balls as counted."""
        phi = np.geomspace(1e-4, 0.5, 20000)
        fine = np.linspace(self.edges[part.start], self.edges[part.stop], 20 * len(part) + 1)
        fine = 0.5 * (fine[1:] + fine[:-1])
        wanted = self.packing[part.start : part.stop].sum()

        def slices(constant):
            level = constant - self.weight * fine / self.mean_temperature
            return np.interp(level, chemical_potential(phi), phi).reshape(len(part), 20).mean(1)

        constant = brentq(lambda c: slices(c).sum() - wanted, -5.0, 15.0, xtol=1e-10)
        return slices(constant)


def over_seeds(values):
    values = np.array(values)
    return values.mean(axis=0), values.std(axis=0, ddof=1) / np.sqrt(len(values))


def atmosphere(case):
    runs = []
    for seed in SEEDS:
        mill = Mill(case.run("column.ini", run__seed=seed))
        runs.append(Atmosphere(mill, ACCELERATION))
        mill.file.close()
    first = runs[0]
    weight = first.count * first.weight
    case.bound(
        "force of floor less lid less change of momentum, off the weight, worst run",
        max(abs(run.force_less_change / weight - 1.0) for run in runs),
        1e-8,
        against="weight of the balls",
    )
    step, error = over_seeds([run.floor - run.lid for run in runs])
    carried, carried_error = over_seeds([run.number.sum() * run.weight / run.area for run in runs])
    error = np.hypot(error, carried_error)
    case.claim(
        "pressure on the floor less that on the lid, in the core",
        step,
        carried,
        4.0 * error,
        against="weight of the core",
        error=error,
        unit="Pa",
    )
    third = SLICES // 3
    ratio, error = over_seeds(
        [
            np.average(run.temperature[:third], weights=run.number[:third])
            / np.average(run.temperature[-third:], weights=run.number[-third:])
            for run in runs
        ]
    )
    case.claim(
        "temperature of the lowest third over that of the uppermost",
        ratio,
        1.0,
        4.0 * error,
        against="equilibrium: equal",
        error=error,
    )
    state_equation(case, runs)
    return runs


def state_equation(case, runs):
    packing = np.mean([run.packing for run in runs], axis=0)
    for wanted in (0.25, 0.15, 0.07):
        k = INNER[np.argmin(np.abs(packing[INNER.start : INNER.stop] - wanted))]
        near = slice(k - 1, k + 2)
        values = [
            np.mean((run.pressure * run.ball / run.packing / run.mean_temperature)[near])
            / np.mean(compressibility(run.packing)[near])
            for run in runs
        ]
        ratio, error = over_seeds(values)
        case.claim(
            f"p/nT over that of theory, at a packing of {packing[near].mean():.3f}",
            ratio,
            1.0,
            0.005 + 4.0 * error,
            against="Carnahan and Starling 1969",
            error=error,
            headline=wanted == 0.25,
        )
    span = len(INNER)
    values = [
        np.log(run.packing[INNER.stop - 1] / run.packing[INNER.start])
        - np.log(run.theory(INNER)[span - 1] / run.theory(INNER)[0])
        for run in runs
    ]
    off, error = over_seeds(values)
    case.claim(
        "ln(packing at the top / at the bottom) less that of theory",
        off,
        0.0,
        0.01 + 4.0 * error,
        against="mu(phi) + m g h / T = const., Carnahan and Starling",
        error=error,
    )


# --- figures ---------------------------------------------------------------------------------------------


def draw_mills(case, mill, steady):
    time, work, loss, energy = mill
    figure, axes = plt.subplots(1, 3, figsize=(13, 4))
    ax = axes[0]
    since = time[50:] - time[0]
    off = (loss[50:] - loss[0] - work[50:] + work[0]) / since
    error = np.sqrt(2.0) * energy.std() / since
    ax.fill_between(since, -4.0 * error, 4.0 * error, color="0.85", label="4 standard errors")
    ax.plot(since, off, color="C0", lw=1, label="measured")
    ax.axhline(0.0, color="k", ls="--", lw=1, label="theory")
    ax.set(
        xlabel="length of the window [s]",
        ylabel="losses less power of the rotor [W]",
        title=f"reference mill, {np.ptp(work) / np.ptp(time):.0f} W",
    )
    ax.legend()
    bins, (force, moment), weight, weight_torque = steady
    for ax, values, level, text in (
        (axes[1], force, weight, "vertical force of all surfaces [N]"),
        (axes[2], 1e3 * moment, -1e3 * weight_torque, "torque of shaft and blades [mN m]"),
    ):
        mean = values.cumsum() / np.arange(1, len(values) + 1)
        ax.plot(bins - 0.025, values, ".", color="0.7", label="blocks of 50 ms")
        ax.plot(bins, mean, color="C0", label="mean from the begin on")
        ax.axhline(level, color="k", ls="--", lw=1)
        ax.set(xlabel="time [s]", ylabel=text, title="smooth mill")
    axes[1].plot([], [], "k--", lw=1, label=r"$N m g$")
    axes[2].plot([], [], "k--", lw=1, label=r"$N m g \langle y \rangle$, whole window")
    axes[1].legend(loc="lower right", fontsize=8)
    axes[2].legend(loc="upper right", fontsize=8)
    axes[2].set_ylim(-1.0, 33.0)
    figure.tight_layout()
    case.save(figure, "mills.png")
    plt.close(figure)


def draw_atmosphere(case, runs):
    figure, axes = plt.subplots(1, 2, figsize=(11, 4.2))
    middle = 500.0 * (runs[0].edges[1:] + runs[0].edges[:-1])
    packing, error = over_seeds([run.packing for run in runs])
    theory, _ = over_seeds([run.theory(INNER) for run in runs])
    inner = slice(INNER.start, INNER.stop)
    ax = axes[0]
    ax.errorbar(
        packing, middle, xerr=4.0 * error, fmt=".", color="C0", label="slices, 4 standard errors"
    )
    ax.plot(theory, middle[inner], "k-", lw=1, label="Carnahan-Starling")
    ax.set(xlabel="packing fraction", ylabel="height [mm]", title="core of the atmosphere")
    ax.legend()
    ax = axes[1]
    z = [run.pressure * run.ball / run.packing / run.mean_temperature for run in runs]
    off = [100.0 * (v / compressibility(run.packing) - 1.0) for v, run in zip(z, runs)]
    off, error = over_seeds(off)
    ax.errorbar(packing[inner], off[inner], 4.0 * error[inner], fmt=".", label="4 standard errors")
    ax.axhline(0.0, color="k", lw=1, label="Carnahan-Starling")
    ax.set(xlabel="packing fraction", ylabel="p / nT off theory [%]", title="equation of state")
    ax.legend()
    figure.tight_layout()
    case.save(figure, "atmosphere.png")
    plt.close(figure)


def check(case):
    reference = power(case, Mill(case.run()))
    rough(case, Mill(case.run("rough.ini"), margin=0.25))
    steady = smooth(case, Mill(case.run("smooth.ini")))
    draw_mills(case, reference, steady)
    draw_atmosphere(case, atmosphere(case))
