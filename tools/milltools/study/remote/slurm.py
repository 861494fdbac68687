"""Jobs through Slurm job arrays, behind `concurrent.futures.Executor`.

submit() gathers jobs; when none comes for a moment they are bundled, many to one array task, and handed to sbatch.
Results come back through files in a shared folder (`spool`), written by the tasks (`slurm_task`) and watched by one thread
here; squeue is asked, seldom, only which tasks are still to be expected. A task that is no longer in the queue and did not
say that it was done was cut off: by its time limit, by scancel, by a node that died. Its results are kept; jobs that it had
in hand are `Lost` (who submitted them decides whether to submit them again); those it had not begun go into the
next array.

The folder outlives the driver. The next one takes up what is in it: results there are not computed again, and jobs that
wait or run in Slurm are waited for, not submitted twice.
"""

import collections
import concurrent.futures
import dataclasses
import math
import sys
import threading
import time

from milltools.base.errors import UserError
from milltools.study.plan.job import Lost
from milltools.study.remote import slurm_queue as queue
from milltools.study.remote import slurm_task
from milltools.study.remote.spool import Listener, Spool

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
WAVE = 10_000  # jobs under way at once


def bundle_size(count, cost, tasks=None, largest=ARRAY):
    """How many of `count` jobs one task gets. cost: wall time of a job [s], None if not known. A task should take minutes,
    but all of `tasks` (SPREAD if None) should have something to do, and an array has `largest` tasks at most."""
    wanted = GUESS if cost is None else max(1, int(TASK / max(cost, 1e-3)))
    return max(1, min(wanted, math.ceil(count / (tasks or SPREAD))), math.ceil(count / largest))


@dataclasses.dataclass(eq=False)
class SentJob:
    """A job on its way. `future` is None while nobody has asked for it: it was submitted by an earlier driver."""

    name: str
    call: str
    job: dict
    future: concurrent.futures.Future | None
    idle: int = 0  # tasks that ended before it began

    def written(self):
        return {"call": self.call, "job": self.job}


class SentTask:
    """One array task as seen from here."""

    def __init__(self, array, number, entries):
        self.array, self.number = array, number
        self.left = {entry.name: entry for entry in entries}  # in their order
        self.begun = set()
        self.ended = False
        self.missed = None  # since when squeue does not list it [monotonic s]
        self.listener = Listener(array.rows(number))


