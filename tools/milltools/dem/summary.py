"""What `mill dem` prints at its end."""

import math
import textwrap

from milltools.read.runfile import Run


def _number(value, unit=""):
    if not math.isfinite(value):
        return "-"
    return f"{value:.4g}{unit}"


def summarize(path, deck, measured):
    """The results in the file at `path` as a text, in the manner of millsim's own summary."""
    with Run(path) as run:
        read = run.read
        window = run.duration
        soft, until = read("run/warm_up_modulus"), read("run/warm_up_time")
        warm = f", after {until * 1e3:.4g} ms at {soft:.3g} Pa" if until > 0 else ""
        sampled = f"sampled for {window * 1e3:.4g} ms"
        if not window > 0:
            sampled = f"nothing sampled: it ended at {run.time * 1e3:.4g} ms, before run.sample_from"
        lines = ["", f"{sampled}; LIGGGHTS, E = {read('run/modulus'):.3g} Pa{warm}", ""]
        lines.append(
            "                                       median v_n  median v_n    mean v_n   dissipated\n"
            "                                           of all   > 50 mm/s      of all        power\n"
            "kind           contacts     rate [/s]       [m/s]       [m/s]       [m/s]          [W]"
        )
        for kind in (*run.kinds, "all"):
            row = f"statistics/impacts/{kind}"
            median, above, mean = (
                read(f"{row}/normal_speed/{name}") for name in ("median", "median_above_50mm_s", "mean")
            )
            lines.append(
                f"{kind:<12}{read(f'{row}/count'):>11}{_number(read(f'{row}/rate')):>14}{_number(median):>12}"
                f"{_number(above):>12}{_number(mean):>12}{_number(read(f'{row}/dissipated_power')):>13}"
            )
        lines.append("")
        drive = run.driven or "rotor"
        blocks = int(read("statistics/rotor/blocks")) if drive == "rotor" else None
        error = read(f"statistics/{drive}/power_error")
        error = (
            f"+- {_number(error)} W" + (f" ({blocks} blocks)" if blocks else "")
            if math.isfinite(error)
            else "(no error: too short)"
        )
        lines.append(f"{drive} power        {_number(read(f'statistics/{drive}/power'))} W {error}")
        energy = [run.series(name)[1] for name in ("kinetic_energy", "rotational_energy")]
        if len(energy[0]):  # not stopped before it began
            moving, turning = (_number(value[-1]) for value in energy)
            lines.append(f"kinetic energy     {moving} J at the end, and {turning} J in spin")
        if run.has("run/energy_balance_error"):
            balance = read("run/energy_balance_error")
            lines.append(f"energy error       {100 * balance:.2g} % of the energy turned over (contacts are sampled)")
        lines.append("")
        lines.append("single impacts      restitution        friction          tangential restitution")
        for kind, law in measured.items():
            wanted = deck.contact(kind)
            lines.append(
                f"{kind:<12} deck {wanted.restitution:<6.4g} got {law.restitution:.3f}"
                f"   deck {wanted.friction:<6.4g} got {_number(law.friction):<7}"
                f"   deck {wanted.tangential_restitution:<6.4g} got {_number(law.tangential_restitution)}"
            )
        lines.append("")
        lines.append(
            f"cost               {read('run/cpu_time'):.4g} s CPU with output, without it {_number(read('run/price'))} s per simulated second; "
            f"{read('run/wall_time'):.4g} s wall"
        )
        lines.append(
            f"largest overlap    {read('run/largest_overlap') * 1e6:.3g} um, "
            f"{100 * read('run/largest_overlap') / run.balls('diameter').min():.2g} % of a diameter; contacts last "
            f"{read('run/contact_duration') * 1e6:.3g} us, time step {read('run/time_step') * 1e6:.3g} us"
        )
        lines.append(f"file               {path}")
        for note in read("run/notes").splitlines():
            lines += textwrap.wrap(f"note: {note}", 100, subsequent_indent="      ")
    return "\n".join([*lines, ""])
