"""Are the marks of the tests true? With `--marks`, a test marked `slow` that needs less than CHEAP seconds of processor
time fails, and an unmarked one that needs more than DEAR. Counted: this process, the programs that it started and has
waited for, and the forks of `mill`; not counted: fixtures that several tests share. The seconds are those of a machine
that does `work` in UNIT: a slow or busy machine changes nothing. `--costs=FILE` also writes the
seconds of every test and shared fixture."""

import resource
import time

import pytest
from warm import Warm, load

CHEAP, DEAR = 0.3, 0.5
UNIT = 0.0186  # [s]
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
    def __init__(self, path):
        self.path, self.shared = path, 0.0
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
        has = [name for name in MARKS if item.get_closest_marker(name)]
        if has == ["slow"] or cost > DEAR / 2 or self.path:  # else cheap on any machine
            cost *= UNIT / min(work(), work())
        self.write(cost, item.nodeid)
        if has == ["slow"] and cost < CHEAP:
            pytest.fail(f"marked slow, needs {cost:.2f} s of processor time: below {CHEAP} s", pytrace=False)
        if not has and cost > DEAR:
            pytest.fail(f"not marked slow, needs {cost:.2f} s of processor time: above {DEAR} s", pytrace=False)
        return answer
