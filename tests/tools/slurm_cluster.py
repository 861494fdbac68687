"""A whole Slurm of one node on loopback, as a context manager: munged, slurmctld and slurmd in the foreground, in a
folder of their own, with a key, sockets and ports of their own. It is up in seconds, and leaves nothing running.

Wants root (slurmd starts tasks as their owner) and Debian's slurmctld, slurmd, slurm-client and munge; `missing()`
says what is not there.
"""

import contextlib
import os
import pathlib
import secrets
import shutil
import signal
import socket
import subprocess
import time

PROGRAMS = ("munged", "slurmctld", "slurmd", "sbatch", "squeue", "scancel", "scontrol")

# Tasks hold CPUs, no memory. Jobs are forgotten two seconds after their end, as on a busy site after minutes; nobody
# waits for anything longer than a second.
CONFIG = """\
ClusterName=millsim
SlurmctldHost=localhost(127.0.0.1)
SlurmctldPort={control}
SlurmdPort={daemon}
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
AuthInfo=socket={folder}/munge.socket
CredType=cred/munge
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd.log
AccountingStorageType=accounting_storage/none
JobAcctGatherType=jobacct_gather/none
JobCompType=jobcomp/none
MpiDefault=none
SwitchType=switch/none
ReturnToService=2
MinJobAge=2
KillWait=1
MaxArraySize={array}
SchedulerType=sched/builtin
SchedulerParameters=batch_sched_delay=0,sched_interval=1,sched_min_interval=0,default_queue_depth=100
SlurmdParameters=config_overrides
NodeName=localhost NodeHostname=localhost NodeAddr=127.0.0.1 CPUs={cpus} RealMemory=1000 State=UNKNOWN
PartitionName=main Nodes=ALL Default=YES MaxTime=INFINITE State=UP OverSubscribe=NO
"""


def missing():
    """Why no cluster can be started here, or None."""
    path = os.environ.get("PATH", "") + ":/usr/sbin:/sbin"
    absent = [name for name in PROGRAMS if not shutil.which(name, path=path)]
    if absent:
        return f"no {', '.join(absent)}: tools/setup slurm installs Slurm"
    if os.geteuid() != 0:
        return "a Slurm of one's own wants root"
    return None


def free_ports(count):
    """So many ports of loopback that nobody listens at."""
    sockets = [socket.socket() for _ in range(count)]
    try:
        for each in sockets:
            each.bind(("127.0.0.1", 0))
        return [each.getsockname()[1] for each in sockets]
    finally:
        for each in sockets:
            each.close()


def _tied(words):
    """`words` such that the process dies with this one, were it by SIGKILL."""
    return ["setpriv", "--pdeathsig", "TERM", "--", *words] if shutil.which("setpriv") else words


class SlurmCluster:
    """with SlurmCluster(folder) as cluster: `cluster.environment` is what its clients need (SLURM_CONF)."""

    def __init__(self, folder, cpus=2, array=1001):
        self.folder = pathlib.Path(folder)
        self.cpus, self.array = cpus, array
        self.processes = []

    @property
    def environment(self):
        return {"SLURM_CONF": str(self.folder / "slurm.conf")}

    def command(self, *words):
        """What a Slurm command says on its standard output; its failure is a CalledProcessError."""
        done = subprocess.run(
            [str(word) for word in words],
            env={**os.environ, **self.environment},
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=30,
        )
        done.check_returncode()
        return done.stdout

    def listed(self, name="", state=None):
        """{ARRAY_TASK} of all that waits or runs in jobs with this in their name, or of those in this state."""
        words = ("squeue", "-h", "-r", "-o", "%j|%F_%K", *(["-t", state] if state else []))
        lines = (line.split("|") for line in self.command(*words).splitlines())
        return {task for job, task in lines if name in job}

    def cancel(self, name=""):
        """Ends what has this in its name, and waits for it."""
        end = time.monotonic() + 20
        while (left := self.listed(name)) and time.monotonic() < end:
            self.command("scancel", "--signal=KILL", "--full", *left)
            self.command("scancel", *left)
            time.sleep(0.2)

    def _start(self, name, *words):
        path = shutil.which(name, path=os.environ.get("PATH", "") + ":/usr/sbin:/sbin")
        with open(self.folder / f"{name}.out", "ab") as out:
            self.processes.append(
                subprocess.Popen(
                    _tied([path, *map(str, words)]),
                    env={**os.environ, **self.environment},
                    stdin=subprocess.DEVNULL,
                    stdout=out,
                    stderr=out,
                    cwd=self.folder,
                    start_new_session=True,
                )
            )

    def _wait(self, what, ready, seconds=30):
        end = time.monotonic() + seconds
        while not ready():
            ended = [p.args[-1] for p in self.processes if p.poll() is not None]
            if ended or time.monotonic() > end:
                logs = sorted(self.folder.glob("*.out")) + sorted(self.folder.glob("*.log"))
                said = "\n".join(f"{p.name}: {p.read_text(errors='replace')[-500:]}" for p in logs)
                raise RuntimeError(f"{what} did not start\n{said}")
            time.sleep(0.05)

    def _idle(self):
        with contextlib.suppress(subprocess.CalledProcessError, subprocess.TimeoutExpired):
            return "idle" in self.command("sinfo", "-h", "-o", "%t")
        return False

    def __enter__(self):
        control, daemon = free_ports(2)
        # munged refuses a folder that others may write to, or a socket that they cannot reach
        self.folder.mkdir(parents=True, exist_ok=True)
        self.folder.chmod(0o755)
        for name in ("state", "spool"):
            (self.folder / name).mkdir()
        key = self.folder / "munge.key"
        key.write_bytes(secrets.token_bytes(128))
        key.chmod(0o400)
        (self.folder / "slurm.conf").write_text(
            CONFIG.format(folder=self.folder, control=control, daemon=daemon, cpus=self.cpus, array=self.array)
        )
        # slurmd wants a way to control groups though it has none to make; this one does not mind where there are none
        (self.folder / "cgroup.conf").write_text("CgroupPlugin=cgroup/v1\nCgroupAutomount=no\n")
        try:
            folder = self.folder
            self._start(
                "munged", "--foreground", "--force", f"--socket={folder}/munge.socket",
                f"--key-file={key}", f"--log-file={folder}/munged.log",
                f"--pid-file={folder}/munged.pid", f"--seed-file={folder}/munged.seed",
            )  # fmt: skip
            self._wait("munged", (folder / "munge.socket").exists)
            self._start("slurmctld", "-D", "-c")
            self._start("slurmd", "-D", "-N", "localhost")
            self._wait("Slurm", self._idle)
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_):
        with contextlib.suppress(subprocess.SubprocessError, OSError):
            if self.processes:
                self.cancel()
        for process in reversed(self.processes):
            process.terminate()
        for process in reversed(self.processes):
            try:
                process.wait(10)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
        self._end_tasks()

    def _end_tasks(self):
        """What slurmd has started outlives it, by design: found by its configuration, and ended."""
        mark = f"SLURM_CONF={self.folder / 'slurm.conf'}".encode()
        for folder in pathlib.Path("/proc").iterdir():
            if not folder.name.isdigit() or int(folder.name) == os.getpid():
                continue
            with contextlib.suppress(OSError):
                words = (folder / "cmdline").read_bytes()
                mine = mark in (folder / "environ").read_bytes().split(b"\0")
                if mine and (b"slurmstepd" in words or b"milltools" in words or b"slurm_script" in words):
                    os.kill(int(folder.name), signal.SIGKILL)
