"""Numbers must read right: prefix, digits, and never rounded across a threshold."""

import math

import pytest

from comparison.formatting import NO_BREAK, percent, quantity

QUANTITIES = {
    (5.2e-7, "m"): "520 nm",
    (9.999e-7, "m"): "1.00 µm",
    (0.0234, "m/s^2"): "23.4 mm/s²",
    (29_184.0, "rad/s²"): "29200 rad/s²",
    (1.5e-13, "m"): "1.50·10⁻¹³ m",
    (1.23e-3, "1"): "0.00123",
    (-1e5, "1"): "−1.00·10⁵",
    (0.0, "m"): "0 m",
    (math.nan, "m"): "n/a",
    (math.inf, "m"): "∞ m",
}
# Rounded to the bad side
SHARES = {1.0: "100 %", 0.999999: "99.99 %", 0.989999: "98.99 %", 0.29: "29.00 %", 0.0: "0.00 %"}


@pytest.mark.parametrize(
    ("shown", "text"),
    [(quantity(*given), text) for given, text in QUANTITIES.items()]
    + [(percent(share), text) for share, text in SHARES.items()]
    + [(percent(math.nan), "n/a"), (percent(0.664, 0.003), "66.40 ± 0.3 %")],
)
def test_numbers_as_they_are_shown(shown, text):
    assert shown == text.replace(" ", NO_BREAK)
