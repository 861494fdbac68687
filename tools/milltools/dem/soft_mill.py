"""A mill in LIGGGHTS, run in parts of constant stiffness; its samples become the results of a run as they come."""

import contextlib
import math
import pathlib
import tempfile

import numpy as np

from milltools.base.errors import UserError
from milltools.dem import script
from milltools.dem.contacts import Contacts, part
from milltools.dem.liggghts import Liggghts
from milltools.dem.model import STEPS_PER_SAMPLE, Model
from milltools.dem.setup import setup_of
from milltools.dem.work import Drive, at_walls
from milltools.foreign.digest import snapshot_times

RUBBING_INTERVAL = 20e-6  # [s] between outputs of the tangential forces
HALF_AN_INTERVAL = 0.5
PRICED = 0.01  # of the steps are run again without output, once and threefold: the cost of LIGGGHTS alone
LEAST_PRICED = 1000  # steps


class SoftMill:
    """The mill of a deck; `results` takes its results (see milltools.foreign.digest), `watch(time)` is called with the
    progress.

    run(modulus, until) continues from the present time to `until` [s] at a Young's modulus [Pa]. `state` and all other
    values are in the frame of the deck's setup; only the results are in the laboratory frame.
    """

    def __init__(self, deck, state, damped, results, ranks=1, watch=None):
        self.deck, self.state, self.damped, self.results = deck, state, damped, results
        self.ranks, self.watch = ranks, watch or (lambda time: None)
        self.time, self.end = 0.0, deck.number("run.time")
        self.series, self.frames = deck.number("output.series"), deck.number("output.frames")
        bodies = [(kind.mass, kind.diameter) for kind in deck.species]
        self.mass, diameters = np.array(bodies)[deck.species_of_ball].T.copy()
        self.inertia = 0.1 * self.mass * diameters**2
        self.setup = setup_of(deck)
        self.drive = Drive(self.setup, self.mass, self.inertia)
        self.rotor_impulse, self.told = 0.0, -math.inf  # [N m s]; [s] of the last account
        self.snapshots = snapshot_times(deck)
        self.columns = bool(deck.blades) + len(self.setup.driven)
        self.contacts, self.model, self.waiting, self.version = None, None, [], "unknown"
        self.rubs = any(deck.contact(kind).friction > 0 for kind in deck.kinds)
        self.normal_loss, self.rubbed, self.isolated_loss = np.zeros((3, len(deck.kinds)))
        self.begin_energy, self.removed, self.unbalanced, self.turnover = None, 0.0, 0.0, 0.0
        self.rows = self.frame_count = self.snapshot_count = 0
        self.cpu = self.deepest = 0.0

    @contextlib.contextmanager
    def _liggghts(self, model, steps, forces_every, dumps, **options):
        """LIGGGHTS running this number of steps from now on; options as in script.write."""
        with tempfile.TemporaryDirectory(prefix="mill-dem-", ignore_cleanup_errors=True) as name:
            folder, begin = pathlib.Path(name), (self.time, self.state)
            text, meshes = script.write(folder, self.deck, model, self.damped, steps, forces_every, *begin, **options)
            triangles = [len(mesh.triangles) for mesh in meshes]
            with Liggghts(folder, text, len(self.mass), triangles, self.ranks, dumps) as process:
                yield process

    def price(self, steps):
        """Processor seconds of LIGGGHTS for one simulated second from now on, without output, from the difference of
        two runs: one of `steps` steps, one of three times as many. Uses the model of the last part."""
        steps = max(LEAST_PRICED, round(PRICED * steps))
        taken = []
        for count in (steps, 3 * steps):
            with self._liggghts(self.model, count, 1, (), told=False) as process:
                taken.append(process.finish())
        price = (taken[1] - taken[0]) / (2 * steps * self.model.time_step)
        return price if price > 0 else math.nan  # NaN for a mill so small that the start costs more

    def run(self, modulus, until):
        model = Model(self.deck, modulus)
        before, contacts = self.contacts, Contacts(self.deck, model)
        if before:
            self.removed += sum(self._energies().values())
            self.state[0] = part(Contacts(self.deck, model), self.time, *self.state[:2])
            self.drive.settle(keep=0)
        self.contacts = contacts
        if before:
            self.removed -= sum(self._energies().values())
        samples = max(1, round((until - self.time) / model.sample_interval))
        every = max(1, round(RUBBING_INTERVAL / model.sample_interval)) if self.rubs else 0
        dumps, process = ["state.bin"] + ["walls.bin"] * self.rubs, None
        try:
            steps = samples * STEPS_PER_SAMPLE
            with self._liggghts(model, steps, every * STEPS_PER_SAMPLE, dumps) as process:
                self._follow(process, samples, every)
            self.model = model
        finally:
            self.cpu += process.cpu if process else 0.0
            self.normal_loss += contacts.normal_loss
            self.isolated_loss += contacts.isolated_loss
            self.deepest = contacts.deepest  # of this part: an earlier, softer part does not count

    def _follow(self, process, samples, forces_every):
        begin, flat, contacts = self.time, np.empty((len(self.mass), 9)), self.contacts
        for sample in range(samples + 1):
            step = process.state(flat)
            if step is None:
                break
            if step != sample * STEPS_PER_SAMPLE:
                raise UserError(f"LIGGGHTS wrote step {step} where step {sample * STEPS_PER_SAMPLE} was expected", 1)
            if sample == 0:
                self.version = process.version()
            # all is read before the time advances: so an interrupt cannot leave half of a sample
            forces = process.walls(len(self.setup.acting)) if forces_every and sample % forces_every == 0 else None
            self.time = begin + sample * contacts.interval
            self.state = [*flat.reshape(-1, 3, 3).swapaxes(0, 1).copy()]
            impacts = contacts.sample(self.time, *self.state)
            self.drive.sample(self.time, *self.state)
            if forces is not None:
                power, torque = at_walls(contacts, self.state, forces.reshape(len(forces), -1, 3))
                self.rubbed += power * forces_every * contacts.interval
                self.drive.shaft_impulse += torque * forces_every * contacts.interval
            if impacts is not None:
                self.waiting.append(self._outside(impacts))
            self._store(process, sample)
            self.watch(self.time)
        process.finish()
        self.version = process.version()
        if step is None:
            raise UserError("LIGGGHTS ended before its run was over", 1)

    def flush(self):
        """Passes on the collected impacts: many at a time are cheaper than few."""
        waiting, self.waiting = self.waiting, []
        if not waiting:
            return
        joined = np.concatenate(waiting)
        # an impact found at a sample began after the sample before, but for rounding
        joined["time"] = np.maximum(joined["time"], self.told)
        self.results.impacts(joined)

    def _outside(self, impacts):
        """Impacts in the laboratory frame at their own times: the frame has moved since."""
        frame = self.setup.frame
        gone = (impacts["time"] - self.time)[:, None] * frame.track(self.time, 1)
        impacts["position"] = impacts["position"] @ frame.rows + frame.track(self.time) + gone
        impacts["normal"] = impacts["normal"] @ frame.rows
        return impacts

    def _store(self, process, sample):
        """Stores the balls at the sample nearest to each time that the observers need, then the account of a row."""
        model = self.contacts.model
        after = self.time + HALF_AN_INTERVAL * model.sample_interval
        row = sample % model.samples_per_row == 0 and after > self.rows * self.series
        frame = self.frames > 0 and after > self.frame_count * self.frames
        snapshots = int(np.searchsorted(self.snapshots, after))  # due before
        if row or frame or snapshots > self.snapshot_count:
            self.results.state(self.time, *self.setup.frame.to_laboratory(self.time, *self.state))
        self.frame_count += frame
        self.snapshot_count = snapshots
        if row:
            self._row(process, sample // model.samples_per_row)

    def _energies(self):
        place, velocity, spin = self.setup.frame.to_laboratory(self.time, *self.state)
        return {
            "kinetic_energy": 0.5 * self.mass @ np.einsum("ij,ij->i", velocity, velocity),
            "rotational_energy": 0.5 * self.inertia @ np.einsum("ij,ij->i", spin, spin),
            "potential_energy": -self.mass @ (place @ self.setup.frame.g),
            "elastic_energy": self.contacts.elastic.sum(),
        }

    def _row(self, process, row):
        if row > 0:
            self.drive.row(process.told_of(row, self.columns), self.series)
        normal = self.normal_loss + self.contacts.normal_loss
        energies = self._energies()
        total = sum(energies.values())
        if self.begin_energy is None:
            self.begin_energy = total
        work, change = sum(self.drive.work.values()), total - self.begin_energy
        missing = work - change - self.removed - normal.sum() - self.rubbed[1:].sum()
        self.turnover = max(self.turnover, abs(work), normal.sum(), abs(change))
        if self.rubs:
            self.rubbed[0] = missing
        else:
            self.unbalanced = missing
        self.rotor_impulse += self.drive.torque * self.series
        values = {"elastic_energy": energies["elastic_energy"]}
        for name in self.deck.motions:
            work, speed = self.drive.work[name], self.deck.number(f"motion.{name}.speed", 0.0)
            values[f"motion_work/{name}"] = work
            if name == "rotor":
                values["motion_impulse/rotor"] = self.rotor_impulse
            elif speed:
                values[f"motion_impulse/{name}"] = work / speed
        for k, kind in enumerate(self.deck.kinds):
            values[f"dissipation_normal/{kind}"] = normal[k]
            values[f"dissipation/{kind}"] = normal[k] + self.rubbed[k]
        self.flush()
        self.told = min(self.rows * self.series, self.end)
        self.results.account(self.told, values)
        self.rows += 1
