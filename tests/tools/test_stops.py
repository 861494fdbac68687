"""Ending in order: an end that is asked for comes, whatever Python does when it is."""

import signal
import time

import pytest

from milltools.base.processes import Stopped, stops_in_order


class Finalizer:
    """Is asked to end while it is finalized: what is raised there Python drops."""

    def __init__(self, number):
        self.number = number

    def __del__(self):
        signal.raise_signal(self.number)


@pytest.mark.parametrize("number, end", [(signal.SIGINT, KeyboardInterrupt), (signal.SIGTERM, Stopped)])
def test_a_signal_that_comes_in_a_finalizer_is_not_lost(number, end):
    with pytest.raises(end), stops_in_order():
        Finalizer(number)
        time.sleep(5)
        pytest.fail("went on")
