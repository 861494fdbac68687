"""Jobs through Slurm job arrays, behind `concurrent.futures.Executor`.

submit() gathers jobs; when none comes for a moment they are bundled, many to one array task, and handed to sbatch.
Results come back through files in a shared folder, written by the tasks (`slurm_task`) and watched by one thread
here; squeue is asked, seldom, only which tasks are still to be expected. A task that is no longer in the queue and
did not say that it was done was cut off: by its time limit, by scancel, by a node that died. Its results are kept;
jobs that it had in hand are `Lost` (who submitted them decides whether to submit them again); those it had not begun
go into the next array.

The folder outlives the driver. The next one takes up what is in it: results there are not computed again, and jobs
that wait or run in Slurm are waited for, not submitted twice.
"""

import collections
import concurrent.futures
import dataclasses
import math
import shutil
import sys
import threading
import time

from milltools.base.errors import UserError
from milltools.study.plan.job import Lost
from milltools.study.remote import cluster, slurm_task
from milltools.study.remote import slurm_queue as queue
from milltools.study.remote.slurm_task import Listener, Spool, ended_job

TASK = 300.0  # [s] what a task should take
GUESS = 20  # jobs in a task while nothing is known of what they cost
SPREAD = 16  # tasks at least, where there are as many jobs and no other number is asked for
ARRAY = 1000  # tasks in one array at most, whatever the site allows

QUIET = 0.3  # [s] without a new job: those gathered are submitted
TARDY = 5.0  # [s] the longest that a job is kept waiting for others
GRACE = 3.0  # [s] that a task may be gone from the queue before its last line is missed
SBATCH = 3.0  # [s] that an sbatch may outlive its driver
TRIES = 3  # tasks in a row that end before a job's turn comes: something is wrong with tasks, not with jobs
AWAY = 5.0  # [s] until a controller that did not answer is asked again
FULL = 30.0  # [s] until another task is submitted where the account has as many as it may


def bundle_size(count, cost, tasks=None, largest=ARRAY):
    """How many of `count` jobs one task gets. cost: wall time of a job [s], None if not known. A task should take
    minutes, but all of `tasks` (SPREAD if None) should have something to do, and an array has `largest` tasks at
    most."""
    wanted = GUESS if cost is None else max(1, int(TASK / max(cost, 1e-3)))
    return max(1, min(wanted, math.ceil(count / (tasks or SPREAD))), math.ceil(count / largest))


@dataclasses.dataclass(eq=False)
class SentJob:
    """A job on its way. `future` is None while nobody has asked for it: it was submitted by an earlier driver."""

    call: str
    job: dict
    future: concurrent.futures.Future | None = None
    idle: int = 0  # tasks that ended before it began


class SentTask:
    """One array task as seen from here."""

    def __init__(self, array, number, entries):
        self.array, self.number = array, number
        self.left = {entry.job["id"]: entry for entry in entries}  # in their order
        self.begun = set()
        self.sure = True  # sbatch did not fail: Slurm has it
        self.ended = False
        self.missed = None  # since when squeue does not list it [monotonic s]
        self.listener = Listener(array.rows(number))


