"""The optimiser as Optuna sees it: distributions of the varied keys, trials as runs, and a sampler of ours.

One objective: `acquisition.choose`, which takes the noise of every run from its own standard error. (Optuna's own Gaussian process knows no
noise of single trials and needs PyTorch.) Several: Optuna's NSGA-II (Deb, Pratap, Agarwal & Meyarivan 2002), after a first
generation from a Sobol sequence; a capped run violates a constraint, so that it is inferior to any that is not.

What a trial knows stands in its user attributes: "id" and "seed" of its run from the moment it is to be run, "owner" (the driver
that runs it), and "row", the whole row of the table, as soon as it is there; with it comes the constraint "capped". A sampler draws from the seed and the
number of the trial alone: an interrupted search goes on as if nothing had happened.
"""

import math

import optuna
from optuna.distributions import CategoricalDistribution, FloatDistribution, IntDistribution
from optuna.trial import TrialState

from milltools.study.search.acquisition import Budget, Tried, choose, spread, unfinished
from milltools.study.search.space import Space, Variable


def distribution(variable: Variable):
    """A word is one of its words; a consecutive whole number itself; of other lists it is the place in the list, for Optuna's
    steps are computed and need not meet the deck's numbers."""
    values = variable.values
    if values is None:
        return FloatDistribution(variable.low, variable.high, log=variable.log)
    if variable.words:
        return CategoricalDistribution(values)
    if _consecutive(values):
        return IntDistribution(values[0], values[-1])
    return IntDistribution(0, len(values) - 1)


def name(variable: Variable) -> str:
    """The parameter's name: the key, or what says that it is a place in a list."""
    listed = variable.values is not None and not variable.words
    return f"{variable.key} (place)" if listed and not _consecutive(variable.values) else variable.key


def _consecutive(values) -> bool:
    return all(isinstance(v, int) for v in values) and values[-1] - values[0] == len(values) - 1


def distributions(space: Space) -> dict:
    return {name(v): distribution(v) for v in space.variables}


def parameters(space: Space, design) -> dict:
    """The parameters of a design."""
    found = {}
    for v, value in zip(space.variables, design):
        listed = name(v) != v.key
        found[name(v)] = v.values.index(value) if listed else value
    return found


def design_of(space: Space, params: dict) -> tuple | None:
    """The design of a trial's parameters; None where it has not got them all."""
    if any(name(v) not in params for v in space.variables):
        return None
    return tuple(v.values[params[name(v)]] if name(v) != v.key else params[name(v)] for v in space.variables)


def finite(value) -> float:
    """A number of a row that has been through JSON, where NaN is null."""
    return math.nan if value is None else float(value)


def run_of(space: Space, trial, paths) -> Tried | None:
    """The run of a trial, by its first objective; None for one that never got as far as being run."""
    design, row = design_of(space, trial.params), trial.user_attrs.get("row")
    if row is not None:
        values = [finite(row[path]) for path in paths]
        whole = all(map(math.isfinite, values))
        status = row["status"] if whole else "failed" if row["status"] == "done" else row["status"]
        value = values[0] if whole else math.nan
        return Tried(design, value, finite(row[f"{paths[0]}:error"]), status)
    if trial.state == TrialState.RUNNING and "id" in trial.user_attrs:
        return Tried(design, status="running")
    return None


def runs_of(space: Space, study, paths) -> list[Tried]:
    """All runs of a study, in the order of the trials."""
    found = (run_of(space, trial, paths) for trial in study.get_trials(deepcopy=False))
    return [run for run in found if run is not None]


class Sampler(optuna.samplers.BaseSampler):
    """Proposes the next design of a study with one objective or several (`paths`)."""

    def __init__(self, space: Space, budget: Budget, paths):
        self.space, self.budget, self.paths = space, budget, list(paths)
        self._ahead = None
        self._evolution = (None, None)

    def propose(self, study) -> tuple | None:
        """The next design if it is known before asking Optuna; None when there is nothing left to be found out. Several
        objectives: always (), for NSGA-II answers when it is asked."""
        runs = runs_of(self.space, study, self.paths)
        if len(self.paths) > 1:
            design = unfinished(runs, self.budget.replicates) or ()
        else:
            design = choose(self.space, runs, self.budget)
        self._ahead = design
        return design

    def infer_relative_search_space(self, study, trial):
        return distributions(self.space)

    def sample_relative(self, study, trial, search_space):
        design = self._ahead or self.propose(study)
        self._ahead = None
        if design:
            return parameters(self.space, design)
        if design is None:  # nothing to be found out, but asked nevertheless
            return {}
        found = self._nsga(trial).sample_relative(study, trial, search_space)
        if not found:
            known = [run.design for run in runs_of(self.space, study, self.paths)]
            found = parameters(self.space, spread(self.space, known, self.budget))
        return found

    def sample_independent(self, study, trial, param_name, param_distribution):
        return self._nsga(trial).sample_independent(study, trial, param_name, param_distribution)

    def after_trial(self, study, trial, state, values):
        if len(self.paths) > 1:
            self._nsga(trial).after_trial(study, trial, state, values)

    def _nsga(self, trial):
        """NSGA-II as it is for this trial: its random numbers come from the seed and the trial's number."""
        if self._evolution[0] != trial.number:
            population = max(8, min(50, 2 * (self.budget.runs // 10)))
            sampler = optuna.samplers.NSGAIISampler(
                population_size=population, seed=(self.budget.seed * 1_000_003 + trial.number) % 2**32
            )
            self._evolution = (trial.number, sampler)
        return self._evolution[1]
