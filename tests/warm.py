"""Calls of `mill` without its long start: a process loads the libraries once and forks for each call, which loads only
milltools. A call takes a third of the time that way; tests/tools/test_mill.py starts the command itself."""

import atexit
import contextlib
import importlib
import json
import os
import pathlib
import runpy
import select
import signal
import socket
import subprocess
import sys
import tempfile
import traceback

LIBRARIES = (
    "PIL.PngImagePlugin",
    "contourpy",
    "h5py",
    "jinja2",
    "matplotlib.backends.backend_agg",
    "matplotlib.backends.backend_svg",
    "matplotlib.figure",
    "numpy",
    "optuna",
    "pandas",
    "pyarrow.compute",
    "pyarrow.parquet",
    "rich.progress",
    "scipy.integrate",
    "scipy.spatial",
    "scipy.stats",
    "sklearn.gaussian_process",
    "vtkmodules.vtkRenderingOpenGL2",
)


class Warm:
    """run(words, folder, environment, timeout) is what subprocess.run is with capture_output and text, of
    `python -m milltools WORDS`; its standard input is empty. Threads may call it at once."""

    def __init__(self, path):
        self.channel, far = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        with far:
            self.process = subprocess.Popen(
                [sys.executable, __file__, str(far.fileno())],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                env={**os.environ, "PYTHONPATH": str(path)},
                pass_fds=[far.fileno()],
            )
        atexit.register(self.close)

    def close(self):
        self.channel.close()
        self.process.kill()  # a fork of this process may hold the channel open
        self.process.wait()

    def run(self, words, folder, environment, timeout):
        call = json.dumps({"words": words, "folder": str(folder), "environment": environment})
        with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
            answer, far = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
            with answer:
                with far:
                    files = [file.fileno() for file in (out, err, far)]
                    socket.send_fds(self.channel, [call.encode()], files)
                pid = int(answer.recv(100))
                answer.settimeout(timeout)
                try:
                    status = int(answer.recv(100))
                except TimeoutError:
                    os.kill(pid, signal.SIGKILL)
                    raise subprocess.TimeoutExpired(words, timeout) from None
            texts = []
            for file in (out, err):
                file.seek(0)
                texts.append(file.read().decode(errors="replace").replace("\r\n", "\n"))
        return subprocess.CompletedProcess(words, status, *texts)


def next_call(channel):
    """The next call and its two files, in a process of its own. Does not return in the process that has loaded the
    libraries, which tells the caller how the call ended."""
    calls = {}  # process and caller by what select() waits for
    while True:
        for ready in select.select([channel, *calls], [], [])[0]:
            if ready is not channel:
                pid, caller = calls.pop(ready)
                status = os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])
                with caller, contextlib.suppress(OSError):  # the caller may have given up
                    caller.send(str(status).encode())
                os.close(ready)
                continue
            message, files, *_ = socket.recv_fds(channel, 1 << 20, 3)
            if not message:
                sys.exit()
            caller = socket.socket(fileno=files.pop())
            pid = os.fork()
            if not pid:
                for end in (channel, caller, *(other for _, other in calls.values())):
                    end.close()
                for number in calls:
                    os.close(number)
                return json.loads(message), files
            caller.send(str(pid).encode())
            calls[os.pidfd_open(pid)] = pid, caller
            for file in files:
                os.close(file)


if __name__ == "__main__":
    for name in LIBRARIES:
        with contextlib.suppress(ImportError):
            importlib.import_module(name)
    call, files = next_call(socket.socket(fileno=int(sys.argv[1])))
    for file, place in zip(files, (1, 2), strict=True):
        os.dup2(file, place)
        os.close(file)
    os.chdir(call["folder"])
    os.environ.clear()
    os.environ.update(call["environment"])
    tempfile.tempdir = None
    sys.path[0] = str(pathlib.Path.cwd())
    sys.argv[1:] = call["words"]
    status = 1
    try:
        runpy.run_module("milltools", run_name="__main__", alter_sys=True)
    except SystemExit as left:
        status = left.code
    except BaseException:
        traceback.print_exc()
    # an interpreter that ends takes its libraries apart, which takes longer than most calls
    atexit._run_exitfuncs()
    sys.stdout.flush()
    os._exit(status or 0)
