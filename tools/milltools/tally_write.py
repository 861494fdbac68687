"""How do the statistics look in the output file? /statistics, dataset by dataset, as src/observe/tally_tell.c has it.

`part` = "normal" is on every dataset that holds only the normal part of the dissipated energy.
"""

import math

import numpy as np

from milltools.h5write import put
from milltools.read.kinds import KINDS
from milltools.tally import BINS, EDGES, FAST, LEVELS, block_error, quantile

NORMAL = {"part": "normal"}


def _put_histogram(group, spectrum, edges):
    """edges: the dataset that all histograms share, None for the first."""
    if edges is None:
        edges = put(
            group,
            "edges",
            EDGES,
            "m s-1",
            "edges of the bins, 20^(k/152) m/s with k = -760..380; bin i is edges[i] <= v < edges[i+1]",
        )
    else:
        group["edges"] = edges
    for name, values, unit, text, more in (
        (
            "count",
            spectrum.count,
            "1",
            "how many fell into each bin; attributes underflow (zero included) and overflow: how many lay outside",
            {},
        ),
        (
            "dissipation",
            spectrum.dissipation,
            "J",
            "energy dissipated by those of each bin; attributes underflow and overflow: by those outside",
            NORMAL,
        ),
    ):
        outside = {"underflow": values[0], "overflow": values[-1]}
        put(group, name, values[1 : BINS + 1], unit, text, **outside, **more)
    return edges


def _put_speed(group, spectrum, fast, edges):
    """fast: counts by slot of those with v_n >= 0.05 m/s."""
    count, levels = spectrum.count, np.array(LEVELS)
    quantiles = {
        name: [quantile(of, level) for level in LEVELS]
        for name, of in (("quantiles", count), ("quantiles_above_50mm_s", fast))
    }
    speed = "m s-1"
    mean = "mean, from the speeds themselves; NaN without impacts"
    put(group, "mean", spectrum.mean(), speed, mean)
    median = "median, log-linear within its bin; NaN without impacts"
    put(group, "median", quantile(count, 0.5), speed, median)
    above = "over the impacts whose normal speed is 0.05 m/s or more"
    put(group, "median_above_50mm_s", quantile(fast, 0.5), speed, f"median {above}")
    at = "quantiles at the attribute levels, log-linear within their bins"
    put(group, "quantiles", quantiles["quantiles"], speed, at, levels=levels)
    values = quantiles["quantiles_above_50mm_s"]
    put(group, "quantiles_above_50mm_s", values, speed, f"quantiles {above}", levels=levels)
    return _put_histogram(group.create_group("histogram"), spectrum, edges)


def put_speeds(group, speeds, duration, power, edges, kinds=KINDS):
    """impacts (power: W by kind, all that they dissipated) or strikes (power None: what their spectra hold)."""
    for number, name in enumerate((*kinds, "all")):
        kind = number if name != "all" else None
        normal, tangential, fast = speeds.row(kind)
        row = group.create_group(name)
        count = int(normal.count.sum())
        put(row, "count", count, "1", "how many within the duration", np.uint64)
        put(row, "rate", count / duration if duration > 0 else 0.0, "s-1", "count / duration")
        if power is None:
            watts, part = normal.lost() / duration if duration > 0 else 0.0, NORMAL
        else:
            watts, part = float(power[kind] if kind is not None else np.sum(power)), {}
        put(row, "dissipated_power", watts, "W", "energy dissipated / duration", **part)
        edges = _put_speed(row.create_group("normal_speed"), normal, normal.count[FAST:], edges)
        edges = _put_speed(row.create_group("tangential_speed"), tangential, fast.count, edges)
    return edges


def _put_map(group, map_, samples, axes, velocities):
    for axis, (name, text) in enumerate(axes):
        put(group, f"{name}_edges", map_.edges(axis), "m", text)
    room, volume = map_.room * samples, map_.flow[0]
    solid = np.full(len(room), math.nan)
    np.divide(volume, room, out=solid, where=room > 0)
    mean = "time-averaged velocity of the balls as seen from the container, weighted by their volume in the cell; NaN where none ever was"
    fields = [
        ("impact_count", map_.count, "1", "impacts in the cell", {}),
        ("normal_speed_sum", map_.speed, "m s-1", "sum of the normal speeds of these impacts", {}),
        ("dissipation", map_.dissipation, "J", "energy dissipated by these impacts", NORMAL),
        (
            "solid_fraction",
            solid,
            "1",
            "time-averaged volume of balls / volume of the cell inside the container (what stands in it is not subtracted); "
            "NaN where the cell is outside",
            {},
        ),
    ]
    for letter, flow in zip(velocities, map_.flow[1:]):
        value = np.full(len(flow), math.nan)
        np.divide(flow, volume, out=value, where=volume > 0)
        fields.append((f"velocity_{letter}", value, "m s-1", mean, {}))
    for name, values, unit, text, more in fields:
        put(group, name, values.reshape(map_.n), unit, text, **more)


