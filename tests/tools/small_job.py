"""A job that is no millsim: for tests of what carries jobs about. Tasks import it, so it imports next to nothing."""

import os
import signal
import time

from milltools.study.plan.job import Lost


def run(job):
    """Writes its id into job["log"], sleeps job["sleep"] seconds, does what job["do"] says, returns a row."""
    with open(job["log"], "a") as log:
        log.write(f"{job['id']}\n")
    time.sleep(job["sleep"])
    if job["do"] == "die":
        os.kill(os.getpid(), signal.SIGKILL)
    if job["do"] == "lose":
        raise Lost("killed from outside")
    if job["do"] == "fail":
        raise OSError("no space left\non the disk")
    return {"id": job["id"], "design": job["design"], "wall": job["sleep"], "task": os.getpid()}
