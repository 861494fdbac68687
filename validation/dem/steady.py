"""The reference mill with friction, steady at 1000 rpm: millsim compared with LIGGGHTS at steel stiffness.

`compare` does the same for any mill that is steady in its sampled window; other.py uses it.
"""

import matplotlib.pyplot as plt
import numpy as np
from mills import (
    STEADY,
    Window,
    claim,
    judge,
    map_verdict,
    mean_map,
    read_map,
    solid_off,
    velocity_off,
)
from runs import ROOT, STIFFNESSES, contact_duration, say, sets

from milltools.read.kinds import KINDS
from milltools.read.kinds import label as kind_label
from milltools.read.runfile import Run

DECK = ROOT / "input" / "simoloyer.ini"
SETTINGS = {"run__time": "0.5 s", "run__sample_from": "0.1 s"}
HARD_SEEDS = 8  # of millsim, with each friction
MAP_BAND = 10  # [%]
OWN_POWER_BAND = 3  # [%] with LIGGGHTS' effective friction
VIEWS = {"cross_section": "cross-section", "axial": "axial view"}


def check(case):
    say("    steady mill with friction")
    compare(case, "steady", "1000 rpm, 4000 balls", DECK, SETTINGS)
    soft_balls(case)


def stiff_run(case, name="steady", deck=DECK, settings=SETTINGS):
    """LIGGGHTS at steel stiffness: (its file, the settings of the deck with its contact duration as strike window)."""
    duration = contact_duration((deck, sets(settings)), STIFFNESSES["steel"])
    settings = settings | {"output__strike_window": f"{duration} s"}
    return case.dem(name, deck, "steel", "1e9", **settings), settings


def soft_run(case):
    """The file of the same at 1e9 Pa."""
    return case.dem("steady-1e9", DECK, "1e9", **SETTINGS)


def soft_balls(case):
    """At 1e9 Pa: why stiffness matters."""
    soft = [Window(soft_run(case))]
    hard = [Window(path) for path in case.seeds(HARD_SEEDS, DECK, **SETTINGS)]
    verdicts = [judge(quantity, soft, hard) for quantity in STEADY]
    case.tell(
        "At 1e9 Pa millsim deviates from LIGGGHTS by "
        + ", ".join(f"{v.off:+.1f} +- {v.error:.1f} % ({v.quantity.name})" for v in verdicts)
        + ". Therefore rates are compared at steel only."
    )


def own_friction(path):
    """Settings that give millsim the friction that LIGGGHTS' run at `path` was measured to have."""
    settings = {}
    with Run(path) as run:
        for kind in run.kinds:
            if run.has(f"run/measured/{kind}"):
                for key in ("friction", "tangential_restitution"):
                    value = float(run.read(f"run/measured/{kind}/{key}"))
                    settings[f"contact__{kind}__{key}"] = value
    return settings


def compare(case, name, what, deck, settings):
    """Holds millsim against LIGGGHTS at steel stiffness: claims, sentences, figures called after `name`."""
    soft_path, settings = stiff_run(case, name, deck, settings)
    own = own_friction(soft_path)
    paths = {
        "deck": case.seeds(HARD_SEEDS, deck, **settings),
        "own": case.seeds(HARD_SEEDS, deck, **settings, **own),
    }
    soft = Window(soft_path)
    hard = {law: [Window(path) for path in group] for law, group in paths.items()}
    verdicts = {law: [judge(quantity, [soft], runs) for quantity in STEADY] for law, runs in hard.items()}
    told = name == "steady"  # the summary has one mill
    for verdict in verdicts["deck"]:
        claim(case, verdict, f"LIGGGHTS, steel, {what}", headline=told and verdict.quantity.headline)
    suffix = ", with LIGGGHTS' effective friction"
    power, *others = verdicts["own"]  # the bands of the others are for the deck's friction
    claim(case, power, f"LIGGGHTS, steel, {what}", OWN_POWER_BAND, suffix, headline=told)
    case.tell(
        "With LIGGGHTS' effective friction in its deck, millsim deviates from LIGGGHTS by "
        + ", ".join(f"{v.off:+.1f} +- {v.error:.1f} % ({v.quantity.name})" for v in others)
        + "."
    )
    claim_maps(case, soft_path, paths["deck"], what, told)
    tell(case, soft_path, soft, hard["deck"], hard["own"], verdicts["deck"])
    draw_verdicts(case, name, what, verdicts)
    draw_spectra(case, name, what, soft_path, paths["deck"])
    draw_maps(case, name, what, soft_path, paths["deck"])