class SlurmExecutor(cluster.ClusterExecutor):
    """Jobs (dicts with an "id") of module-level functions, through sbatch.

    folder: shared with the nodes; options: for sbatch, as typed; bundle: jobs a task, None: bundle_size(); tasks: so
    many of ours in the queue at once at most; detach: an interrupted driver leaves its tasks in the queue; anew:
    what an earlier driver has left is cancelled and forgotten. All but submit() is the business of one thread.
    """

    def __init__(self, folder, options="", bundle=None, tasks=None, detach=False, anew=False):
        super().__init__()
        queue.check()
        self.options, self.bundle, self.tasks, self.detach = options, bundle, tasks, detach
        self.largest = self.allowed = min(ARRAY, queue.largest_array())  # tasks an array, tasks an array now
        self.spool = Spool(folder)
        self.submitted = collections.deque()  # entries that the thread has not seen yet
        self.gathered = collections.deque()  # entries that are in no task
        self.first = self.last = 0.0  # when the oldest, the newest of them came [monotonic s]
        self.rows, self.earlier = {}, {}  # rows, entries by name: of an earlier driver, nobody has asked for them yet
        self.running = []  # tasks that have not ended
        self.cost, self.counted = 0.0, 0  # wall time of the results so far [s], their number
        self.changed = self.asked = 0.0  # when a task last said something, when squeue was asked [monotonic s]
        self.later = 0.0  # nothing is submitted before [monotonic s]
        self.told = False
        self.closing = threading.Event()
        self._take_up(anew)
        self.watcher = threading.Thread(target=self._watch, name="slurm", daemon=True)
        self.watcher.start()

    # what users of an Executor call

    @property
    def workers(self):
        """How many runs may go on at once, as far as it is known."""
        return self.tasks or max(SPREAD, len(self.running))

    def submit(self, call, job):
        future = self.new_future()
        self.submitted.append(SentJob(f"{call.__module__}:{call.__qualname__}", job, future))
        return future

    def leave(self, interrupted):
        """Cancels what nobody waits for, and removes the folder when all of it has been handed over. With `detach`
        tasks of an interrupted driver are left alone."""
        self.closing.set()
        self.watcher.join()
        names = sorted({task.array.name for task in self.running})
        if names and interrupted and self.detach:
            numbers = ", ".join(sorted({task.array.job or "?" for task in self.running}))
            what = f"{len(self.running)} tasks stay in Slurm's queue ({numbers})"
            print(f"mill: {what}; the same command takes up their results", file=sys.stderr)
        else:
            try:
                queue.cancel(names)
            except (queue.Away, UserError) as fault:
                print(f"mill: tasks may still be in Slurm's queue: {fault}", file=sys.stderr)
        if not interrupted:
            shutil.rmtree(self.spool.folder, ignore_errors=True)

    # the other side: arrays

    def _take_up(self, anew):
        """What an earlier driver has left: results, and tasks that may still be under way; with `anew` it goes."""
        arrays = self.spool.arrays()
        # a driver that was killed a moment ago may have left an sbatch at work
        end = time.time() + SBATCH
        young = [array for array in arrays if array.folder.stat().st_mtime > end - 2 * SBATCH]
        while time.time() < end and not all(array.job for array in young):
            time.sleep(0.1)
        while True:  # what runs must not be submitted again
            try:
                there = queue.listed([array.name for array in arrays])
                break
            except queue.Away as fault:
                self._tell(fault)
                time.sleep(AWAY)
        if anew:
            queue.cancel(sorted({name for name, _ in there}))
            shutil.rmtree(self.spool.folder, ignore_errors=True)
            return
        for array in arrays:
            for number in array.tasks():
                try:
                    entries = [SentJob(e["call"], e["job"]) for e in array.entries(number)]
                    task = SentTask(array, number, entries)
                except (ValueError, KeyError, TypeError):
                    continue  # its driver died while it wrote this: it was never submitted
                self._hear(task)
                if not task.ended and (array.name, number) in there:
                    self.running.append(task)
                    self.earlier |= task.left
        self.changed = time.monotonic()

    def _tell(self, fault):
        """Says once why nothing happens."""
        if not self.told:
            what = "Slurm does not answer" if isinstance(fault, queue.Away) else "no place in Slurm's queue"
            print(f"mill: {what}, waiting: {fault}", file=sys.stderr)
        self.told = True

    def _watch(self):
        """The thread that submits, listens and asks, until the end."""
        try:
            while not self.closing.wait(self._pause()):
                while self.submitted:
                    self._receive(self.submitted.popleft())
                self._submit_gathered()
                for task in self.running:
                    self._hear(task)
                self._look_for_lost()
                self.running = [task for task in self.running if not task.ended]
        except OSError as fault:
            self.fail(UserError(f"{fault.filename or self.spool.folder}: {fault.strerror}", 1))
        except Exception as fault:  # whatever it is: those who wait must hear of it
            self.fail(fault)

    def _pause(self):
        """[s] Shorter while things happen, longer when tasks take long: gentle to file system and controller."""
        if self.submitted or (self.gathered and time.monotonic() - self.last < TARDY):
            return 0.1
        return min(max(0.1, 0.1 * (time.monotonic() - self.changed)), 3.0)

    def _receive(self, entry):
        """A job that was submitted: its row may be there, or an earlier driver's task may be at it."""
        name = entry.job["id"]
        if name in self.rows:
            # the numbers of designs are the study's, which may have grown since
            numbers = {key: entry.job[key] for key in ("design", "replicate") if key in entry.job}
            cluster.settle(entry.future, {**self.rows.pop(name), **numbers})
        elif name in self.earlier:
            self.earlier.pop(name).future = entry.future
        else:
            self._gather(entry)

    def _gather(self, entry, ahead=False):
        self.last = time.monotonic()
        if not self.gathered:
            self.first = self.last
        (self.gathered.appendleft if ahead else self.gathered.append)(entry)

    def _submit_gathered(self):
        """Submits an array of what was gathered, if it is time and there is room for it."""
        now, count = time.monotonic(), len(self.gathered)
        free = math.inf if self.tasks is None else self.tasks - len(self.running)
        ready = now - self.last >= QUIET or now - self.first >= TARDY
        if not count or not ready or free < 1 or now < self.later:
            return
        cost = self.cost / self.counted if self.counted else None
        size = self.bundle or bundle_size(count, cost, self.tasks, self.largest)
        taken = [self.gathered.popleft() for _ in range(min(count, size * self.allowed))]
        self.first = now
        bundles = [taken[i : i + size] for i in range(0, len(taken), size)]
        array = self.spool.create([[{"call": e.call, "job": e.job} for e in bundle] for bundle in bundles])
        tasks = [SentTask(array, number, bundle) for number, bundle in enumerate(bundles)]
        at_once = free if free < len(bundles) else None
        try:
            queue.submit(array, len(bundles), slurm_task.script(array), self.options, at_once)
        except queue.Full as fault:
            self.gathered.extendleft(reversed(taken))
            shutil.rmtree(array.folder)
            if len(bundles) > 1:
                self.allowed = len(bundles) // 2
            else:
                if not self.running:  # others of this account, or ours that have only just ended
                    self._tell(fault)
                self.allowed, self.later = self.largest, now + FULL
            return
        except queue.Away as fault:  # it may have got through all the same: squeue will tell
            self._tell(fault)
            self.later = now + AWAY
            for task in tasks:
                task.sure = False
        else:
            self.told = False
        self.running += tasks
        self.changed = self.asked = time.monotonic()

    def _hear(self, task, gone=False):
        """Takes in what a task has said since the last look; of one that is gone it was the last."""
        for said in task.listener.listen():
            self.changed = time.monotonic()
            if "start" in said:
                task.begun.add(said["start"])
            elif "end" in said:
                task.ended = True
            elif entry := task.left.pop(ended_job(said), None):  # else said twice: by two incarnations of one task
                self._finish(entry, said)
        task.ended = task.ended or gone
        # one that says that it is done may not be: a list cut short, a disk that lied
        if task.ended and task.left and not self.closing.is_set():
            self._bury(task)

    def _finish(self, entry, said):
        """A job has ended, as its task said."""
        row, why = said.get("row"), said.get("why", "")
        wall = row.get("wall") if row else None
        if isinstance(wall, (int, float)) and math.isfinite(wall):
            self.cost, self.counted = self.cost + wall, self.counted + 1
        if entry.future:
            fault = None if row else Lost(why) if "lost" in said else UserError(why, 1)
            cluster.settle(entry.future, row, fault)
            return
        self.earlier.pop(entry.job["id"], None)
        if row:
            self.rows[entry.job["id"]] = row

    def _look_for_lost(self):
        """Asks squeue, now and then, which tasks are still to be expected, and gives up those that are not."""
        now = time.monotonic()
        missed = any(task.missed for task in self.running)
        pause = 1.0 if missed else min(max(1.0, 0.1 * (now - self.changed)), 15.0)
        if not self.running or now - self.asked < pause:
            return
        self.asked = now
        try:
            there = queue.listed(sorted({task.array.name for task in self.running}))
        except queue.Away as fault:
            self._tell(fault)
            return
        self.told = False
        for task in self.running:
            if (task.array.name, task.number) in there:
                task.missed = None
            elif task.missed is None:
                task.missed = now
            elif now - task.missed >= GRACE:
                self._hear(task, gone=True)  # its last words came before squeue said that it was gone

    def _bury(self, task):
        """A task was cut off: what it had begun is lost, what it had not goes into another."""
        self.changed = time.monotonic()
        words = task.array.last_words(task.number)
        for name, entry in reversed(task.left.items()):
            if entry.future is None:
                self.earlier.pop(name, None)
            elif name in task.begun:
                fault = Lost(f"its Slurm task was ended while it ran{words and ': '}{words}")
                cluster.settle(entry.future, fault=fault)
            else:
                entry.idle = 0 if task.begun else entry.idle + task.sure
                if entry.idle >= TRIES:
                    said = f"the last one said: {words}" if words else "they said nothing"
                    raise UserError(f"{TRIES} Slurm tasks ended before their first run; {said}", 1)
                self._gather(entry, ahead=True)
        task.left.clear()
