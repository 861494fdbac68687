"""A run as arrays of xarray.

Arrays use xarray's own lazy indexing: a variable is read when its values are used, and only its selected part.
`.chunk()` makes dask arrays, for data larger than memory. (xarray has no other interface to lazy indexing than
xarray.core.indexing, which its guide for backends uses too.)

Values, shapes and types are exactly those of the file. Every variable has `units` (SI, "m s-1") and a `description` in
its attributes, which xarray writes on the axes of its plots.
"""

from typing import Any

import numpy as np
import xarray as xr
from xarray.backends import BackendArray
from xarray.core import indexing

from milltools.base.errors import InputError
from milltools.read.runfile import VIEWS, Run

STATES = ("position", "velocity", "angular_velocity")
COORDINATES = {
    "x": "along the drum's axis",
    "y": "across the drum, horizontal",
    "z": "across the drum, upwards",
    "r": "distance from the drum's axis",
}


class Stored(BackendArray):
    """Datasets of a run as one array: a single dataset unchanged, K datasets of one shape (S, ...) as (S, K, ...)."""

    def __init__(self, run: Run, paths: tuple[str, ...], stacked: bool):
        self.run, self.paths, self.stacked = run, paths, stacked
        shape, self.dtype = run.layout(paths[0])
        for path in paths[1:]:
            if run.layout(path) != (shape, self.dtype):
                raise InputError(f"{run.path}: /{path} has another shape or type than /{paths[0]}")
        self.shape = (shape[0], len(paths), *shape[1:]) if stacked else shape

    def __getitem__(self, key: Any) -> Any:
        as_h5py = indexing.IndexingSupport.OUTER_1VECTOR
        return indexing.explicit_indexing_adapter(key, self.shape, as_h5py, self._read)

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


def variable(run: Run, dims: list[str], *paths: str, stacked: bool = False, **more: str) -> xr.Variable:
    """A lazy variable of the dataset at a path; several datasets are stacked along the second dimension."""
    told = (("units", "unit"), ("description", "description"))
    attributes = {name: run.attribute(paths[0], attribute, "") for name, attribute in told}
    array = indexing.LazilyIndexedArray(Stored(run, paths, stacked))
    return xr.Variable(dims, array, attributes | more)


def coordinate(name: str, values: object, units: str, description: str) -> xr.Variable:
    return xr.Variable(name, values, {"units": units, "description": description})


def series(run: Run) -> xr.Dataset:
    """/observables: (time,); for each kind of contact (time, kind); for each motion (time, motion). For a mill without
    a rotor the columns of the rotor are left out."""
    time = run.read("observables/kinetic_energy/time")
    coords = {"time": coordinate("time", time, "s", "simulated time")}
    members = {"kind": run.kinds, "motion": run.motions}
    found, charges = {}, {}
    for name in run.names("observables"):
        if name.startswith("frame_") or (name in ("rotor_work", "rotor_torque") and not run.has_rotor):
            continue  # or at the times of the frames
        if run.has_series(name):
            found[name] = variable(run, ["time"], f"observables/{name}/value", long_name=words(name))
            continue
        of = "motion" if name == "motion_work" else "kind"
        paths = [f"observables/{name}/{member}/value" for member in members[of]]
        if not paths or not all(map(run.has, paths)):
            continue
        coords[of] = coordinate(of, list(members[of]), "", {"kind": "kind of contact", "motion": "moving body"}[of])
        dims = ["time", of]
        if name == "fast_collisions":
            dims.append("threshold")
            speeds = run.attribute(paths[0], "thresholds")
            coords["threshold"] = coordinate("threshold", speeds, "m s-1", "smallest normal speed")
        found[name] = variable(run, dims, *paths, stacked=True, long_name=words(name))
        found[name].attrs["description"] = found[name].attrs["description"].replace("this", "a")
    for name in run.charge:
        path = f"observables/charge/{name}"
        coords["turn"] = coordinate("turn", run.read(f"{path}/time"), "s", "end of the time that a value is of")
        charges[f"charge_{name}"] = variable(run, ["turn"], f"{path}/value", long_name=words(name))
    for name, one in found.items():
        if one.shape[0] != len(time):
            raise InputError(f"{run.path}: /observables/{name}: {one.shape[0]} values, {len(time)} times")
    return xr.Dataset(found | charges, coords)


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
    about, views = {"samples": int(run.read("statistics/maps/samples")), "duration": run.duration}, {}
    for view, (*dims, _) in VIEWS.items():
        where, coords, found = f"statistics/maps/{view}", {}, {}
        for dim, edges in zip(dims, run.edges(view)):
            middle = (edges[:-1] + edges[1:]) / 2
            coords[dim] = coordinate(dim, middle, "m", f"{COORDINATES[dim]}: middle of the cell")
            found[f"{dim}_edges"] = variable(run, [f"{dim}_edge"], f"{where}/{dim}_edges")
        for name in run.names(where):
            if not name.endswith("_edges"):
                found[name] = variable(run, dims, f"{where}/{name}", long_name=words(name))
        views[view] = xr.Dataset(found, coords, about)
    return xr.DataTree.from_dict(views)
