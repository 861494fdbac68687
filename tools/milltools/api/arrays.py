"""A run as arrays of xarray. They are lazy by xarray's own lazy indexing: a variable is read when its values are used, and
of it only what was selected; `.chunk()` makes dask arrays of them, for what is larger than memory. (xarray.core.indexing is
where xarray's guide for backends finds this: there is no other door to it.)

Values, shapes and types are those of the file, to the last bit. Every variable has `units` (SI, "m s-1") and a
`description` in its attributes, which xarray writes on the axes of its plots.
"""

from typing import Any

import numpy as np
import xarray as xr
from xarray.backends import BackendArray
from xarray.core import indexing

from milltools.base.errors import InputError
from milltools.read.runfile import Run

STATES = ("position", "velocity", "angular_velocity")
VIEWS = {"cross_section": ["y", "z"], "axial": ["x", "r"]}
COORDINATES = {
    "x": "along the drum's axis",
    "y": "across the drum, horizontal",
    "z": "across the drum, upwards",
    "r": "distance from the drum's axis",
}


class Stored(BackendArray):
    """Datasets of a run as one array: a single one as it is, several of one shape (S, ...) as (S, K, ...)."""

    def __init__(self, run: Run, paths: tuple[str, ...], stacked: bool):
        self.run, self.paths, self.stacked = run, paths, stacked
        shape, self.dtype = run.layout(paths[0])
        for path in paths[1:]:
            if run.layout(path) != (shape, self.dtype):
                raise InputError(f"{run.path}: /{path} is not like /{paths[0]}")
        self.shape = (shape[0], len(paths), *shape[1:]) if stacked else shape

    def __reduce__(self) -> tuple[Any, ...]:  # to another process, as dask does: an open file cannot go
        return _again, (self.run.path, self.paths, self.stacked)

    def __getitem__(self, key: Any) -> Any:
        able = indexing.IndexingSupport.OUTER_1VECTOR  # as h5py
        return indexing.explicit_indexing_adapter(key, self.shape, able, self._read)

    def _read(self, key: Any) -> np.ndarray:
        if not self.stacked:
            return np.asarray(self.run.read(self.paths[0], key))
        rows, chosen, *rest = key
        found = np.arange(len(self.paths))[chosen]
        parts = [self.run.read(self.paths[k], (rows, *rest)) for k in np.atleast_1d(found)]
        if found.ndim == 0:
            return np.asarray(parts[0])
        at = 0 if isinstance(rows, int | np.integer) else 1
        if not parts:
            return self._read((rows, slice(0, 1), *rest)).take([], at)
        return np.stack(parts, axis=at)


def _again(path: str, paths: tuple[str, ...], stacked: bool) -> Stored:
    return Stored(Run(path), paths, stacked)


def variable(run: Run, dims: list[str], *paths: str, stacked: bool = False, **more: str) -> xr.Variable:
    """A lazy variable of the dataset at a path; of several of them, stacked along the second dimension."""
    attributes = {
        "units": run.attribute(paths[0], "unit", ""),
        "description": run.attribute(paths[0], "description", ""),
    }
    array = indexing.LazilyIndexedArray(Stored(run, paths, stacked))
    return xr.Variable(dims, array, attributes | more)


def coordinate(name: str, values: object, units: str, description: str) -> xr.Variable:
    return xr.Variable(name, values, {"units": units, "description": description})


def series(run: Run) -> xr.Dataset:
    """/observables: (time,), and what is told of each kind of contact (time, kind), of each motion (time, motion). Of a mill
    without a rotor the columns about one are left out."""
    time = run.read("observables/kinetic_energy/time")
    coords = {"time": coordinate("time", time, "s", "simulated time")}
    members = {"kind": run.kinds, "motion": run.motions}
    found = {}
    for name in run.names("observables"):
        if name in ("rotor_work", "rotor_torque") and not run.has_rotor:
            continue
        if run.has_series(name):
            found[name] = variable(run, ["time"], f"observables/{name}/value", long_name=words(name))
            continue
        of = "motion" if name == "motion_work" else "kind"
        paths = [f"observables/{name}/{member}/value" for member in members[of]]
        if not paths or not all(map(run.has, paths)):
            continue
        coords[of] = coordinate(of, list(members[of]), "", {"kind": "kind of contact", "motion": "what moves"}[of])
        dims = ["time", of]
        if name == "fast_collisions":
            dims.append("threshold")
            speeds = run.attribute(paths[0], "thresholds")
            coords["threshold"] = coordinate("threshold", speeds, "m s-1", "least normal speed")
        found[name] = variable(run, dims, *paths, stacked=True, long_name=words(name))
        found[name].attrs["description"] = found[name].attrs["description"].replace("this", "a")
    for name, one in found.items():
        if one.shape[0] != len(time):
            raise InputError(f"{run.path}: /observables/{name}: {one.shape[0]} values, {len(time)} times")
    return xr.Dataset(found, coords)


def words(name: str) -> str:
    return name.replace("_", " ")


def frames(run: Run) -> xr.Dataset:
    """The stored ball states: position, velocity, angular_velocity (time, ball, axis)."""
    where = "particles/trajectory"
    if not run.has(f"{where}/position/time"):
        raise InputError(f"{run.path}: no ball states are stored (output.frames = 0 s)")
    names = np.asarray(run.species_names())
    coords = {
        "time": coordinate("time", run.frame_times(), "s", "simulated time"),
        "ball": coordinate("ball", run.balls("id"), "1", "number of the ball"),
        "axis": coordinate("axis", ["x", "y", "z"], "", "x along the drum's axis, z upwards"),
        "mass": variable(run, ["ball"], f"{where}/mass"),
        "diameter": variable(run, ["ball"], f"{where}/diameter"),
        "species": ("ball", names[run.balls("species")], {"description": "kind of the ball"}),
    }
    dims = ["time", "ball", "axis"]
    found = {name: variable(run, dims, f"{where}/{name}/value", long_name=words(name)) for name in STATES}
    return xr.Dataset(found, coords)


def maps(run: Run) -> xr.DataTree:
    """/statistics/maps: the nodes "cross_section" (y, z) and "axial" (x, r)."""
    run.need_statistics()
    return xr.DataTree.from_dict({view: _view(run, view, dims) for view, dims in VIEWS.items()})


def _view(run: Run, view: str, dims: list[str]) -> xr.Dataset:
    where, coords, found = f"statistics/maps/{view}", {}, {}
    for dim, edges in zip(dims, run.edges(view)):
        middle = (edges[:-1] + edges[1:]) / 2
        coords[dim] = coordinate(dim, middle, "m", f"{COORDINATES[dim]}: middle of the cell")
        found[f"{dim}_edges"] = variable(run, [f"{dim}_edge"], f"{where}/{dim}_edges")
    for name in run.names(where):
        if not name.endswith("_edges"):
            found[name] = variable(run, dims, f"{where}/{name}", long_name=words(name))
    samples = int(run.read("statistics/maps/samples"))
    return xr.Dataset(found, coords, {"samples": samples, "duration": run.duration})
