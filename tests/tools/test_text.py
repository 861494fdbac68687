"""Numbers as pages show them."""

import pytest

from milltools.base import progress, text


@pytest.mark.parametrize(
    "number, shown",
    [
        (text.scaled(-0.00123, "W"), "−1.230 mW"),
        (text.with_error(-8.2, 0.1, "N m"), "−8.200 ± 0.100 N m"),
        (text.small(-1.5e-15), "−1.5 × 10⁻¹⁵"),
        (text.share(-0.021), "−2.1 %"),
    ],
)
def test_what_is_below_zero_has_a_true_minus_and_its_value(number, shown):
    assert str(number).replace(text.SPACE, " ").replace(text.THIN, " ") == shown
    assert number.value < 0


@pytest.mark.parametrize(
    "value, error, shown",
    [
        (862.49, 8.72, "862 ± 9 W"),
        (862.49, 12.96, "862 ± 13 W"),
        (0.8625, 0.0096, "862 ± 10 mW"),
        (93904.0, 1410.0, "93.9 ± 1.4 kW"),
        (862.49, float("nan"), "862 W"),
        (1.0, 3.0, "1 ± 3 W"),
        (0.0, 0.0, "0 W"),
    ],
)
def test_a_brief_number_has_the_digits_that_its_error_leaves(value, error, shown):
    found = text.brief(value, error, "W")
    assert str(found).replace(text.SPACE, " ") == shown and found.value == value


@pytest.mark.parametrize(
    "number, shown",
    [
        (text.with_error(0.04954, 0.00112, "/s"), "0.04954 ± 0.00112 /s"),
        (text.with_error(0.2846, 0.0448, "/J"), "0.2846 ± 0.0448 /J"),
        (text.with_error(4.954e-5, 1.12e-6, "/s"), "4.954 ± 0.112 × 10⁻⁵ /s"),
        (text.with_error(93904, 1410, "1/s"), "93.90 ± 1.41 thousand/s"),
        (text.brief(0.2846, 0.0448, ""), "0.28 ± 0.04"),
        (text.brief(0.2846, 0.0448, "%"), "0.28 ± 0.04 %"),
        (text.scaled(2.5e6, "/J"), "2.500 million/J"),
        (text.scaled(2.5e6, ""), "2.500 million"),
        (text.column([0.5, 0.25], "/s")[1], "0.2500 /s"),
        (text.quantity(0.002, "/s"), "0.002 /s"),
    ],
)
def test_a_number_without_a_unit_of_its_own_has_no_letter_that_reads_as_one(number, shown):
    assert str(number).replace(text.SPACE, " ").replace(text.THIN, " ") == shown


def test_a_column_has_one_unit_and_small_numbers_do_not_vanish():
    shown = [str(one).replace(text.SPACE, " ") for one in text.column([570.2, 40.63, 9e-4, 0.0, float("nan")], "W")]
    assert shown == ["570.2 W", "40.6 W", "< 0.1 W", "0.0 W", text.MISSING]


def test_uneven_steps_show_what_is_done_but_promise_no_time(capsys, monkeypatch):
    monkeypatch.setattr(progress, "PATIENCE", -1.0)
    monkeypatch.setattr(progress, "PLAIN", 0.0)
    with progress.Progress("mill x", 4) as watch:
        with watch.step("pictures"):
            pass
        watch(1, "the balls")
    assert capsys.readouterr().err.splitlines() == [
        "mill x: pictures, 0 %",
        "mill x: pictures, 25 %",
        "mill x: the balls, 25 %",
    ]
    with progress.Progress("mill x", 4) as watch:
        watch(1, "rows")
    assert capsys.readouterr().err.endswith(" left\n")
