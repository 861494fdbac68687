"""Single impacts: balls thrown at a wall and at each other at 20 angles, in LIGGGHTS, in millsim and in theory."""

import matplotlib.pyplot as plt
import numpy as np
from law import impact as law_of_liggghts
from runs import LABELS, ROOT, STIFFNESSES, say

from milltools.dem import model as dem_model
from milltools.dem import singles
from milltools.dem.model import STEEL, Model, sticking_restitution, tangential_damping
from milltools.read.deck import Deck
from milltools.read.runfile import Run

DECK = ROOT / "input" / "simoloyer.ini"
KINDS = {"ball_ball": "pair", "ball_wall": "wall"}
RESTITUTIONS = (0.5, 0.6, 0.7, 0.8, 0.9)
STEPS = (10, 20, 40, 80, 160)  # a contact, for what the time step does
PLACES = {"ball_ball": "at each other", "ball_wall": "at a wall"}

# The balls of one throw in millsim: along the end wall x = -L/2, or one behind the other's target
THROWN = """\
[run]
time = {time} s
[gravity]
acceleration = 0 0 0 m/s^2
[balls]
count = {count}
diameter = {diameter} m
density = {density} kg/m^3
start = {start}
[drum]
radius = 0.5 m
length = 1 m
[contact]
restitution = {e}
friction = {mu}
tangential_restitution = {beta}
rebound_floor = 1e-9 m/s
[output]
frames = {time} s
series = {time} s
impacts = all
"""


def walton(ratio, e, mu, beta):
    """Slip after over normal speed before, by slip over normal speed before (Walton 1993; solid spheres)."""
    return np.maximum(-beta * ratio, ratio - 3.5 * mu * (1 + e))


def throw_hard(case, deck, kind, ratio):
    """The same throw in millsim: (restitution (A,), slip after over normal speed before (A,))."""
    species, law = deck.species[0], deck.contact(kind)
    d, speed = species.diameter, singles.SPEED
    pairs, count = kind == "ball_ball", len(ratio)
    gap = singles.GAP * d
    place = np.zeros((count, 3))
    place[:, 1] = 4 * d * (np.arange(count) - count / 2) - ratio * gap
    place[:, 0] = (d + gap) if pairs else (d / 2 + gap - 0.5)
    velocity = np.column_stack([np.full(count, -speed), ratio * speed, 0 * ratio])
    rows = [np.hstack([place, velocity])]
    if pairs:
        target = np.zeros((count, 6))
        target[:, 1] = place[:, 1] + ratio * gap
        rows.append(target)
    rows = np.vstack(rows)
    start = case.write(f"{kind}.txt", "\n".join(" ".join(map(repr, map(float, r))) for r in rows))
    text = THROWN.format(
        time=2 * gap / speed,
        count=len(rows),
        diameter=d,
        density=species.density,
        start=start.name,
        e=law.restitution,
        mu=law.friction,
        beta=law.tangential_restitution,
    )
    with Run(case.run(case.write(f"{kind}.ini", text))) as run:
        after, spin = (run.frame(-1, name).astype(float) for name in ("velocity", "angular_velocity"))
        impacts = len(run.read("impacts/time"))
    if impacts != count:
        raise RuntimeError(f"{kind}: {impacts} impacts of {count} balls thrown in millsim")
    moving, turning = after[:count], spin[:count] * d / 2
    if pairs:
        moving, turning = moving - after[count:], turning + spin[count:] * d / 2
    normal = np.array([1.0, 0.0, 0.0])
    slip = (moving - np.cross(turning, normal))[:, 1]
    return moving[:, 0] / speed, slip / speed


def throws(deck, modulus, kind):
    """What LIGGGHTS makes of it: milltools.dem.singles.Singles."""
    return singles.throw(deck, Model(deck, modulus), tangential_damping(deck)[0], kind)


