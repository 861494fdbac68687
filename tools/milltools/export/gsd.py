"""Frames as GSD in HOOMD's schema, for OVITO, HOOMD and freud.

Quantities that GSD has a name for go there (single precision, as in the frames of the run). Spins go into
log/particles/angular_velocity, because GSD's own `angmom` is a quaternion in the frame of the body, and balls have no
orientation. The exact time of a frame goes into log/time. The box of GSD is always periodic, so the box is wider than
the space that the container sweeps, by a ball on each side. Otherwise balls at opposite walls would be neighbours.
Between periodic ends they are, so along x the box is then as long as the drum.
"""

import os

import numpy as np

from milltools.base.extras import needs
from milltools.base.files import whole
from milltools.base.text import size
from milltools.export import source
from milltools.geometry.bodies import Mill


def balls(arguments):
    needs("export", "gsd")
    import gsd.fl
    import gsd.hoomd

    with source.open_run(arguments) as run:
        chosen, times = source.many(run, arguments), source.stored(run)
        frame, diameter = gsd.hoomd.Frame(), run.balls("diameter")
        hull = np.abs(Mill.of(run).hull).max(axis=0)  # GSD's box is about the origin
        frame.configuration.box = [*(2 * hull + 2 * diameter.max()), 0, 0, 0]
        frame.configuration.box[0] = run.slice_length or frame.configuration.box[0]
        frame.particles.N = len(diameter)
        frame.particles.types = run.species_names()
        frame.particles.typeid = run.balls("species")
        frame.particles.diameter = diameter.astype(np.float32)
        frame.particles.mass = run.balls("mass").astype(np.float32)
        with whole(arguments.file) as draft:
            file = gsd.fl.GSDFile(str(draft), "w", f"{run.program} {run.version}", "hoomd", [1, 4])
            with gsd.hoomd.HOOMDTrajectory(file) as out:
                for index in source.steps(chosen, arguments):  # data as in the first frame are not repeated
                    frame.configuration.step = int(run.read("particles/trajectory/position/step", index))
                    frame.particles.position = run.frame(index, "position")
                    frame.particles.velocity = run.frame(index, "velocity")
                    frame.log["time"] = np.array([times[index]])
                    frame.log["particles/angular_velocity"] = run.frame(index, "angular_velocity")
                    out.append(frame)
        total = os.path.getsize(arguments.file)
        return f"{source.count(chosen, len(diameter))}, {size(total)}", {"frames": len(chosen), "bytes": total}
