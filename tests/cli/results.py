"""Comparing output files: what they hold, and whether two of them hold the same."""

import functools
import os

import h5py
import numpy as np

# All else must be the same to the bit in two runs of one deck
OWN = tuple(
    f"/run/{name}" for name in ("command", "started", "wall_time", "cpu_time", "checkpoint", "peak_memory", "threads")
)


def things(path):
    """Every group, dataset and soft link of the file by name, in a form that can be compared: links by their target,
    all else by type, shape, attributes and bytes. The low-level interface of h5py takes half of the time."""
    found, dtypes = {}, {}

    def held_by(thing, read):
        """Type, shape and bytes of an attribute or a dataset."""
        code = thing.get_type().encode()
        if code not in dtypes:
            dtypes[code] = thing.dtype
        value = np.empty(thing.shape, dtypes[code])
        if value.size:
            read(value)
        return code, thing.shape, repr(value.tolist()) if value.dtype.kind == "O" else value.tobytes()

    def attributes(thing):
        each = (h5py.h5a.open(thing, index=k) for k in range(h5py.h5a.get_num_attrs(thing)))
        return sorted((one.name, *held_by(one, one.read)) for one in each)

    def walk(group, above):
        found[above or "/"] = ("group", attributes(group))
        for name in group:
            path = f"{above}/{name.decode()}"
            if group.links.get_info(name).type == h5py.h5l.TYPE_SOFT:
                found[path] = ("link", group.links.get_val(name))
                continue
            member = h5py.h5o.open(group, name)
            if isinstance(member, h5py.h5g.GroupID):
                walk(member, path)
            else:
                value = held_by(member, lambda array, of=member: of.read(h5py.h5s.ALL, h5py.h5s.ALL, array))
                layout = member.get_create_plist()
                chunks = layout.get_chunk() if layout.get_layout() == h5py.h5d.CHUNKED else None
                space = member.get_space().get_simple_extent_dims(maxdims=True)
                found[path] = ("dataset", *value, space, chunks, attributes(member))

    with h5py.File(path, "r") as file:
        walk(h5py.h5g.open(file.id, b"/"), "")
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