def check(case):
    say("    single impacts at 20 angles")
    deck = Deck.check(DECK)
    curves = {}
    for kind in KINDS:
        hard = throw_hard(case, deck, kind, singles.ANGLES)
        claim_hard(case, deck, kind, *hard)
        for name, modulus in STIFFNESSES.items():
            curves[kind, name] = soft = throws(deck, modulus, kind)
            claim_soft(case, deck, kind, name, soft)
    by_restitution = sweep_restitution(case)
    by_step = sweep_step(case, deck)
    draw(case, deck, curves, by_restitution, by_step)


def claim_hard(case, deck, kind, e, after):
    law = deck.contact(kind)
    expected = walton(singles.ANGLES, law.restitution, law.friction, law.tangential_restitution)
    off = np.maximum(np.abs(e - law.restitution), np.abs(after - expected))
    case.bound(
        f"millsim, balls thrown {PLACES[kind]}, {len(e)} angles: restitution and slip after the impact, largest error",
        off.max(),
        1e-5,
        against="contact law of the deck (Walton 1993); velocities are stored in single precision",
    )


def claim_soft(case, deck, kind, name, soft):
    law = deck.contact(kind)
    where = f"LIGGGHTS at {LABELS[name]}, balls thrown {PLACES[kind]}"
    error = soft.spread / np.sqrt(len(soft.ratio))
    case.claim(
        f"{where}: restitution",
        soft.restitution,
        law.restitution,
        0.01 * law.restitution,
        error=error,
        against="restitution of the deck",
        headline=name == "steel" and kind == "ball_ball",
    )
    own = walton(soft.ratio, law.restitution, law.friction, law.tangential_restitution)
    effective = walton(soft.ratio, soft.restitution, soft.friction, soft.tangential_restitution)
    claim_law(case, deck, kind, STIFFNESSES[name], soft, where)
    case.claim(
        f"{where}: effective tangential restitution",
        soft.tangential_restitution,
        sticking_restitution(law.restitution),
        0.015,
        against="damped oscillators in normal and tangential direction, closed form",
    )
    case.tell(
        f"{where}: effective friction {soft.friction:.4f} and tangential restitution "
        f"{soft.tangential_restitution:.4f}. The slip after the impact deviates from Walton's law by "
        f"{off(soft.after, effective, own):.1f} % (rms) with these values, and by {off(soft.after, own, own):.1f} % "
        f"with the deck's {law.friction} and {law.tangential_restitution}."
    )


def off(one, other, scale):
    """Root mean square of a difference [%] of that of `scale`."""
    return 100 * np.sqrt(((one - other) ** 2).mean() / (scale**2).mean())


def claim_law(case, deck, kind, modulus, soft, where):
    """LIGGGHTS does what its contact law says at this time step, whatever that is in terms of Walton's."""
    model = Model(deck, modulus)
    spring = model.pair[0][0] if kind == "ball_ball" else model.wall[kind][0]
    count = np.arange(len(soft.ratio))
    gap = singles.GAP * deck.species[0].diameter * (1 + count / (7.1 * len(count)))
    law = deck.contact(kind)
    _, after = law_of_liggghts(spring, law.friction, soft.ratio, gap, singles.SPEED, model.time_step)
    case.bound(
        f"{where}: slip after the impact, rms deviation from the contact law of LIGGGHTS",
        off(soft.after, after, after),
        1,
        against="spring, dashpot and cap integrated with the same time step",
        unit="%",
    )


def sweep_restitution(case):
    """Effective friction and tangential restitution of pairs at steel, by restitution."""
    found, misfit = [], {}
    for e in RESTITUTIONS:
        deck = Deck.check(DECK, [f"contact.restitution={e}"])
        soft = throws(deck, STEEL, "ball_ball")
        where = f"LIGGGHTS at steel, balls thrown at each other, restitution {e}"
        claim_law(case, deck, "ball_ball", STEEL, soft, where)
        found.append((e, soft.restitution, soft.friction, soft.tangential_restitution))
        own = walton(soft.ratio, *found[-1][1:])
        misfit[e] = off(soft.after, own, soft.after)
    values = {e: mu for e, _, mu, _ in found}
    deck_mu = Deck.check(DECK).contact("ball_ball").friction
    case.claim(
        "LIGGGHTS at steel, restitution 0.8, friction 0.3: ratio of the effective friction of two balls to the deck's",
        values[0.8] / deck_mu,
        1,
        0.08,
        against="0.314 to 0.323 for 0.3, measured earlier with another program",
        headline=True,
    )
    case.tell(
        "Effective friction of two balls at steel, where the friction of the deck is "
        f"{deck_mu}: " + ", ".join(f"{mu:.3f} at e = {e}" for e, mu in values.items()) + "."
    )
    case.tell(
        "Slip after the impact in LIGGGHTS, rms deviation from Walton's law with the effective friction and tangential "
        "restitution of LIGGGHTS: " + ", ".join(f"{v:.1f} % at e = {e}" for e, v in misfit.items()) + "."
    )
    return found


