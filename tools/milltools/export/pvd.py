"""Frames for ParaView: a collection (.pvd) that gives each .vtp of the folder beside it its time."""

import pathlib
import re
from xml.sax.saxutils import quoteattr

from milltools.base.errors import UserError
from milltools.base.files import whole, whole_folder
from milltools.base.text import plural, size
from milltools.export import source, vtp


def balls(arguments):
    with source.open_run(arguments) as run:
        kept = vtp.still(run)
        chosen, times = source.many(run, arguments), source.stored(run)

        def write(index, path):
            return vtp.write_balls(run, index, times[index], kept, path)

        return collection(arguments, chosen, times, write, f"{len(kept['id'])} balls")


def mill(arguments):
    if source.about(arguments.source) == "deck":
        raise UserError(f"{arguments.file}: a deck has no frames: give a run, or write .stl or .vtp")
    bodies = vtp.Bodies(source.deck_of(arguments), arguments)
    with source.open_run(arguments) as run:
        chosen, times = source.many(run, arguments), source.stored(run)

        def write(index, path):
            return bodies.write(times[index], path, run.poses(index))

        return collection(arguments, chosen, times, write, ", ".join(bodies.parts))


def collection(arguments, chosen, times, write, of):
    """balls.pvd and balls/balls_0000.vtp ..., by write(frame, path) -> bytes; says how much `of` what."""
    path = pathlib.Path(arguments.file)
    place = path.with_suffix("")
    own = re.compile(re.escape(place.name) + r"_\d+\.vtp")
    digits = max(4, len(str(chosen[-1])))
    lines, total = [], 0
    with whole(path) as draft, whole_folder(place, own.fullmatch) as folder:
        for index in source.steps(chosen, arguments):
            name = f"{place.name}_{index:0{digits}d}.vtp"
            total += write(index, folder / name)
            link = quoteattr(f"{place.name}/{name}")
            lines.append(f'<DataSet timestep="{float(times[index])!r}" part="0" file={link}/>')
        draft.write_text(page(lines), encoding="utf-8")
    return f"{plural(len(lines), 'frame')} of {of}, {size(total)} in {place.name}/"


def page(lines):
    body = "\n".join(lines)
    return (
        '<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1" byte_order="LittleEndian">\n'
        f"<Collection>\n{body}\n</Collection>\n</VTKFile>\n"
    )
