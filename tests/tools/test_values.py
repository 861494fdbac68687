"""Values of options, as the engine reads them."""

import pytest

from milltools.base.errors import UserError
from milltools.read import values


def test_times_and_lengths_are_read_as_in_a_deck_and_plain_numbers_are_si():
    assert values.seconds({"--time": "5 ns", "--from": None, "--to": "2 min", "--at": " 0.1 "}) == [
        5e-9,
        None,
        120.0,
        0.1,
    ]
    assert values.seconds({"--offset": "-5 ms"}, negative=True) == [-5e-3]
    assert values.metres({"--scale": "0.1 mm", "--other": "3 um"}) == [1e-4, 3e-6]


@pytest.mark.parametrize("text", ["", "soon", "5 m", "-3 ms", "-0.1", "nan", "inf s", "1 2 ms"])
def test_a_wrong_time_names_its_option_and_not_another(text):
    with pytest.raises(UserError) as fault:
        values.seconds({"--to": "1 ms", "--from": text})
    words = "must be 0 or more" if text.startswith("-") else "expected a time such as '120 ms'"
    assert str(fault.value) == f"--from: {words}, got '{text}'"


def test_values_are_told_by_one_call_of_the_engine(monkeypatch):
    calls, tell = [], values.tell
    monkeypatch.setattr(values, "tell", lambda orders: calls.append(1) or tell(orders))
    values.seconds({"--from": "1 ms", "--to": "2 ms"})
    assert len(calls) == 1