def sweep_step(case, deck):
    """Restitution and friction of pairs at steel, by steps a contact."""
    usual, found = dem_model.STEPS_PER_CONTACT, []
    try:
        for steps in STEPS:
            dem_model.STEPS_PER_CONTACT = steps
            soft = throws(deck, STEEL, "ball_ball")
            found.append((steps, soft.restitution, soft.friction, soft.tangential_restitution))
    finally:
        dem_model.STEPS_PER_CONTACT = usual
    case.tell(
        "Restitution and effective friction of two balls at steel, by the number of time steps per contact: "
        + "; ".join(f"{n} steps: {e:.4f} and {mu:.4f}" for n, e, mu, _ in found)
        + f". All other runs have {usual} steps per contact."
    )
    return found


def draw(case, deck, curves, by_restitution, by_step):
    figure, (left, middle, right) = plt.subplots(1, 3, figsize=(14, 4.6), layout="constrained")
    law = deck.contact("ball_ball")
    soft = curves["ball_ball", "steel"]
    ratio = np.linspace(0, soft.ratio.max() * 1.03, 400)
    lines = (
        ("the deck: 0.3, 0.484", law, "-"),
        (
            f"effective in LIGGGHTS: {soft.friction:.3f}, {soft.tangential_restitution:.3f}",
            law._replace(friction=soft.friction, tangential_restitution=soft.tangential_restitution),
            "--",
        ),
    )
    for label, it, style in lines:
        after = walton(ratio, it.restitution, it.friction, it.tangential_restitution)
        left.plot(ratio, after, style, color="k", lw=1, label=f"Walton, {label}")
    for (kind, name), marker in (
        (("ball_ball", "1e9"), "o"),
        (("ball_ball", "steel"), "x"),
        (("ball_wall", "steel"), "+"),
    ):
        soft = curves[kind, name]
        label = f"LIGGGHTS, {LABELS[name]}, {KINDS[kind]}"
        left.plot(soft.ratio, soft.after, marker, ms=6, mfc="none", label=label)
    left.set(
        xlabel="slip before / normal speed before [1]",
        ylabel="slip after / normal speed before [1]",
        title="Oblique impacts, e = 0.8",
    )
    e, _, mu, beta = np.array(by_restitution).T
    middle.plot(e, mu, "o-", label="friction")
    middle.plot(e, beta, "s-", label="tangential restitution")
    middle.axhline(law.friction, color="C0", ls=":", label="friction of the deck")
    middle.set(xlabel="restitution [1]", ylabel="effective value [1]", title="Two balls in LIGGGHTS, steel")
    steps, e, mu, _ = np.array(by_step).T
    right.plot(steps, 100 * (e / law.restitution - 1), "o-", label="restitution")
    right.plot(steps, 100 * (mu / law.friction - 1), "s-", label="friction")
    right.axvline(dem_model.STEPS_PER_CONTACT, color="grey", lw=0.8)
    right.axhline(0, color="k", lw=0.8)
    right.set(
        xscale="log",
        xlabel="time steps per contact [1]",
        ylabel="deviation from the deck [%]",
        title="Effect of the time step, steel, e = 0.8",
    )
    right.set_xticks(STEPS, [str(n) for n in STEPS])
    right.set_xticks([], minor=True)
    for axis in (left, middle, right):
        axis.grid(alpha=0.3)
        axis.legend(fontsize=8)
    case.save(figure, "impacts.png")
    plt.close(figure)
