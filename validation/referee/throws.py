"""Single impacts on the surfaces of the mills: LAMMPS and soft millsim against the closed form (Walton)."""

import numpy as np
from comparison import DECKS
from lammps_run import EVERY, Mill
from script import write

from milltools.base.engine import version

STIFF = 1e12  # [Pa] five times that of steel: surfaces hardly move during an impact
SPEED = "3 m/s"
LASTS = 1.7  # [contacts] until the states are compared
# deck, overrides, throws
THROWS = {"planetary": 12, "emax": 12, "mixer": 16, "vibratory": 8, "attritor": 24, "discs": 24, "wavy": 24}


def closed(course, law, radius, time, place, normal, velocity, spin):
    """(change of velocity, of spin) of a ball by an impact; velocity, spin: just before it."""
    at, moves, _, matrix = course.moving(time)
    slip = velocity - np.cross(spin, radius * normal) - moves - (place - at) @ matrix
    across = slip - (slip @ normal) * normal
    push = -(1 + law.restitution) * (slip @ normal)
    size = np.linalg.norm(across)
    drag = min(2 / 7 * (1 + law.tangential_restitution) * size, law.friction * push)
    along = -drag * across / size if size > 0 else 0 * across
    return push * normal + along, np.cross(-radius * normal, along) / (0.4 * radius**2)


def throw(runner, name, seed):
    """{kind, of each program: (error of the velocity, of the spin) after the first impact}; None: another impact is too
    near, or there is none."""
    path, sets = DECKS[name]
    sets = [*sets, f"run.seed={seed}", "balls.count=1", f"balls.speed={SPEED}", "run.sample_from=0 s"]
    hard = runner.millsim(path, [*sets, "run.time=20 ms", "output.impacts=all", "output.frames=0 s"])
    with hard as run:
        if run.length("impacts/time") == 0:
            return None
        log = {key: run.read(f"impacts/{key}") for key in ("time", "kind", "position", "normal", "normal_speed")}
        kind = run.kinds[log["kind"][0]]
    time = log["time"][0]
    probe = runner.soft(path, [*sets, "run.time=1 ms", "output.frames=0 s"], STIFF)
    with probe as run:
        speed, step, lasts = (float(run.read(f"run/soft/{k}")) for k in ("speed", "time_step", "contact_duration"))
    end = time + LASTS * lasts
    if len(log["time"]) > 1 and log["time"][1] < end + lasts:
        return None
    deck = runner.deck(path, sets)
    start = deck.start()
    made = write(deck, start, STIFF, speed, step)
    radius, gravity = made.radius, np.array(deck.numbers("gravity.acceleration"))
    course = next(wall.course for wall in made.walls if wall.kind == kind)
    place, normal = log["position"][0].astype(float), log["normal"][0].astype(float)
    before = start[1][0] + gravity * time
    change, twist = closed(course, deck.contact(kind), radius, time, place, normal, before, start[2][0])
    steps = round(end / step)

    def errors(velocity, spin, at):
        off = velocity - start[1][0] - gravity * at - change
        return np.linalg.norm(off) / np.linalg.norm(change), np.linalg.norm(spin - start[2][0] - twist) * radius / (
            np.linalg.norm(change)
        )

    found = {"kind": kind}
    for law in ("limited", "attracting"):
        mill = Mill(write(deck, start, STIFF, speed, step, law))
        pieces = steps // EVERY if mill.caps else 1  # a ball may come to the end of a capsule
        for _ in range(pieces):
            mill.step(steps // pieces)
        mill.step(steps % pieces)
        found[law] = errors(mill.speed[0].copy(), mill.spin[0].copy(), steps * step)
        mill.close()
    with runner.soft(path, [*sets, f"run.time={end:.17g} s", f"output.frames={end:.17g} s"], STIFF) as run:
        last = len(run.frame_times()) - 1
        found["soft"] = errors(run.frame(last)[0], run.frame(last, "angular_velocity")[0], run.frame_times()[last])
    return found


def table(runner):
    """The lines of a table."""
    lines = [
        "| deck | surface | throws | LAMMPS, limited | LAMMPS, attracting | soft millsim |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    for name, count in THROWS.items():
        thrown = runner.kept(
            f"impacts {name}",
            repr((version(), count, STIFF, DECKS[name])),
            lambda n=name, many=count: [throw(runner, n, seed) for seed in range(1, many + 1)],
        )
        found = [one for one in thrown if one]
        for kind in sorted({one["kind"] for one in found}):
            own = [one for one in found if one["kind"] == kind]
            cells = []
            for program in ("limited", "attracting", "soft"):
                errors = 100 * np.array([one[program] for one in own])
                median, most = np.median(errors, axis=0), errors.max(axis=0)
                cells.append(f"{median[0]:.2f}, {median[1]:.2f} (at most {most[0]:.1f}, {most[1]:.1f})")
            lines.append(f"| {name} | {kind.removeprefix('ball_')} | {len(own)} | {' | '.join(cells)} |")
        runner.say(f"single impacts: {name}")
    return lines
