"""Comparing output files: what they hold, and whether two of them hold the same."""

import functools
import os

import h5py

# All else must be the same to the bit in two runs of one deck
OWN = tuple(
    f"/run/{name}" for name in ("command", "started", "wall_time", "cpu_time", "checkpoint", "peak_memory", "threads")
)


def things(path):
    """Every group, dataset and soft link of the file by name, in a form that can be compared:
    links by their target, all else by type, shape, attributes and bytes."""
    found = {}

    def attributes(thing):
        return {key: plain(value) for key, value in sorted(thing.attrs.items())}

    def plain(value):
        if hasattr(value, "tobytes") and value.dtype.kind != "O":
            return value.dtype.str, value.shape, value.tobytes()
        return repr(value)

    def walk(group):
        for name in group:
            link = group.get(name, getlink=True)
            path = f"{group.name.rstrip('/')}/{name}"
            if isinstance(link, h5py.SoftLink):
                found[path] = ("link", link.path)
                continue
            member = group[name]
            if isinstance(member, h5py.Group):
                found[path] = ("group", attributes(member))
                walk(member)
            else:
                found[path] = (
                    "dataset",
                    member.dtype.str,
                    member.shape,
                    member.maxshape,
                    member.chunks,
                    attributes(member),
                    repr(member[()]) if member.dtype.kind == "O" else member[()].tobytes(),
                )

    with h5py.File(path, "r") as file:
        found["/"] = ("group", attributes(file))
        walk(file)
    return found


@functools.lru_cache(maxsize=2)
def held(path, changed):
    """things() of a file: many are compared with the same one."""
    return things(path)


def differences(first, second, apart_from=OWN):
    """Names under which the two files hold something different, and those that only one has."""
    sides = (held(path, os.stat(path).st_mtime_ns) for path in (first, second))
    one, two = ({name: thing for name, thing in side.items() if not name.startswith(apart_from)} for side in sides)
    assert len(one) > 100, "the first is no whole output file"
    return sorted(name for name in one.keys() | two.keys() if one.get(name) != two.get(name))


def assert_same(first, second, apart_from=OWN):
    assert differences(first, second, apart_from) == []


def status(path):
    """The /run/status and /run/time of a file; the time is 0 before the first checkpoint."""
    with h5py.File(path, "r") as file:
        time = file["/run/time"][()] if "/run/time" in file else 0.0
        return file["/run/status"].asstr()[()], float(time)
