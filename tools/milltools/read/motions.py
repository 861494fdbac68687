"""Describes the motions of a mill and their speeds in words, from the deck of a run."""

import math

MINUS = "\N{MINUS SIGN}"


def rate(run, name: str) -> float:
    """Angular velocity of a motion of kind "turn" [rad/s]; 0 for other motions."""
    if name == "rotor" and not run.has("deck/motion.rotor"):
        return run.rotor_speed
    return run.quantity(f"motion.{name}/speed", 0.0)


def speed(run, name: str) -> str:
    """The speed of a motion, such as "300 rpm", "20 Hz"."""
    place = f"motion.{name}"
    kind = run.text(f"{place}/kind", "turn")
    if kind == "turn":
        return f"{rate(run, name) * 30 / math.pi:.4g} rpm".replace("-", MINUS)
    if kind in ("swing", "shift"):
        return f"{run.quantity(f'{place}/frequency', 0.0):.4g} Hz"
    return "as measured"


def speeds(run) -> list[str]:
    """The speeds of all motions, with their names if there are several: "sun 300 rpm"."""
    names = run.motions
    return [speed(run, names[0])] if len(names) == 1 else [f"{n} {speed(run, n)}" for n in names]


def words(run, name: str) -> str:
    """Describes a motion, such as "turns at 300 rpm", "swings by 15 degrees at 20 Hz on sun"."""
    place, rate = f"motion.{name}", speed(run, name)
    kind = run.text(f"{place}/kind", "turn")
    if kind == "swing":
        angle = math.degrees(run.quantity(f"{place}/amplitude", 0.0))
        said = f"swings by \N{PLUS-MINUS SIGN}{angle:.4g}\N{DEGREE SIGN} at {rate}"
    elif kind == "shift":
        amplitude = run.vector(f"{place}/amplitude") if run.has(f"deck/{place}/amplitude") else []
        some = sorted({abs(v) for v in amplitude if v}, reverse=True) or [0.0]  # [m]
        said = f"moves \N{PLUS-MINUS SIGN}{' and '.join(f'{1e3 * v:.4g}' for v in some)} mm to and fro at {rate}"
    else:
        said = f"turns at {rate}" if kind == "turn" else "moves as given by a table"
    carrier = run.text(f"{place}/on", "")
    return said + (f" on {carrier}" if carrier else "")
