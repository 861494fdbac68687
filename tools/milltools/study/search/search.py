"""A search for the best design: gets the next design from Optuna, runs it, and stores each result in Optuna.

One objective: `acquisition.choose`, which takes the noise of every run from its own standard error. (Optuna's own
Gaussian process ignores the noise of single trials and needs PyTorch.) Several: Optuna's NSGA-II (Deb, Pratap, Agarwal
& Meyarivan 2002), after a first generation from a Sobol sequence; a capped run, and one that does not meet a
requirement of the study, violates a constraint, so it ranks below every run that violates none. The proposals depend
only on the seed and the number of the trial: an interrupted search continues as if there had been no interruption.

Every run is a trial in Optuna's storage and a row in the table. The order is: make the trial; store "owner" (the
driver that runs it), "seed" and "id" of its run in it; run it; write the row into the table; write the row into the
trial, as "row" and with the constraint "capped"; give the trial its values. So if a driver is killed, the next one
can recover all finished runs: a trial whose row is in the table gets its values, a row without a trial gets a trial,
and a trial of this table without a row is run again. Trials of other drivers on the same storage (other tables) are
not touched; their rows are copied as they come.
"""

import contextlib
import datetime
import hashlib
import json
import math
import socket

import optuna
from optuna.distributions import CategoricalDistribution, FloatDistribution, IntDistribution
from optuna.trial import TrialState

from milltools.read.expression import excess
from milltools.study.plan.ranges import ABOUT, Range
from milltools.study.plan.sealed import plain
from milltools.study.search.acquisition import Budget, Tried, choose, spread, unfinished
from milltools.study.search.space import Space

ASKING = datetime.timedelta(minutes=5)  # longest time between a trial and its id, which another driver may be writing
ATTEMPTS = 100  # of NSGA-II to find a design that meets what is required of keys; then it is a spread one
CAPPED = "capped"  # Optuna's constraint: satisfied if not positive


# ---- designs in Optuna


def by_place(r: Range) -> bool:
    """Is the parameter of a key the place in the list of its values? Consecutive whole numbers are used directly. Steps
    computed by Optuna could differ from the deck's numbers."""
    gapless = r.whole and r.values[-1] - r.values[0] == len(r.values) - 1
    return r.numeric and r.values is not None and not gapless


def name(r: Range) -> str:
    """The name of the parameter: the key, with a mark if the parameter is a place in a list."""
    return f"{r.key} (place)" if by_place(r) else r.key


def distribution(r: Range):
    if r.values is None:
        return FloatDistribution(r.low, r.high, log=r.log)
    if not r.numeric:
        return CategoricalDistribution(r.values)
    return IntDistribution(0, len(r.values) - 1) if by_place(r) else IntDistribution(r.low, r.high)


def parameters(space: Space, design) -> dict:
    """The parameters of a design."""
    return {name(r): r.values.index(value) if by_place(r) else value for r, value in zip(space.ranges, design)}


def design_of(space: Space, params: dict) -> tuple | None:
    """The design of a trial's parameters; None if some are missing."""
    found = [params.get(name(r)) for r in space.ranges]
    if None in found:
        return None
    return tuple(r.values[value] if by_place(r) else value for r, value in zip(space.ranges, found))


