"""What moves in the mill of another program's run: poses of its motions, and the work that they do. A part of Results."""

import math

import numpy as np

import milltools.tally_write as sheet
from milltools.h5write import append, make_column
from milltools.read.schema import POSE
from milltools.tally import Blocks


class Moved:
    """Of a Results, which has the deck, the rows of the time series and the file."""

    def _rotor(self, time):
        if "rotor" not in self.deck.sections:
            return {}
        angle = self.deck.number("rotor.angle", 0.0) + self.rotor_speed * time
        c, s = math.cos(angle), math.sin(angle)
        return {"rotor": ([[1, 0, 0], [0, c, -s], [0, s, c]], np.zeros(3))}

    def _append_pose(self, name, values):
        if name not in self.poses:
            group = self.scratch.require_group(f"pose/{name}")
            self.poses[name] = {
                part: make_column(group, part, shape, "<f8", unit, text) for part, (shape, unit, text) in POSE.items()
            }
        for part, column in self.poses[name].items():
            append(column, [values[part]])

    def _tells_motions(self):
        """Whether it is known what each motion does."""
        names = [f"motion_work/{name}" for name in self.deck.motions]
        return not any(np.isnan(self.series[name]).any() for name in names)

    def _write_poses(self, file):
        """Where motions are in the frames, as far as that was told."""
        first = file["particles/trajectory/position"]
        for name in self.poses:
            group = file.create_group(f"observables/pose/{name}")
            for part in POSE:
                self.scratch.copy(f"pose/{name}/{part}", group.create_group(part), "value")
                group[f"{part}/step"], group[f"{part}/time"] = first["step"], first["time"]
            for shared in ("step", "time", "value"):
                group[shared] = group[f"rotation/{shared}"]

    def _write_drive(self, group, mean, times, series):
        """Of all motions; blocks are periods of the slowest."""
        deck, motions = self.deck, {}
        rates = {n: deck.number("rotor.speed" if n == "rotor" else f"motion.{n}.speed", 0.0) for n in deck.motions}  # fmt: skip
        cycles = [2 * math.pi * deck.number(f"motion.{n}.frequency", 0.0) for n in deck.motions]
        slowest = min(filter(None, [*map(abs, rates.values()), *cycles]), default=0.0)
        work = {name: series[f"motion_work/{name}"] for name in deck.motions}

        def blocks_of(sums):
            blocks, sums = Blocks(slowest, self.begin, self.end), sums[: len(times)]
            blocks.close(times, sums, sums)
            return blocks

        for name, sums in work.items():
            power, error = mean(sums, math.nan), sheet.block_error(blocks_of(sums).power)
            rate = rates[name] or math.nan
            motions[name] = power, error, power / rate, error / abs(rate)
        total = sum(work.values(), np.zeros(len(self.times)))
        sheet.put_drive(group, blocks_of(total), mean(total, math.nan), motions)
