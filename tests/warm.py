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
    "ezdxf.recover",
    "h5py",
    "jinja2",
    "manifold3d",
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
    "xarray",
)


class Warm:
    """The process that `mill` is forked from, one for all processes of pytest: the first one opens it and tells the
    others, which are its children, by an environment variable. It loads the libraries at the first call.

    run(words, folder, environment, timeout) is what subprocess.run is with capture_output and text, of
    `python -m milltools WORDS`; its standard input is empty. Threads may call it at once. `used` is the processor time
    [s] of all calls of this process so far."""

    PLACE = "MILL_WARM"
    used = 0.0

    @classmethod
    def open(cls, path):
        """Starts the process, which ends with this one, and returns it; `path`: where it finds milltools."""
        place = pathlib.Path(tempfile.mkdtemp()) / "calls"
        calls, (end, cls.held) = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM), os.pipe()
        calls.bind(str(place))
        process = subprocess.Popen(
            [sys.executable, __file__, str(calls.fileno()), str(end)],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            env={**os.environ, "PYTHONPATH": str(path)},
            pass_fds=[calls.fileno(), end],
        )
        calls.close()
        os.close(end)
        os.environ[cls.PLACE] = str(place)
        atexit.register(cls.close, process, place)
        return process

    @staticmethod
    def close(process, place):
        process.kill()
        process.wait()
        place.unlink(missing_ok=True)
        place.parent.rmdir()

    @classmethod
    def run(cls, words, folder, environment, timeout):
        call = json.dumps({"words": words, "folder": str(folder), "environment": environment})
        with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
            answer, far = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
            with answer:
                with far, socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as calls:
                    calls.connect(os.environ[cls.PLACE])
                    socket.send_fds(calls, [call.encode()], [file.fileno() for file in (out, err, far)])
                pid = int(answer.recv(100))
                answer.settimeout(timeout)
                try:
                    status, cost = answer.recv(100).decode().split()
                except TimeoutError:
                    os.kill(pid, signal.SIGKILL)
                    raise subprocess.TimeoutExpired(words, timeout) from None
            texts = []
            for file in (out, err):
                file.seek(0)
                texts.append(file.read().decode(errors="replace").replace("\r\n", "\n"))
        cls.used += float(cost)
        return subprocess.CompletedProcess(words, int(status), *texts)


def load():
    """Loads the libraries that are installed."""
    for name in LIBRARIES:
        with contextlib.suppress(ImportError):
            importlib.import_module(name)


def next_call(calls, end):
    """The next call and its two files, in a process of its own. Does not return in the process that has loaded the
    libraries, which tells the caller how the call ended, and ends when the other side of `end` is closed."""
    under_way, loaded = {}, False  # process and caller by what select() waits for
    while True:
        for ready in select.select([calls, end, *under_way], [], [])[0]:
            if ready is end:
                sys.exit()
            if ready is not calls:
                pid, caller = under_way.pop(ready)
                _, status, cost = os.wait4(pid, 0)
                with caller, contextlib.suppress(OSError):  # the caller may have given up
                    caller.send(f"{os.waitstatus_to_exitcode(status)} {cost.ru_utime + cost.ru_stime}".encode())
                os.close(ready)
                continue
            message, files, *_ = socket.recv_fds(calls, 1 << 20, 3)
            if not loaded:
                loaded = load() is None
            caller = socket.socket(fileno=files.pop())
            pid = os.fork()
            if not pid:
                for other in (calls, caller, *(one for _, one in under_way.values())):
                    other.close()
                for number in (end, *under_way):
                    os.close(number)
                return json.loads(message), files
            caller.send(str(pid).encode())
            under_way[os.pidfd_open(pid)] = pid, caller
            for file in files:
                os.close(file)


if __name__ == "__main__":
    call, files = next_call(socket.socket(fileno=int(sys.argv[1])), int(sys.argv[2]))
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
