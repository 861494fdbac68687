"""Numbers as pages show them."""

import pytest

from milltools.base import text


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
