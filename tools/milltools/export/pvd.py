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
    return collection(arguments, (_balls,))


def mill(arguments):
    return collection(arguments, (_mill,))


def both(arguments):
    """Part 0 of each frame is the balls, part 1 the bodies of the mill."""
    return collection(arguments, (_balls, _mill))


def _balls(arguments, run):
    kept = vtp.still(run)
    return f"{len(kept['id'])} balls", lambda index, time, path: vtp.write_balls(run, index, time, kept, path)


def _mill(arguments, run):
    bodies = vtp.Bodies(source.deck_of(arguments), arguments)
    return ", ".join(bodies.at_start), lambda index, time, path: bodies.write(time, path, run.poses(index))


def collection(arguments, makers):
    """Writes balls.pvd and balls/balls_0000.vtp ... A maker gives, for a run, a name and a function write(frame, time
    [s], path) -> bytes. Of several parts, the later ones are balls/balls_0000_1.vtp ..."""
    if source.kind_of(arguments.source) == "deck" and _mill in makers:
        raise UserError(f"{arguments.file}: a deck has no frames: give a run, or write .stl or .vtp")
    with source.open_run(arguments) as run:
        return _collection(arguments, run, [make(arguments, run) for make in makers])


def _collection(arguments, run, parts):
    chosen, times = source.many(run, arguments), source.stored(run)
    path = pathlib.Path(arguments.file)
    place = path.with_suffix("")
    own = re.compile(re.escape(place.name) + r"_\d+(_1)?\.vtp")
    digits = max(4, len(str(chosen[-1])))
    lines, total = [], 0
    with whole(path) as draft, whole_folder(place, own.fullmatch) as folder:
        for index in source.steps(chosen, arguments):
            for part, (_, write) in enumerate(parts):
                name = f"{place.name}_{index:0{digits}d}{'_1' * part}.vtp"
                total += write(index, times[index], folder / name)
                link = quoteattr(f"{place.name}/{name}")
                lines.append(f'<DataSet timestep="{float(times[index])!r}" part="{part}" file={link}/>')
        draft.write_text(HEAD + "\n".join(lines) + TAIL, encoding="utf-8")
    words = f"{plural(len(chosen), 'frame')} of {', '.join(of for of, _ in parts)}, {size(total)} in {place.name}/"
    return words, {"folder": place, "frames": len(chosen), "bytes": total}
