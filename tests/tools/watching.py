"""What tests of `mill watch` share; watched.py has their fixtures."""

import base64
import time

import numpy as np
from conftest import SLOWER

KINDS = {"f4": "<f4", "f8": "<f8", "u4": "<u4", "u1": "u1"}
ENDLESS = ("-s", "run.time=10000 s", "-s", "output.frames=1 s", "-s", "output.series=1 s")
OFTEN = ("-s", "output.checkpoint=0.2 s")


def decoded(value):
    """A value of the server's JSON with its arrays as numpy arrays."""
    if isinstance(value, list):
        return [decoded(one) for one in value]
    if isinstance(value, dict):
        if len(value) == 1 and (kind := next(iter(value))) in KINDS:
            return np.frombuffer(base64.b64decode(value[kind], validate=True), KINDS[kind])
        return {name: decoded(one) for name, one in value.items()}
    return value


def until(true, seconds=120.0):
    """Waits until a function is true; returns its value."""
    end = time.monotonic() + seconds * SLOWER
    while not (found := true()):
        assert time.monotonic() < end, "never came true"
        time.sleep(0.05)
    return found


def messages(answer, kind):
    return [message for message in answer["news"] if message["type"] == kind]
