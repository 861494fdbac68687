"""What Slurm is asked and told: sbatch, squeue, scancel and scontrol, as processes. No accounting (sacct) is wanted.

A site's wrong option or an account that may not submit is a UserError with sbatch's own line; a controller that does
not answer is `Away`: it may be back in a minute.
"""

import contextlib
import os
import re
import shlex
import shutil
import subprocess

from milltools.base.errors import UserError
from milltools.study.remote.cluster import one_line

PATIENCE = 120  # [s] that a command of Slurm may take

# squeue's short names of states in which a task will not run again by itself
ENDED = frozenset("BF CA CD DL F NF OOM PR RV TO".split())


class Away(Exception):
    """Slurm's controller does not answer."""


class Full(Exception):
    """This account may not have more tasks in the queue now."""


def _environment():
    """Ours without what an allocation that the driver itself may run in has set: tasks would take it for theirs.
    Options of squeue in the environment would change what it prints."""
    dropped = {name for name in os.environ if name.startswith(("SLURM_", "SQUEUE_"))} - {"SLURM_CONF", "SLURM_CLUSTERS"}
    return {name: value for name, value in os.environ.items() if name not in dropped}


def _run(*words, text="", out=subprocess.PIPE):
    """A command of Slurm that reads `text`, run to its end."""
    try:
        return subprocess.run(
            words, env=_environment(), input=text, stdout=out, stderr=subprocess.PIPE, text=True, errors="replace",
            timeout=PATIENCE, start_new_session=True,  # Ctrl-C is the driver's business
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        raise Away(f"{words[0]} does not answer") from None
    except OSError as fault:
        raise UserError(f"{words[0]}: {fault.strerror}", 1) from None


def _silent(said):
    """Does this line of a Slurm command say that nobody answers?"""
    return re.search(r"contact(ing)? (the )?slurm|timed out|Connection (refused|reset)|backup mode", said, re.I)


def check():
    """A UserError where Slurm's commands are missing."""
    missing = [name for name in ("sbatch", "squeue", "scancel") if not shutil.which(name)]
    if missing:
        raise UserError(f"--slurm: no {missing[0]} here: start it on a host that submits to Slurm", 1)


def largest_array():
    """How many tasks an array of this site may have; 1001, Slurm's own default, where it does not say."""
    said = ""
    with contextlib.suppress(Away):
        if shutil.which("scontrol"):
            said = _run("scontrol", "show", "config").stdout
    found = re.search(r"^MaxArraySize\s*=\s*(\d+)", said, re.M)
    return max(1, int(found[1])) if found else 1001


def submit(array, count, script, options="", at_once=None):
    """Submits `count` tasks that run `script` (text). `options` are the user's, for sbatch; at_once: so many run at a
    time. sbatch itself writes the array's number into the array's folder: it is known even if we die meanwhile."""
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
    """{(name of an array, task)} of all that wait or run, of arrays of these names."""
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
    """Ends what waits or runs of arrays of these names."""
    for name in names:
        done = _run("scancel", f"--name={name}")
        if done.returncode != 0 and _silent(done.stderr):
            raise Away(one_line(done.stderr))