class Sampler(optuna.samplers.BaseSampler):
    """Gives each trial the `design` that was chosen for it; without one, a design of NSGA-II, at first from
    `start`."""

    design: tuple | None = None
    start: tuple

    def __init__(self, space: Space, budget: Budget):
        self.space, self.budget = space, budget
        self.distributions = {name(r): distribution(r) for r in space.ranges}

    def infer_relative_search_space(self, study, trial):
        return self.distributions

    def sample_relative(self, study, trial, search_space):
        if self.design:
            return parameters(self.space, self.design)
        population = max(8, min(50, 2 * (self.budget.runs // 10)))
        seed = (self.budget.seed * 1_000_003 + trial.number) % 2**32
        for attempt in range(ATTEMPTS):
            self._evolution = optuna.samplers.NSGAIISampler(population_size=population, seed=seed + attempt)
            found = self._evolution.sample_relative(study, trial, search_space)
            if not found or not self.space.met:
                break
            for one, kind in search_space.items():  # what NSGA-II mutates
                if one not in found:
                    found[one] = self.sample_independent(study, trial, one, kind)
            if self.space.allowed([design_of(self.space, found)]):
                return found
        return found if found and not self.space.met else parameters(self.space, self.start)

    def sample_independent(self, *asked):
        """A parameter that NSGA-II mutates."""
        return self._evolution.sample_independent(*asked)


# ---- the search


def name_of(study) -> str:
    """The name of the study in the storage: searches with equal runs, ranges and goals share it."""
    ranges = [{name: getattr(r, name) for name in ABOUT} for r in study.vary]
    what = [study.fingerprint, [(o.path, o.goal) for o in study.objectives], ranges]
    what += [study.formulas.rules] * bool(study.formulas.rules)
    return f"millsim-{hashlib.sha256(json.dumps(what).encode()).hexdigest()[:16]}"


class Search:
    """`study`: a study_deck.Study. `table`: a table.Writer. `storage`: Optuna's. Rows in the table or in the
    storage count as runs of this search, unless it begins `anew`. `private`: no other driver uses this
    storage."""

    def __init__(self, study, table, storage, budget: Budget, private=True, anew=False):
        self.study, self.table, self.budget = study, table, budget
        self.space = Space(study.about()["vary"], study.formulas.met if study.formulas.rules else None)
        self.paths = [objective.path for objective in study.objectives]
        self.sampler = Sampler(self.space, budget)
        self.owner = f"{socket.gethostname()}:{table.path.resolve()}"
        name = name_of(study)
        if anew:
            with contextlib.suppress(KeyError):  # there may be none
                optuna.delete_study(study_name=name, storage=storage)
        self.optuna = optuna.create_study(
            study_name=name,
            storage=storage,
            directions=["maximize" if o.sign > 0 else "minimize" for o in study.objectives],
            sampler=self.sampler,
            load_if_exists=True,
        )
        self._out = {}  # id of an unfinished run -> id of its trial in the storage
        self._again = self._recover(private)

    # ---- existing runs

    def trials(self):
        return self.optuna.get_trials(deepcopy=False)

    def runs(self) -> list[Tried]:
        """All runs, of other drivers too, by their first objective, in the order of the trials."""
        found = []
        for trial in self.trials():
            design, row = design_of(self.space, trial.params), trial.user_attrs.get("row")
            if row is not None:
                values, error = self._values(row), row[f"{self.paths[0]}:error"]
                status = "failed" if row["status"] == "done" and not values else row["status"]
                value = values[0] if values else math.nan
                error = math.nan if error is None else error
                found.append(Tried(design, value, error, status, self._excess(row) if values else ()))
            elif trial.state == TrialState.RUNNING and "id" in trial.user_attrs:
                found.append(Tried(design, status="running"))
        return found

    def _values(self, row) -> list[float] | None:
        """The objectives of a row; None if it failed or one is not known (JSON has null for NaN)."""
        values = [math.nan if row[path] is None else row[path] for path in self.paths]
        return values if row["status"] != "failed" and all(map(math.isfinite, values)) else None

    def _excess(self, row) -> tuple:
        """For every requirement by how much the run of a row violates it, with the standard error."""
        return excess(row["results"], tuple(one.text for one in self.study.require))

    def _constraints(self, row) -> dict:
        """Optuna's constraints: satisfied if not positive."""
        found = {CAPPED: float(row["status"] == "capped")}
        if row["status"] != "failed":
            for one, (over, _) in zip(self.study.require, self._excess(row)):
                found[one.text] = over / (abs(one.limit) or 1) if math.isfinite(over) else 1.0
        return found

    def _recover(self, private) -> list:
        """Makes table and storage consistent; returns the trials of this table whose runs its driver did not finish."""
        latest = datetime.datetime.now() - ASKING
        rows = {row["id"]: row for row in self.table.rows()}
        again = []
        for trial in [trial for trial in self.trials() if trial.state == TrialState.RUNNING]:
            known = trial.user_attrs
            row = known.get("row") or rows.get(known.get("id"))
            if row is not None:
                self._tell(trial._trial_id, row)
            elif "id" not in known:
                if private or trial.datetime_start < latest:  # its driver ended before the design was chosen
                    self.optuna.tell(trial.number, state=TrialState.FAIL)
            elif known.get("owner") == self.owner:
                again.append(trial)
        self.take_over()
        known = {trial.user_attrs.get("id") for trial in self.trials()}
        for row in rows.values():
            if row["id"] not in known:
                self._adopt(row)
        return again

    def take_over(self):
        """Copies rows of other drivers, or of a lost table, into this table."""
        there = self.table.ids()
        for trial in self.trials():
            row = trial.user_attrs.get("row")
            if row is not None and row["id"] not in there:
                self.table.add(row)
                there.add(row["id"])

    def _adopt(self, row):
        """Makes a trial of a row, if its design is one of this search and keeps the requirements on keys."""
        values = self._values(row)
        if not self.space.allowed([[row[key] for key in self.space.keys]]):
            return
        with contextlib.suppress(ValueError):  # if a range was made smaller
            trial = optuna.trial.create_trial(
                state=TrialState.COMPLETE if values else TrialState.FAIL,
                values=values,
                params=parameters(self.space, [row[key] for key in self.space.keys]),
                distributions=self.sampler.distributions,
                user_attrs={"id": row["id"], "owner": self.owner, "row": plain(row)},
                constraints=self._constraints(row),
            )
            self.optuna.add_trial(trial)

    # ---- new runs

    def jobs(self, workers: int):
        """The jobs one by one, for filling.send, at most `workers` at once; None if it has to wait for a row."""
        while True:
            if len(self._out) >= workers:
                yield None
            elif self._again:
                yield self._job(self._again.pop(0))
            elif len(runs := self.runs()) >= self.budget.runs:
                return
            elif self._choose(runs):
                yield self._job(self.optuna.ask(self.sampler.distributions))
            elif self._out:
                yield None  # unfinished runs may make another run necessary
            else:
                return

    def _choose(self, runs) -> bool:
        """Gives the sampler the design of the next trial; False if no further run is needed."""
        if len(self.paths) == 1:
            self.sampler.design = choose(self.space, runs, self.budget)
            return self.sampler.design is not None
        self.sampler.design = unfinished(runs, self.budget.replicates)
        self.sampler.start = spread(self.space, [run.design for run in runs], self.budget)
        return True

    def _job(self, trial):
        """The job of a trial; its id and owner are in the storage before it is run."""
        design = design_of(self.space, trial.params)
        number, replicate = self._number(design, trial._trial_id)
        job = self.study.job(number, dict(zip(self.space.keys, design, strict=True)), replicate)
        self._out[job["id"]] = trial._trial_id
        for what, value in (("owner", self.owner), ("seed", job["seed"]), ("id", job["id"])):
            self.optuna._storage.set_trial_user_attr(trial._trial_id, what, value)
        return job

    def _number(self, design, trial_id):
        """Number of the design, in the order of first runs, and number of this run of the design."""
        seen, replicate = {}, 0
        for trial in self.trials():
            if trial._trial_id == trial_id:
                break
            other = design_of(self.space, trial.params)
            if other is not None and (trial.state != TrialState.FAIL or "id" in trial.user_attrs):
                seen.setdefault(other, len(seen))
                replicate += other == design
        return seen.setdefault(design, len(seen)), replicate

    def take(self, row):
        """Stores a new row."""
        self.table.add(row)
        self._tell(self._out.pop(row["id"]), row)

    def _tell(self, trial_id, row):
        storage, values = self.optuna._storage, self._values(row)
        number, state = storage.get_trial_number_from_id(trial_id), TrialState.COMPLETE if values else TrialState.FAIL
        with contextlib.suppress(optuna.exceptions.UpdateFinishedTrialError):  # another driver was faster
            storage.set_trial_user_attr(trial_id, "row", plain(row))
            for name, excess in self._constraints(row).items():
                storage.set_trial_system_attr(trial_id, f"constraints:{name}", excess)
            self.optuna.tell(number, values, state=state, skip_if_finished=True)

    @property
    def out(self) -> int:
        """The number of unfinished runs of other drivers."""
        return sum(run.status == "running" for run in self.runs())
