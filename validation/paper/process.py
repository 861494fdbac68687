"""The main process parameters of the reference mill: what rotor speed, filling, ball size and restitution do to impacts and power."""

import numpy as np
from studies import MEDIAN, ROOT

MAIN = "Rotor speed, filling, size and restitution of the balls are main process parameters"
STUDY = ROOT / "input" / "process.study"
# Of the deck's 128 designs, each cut off at 2e7 contacts: an eighth of the time, and the exponents are known well enough
SAMPLES, CONTACTS = 32, 8e6
POWER = "rotor/power"
KEYS = {
    "rotor.speed": "rotor speed",
    "balls.fill": "filling",
    "balls.diameter": "ball diameter",
    "contact.restitution": "1 - restitution^2",
}
WANTED = {MEDIAN: "median impact speed", POWER: "rotor power"}


def exponents(table, wanted):
    """{key: (exponent, its standard error)} of a power law through all designs, and its R^2."""
    x = table[list(KEYS)].to_numpy(float)
    x[:, -1] = 1 - x[:, -1] ** 2
    x = np.log(x)
    x = np.column_stack([x - x.mean(axis=0), np.ones(len(x))])
    y = np.log(table[wanted].to_numpy())
    found, _, _, _ = np.linalg.lstsq(x, y, rcond=None)
    off = y - x @ found
    variance = off @ off / (len(y) - x.shape[1]) * np.linalg.inv(x.T @ x)
    errors = np.sqrt(np.diag(variance))
    return dict(zip(KEYS, zip(found, errors))), 1 - off.var() / y.var()


def check(case):
    table, _ = case.study(
        "process",
        "sweep",
        "--no-picture",
        "--set",
        f"study.samples={SAMPLES}",
        "--set",
        f"study.max_collisions={CONTACTS:g}",
        file=STUDY,
    )
    done = table[table.status == "done"]
    for wanted, name in WANTED.items():
        found, explained = exponents(done, wanted)
        for key, words in KEYS.items():
            value, error = found[key]
            case.ask(
                MAIN, f"{name} goes with {words} to the power of {value:.2f}: distance from none", abs(value),
                above=0, error=error, headline=key == "rotor.speed",
            )  # fmt: skip
        case.tell(
            f"{name.capitalize()}: {', '.join(f'{words}^{found[key][0]:.2f}' for key, words in KEYS.items())}; this law leaves "
            f"{100 * (1 - explained):.1f} % of the variance of the logarithm."
        )
    pinched = int(table.message.fillna("").str.contains("pinched").sum())
    case.tell(
        f"{len(table)} designs by Sobol's sequence, {len(done)} of them known to 2 % and in the law, {pinched} spoilt by pinched balls, the others cut off at {CONTACTS:.0e} contacts; "
        f"{table.cpu.sum():.0f} CPU s. The deck asks for 128 designs and 2e7 contacts. "
        f"Ranges: {', '.join(f'{words} {table[key].min():.3g} to {table[key].max():.3g}' for key, words in KEYS.items() if words[0] != '1')} (SI)."
    )
    for kind in ("contour", "slices", "sensitivity"):
        case.picture("process", kind, f"process-{kind}.png")
