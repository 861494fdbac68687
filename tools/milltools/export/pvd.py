"""Frames for ParaView: a collection (.pvd) that gives the time of each .vtp file in the folder of the same name."""

import pathlib
import re
from xml.sax.saxutils import quoteattr

from milltools.base.errors import UserError
from milltools.base.files import whole, whole_folder
from milltools.base.text import plural, size
from milltools.export import source, vtp

HEAD = '<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1" byte_order="LittleEndian">\n<Collection>\n'
TAIL = "\n</Collection>\n</VTKFile>\n"


def balls(arguments):
    with source.open_run(arguments) as run:
        kept = vtp.still(run)

        def write(index, time, path):
            return vtp.write_balls(run, index, time, kept, path)

        return collection(arguments, run, write, f"{len(kept['id'])} balls")


def mill(arguments):
    if source.about(arguments.source) == "deck":
        raise UserError(f"{arguments.file}: a deck has no frames: give a run, or write .stl or .vtp")
    bodies = vtp.Bodies(source.deck_of(arguments), arguments)
    with source.open_run(arguments) as run:

        def write(index, time, path):
            return bodies.write(time, path, run.poses(index))

        return collection(arguments, run, write, ", ".join(bodies.at_start))


def collection(arguments, run, write, of):
    """Writes balls.pvd and balls/balls_0000.vtp ... by write(frame, time [s], path) -> bytes; returns how much."""
    chosen, times = source.many(run, arguments), source.stored(run)
    path = pathlib.Path(arguments.file)
    place = path.with_suffix("")
    own = re.compile(re.escape(place.name) + r"_\d+\.vtp")
    digits = max(4, len(str(chosen[-1])))
    lines, total = [], 0
    with whole(path) as draft, whole_folder(place, own.fullmatch) as folder:
        for index in source.steps(chosen, arguments):
            name = f"{place.name}_{index:0{digits}d}.vtp"
            total += write(index, times[index], folder / name)
            link = quoteattr(f"{place.name}/{name}")
            lines.append(f'<DataSet timestep="{float(times[index])!r}" part="0" file={link}/>')
        draft.write_text(HEAD + "\n".join(lines) + TAIL, encoding="utf-8")
    return f"{plural(len(lines), 'frame')} of {of}, {size(total)} in {place.name}/"
