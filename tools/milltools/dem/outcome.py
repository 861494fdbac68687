"""What `mill dem` tells of a run: the facts in its file's /run, and the text at its end."""

import math
import shlex
import textwrap
import time

from milltools.base import engine
from milltools.read.runfile import Run

SINGLES = {
    "restitution": "normal restitution",
    "friction": "friction of sliding contacts",
    "tangential_restitution": "tangential restitution of sticking contacts",
}
ISOLATED = "loss of the impacts, as if each were alone, over the loss in the dashpots, summed over samples"


def facts(job, mill):
    """What goes into /run, as milltools.foreign.digest takes it, of a Job of milltools.dem.command and its SoftMill."""
    model, price = job.model, "processor seconds of LIGGGHTS for one simulated second at `modulus`, without output"
    found = {
        "notes": "\n".join(job.cautions + job.softness()),
        "program": "LIGGGHTS",
        "version": mill.version,
        "command": shlex.join(job.arguments.words),
        "started": job.started,
        "wall_time": time.monotonic() - job.begin,
        "cpu_time": mill.cpu,
        "largest_overlap": mill.deepest,
        "tools": (engine.version(), "", "version of millsim's tools that drove it"),
        "price": (job.price, "1", price),
        "modulus": (job.modulus, "Pa", "Young's modulus of all bodies"),
        "warm_up_modulus": (job.soft or job.modulus, "Pa", "Young's modulus up to warm_up_time"),
        "warm_up_time": (job.soft_until, "s", "end of the softer warm-up"),
        "time_step": (model.time_step, "s", "time step at `modulus`"),
        "sample_interval": (model.sample_interval, "s", "interval at which contacts were looked at"),
        "contact_duration": (model.pair[0][0].duration, "s", "of two balls of the first kind at `modulus`"),
        "ranks": (job.arguments.ranks, "1", "processes of LIGGGHTS"),
    }
    if not mill.rubs and mill.turnover:
        found["energy_turnover"] = mill.turnover
        found["energy_balance_error"] = abs(mill.unbalanced) / mill.turnover
    for kind, isolated, lost in zip(job.deck.kinds, mill.isolated_loss, mill.normal_loss, strict=True):
        found[f"isolated_share/{kind}"] = (isolated / lost if lost else math.nan, "1", ISOLATED)
    for kind, law in job.measured.items():
        for name, meaning in SINGLES.items():
            text = f"{meaning} of single impacts in LIGGGHTS at this stiffness and time step"
            found[f"measured/{kind}/{name}"] = (getattr(law, name), "1", text)
    return found


def _number(value):
    return f"{value:.4g}" if math.isfinite(value) else "-"


def summarize(path, deck, measured):
    """The results in the file at `path` as a text, in the manner of millsim's own summary; measured: {kind: Singles}."""
    with Run(path) as run:
        read, window = run.read, run.duration
        until = read("run/warm_up_time")
        warm = f", after {until * 1e3:.4g} ms at {read('run/warm_up_modulus'):.3g} Pa" if until > 0 else ""
        sampled = f"sampled for {window * 1e3:.4g} ms"
        if not window > 0:
            sampled = f"nothing sampled: it ended at {run.time * 1e3:.4g} ms, before run.sample_from"
        lines = [
            "",
            f"{sampled}; LIGGGHTS, E = {read('run/modulus'):.3g} Pa{warm}",
            "",
            "                                       median v_n  median v_n    mean v_n   dissipated",
            "                                           of all   > 50 mm/s      of all        power",
            "kind           contacts     rate [/s]       [m/s]       [m/s]       [m/s]          [W]",
        ]
        speeds = [f"normal_speed/{name}" for name in ("median", "median_above_50mm_s", "mean")]
        columns = [("rate", 14), *((name, 12) for name in speeds), ("dissipated_power", 13)]
        for kind in (*run.kinds, "all"):
            row = f"statistics/impacts/{kind}"
            cells = "".join(f"{_number(read(f'{row}/{name}')):>{width}}" for name, width in columns)
            lines.append(f"{kind:<12}{read(f'{row}/count'):>11}{cells}")
        drive = run.driven or "rotor"
        error = read(f"statistics/{drive}/power_error")
        blocks = f" ({int(read('statistics/rotor/blocks'))} blocks)" if drive == "rotor" else ""
        error = f"+- {_number(error)} W{blocks}" if math.isfinite(error) else "(no error: too short)"
        lines += ["", f"{drive} power        {_number(read(f'statistics/{drive}/power'))} W {error}"]
        moving, turning = (run.series(name)[1] for name in ("kinetic_energy", "rotational_energy"))
        if len(moving):  # not stopped before it began
            lines.append(f"kinetic energy     {_number(moving[-1])} J at the end, and {_number(turning[-1])} J in spin")
        if run.has("run/energy_balance_error"):
            balance = read("run/energy_balance_error")
            lines.append(f"energy error       {100 * balance:.2g} % of the energy turned over (contacts are sampled)")
        lines += ["", "single impacts      restitution        friction          tangential restitution"]
        for kind, law in measured.items():
            wanted = deck.contact(kind)
            lines.append(
                f"{kind:<12} deck {wanted.restitution:<6.4g} got {law.restitution:.3f}"
                f"   deck {wanted.friction:<6.4g} got {_number(law.friction):<7}"
                f"   deck {wanted.tangential_restitution:<6.4g} got {_number(law.tangential_restitution)}"
            )
        overlap = read("run/largest_overlap")
        lines += [
            "",
            f"cost               {read('run/cpu_time'):.4g} s CPU with output, without it {_number(read('run/price'))} s "
            f"per simulated second; {read('run/wall_time'):.4g} s wall",
            f"largest overlap    {overlap * 1e6:.3g} um, {100 * overlap / run.balls('diameter').min():.2g} % of a diameter; "
            f"contacts last {read('run/contact_duration') * 1e6:.3g} us, time step {read('run/time_step') * 1e6:.3g} us",
            f"file               {path}",
        ]
        for note in read("run/notes").splitlines():
            lines += textwrap.wrap(f"note: {note}", 100, subsequent_indent="      ")
    return "\n".join([*lines, ""])
