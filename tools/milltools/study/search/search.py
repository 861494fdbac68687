"""A search for the best design: asks Optuna what to run next, sends it, tells what came out, and forgets nothing.

Every run is a trial in Optuna's storage and a row in the table. In this order: the trial is made; "id" and "owner" are noted
with it; it is run; the row goes into the table; the row goes into the trial; the trial is told its values. So whenever a
driver is killed, the next one finds out from the two what was paid for: a trial whose row is in the table is told, a row that the
storage does not know is made a trial, and a trial of this table without a row is run again. Trials of other
drivers on the same storage (other tables) are left to them; their rows are taken over as they come.
"""

import contextlib
import datetime
import hashlib
import json
import math
import socket

import optuna
from optuna.trial import TrialState

from milltools.study.search import sampler as optunas
from milltools.study.search.acquisition import Budget
from milltools.study.search.space import Space

ASKING = datetime.timedelta(minutes=5)  # longest between a trial and its id, which others may be making
CAPPED = "capped"  # Optuna's constraint: satisfied where not positive


def name_of(study) -> str:
    """The study's name in the storage: searches of the same runs, ranges and goals share one."""
    what = [study.fingerprint, [(o.path, o.goal) for o in study.objectives], study.about()["vary"]]
    return f"millsim-{hashlib.sha256(json.dumps(what).encode()).hexdigest()[:16]}"


def forget(study, storage):
    """Takes the search out of the storage, if it is there."""
    with contextlib.suppress(KeyError):
        optuna.delete_study(study_name=name_of(study), storage=storage)


class Search:
    """`study`: the study deck (deck.Study). `table`: a table.Writer. `storage`: Optuna's. Rows that are known to
    the table or to the storage are runs of this search at once. `private`: no other driver has this storage."""

    def __init__(self, study, table, storage, budget: Budget, private=True):
        self.study, self.table, self.budget = study, table, budget
        about = study.about()
        self.space = Space(about["vary"])
        self.paths = [objective.path for objective in study.objectives]
        self.sampler = optunas.Sampler(self.space, budget, self.paths)
        self.owner = f"{socket.gethostname()}:{table.path.resolve()}"
        self.optuna = optuna.create_study(
            study_name=name_of(study),
            storage=storage,
            directions=["maximize" if o.sign > 0 else "minimize" for o in study.objectives],
            sampler=self.sampler,
            load_if_exists=True,
        )
        self._out = {}  # id of a run that is out -> its trial's id in the storage
        self._again = self._recover(private)

    # ---- what there is

    def trials(self):
        return self.optuna.get_trials(deepcopy=False)

    def runs(self) -> list:
        """All runs (acquisition.Run), of other drivers too."""
        return optunas.runs_of(self.space, self.optuna, self.paths)

    def _recover(self, private) -> list:
        """Brings table and storage together; returns the trials of this table that were out when its driver ended."""
        latest = datetime.datetime.now() - (datetime.timedelta(0) if private else ASKING)
        rows = {row["id"]: row for row in self.table.rows()}
        again = []
        for trial in self.trials():
            known, own = trial.user_attrs, trial.user_attrs.get("owner") == self.owner
            row = known.get("row") or rows.get(known.get("id"))
            if row is not None and trial.state == TrialState.RUNNING:
                self._tell(trial._trial_id, row)
            elif row is None and trial.state == TrialState.RUNNING and own and "id" in known:
                again.append(trial)
            elif trial.state == TrialState.RUNNING and "id" not in known:
                if trial.datetime_start < latest:  # its driver ended before it knew what to run
                    self.optuna.tell(trial.number, state=TrialState.FAIL)
        self.take_over()
        known = {trial.user_attrs.get("id") for trial in self.trials()}
        for row in rows.values():
            if row["id"] not in known:
                self._adopt(row)
        return again

    def take_over(self):
        """Puts rows of other drivers, or of a table that was lost, into this table."""
        there = self.table.ids()
        for trial in self.trials():
            row = trial.user_attrs.get("row")
            if row is not None and row["id"] not in there:
                self.table.add(row)
                there.add(row["id"])

    def _adopt(self, row):
        """Makes a trial of a row, if its design is one of this search."""
        design = tuple(row[key] for key in self.space.keys)
        values = [row[path] for path in self.paths]
        good = row["status"] != "failed" and all(map(math.isfinite, values))
        try:
            trial = optuna.trial.create_trial(
                state=TrialState.COMPLETE if good else TrialState.FAIL,
                values=values if good else None,
                params=optunas.parameters(self.space, design),
                distributions=optunas.distributions(self.space),
                user_attrs={"id": row["id"], "owner": self.owner, "row": plain(row)},
                constraints={CAPPED: float(row["status"] == "capped")},
            )
        except ValueError:  # a range was made smaller
            return
        self.optuna.add_trial(trial)

    # ---- what is to be run

    def jobs(self, workers: int):
        """The jobs, one by one, for sending.send: at most `workers` are out; None where it has to wait for a row."""
        for trial in self._again:
            while len(self._out) >= workers:
                yield None
            yield self._job(trial._trial_id, trial.params)
        while True:
            while len(self._out) >= workers:
                yield None
            if len(self.runs()) >= self.budget.runs:
                return
            if self.sampler.propose(self.optuna) is None:
                if not self._out:
                    return
                yield None  # what is still out may raise the question again
                continue
            trial = self.optuna.ask(optunas.distributions(self.space))
            yield self._job(trial._trial_id, trial.params)

    def _job(self, trial_id, params):
        """The job of a trial; its id and owner are in the storage before it is run."""
        design = optunas.design_of(self.space, params)
        number, replicate = self._number(design, trial_id)
        job = self.study.job(number, dict(zip(self.space.keys, design, strict=True)), replicate)
        self._out[job["id"]] = trial_id
        storage = self.optuna._storage
        storage.set_trial_user_attr(trial_id, "owner", self.owner)
        storage.set_trial_user_attr(trial_id, "seed", job["seed"])
        storage.set_trial_user_attr(trial_id, "id", job["id"])
        return job

    def _number(self, design, trial_id):
        """Number of the design in the order they came, and of this run of it."""
        seen, replicate = {}, 0
        for trial in self.trials():
            other = optunas.design_of(self.space, trial.params)
            if trial._trial_id == trial_id:
                break
            if other is None or (trial.state == TrialState.FAIL and "id" not in trial.user_attrs):
                continue
            seen.setdefault(other, len(seen))
            replicate += other == design
        return seen.setdefault(design, len(seen)), replicate

    def take(self, row):
        """A row has come."""
        self.table.add(row)
        self._tell(self._out.pop(row["id"]), row)

    def _tell(self, trial_id, row):
        storage = self.optuna._storage
        storage.set_trial_user_attr(trial_id, "row", plain(row))
        storage.set_trial_system_attr(trial_id, f"constraints:{CAPPED}", float(row["status"] == "capped"))  # fmt: skip
        values = [optunas.finite(row[path]) for path in self.paths]
        number = storage.get_trial_number_from_id(trial_id)
        if row["status"] == "failed" or not all(map(math.isfinite, values)):
            self.optuna.tell(number, state=TrialState.FAIL)
        else:
            self.optuna.tell(number, values)

    @property
    def out(self) -> int:
        """Runs that other drivers have not ended yet."""
        return sum(run.status == "running" for run in self.runs())


def plain(row) -> dict:
    """A row as JSON has it: what is not known is null."""
    found = {}
    for key, value in row.items():
        value = value.item() if hasattr(value, "item") else value
        found[key] = None if isinstance(value, float) and not math.isfinite(value) else value
    return found
