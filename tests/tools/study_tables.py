"""Tables of studies that were never run: known surfaces with known noise, in the schema of a study's table."""

import hashlib

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet

from milltools.study.plan import table

SPEED = "impacts/all/normal_speed/median_above_floor"
POWER = "rotor/power"
UNITS = {SPEED: "m/s", POWER: "W"}
KEYS = {
    "drum.buckles": {"unit": "1", "meaning": "number of buckles", "whole": True},
    "drum.buckle_height": {"unit": "m", "meaning": "height of the buckles"},
    "rotor.speed": {"unit": "rad/s", "meaning": "speed of the rotor"},
    "balls.diameter": {"unit": "m", "meaning": "diameter"},
    "contact.restitution": {"unit": "1", "meaning": "normal restitution"},
}


def wavy(n, h):
    """Median normal speed [m/s] over buckles n and their height h [m], of Figure 7's shape: lowest for the circle, one
    flat maximum of 1.1 m/s about n = 6.5, h = 6.5 mm, next to nothing gained where both are small."""
    x, y = (np.log(n) - np.log(6.5)) / 0.95, (h - 6.5e-3) / 6.5e-3
    hill = np.exp(-0.5 * (x**2 + y**2) ** 1.3)
    circle = np.exp(-((h / 1.2e-3) ** 2))
    dead = 1 / (1 + np.exp(-(n * h / 1e-3 - 9) / 2))
    return 0.45 + 0.65 * hill * dead * (1 - circle)


def vary(key, values=None, low=None, high=None, log=False, choices=None):
    """An entry of the metadata's "vary"."""
    known = KEYS.get(key, {"unit": "1", "meaning": key})
    spread = [low, high] if values is None else [v.item() for v in np.asarray(values)]
    return {
        "key": key,
        "unit": known["unit"],
        "meaning": known["meaning"],
        "kind": "choice" if choices else "whole" if known.get("whole") else "number",
        "whole": known.get("whole", False),
        "log": log,
        "low": None if choices else min(spread),
        "high": None if choices else max(spread),
        "values": choices or (None if values is None else [v.item() for v in np.asarray(values)]),
        "choices": choices or [],
    }


def made(designs, entries, objectives, errors=None, status=None, replicates=1, noise=True, seed=1, **meta):
    """(rows, metadata): designs is a frame of the varied keys; objectives {path: (goal, truth)}, truth one value a
    design; errors {path: standard error of each run, NaN if not told}, scatter of the runs where noise."""
    random = np.random.default_rng(seed)
    designs = designs.reset_index(drop=True)
    status = np.full(len(designs), "done", object) if status is None else status
    frames = []
    for replicate in range(replicates):
        rows = designs.copy()
        rows.insert(0, "design", np.arange(len(designs)))
        rows.insert(1, "replicate", replicate)
        rows.insert(2, "seed", 1 + replicate)
        for path, (_, truth) in objectives.items():
            spread = np.broadcast_to((errors or {}).get(path, np.nan), len(designs)).astype(float)
            shake = np.nan_to_num(spread) * random.standard_normal(len(designs)) if noise else 0
            bad = status == "failed"
            rows[path] = np.where(bad, np.nan, truth + shake)
            rows[f"{path}:error"] = np.where(bad, np.nan, spread)
        rows["results"] = ""
        rows["status"] = status
        rows["message"] = ""
        rows.loc[status == "failed", "message"] = "x.ini: [drum] buckle_height: expected less than the blades leave"
        rows.loc[status == "capped", "message"] = "30000000 collisions reached"
        rows["time"], rows["sample_from"] = 0.4, 0.3
        rows["collisions"] = 1_000_000
        rows["cpu"], rows["wall"] = 1.5, 1.6
        rows["version"], rows["worker"] = "0.1.0", "here:1"
        rows["finished"] = [f"2025-03-04T05:{k // 60 % 60:02}:{k % 60:02}+00:00" for k in range(len(rows))]
        frames.append(rows)
    rows = pd.concat(frames, ignore_index=True)
    keys = [e["key"] for e in entries]
    rows.insert(3, "id", [_id(v) for v in rows[[*keys, "seed"]].itertuples(index=False)])
    return rows, {
        "study": "[study]\ndeck = mill.ini\n",
        "file": "made.study",
        "deck": "[run]\ntime = 1 s\n",
        "objectives": [
            {"path": p, "goal": goal, "unit": UNITS[p], "description": p} for p, (goal, _) in objectives.items()
        ],
        "vary": entries,
        "record": [],
        "replicates": replicates,
        "fingerprint": "0123456789abcdef",
        "planned": len(rows),
        "command": "mill sweep made.study",
        "version": "0.1.0",
        **meta,
    }


def _id(values):
    return hashlib.sha256(repr(values).encode()).hexdigest()[:16]


def grid(**values):
    """Every combination of values as a frame; keys with "__" for "."."""
    mesh = np.meshgrid(*values.values(), indexing="ij")
    return pd.DataFrame({key.replace("__", "."): m.ravel() for key, m in zip(values, mesh)})


def figure7(heights=21, noise=0.02, seed=1, gain=1.0, **options):
    """Figure 7's grid with its dead corner capped, one design failed."""
    n, h = np.arange(2, 21), np.linspace(0, 10e-3, heights)
    designs = grid(drum__buckles=n, drum__buckle_height=h)
    a, b = designs["drum.buckles"].to_numpy(), designs["drum.buckle_height"].to_numpy()
    truth = 0.45 + gain * (wavy(a, b) - 0.45)
    status = np.where((a * b < 6e-3) & (b > 0) & (a < 6), "capped", "done").astype(object)
    status[(a == 20) & (b == h[-1])] = "failed"
    entries = [vary("drum.buckles", n), vary("drum.buckle_height", h)]
    return made(
        designs, entries, {SPEED: ("maximise", truth)}, {SPEED: noise * truth},
        status=status, seed=seed, **options,
    )  # fmt: skip


def write(path, rows, meta):
    """The table as Parquet."""
    pyarrow.parquet.write_table(pa.Table.from_pandas(rows, table.schema(meta), preserve_index=False), path)
    return path