class SlurmExecutor(concurrent.futures.Executor):
    """Jobs (dicts with an "id") of module-level functions, through sbatch.

    folder: shared with the nodes; options: for sbatch, as typed; bundle: jobs a task, None: bundle_size(); tasks: so many of
    ours in the queue at once at most; detach: an interrupted driver leaves its tasks in the queue; anew: what an earlier
    driver has left is cancelled and forgotten.
    """

    def __init__(self, folder, options="", bundle=None, tasks=None, detach=False, anew=False):
        queue.check()
        self.options, self.bundle, self.tasks, self.detach = options, bundle, tasks, detach
        self.largest = self.allowed = min(ARRAY, queue.largest_array())  # tasks an array, tasks an array now
        self.spool = Spool(folder)
        self.lock = threading.RLock()
        self.gathered = collections.deque()  # entries that are in no task
        self.first = self.last = 0.0  # when the oldest, the newest of them came [monotonic s]
        self.known = {}  # name: entry, of all that are under way
        self.rows = {}  # name: row of an earlier driver's job that nobody has asked for yet
        self.running = []  # tasks that have not ended
        self.cost, self.counted = 0.0, 0  # wall time of the results so far [s], their number
        self.changed = self.asked = 0.0  # when a task last said something, when squeue was asked [monotonic s]
        self.later = 0.0  # nothing is submitted before [monotonic s]
        self.told = False
        self.closing = threading.Event()
        self.fault = None
        if anew:
            self._forget()
        else:
            self._adopt()
        self.watcher = threading.Thread(target=self._watch, name="slurm", daemon=True)
        self.watcher.start()

    # what users of an Executor call

    @property
    def width(self):
        """How many jobs it wants at once: all, up to a wave."""
        return WAVE

    @property
    def workers(self):
        """How many runs may go on at once, as far as it is known."""
        return self.tasks or max(SPREAD, len(self.running))

    def submit(self, call, job):
        future = concurrent.futures.Future()
        name, words = job["id"], f"{call.__module__}:{call.__qualname__}"
        with self.lock:
            if self.closing.is_set():
                raise RuntimeError("cannot schedule new futures after shutdown")
            if self.fault:
                future.set_exception(self.fault)
            elif name in self.rows:
                # the numbers of designs are the study's, which may have grown since
                numbers = {key: job[key] for key in ("design", "replicate") if key in job}
                future.set_result({**self.rows.pop(name), **numbers})
            elif name in self.known and self.known[name].future is None:
                self.known[name].future = future
                future.set_running_or_notify_cancel()
            else:
                self._gather(SentJob(name, words, job, future))
        return future

    def __exit__(self, kind, fault, trace):
        self.shutdown(cancel_futures=kind is not None)

    def shutdown(self, wait=True, *, cancel_futures=False):
        """Without cancel_futures waits for all results (whatever `wait`), then removes the folder. With it, tasks are
        cancelled (detach: left alone) and the folder stays for the next driver, if there is anything in it."""
        with self.lock:
            gathered = list(self.gathered) if cancel_futures else []
            if cancel_futures:
                self.gathered.clear()
        for entry in gathered:
            self.known.pop(entry.name, None)
            entry.future.cancel()
        while not cancel_futures and self.fault is None:
            with self.lock:
                if not any(entry.future for entry in self.known.values()):
                    break
            time.sleep(0.05)
        self.closing.set()
        self.watcher.join()
        self._close(cancel_futures or self.fault is not None)

    # the other side: arrays

    def _adopt(self):
        """Takes up what an earlier driver has left: results, and tasks that may still be under way."""
        arrays = self.spool.arrays()
        self._await_sbatch(arrays)
        there = self._listed([array.name for array in arrays]) if arrays else set()
        for array in arrays:
            for number in array.tasks():
                try:
                    entries = [SentJob(e["job"]["id"], e["call"], e["job"], None) for e in array.entries(number)]
                except (ValueError, KeyError, TypeError):
                    continue  # its driver died while it wrote this: it was never submitted
                task = SentTask(array, number, entries)
                expected = (array.name, number) in there
                self._hear(task)
                if task.ended or not expected:
                    continue
                self.running.append(task)
                for entry in task.left.values():
                    self.known[entry.name] = entry
        self.changed = time.monotonic()

    def _forget(self):
        """Cancels and removes what an earlier driver has left."""
        arrays = self.spool.arrays()
        self._await_sbatch(arrays)
        names = [array.name for array in arrays]
        queue.cancel(sorted({name for name, _ in self._listed(names)}))
        self.spool.remove()

    @staticmethod
    def _await_sbatch(arrays):
        """A driver that was killed a moment ago may have left an sbatch at work."""
        end = time.time() + SBATCH
        while any(a.job is None and time.time() - a.folder.stat().st_mtime < SBATCH for a in arrays):
            if time.time() > end:
                return
            time.sleep(0.1)

    def _listed(self, names):
        """As queue.listed(), waiting for a controller that does not answer: what runs must not be submitted again."""
        while True:
            try:
                return queue.listed(names)
            except queue.Away as fault:
                self._tell_away(fault)
                time.sleep(AWAY)

    def _tell(self, what):
        """Says once why nothing happens."""
        if not self.told:
            print(f"mill: {what}", file=sys.stderr)
        self.told = True

    def _tell_away(self, fault):
        self._tell(f"Slurm does not answer, waiting: {fault}")

    def _gather(self, entry, ahead=False):
        self.last = time.monotonic()
        if not self.gathered:
            self.first = self.last
        self.known[entry.name] = entry
        (self.gathered.appendleft if ahead else self.gathered.append)(entry)

    def _watch(self):
        """The thread that submits, listens and asks, until shutdown."""
        try:
            while not self.closing.wait(self._pause()):
                self._submit_gathered()
                for task in list(self.running):
                    self._hear(task)
                self.running = [task for task in self.running if not task.ended]
                self._look_for_lost()
        except UserError as fault:
            self._fail(fault)
        except OSError as fault:
            where = fault.filename or self.spool.folder
            self._fail(UserError(f"{where}: {fault.strerror}", 1))
        except Exception as fault:  # whatever it is: those who wait must hear of it
            self._fail(fault)

    def _pause(self):
        """[s] Shorter while things happen, longer when tasks take long: gentle to file system and controller."""
        if self.gathered and time.monotonic() - self.last < TARDY:
            return 0.1
        return min(max(0.1, 0.1 * (time.monotonic() - self.changed)), 3.0)

    def _submit_gathered(self):
        now = time.monotonic()
        with self.lock:
            count = len(self.gathered)
            free = math.inf if self.tasks is None else self.tasks - len(self.running)
            ready = now - self.last >= QUIET or now - self.first >= TARDY
            if not count or not ready or free < 1 or now < self.later:
                return
            cost = self.cost / self.counted if self.counted else None
            size = self.bundle or bundle_size(count, cost, self.tasks, self.largest)
            taken = []
            while self.gathered and len(taken) < size * self.allowed:
                entry = self.gathered.popleft()
                # one that an earlier task brought back has been running for its owner all the time
                if entry.future.running() or entry.future.set_running_or_notify_cancel():
                    taken.append(entry)
                else:
                    del self.known[entry.name]
            self.first = now
        if taken:
            self._submit([taken[i : i + size] for i in range(0, len(taken), size)], free)

    def _submit(self, bundles, free):
        array = self.spool.create([[e.written() for e in bundle] for bundle in bundles])
        at_once = None if free == math.inf or free >= len(bundles) else free
        try:
            queue.submit(array, len(bundles), slurm_task.script(array), self.options, at_once)
        except queue.Full as fault:
            self._return(array, bundles)
            if len(bundles) > 1:
                self.allowed = len(bundles) // 2
            else:
                if not self.running:  # others of this account, or ours that have only just ended
                    self._tell(f"no place in Slurm's queue, waiting: {fault}")
                self.allowed, self.later = self.largest, time.monotonic() + FULL
            return
        except queue.Away as fault:
            self._tell_away(fault)
            # it may have got through all the same
            if not any(name == array.name for name, _ in self._listed([array.name])):
                self._return(array, bundles)
                self.later = time.monotonic() + AWAY
                return
        self.told = False
        tasks = [SentTask(array, number, bundle) for number, bundle in enumerate(bundles)]
        with self.lock:
            self.running += tasks
        self.changed = self.asked = time.monotonic()

    def _return(self, array, bundles):
        with self.lock:
            for bundle in reversed(bundles):
                self.gathered.extendleft(reversed(bundle))
        for path in array.folder.iterdir():
            path.unlink()
        array.folder.rmdir()

    def _hear(self, task):
        """Takes in what a task has said since the last look."""
        for said in task.listener.listen():
            self.changed = time.monotonic()
            if "start" in said:
                task.begun.add(said["start"])
            elif "row" in said and isinstance(said["row"], dict):
                self._finish(task, said["row"].get("id"), row=said["row"])
            elif "lost" in said:
                self._finish(task, said["lost"], fault=Lost(said.get("why", "")))
            elif "error" in said:
                self._finish(task, said["error"], fault=UserError(said.get("why", ""), 1))
            elif "end" in said:
                task.ended = True
        if task.ended and task.left and not self.closing.is_set():
            # it says that it is done, and is not: a list cut short, a disk that lied
            self._bury(task)

    def _finish(self, task, name, row=None, fault=None):
        entry = task.left.pop(name, None)
        if entry is None:
            return  # said twice: by two incarnations of one task
        if row is not None:
            wall = row.get("wall")
            if isinstance(wall, (int, float)) and math.isfinite(wall):
                self.cost, self.counted = self.cost + wall, self.counted + 1
        with self.lock:
            if self.known.get(name) is entry:
                del self.known[name]
            if entry.future is None:
                if row is not None:
                    self.rows[name] = row
                return
        if fault is not None:
            entry.future.set_exception(fault)
        else:
            entry.future.set_result(row)

    def _look_for_lost(self):
        """Asks squeue, now and then, which tasks are still to be expected, and gives up those that are not."""
        now = time.monotonic()
        missed = [task.missed for task in self.running if task.missed]
        pause = 1.0 if missed else min(max(1.0, 0.1 * (now - self.changed)), 15.0)
        if not self.running or now - self.asked < pause:
            return
        self.asked = now
        try:
            there = queue.listed(sorted({task.array.name for task in self.running}))
        except queue.Away as fault:
            self._tell_away(fault)
            return
        self.told = False
        for task in self.running:
            if (task.array.name, task.number) in there:
                task.missed = None
            elif task.missed is None:
                task.missed = now
            elif now - task.missed >= GRACE:
                self._hear(task)  # its last words came before squeue said that it was gone
                if not task.ended:
                    self._bury(task)
        self.running = [task for task in self.running if not task.ended]

    def _bury(self, task):
        """A task was cut off: what it had begun is lost, what it had not goes into another."""
        task.ended = True
        self.changed = time.monotonic()
        for entry in reversed(list(task.left.values())):
            if entry.future is None:
                with self.lock:
                    self.known.pop(entry.name, None)
            elif entry.name in task.begun:
                words = task.array.last_words(task.number)
                fault = Lost(f"its Slurm task was ended while it ran{words and ': '}{words}")
                self._finish(task, entry.name, fault=fault)
            else:
                entry.idle = 0 if task.begun else entry.idle + 1
                if entry.idle >= TRIES:
                    words = task.array.last_words(task.number)
                    said = f"the last one said: {words}" if words else "they said nothing"
                    raise UserError(f"{TRIES} Slurm tasks ended before their first run; {said}", 1)
                with self.lock:
                    self._gather(entry, ahead=True)
        task.left.clear()

    def _fail(self, fault):
        """Nothing will come any more: all who wait get this."""
        with self.lock:
            self.fault = fault
            entries, self.known = list(self.known.values()), {}
            self.gathered.clear()
        for entry in entries:
            if entry.future and not entry.future.done():
                if entry.future.running() or entry.future.set_running_or_notify_cancel():
                    entry.future.set_exception(fault)

    def _close(self, interrupted):
        """The end: cancels what nobody waits for, and removes the folder when all of it has been handed over."""
        names = sorted({task.array.name for task in self.running})
        if names and not (interrupted and self.detach):
            try:
                queue.cancel(names)
            except (queue.Away, UserError) as fault:
                print(f"mill: tasks may still be in Slurm's queue: {fault}", file=sys.stderr)
        for task in self.running:
            self._hear(task)
        left = [entry for entry in self.known.values() if entry.future and not entry.future.done()]
        if names and interrupted and self.detach:
            numbers = sorted({task.array.job or "?" for task in self.running})
            print(
                f"mill: {len(self.running)} tasks stay in Slurm's queue ({', '.join(numbers)}); "
                "the same command takes up their results",
                file=sys.stderr,
            )
        for entry in left:
            entry.future.set_exception(Lost("interrupted"))
        if not interrupted:
            self.spool.remove()
