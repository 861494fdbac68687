"""Are the marks of the tests true? With `--marks`, a test marked `slow` that needs less than CHEAP seconds of processor
time fails, and an unmarked one that needs more than DEAR, three times out of three: a machine that others use is not
always as fast. Counted: this process, the programs that it started and has waited for, and the forks of `mill`; not
counted: fixtures that several tests share. What needs one of the fixtures SHARED is slow for it, without a mark. The
seconds are those of a machine that does `work` in UNIT. `--costs=FILE` writes the seconds of every test and shared
fixture. With these limits `make check` leaves out the twentieth of its cases that took a third of its time."""

import resource
import time

import pytest
from _pytest.runner import runtestprotocol
from warm import Warm, load

CHEAP, DEAR = 0.15, 0.3
UNIT = 0.0186  # [s]
SHARED = {"compared", "page"}  # fixtures that take seconds
MARKS = ("slow", "thorough", "browser", "slurm", "dem", "render")  # none of these is in `make check`


def used():
    """Processor time [s] so far."""
    children = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.process_time() + children.ru_utime + children.ru_stime + Warm.used


def work():
    """Processor time [s] of a fixed piece of work, which tells how fast the machine is now."""
    begin, words = time.process_time(), {}
    for k in range(60000):
        words[f"{k % 1000:05d}"] = words.get(k, 0.0) + k**0.5
    return time.process_time() - begin


class Costs:
    def __init__(self, checks, path):
        self.checks, self.path, self.shared, self.wrong = checks, path, 0.0, None
        load()  # or the first test that needs a library would pay for it

    @pytest.hookimpl(wrapper=True)
    def pytest_fixture_setup(self, fixturedef):
        begin, inside = used(), self.shared
        try:
            return (yield)
        finally:
            if fixturedef.scope != "function":
                self.write(used() - begin - self.shared + inside, f"{fixturedef.argname} of {fixturedef.baseid}")
                self.shared = inside + used() - begin

    def write(self, cost, name):
        if self.path:
            with open(self.path, "a") as file:
                file.write(f"{cost:.3f} {name}\n")

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_setup(self, item):
        self.shared, item.began = 0.0, used()
        return (yield)

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_call(self, item):
        answer = yield
        cost = used() - item.began - self.shared
        if cost > CHEAP / 3:  # else cheap on any machine
            cost *= UNIT / min(work(), work())
        self.write(cost, item.nodeid)
        has = [name for name in MARKS if item.get_closest_marker(name)]
        if has == ["slow"] and cost < CHEAP and not SHARED & set(item.fixturenames):
            self.wrong = f"marked slow, needs {cost:.2f} s of processor time: below {CHEAP} s"
        if not has and cost > DEAR:
            self.wrong = f"not marked slow, needs {cost:.2f} s of processor time: above {DEAR} s"
        return answer

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtest_protocol(self, item, nextitem):
        item.ihook.pytest_runtest_logstart(nodeid=item.nodeid, location=item.location)
        for _ in range(3):
            self.wrong = None
            reports = runtestprotocol(item, nextitem=nextitem, log=False)
            if not self.wrong or not self.checks:
                break
        else:
            reports[1].outcome, reports[1].longrepr = "failed", self.wrong
        for report in reports:
            item.ihook.pytest_runtest_logreport(report=report)
        item.ihook.pytest_runtest_logfinish(nodeid=item.nodeid, location=item.location)
        return True
