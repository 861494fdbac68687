"""What moves in a mill and how fast, in words, from the run's deck."""

import math

MINUS = "\N{MINUS SIGN}"


def rate(run, name: str) -> float:
    """Angular velocity of what turns about its axis [rad/s]; 0 of other motions."""
    if name == "rotor" and not run.has("deck/motion.rotor"):
        return run.rotor_speed
    return run.quantity(f"motion.{name}/speed", 0.0)


def speed(run, name: str) -> str:
    """Of a motion, as in "300 rpm", "20 Hz"."""
    place = f"motion.{name}"
    kind = run.text(f"{place}/kind", "turn")
    if kind == "turn":
        return f"{rate(run, name) * 30 / math.pi:.4g} rpm".replace("-", MINUS)
    if kind in ("swing", "shift"):
        return f"{run.quantity(f'{place}/frequency', 0.0):.4g} Hz"
    return "as measured"


def speeds(run) -> list[str]:
    """Of all motions: of a single one its speed alone, else "sun 300 rpm"."""
    names = run.motions
    return [speed(run, names[0])] if len(names) == 1 else [f"{n} {speed(run, n)}" for n in names]


def words(run, name: str) -> str:
    """How a motion goes, as in "turns at 300 rpm", "swings by 15 degrees at 20 Hz, on sun"."""
    place, rate = f"motion.{name}", speed(run, name)
    kind = run.text(f"{place}/kind", "turn")
    if kind == "swing":
        angle = math.degrees(run.quantity(f"{place}/amplitude", 0.0))
        said = f"swings by \N{PLUS-MINUS SIGN}{angle:.4g}\N{DEGREE SIGN} at {rate}"
    elif kind == "shift":
        amplitude = run.vector(f"{place}/amplitude") if run.has(f"deck/{place}/amplitude") else []
        some = sorted({abs(v) for v in amplitude if v}, reverse=True) or [0.0]  # [m]
        said = f"goes \N{PLUS-MINUS SIGN}{' and '.join(f'{1e3 * v:.4g}' for v in some)} mm to and fro at {rate}"
    else:
        said = f"turns at {rate}" if kind == "turn" else "moves as a table says"
    carrier = run.text(f"{place}/on", "")
    return said + (f" on {carrier}" if carrier else "")