def claim_maps(case, soft, hard, what, told):
    for view, label in VIEWS.items():
        for measure, name in ((velocity_off, "velocity"), (solid_off, "solid fraction")):
            off, noise = map_verdict(soft, hard, view, measure)
            case.bound(
                f"map of the {name}, {label}, rms difference; noise alone {100 * noise:.1f} %",
                100 * off,
                MAP_BAND,
                error=100 * noise,
                unit="%",
                against=f"LIGGGHTS, steel, {what}, where the solid fraction exceeds 0.02",
                headline=told and name == "velocity" and view == "cross_section",
            )


def tell(case, soft_path, soft, hard, own, verdicts):
    """Where hard and soft spheres must differ, in figures."""
    mean = {key: np.mean([run.values[key] for run in hard]) for key in soft.values}
    for runs, law in ((hard, "the deck's friction"), (own, "LIGGGHTS' effective friction")):
        counts = []
        for kind in ("ball_ball", "ball_drum", "ball_wall", "ball_blade"):
            names = (f"{kind.removeprefix('ball_')}_{what}" for what in ("1", "strikes"))
            one, merged = (100 * (np.mean([run.values[k] for run in runs]) / soft.values[k] - 1) for k in names)
            counts.append(f"{kind_label(kind)} {one:+.1f} %, {merged:+.1f} %")
        case.tell(
            f"Rates above 1 m/s with {law}, deviation of millsim from LIGGGHTS if each impact counts, and if "
            f"re-contacts of a pair within the duration of a contact count once in both: {'; '.join(counts)}."
        )
    case.tell(
        f"Slow impacts: millsim has {mean['all']:.4g} impacts per second in total, LIGGGHTS {soft.values['all']:.4g}; "
        f"of these, {100 * mean['slow'] / mean['all']:.1f} and "
        f"{100 * soft.values['slow'] / soft.values['all']:.1f} % are slower than 50 mm/s."
    )
    with Run(soft_path) as run:
        shares = {k: float(run.read(f"run/isolated_share/{k}")) for k in KINDS}
    case.tell(
        "Multiple contacts in LIGGGHTS: ratio of the energy that the impacts would lose as single impacts to the work "
        "of the dashpots: " + ", ".join(f"{kind_label(k)} {share:.3f}" for k, share in shares.items()) + "."
    )
    case.tell(
        "Standard error of the LIGGGHTS run from its own blocks, and scatter of single runs of millsim from seed to "
        "seed: " + "; ".join(f"{v.quantity.name} {v.blocks:.2g} and {v.scatter:.2g} %" for v in verdicts) + "."
    )


# --- Figures ------------------------------------------------------------------------------------------------------


def draw_verdicts(case, name, what, verdicts):
    figure, axis = plt.subplots(figsize=(9, 4.6), layout="constrained")
    rows = np.arange(len(STEADY))[::-1]
    for row, quantity in zip(rows, STEADY, strict=True):
        axis.fill_betweenx([row - 0.4, row + 0.4], -quantity.band, quantity.band, color="C2", alpha=0.15, lw=0)
    for law, label, shift, style in (
        ("deck", "millsim with the deck's friction", 0.12, "o"),
        ("own", "millsim with LIGGGHTS' effective friction", -0.12, "s"),
    ):
        off = [v.off for v in verdicts[law]]
        error = [v.error for v in verdicts[law]]
        axis.errorbar(off, rows + shift, xerr=error, fmt=style, ms=5, capsize=3, label=label)
    axis.axvline(0, color="k", lw=0.8)
    axis.fill_betweenx([], [], [], color="C2", alpha=0.15, label="band")
    axis.set_yticks(rows, [quantity.name for quantity in STEADY])
    axis.set(
        xlabel="deviation of millsim from LIGGGHTS at steel stiffness [%]", title=f"{what}; bars: one standard error"
    )
    axis.grid(alpha=0.3, axis="x")
    axis.legend(fontsize=8, ncols=3, loc="upper center", bbox_to_anchor=(0.5, -0.13))
    case.save(figure, f"{name}.png")
    plt.close(figure)


