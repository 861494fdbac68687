"""What the driver knows of the tasks of its Slurm arrays: how many jobs each gets, which are on their way, what was heard
of them."""

import concurrent.futures
import dataclasses
import math

from milltools.study.remote.spool import Listener

TASK = 300.0  # [s] what a task should take
GUESS = 20  # jobs in a task while nothing is known of what they cost
SPREAD = 16  # tasks at least, where there are as many jobs and no other number is asked for
ARRAY = 1000  # tasks in one array at most, whatever the site allows


def bundle_size(count, cost, tasks=None, largest=ARRAY):
    """How many of `count` jobs one task gets. cost: wall time of a job [s], None if not known. A task should take minutes,
    but all of `tasks` (SPREAD if None) should have something to do, and an array has `largest` tasks at most."""
    wanted = GUESS if cost is None else max(1, int(TASK / max(cost, 1e-3)))
    return max(1, min(wanted, math.ceil(count / (tasks or SPREAD))), math.ceil(count / largest))


@dataclasses.dataclass(eq=False)
class Entry:
    """A job on its way. `future` is None while nobody has asked for it: it was submitted by an earlier driver."""

    name: str
    call: str
    job: dict
    future: concurrent.futures.Future | None
    idle: int = 0  # tasks that ended before it began

    def written(self):
        return {"call": self.call, "job": self.job}


class Task:
    """One array task as seen from here."""

    def __init__(self, array, number, entries):
        self.array, self.number = array, number
        self.left = {entry.name: entry for entry in entries}  # in their order
        self.begun = set()
        self.ended = False
        self.missed = None  # since when squeue does not list it [monotonic s]
        self.listener = Listener(array.rows(number))
