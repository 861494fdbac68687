"""Commands to Slurm: sbatch, squeue, scancel and scontrol, as processes. Accounting (sacct) is not needed.

An option that the site refuses, or an account that cannot submit, is a UserError with the message of sbatch. If the
controller does not answer, the exception is `Away`: the controller may answer again in a minute.
"""

import contextlib
import os
import re
import shlex
import shutil
import subprocess

from milltools.base.errors import UserError
from milltools.study.remote.cluster import one_line

PATIENCE = 120  # [s] time limit of a command of Slurm

# squeue's short names of states in which a task will not run again by itself
ENDED = frozenset("BF CA CD DL F NF OOM PR RV TO".split())


class Away(Exception):
    """Slurm's controller does not answer."""


class Full(Exception):
    """This account has reached its limit of tasks in the queue."""


def _environment():
    """Our environment without variables of a Slurm allocation in which the driver may run: tasks would use them.
    Options of squeue are removed too, because they would change its output."""
    dropped = {name for name in os.environ if name.startswith(("SLURM_", "SQUEUE_"))} - {"SLURM_CONF", "SLURM_CLUSTERS"}
    return {name: value for name, value in os.environ.items() if name not in dropped}


def _run(*words, text="", out=subprocess.PIPE):
    """Runs a command of Slurm, with `text` as its input, to its end."""
    try:
        return subprocess.run(
            words, env=_environment(), input=text, stdout=out, stderr=subprocess.PIPE, text=True, errors="replace",
            timeout=PATIENCE, start_new_session=True,  # only the driver reacts to Ctrl-C
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        raise Away(f"{words[0]} does not answer") from None
    except OSError as fault:
        raise UserError(f"{words[0]}: {fault.strerror}", 1) from None


def _silent(said):
    """Does this line of a Slurm command report that the controller does not answer?"""
    return re.search(r"contact(ing)? (the )?slurm|timed out|Connection (refused|reset)|backup mode", said, re.I)


def check():
    """UserError if Slurm's commands are missing."""
    missing = [name for name in ("sbatch", "squeue", "scancel") if not shutil.which(name)]
    if missing:
        raise UserError(f"--slurm: no {missing[0]} here: start it on a host that submits to Slurm", 1)


def largest_array():
    """Largest number of tasks in an array at this site; 1001, the default of Slurm, if Slurm does not give it."""
    said = ""
    with contextlib.suppress(Away):
        if shutil.which("scontrol"):
            said = _run("scontrol", "show", "config").stdout
    found = re.search(r"^MaxArraySize\s*=\s*(\d+)", said, re.M)
    return max(1, int(found[1])) if found else 1001


def submit(array, count, script, options="", at_once=None):
    """Submits `count` tasks that run `script` (text). `options`: of the user, for sbatch; at_once: largest number that
    run at once. sbatch itself writes the array's number into the array's folder, so it is kept if this driver dies."""
    limit = f"%{at_once}" if at_once else ""
    output = str(array.folder.resolve()).replace("%", "%%") + "/%a.out"
    files = (f"--output={output}", "--open-mode=append", "--parsable")
    words = (*shlex.split(options), *files, f"--array=0-{count - 1}{limit}", f"--job-name={array.name}")
    with open(array.folder / "job", "w") as file:
        done = _run("sbatch", *words, text=script, out=file)
    if done.returncode == 0:
        return
    said = one_line(done.stderr)
    if _silent(said):
        raise Away(said)
    if re.search(r"submit (job )?limit|SubmitJobs?(Per|Limit)|SubmitJobLimit|job limit|temporarily", said, re.I):
        raise Full(said)
    lines = [re.sub(r"^sbatch: (error: )?", "", line) for line in done.stderr.splitlines()]
    raise UserError(f"sbatch: {'; '.join(lines)}", 2 if "option" in said else 1)


def listed(names):
    """{(name of an array, task)} of all waiting or running tasks in arrays of these names."""
    if not names:
        return set()
    form = ("--noheader", "--array", "--states=all", "--format=%j|%K|%t")
    done = _run("squeue", *form, f"--name={','.join(names)}")
    if done.returncode != 0:
        raise Away(one_line(done.stderr) or "squeue failed")
    found = set()
    for line in done.stdout.splitlines():
        name, task, state = (line.split("|") + ["", ""])[:3]
        if task.strip().isdigit() and state.strip() not in ENDED:
            found.add((name.strip(), int(task)))
    return found


def cancel(names):
    """Ends all waiting or running tasks in arrays of these names."""
    for name in names:
        done = _run("scancel", f"--name={name}")
        if done.returncode != 0 and _silent(done.stderr):
            raise Away(one_line(done.stderr))