def draw_spectra(case, name, what, soft, hard):
    kinds = [kind for kind in KINDS if kind != "ball_shaft"]  # it has a few contacts a second
    figure, axes = plt.subplots(2, 2, figsize=(11, 8), layout="constrained")
    for axis, kind in zip(axes.flat, kinds, strict=True):
        for paths, colour, label in ((hard, "k", "millsim"), ([soft], "C3", "LIGGGHTS, steel")):
            for group, style in (("impacts", "-"), ("strikes", ":")):
                if group == "strikes" and paths is not hard:
                    continue  # there they are the same: a soft contact is one
                edges, density = density_of(paths, kind, group)
                text = label + (", re-contacts counted once" if group == "strikes" else "")
                axis.stairs(density, edges, color=colour, ls=style, label=text)
        axis.set(xscale="log", yscale="log", xlim=(0.004, 12), title=kind_label(kind))
        top = density_of([soft], kind, "impacts")[1].max()
        axis.set(ylim=(top / 1e3, 4 * top), xlabel="normal speed [m/s]")
        axis.set_ylabel("impacts per second and unit of ln(speed) [1/s]")
        axis.grid(alpha=0.3)
    axes[0, 0].legend(fontsize=9, loc="lower center")
    figure.suptitle(f"Impact speeds, {what}")
    case.save(figure, f"{name}-spectra.png")
    plt.close(figure)


def density_of(paths, kind, group, join=5):
    """(edges, mean rate by the logarithm of the speed) of impacts or strikes, so many bins in one."""
    total = 0.0
    for path in paths:
        with Run(path) as run:
            histogram = run.histogram(kind, group)
            total = total + histogram.count / run.duration / len(paths)
    edges = histogram.edges[::join]
    bins = len(edges) - 1
    return edges, total[: join * bins].reshape(bins, join).sum(axis=1) / np.diff(np.log(edges))


def draw_maps(case, name, what, soft, hard):
    with Run(soft) as run:
        y, z = (1e3 * edges for edges in run.edges("cross_section"))
    one = mean_map([read_map(path, "cross_section") for path in hard])
    other = read_map(soft, "cross_section")
    figure, axes = plt.subplots(1, 3, figsize=(15, 4.6), layout="constrained")
    fast = max(np.linalg.norm(m.velocity, axis=-1).max() for m in (one, other))
    for axis, m, label in (
        (axes[0], one, f"millsim, mean of {len(hard)}"),
        (axes[1], other, "LIGGGHTS, steel"),
    ):
        speed = np.where(m.solid > 0.02, np.linalg.norm(m.velocity, axis=-1), np.nan)
        mesh = axis.pcolormesh(y, z, speed.T, vmin=0, vmax=fast, cmap="viridis")
        axis.set(title=label)
    figure.colorbar(mesh, ax=axes[:2], label="mean velocity of the balls [m/s]")
    dense = (one.solid > 0.02) & (other.solid > 0.02)
    off = np.where(dense, np.linalg.norm(one.velocity - other.velocity, axis=-1), np.nan)
    mesh = axes[2].pcolormesh(y, z, off.T, vmin=0, vmax=fast / 5, cmap="magma")
    axes[2].set(title="difference")
    figure.colorbar(mesh, ax=axes[2], label="difference of the velocities [m/s]")
    for axis in axes:
        axis.set(xlabel="y [mm]", ylabel="z [mm]", aspect="equal")
    figure.suptitle(f"{what}, where the solid fraction exceeds 0.02")
    case.save(figure, f"{name}-maps.png")
    plt.close(figure)
