"""What a reader of the numbers ought to know: the rules of the simulator's summary (docs/file-format.md, "The summary as
JSON"), told from the file, for a report has no simulation at hand."""

import math

import numpy as np

from milltools.kinds import KINDS
from milltools.runfile import KIND_LABEL

FEW_ROTOR_CONTACTS = 5e-3  # of all, in the last tenth of the window
TURNING = 0.9  # of the kinetic energy
UNSTEADY = 0.05
INELASTIC = 0.6
FLOORED = 0.3


def _law(run, kind, name):
    """A number of a kind's contact law."""
    own = f"contact.{kind}/{name}"
    return run.quantity(own if run.has(f"deck/{own}") else f"contact/{name}", 0.0)


def _late_contacts(run) -> tuple[float, float]:
    """Contacts in the last tenth of the window: (all, those of shaft and blades)."""
    first, last = run.window
    since, total = last - (last - first) / 10, {}
    for kind in KINDS:
        time, value = run.series(f"collisions/{kind}")
        total[kind] = float(np.diff(np.interp([since, last], time, value))[0]) if len(time) else 0.0
    return sum(total.values()), total["ball_shaft"] + total["ball_blade"]


def ring_speed(run) -> float:
    """Angular speed of the ring that the charge has become [rad/s]; 0 when it has not, or nothing stored tells."""
    times = run.frame_times()
    if not run.rotor_speed or not len(times) or not run.has_series("collisions/ball_ball"):
        return 0.0
    mass = run.balls("mass")
    everything, rotor = _late_contacts(run)
    if everything < len(mass) or rotor > FEW_ROTOR_CONTACTS * everything:
        return 0.0
    place, velocity = (run.frame(-1, n).astype(float) for n in ("position", "velocity"))
    inertia = float(mass @ (place[:, 1] ** 2 + place[:, 2] ** 2))
    momentum = float(mass @ (place[:, 1] * velocity[:, 2] - place[:, 2] * velocity[:, 1]))
    kinetic = float(mass @ (velocity**2).sum(axis=1)) / 2
    if not inertia > 0:
        return 0.0
    speed = momentum / inertia
    gravity = math.hypot(*run.vector("gravity/acceleration")[1:3])
    turning = speed != 0 and momentum * speed / 2 >= TURNING * kinetic
    return speed if turning and speed**2 * math.sqrt(inertia / mass.sum()) > gravity else 0.0


def _unsteady(run) -> bool:
    if not run.rotor_speed or not run.has("statistics/rotor/power"):
        return False
    power = float(run.statistic("rotor/power"))
    dissipated = float(run.statistic("impacts/all/dissipated_power"))
    return abs(power - dissipated) > UNSTEADY * max(abs(power), abs(dissipated))


def _motion(run) -> list[str]:
    ring = ring_speed(run)
    if ring:
        share = 100 * ring / run.rotor_speed
        smooth = (
            "" if _law(run, "ball_drum", "friction") > 0
            else ": nothing brakes the balls in a smooth drum without friction"
        )  # fmt: skip
        return [
            f"The charge has come off the rotor and turns as a ring, at {share:.0f} % of the rotor's speed{smooth}."
        ]
    if _unsteady(run):
        return [
            "Not steady: the rotor's power and the dissipated power differ by more than 5 % over the sampled window. "
            "Sample later or for longer."
        ]
    return []


def _hard_spheres(run) -> list[str]:
    """What only concerns hard spheres: their law, their floor, pinched balls."""
    found = []
    for kind in KINDS:
        met = run.has(f"run/events/collisions/{kind}") and run.read(f"run/events/collisions/{kind}")
        restitution = _law(run, kind, "restitution")
        if met and _law(run, kind, "friction") > 0 and restitution <= INELASTIC:
            found.append(
                f"{KIND_LABEL[kind].capitalize()} contacts have friction and a restitution of {restitution:.3g}: hard spheres are "
                "meant for 0.7 and more; in dense beds below that their power no longer agrees with soft spheres."
            )
            break
    reliefs = int(run.read("run/reliefs")) if run.has("run/reliefs") else 0
    if reliefs:
        times = "once" if reliefs == 1 else f"{reliefs} times"
        found.append(
            f"Pinched balls were let go {times}. The thousands of contacts before each spoil counts and "
            "medians (strikes less); wider gaps around the blades help, though chains of balls may still be pressed."
        )
    floored = (
        float(run.statistic("floor_share/ball_ball")) if run.has("statistics/floor_share") else 0
    )
    if floored > FLOORED:
        found.append(
            f"{100 * floored:.0f} % of the ball-ball contacts are at the rebound floor: medians over all contacts depend on it; "
            "rather use those above 50 mm/s."
        )
    return found


def how_far(run) -> list[str]:
    """What is not there because the run has not come to its end."""
    until = f"{run.time:.6g} s of {run.quantity('run/time', math.nan):.6g} s"
    if run.status == "stopped":
        found = [f"Stopped at {until}; the file holds everything up to then."]
    elif run.status == "failed":
        found = [
            f"The run failed, at {until}; the file holds everything up to its last checkpoint."
        ]
    elif run.status == "running" and run.time == 0:
        found = [
            "The run has not come to its first checkpoint: the file holds its deck and nothing else. If it is not running any "
            "more, it has to be started again."
        ]
    elif run.status == "running":
        found = [
            f"The run is not complete: this is what the file held at its last checkpoint, at {until}. If it is not running "
            "any more, --resume goes on from there."
        ]
    else:
        found = []
    if run.has_statistics and not run.duration > 0:
        begin = run.quantity("run/sample_from", 0.0)
        found.append(
            f"Nothing was sampled: the run has not got beyond run.sample_from = {begin:.6g} s."
        )
    return found


def notes(run) -> list[str]:
    """Sentences, the weightiest first; empty if there is nothing to warn of."""
    found = how_far(run)
    if run.has_statistics and run.duration > 0:
        found += _motion(run)
        if run.program == "millsim":
            found += _hard_spheres(run)
    if run.has("run/notes"):
        found += [line for line in run.read("run/notes").splitlines() if line.strip()]
    return found