def put_maps(group, maps):
    """maps/: both maps and the number of snapshots."""
    text = "snapshots that the solid fraction and the mean velocity are averaged over"
    put(group, "samples", maps.samples, "1", text, np.uint64)
    first, second = "{}, the first index", "{}, the second index"
    _put_map(
        group.create_group("cross_section"),
        maps.cross,
        maps.samples,
        (("y", first.format("edges along y")), ("z", second.format("edges along z"))),
        "xyz",
    )
    _put_map(
        group.create_group("axial"),
        maps.axial,
        maps.samples,
        (("x", first.format("edges along x")), ("r", second.format("edges in r"))),
        ("x", "r", "phi"),
    )


def put_rotor(group, blocks, power, torque):
    """rotor/: means over the window [W], [N m] and those of the blocks."""
    error = (
        "standard error of the mean {} from the scatter of the blocks, widened by Student's t: value +- 1.96 times this "
        "is the 95 % interval; NaN with fewer than four"
    )
    put(group, "power", power, "W", "work of the rotor on the balls / duration")
    put(group, "power_error", block_error(blocks.power), "W", error.format("power"))
    put(group, "torque", torque, "N m", "mean torque of the rotor on the balls about +x")
    put(group, "torque_error", block_error(blocks.torque), "N m", error.format("torque"))
    text = "whole blocks within the duration"
    put(group, "blocks", len(blocks.power), "1", text, np.uint64)
    text = "revolutions of the rotor in a block"
    put(group, "block_revolutions", blocks.revolutions, "1", text)
    text = "length of a block, whole periods of all motions; NaN where no rotor turns"
    put(group, "block_duration", blocks.duration, "s", text)
    put(group, "block_power", blocks.power, "W", "mean power of each block")
    put(group, "block_torque", blocks.torque, "N m", "mean torque of each block")


def put_drive(group, blocks, power, motions):
    """motions/, drive/ and precision/drive_power/ below `group`: the mean power [W] of all motions and its blocks; of each by
    name (power, its error, torque [N m], its error)."""
    for name, values in motions.items():
        one, error = group.require_group("motions").create_group(name), "its standard error, from blocks of the motions' period"  # fmt: skip
        text = "work on the balls by this motion's own velocity / duration"
        put(one, "power", values[0], "W", text)
        put(one, "power_error", values[1], "W", error)
        text = "mean torque on the balls about the motion's own axis; NaN: it has none"
        put(one, "torque", values[2], "N m", text)
        put(one, "torque_error", values[3], "N m", error)
    error = block_error(blocks.power)
    drive, known = group.create_group("drive"), group.create_group("precision/drive_power")
    put(drive, "power", power, "W", "work of all motions on the balls / duration")
    put(drive, "power_error", error, "W", "its standard error, the same as in precision")
    put(known, "value", power, "W", "mean power of all motions on the balls")
    put(
        known,
        "standard_error",
        error,
        "W",
        "its standard error, from blocks of the motions' period",
    )
    freedom = len(blocks.power) - 1 if math.isfinite(error) else 0
    text = "of the standard error, for which it is widened; 0: none"
    put(known, "degrees_of_freedom", float(freedom), "1", text)


def put_precision(group, blocks, power, torque):
    """precision/: what is known of the means over the window [W], [N m], as rotor/ tells it."""
    for name, value, values, unit in (
        ("rotor_power", power, blocks.power, "W"),
        ("rotor_torque", torque, blocks.torque, "N m"),
    ):
        one, error = group.create_group(name), block_error(values)
        put(one, "value", value, unit, "mean over the window, the same as in rotor")
        put(one, "standard_error", error, unit, "its standard error, the same as in rotor")
        freedom = len(values) - 1 if math.isfinite(error) else 0
        put(one, "degrees_of_freedom", float(freedom), "1", "of the standard error; 0: none")


def put_floor_share(group, kinds=KINDS):
    """floor_share/: NaN, there is no rebound floor."""
    text = "share of the impacts at which the rebound floor acted; NaN without impacts"
    for name in (*kinds, "all"):
        put(group, name, math.nan, "1", text)
