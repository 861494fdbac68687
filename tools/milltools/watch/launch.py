"""The run that `mill watch DECK` starts."""

import contextlib
import json
import signal
import subprocess
import sys
import threading

from milltools.base import engine, processes
from milltools.base.errors import UserError

PATIENCE = 120.0  # [s] for an interrupted run to write its results


class Child:
    """millsim with the options `words`. `live`: its last line of --progress=json (docs/running.md); None before the
    first one. Its other lines go to standard error, its summary to standard output."""

    def __init__(self, words: list[str]):
        self.live, self.said, self.begun = None, [], False
        # TERM: if this process is killed, the run saves its results
        command = [*processes.guard("TERM"), engine.program().absolute(), "--progress=json", *words]
        try:
            self.process = subprocess.Popen(
                command, stdin=subprocess.DEVNULL, stdout=sys.stdout, stderr=subprocess.PIPE, encoding="utf-8",
                errors="replace", start_new_session=True,  # this process passes on a Ctrl-C
            )  # fmt: skip
        except OSError as fault:
            raise UserError(f"{command[-1]}: {fault.strerror}", status=1) from None
        self.reader = threading.Thread(target=self._read, daemon=True)
        self.reader.start()

    def _read(self):
        for line in self.process.stderr:
            if line.startswith("{"):
                with contextlib.suppress(ValueError):
                    self.live = json.loads(line)
            else:
                self.said.append(line)
                print(line, end="", file=sys.stderr, flush=True)

    @property
    def alive(self) -> bool:
        return self.process.poll() is None

    @property
    def status(self) -> int | None:
        """The exit status; None while it runs."""
        return self.process.poll()

    @property
    def complaints(self) -> list[str]:
        """The messages with which it ended."""
        self.reader.join(1.0)
        if self.status is not None and self.status < 0:
            return [f"millsim was ended by signal {-self.status}; '{engine.MILLSIM} --resume' with this deck goes on"]
        return engine.complaints(self.status or 0, "".join(self.said))

    def end(self):
        """Ends the run so that it saves its results, or at once after a second interrupt or a long wait."""
        try:
            if self.alive:
                self.process.send_signal(signal.SIGINT)
            with contextlib.suppress(subprocess.TimeoutExpired):
                self.process.wait(PATIENCE)
        finally:
            self.process.kill()  # no effect if it has ended
            self.process.wait()
            self.reader.join(1.0)
