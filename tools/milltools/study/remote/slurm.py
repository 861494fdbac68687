"""Jobs through Slurm job arrays, behind `concurrent.futures.Executor`.

submit() collects jobs. When no new job comes for a moment, they are bundled, many to one array task, and passed to
sbatch. The tasks (`slurm_task`) write their results into files in a shared folder, which one thread here reads.
squeue is asked only seldom, and only which tasks still exist. If a task has left the queue without reporting its end,
it was cut off by its time limit, by scancel or by the failure of a node. Its results are kept. Jobs that it was running
are `Lost` (the caller of submit() decides whether to submit them again); jobs that it had not begun go into the next
array.
The folder remains after the driver has ended. The next driver uses its content: results there are not computed again,
and jobs that wait or run in Slurm are not submitted twice.
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

TASK = 300.0  # [s] intended time of a task
GUESS = 20  # jobs in a task while their cost is not known
SPREAD = 16  # smallest number of tasks, if there are enough jobs and no other number is given
ARRAY = 1000  # largest number of tasks in one array, also if the site allows more

QUIET = 0.3  # [s] without a new job, after which the collected jobs are submitted
TARDY = 5.0  # [s] longest time that a job waits for others
GRACE = 3.0  # [s] to wait for the last line of a task after it left the queue
SBATCH = 3.0  # [s] that an sbatch may continue after the end of its driver
TRIES = 3  # after this many tasks in a row that end before a job begins, the tasks are at fault, not the jobs
AWAY = 5.0  # [s] before a controller that did not answer is asked again
FULL = 30.0  # [s] before another submission if the account has reached its limit of tasks


def bundle_size(count, cost, tasks=None, largest=ARRAY):
    """How many of `count` jobs one task gets. cost: wall time of a job [s], None if not known. A task should take
    minutes, but each of the `tasks` (SPREAD if None) should get jobs, and an array has at most `largest`
    tasks."""
    wanted = GUESS if cost is None else max(1, int(TASK / max(cost, 1e-3)))
    return max(1, min(wanted, math.ceil(count / (tasks or SPREAD))), math.ceil(count / largest))


@dataclasses.dataclass(eq=False)
class SentJob:
    """A submitted job. `future` is None for a job of an earlier driver that has not been requested again."""

    call: str
    job: dict
    future: concurrent.futures.Future | None = None
    idle: int = 0  # tasks that ended before it began


class SentTask:
    """The state of one array task, as the driver knows it."""

    def __init__(self, array, number, entries):
        self.array, self.number = array, number
        self.left = {entry.job["id"]: entry for entry in entries}  # in their order
        self.begun = set()
        self.sure = True  # sbatch did not fail: Slurm has it
        self.ended = False
        self.missed = None  # time since which squeue does not list it [monotonic s]
        self.listener = Listener(array.rows(number))


class SlurmExecutor(cluster.ClusterExecutor):
    """Jobs (dicts with an "id") of module-level functions, through sbatch.

    folder: shared with the nodes; options: for sbatch, as typed; bundle: jobs per task, None: bundle_size(); tasks:
    largest number of our tasks in the queue; detach: an interrupted driver leaves its tasks in the queue; anew: tasks
    and results of an earlier driver are cancelled and deleted. One thread does everything except submit().
    """

    def __init__(self, folder, options="", bundle=None, tasks=None, detach=False, anew=False):
        super().__init__()
        queue.check()
        self.options, self.bundle, self.tasks, self.detach = options, bundle, tasks, detach
        self.largest = self.allowed = min(ARRAY, queue.largest_array())  # tasks per array: of the site, at present
        self.spool = Spool(folder)
        self.submitted = collections.deque()  # entries that the thread has not seen yet
        self.gathered = collections.deque()  # entries that are in no task
        self.first = self.last = 0.0  # times of the oldest and the newest of these [monotonic s]
        self.rows, self.earlier = {}, {}  # rows and entries by name, of an earlier driver, not requested yet
        self.running = []  # tasks that have not ended
        self.cost, self.counted = 0.0, 0  # wall time of the results so far [s], their number
        self.changed = self.asked = 0.0  # times of the last news from a task and of the last squeue [monotonic s]
        self.later = 0.0  # no submission before this time [monotonic s]
        self.told = False
        self.closing = threading.Event()
        self._take_up(anew)
        self.watcher = threading.Thread(target=self._watch, name="slurm", daemon=True)
        self.watcher.start()

    # what users of an Executor call

    @property
    def workers(self):
        """The number of runs that can run at once, as far as it is known."""
        return self.tasks or max(SPREAD, len(self.running))

    def submit(self, call, job):
        future = self.new_future()
        self.submitted.append(SentJob(f"{call.__module__}:{call.__qualname__}", job, future))
        return future

    def leave(self, interrupted):
        """Cancels tasks that nobody waits for, and removes the folder when all its results have been used. With
        `detach` the tasks of an interrupted driver stay in the queue."""
        self.closing.set()
        self.watcher.join()
        names = sorted({task.array.name for task in self.running})
        if names and interrupted and self.detach:
            numbers = ", ".join(sorted({task.array.job or "?" for task in self.running}))
            what = f"{len(self.running)} tasks stay in Slurm's queue ({numbers})"
            print(f"mill: {what}; the same command later collects their results", file=sys.stderr)
        else:
            try:
                queue.cancel(names)
            except (queue.Away, UserError) as fault:
                print(f"mill: tasks may still be in Slurm's queue: {fault}", file=sys.stderr)
        if not interrupted:
            shutil.rmtree(self.spool.folder, ignore_errors=True)

    # the other side: arrays

    def _take_up(self, anew):
        """Takes the results of an earlier driver, and its tasks that may still run; with `anew` they are deleted."""
        arrays = self.spool.arrays()
        # a driver that was killed a moment ago may have left a running sbatch
        end = time.time() + SBATCH
        young = [array for array in arrays if array.folder.stat().st_mtime > end - 2 * SBATCH]
        while time.time() < end and not all(array.job for array in young):
            time.sleep(0.1)
        while True:  # running tasks must not be submitted again
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
                    continue  # its driver died while writing the array, before submitting it
                self._hear(task)
                if not task.ended and (array.name, number) in there:
                    self.running.append(task)
                    self.earlier |= task.left
        self.changed = time.monotonic()

    def _tell(self, fault):
        """Reports once why nothing happens."""
        if not self.told:
            what = "Slurm does not answer" if isinstance(fault, queue.Away) else "Slurm's queue is full"
            print(f"mill: {what}, waiting: {fault}", file=sys.stderr)
        self.told = True

    def _watch(self):
        """The thread that submits jobs, reads results and asks squeue, until the end."""
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
        except Exception as fault:  # of any kind: the waiting callers must get it
            self.fail(fault)

    def _pause(self):
        """[s] between readings: short while news arrive, longer for long tasks, to spare file system and controller."""
        if self.submitted or (self.gathered and time.monotonic() - self.last < TARDY):
            return 0.1
        return min(max(0.1, 0.1 * (time.monotonic() - self.changed)), 3.0)

    def _receive(self, entry):
        """Handles a submitted job: its row may exist already, or a task of an earlier driver may be running it."""
        name = entry.job["id"]
        if name in self.rows:
            # the design number comes from the study, which may have grown since
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
        """Submits an array of the collected jobs, if it is time and the queue has room."""
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
                if not self.running:  # full of other tasks of this account, or of ours that have just ended
                    self._tell(fault)
                self.allowed, self.later = self.largest, now + FULL
            return
        except queue.Away as fault:  # the submission may still have succeeded: squeue will show it
            self._tell(fault)
            self.later = now + AWAY
            for task in tasks:
                task.sure = False
        else:
            self.told = False
        self.running += tasks
        self.changed = self.asked = time.monotonic()

    def _hear(self, task, gone=False):
        """Reads the new lines of a task; `gone`: the task has ended, and these are its last lines."""
        for said in task.listener.listen():
            self.changed = time.monotonic()
            if "start" in said:
                task.begun.add(said["start"])
            elif "end" in said:
                task.ended = True
            elif entry := task.left.pop(ended_job(said), None):  # else reported twice: by two runs of one task
                self._finish(entry, said)
        task.ended = task.ended or gone
        # a task may report its end too early: if its list was truncated, or a disk failed
        if task.ended and task.left and not self.closing.is_set():
            self._bury(task)

    def _finish(self, entry, said):
        """A job has ended, according to its task."""
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
        """Asks squeue from time to time which tasks still exist, and gives up the others."""
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
                self._hear(task, gone=True)  # its last lines were written before squeue reported its end

    def _bury(self, task):
        """A task was cut off: the jobs that it had begun are lost, the others go into another task."""
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
                    said = f"the last message: {words}" if words else "there was no message"
                    raise UserError(f"{TRIES} Slurm tasks ended before their first run; {said}", 1)
                self._gather(entry, ahead=True)
        task.left.clear()
