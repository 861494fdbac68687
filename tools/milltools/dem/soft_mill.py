"""A mill in LIGGGHTS, run in parts of constant stiffness; its samples become the results of a run as they come."""

import contextlib
import math
import pathlib
import tempfile

import numpy as np

from milltools.base.errors import UserError
from milltools.dem import script
from milltools.dem.liggghts import Liggghts, states
from milltools.dem.model import STEPS_PER_SAMPLE, Model
from milltools.dem.setup import setup_of
from milltools.foreign.digest import snapshot_times

HALF_AN_INTERVAL = 0.5
WATCHED = 10  # samples between two calls of `watch`
PRICED = 0.01  # of the steps are run again without output, once and threefold: the cost of LIGGGHTS alone
LEAST_PRICED = 1000  # steps


class SoftMill:
    """The mill of a deck; its samples go to `results`, a milltools.foreign.digest.Digest, which finds the contacts;
    `watch(time)` is called with the progress.

    run(modulus, until) continues from the present time to `until` [s] at a Young's modulus [Pa]. `state` is in the
    frame of the deck's setup, all else in the laboratory.
    """

    def __init__(self, deck, state, damped, results, ranks=1, watch=None):
        self.deck, self.state, self.damped, self.results = deck, state, damped, results
        self.ranks, self.watch = ranks, watch or (lambda time: None)
        self.time, self.end = 0.0, deck.number("run.time")
        self.series, self.frames = deck.number("output.series"), deck.number("output.frames")
        self.mass, self.diameter = np.array([(k.mass, k.diameter) for k in deck.species])[deck.species_of_ball].T.copy()
        self.setup = setup_of(deck)
        self.work = dict.fromkeys(["rotor", *deck.motions], 0.0)  # [J] so far
        self.rotor_impulse, self.told = 0.0, -math.inf  # [N m s]; [s] of the last account
        self.snapshots = snapshot_times(deck)
        self.model, self.version = None, "unknown"
        self.rubs = any(deck.contact(kind).friction > 0 for kind in deck.kinds)
        self.normal_loss, self.rubbed, self.isolated_loss = np.zeros((3, len(deck.kinds)))
        self.begin_energy, self.removed, self.unbalanced, self.turnover = None, 0.0, 0.0, 0.0
        self.rows = self.frame_count = self.snapshot_count = 0
        self.cpu = self.deepest = 0.0

    @contextlib.contextmanager
    def _liggghts(self, model, steps, **options):
        """LIGGGHTS running this number of steps from now on; options as in script.write."""
        with tempfile.TemporaryDirectory(prefix="mill-dem-", ignore_cleanup_errors=True) as name:
            folder, begin = pathlib.Path(name), (self.time, self.state)
            text, meshes = script.write(folder, self.deck, model, self.damped, steps, *begin, **options)
            triangles = [len(mesh.triangles) for mesh in meshes]
            with Liggghts(folder, text, len(self.mass), triangles, self.ranks) as process:
                yield process

    def price(self, steps):
        """Processor seconds of LIGGGHTS for one simulated second from now on, without output, from the difference of
        two runs: one of `steps` steps, one of three times as many. Uses the model of the last part."""
        steps = max(LEAST_PRICED, round(PRICED * steps))
        taken = []
        for count in (steps, 3 * steps):
            with self._liggghts(self.model, count, told=False) as process:
                taken.append(process.finish())
        price = (taken[1] - taken[0]) / (2 * steps * self.model.time_step)
        return price if price > 0 else math.nan  # NaN for a mill so small that the start costs more

    def run(self, modulus, until):
        before, self.model = self.model, Model(self.deck, modulus)
        model = self.model
        if before:
            self.removed += self._energy(self.results.ask())
        self.results.springs(model.sample_interval, self.damped, model.springs())
        if before:  # overlaps that softer springs left would throw balls apart
            self.results.part()
            try:
                parted = self.results.ask()
            except UserError as fault:
                raise UserError(f"choose a larger modulus for --warm-up: {fault}", 1) from None
            self.removed -= self._energy(parted)
            self.state = self.setup.frame.from_laboratory(self.time, *parted.state)
        samples, process = max(1, round((until - self.time) / model.sample_interval)), None
        try:
            with self._liggghts(model, samples * STEPS_PER_SAMPLE) as process:
                self._follow(process, samples)
        finally:
            self.cpu += process.cpu if process else 0.0

    def _follow(self, process, samples):
        begin, model, frame = self.time, self.model, self.setup.frame
        place = frame.of(begin)
        sample, rows = -1, None
        for sample, (step, rows) in enumerate(process.samples(samples + 1)):
            if step != sample * STEPS_PER_SAMPLE:
                raise UserError(f"LIGGGHTS wrote step {step} where step {sample * STEPS_PER_SAMPLE} was expected", 1)
            if sample == 0:
                self.version = process.version()
            self.time = begin + sample * model.sample_interval
            place = frame.of(self.time) if frame.moves else place
            # the observers get the sample nearest to each time that they need
            after = self.time + HALF_AN_INTERVAL * model.sample_interval
            row = sample % model.samples_per_row == 0 and after > self.rows * self.series
            framed = self.frames > 0 and after > self.frame_count * self.frames
            snapped = self.snapshot_count < len(self.snapshots) and self.snapshots[self.snapshot_count] < after
            self.snapshot_count += snapped
            self.frame_count += framed
            self.results.sample(self.time, row or framed or snapped, place, rows)
            if row:
                self._row(process, sample // model.samples_per_row)
            if sample % WATCHED == 0:
                self.watch(self.time)
        if sample == samples:
            self.state = states(rows)
        process.finish()
        self.version = process.version()
        if sample < samples:
            raise UserError("LIGGGHTS ended before its run was over", 1)

    def _energy(self, answer):
        place, velocity, spin = answer.state
        square = np.einsum("ij,ij->i", velocity, velocity) + 0.1 * self.diameter**2 * np.einsum("ij,ij->i", spin, spin)
        return self.mass @ (0.5 * square - place @ self.setup.frame.g) + answer.elastic

    def _drive(self, process, row, answer):
        """Adds the work of a row. LIGGGHTS sums it over its steps, if the container does not move."""
        setup, speed = self.setup, self.deck.rotor_speed
        if setup.moves:
            self.work.update(zip(self.deck.motions, answer.work, strict=True))
            return
        columns = bool(self.deck.blades) + len(setup.driven)
        told = process.told_of("torque.txt", row, columns) if columns else []
        torque = process.told_of("shaft.txt", row, 1)[0] if setup.shafts else 0.0
        torque -= told.pop(0) if self.deck.blades else 0.0
        self.work["rotor"] += torque * speed * self.series
        for mesh, power in zip(setup.driven, told, strict=True):
            self.work[mesh.motion.name] += power * self.series
            if mesh.motion.name == "rotor" and speed:
                torque += power / speed
        self.rotor_impulse += torque * self.series

    def _row(self, process, row):
        answer = self.results.ask()
        if row > 0:
            self._drive(process, row, answer)
        self.deepest, self.isolated_loss, self.normal_loss = answer.deepest, answer.isolated, answer.normal
        normal, total = answer.normal, self._energy(answer)
        if self.begin_energy is None:
            self.begin_energy = total
        work, change = sum(self.work.values()), total - self.begin_energy
        self.rubbed[1:] = answer.rubbed[1:]
        missing = work - change - self.removed - normal.sum() - self.rubbed[1:].sum()
        self.turnover = max(self.turnover, abs(work), normal.sum(), abs(change))
        if self.rubs:
            self.rubbed[0] = missing
        else:
            self.unbalanced = missing
        values = {"elastic_energy": answer.elastic}
        for name in self.deck.motions:
            work, speed = self.work[name], self.deck.number(f"motion.{name}.speed", 0.0)
            values[f"motion_work/{name}"] = work
            if name == "rotor":
                values["motion_impulse/rotor"] = self.rotor_impulse
            elif speed:
                values[f"motion_impulse/{name}"] = work / speed
        for k, kind in enumerate(self.deck.kinds):
            values[f"dissipation_normal/{kind}"] = normal[k]
            values[f"dissipation/{kind}"] = normal[k] + self.rubbed[k]
        self.told = min(self.rows * self.series, self.end)
        self.results.account(self.told, values)
        self.rows += 1
