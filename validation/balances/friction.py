"""Forces and torques of a mill with friction, from the balls' paths."""

import numpy as np
from balances.common import (
    GRAVITY,
    ROTOR,
    STILL,
    SURFACES,
    claim_weight,
    momentum,
    properties,
    rotor_torque,
    sampling_error,
    steady_error,
)

SOON = 2e-5  # [s] impacts of one ball closer than this: its velocity between them is not used
JAM = 1e-9  # [s] closer than this is a chain of balls being squeezed


class Paths:
    """Impulses found again from where and when each ball was struck.

    Between two impacts a ball flies on a parabola, so their places and times give its velocity after the one and
    before the other. The log's places are single precision, which spoils velocities over short times: impacts of
    balls that follow one on a surface within SOON are counted with it, on both their balls; their sum is zero.
    """

    def __init__(self, mill, radius, mass):
        time, kind, ball, partner, place, normal = mill.log("time", "kind", "ball", "partner", "position", "normal")
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


def rough(case, mill):
    """Friction at every surface: forces and torques from the paths."""
    count, mass, radius, inertia = properties(mill)
    weight = np.array([0.0, 0.0, count * mass * GRAVITY])
    paths = Paths(mill, radius, mass)
    paths.clear(mill)
    _, linear, angular, weight_torque = momentum(mill, mass, inertia)
    force, noise = (x / mill.duration for x in paths.sum(SURFACES, mill.begin, mill.end))
    error = np.hypot(noise[2], steady_error(linear[:, 2], mill.duration))
    claim_weight(case, "mill with friction", force[2], weight[2], error, headline=True)
    change = (linear[-1] - linear[0]) / mill.duration
    case.bound(
        "force minus weight minus change of momentum: largest ratio of a component to its rounding error",
        np.abs((force - weight - change) / noise).max(),
        4.0,
        against="momentum balance",
    )
    reactions = paths.reactions(mill.begin, mill.end)
    case.claim(
        "contacts of two balls: mean square of the sum of the two impulses divided by its rounding error",
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
        "torque of shaft and blades, computed from the paths of the balls",
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
        "torque of drum and end walls, computed from the paths of the balls",
        still,
        change - booked - weight_torque,
        4.0 * still_noise + sampling,
        against="change of angular momentum - torque of the rotor - moment of the weight",
        error=still_noise,
        unit="N m",
    )
    error = np.hypot(still_noise, steady_error(angular, mill.duration))
    case.claim(
        "torque of drum and end walls, computed from the paths of the balls, steady mean",
        still,
        -booked - weight_torque,
        4.0 * error,
        against="- torque of the rotor - moment of the weight",
        error=error,
        unit="N m",
    )
